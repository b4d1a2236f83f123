//! The same on a store that machines share: whatever a killed daemon held in the database, its next life takes up.

use suture_bench::generate::Case;
use suture_store::testkit::server::server;
use suture_tests::binary::with_crash_points;
use suture_tests::hot::{Hot, mesh};

use super::{
    assert_at_rest, assert_attempts, drop_one, drop_two, exhaustive, on_two_threads, reference, state, traced, was_killed,
};

/// Of all steps, each of so many, so that CI has time for it.
const EACH: usize = 4;

#[test]
fn f01_killed_at_steps_on_a_shared_store() {
    let Some(server) = server() else { return };
    let url = server.url();
    // As on a machine's own store, so that the two make the same.
    let (expected, _) = reference(drop_two);
    let hot = Hot::sharing(with_crash_points(), &url);
    drop_two(&hot);
    let (status, trace) = traced(&hot, hot.watch(&["--once"]));
    assert!(status.code().is_some_and(|code| code < 2), "{status}");
    assert_eq!(state(&hot), expected, "without a kill");
    let passes = trace.lines().count() as u64;
    assert!(passes > 20, "{trace}");
    let each = if exhaustive() { 1 } else { EACH };
    let steps: Vec<u64> = (1..=passes).step_by(each).collect();
    on_two_threads(&steps, |&step| {
        let hot = Hot::sharing(with_crash_points(), &url);
        drop_two(&hot);
        let what = format!("killed at pass {step} of {passes}");
        let killed = was_killed(hot.once(Some(step)));
        assert!(killed || step + 8 > passes, "{what}: was not");
        assert!(hot.once(None).code().is_some_and(|code| code < 2), "{what}: the next run fails");
        assert_eq!(state(&hot), expected, "{what}");
        assert_at_rest(&hot, &what);
        assert_attempts(&hot, 1, &what);
    });
}

/// Killed, and killed again while it takes up what it held.
#[test]
fn f01_killed_twice_on_a_shared_store() {
    let Some(server) = server() else { return };
    let url = server.url();
    let (expected, passes) = reference(drop_one);
    let each = if exhaustive() { 1 } else { 2 * EACH };
    let pairs: Vec<(u64, u64)> = (1..=passes).step_by(each).flat_map(|first| [(first, 1), (first, 3)]).collect();
    on_two_threads(&pairs, |&(first, second)| {
        let hot = Hot::sharing(with_crash_points(), &url);
        hot.put("part.stl", &mesh(Case::Clean, 1));
        let what = format!("killed at pass {first}, then at pass {second}");
        for step in [first, second] {
            hot.once(Some(step));
        }
        assert_eq!(hot.once(None).code(), Some(0), "{what}: the last run fails");
        assert_eq!(state(&hot), expected, "{what}");
        assert_at_rest(&hot, &what);
        assert_attempts(&hot, 2, &what);
    });
}
