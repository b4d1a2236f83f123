//! Flat surface that goes on to where it meets other flat surface: a patch of a few planes for a loop that is in none.
//!
//! The loop is cut into runs that lie in a plane each (`runs`): along a face that is missing whole, or across one that lacks a part. These planes
//! bound what is missing, so the patch is made of them, up to the lines and points where they meet (`peel`): an edge of a box that is lost
//! is an edge again, and a corner a corner. Coordinates of new vertices are those of the loop's where planes are parallel to an axis.
//!
//! Where the loop runs through two or three planes of the surface beyond it, and no others, these tell an edge or a corner. Else any hexagon is three
//! planes, so that a plane needs a witness: surface that lies in it, a fourth corner of the loop, or right angles to all surface along it. Floating point finds the patch; whether it is valid is decided with exact predicates. O(n²), for most loops on
//! curved surface O(n).

mod peel;
mod runs;
#[cfg(test)]
mod tests;

use glam::DVec3;

use super::triangulate::{Rim, directed_area, in_plane, stands};
use crate::geometry::exact::{Point, at};
use crate::geometry::sums::step_at;
use peel::{Search, Shown};
use runs::{Lie, lie};

/// Vertices of a loop that is looked at.
const MOST_VERTICES: usize = 2048;
/// Vertices are in a plane that they are off by less than this share of the loop's size: decimals of five digits.
const OFF_PLANE: f64 = 1e-5;
/// Sine of the angle at which pieces meet, at least: what bends less may be bent surface.
const FOLD: f64 = 0.25;
/// And the cosine between their normals, at least: less is no wedge that anybody would print.
const SHARPEST: f64 = -0.95;
/// Cosine of a right angle, at most, and of none, at least.
const SQUARE: f64 = 0.02;
const SAME: f64 = 0.9999;
/// Corners of a plane that need no other witness.
const CORNERS: usize = 4;
/// Sine of the turn at a corner, at least.
const TURN: f64 = 0.2;
/// Right angles witness a plane in which they hold along a run that is this wide for its length: beside a shallow arc there are some, too.
const BROAD: f64 = 0.05;
/// A plane that no surface lies in is known if the loop has this share of its outline: more than one side of four.
const KNOWN: f64 = 1.0 / 3.0;

/// A patch of flat pieces.
#[derive(Debug)]
pub(crate) struct Extended {
    /// New vertices, numbered from the loop's size on.
    pub(crate) added: Vec<Point>,
    pub(crate) triangles: Vec<[u32; 3]>,
    /// A piece of it stands at right angles to what is around because nothing says how else.
    pub(crate) assumed: bool,
    /// The loop runs through the planes of surface beyond it, and through no other.
    told: bool,
    /// How many pieces there are, and how many of them lie in the plane of no surface.
    pieces: [usize; 2],
    /// The volume under it, seen from the loop's centre.
    pub(crate) volume: f64,
    /// The volume by which another patch like it differs.
    pub(crate) in_doubt: f64,
}

/// Do all of these places lie in one plane, as well as they are known?
pub(crate) fn lie_in_a_plane(points: &[Point]) -> bool {
    let places: Vec<DVec3> = points.iter().map(at).collect();
    let (_, _, tolerance) = measure(points, &places);
    matches!(lie(places.iter().copied(), tolerance), Lie::Plane(_))
}

/// The middle of a loop's vertices, how far they are from it at most, and how well they are known.
fn measure(points: &[Point], places: &[DVec3]) -> (DVec3, f64, f64) {
    let centre = places.iter().sum::<DVec3>() / places.len() as f64;
    let radius = places.iter().map(|p| p.distance(centre)).fold(0.0, f64::max);
    let largest = points.as_flattened().iter().fold(0.0_f32, |most, x| most.max(x.abs()));
    (centre, radius, 4.0 * step_at(largest) + 2.0 * OFF_PLANE * radius)
}

/// Closes a loop by flat pieces that meet at clear angles; `None` where these do not explain it. `may_add`: new vertices.
pub(crate) fn extend(rim: &Rim<'_>, may_add: bool) -> Option<Extended> {
    let n = rim.points.len();
    if !(4..=MOST_VERTICES).contains(&n) || !rim.points.as_flattened().iter().all(|x| x.is_finite()) {
        return None;
    }
    let places: Vec<DVec3> = rim.points.iter().map(at).collect();
    let (centre, radius, tolerance) = measure(rim.points, &places);
    let beyond: Vec<Option<DVec3>> = (0..n)
        .map(|i| {
            let (a, b, apex) = (places[i], places[(i + 1) % n], at(&(*rim.apexes.get(i)?)?));
            // A sliver tells no direction.
            let normal = (a - b).cross(apex - b);
            (normal.length() > 4.0 * tolerance * a.distance(b)).then(|| normal.normalize_or_zero())
        })
        .collect();
    let outline: Vec<u32> = (0..n as u32).collect();
    let mut found: Vec<Extended> = Vec::new();
    let show = |shown: &Shown<'_>| found.extend(accepted(rim, &beyond, tolerance, shown));
    let mut search = Search::new(rim.points, &beyond, tolerance, (centre, radius), show);
    search.may_add = may_add;
    search.peel_told();
    search.peel(&outline);
    // Of equal ones the first.
    let (best, _) = found.iter().enumerate().min_by_key(|(i, patch)| (patch.assumed, !patch.told, patch.pieces, *i))?;
    let mut best = found.swap_remove(best);
    // Where surface tells all planes, one that it does not tell may be another guess, but not several.
    let speaks = |other: &&Extended| !best.told || other.pieces[1] < 2;
    best.in_doubt = found.iter().filter(speaks).map(|other| (other.volume - best.volume).abs()).fold(0.0, f64::max);
    Some(best)
}

/// These pieces as a patch, if each plane has a witness, they meet at clear angles, and the patch is valid.
fn accepted(rim: &Rim<'_>, beyond: &[Option<DVec3>], tolerance: f64, shown: &Shown<'_>) -> Option<Extended> {
    let &Shown { points, pieces, told } = shown;
    if pieces.len() < 2 {
        return None;
    }
    let outlines: Vec<Vec<Point>> = pieces.iter().map(|piece| piece.iter().map(|v| points[*v as usize]).collect()).collect();
    let normals: Vec<DVec3> = outlines.iter().map(|outline| directed_area(outline).normalize_or_zero()).collect();
    let (mut assumed, mut unseen) = (false, 0);
    for (piece, normal) in pieces.iter().zip(&normals).filter(|_| !told) {
        match witness(piece, *normal, beyond, tolerance, points) {
            Witness::Surface => {}
            Witness::Corners => unseen += 1,
            Witness::Assumed => {
                assumed = true;
                unseen += 1;
            }
            Witness::None => return None,
        }
    }
    if !fold_clearly(pieces, &normals) {
        return None;
    }
    let mut triangles = Vec::new();
    for (piece, outline) in pieces.iter().zip(&outlines) {
        let n = rim.points.len() as u32;
        let forbidden = |i: u32, j: u32| {
            let [a, b] = [piece[i as usize], piece[j as usize]];
            a < n && b < n && !rim.allows(a, b)
        };
        let made = in_plane(&Rim { points: outline, apexes: &[], obstacles: &[], forbidden: &forbidden })?;
        triangles.extend(made.into_iter().map(|t| t.map(|i| piece[i as usize])));
    }
    let n = rim.points.len();
    let centre = rim.points.iter().map(at).sum::<DVec3>() / n as f64;
    let volume = triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|v| at(&points[v as usize]) - centre);
            a.cross(b).dot(c) / 6.0
        })
        .sum();
    let added = points[n..].to_vec();
    stands(rim, points, &triangles).then_some(Extended {
        added,
        triangles,
        assumed,
        told,
        pieces: [pieces.len(), unseen],
        volume,
        in_doubt: 0.0,
    })
}

/// The reason to take it that there is a plane.
enum Witness {
    None,
    /// It holds one line of the loop, or little more, at right angles to the surface beyond.
    Assumed,
    /// Corners of the loop, or right angles.
    Corners,
    /// Surface that lies in it.
    Surface,
}

fn witness(piece: &[u32], normal: DVec3, beyond: &[Option<DVec3>], tolerance: f64, points: &[Point]) -> Witness {
    let n = beyond.len();
    let place = |v: u32| at(&points[v as usize]);
    let edges: Vec<[u32; 2]> = (0..piece.len())
        .map(|i| [piece[i], piece[(i + 1) % piece.len()]])
        .filter(|[a, b]| (*a as usize) < n && (*a as usize + 1) % n == *b as usize)
        .collect();
    let cosine = |edge: &[u32; 2]| beyond[edge[0] as usize].map(|b| b.dot(normal));
    let tells = |wanted: &dyn Fn(f64) -> bool, broad: f64| {
        let ends = edges.iter().filter(|e| cosine(e).is_some_and(wanted)).flatten().map(|v| place(*v));
        let ends: Vec<DVec3> = ends.collect();
        let length = ends.iter().map(|p| p.distance(ends[0])).fold(0.0, f64::max);
        !matches!(lie(ends.iter().copied(), tolerance.max(broad * length)), Lie::Line)
    };
    if tells(&|c| c > SAME, 0.0) {
        return Witness::Surface;
    }
    // Most of its outline is to be found yet.
    let length = |[a, b]: [u32; 2]| place(a).distance(place(b));
    let known: f64 = edges.iter().map(|edge| length(*edge)).sum();
    let whole: f64 = (0..piece.len()).map(|i| length([piece[i], piece[(i + 1) % piece.len()]])).sum();
    let corners = if known < KNOWN * whole { Witness::Assumed } else { Witness::Corners };
    let turns = |i: &usize| {
        let [before, here, after] = [i + piece.len() - 1, *i, i + 1].map(|i| place(piece[i % piece.len()]));
        (here - before).normalize_or_zero().cross((after - here).normalize_or_zero()).length() > TURN
    };
    if (0..piece.len()).filter(|i| (piece[*i] as usize) < n && turns(i)).count() >= CORNERS {
        return corners;
    }
    let is_square = |c: f64| c > SAME || c.abs() < SQUARE;
    if edges.is_empty() || !edges.iter().all(|e| cosine(e).is_none_or(is_square)) {
        return Witness::None;
    }
    match (tells(&is_square, BROAD), tells(&is_square, 0.0)) {
        (true, _) => corners,
        (false, false) => Witness::Assumed,
        (false, true) => Witness::None,
    }
}

/// Do pieces meet at angles at which no smooth surface is bent?
fn fold_clearly(pieces: &[Vec<u32>], normals: &[DVec3]) -> bool {
    let sides = |piece: &[u32]| -> Vec<[u32; 2]> { (0..piece.len()).map(|i| [piece[i], piece[(i + 1) % piece.len()]]).collect() };
    let mut all: Vec<([u32; 2], bool, usize)> = Vec::new();
    for (p, piece) in pieces.iter().enumerate() {
        all.extend(sides(piece).into_iter().map(|[a, b]| ([a.min(b), a.max(b)], a < b, p)));
    }
    all.sort_unstable();
    all.chunk_by(|a, b| a.0 == b.0).all(|same| match same {
        [_] => true,
        [(_, _, p), (_, _, q)] => {
            let (a, b) = (normals[*p], normals[*q]);
            a.cross(b).length() >= FOLD && a.dot(b) >= SHARPEST
        }
        _ => false,
    })
}
