//! Which components lie inside which closed ones: exact winding numbers by vertical rays.
//!
//! For each component asked about whose box lies inside a closed one's, a ray runs upwards from a point of one of its triangles. Crossings
//! of every other component are counted with their sign by exact predicates and half-open rules, so that a ray through an edge or a
//! vertex counts once. The sum of integers does not depend on the order, so triangles are visited chunk by chunk.
//!
//! [`obstructed`] casts rays along any axis in the same way, and asks only if they meet anything.

use std::ops::Neg;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

use robust::{Coord, Coord3D};

use crate::geometry::boxes::BoxTree;
use crate::geometry::ray_grid::{RayGrid, flat};
use crate::geometry::sums::Bounds;
use crate::io::record;
use crate::submesh::Submesh;
use crate::submesh::components::{Component, Components, Reversed, Sample};
use crate::topology::survey::Survey;
use crate::util::ids::NONE;

/// The closed components that lie around a component.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Surroundings {
    /// Components that wind around it, with their winding numbers, ascending.
    pub(crate) around: Vec<(u32, i32)>,
}

impl Surroundings {
    pub(crate) fn winding(&self) -> i32 {
        self.around.iter().map(|(_, w)| w).sum()
    }
}

/// A ray upwards from a point.
struct Ray {
    from: [f64; 3],
    /// Closed components whose crossings count, ascending.
    candidates: Vec<u32>,
}

/// The surroundings of every component that is asked about; empty for others, and for those in no closed one's box. When at least one box
/// lies in another, reads the chunks of the file once more that a ray may meet.
pub(crate) fn surroundings(
    survey: &Survey<'_>,
    submesh: &Submesh,
    components: &Components,
    reversed: &Reversed,
    asks: impl Fn(&Component) -> bool,
) -> Vec<Surroundings> {
    let mut all = vec![Surroundings::default(); components.list.len()];
    let (of_rays, rays) = rays(survey, submesh, &components.list, asks);
    for (component, around) in of_rays.into_iter().zip(count(survey, submesh, components, reversed, &rays)) {
        all[component as usize].around = around;
    }
    all
}

/// How often all closed components together wind around each of some points, none of which may lie on a surface. Reads the chunks of the
/// file that the rays may meet.
pub(crate) fn windings(
    survey: &Survey<'_>,
    submesh: &Submesh,
    components: &Components,
    reversed: &Reversed,
    points: &[[f64; 3]],
) -> Vec<i32> {
    let around = surfaces_around(survey, submesh, components, reversed, points);
    around.into_iter().map(|around| around.iter().map(|(_, w)| w).sum()).collect()
}

/// The closed components that wind around each of some points, ascending, with their winding numbers; as [`windings`] else.
pub(crate) fn surfaces_around(
    survey: &Survey<'_>,
    submesh: &Submesh,
    components: &Components,
    reversed: &Reversed,
    points: &[[f64; 3]],
) -> Vec<Vec<(u32, i32)>> {
    let (closed, tree) = closed_ones(&components.list);
    let mut found = Vec::new();
    let rays: Vec<Ray> = points
        .iter()
        .map(|from| {
            let [lo, hi] = [0, 1].map(|side| from.map(|x| around(x)[side]));
            // What the point is in is met by the box of the f32 around it.
            tree.meeting(&Bounds { lo, hi }, &mut found);
            found.sort_unstable();
            Ray { from: *from, candidates: found.iter().map(|c| closed[*c as usize]).collect() }
        })
        .collect();
    count(survey, submesh, components, reversed, &rays)
}

/// How often closed surfaces of these triangles together wind around each of some points, none of which may lie on one.
pub(crate) fn windings_of(triangles: &[[[f32; 3]; 3]], points: &[[f64; 3]]) -> Vec<i32> {
    let mut windings = vec![0; points.len()];
    if triangles.is_empty() || points.is_empty() {
        return windings;
    }
    let rays: Vec<Ray> = points.iter().map(|from| Ray { from: *from, candidates: vec![0] }).collect();
    let grid = Grid::new(&rays);
    triangles.iter().for_each(|corners| grid.cross(&rays, corners, 0, &mut |at, w| windings[at as usize] += w));
    windings
}

/// For each ray the components of its candidates that wind around where it begins, ascending.
fn count(
    survey: &Survey<'_>,
    submesh: &Submesh,
    components: &Components,
    reversed: &Reversed,
    rays: &[Ray],
) -> Vec<Vec<(u32, i32)>> {
    if rays.is_empty() {
        return Vec::new();
    }
    let mut asked = vec![false; components.list.len()];
    rays.iter().flat_map(|r| &r.candidates).for_each(|c| asked[*c as usize] = true);
    let grid = Grid::new(rays);

    let mut counts = vec![0i32; rays.iter().map(|r| r.candidates.len()).sum()];
    let is_asked = |region: u32| asked.get(components.of_region[region as usize] as usize) == Some(&true);
    let per_chunk = survey.visit_regular(
        is_asked,
        |reach| Over::new(rays, &grid, reach).map(|over| (over, Vec::new())),
        |(over, _), corners| over.may_meet(&grid, corners),
        |(_, hits): &mut (Over, Vec<(u32, i32)>), triangle, region| {
            let corners = record::corners(&survey.records[triangle as usize]);
            let sign = if reversed.regions[region as usize] { -1 } else { 1 };
            grid.cross(rays, &corners, components.of_region[region as usize], &mut |at, w| hits.push((at, sign * w)));
        },
    );
    per_chunk.into_iter().flat_map(|(_, hits)| hits).for_each(|(at, w)| counts[at as usize] += w);
    for t in submesh.living() {
        let component = components.of_triangle[t as usize];
        if asked[component as usize] {
            grid.cross(rays, &submesh.points(t), component, &mut |at, w| counts[at as usize] += w);
        }
    }
    let mut at = 0;
    let around = |ray: &Ray| {
        let found = &counts[at..at + ray.candidates.len()];
        at += ray.candidates.len();
        ray.candidates.iter().zip(found).filter(|(_, w)| **w != 0).map(|(c, w)| (*c, *w)).collect()
    };
    rays.iter().map(around).collect()
}

/// The closed components, ascending, and their boxes in that order.
fn closed_ones(list: &[Component]) -> (Vec<u32>, BoxTree) {
    let closed: Vec<u32> = (0..list.len() as u32).filter(|c| !list[*c as usize].open).collect();
    let boxes: Vec<Bounds> = closed.iter().map(|c| list[*c as usize].bounds).collect();
    (closed, BoxTree::new(&boxes))
}

/// A direction along an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Direction {
    pub(crate) axis: usize,
    /// Towards smaller coordinates.
    pub(crate) backward: bool,
}

impl Direction {
    /// The coordinates of a point in a frame in which this is upwards. Exact, and even where coordinates are mirrored, an edge that two triangles
    /// share is the same for both.
    #[inline(always)]
    pub(crate) fn upright<T: Copy + Neg<Output = T>>(self, p: [T; 3]) -> [T; 3] {
        let [x, y, z] = match self.axis {
            0 => [p[1], p[2], p[0]],
            1 => [p[2], p[0], p[1]],
            _ => p,
        };
        [x, y, if self.backward { -z } else { z }]
    }

    /// A triangle's corners in that frame.
    #[inline(always)]
    fn upright_corners(self, [a, b, c]: &[[f32; 3]; 3]) -> [[f32; 3]; 3] {
        [self.upright(*a), self.upright(*b), self.upright(*c)]
    }

    fn upright_box(self, of: &Bounds) -> Bounds {
        let (mut lo, mut hi) = (self.upright(of.lo), self.upright(of.hi));
        if self.backward {
            (lo[2], hi[2]) = (hi[2], lo[2]);
        }
        Bounds { lo, hi }
    }
}

/// Where a ray begins, and the component that does not stand in its way.
pub(crate) struct Source {
    pub(crate) from: [f64; 3],
    pub(crate) component: u32,
}

/// Which rays meet another component on their way, for each direction. Triangles of the submesh count if `counts` says so, all others do; one whose
/// plane holds the ray, or where it begins, does not. O(triangles under rays), and reads the chunks of the file that the rays may meet, once.
pub(crate) fn obstructed(
    survey: &Survey<'_>,
    submesh: &Submesh,
    components: &Components,
    asked: &[(Direction, Vec<Source>)],
    counts: impl Fn(u32) -> bool,
) -> Vec<Vec<bool>> {
    let bundles: Vec<Bundle> = asked.iter().map(|(direction, sources)| Bundle::of(*direction, sources)).collect();
    if bundles.iter().any(|bundle| !bundle.rays.is_empty()) {
        survey.visit_regular(
            |region| components.of_region[region as usize] != NONE,
            |reach| {
                let over = |bundle| Some((bundle, Bundle::over(bundle, reach)?));
                let over: Vec<(&Bundle, Over)> = bundles.iter().filter_map(over).collect();
                (!over.is_empty()).then_some(over)
            },
            |over, corners| over.iter().any(|(bundle, over)| bundle.may_meet(over, corners)),
            |over, triangle, region| {
                let corners = record::corners(&survey.records[triangle as usize]);
                let component = components.of_region[region as usize];
                let under = over.iter().filter(|(bundle, over)| bundle.may_meet(over, &corners));
                under.for_each(|(bundle, _)| bundle.meet(&corners, component));
            },
        );
        for t in submesh.living().filter(|t| counts(*t)) {
            bundles.iter().for_each(|bundle| bundle.meet(&submesh.points(t), components.of_triangle[t as usize]));
        }
    }
    bundles.into_iter().map(Bundle::met).collect()
}

/// Rays of one direction, and which of them met anything; in the order of the grid, so that those under a triangle lie side by side.
struct Bundle {
    direction: Direction,
    rays: Vec<Ray>,
    grid: Grid,
    /// Where the rays begin, upright, and the components that are not in their way.
    sources: Vec<Source>,
    met: Vec<AtomicBool>,
}

impl Bundle {
    fn of(direction: Direction, sources: &[Source]) -> Self {
        let ray = |source: &Source| Ray { from: direction.upright(source.from), candidates: Vec::new() };
        let rays: Vec<Ray> = sources.iter().map(ray).collect();
        let grid = Grid::new(&rays);
        let met = sources.iter().map(|_| AtomicBool::new(false)).collect();
        let upright = |r: &u32| Source { from: rays[*r as usize].from, component: sources[*r as usize].component };
        Self { direction, sources: grid.cells.order().iter().map(upright).collect(), grid, rays, met }
    }

    /// The rays that may meet what lies in a box of the file.
    fn over(&self, reach: &Bounds) -> Option<Over> {
        Over::new(&self.rays, &self.grid, &self.direction.upright_box(reach))
    }

    #[inline(always)]
    fn may_meet(&self, over: &Over, corners: &[[f32; 3]; 3]) -> bool {
        over.may_meet(&self.grid, &self.direction.upright_corners(corners))
    }

    fn meet(&self, corners: &[[f32; 3]; 3], component: u32) {
        let corners = self.direction.upright_corners(corners);
        for place in self.grid.cells.places_under(flat(&corners)) {
            let (source, met) = (&self.sources[place], &self.met[place]);
            // Whoever meets it first: it is met.
            if source.component != component && !met.load(Relaxed) && crossing(&corners, source.from) != 0 {
                met.store(true, Relaxed);
            }
        }
    }

    /// Which rays met anything, in the order of the sources.
    fn met(self) -> Vec<bool> {
        let mut met = vec![false; self.met.len()];
        let places = self.grid.cells.order().iter().zip(self.met);
        places.for_each(|(ray, is_met)| met[*ray as usize] = is_met.into_inner());
        met
    }
}

/// Which points surface lies around: in at least four of the six directions along the axes, a ray leaves surface more often than it enters, or
/// the other way. Neither holes nor a few turned triangles change much of that. O(triangles under rays), and reads the chunks of the
/// file that the rays may meet, six times.
pub(crate) fn are_surrounded(survey: &Survey<'_>, submesh: &Submesh, points: &[[f64; 3]]) -> Vec<bool> {
    let mut votes = vec![0; points.len()];
    if points.is_empty() {
        return Vec::new();
    }
    for (axis, backward) in (0..3).flat_map(|axis| [(axis, false), (axis, true)]) {
        let direction = Direction { axis, backward };
        let rays: Vec<Ray> = points.iter().map(|p| Ray { from: direction.upright(*p), candidates: vec![0] }).collect();
        let grid = Grid::new(&rays);
        let upright = |corners: &[[f32; 3]; 3]| direction.upright_corners(corners);
        let mut windings = vec![0; points.len()];
        let per_chunk = survey.visit_regular(
            |_| true,
            |reach| Over::new(&rays, &grid, &direction.upright_box(reach)).map(|over| (over, Vec::new())),
            |(over, _), corners| over.may_meet(&grid, &upright(corners)),
            |(_, hits): &mut (Over, Vec<(u32, i32)>), triangle, _| {
                let corners = record::corners(&survey.records[triangle as usize]);
                grid.cross(&rays, &upright(&corners), 0, &mut |at, w| hits.push((at, w)));
            },
        );
        per_chunk.into_iter().flat_map(|(_, hits)| hits).for_each(|(at, w)| windings[at as usize] += w);
        let mut cross = |t| grid.cross(&rays, &upright(&submesh.points(t)), 0, &mut |at, w| windings[at as usize] += w);
        submesh.living().for_each(&mut cross);
        votes.iter_mut().zip(&windings).for_each(|(vote, w)| *vote += i32::from(*w != 0));
    }
    votes.into_iter().map(|votes| votes >= 4).collect()
}

/// The components asked about whose boxes lie in closed ones', ascending, and a ray for each.
fn rays(survey: &Survey<'_>, submesh: &Submesh, list: &[Component], asks: impl Fn(&Component) -> bool) -> (Vec<u32>, Vec<Ray>) {
    if list.len() < 2 || list.iter().all(|c| c.open) {
        return Default::default();
    }
    let (closed, tree) = closed_ones(list);
    let mut found = Vec::new();
    let (mut of_rays, mut rays) = (Vec::new(), Vec::new());
    for (component, inner) in (0..).zip(list).filter(|(_, inner)| asks(inner)) {
        tree.meeting(&inner.bounds, &mut found);
        let around = found.iter().map(|j| closed[*j as usize]);
        let candidates: Vec<u32> =
            around.filter(|c| *c != component && list[*c as usize].bounds.contains(&inner.bounds)).collect();
        if !candidates.is_empty() {
            let Sample { record, in_submesh } = inner.sample;
            let corners = in_submesh.map_or_else(|| record::corners(&survey.records[record as usize]), |t| submesh.points(t));
            of_rays.push(component);
            rays.push(Ray { from: inner_point(&corners), candidates });
        }
    }
    (of_rays, rays)
}

/// The weights of a triangle's corners in a point of it, of no symmetry, so that it does not fall on grid lines that models are built on.
pub(crate) const INNER_POINT: [f64; 3] = [0.318_411, 0.367_778, 0.313_811];

/// A point of a triangle.
pub(crate) fn inner_point(corners: &[[f32; 3]; 3]) -> [f64; 3] {
    std::array::from_fn(|k| (0..3).map(|i| INNER_POINT[i] * f64::from(corners[i][k])).sum())
}

/// The rays that may meet what lies in some box.
enum Over {
    /// Few enough to be compared with each triangle: for each x and y, the largest f32 up to it and the smallest from it on.
    Few(Vec<[[f32; 2]; 2]>),
    Many,
}

impl Over {
    /// More rays than these are looked up in the grid.
    const FEW: usize = 4;

    /// `None`: no ray meets the box.
    fn new(rays: &[Ray], grid: &Grid, reach: &Bounds) -> Option<Self> {
        if reach.is_empty() {
            return None;
        }
        let inside = |ray: &&Ray| {
            let within = |k: usize| f64::from(reach.lo[k]) <= ray.from[k] && ray.from[k] <= f64::from(reach.hi[k]);
            within(0) && within(1) && ray.from[2] <= f64::from(reach.hi[2])
        };
        let mut few = Vec::new();
        let corners = [reach.lo, reach.hi, reach.hi];
        for ray in grid.cells.under(flat(&corners)).map(|r| &rays[r]).filter(inside) {
            if few.len() == Self::FEW {
                return Some(Self::Many);
            }
            few.push([0, 1].map(|k| around(ray.from[k])));
        }
        (!few.is_empty()).then_some(Self::Few(few))
    }

    /// Asked of every triangle.
    #[inline(always)]
    fn may_meet(&self, grid: &Grid, corners: &[[f32; 3]; 3]) -> bool {
        match self {
            Self::Few(few) => {
                let low = |k: usize| corners[0][k].min(corners[1][k]).min(corners[2][k]);
                let high = |k: usize| corners[0][k].max(corners[1][k]).max(corners[2][k]);
                let (lo, hi) = ([low(0), low(1)], [high(0), high(1)]);
                few.iter().any(|[x, y]| (lo[0] <= x[0]) & (hi[0] >= x[1]) & (lo[1] <= y[0]) & (hi[1] >= y[1]))
            }
            Self::Many => grid.cells.may_meet(flat(corners)),
        }
    }
}

/// The largest f32 that is not above `x`, and the smallest that is not below.
pub(crate) fn around(x: f64) -> [f32; 2] {
    let near = x as f32;
    [if f64::from(near) > x { near.next_down() } else { near }, if f64::from(near) < x { near.next_up() } else { near }]
}

/// Rays in a grid, and where each ray's candidates begin in the table of counts.
struct Grid {
    cells: RayGrid,
    bases: Vec<u32>,
}

impl Grid {
    fn new(rays: &[Ray]) -> Self {
        // Several cells a ray, so that most small triangles are over with at the first look.
        let mut grid = Self { cells: RayGrid::new(rays.iter().map(|ray| ray.from), 8, 1024), bases: Vec::new() };
        let mut base = 0;
        for ray in rays {
            grid.bases.push(base);
            base += ray.candidates.len() as u32;
        }
        grid
    }

    /// Reports `(place in the table of counts, signed crossing)` for every ray that asks for `component` and meets the triangle.
    fn cross(&self, rays: &[Ray], corners: &[[f32; 3]; 3], component: u32, hit: &mut dyn FnMut(u32, i32)) {
        for r in self.cells.under(flat(corners)) {
            let ray = &rays[r];
            if let Ok(i) = ray.candidates.binary_search(&component) {
                let w = crossing(corners, ray.from);
                if w != 0 {
                    hit(self.bases[r] + i as u32, w);
                }
            }
        }
    }
}

/// How the ray upwards from `p` crosses a triangle: 1 from inside to outside, −1 from outside to inside, 0 not at all. A point on
/// the triangle's plane does not cross it.
pub(crate) fn crossing([a, b, c]: &[[f32; 3]; 3], p: [f64; 3]) -> i32 {
    if f64::from(a[2].max(b[2]).max(c[2])) < p[2] {
        return 0;
    }
    // Half-open in y, strict in x: an edge shared by two triangles is decided alike for both.
    let begins = |v: &[f32; 3]| f64::from(v[1]) <= p[1];
    let over = [begins(a), begins(b), begins(c)];
    if over[0] == over[1] && over[1] == over[2] {
        return 0;
    }
    let above = |v: &[f32; 3]| Coord { x: v[0].into(), y: v[1].into() };
    let from = Coord { x: p[0], y: p[1] };
    let along = |[a, b]: [&[f32; 3]; 2], over: [bool; 2]| match over {
        [true, false] if robust::orient2d(above(a), above(b), from) > 0.0 => 1,
        [false, true] if robust::orient2d(above(b), above(a), from) > 0.0 => -1,
        _ => 0,
    };
    let winding = along([a, b], [over[0], over[1]]) + along([b, c], [over[1], over[2]]) + along([c, a], [over[2], over[0]]);
    if winding == 0 {
        return 0;
    }
    let at = |v: &[f32; 3]| Coord3D { x: v[0].into(), y: v[1].into(), z: v[2].into() };
    // Positive when p lies below the plane of three corners that run counter-clockwise seen from above.
    let below = robust::orient3d(at(a), at(b), at(c), Coord3D { x: p[0], y: p[1], z: p[2] });
    if below * f64::from(winding) > 0.0 { winding } else { 0 }
}

#[cfg(test)]
mod tests;
