//! Pictures of meshes for pages: made by a process of its own with little memory and time, one at a time, and kept beside the job store, under a name that is made of what
//! they show. So many bytes of them are kept; the oldest go.

use std::io;
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};
use std::sync::Arc;
use std::thread::{Builder, sleep};
use std::time::{Duration, Instant};

use suture_store::{Hash, JobId};
use tokio::sync::{OwnedSemaphorePermit, oneshot};

use super::ask::ask;
use super::files::{Known, Opened, open, opened_as};
use super::problem::Problem;
use super::shared::Shared;
use crate::exit::Exit;
use crate::fsx::{self, Identity};
use crate::schedule::Hold;
use crate::supervise::room_of;

/// Bytes that a drawing may hold by its own count.
const MEMORY: u64 = 256 << 20;
const THREADS: usize = 2;
/// How long it may take, and how often its end is looked for.
const LIMIT: Duration = Duration::from_secs(180);
const LOOK_EVERY: Duration = Duration::from_millis(10);
/// How often a drawing is tried.
const TRIES: u32 = 3;
/// Bytes that are kept altogether.
const KEPT: u64 = 256 << 20;

/// What is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum What {
    /// A PNG of one mesh or two.
    Picture,
    /// The same from the opposite side.
    Behind,
    /// One mesh with few triangles.
    Mesh,
}

/// Why there is no drawing.
enum Failure {
    /// The mesh is to blame, or the limits.
    Never,
    /// Something else; trying again may help.
    NotNow,
}

/// The drawing of these files of a job; and its name, which no other drawing has.
///
/// # Errors
/// When a file is not in its place, cannot be drawn within the limits, or others draw.
pub(super) async fn drawing(shared: &Shared, id: JobId, what: What, of: &[Known]) -> Result<(Opened, String), Problem> {
    let folder = shared.context.settings.now().state.with_file_name("pictures");
    let name = name(what, of);
    let path = folder.join(&name);
    if let Some(kept) = kept(shared, &path).await? {
        return Ok((kept, name));
    }
    if shared.drawings.is_impossible(&name) {
        return Err(never());
    }
    if shared.context.schedule.held(Hold::Disk).is_some() {
        return Err(Problem::unavailable("there is no room for pictures for now; what is done of files comes first"));
    }
    let seat = shared.drawings.turn().await?;
    // Whoever had the seat may have made this one.
    if let Some(kept) = kept(shared, &path).await? {
        return Ok((kept, name));
    }
    let mut found = Vec::new();
    for known in of {
        found.push((known.path.clone(), opened_as(shared, id, known.clone()).await?.found));
    }
    let (tell, told) = oneshot::channel();
    let task = Task { what, found, path: path.clone(), _seat: seat };
    let (drawings, key) = (Arc::clone(&shared.drawings), name.clone());
    let work = move || {
        let done = task.run();
        if matches!(done, Err(Failure::Never)) {
            drawings.set_impossible(key);
        }
        // The client may have gone.
        let _ = tell.send(done);
    };
    // A thread of its own: the system ends the process with the thread that started it.
    let begun = Builder::new().name("drawing".into()).spawn(work);
    let failure = || Problem::unavailable("no picture can be made for now; try again");
    begun.map_err(|_| failure())?;
    match told.await.map_err(|_| failure())? {
        Ok(()) => Ok((kept(shared, &path).await?.ok_or_else(failure)?, name)),
        Err(Failure::NotNow) => Err(failure()),
        Err(Failure::Never) => Err(never()),
    }
}

fn never() -> Problem {
    Problem::missing("no picture can be made of this mesh: it holds nothing to draw, or needs too much time or memory")
}

/// Its name: of the same bytes, drawn by the same program, it is the same.
fn name(what: What, of: &[Known]) -> String {
    let mut hasher = blake3::Hasher::new();
    hasher.update(env!("CARGO_PKG_VERSION").as_bytes());
    for known in of {
        hasher.update(&known.hash.0);
    }
    let ending = match what {
        What::Picture => "png",
        What::Behind => "behind.png",
        What::Mesh => "mesh",
    };
    format!("{}.{ending}", &hasher.finalize().to_hex()[..32])
}

async fn kept(shared: &Shared, path: &Path) -> Result<Option<Opened>, Problem> {
    let path = path.to_path_buf();
    ask(&shared.context, move |_| {
        let there = fsx::is_file(&path).map_err(|_| Problem::unavailable("the pictures cannot be read; try again"))?;
        there.then(|| open(path, Hash([0; 32]))).transpose()
    })
    .await
}

/// A drawing that is to be made.
struct Task {
    what: What,
    found: Vec<(PathBuf, Identity)>,
    path: PathBuf,
    _seat: OwnedSemaphorePermit,
}

impl Task {
    fn run(&self) -> Result<(), Failure> {
        let folder = fsx::folder_of(&self.path);
        let made = std::fs::create_dir_all(folder).and_then(|()| self.drawn());
        let status = made.map_err(|error| {
            tracing::warn!(%error, "No picture can be made.");
            Failure::NotNow
        })?;
        let is_same = |(path, found): &(PathBuf, Identity)| Identity::of(path).is_ok_and(|now| now.same_content(found));
        match status.map(|status| (status.code(), status.signal())) {
            Some((Some(0), _)) if self.found.iter().all(is_same) => {
                prune(folder);
                Ok(())
            }
            Some((Some(0), _)) => {
                // It may show something else.
                let _ = fsx::remove_if_there(&self.path);
                Err(Failure::NotNow)
            }
            Some((Some(code), _)) if [Exit::Cut, Exit::TryAgain].map(|exit| i32::from(exit.code())).contains(&code) => {
                Err(Failure::NotNow)
            }
            // Someone killed it.
            Some((_, Some(9 | 15))) => Err(Failure::NotNow),
            ended => {
                tracing::info!(?ended, file = %self.path.display(), "No picture can be made of a mesh.");
                Err(Failure::Never)
            }
        }
    }

    /// Draws until a process does not want to be tried again. The original of a job that has just ended loses a second name in the work folder, which looks as
    /// if it had changed.
    fn drawn(&self) -> io::Result<Option<ExitStatus>> {
        for _ in 1..TRIES {
            let status = self.draw()?;
            if status.and_then(|status| status.code()) != Some(Exit::TryAgain.code().into()) {
                return Ok(status);
            }
        }
        self.draw()
    }

    /// How the process ended; `None`: it took too long.
    fn draw(&self) -> io::Result<Option<ExitStatus>> {
        let mut command = Command::new("/proc/self/exe");
        // A text file becomes records in a file without a name, which is to lie where there is room.
        command.arg0("suture").arg("draw").env("RUST_BACKTRACE", "0").env("TMPDIR", fsx::folder_of(&self.path));
        command.args(["--parent", &std::process::id().to_string(), "--data", &room_of(MEMORY, THREADS).to_string()]);
        command.arg("--within").arg(fsx::folder_of(&self.path));
        command.args(["--memory", &MEMORY.to_string(), "--threads", &THREADS.to_string()]);
        match self.what {
            What::Picture => {}
            What::Behind => drop(command.arg("--behind")),
            What::Mesh => drop(command.arg("--coarse")),
        }
        command.arg("--output").arg(&self.path).arg("--").args(self.found.iter().map(|(path, _)| path));
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).process_group(0);
        let mut child = command.spawn()?;
        let began = Instant::now();
        loop {
            match child.try_wait() {
                Ok(Some(status)) => return Ok(Some(status)),
                Ok(None) if began.elapsed() < LIMIT => sleep(LOOK_EVERY),
                late => {
                    // Gone already: nothing to kill.
                    let _ = child.kill();
                    let _ = child.wait();
                    return late.map(|_| None);
                }
            }
        }
    }
}

/// Removes the oldest where there is too much; what a drawing that was ended left goes in its turn.
fn prune(folder: &Path) {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut all: Vec<_> = entries
        .filter_map(|entry| {
            let meta = entry.metadata().ok().filter(std::fs::Metadata::is_file)?;
            Some((meta.modified().ok()?, meta.len(), entry.path()))
        })
        .collect();
    all.sort_unstable();
    let mut total: u64 = all.iter().map(|(_, size, _)| size).sum();
    for (_, size, path) in all {
        if total <= KEPT {
            break;
        }
        total -= size;
        if let Err(error) = fsx::remove_if_there(&path) {
            tracing::warn!(%error, "An old picture cannot be removed.");
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use super::*;
    use crate::web::verified::Which;

    #[test]
    fn a_name_tells_what_is_shown() {
        let known = |byte: u8| Known { which: Which::Result, path: PathBuf::new(), hash: Hash([byte; 32]) };
        let names = [
            name(What::Picture, &[known(1)]),
            name(What::Mesh, &[known(1)]),
            name(What::Picture, &[known(2)]),
            name(What::Picture, &[known(1), known(2)]),
            name(What::Picture, &[known(2), known(1)]),
        ];
        assert_eq!(names.iter().collect::<HashSet<_>>().len(), names.len());
        assert_eq!(names[0], name(What::Picture, &[Known { path: "elsewhere".into(), ..known(1) }]));
    }

    #[test]
    fn the_oldest_pictures_go() {
        let dir = tempfile::tempdir().unwrap();
        let put = |name: &str, size: u64, age: u64| {
            let file = std::fs::File::create(dir.path().join(name)).unwrap();
            file.set_len(size).unwrap();
            file.set_modified(std::time::SystemTime::UNIX_EPOCH + Duration::from_secs(1000 - age)).unwrap();
        };
        put("old.png", KEPT / 2, 3);
        put("older.tmp", KEPT / 2, 4);
        put("new.png", KEPT / 2, 1);
        put("newer.png", 1, 0);
        prune(dir.path());
        let mut left: Vec<_> = std::fs::read_dir(dir.path()).unwrap().map(|entry| entry.unwrap().file_name()).collect();
        left.sort_unstable();
        assert_eq!(left, ["new.png", "newer.png"]);
    }
}
