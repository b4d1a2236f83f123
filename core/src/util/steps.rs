//! Steps of work, counted in tests: that a loop costs no more than its input is asserted by counts, never by time.
//!
//! A loop whose cost has a test calls [`count`] where it does its work; the primitives that loops are made of (a link of a star list, an
//! entry of a table of positions) do so too. Outside of tests nothing is counted. Each thread counts for itself.

#[cfg(test)]
thread_local! {
    static STEPS: std::cell::Cell<u64> = const { std::cell::Cell::new(0) };
}

/// So many steps are done.
#[inline(always)]
pub(crate) fn count(steps: usize) {
    #[cfg(test)]
    STEPS.with(|all| all.set(all.get() + steps as u64));
    #[cfg(not(test))]
    let _ = steps;
}

/// The steps that `work` does in this thread, and its result.
#[cfg(test)]
pub(crate) fn of<R>(work: impl FnOnce() -> R) -> (u64, R) {
    let before = STEPS.with(std::cell::Cell::get);
    let result = work();
    (STEPS.with(std::cell::Cell::get) - before, result)
}

/// Checks that twice the input costs about twice the steps: less than 2.6 times as many, which allows for logarithms and forbids squares.
/// `steps(n)`: those for an input of size n, which is tried with three sizes from `smallest` on.
#[cfg(test)]
pub(crate) fn assert_near_linear(smallest: usize, steps: impl Fn(usize) -> u64) {
    let counts = [1, 2, 4].map(|times| steps(smallest * times));
    assert!(counts[0] >= smallest as u64, "{counts:?}: the work was not counted");
    assert!(counts.windows(2).all(|two| two[1] as f64 <= 2.6 * two[0] as f64), "{counts:?} steps for {smallest} × 1, 2, 4");
}
