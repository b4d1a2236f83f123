//! Words to the service manager that has started the daemon, as systemd's `sd_notify` takes them: that it is ready, reads its configuration anew, or ends,
//! and that it goes on. The last is said only while the thread that looks after the folders makes progress, so that a daemon that hangs is ended.

use std::ffi::OsStr;
use std::io;
use std::os::linux::net::SocketAddrExt;
use std::os::unix::ffi::OsStrExt;
use std::os::unix::net::{SocketAddr, UnixDatagram};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use rustix::time::{ClockId, clock_gettime};
use suture_store::patience::brief;

use crate::attempt::Context;
use crate::glance::away;

const LOOK_EVERY: Duration = Duration::from_millis(100);
/// How often it is said what is done.
const STATUS_EVERY: Duration = Duration::from_secs(5);

/// The service manager, if there is one.
pub(crate) struct Manager {
    socket: Option<(UnixDatagram, SocketAddr)>,
    /// It wants to hear of the daemon within such a time.
    watchdog: Option<Duration>,
    beaten: Mutex<Option<Instant>>,
}

impl Manager {
    /// The one that the environment names.
    pub(crate) fn of_environment() -> Self {
        let variable = |name: &str| std::env::var_os(name);
        let number = |name: &str| variable(name).and_then(|text| text.to_str()?.parse::<u64>().ok());
        let is_ours = variable("WATCHDOG_PID").is_none() || number("WATCHDOG_PID") == Some(std::process::id().into());
        let watchdog = number("WATCHDOG_USEC").filter(|time| is_ours && *time > 0).map(Duration::from_micros);
        let socket = variable("NOTIFY_SOCKET").and_then(|path| {
            let reached = reach(&path);
            let told = |error: &io::Error| tracing::warn!(%error, "The service manager cannot be told anything.");
            reached.inspect_err(told).ok()
        });
        Self { socket, watchdog, beaten: Mutex::default() }
    }

    fn say(&self, words: &str) {
        if let Some((socket, address)) = &self.socket {
            // One that does not listen is not waited for.
            let _ = socket.send_to_addr(words.as_bytes(), address);
        }
    }

    /// The daemon goes on at `now`: said as often as the manager wants it, and not more often.
    pub(crate) fn beat(&self, now: Instant) {
        let Some(watchdog) = self.watchdog else { return };
        let mut beaten = self.beaten.lock().unwrap_or_else(PoisonError::into_inner);
        if beaten.is_none_or(|then| now.duration_since(then) >= watchdog / 3) {
            *beaten = Some(now);
            self.say("WATCHDOG=1");
        }
    }

    /// Says that the daemon waits, and why.
    pub(crate) fn wait(&self, why: &str) {
        self.say(&format!("STATUS={why}"));
    }

    /// Tells of one life of the daemon, until `is_over`.
    pub(crate) fn tell(&self, context: &Context, is_over: &dyn Fn() -> bool) {
        if self.socket.is_none() {
            return;
        }
        let mut told = Told::default();
        while !is_over() {
            self.look(context, &mut told);
            std::thread::sleep(LOOK_EVERY);
        }
        self.look(context, &mut told);
    }

    fn look(&self, context: &Context, told: &mut Told) {
        let (pulse, now) = (&context.pulse, context.world.steady());
        let is_ready = || context.folders.iter().all(|folder| pulse.scan_of(&folder.name).is_some());
        if !told.ready && is_ready() {
            told.ready = true;
            self.say("READY=1");
        }
        let reloads = pulse.reloads();
        if told.ready && told.reloads != reloads {
            // It is done already: the manager wants to hear of both.
            let time = clock_gettime(ClockId::Monotonic);
            let usec = i128::from(time.tv_sec) * 1_000_000 + i128::from(time.tv_nsec) / 1000;
            self.say(&format!("RELOADING=1\nMONOTONIC_USEC={usec}"));
            self.say("READY=1");
        }
        told.reloads = reloads;
        if pulse.is_ending() && !std::mem::replace(&mut told.ending, true) {
            self.say("STOPPING=1");
        }
        // While it ends, its jobs have a time limit of their own; while its database is away, it can only wait.
        if pulse.is_ending() || context.store.away().is_some() || self.watchdog.is_some_and(|watchdog| pulse.silence() < watchdog)
        {
            self.beat(now);
        }
        if told.status.is_none_or(|then| now.duration_since(then) >= STATUS_EVERY) {
            told.status = Some(now);
            self.say(&format!("STATUS={}", status(context)));
        }
    }
}

/// What was said of one life.
#[derive(Default)]
struct Told {
    ready: bool,
    ending: bool,
    reloads: u64,
    status: Option<Instant>,
}

/// What the daemon does, in one line.
fn status(context: &Context) -> String {
    let counts = brief(|| context.store.counts());
    if let Some(why) = away(&*context.store) {
        return why;
    }
    let counts = counts.unwrap_or_default();
    let sum =
        |of: fn(suture_store::Kind) -> bool| counts.iter().filter(|(kind, _)| of(*kind)).map(|(_, count)| count).sum::<u64>();
    let held = context.schedule.standing().held;
    let why = held.first().map(|why| format!("; nothing new is taken: {why}")).unwrap_or_default();
    format!("{} waiting, {} in work{why}", sum(suture_store::Kind::is_queued), sum(suture_store::Kind::is_held))
}

/// A socket to this address; one that begins with `@` is not in the file system.
fn reach(path: &OsStr) -> io::Result<(UnixDatagram, SocketAddr)> {
    let address = match path.as_bytes() {
        [b'@', name @ ..] => SocketAddr::from_abstract_name(name)?,
        [b'/', ..] => SocketAddr::from_pathname(path)?,
        _ => return Err(io::Error::new(io::ErrorKind::InvalidInput, "NOTIFY_SOCKET is no address of a local socket")),
    };
    let socket = UnixDatagram::unbound()?;
    socket.set_nonblocking(true)?;
    Ok((socket, address))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn heard(socket: &UnixDatagram) -> Vec<String> {
        socket.set_nonblocking(true).unwrap();
        let mut words = [0; 256];
        std::iter::from_fn(|| socket.recv(&mut words).ok().map(|n| String::from_utf8_lossy(&words[..n]).into_owned())).collect()
    }

    #[test]
    fn words_come_to_a_path_and_to_a_name() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("notify");
        let name = format!("suture-test-{}", std::process::id());
        let named = SocketAddr::from_abstract_name(name.as_bytes()).unwrap();
        for (stub, told) in [
            (UnixDatagram::bind(&path).unwrap(), path.clone().into_os_string()),
            (UnixDatagram::bind_addr(&named).unwrap(), format!("@{name}").into()),
        ] {
            let socket = Some(reach(&told).unwrap());
            Manager { socket, watchdog: None, beaten: Mutex::default() }.say("READY=1");
            assert_eq!(heard(&stub), ["READY=1"]);
        }
        assert!(reach(OsStr::new("vsock:2:3")).is_err() && reach(OsStr::new("")).is_err());
    }

    #[test]
    fn it_beats_as_often_as_is_wanted() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("notify");
        let stub = UnixDatagram::bind(&path).unwrap();
        let socket = Some(reach(path.as_os_str()).unwrap());
        let manager = Manager { socket, watchdog: Some(Duration::from_secs(30)), beaten: Mutex::default() };
        let born = Instant::now();
        for second in 0..=25 {
            manager.beat(born + Duration::from_secs(second));
        }
        assert_eq!(heard(&stub), ["WATCHDOG=1"; 3]);
        Manager { watchdog: None, ..manager }.beat(born + Duration::from_secs(99));
        assert_eq!(heard(&stub), Vec::<String>::new());
    }
}
