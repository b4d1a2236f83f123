//! Normals of triangles that were turned: a file may say them at corners, where they stay what they are.

use std::collections::BTreeSet;

use crate::io::rows::{CHANNELS, Corner, Mix, NONE, Rows, VERTICES, facing};

/// The file says normals at corners.
pub(super) fn has_normals(rows: &dyn Rows) -> bool {
    (0..CHANNELS).any(|channel| rows.mixes(channel).contains(&Mix::Direction))
}

/// How many of these triangles, whose corners stand in the order in which they came, have a normal at a corner that looks against them since they were
/// turned. `None` if their rows are not there. O(bytes), and O(n log n) in them.
pub(super) fn against(rows: &dyn Rows, turned: &[[Corner; 3]]) -> Option<u64> {
    let mut is_against = vec![false; turned.len()];
    for channel in 0..CHANNELS {
        let Some(first) = rows.mixes(channel).iter().position(|mix| *mix == Mix::Direction) else { continue };
        let named: BTreeSet<u32> = turned.iter().flatten().map(|corner| corner[channel]).filter(|row| *row != NONE).collect();
        let values = rows.values(channel, &named)?;
        for (is_against, corners) in is_against.iter_mut().zip(turned) {
            let [a, b, c] = corners.map(|corner| rows.position(corner[VERTICES]));
            let now = facing([a?, c?, b?]);
            *is_against |= corners.iter().filter_map(|corner| values.get(&corner[channel])?.get(first..first + 3)).any(|own| {
                // Of no direction at all, nothing can be said.
                own.iter().zip(now).map(|(x, y)| x * y).sum::<f64>() < 0.0
            });
        }
    }
    Some(is_against.into_iter().filter(|is| *is).count() as u64)
}
