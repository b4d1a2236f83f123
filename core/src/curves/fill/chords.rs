//! Edges that lie on each other in space, divided.
//!
//! A surface of revolution that is cut open has each point of the cut twice on its rim. Edges from both of them to one point are two on the
//! map and one in space, and triangles between them lie on each other; with a point in the middle of each such edge, they do not. The same
//! holds of two outlines that share two curves, as the halves of a cone do: an edge from one of these to the other may be in both.

use std::collections::{BTreeMap, BTreeSet};

use rayon::prelude::*;

use super::layout::Corner;
use super::lifted::Lifted;

/// A point of the mesh in space: kind and number.
type Key = (u8, u32);
/// Edges on the map by their ends, and how many triangles each has.
type Edges = BTreeMap<(u32, u32), u32>;

/// Ends of an edge within an outline, both on its rim: numbers of points of the mesh, the lower one first.
pub(super) type Chord = [u32; 2];

/// Chords of each outline that other outlines have too, all but those of the first one, and all that are edges of curves, whose points are given.
/// O(triangles · log triangles + points · log chords).
pub(super) fn shared<'a>(meshes: &[&[[Corner; 3]]], curves: impl ParallelIterator<Item = &'a [(f64, u32)]>) -> Vec<Vec<Chord>> {
    let within: Vec<Vec<Chord>> = meshes.par_iter().map(|triangles| chords(triangles)).collect();
    let mut all: Vec<(Chord, usize)> =
        within.iter().enumerate().flat_map(|(mesh, chords)| chords.iter().map(move |chord| (*chord, mesh))).collect();
    all.sort_unstable();
    let on_curves: BTreeSet<Chord> = curves
        .flat_map_iter(|points| points.windows(2))
        .filter_map(|pair| if let &[(_, a), (_, b)] = pair { Some([a.min(b), a.max(b)]) } else { None })
        .filter(|chord| all.binary_search_by(|(other, _)| other.cmp(chord)).is_ok())
        .collect();
    let mut shared = vec![Vec::new(); meshes.len()];
    for group in all.chunk_by(|a, b| a.0 == b.0) {
        let first = group.first().filter(|(chord, _)| !on_curves.contains(chord)).map(|(_, mesh)| *mesh);
        for (chord, mesh) in group.iter().filter(|(_, mesh)| Some(*mesh) != first) {
            shared.iter_mut().skip(*mesh).take(1).for_each(|own| own.push(*chord));
        }
    }
    shared
}

/// Edges of two triangles whose ends are on the rim.
fn chords(triangles: &[[Corner; 3]]) -> Vec<Chord> {
    let mut edges: Vec<Chord> = Vec::new();
    for [a, b, c] in triangles {
        for pair in [[a, b], [b, c], [c, a]] {
            if let [Corner::Rim(p), Corner::Rim(q)] = pair {
                edges.push([*p.min(q), *p.max(q)]);
            }
        }
    }
    edges.sort_unstable();
    edges.chunk_by(|a, b| a == b).filter(|group| group.len() > 1).filter_map(|group| group.first().copied()).collect()
}

/// Divides edges within that are not the only ones between their ends in space, and those between the ends of `others`, which are in order.
/// The first points of the mesh are `corners`. O(triangles · log triangles), nothing where no point is twice on the rim and there are no others.
pub(super) fn divide(lifted: &mut Lifted<'_>, corners: &[Corner], others: &[Chord]) {
    let mut known = BTreeSet::new();
    if others.is_empty() && corners.iter().all(|corner| known.insert(key(corner))) {
        return;
    }
    let place = |number: u32| corners.get(number as usize).map_or((2, number), key);
    let mut uses: BTreeMap<(Key, Key), Edges> = BTreeMap::new();
    for (a, b) in lifted.flat.triangles.iter().flat_map(sides) {
        let (p, q) = (place(a), place(b));
        *uses.entry((p.min(q), p.max(q))).or_default().entry((a.min(b), a.max(b))).or_default() += 1;
    }
    let mut middles: BTreeMap<(u32, u32), u32> = BTreeMap::new();
    let is_other = |ends: &(Key, Key)| matches!(ends, ((0, a), (0, b)) if others.binary_search(&[*a, *b]).is_ok());
    let many = uses.iter().filter(|(ends, edges)| ends.0 == ends.1 || edges.len() > 1 || is_other(ends));
    // An edge of the rim has one triangle.
    for (ends, _) in many.flat_map(|(_, edges)| edges).filter(|(_, count)| **count == 2) {
        let [p, q] = [lifted.place(ends.0), lifted.place(ends.1)];
        let middle = [0.5 * (p[0] + q[0]), 0.5 * (p[1] + q[1])];
        middles.insert(*ends, lifted.points.len() as u32);
        let point = lifted.lift(middle);
        lifted.points.push(point);
        lifted.flat.places.push(middle);
    }
    let triangles = std::mem::take(&mut lifted.flat.triangles);
    lifted.flat.triangles = triangles.into_iter().flat_map(|triangle| parts(triangle, &middles)).collect();
}

fn key(corner: &Corner) -> Key {
    match corner {
        Corner::Rim(number) => (0, *number),
        Corner::Inner(number) => (1, *number),
    }
}

fn sides([a, b, c]: &[u32; 3]) -> [(u32, u32); 3] {
    [(*a, *b), (*b, *c), (*c, *a)]
}

/// A triangle with its divided sides: one to four of them, turned as it is.
fn parts(triangle: [u32; 3], middles: &BTreeMap<(u32, u32), u32>) -> Vec<[u32; 3]> {
    let middle = |(a, b): (u32, u32)| middles.get(&(a.min(b), a.max(b))).copied();
    let around = sides(&triangle).map(middle);
    // The polygon of corners and middles, and a fan from its first middle; of three middles, the triangle between them stays.
    if let [Some(p), Some(q), Some(r)] = around {
        let [a, b, c] = triangle;
        return vec![[a, p, r], [p, b, q], [r, q, c], [p, q, r]];
    }
    let ring: Vec<u32> = triangle.into_iter().zip(around).flat_map(|(corner, middle)| [Some(corner), middle]).flatten().collect();
    let Some(first) = around.iter().flatten().next().and_then(|middle| ring.iter().position(|number| number == middle)) else {
        return vec![triangle];
    };
    let at = |step: usize| ring.get((first + step) % ring.len()).copied().unwrap_or_default();
    (1..ring.len() - 1).map(|step| [at(0), at(step), at(step + 1)]).collect()
}

#[cfg(test)]
mod tests {
    use super::super::{Options, Outline, fill};
    use super::*;
    use crate::curves::Use;
    use crate::curves::curve::{Arc, Shape};

    #[test]
    fn triangles_are_divided_along_their_chords() {
        let middles: BTreeMap<(u32, u32), u32> = [((0, 1), 10), ((1, 2), 11), ((0, 2), 12)].into();
        let area = |triangles: &[[u32; 3]]| {
            let place = |number: u32| match number {
                0 => [0.0, 0.0],
                1 => [4.0, 0.0],
                2 => [0.0, 4.0],
                10 => [2.0, 0.0],
                11 => [2.0, 2.0],
                _ => [0.0, 2.0],
            };
            let of = |t: &[u32; 3]| {
                let [a, b, c]: [[f64; 2]; 3] = t.map(place);
                0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))
            };
            assert!(triangles.iter().all(|triangle| of(triangle) > 0.0), "{triangles:?}");
            triangles.iter().map(of).sum::<f64>()
        };
        for count in 0..=3 {
            let some: BTreeMap<(u32, u32), u32> = middles.iter().take(count).map(|(ends, middle)| (*ends, *middle)).collect();
            let made = parts([0, 1, 2], &some);
            assert_eq!((made.len(), area(&made)), (count + 1, 8.0));
        }
    }

    /// A cone that is cut open from its apex to its circle: no two triangles have the same corners, coarse as it is.
    #[test]
    fn triangles_at_the_apex_of_a_cone_do_not_lie_on_each_other() {
        let circle = Arc::new([0.0; 3], [[35.0, 0.0, 0.0], [0.0, 35.0, 0.0]], [0.0, std::f64::consts::TAU]).unwrap();
        let shapes = [Shape::Arc(circle), Shape::Line([[35.0, 0.0, 0.0], [0.0, 0.0, 100.0]])];
        let uses = [(0, false), (1, false), (1, true)].map(|(curve, is_reversed)| Use { curve, is_reversed });
        let outline = Outline { outer: uses.to_vec(), inner: Vec::new() };
        let shapes: Vec<&Shape> = shapes.iter().collect();
        for chord in [0.02, 0.2, 2.0] {
            let options = Options { chord: Some(chord), ..Options::default() };
            let filled = fill(&shapes, std::slice::from_ref(&outline), &options).unwrap();
            let mut sets: Vec<[u32; 3]> = filled.mesh.triangles.clone();
            sets.iter_mut().for_each(|set| set.sort_unstable());
            sets.sort_unstable();
            assert!(sets.len() > 10 && sets.windows(2).all(|pair| pair[0] != pair[1]), "{chord}");
            assert!(sets.iter().all(|[a, b, c]| a != b && b != c), "{chord}");
        }
    }

    /// Two halves of a cone, which share two straight lines, and the disc below: each edge of the mesh has one triangle on each side.
    #[test]
    fn halves_of_a_cone_share_no_chord() {
        let half =
            |from: f64| Arc::new([0.0; 3], [[35.0, 0.0, 0.0], [0.0, 35.0, 0.0]], [from, from + std::f64::consts::PI]).unwrap();
        let line = |x: f64| Shape::Line([[x, 0.0, 0.0], [0.0, 0.0, 100.0]]);
        let shapes = [Shape::Arc(half(0.0)), Shape::Arc(half(std::f64::consts::PI)), line(35.0), line(-35.0)];
        let outline = |uses: &[(usize, bool)]| {
            let outer = uses.iter().map(|&(curve, is_reversed)| Use { curve, is_reversed }).collect();
            Outline { outer, inner: Vec::new() }
        };
        let outlines = [
            outline(&[(0, false), (3, false), (2, true)]),
            outline(&[(1, false), (2, false), (3, true)]),
            outline(&[(1, true), (0, true)]),
        ];
        let shapes: Vec<&Shape> = shapes.iter().collect();
        for chord in [0.02, 0.2, 2.0, 20.0] {
            let options = Options { chord: Some(chord), ..Options::default() };
            let mesh = fill(&shapes, &outlines, &options).unwrap().mesh;
            let mut edges: BTreeMap<(u32, u32), i32> = BTreeMap::new();
            for (a, b) in mesh.triangles.iter().flat_map(sides) {
                *edges.entry((a, b)).or_default() += 1;
            }
            assert!(edges.iter().all(|((a, b), count)| *count == 1 && edges.get(&(*b, *a)) == Some(&1)), "{chord}");
        }
    }
}
