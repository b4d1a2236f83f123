//! The worker's side: `suture worker`, started by the supervisor, never by hand. It takes requests until its input ends.

use std::io::{self, BufRead, Write};
use std::sync::Mutex;
use std::time::{Duration, Instant};

use suture_core::report::Task;
use suture_core::{Access, Error, ErrorClass, Progress, Report};

use crate::beside;
use crate::cli::WorkerArgs;
use crate::confine;
use crate::create;
use crate::fsx::Identity;
use crate::protocol::{Message, Request};
use crate::units::show_size;

/// Progress is told at most this often, and at the beginning of a stage.
const PROGRESS_EVERY: Duration = Duration::from_millis(100);
/// Work that is done sooner says nothing.
const FIRST_AFTER: Duration = Duration::from_millis(100);

/// Answers requests until standard input ends.
///
/// # Errors
/// When the supervisor is gone, or speaks another protocol.
pub(crate) fn serve(args: &WorkerArgs) -> io::Result<()> {
    orphan::listen()?;
    confine::bind(args)?;
    confine::confine(args, &[]);
    name_want_of_memory();
    let mut files = confine::Files::inherited();
    for line in io::stdin().lock().lines() {
        let request: Request = serde_json::from_str(&line?)?;
        say(&Message::Begun)?;
        orphan::work_begins(request.witness.as_deref());
        // The peak of this file, not of the process's life; a kernel that refuses leaves the report with the latter.
        let _ = create::tell_kernel("clear_refs", "5");
        let answer = answer(&request, &mut files);
        orphan::work_begins(None);
        if let Some(witness) = &request.witness {
            // Not synced: a machine that goes down takes this word with it, and the file stays a suspect.
            let _ = create::mark(witness);
        }
        say(&answer)?;
    }
    Ok(())
}

/// Libraries that panic for want of memory are made to end as the standard library does: by an abort whose line the supervisor knows.
fn name_want_of_memory() {
    let usual = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        if panic.location().is_some_and(|place| is_of_allocation(place.file())) {
            // How much it wanted is not said.
            std::alloc::handle_alloc_error(std::alloc::Layout::new::<u8>());
        }
        usual(panic);
    }));
}

/// Is this the source file in which `bytemuck`, which `obvhs` gets its tables from, unwraps what it allocates?
fn is_of_allocation(source: &str) -> bool {
    source.ends_with("allocation.rs") && source.contains("bytemuck")
}

fn say(message: &Message) -> io::Result<()> {
    let mut line = serde_json::to_vec(message)?;
    line.push(b'\n');
    let mut out = io::stdout().lock();
    out.write_all(&line)?;
    out.flush()
}

fn answer(request: &Request, files: &mut confine::Files) -> Message {
    #[cfg(feature = "crash-points")]
    hook::act(request);
    let length = std::fs::metadata(&request.input).map_or(0, |meta| meta.len());
    let wanted = confine::file_bound(length, request.limits.memory_bytes);
    let most = files.bound(wanted);
    let worked = work(request);
    #[cfg(feature = "crash-points")]
    let worked = worked.map(|report| hook::spoil(request, report));
    match worked {
        Ok(report) => {
            let output = request.output.as_deref().filter(|_| report.output.is_some());
            let written = output.and_then(|path| std::fs::metadata(path).ok()).map(|meta| Identity::from(&meta));
            Message::Done { report: Box::new(report), written }
        }
        Err(error) if is_too_large(&error) => too_large(&named(&error, request), wanted, most),
        Err(error) => Message::Failed { class: error.class(), message: named(&error, request) },
    }
}

/// Would a file have grown beyond what is allowed, here or by its file system?
fn is_too_large(error: &Error) -> bool {
    matches!(error, Error::Io { source, .. } if source.kind() == io::ErrorKind::FileTooLarge)
}

/// The answer then. `wanted` bytes are what the work can need; less than that is someone's limit for all of us, which they may raise.
fn too_large(line: &str, wanted: u64, most: u64) -> Message {
    let size = show_size(most);
    if most < wanted {
        let message = format!("{line}; the limit of the size of files is {size} here: raise it (`ulimit -f`)");
        return Message::Failed { class: ErrorClass::Environment, message };
    }
    // Another try would write as much.
    let message = format!("{line}; no file of this work may have more than {size}, and its file system may allow less");
    Message::Failed { class: ErrorClass::Refused, message }
}

/// The error's line, with the file's own name instead of the claimed or temporary one.
fn named(error: &Error, request: &Request) -> String {
    let mut line = error.to_string();
    line = line.replace(&*request.input.display().to_string(), &request.shown_input);
    if let (Some(output), Some(shown)) = (&request.output, &request.shown_output) {
        line = line.replace(&*output.display().to_string(), shown);
    }
    line
}

fn work(request: &Request) -> suture_core::error::Result<Report> {
    let start = Instant::now();
    let teller = Teller { start, last: Mutex::new((start, "")) };
    let Request { input, profile, .. } = request;
    // SAFETY: this process does nothing else than this work. If someone truncates the file, SIGBUS ends it, and the supervisor tells why. If
    // someone changes it, the bytes seen are plain numbers, valid in every state, and the result is thrown away.
    let access = unsafe { Access::mapped() };
    let mut limits = request.limits.clone();
    limits.access = access;
    let limits = &limits;
    let mut own = profile.clone();
    beside::put(&request.companions, &mut own);
    let mut report = match (request.task, &request.output) {
        (Task::Repair, Some(output)) => suture_core::repair(input, output, &own, limits, &teller)?,
        _ => suture_core::inspect(input, &own, limits, &teller)?,
    };
    beside::take_back(&request.companions, profile, &mut report);
    report.input.path = request.shown_input.clone().into();
    if let (Some(facts), Some(shown)) = (&mut report.output, &request.shown_output) {
        facts.path = shown.clone().into();
    }
    // The spool folder is a temporary name too, and no one else's business.
    report.limits.spool = None;
    report.limits.defer_sync = false;
    if let Some(path) = &request.report {
        create::write_new_json(path, &report, !limits.defer_sync).map_err(|source| Error::Io {
            path: path.clone(),
            action: "writing the report",
            source,
        })?;
        report.edit_records = None;
    }
    Ok(report)
}

/// Tells the supervisor where the work stands.
struct Teller {
    start: Instant,
    /// When it last did, and of which stage.
    last: Mutex<(Instant, &'static str)>,
}

impl Progress for Teller {
    fn at(&self, stage: &'static str, done: u64, total: u64) {
        // Another thread is telling: this one has nothing newer to add.
        let Ok(mut last) = self.last.try_lock() else { return };
        let now = Instant::now();
        let news = last.1 != stage || now - last.0 >= PROGRESS_EVERY;
        if news && now - self.start >= FIRST_AFTER {
            *last = (now, stage);
            // A supervisor that is gone is noticed at the end of the work, and kills us before.
            let _ = say(&Message::Progress { stage: stage.into(), done, total });
        }
    }
}

/// The end of a worker whose supervisor died: the system sends SIGTERM then. Before it ends, it leaves a file that says that its
/// work outlived the supervisor, so that the work is not suspected of having killed it. (An operator's SIGTERM leaves the file too;
/// the supervisor, being alive, pays no attention to it.)
mod orphan {
    use std::ffi::CString;
    use std::io;
    use std::os::unix::ffi::OsStrExt;
    use std::path::Path;
    use std::ptr::null_mut;
    use std::sync::atomic::{AtomicPtr, Ordering};

    use signal_hook::consts::SIGTERM;

    /// The name to leave: from `CString::into_raw`, or null. A name is never freed while the handler might read it: it is leaked,
    /// some hundred bytes a file for a process that serves some hundred files.
    static WITNESS: AtomicPtr<std::ffi::c_char> = AtomicPtr::new(null_mut());

    pub(super) fn work_begins(witness: Option<&Path>) {
        let name = witness.and_then(|path| CString::new(path.as_os_str().as_bytes()).ok());
        WITNESS.store(name.map_or(null_mut(), CString::into_raw), Ordering::SeqCst);
    }

    pub(super) fn listen() -> io::Result<()> {
        let end = || {
            let name = WITNESS.load(Ordering::SeqCst);
            if !name.is_null() {
                // SAFETY: not null, so it came from `CString::into_raw`, ends with a NUL, and is never freed.
                let name = unsafe { std::ffi::CStr::from_ptr(name) };
                // Without the file, the work is suspected, as it would be without this handler.
                crate::create::mark_in_handler(name);
            }
            // Ends the process as the signal would have.
            let _ = signal_hook::low_level::emulate_default_handler(SIGTERM);
        };
        // SAFETY: the handler only loads an atomic, makes plain system calls (open, and those of the default action),
        // and neither allocates nor locks.
        unsafe { signal_hook::low_level::register(SIGTERM, end) }?;
        Ok(())
    }
}

/// Faults on demand, for the tests of the supervisor and of the daemon: a build with the feature `crash-points` looks for
/// `!abort!`, `!segv!`, `!flip!`, `!hang!`, `!reach!`, `!kill-parent!`, `!memory!`, `!panic!` or `!slow!` in the input's name. (The daemon looks
/// for `!kill-daemon!`: it dies of the answer.)
#[cfg(feature = "crash-points")]
mod hook {
    use std::time::Duration;

    use suture_core::Report;

    use crate::create;
    use crate::protocol::Request;

    /// As faulty memory does: some bytes of the result are others in each attempt, and nobody notices.
    pub(super) fn spoil(request: &Request, mut report: Report) -> Report {
        let Some(output) = request.output.as_deref().filter(|_| request.shown_input.contains("!flip!")) else { return report };
        let mut bytes = std::fs::read(output).unwrap_or_default();
        let noise = std::time::UNIX_EPOCH.elapsed().unwrap_or_default().as_nanos().to_le_bytes();
        // Within the head of a binary STL file.
        bytes.iter_mut().skip(40).zip(noise).for_each(|(byte, other)| *byte = other);
        let is_written = std::fs::remove_file(output).and_then(|()| create::write_new(output, &bytes)).is_ok();
        if let (true, Some(facts)) = (is_written, &mut report.output) {
            facts.blake3 = blake3::hash(&bytes).to_hex().to_string();
        }
        report
    }

    pub(super) fn act(request: &Request) {
        let name = &request.shown_input;
        if name.contains("!abort!") {
            std::process::abort();
        }
        if name.contains("!segv!") {
            // The first finds the handler that tells stack overflows, which then steps aside.
            for _ in 0..2 {
                let _ = rustix::process::kill_process(rustix::process::getpid(), rustix::process::Signal::SEGV);
            }
        }
        if name.contains("!kill-parent!")
            && let Some(parent) = rustix::process::getppid()
        {
            // It is not allowed to: the parent lives and sees it abort.
            super::orphan::work_begins(None);
            let _ = rustix::process::kill_process(parent, rustix::process::Signal::KILL);
            std::process::abort();
        }
        if name.contains("!panic!") {
            panic!("asked to by {name}");
        }
        if name.contains("!memory!") {
            let mut hog: Vec<Vec<u8>> = Vec::new();
            loop {
                hog.push(vec![1; 16 << 20]);
            }
        }
        if name.contains("!reach!") {
            // Another customer's file, beside the folder of the work, and a program.
            let inbox = request.input.ancestors().nth(4).map(|root| root.join("in").join("other.txt"));
            let is_open = std::fs::read(inbox.unwrap_or_default()).is_ok() || std::fs::read("/proc/self/exe").is_ok();
            if is_open {
                std::process::abort();
            }
        }
        if name.contains("!hang!") {
            // Something that the worker started is to go with it.
            // SAFETY: the child only sleeps, and ends without running anything of this process.
            if unsafe { libc::fork() } == 0 {
                // SAFETY: as above.
                unsafe {
                    libc::sleep(10);
                    libc::_exit(0);
                }
            }
            std::thread::sleep(Duration::from_secs(3600));
        }
        if name.contains("!slow!") {
            std::thread::sleep(Duration::from_millis(300));
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::channel;

    use super::*;

    /// What grows beyond all need fails for good; where someone's limit is in the way, that may change.
    #[test]
    fn a_file_that_grows_too_large_is_refused_unless_someone_can_raise_the_limit() {
        let told = |wanted, most| match too_large("part.stl: writing failed", wanted, most) {
            Message::Failed { class, message } => (class, message),
            other => panic!("{other:?}"),
        };
        let (class, line) = told(5_000_000, 5_000_000);
        assert!(class == ErrorClass::Refused && line.contains("no file of this work may have more than 5.0 MB"), "{line}");
        let (class, line) = told(5_000_000, 1_000_000);
        assert!(class == ErrorClass::Environment && line.contains("is 1.0 MB here: raise it (`ulimit -f`)"), "{line}");
        let io = |errno| Error::Io { path: "a".into(), action: "writing", source: io::Error::from_raw_os_error(errno) };
        assert_eq!([libc::EFBIG, libc::ENOSPC].map(|errno| is_too_large(&io(errno))), [true, false]);
    }

    /// Wherever another version of the library panics, this fails.
    #[test]
    fn a_librarys_want_of_memory_is_told_by_its_place() {
        let (said, places) = channel();
        let usual = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |panic| {
            let _ = said.send(panic.location().map(|place| place.file().to_owned()));
        }));
        // Asked for even where nobody looks at it.
        let without = std::panic::catch_unwind(|| {
            std::hint::black_box(bytemuck::allocation::zeroed_vec::<u8>(isize::MAX.unsigned_abs())).len()
        });
        std::panic::set_hook(usual);
        assert!(without.is_err());
        let places: Vec<String> = places.iter().flatten().collect();
        assert!(places.iter().any(|place| is_of_allocation(place)), "{places:?}");
        assert!(!is_of_allocation("core/src/geometry/boxes.rs"));
    }
}
