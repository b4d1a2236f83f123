//! Closing one boundary loop with triangles between its vertices.
//!
//! A loop of n vertices takes n − 2 triangles and no new vertex: a triangulated polygon. The first patch that stands the exact
//! tests of `Rim::accepts` wins. Tried are, in this order: the triangle itself; a constrained Delaunay triangulation in the
//! plane of a nearly planar loop (`planar`); for loops of some hundred vertices the minimum-weight triangulation by dynamic
//! programming (`minweight`), for larger ones an advancing front (`front`); where these cross themselves, another weight, the
//! projection of a loop that is not planar, for small loops the front, and at last, for very small ones, any patch (`search`).
//! Where the triangles that a valid patch may have make no triangulation, none of the rest is tried.
//!
//! Floating point only ever ranks patches; whether one is valid is decided with exact predicates. Every ranking uses
//! + − × ÷ √ alone and every bound of work is a count, so results are the same everywhere.

mod beside;
mod boxes;
mod clear;
pub(crate) mod flips;
mod front;
mod minweight;
mod patch;
mod planar;
mod rim;
mod search;
pub(crate) mod strip;
mod weights;

use crate::geometry::exact::Point;
use crate::geometry::position::Position;
use clear::Clearance;
use flips::Flips;
use front::Order;
use minweight::{Choice, Weight};
pub(crate) use patch::{Method, Patch, Unfillable};
use patch::{in_order, patch};
pub(crate) use planar::directed_area;
pub(crate) use rim::Rim;
use rim::{Fault, Surroundings, are_distinct, crosses_itself, runs_once};

/// Bounds of the methods. They decide results, so they are part of what makes a repair repeatable.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct FillSettings {
    /// A loop is nearly planar when the root mean square of its vertices' distances from its plane is at most this share of the
    /// square root of the area that it encloses in projection. (A circle of radius r: 0.02 allows 0.035 r.)
    pub planar_deviation: f64,
    /// Largest loop for the minimum-weight triangulation: O(n³) time, O(n²) memory.
    pub minimum_weight_vertices: usize,
    /// Largest loop at all.
    pub max_vertices: usize,
}

impl Default for FillSettings {
    fn default() -> Self {
        Self { planar_deviation: 0.02, minimum_weight_vertices: 300, max_vertices: 100_000 }
    }
}

/// Closes one loop.
///
/// For each patch returned holds, exactly: it is a disc with the loop as its border; no triangle has zero area; no chord is
/// forbidden; it neither crosses nor overlaps itself, nor any of the mesh's triangles along the rim (other triangles of the mesh
/// are the caller's to test). Time: O(n log n) if nearly planar, O(n³) up to [`FillSettings::minimum_weight_vertices`], about
/// O(n log n) beyond.
pub(crate) fn triangulate(rim: &Rim<'_>, settings: &FillSettings) -> Result<Patch, Unfillable> {
    if !rim.is_loop() {
        return Err(Unfillable::NotALoop);
    }
    if rim.len() > settings.max_vertices {
        return Err(Unfillable::TooLarge);
    }
    if rim.on_one_line() {
        return Err(Unfillable::Collinear);
    }
    if rim.len() == 3 {
        let only = [0, 1, 2];
        return if rim.admits(only) && !rim.meets_obstacle(&rim.corners(only)) {
            Ok(Patch { triangles: vec![only], method: Method::Triangle })
        } else {
            Err(Unfillable::Blocked)
        };
    }
    by_methods(rim, settings)
}

/// Any triangulation of a loop: it may cross itself and everything else. `None` for what is no loop, too large or on one line.
pub(crate) fn unchecked(rim: &Rim<'_>) -> Option<Patch> {
    let most = FillSettings::default().minimum_weight_vertices;
    if !rim.is_loop() || rim.on_one_line() || rim.len() > FillSettings::default().max_vertices {
        return None;
    }
    if rim.len() <= most {
        let triangles = minweight::triangulate(rim, Weight::Area, Choice::Any).ok()?;
        return Some(patch(triangles, Method::LeastArea));
    }
    front::triangulate(rim, Order::Chord, most).ok().map(|triangles| patch(triangles, Method::Front))
}

/// A planar loop by its constrained Delaunay triangulation: no triangle is collinear, and none crosses another. `None` where the loop is no simple
/// polygon in its plane, or needs a forbidden chord.
pub(crate) fn in_plane(rim: &Rim<'_>) -> Option<Vec<[u32; 3]>> {
    match rim.len() {
        3 => Some(vec![[0, 1, 2]]),
        _ => planar::triangulate(rim, FillSettings::default().planar_deviation),
    }
}

/// Are these triangles over a loop's vertices, and others behind them in `points`, valid as the loop's patch, as one of [`triangulate`] is? That
/// they close it is the caller's to know.
pub(crate) fn stands(rim: &Rim<'_>, points: &[Point], triangles: &[[u32; 3]]) -> bool {
    let n = rim.len() as u32;
    let allows = |a: u32, b: u32| a >= n || b >= n || rim.allows(a, b);
    let around = Surroundings::new(points, (0..rim.len()).map(|i| rim.neighbour(i)).collect(), &allows);
    let corners = |t: &[u32; 3]| t.map(|v| points[v as usize]);
    are_distinct(points)
        && triangles.iter().all(|t| around.admits(t) && !rim.meets_obstacle(&corners(t)))
        && crosses_itself(points, triangles).is_ok()
}

/// Closes a loop around others, the rims of islands in it, which run the other way round: triangles over the vertices of all, one loop
/// after the other. `joined`: is there an edge of the mesh between vertices of two loops already?
///
/// Valid as a patch of [`triangulate`] is, but for its topology: a disc with a hole for each island. O(n log n), or what [`strip::bridge`] takes
/// for the only one.
pub(crate) fn around_islands(rims: &[&Rim<'_>], joined: &dyn Fn(u32, u32) -> bool) -> Result<Vec<[u32; 3]>, Unfillable> {
    let points: Vec<Point> = rims.iter().flat_map(|rim| rim.points).copied().collect();
    let sizes: Vec<usize> = rims.iter().map(|rim| rim.len()).collect();
    if sizes.iter().any(|size| *size < 3) || u32::try_from(points.len()).is_err() || !are_distinct(&points) {
        return Err(Unfillable::NotALoop);
    }
    let owners: Vec<(usize, u32)> =
        sizes.iter().enumerate().flat_map(|(rim, size)| (0..*size as u32).map(move |i| (rim, i))).collect();
    let allows = |a: u32, b: u32| {
        let ((rim, i), (other, j)) = (owners[a as usize], owners[b as usize]);
        if rim == other { rims[rim].allows(i, j) } else { !joined(a.min(b), a.max(b)) }
    };
    let beyond = rims.iter().flat_map(|rim| (0..rim.len()).map(|i| rim.neighbour(i))).collect();
    let around = Surroundings::new(&points, beyond, &allows);
    let checked = |triangles: Vec<[u32; 3]>| {
        if !triangles.iter().all(|t| around.admits(t)) {
            return Err(Fault::Inadmissible);
        }
        crosses_itself(&points, &triangles).map(|()| in_order(triangles))
    };
    match (planar::between(&points, &sizes).map(checked), rims) {
        (Some(Ok(triangles)), _) => Ok(triangles),
        (_, [outer, inner]) => strip::bridge([outer, inner], joined),
        (Some(Err(fault)), _) => Err(fault.into()),
        (None, _) => Err(Unfillable::Blocked),
    }
}

/// Closes a loop that is in some places more than once, as it walks around islands that touch it: the copies of a place are one vertex of
/// the mesh. Valid as a patch of [`triangulate`] is; no two chords lie between the same places. O(n³), and not for more vertices than
/// [`FillSettings::minimum_weight_vertices`].
pub(crate) fn pinched(rim: &Rim<'_>) -> Result<Vec<[u32; 3]>, Unfillable> {
    if rim.len() > FillSettings::default().minimum_weight_vertices {
        return Err(Unfillable::TooLarge);
    }
    let place = |i: u32| Position::of(rim.points[i as usize]);
    let forbidden = |i: u32, j: u32| place(i) == place(j) || (rim.forbidden)(i, j);
    let rim = &Rim { points: rim.points, apexes: rim.apexes, obstacles: rim.obstacles, forbidden: &forbidden };
    let mut clearance = Clearance::new(rim);
    let mut attempt = |weight| match rim.len() {
        _ if clearance.none_is_valid => None,
        ..=PINCHED_THOROUGH => by_weight(rim, weight, &mut clearance).ok(),
        _ => minweight::triangulate(rim, weight, Choice::Any).ok().filter(|made| rim.accepts(made, false).is_ok()),
    };
    let triangles = attempt(Weight::Bend).or_else(|| attempt(Weight::Area)).ok_or(Unfillable::Blocked)?;
    if runs_once(&triangles, place) { Ok(in_order(triangles)) } else { Err(Unfillable::Blocked) }
}

/// No way of [`pinched`] of more vertices is triangulated from clear triangles only: there are other ways to close what it is made of.
const PINCHED_THOROUGH: usize = 100;

/// Tries what there is for more than three vertices.
fn by_methods(rim: &Rim<'_>, settings: &FillSettings) -> Result<Patch, Unfillable> {
    const SMALL: [Method; 6] =
        [Method::Planar, Method::MinimumWeight, Method::LeastArea, Method::Projected, Method::Front, Method::Search];
    const LARGE: [Method; 3] = [Method::Planar, Method::Front, Method::Projected];
    let small = rim.len() <= settings.minimum_weight_vertices;
    let mut clearance = Clearance::new(rim);
    let mut reason = Unfillable::Blocked;
    for &method in if small { &SMALL[..] } else { &LARGE[..] } {
        let made = match method {
            Method::Planar => by_projection(rim, settings.planar_deviation),
            Method::Projected => by_projection(rim, f64::INFINITY),
            Method::MinimumWeight => by_weight(rim, Weight::Bend, &mut clearance),
            Method::LeastArea => by_weight(rim, Weight::Area, &mut clearance),
            Method::Front => by_front(rim, settings.minimum_weight_vertices),
            Method::Search if rim.len() <= SEARCH_VERTICES => by_search(rim, &mut clearance),
            Method::Search | Method::Triangle | Method::Zipped => Err(Unfillable::Blocked),
        };
        match made {
            Ok(triangles) => return Ok(patch(triangles, method)),
            // What a patch that was made came to grief on says more than that another could not be made; the first method says
            // it best, and none says of a small loop that it is too large.
            Err(other) if reason == Unfillable::Blocked && !(small && other == Unfillable::TooLarge) => reason = other,
            Err(_) => {}
        }
        if clearance.none_is_valid {
            break;
        }
    }
    Err(reason)
}

fn by_projection(rim: &Rim<'_>, max_deviation: f64) -> Result<Vec<[u32; 3]>, Unfillable> {
    let triangles = planar::triangulate(rim, max_deviation).ok_or(Unfillable::Blocked)?;
    // What is nearly planar is as smooth as it gets.
    if max_deviation == f64::INFINITY
        && let Some(smooth) = smoothed(rim, &triangles)
    {
        return Ok(smooth);
    }
    rim.accepts(&triangles, true)?;
    Ok(triangles)
}

/// The patch with fewer sharp bends, if that is valid.
fn smoothed(rim: &Rim<'_>, triangles: &[[u32; 3]]) -> Option<Vec<[u32; 3]>> {
    let mut mesh = Flips::new(rim, triangles.to_vec());
    mesh.smooth();
    rim.accepts(mesh.triangles(), false).is_ok().then(|| mesh.into_triangles())
}

/// The best patch; where it is not valid, the best of clear triangles; where that crosses itself, again without the larger of
/// two triangles that cross, some times.
fn by_weight(rim: &Rim<'_>, weight: Weight, clearance: &mut Clearance<'_>) -> Result<Vec<[u32; 3]>, Unfillable> {
    let triangles = minweight::triangulate(rim, weight, Choice::Any)?;
    if rim.accepts(&triangles, false).is_ok() {
        return Ok(triangles);
    }
    let mut table = minweight::Table::new(rim, weight, Choice::Clear(clearance));
    if let Err(reason) = table.best() {
        clearance.found_none();
        return Err(reason);
    }
    loop {
        let triangles = table.best()?;
        let crossing = match rim.accepts(&triangles, false) {
            Ok(()) => return Ok(triangles),
            Err(Fault::Crossing(i, j)) if table.banned() < BAN_WORK / rim.len() => [triangles[i], triangles[j]],
            Err(fault) => return Err(fault.into()),
        };
        table.ban(if rim.area(crossing[0]) > rim.area(crossing[1]) { crossing[0] } else { crossing[1] });
    }
}

/// A loop of n vertices is triangulated anew up to this / n times.
const BAN_WORK: usize = 600;

fn by_front(rim: &Rim<'_>, max_rest: usize) -> Result<Vec<[u32; 3]>, Unfillable> {
    let attempt = |order| {
        let triangles = front::triangulate(rim, order, max_rest)?;
        if let Some(smooth) = smoothed(rim, &triangles) {
            return Ok(smooth);
        }
        rim.accepts(&triangles, false)?;
        Ok(triangles)
    };
    attempt(Order::Chord).or_else(|_: Unfillable| attempt(Order::Angle))
}

fn by_search(rim: &Rim<'_>, clearance: &mut Clearance<'_>) -> Result<Vec<[u32; 3]>, Unfillable> {
    // Why nothing was found the other methods say better.
    let triangles = search::triangulate(rim, clearance).ok_or(Unfillable::Blocked)?;
    rim.accepts(&triangles, false)?;
    Ok(triangles)
}

/// Largest loop that is searched for any valid triangulation at all.
const SEARCH_VERTICES: usize = 24;

#[cfg(test)]
mod tests;
