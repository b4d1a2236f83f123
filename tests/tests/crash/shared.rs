//! The same on a store that machines share: whatever a killed daemon held in the database, its next life takes up.

use suture_store::testkit::server::server;
use suture_tests::binary::with_crash_points;
use suture_tests::hot::Hot;

use super::{drop_one, drop_two, exhaustive, killed_at, killed_twice_at, on_two_threads, reference, state, traced};

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
        killed_at(&hot, (step, passes), &expected);
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
    on_two_threads(&pairs, |&pair| {
        let hot = Hot::sharing(with_crash_points(), &url);
        drop_one(&hot);
        killed_twice_at(&hot, pair, &expected);
    });
}
