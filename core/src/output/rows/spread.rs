//! Values of positions that only new triangles have: the means of those around them, from the rim inwards.

use std::collections::BTreeMap;

/// Positions without rows, in the order in which they get one, and the positions each takes the mean of.
pub(super) struct Spread {
    pub(super) order: Vec<(u32, Vec<u32>)>,
    /// The rows of those that have one.
    pub(super) rows: BTreeMap<u32, u32>,
}

/// Goes inwards over these triangles from the positions that are `known`, step by step; a position takes the mean of those around it that were
/// reached in an earlier step. Where nothing is known, positions have nothing around them. O(n log n).
pub(super) fn spread(faces: &[[u32; 3]], known: impl Fn(u32) -> Option<u32>) -> Spread {
    let mut rows = BTreeMap::new();
    let mut around: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for face in faces {
        for (k, number) in face.iter().enumerate() {
            match known(*number) {
                Some(row) => {
                    rows.insert(*number, row);
                }
                None => around.entry(*number).or_default().extend([face[(k + 1) % 3], face[(k + 2) % 3]]),
            }
        }
    }
    for all in around.values_mut() {
        all.sort_unstable();
        all.dedup();
    }
    // By position: the step in which it was reached.
    let mut step_of: BTreeMap<u32, u32> = rows.keys().map(|number| (*number, 0)).collect();
    let mut waiting: Vec<u32> =
        around.iter().filter(|(_, all)| all.iter().any(|other| rows.contains_key(other))).map(|(number, _)| *number).collect();
    let mut order = Vec::new();
    for step in 1.. {
        if waiting.is_empty() {
            break;
        }
        step_of.extend(waiting.iter().map(|number| (*number, step)));
        let mut next = Vec::new();
        for number in waiting {
            let all = around.get(&number).map(Vec::as_slice).unwrap_or_default();
            let is_before = |other: &&u32| step_of.get(other).is_some_and(|own| *own < step);
            order.push((number, all.iter().filter(is_before).copied().collect()));
            next.extend(all.iter().filter(|other| !step_of.contains_key(other)));
        }
        next.sort_unstable();
        next.dedup();
        waiting = next;
    }
    order.extend(around.keys().filter(|number| !step_of.contains_key(number)).map(|number| (*number, Vec::new())));
    Spread { order, rows }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A fan around 9, whose rim is known but for 3; and a triangle by itself.
    #[test]
    fn values_go_inwards() {
        let faces = [[0, 1, 9], [1, 2, 9], [2, 3, 9], [3, 0, 9], [20, 21, 22]];
        let spread = spread(&faces, |number| (number < 3).then_some(number + 100));
        assert_eq!(spread.rows, BTreeMap::from([(0, 100), (1, 101), (2, 102)]));
        // 3 and 9 are reached in one step: neither takes the other's.
        let alone = [20, 21, 22].map(|number| (number, Vec::new()));
        assert_eq!(spread.order[..2], [(3, vec![0, 2]), (9, vec![0, 1, 2])]);
        assert_eq!(spread.order[2..], alone);
    }
}
