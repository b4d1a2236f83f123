//! The command of `[on_done]`: a program with its arguments, without a shell between, in a process group of its own, which ends at its time limit with
//! all that it has started.

use std::collections::VecDeque;
use std::ffi::{OsStr, OsString};
use std::io::{self, PipeReader, Read};
use std::os::unix::ffi::{OsStrExt, OsStringExt};
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::PathBuf;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::process::{Pid, Signal, kill_process_group};

use super::end::End;
use super::pace::Outcome;
use crate::config::events::{OnDone, When, placeholders};
use crate::say::plain;
use crate::world::World;

/// How often a wait looks whether it is over.
const LOOK_EVERY: Duration = Duration::from_millis(50);
/// So much of what it says is kept, from its end.
const KEPT: usize = 2048;
/// Exit status of a program that wants to be tried again.
const TRY_AGAIN: i32 = 75;
/// What a service manager tells the daemon, and nobody else.
const FOR_THE_DAEMON: [&str; 5] = ["NOTIFY_SOCKET", "WATCHDOG_USEC", "WATCHDOG_PID", "LISTEN_FDS", "LISTEN_PID"];

/// Runs it once, if it is to be run of this.
pub(super) fn run(on_done: &OnDone, end: &End<'_>, world: &dyn World, is_cut: &dyn Fn() -> bool) -> Outcome {
    if on_done.when == When::Certified
        && let Err(why) = end.holds()
    {
        return Outcome::Delivered { note: format!("it is not run: {why}") };
    }
    let (mut child, mut said) = match start(on_done, end) {
        Ok(started) => started,
        Err(error) => return Outcome::Again { why: format!("it cannot be started: {error}"), after: None },
    };
    let began = world.steady();
    let is_late = || world.steady().duration_since(began) >= on_done.time_limit;
    let ended = attend(&mut child, &mut said, &|| is_cut() || is_late());
    let words = said.words();
    match ended {
        Ok(Some(status)) if status.success() => Outcome::Delivered { note: words },
        Ok(Some(status)) if status.code() == Some(TRY_AGAIN) => {
            Outcome::Again { why: told("it wants to be tried again", &words), after: None }
        }
        Ok(Some(status)) => Outcome::Never { why: told(&how(status), &words) },
        Ok(None) if is_cut() => Outcome::Cut,
        Ok(None) => Outcome::Never { why: told("it was ended at its time limit", &words) },
        Err(error) => Outcome::Again { why: format!("it cannot be waited for: {error}"), after: None },
    }
}

fn told(how: &str, words: &str) -> String {
    if words.is_empty() { how.to_owned() } else { format!("{how}: {words}") }
}

fn how(status: ExitStatus) -> String {
    match (status.code(), status.signal()) {
        (Some(code), _) => format!("it ended with {code}"),
        (None, signal) => format!("it was killed by signal {}", signal.unwrap_or_default()),
    }
}

/// What is known for each placeholder, in their order.
fn values(end: &End<'_>) -> [(&'static str, OsString); 8] {
    let path = |path: &Option<PathBuf>| path.as_ref().map(|path| path.clone().into_os_string()).unwrap_or_default();
    let ending = end.job.publication().and_then(|publication| serde_json::to_value(publication.ending).ok());
    let ending = ending.as_ref().and_then(|ending| ending.as_str()).unwrap_or_default().to_owned();
    [
        ("output", path(&end.paths.output)),
        ("report", path(&end.paths.report)),
        ("original", path(&end.paths.original)),
        ("folder", end.job.source.folder.clone().into()),
        ("file", end.job.source.path.to_path().into_os_string()),
        ("job", end.job.id.to_string().into()),
        ("event", end.event.word().into()),
        ("ending", ending.into()),
    ]
}

/// The word with its placeholders filled in, each once: a value is never looked at again.
fn filled(word: &str, values: &[(&str, OsString)]) -> OsString {
    let (mut whole, mut rest) = (Vec::new(), word);
    for name in placeholders(word) {
        let Some((before, after)) = rest.split_once(&format!("{{{name}}}")) else { continue };
        let value = values.iter().find(|(known, _)| *known == name).map(|(_, value)| value.as_bytes());
        whole.extend_from_slice(before.as_bytes());
        whole.extend_from_slice(value.unwrap_or_default());
        rest = after;
    }
    whole.extend_from_slice(rest.as_bytes());
    OsString::from_vec(whole)
}

fn start(on_done: &OnDone, end: &End<'_>) -> io::Result<(Child, Said)> {
    let values = values(end);
    let mut words = on_done.command.iter().map(|word| filled(word, &values));
    let (reader, writer) = io::pipe()?;
    let mut command = Command::new(words.next().unwrap_or_default());
    command.args(words).stdin(Stdio::null()).stdout(writer.try_clone()?).stderr(writer).process_group(0);
    for name in FOR_THE_DAEMON {
        command.env_remove(name);
    }
    for (name, value) in &values {
        command.env(format!("SUTURE_{}", name.to_uppercase()), value);
    }
    command.env("SUTURE_DELIVERY", OsStr::new(&end.id));
    // The command's own ends of the pipe go with it: what is left is the child's.
    Ok((command.spawn()?, Said { from: Some(reader), kept: VecDeque::new() }))
}

/// Waits for its end, and listens to it; `None`: it was over before, and has been killed with all that it has started.
fn attend(child: &mut Child, said: &mut Said, is_over: &dyn Fn() -> bool) -> io::Result<Option<ExitStatus>> {
    loop {
        said.listen(LOOK_EVERY);
        if let Some(status) = child.try_wait()? {
            // What is still in the pipe; whoever else holds it is not waited for.
            (0..KEPT).take_while(|_| said.listen(Duration::ZERO)).for_each(drop);
            return Ok(Some(status));
        }
        if is_over() {
            // It is not waited for yet, so that its number is nobody else's.
            let killed = kill_process_group(Pid::from_child(child), Signal::KILL);
            killed.or_else(|_| child.kill().map_err(|_| rustix::io::Errno::SRCH)).ok();
            child.wait()?;
            return Ok(None);
        }
    }
}

/// The end of what a command says.
struct Said {
    /// `None`: it says nothing more.
    from: Option<PipeReader>,
    kept: VecDeque<u8>,
}

impl Said {
    /// Takes in what it says within this time. Returns whether it said anything.
    fn listen(&mut self, wait: Duration) -> bool {
        let Some(from) = &mut self.from else {
            std::thread::sleep(wait);
            return false;
        };
        let time = Timespec { tv_sec: 0, tv_nsec: i64::from(wait.subsec_nanos()) };
        if !poll(&mut [PollFd::new(&*from, PollFlags::IN)], Some(&time)).is_ok_and(|ready| ready > 0) {
            return false;
        }
        let mut piece = [0; 4096];
        match from.read(&mut piece) {
            Ok(read @ 1..) => self.kept.extend(piece.get(..read).unwrap_or_default()),
            _ => self.from = None,
        }
        self.kept.drain(..self.kept.len().saturating_sub(KEPT));
        self.from.is_some()
    }

    /// In one line.
    fn words(&self) -> String {
        let bytes: Vec<u8> = self.kept.iter().copied().collect();
        plain(&String::from_utf8_lossy(&bytes).trim().replace('\n', " | "))
    }
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;
    use std::path::Path;

    use suture_store::Ending;

    use super::super::end::tests::ended;
    use super::*;
    use crate::world::Machine;

    fn run_of(words: &[&str], time_limit: Duration, is_cut: &dyn Fn() -> bool) -> Outcome {
        let command = words.iter().map(|word| (*word).to_owned()).collect();
        let on_done = OnDone { command, when: When::Always, time_limit };
        let job = ended(Ending::Repaired, None, None);
        run(&on_done, &End::of(&job, Some(Path::new("/srv/hot"))).unwrap(), &Machine, is_cut)
    }

    fn shell(script: &str) -> Outcome {
        run_of(&["/bin/sh", "-c", script, "sh", "{output}", "{ending}-{job}", "{"], Duration::from_secs(60), &|| false)
    }

    #[test]
    fn it_has_its_arguments_and_its_environment() {
        let said = |script| match shell(script) {
            Outcome::Delivered { note } => note,
            other => panic!("{other:?}"),
        };
        assert_eq!(said("echo \"$2 $3 $#\""), "repaired-7 { 3");
        assert_eq!(said("[ \"$1\" = \"$SUTURE_OUTPUT\" ] && echo $SUTURE_EVENT $SUTURE_DELIVERY"), "finished 18bcfe5687b-9");
        assert_eq!(said("printf '%s' \"$1\" | od -An -c | tr -d ' \\n'"), "/srv/hot/out/a\\nb.stl");
    }

    /// No value is taken for a placeholder, and no shell sees any.
    #[test]
    fn values_are_only_values() {
        let values = [("file", OsString::from("{job}; $(touch x)")), ("job", OsString::from("7"))];
        assert_eq!(filled("a {file} {job} {x y} {", &values), "a {job}; $(touch x) 7 {x y} {");
        assert_eq!(filled("{file}{file}", &values), "{job}; $(touch x){job}; $(touch x)");
    }

    #[test]
    fn its_end_says_what_is_next() {
        assert_eq!(
            shell("echo no; echo room >&2; exit 75"),
            Outcome::Again { why: "it wants to be tried again: no | room".into(), after: None }
        );
        assert_eq!(shell("exit 3"), Outcome::Never { why: "it ended with 3".into() });
        assert_eq!(shell("kill -9 $$"), Outcome::Never { why: "it was killed by signal 9".into() });
        let none = run_of(&["/nowhere/program"], Duration::from_secs(60), &|| false);
        assert!(matches!(none, Outcome::Again { why, .. } if why.starts_with("it cannot be started")));
    }

    #[test]
    fn very_much_said_is_cut_to_its_end() {
        let Outcome::Delivered { note } = shell("yes word | head -c 300000; echo; echo last") else { panic!() };
        assert!(note.ends_with("last") && note.len() < 3 * KEPT, "{}", note.len());
    }

    /// With all that it has started, which would hold its pipe open.
    #[test]
    fn it_ends_at_its_time_limit_or_with_the_daemon() {
        let script = ["/bin/sh", "-c", "echo begun; sleep 1000 & sleep 1000"];
        let late = run_of(&script, Duration::from_millis(300), &|| false);
        assert_eq!(late, Outcome::Never { why: "it was ended at its time limit: begun".into() });
        let looks = Cell::new(0);
        let is_cut = || looks.replace(looks.get() + 1) >= 3;
        assert_eq!(run_of(&script, Duration::from_secs(1000), &is_cut), Outcome::Cut);
        // One that goes into the background is not waited for.
        assert!(matches!(shell("sleep 5 & echo done"), Outcome::Delivered { note } if note == "done"));
    }

    #[test]
    fn without_a_certificate_it_is_not_run() {
        let on_done = OnDone { command: vec!["/nowhere".into()], when: When::Certified, time_limit: Duration::ZERO };
        let job = ended(Ending::NeedsReview, None, None);
        let outcome = run(&on_done, &End::of(&job, None).unwrap(), &Machine, &|| false);
        assert!(matches!(outcome, Outcome::Delivered { note } if note.contains("not run: it has no good result")));
    }
}
