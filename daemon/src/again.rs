//! Another life of the daemon, in the same process: the program begins anew under its process number.
//!
//! After an error of its disk the job database is in doubt, and its handles can neither be used nor, as measured, be dropped: sled 0.34
//! waits now and then for a write that never comes. A program that begins anew has none of them, nor a thread, nor a worker, and finds
//! what is to be done as after any other death.

use std::io;
use std::os::unix::process::CommandExt;
use std::process::Command;
use std::time::Duration;

/// Tells the next life of those before it.
const LIVES: &str = "SUTURE_LIVES";
/// Lives in a row that were short, before the process gives up.
const SHORT_LIVES: u32 = 3;
/// A life that lasted so long was not short.
const LONG: Duration = Duration::from_secs(60);

/// What is known of earlier lives of this process.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Lives {
    /// Short ones in a row.
    short: u32,
    /// A job ended not good in one of them.
    pub not_good: bool,
}

impl Lives {
    /// As an earlier life left word.
    pub(crate) fn so_far() -> Self {
        std::env::var(LIVES).ok().and_then(|text| Self::parse(&text)).unwrap_or_default()
    }

    fn parse(text: &str) -> Option<Self> {
        let (short, not_good) = text.split_once(' ')?;
        Some(Self { short: short.parse().ok()?, not_good: not_good.parse().ok()? })
    }

    /// After a life of `lasted`; `None` when there is to be no other. With the pause before the next.
    fn next(self, lasted: Duration, not_good: bool) -> Option<(Self, Duration)> {
        let short = if lasted > LONG { 1 } else { self.short + 1 };
        let next = Self { short, not_good: self.not_good || not_good };
        (short <= SHORT_LIVES).then(|| (next, Duration::from_secs(1) * short))
    }

    /// Begins the program anew, after a pause that `stop` cuts short. Returns when there is to be no other life.
    pub(crate) fn begin_another(self, lasted: Duration, not_good: bool, stop: &dyn Fn() -> bool) {
        let Some((next, pause)) = self.next(lasted, not_good) else { return };
        let step = Duration::from_millis(50);
        for _ in 0..pause.as_millis() / step.as_millis() {
            if stop() {
                return;
            }
            std::thread::sleep(step);
        }
        let error = replace_program(&format!("{} {}", next.short, next.not_good));
        tracing::error!(%error, "The program could not begin anew.");
    }
}

/// The running binary itself, even when a newer one has taken its name meanwhile. Everything that is open closes.
fn replace_program(lives: &str) -> io::Error {
    let mut arguments = std::env::args_os();
    let name = arguments.next().unwrap_or_else(|| "suture".into());
    Command::new("/proc/self/exe").arg0(name).args(arguments).env(LIVES, lives).exec()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn short_lives_come_to_an_end_and_long_ones_do_not() {
        let (short, long) = (Duration::from_secs(1), Duration::from_secs(61));
        let mut lives = Lives::default();
        for n in 1..=SHORT_LIVES {
            let (next, pause) = lives.next(short, n == 1).unwrap();
            assert_eq!((pause, next.not_good), (Duration::from_secs(u64::from(n)), true));
            assert_eq!(Lives::parse(&format!("{} {}", next.short, next.not_good)), Some(next));
            lives = next;
        }
        assert_eq!(lives.next(short, false), None);
        assert_eq!(lives.next(long, false).unwrap().0.short, 1);
        assert_eq!(Lives::parse("nonsense"), None);
    }
}
