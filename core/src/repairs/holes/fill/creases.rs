//! Sharp edges that end at a hole: may they go on across it?
//!
//! A patch over a hole in flat surface is all that is missing. Where a sharp edge of the surface runs into the hole, and comes out of it elsewhere, the
//! surface was bent on the way: the edge goes on from the one end to the other.

use glam::DVec3;

use crate::detect::coned_volume::cone;
use crate::detect::holes::loops::Loop;
use crate::submesh::{Origin, Submesh, Vertex};

/// Cosine of the angle between the two sides of an edge that is sharp: 40°.
const SHARP: f64 = 0.766;
/// Cosine of the angle by which an edge may turn away from the straight way to where it goes on: 60°, half of the turn of an arc.
pub(super) const ARC: f64 = 0.5;
/// The same, where planes go on to where they meet: edges that end in a lost corner are not taken for one.
pub(super) const STRAIGHT: f64 = 0.94;
/// An edge goes on as one whose angle differs by less: as a difference of cosines.
const ALIKE: f64 = 0.3;
/// Edges that end at one hole, at most: where there are more, the surface is rough.
const MOST_ENDS: usize = 16;
/// Triangles around a vertex, at most: of more, it is no end.
const MOST_AROUND: usize = 64;

/// A sharp edge that ends at a rim.
struct End {
    /// Number of the vertex in the rim.
    at: usize,
    place: DVec3,
    /// The way on, into the hole; of unit length.
    way: DVec3,
    /// Cosine of the angle between its sides, 1 in flat surface.
    cosine: f64,
    is_convex: bool,
}

/// The volume between a patch that encloses `under` as seen from a place `from`, and flat pieces between the edges that go on across a hole; 0 if
/// none does. O(rim).
pub(super) fn beyond(submesh: &Submesh, rim: &Loop, straight: f64, (under, from): (f64, DVec3)) -> f64 {
    let chords = chords(&ends(submesh, rim), straight);
    if chords.is_empty() {
        return 0.0;
    }
    let of_rim = |piece: &Vec<usize>| piece.iter().map(|i| rim.vertices[*i]).collect::<Vec<Vertex>>();
    let flat: f64 = pieces(rim.vertices.len(), &chords).iter().map(|piece| cone(from, submesh, &of_rim(piece))).sum();
    flat - under
}

/// The sharp edges that end at a rim, in its order; none if it is rough.
fn ends(submesh: &Submesh, rim: &Loop) -> Vec<End> {
    let mut ends = Vec::new();
    for (at, &v) in rim.vertices.iter().enumerate() {
        ends.extend(end_at(submesh, v).map(|(way, cosine, is_convex)| End {
            at,
            place: submesh.place(v),
            way,
            cosine,
            is_convex,
        }));
        if ends.len() > MOST_ENDS {
            return Vec::new();
        }
    }
    ends
}

/// The sharpest edge of what was there before around a vertex: its way to the vertex, the cosine of its angle, is it convex.
fn end_at(submesh: &Submesh, v: Vertex) -> Option<(DVec3, f64, bool)> {
    let is_given = |t: u32| !matches!(submesh.triangles[t as usize].origin, Origin::Added(_));
    let around: Vec<(u32, usize)> = submesh.star(v).filter(|(t, _)| is_given(*t)).take(MOST_AROUND + 1).collect();
    if around.len() > MOST_AROUND {
        return None;
    }
    let corners = |t: u32| submesh.triangles[t as usize].v;
    let mut sharpest: Option<(DVec3, f64, bool)> = None;
    for &(t, k) in &around {
        let (other, apex) = (corners(t)[(k + 1) % 3], corners(t)[(k + 2) % 3]);
        // The triangle on the other side comes to `v` from there.
        let Some(&(across, _)) = around.iter().find(|(s, j)| corners(*s)[(j + 2) % 3] == other) else { continue };
        let normals = [t, across].map(|t| submesh.normal(t).normalize_or_zero());
        let cosine = normals[0].dot(normals[1]);
        if cosine < SHARP && sharpest.is_none_or(|(_, least, _)| cosine < least) {
            let is_convex = normals[1].dot(submesh.vector(v, apex)) < 0.0;
            sharpest = Some((submesh.vector(other, v).normalize_or_zero(), cosine, is_convex));
        }
    }
    sharpest
}

/// Which edges go on as which others, with at least this cosine at both ends, as places in the rim: the straightest first, none across another one.
fn chords(ends: &[End], at_least: f64) -> Vec<[usize; 2]> {
    let mut pairs: Vec<(f64, [usize; 2])> = Vec::new();
    for (i, a) in ends.iter().enumerate() {
        for b in &ends[i + 1..] {
            let along = (b.place - a.place).normalize_or_zero();
            let straight = a.way.dot(along).min(-b.way.dot(along));
            if straight > at_least && (a.cosine - b.cosine).abs() < ALIKE && a.is_convex == b.is_convex {
                pairs.push((straight, [a.at, b.at]));
            }
        }
    }
    pairs.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let mut chords: Vec<[usize; 2]> = Vec::new();
    for (_, [a, b]) in pairs {
        let is_inside = |i: usize| a < i && i < b;
        let is_free = chords.iter().all(|c| !c.contains(&a) && !c.contains(&b) && is_inside(c[0]) == is_inside(c[1]));
        if is_free {
            chords.push([a, b]);
        }
    }
    chords
}

/// The parts of a rim of so many vertices between chords that do not cross.
fn pieces(n: usize, chords: &[[usize; 2]]) -> Vec<Vec<usize>> {
    let mut pieces: Vec<Vec<usize>> = vec![(0..n).collect()];
    for &[a, b] in chords {
        let Some(i) = pieces.iter().position(|piece| piece.contains(&a) && piece.contains(&b)) else { continue };
        let piece = pieces.swap_remove(i);
        pieces.push(piece.iter().copied().filter(|i| (a..=b).contains(i)).collect());
        pieces.push(piece.into_iter().filter(|i| *i <= a || *i >= b).collect());
    }
    pieces
}

#[cfg(test)]
mod tests {
    use super::*;

    fn end(at: usize, place: [f64; 3], way: [f64; 3]) -> End {
        End { at, place: place.into(), way: way.into(), cosine: 0.0, is_convex: true }
    }

    /// An edge along x that lost its middle: it goes on, straight. One that leaves the hole upwards does not.
    #[test]
    fn an_edge_goes_on_to_where_it_comes_out() {
        let [left, right] = [end(1, [0.0; 3], [1.0, 0.0, 0.0]), end(4, [1.0, 0.0, 0.0], [-1.0, 0.0, 0.0])];
        let up = end(2, [0.5, 0.0, 0.0], [0.0, 0.0, 1.0]);
        assert_eq!(chords(&[left, up, right], ARC), [[1, 4]]);
        assert_eq!(chords(&[end(0, [0.0; 3], [-1.0, 0.0, 0.0]), end(2, [1.0, 0.0, 0.0], [1.0, 0.0, 0.0])], ARC), [[0; 2]; 0]);
    }

    #[test]
    fn edges_that_would_cross_one_that_goes_on_end() {
        let all = [
            end(0, [0.0, 0.0, 0.0], [1.0, 0.0, 0.0]),
            end(1, [0.5, 0.5, 0.0], [0.6, -0.8, 0.0]),
            end(2, [1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]),
            end(3, [0.5, -0.5, 0.0], [0.6, 0.8, 0.0]),
        ];
        assert_eq!(chords(&all, ARC), [[0, 2]]);
    }

    #[test]
    fn chords_cut_a_rim_into_pieces() {
        let mut got = pieces(8, &[[1, 4], [5, 7]]);
        got.sort();
        assert_eq!(got, [vec![0, 1, 4, 5, 7], vec![1, 2, 3, 4], vec![5, 6, 7]]);
    }
}
