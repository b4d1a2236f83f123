//! The proof anew where a few faces of the second mesh have changed since the last proof.
//!
//! A place of the first mesh that was near to the second one is so still, unless it was near to a face that is gone: only triangles as near as that to
//! such a face are asked about. Faces that did not change are as near to the first mesh as before. All this is proved of parts of both
//! meshes: the distance from a part is not less than that from the whole.

use rayon::prelude::*;

use crate::geometry::boxes::BoxTree;
use crate::geometry::exact::Point;
use crate::geometry::sums::Bounds;
use crate::geometry::tri_tri::Triangle;
use crate::proof::map::BLOCK;
use crate::proof::pairing::Pairing;
use crate::proof::proving::{Asked, Proved, Verdict, prove_of};
use crate::util::ids::NONE;

/// Faces that have changed since a proof.
pub(crate) struct Changes<'a> {
    /// Faces of the second mesh that are gone.
    pub(crate) gone: Vec<Triangle>,
    /// Which of its faces are new.
    pub(crate) is_fresh: Vec<bool>,
    /// The proof.
    pub(crate) verdict: &'a Verdict,
}

/// Parts of both meshes.
struct Part {
    points: Vec<Point>,
    faces: Vec<[u32; 3]>,
    new_points: Vec<Point>,
    new_faces: Vec<[u32; 3]>,
    became: Vec<u32>,
    open: Vec<u32>,
    /// The numbers of faces of both in the wholes.
    origins: [Vec<u32>; 2],
}

/// Proves bounds where faces have changed, for the same `most`. O(n) with a small constant, and what [`super::prove`] takes for what has changed.
pub(crate) fn prove_again(pairing: &Pairing<'_>, changes: &Changes<'_>, (most, enough): (f64, f64)) -> Verdict {
    let before = changes.verdict;
    let is_asked = asked(pairing, changes, most);
    let part = Part::new(pairing, &is_asked, changes, most);
    let [first, second] = [(&is_asked, 0), (&changes.is_fresh, 1)]
        .map(|(is, k): (&Vec<bool>, usize)| part.origins[k].iter().map(|f| is[*f as usize]).collect::<Vec<_>>());
    let own = Pairing {
        points: &part.points,
        faces: &part.faces,
        new_points: &part.new_points,
        new_faces: &part.new_faces,
        became: &part.became,
        open: &part.open,
    };
    let verdict = prove_of(&own, Some(&Asked { first: &first, second: &second }), (most, enough));
    let proved = Proved {
        forward: verdict.proved.forward.max(before.within[0]),
        backward: verdict.proved.backward.max(before.within[1]),
        searched: before.proved.searched + verdict.proved.searched,
    };
    Verdict {
        proved,
        far: verdict.far.iter().map(|(f, bound)| (part.origins[0][*f as usize], *bound)).collect(),
        under: verdict.under.iter().map(|f| part.origins[1][*f as usize]).collect(),
        within: [0, 1].map(|k| verdict.within[k].max(before.within[k])),
    }
}

/// The box of all places as near to a triangle.
fn around(triangle: &Triangle, reach: f64) -> Bounds {
    let mut bounds = Bounds::of(triangle);
    bounds.lo = bounds.lo.map(|x| ((f64::from(x) - reach) as f32).next_down());
    bounds.hi = bounds.hi.map(|x| ((f64::from(x) + reach) as f32).next_up());
    bounds
}

/// Which triangles of the first mesh are asked about: those that may have been near to a face that is gone, and those that were far.
fn asked(pairing: &Pairing<'_>, changes: &Changes<'_>, most: f64) -> Vec<bool> {
    let boxes: Vec<Bounds> = changes.gone.iter().map(|t| Bounds::of(t)).collect();
    let tree = BoxTree::new(&boxes);
    let is_near = |face: &[u32; 3]| tree.meets(&around(&face.map(|v| pairing.points[v as usize]), most));
    let mut is_asked: Vec<bool> = pairing.faces.par_iter().with_min_len(BLOCK).map(is_near).collect();
    changes.verdict.far.iter().for_each(|(f, _)| is_asked[*f as usize] = true);
    is_asked
}

/// The numbers of faces that have one of these vertices, in order.
fn touching(faces: &[[u32; 3]], is_wanted: impl Fn(u32) -> bool + Sync) -> Vec<u32> {
    let has = |f: &u32| faces[*f as usize].iter().any(|v| is_wanted(*v));
    (0..faces.len() as u32).into_par_iter().with_min_len(BLOCK).filter(has).collect()
}

/// Numbers of those of some vertices that faces have, in order, and how many there are.
fn numbers(count: usize, faces: &[[u32; 3]], chosen: &[u32]) -> Vec<u32> {
    let mut numbers = vec![NONE; count];
    chosen.iter().flat_map(|f| faces[*f as usize]).for_each(|v| numbers[v as usize] = 0);
    (0..).zip(numbers.iter_mut().filter(|number| **number == 0)).for_each(|(i, number)| *number = i);
    numbers
}

/// The entries of vertices that have numbers.
fn numbered<T: Copy>(all: &[T], numbers: &[u32]) -> Vec<T> {
    all.iter().zip(numbers).filter(|(_, number)| **number != NONE).map(|(one, _)| *one).collect()
}

impl Part {
    fn new(pairing: &Pairing<'_>, is_asked: &[bool], changes: &Changes<'_>, most: f64) -> Self {
        let new_count = pairing.new_points.len();
        // The new faces in reach of what is asked about, or around what its vertices became.
        let asked: Vec<u32> = (0..is_asked.len() as u32).filter(|f| is_asked[*f as usize]).collect();
        let boxes: Vec<Bounds> =
            asked.iter().map(|f| around(&pairing.faces[*f as usize].map(|v| pairing.points[v as usize]), most)).collect();
        let tree = BoxTree::new(&boxes);
        let is_near = |f: u32| {
            let face = pairing.new_faces[f as usize].map(|v| pairing.new_points[v as usize]);
            changes.is_fresh[f as usize] || tree.meets(&Bounds::of(&face))
        };
        let near: Vec<u32> =
            (0..pairing.new_faces.len() as u32).into_par_iter().with_min_len(BLOCK).filter(|f| is_near(*f)).collect();
        let mut is_wanted = vec![false; new_count];
        near.iter().flat_map(|f| pairing.new_faces[*f as usize]).for_each(|v| is_wanted[v as usize] = true);
        let ends = asked.iter().flat_map(|f| pairing.faces[*f as usize]);
        ends.for_each(|v| is_wanted[pairing.became[v as usize] as usize] = true);
        // Of the first mesh all that went there, and of the second all around what that became.
        let own = touching(pairing.faces, |v| is_wanted[pairing.became[v as usize] as usize]);
        let all = own.iter().flat_map(|f| pairing.faces[*f as usize]);
        all.for_each(|v| is_wanted[pairing.became[v as usize] as usize] = true);
        let new = touching(pairing.new_faces, |v| is_wanted[v as usize]);
        let of_first = numbers(pairing.points.len(), pairing.faces, &own);
        let of_second = numbers(new_count, pairing.new_faces, &new);
        Self {
            points: numbered(pairing.points, &of_first),
            faces: own.iter().map(|f| pairing.faces[*f as usize].map(|v| of_first[v as usize])).collect(),
            new_points: numbered(pairing.new_points, &of_second),
            new_faces: new.iter().map(|f| pairing.new_faces[*f as usize].map(|v| of_second[v as usize])).collect(),
            became: numbered(pairing.became, &of_first).into_iter().map(|v| of_second[v as usize]).collect(),
            open: open(pairing, &own, &of_first),
            origins: [own, new],
        }
    }
}

/// The vertices of a part of the first mesh whose triangles form no closed fan in it.
fn open(pairing: &Pairing<'_>, own: &[u32], numbers: &[u32]) -> Vec<u32> {
    let mut counts = vec![0_i32; pairing.points.len()];
    pairing.faces.as_flattened().iter().for_each(|v| counts[*v as usize] += 1);
    own.iter().flat_map(|f| pairing.faces[*f as usize]).for_each(|v| counts[v as usize] -= 1);
    let mut is_open: Vec<bool> = counts.into_iter().map(|count| count > 0).collect();
    pairing.open.iter().for_each(|v| is_open[*v as usize] = true);
    numbers.iter().zip(is_open).filter(|(number, is_open)| **number != NONE && *is_open).map(|(number, _)| *number).collect()
}
