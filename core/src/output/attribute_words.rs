//! Attribute words of new triangles: each takes the word of most of the rim around it, by the rim's length.
//!
//! **In:** the submesh as repairs left it, and the records of the input.
//! **Out:** the words of new triangles that are not 0.
//! **Promise:** new triangles that hang together have one word; where two words are said by rims of the same length, the smaller one counts.
//!
//! Programs keep the colour of a facet there, as VisCAM and Magics do. Nearly all files have no word but 0: then the rim is read, and no more.

use std::collections::{BTreeMap, HashMap};

use crate::geometry::distance::distance;
use crate::io::record;
use crate::submesh::{Origin, Submesh, Vertex};
use crate::topology::survey::Survey;
use crate::util::bits;
use crate::util::union_find;

/// The words of new triangles that are not 0, by their numbers in the submesh. O(submesh).
pub(super) fn of_new(survey: &Survey<'_>, submesh: &Submesh) -> HashMap<u32, u16> {
    let new: Vec<u32> = submesh.living().filter(|t| is_new(submesh, *t)).collect();
    if new.is_empty() {
        return HashMap::new();
    }
    let rim = words_around(survey, submesh, &new);
    if rim.iter().all(|(_, word)| *word == 0) {
        return HashMap::new();
    }
    let groups = together(submesh, &new);
    let of_edge: HashMap<[Vertex; 2], u32> =
        new.iter().zip(&groups).flat_map(|(t, group)| edges(submesh, *t).map(|edge| (edge, *group))).collect();
    let mut lengths: BTreeMap<(u32, u16), f64> = BTreeMap::new();
    for (t, word) in rim {
        for edge in edges(submesh, t) {
            if let Some(group) = of_edge.get(&edge) {
                let [a, b] = edge.map(|v| submesh.positions[v as usize]);
                *lengths.entry((*group, word)).or_default() += distance(a, b);
            }
        }
    }
    let mut most: HashMap<u32, (f64, u16)> = HashMap::new();
    for ((group, word), length) in lengths {
        let best = most.entry(group).or_insert((length, word));
        if length > best.0 {
            *best = (length, word);
        }
    }
    let word = |group: &u32| most.get(group).map_or(0, |(_, word)| *word);
    new.into_iter().zip(&groups).map(|(t, group)| (t, word(group))).filter(|(_, word)| *word != 0).collect()
}

fn is_new(submesh: &Submesh, t: u32) -> bool {
    matches!(submesh.triangles[t as usize].origin, Origin::Added(_))
}

/// The triangles of the input, and parts of such, that have two corners at new ones: their words.
fn words_around(survey: &Survey<'_>, submesh: &Submesh, new: &[u32]) -> Vec<(u32, u16)> {
    let mut touched = vec![0; submesh.positions.len().div_ceil(64)];
    new.iter().flat_map(|t| submesh.triangles[*t as usize].v).for_each(|v| bits::put(&mut touched, v as usize));
    let is_touched = |v: &&Vertex| bits::holds(&touched, **v as usize);
    let is_near = |t: &u32| submesh.triangles[*t as usize].v.iter().filter(is_touched).count() > 1;
    let rim = submesh.living().filter(|t| !is_new(submesh, *t)).filter(is_near);
    let word = |t: u32| (t, record::attribute(&survey.records[submesh.record(t) as usize]));
    survey.ahead(rim, |t| Some(submesh.record(*t))).map(word).collect()
}

/// The same number for new triangles that hang together at corners.
fn together(submesh: &Submesh, new: &[u32]) -> Vec<u32> {
    let mut at_vertex: HashMap<Vertex, u32> = HashMap::new();
    let mut joined: Vec<u32> = (0..new.len() as u32).collect();
    for (place, t) in (0..).zip(new) {
        for v in submesh.triangles[*t as usize].v {
            let other = *at_vertex.entry(v).or_insert(place);
            union_find::unite(&mut joined, place, other);
        }
    }
    union_find::roots(joined)
}

fn edges(submesh: &Submesh, t: u32) -> [[Vertex; 2]; 3] {
    let [a, b, c] = submesh.triangles[t as usize].v;
    [[a, b], [b, c], [c, a]].map(|[from, to]| [from.min(to), from.max(to)])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contract::report::RepairName;
    use crate::output::edit::Edit;
    use crate::submesh::components::Reversed;
    use crate::testing::{diagnose, plate, records, written};

    /// A plate of three by three squares without the one in its middle, whose rim says `words` on its four sides.
    fn closed(words: [u16; 4]) -> Vec<u16> {
        let mut records = records(&plate(3, |x, y| (x, y) != (1, 1)));
        for record in &mut records {
            let middle = record::corners(record).iter().fold([0.0; 2], |sum, p| [sum[0] + p[0] / 3.0, sum[1] + p[1] / 3.0]);
            let side = match middle {
                [x, _] if x < 1.0 => 0,
                [x, _] if x > 2.0 => 1,
                [_, y] if y < 1.0 => 2,
                _ => 3,
            };
            record[48..].copy_from_slice(&words[side].to_le_bytes());
        }
        let mut d = diagnose(&records);
        let at = |p: [f32; 3]| d.submesh.positions.iter().position(|q| *q == p).unwrap() as u32;
        let [a, b, c, e] = [[1.0, 1.0, 0.0], [2.0, 1.0, 0.0], [2.0, 2.0, 0.0], [1.0, 2.0, 0.0]].map(at);
        for v in [[a, b, c], [a, c, e]] {
            d.submesh.add(v, Origin::Added(RepairName::Fill), u32::MAX);
        }
        let after = written(&Edit::of(&d.survey, &d.submesh, &Reversed::none(&d.survey), &[]), &records);
        assert_eq!(after[..records.len()], records[..]);
        after[records.len()..].iter().map(record::attribute).collect()
    }

    #[test]
    fn a_hole_takes_the_word_of_most_of_its_rim() {
        assert_eq!(closed([7, 7, 9, 7]), [7, 7]);
        assert_eq!(closed([9, 7, 9, 7]), [7, 7], "the smaller of two that are equal");
        assert_eq!(closed([0, 0, 9, 0]), [0, 0], "most of it says nothing");
        assert_eq!(closed([0; 4]), [0, 0]);
    }
}
