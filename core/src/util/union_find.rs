//! Sets of numbered things that are merged pair by pair, in a table of parents.

/// Root of `v`, halving the path.
#[inline]
pub(crate) fn find(parents: &mut [u32], mut v: u32) -> u32 {
    while parents[v as usize] != v {
        let up = parents[parents[v as usize] as usize];
        parents[v as usize] = up;
        v = up;
    }
    v
}

/// The smaller root wins, so that the result does not depend on the order of unions. Says whether there were two.
#[inline]
pub(crate) fn unite(parents: &mut [u32], a: u32, b: u32) -> bool {
    let (a, b) = (find(parents, a), find(parents, b));
    parents[a.max(b) as usize] = a.min(b);
    a != b
}

/// The root of each. O(n).
pub(crate) fn roots(mut parents: Vec<u32>) -> Vec<u32> {
    // A parent is no larger than its child, so that its root is known before.
    for v in 0..parents.len() {
        parents[v] = parents[parents[v] as usize];
    }
    parents
}
