//! The daemon is killed, and then its state is lost: what lies in the hot folder alone tells the next one what was done, and what was
//! about to be. Each original has one result, wherever the kill was.

use suture_bench::generate::Case;
use suture_tests::binary::with_crash_points;
use suture_tests::hot::{Hot, mesh};

use crate::{assert_at_rest, drop_two, on_two_threads, reference, state, was_killed};

/// One that is good, one that is not and has a best attempt.
fn drop_others(hot: &Hot) {
    hot.put("part.stl", &mesh(Case::Clean, 1));
    hot.put("cautious/part.stl", &mesh(Case::Mixed, 1));
}

fn sweep(put: fn(&Hot)) {
    let (expected, passes) = reference(put);
    let steps: Vec<u64> = (1..=passes).collect();
    on_two_threads(&steps, |&step| {
        let hot = Hot::new(with_crash_points());
        put(&hot);
        let what = format!("killed at pass {step} of {passes}, and the state is lost");
        let killed = was_killed(hot.once(Some(step)));
        assert!(killed || step + 8 > passes, "{what}: was not");
        let jobs = hot.path().join(".suture/state");
        if jobs.exists() {
            std::fs::remove_dir_all(jobs).expect("the state can be removed");
        }
        assert!(hot.once(None).code().is_some_and(|code| code < 2), "{what}: the next run fails");
        assert_eq!(state(&hot), expected, "{what}");
        assert_at_rest(&hot, &what);
        assert_eq!(hot.jobs().len(), 2, "{what}: {:?}", hot.jobs());
    });
}

#[test]
fn f06_killed_at_every_step_and_the_state_is_lost() {
    sweep(drop_two);
}

#[test]
fn f06_killed_at_every_step_of_others_and_the_state_is_lost() {
    sweep(drop_others);
}
