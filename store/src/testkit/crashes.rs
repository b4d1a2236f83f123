//! Who wants to know of crash points that a thread passes: a simulation, which ends a daemon there without ending the process.

use std::cell::RefCell;
use std::rc::Rc;

type Watch = Rc<dyn Fn(&'static str)>;

thread_local! {
    static WATCH: RefCell<Option<Watch>> = const { RefCell::new(None) };
}

/// Has `watch` be called with the name of each crash point that this thread passes, or no one any more. It may unwind.
pub fn at_crash_points(watch: Option<Watch>) {
    WATCH.with(|slot| *slot.borrow_mut() = watch);
}

#[cfg(feature = "testkit")]
pub(crate) fn pass_crash_point(name: &'static str) {
    let watch = WATCH.with(|slot| slot.borrow().clone());
    if let Some(watch) = watch {
        watch(name);
    }
}
