//! How long a call may wait for a database that is away. Whoever works on a job waits, since the job is worth it; whoever only looks, or holds a
//! lock meanwhile that others need, says so and gets an error soon.

use std::cell::Cell;
use std::sync::OnceLock;

thread_local! {
    static BRIEF: Cell<bool> = const { Cell::new(false) };
}

/// Does `look`, whose calls of a store wait for its database hardly at all.
pub fn brief<T>(look: impl FnOnce() -> T) -> T {
    /// Puts back what was, also where `look` unwinds.
    struct Before(bool);
    impl Drop for Before {
        fn drop(&mut self) {
            BRIEF.set(self.0);
        }
    }
    let _before = Before(BRIEF.replace(true));
    look()
}

/// Says whether all calls of this process are to be brief from now on.
type Hurry = Box<dyn Fn() -> bool + Send + Sync>;

static HURRY: OnceLock<Hurry> = OnceLock::new();

/// Has no call of this process wait any longer once `is_so`: someone wants it to end. The first word counts.
pub fn hurry_when(is_so: impl Fn() -> bool + Send + Sync + 'static) {
    // Whoever said so before is the daemon itself.
    let _ = HURRY.set(Box::new(is_so));
}

/// Is the process to end?
pub fn is_hurried() -> bool {
    HURRY.get().is_some_and(|is_so| is_so())
}

/// Is this thread within [`brief`]?
#[cfg(feature = "postgres")]
pub(crate) fn is_brief() -> bool {
    BRIEF.get()
}

#[cfg(all(test, feature = "postgres"))]
mod tests {
    use super::*;

    #[test]
    fn it_ends_with_the_look() {
        assert!(!is_brief());
        assert!(brief(|| brief(is_brief) && is_brief()));
        assert!(!is_brief());
        assert!(std::panic::catch_unwind(|| brief(|| panic!("a look that fails"))).is_err());
        assert!(!is_brief());
    }
}
