//! Which components lie inside which closed ones: exact winding numbers by vertical rays.
//!
//! For each component asked about whose box lies inside a closed one's, a ray runs upwards from a point of one of its triangles. Crossings
//! of every other component are counted with their sign by exact predicates and half-open rules, so that a ray through an edge or a
//! vertex counts once. The sum of integers does not depend on the order, so triangles are visited chunk by chunk.
//!
//! [`obstructed`] casts rays along any axis in the same way, and asks only if they meet anything.

pub(crate) mod surrounded;

use std::ops::Neg;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

use robust::{Coord, Coord3D};

use crate::geometry::boxes::BoxTree;
use crate::geometry::ray_grid::{self, RayGrid, flat};
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
type Ray = [f64; 3];

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
    let list = &components.list;
    let (of_rays, rays) = rays(survey, submesh, list, asks);
    let counts = |ray: usize, c: u32| {
        let inner = of_rays[ray];
        c != inner && list[c as usize].bounds.contains(&list[inner as usize].bounds)
    };
    let found = count(survey, submesh, components, reversed, &rays, counts);
    for (component, around) in of_rays.iter().zip(found) {
        all[*component as usize].around = around;
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
    // The box of the f32 around a point meets every body that the point is in.
    let boxes: Vec<Bounds> = points.iter().map(|p| box_around(*p, 0.0)).collect();
    let counts = |ray: usize, c: u32| components.list[c as usize].bounds.overlap(&boxes[ray]).is_some();
    count(survey, submesh, components, reversed, points, counts)
}

/// How often closed surfaces of these triangles together wind around each of some points, none of which may lie on one.
pub(crate) fn windings_of(triangles: &[[[f32; 3]; 3]], points: &[[f64; 3]]) -> Vec<i32> {
    let mut windings = vec![0; points.len()];
    if triangles.is_empty() || points.is_empty() {
        return windings;
    }
    let grid = grid_of(points);
    triangles.iter().for_each(|corners| cross(&grid, points, corners, |_| true, |ray, w| windings[ray] += w));
    windings
}

/// For each ray the closed components that wind around where it begins, ascending, of those that `counts` says of the ray by number.
fn count(
    survey: &Survey<'_>,
    submesh: &Submesh,
    components: &Components,
    reversed: &Reversed,
    rays: &[Ray],
    counts: impl Fn(usize, u32) -> bool + Sync,
) -> Vec<Vec<(u32, i32)>> {
    if rays.is_empty() {
        return Vec::new();
    }
    let grid = grid_of(rays);
    let is_over =
        |c: &Component| !c.open && !c.bounds.is_empty() && grid.may_meet(flat(&[c.bounds.lo, c.bounds.hi, c.bounds.hi]));
    let asked: Vec<bool> = components.list.iter().map(is_over).collect();
    let is_asked = |region: u32| asked.get(components.of_region[region as usize] as usize) == Some(&true);
    // Ray, component, and what it crosses of that, which makes a sum of integers in the end.
    type Hits = Vec<(u32, u32, i32)>;
    let hit = |corners: &[[f32; 3]; 3], component: u32, sign: i32, hits: &mut Hits| {
        cross(&grid, rays, corners, |ray| counts(ray, component), |ray, w| hits.push((ray as u32, component, sign * w)));
    };
    let per_chunk = survey.visit_regular_near(
        is_asked,
        |reach| Over::new(rays, &grid, reach).map(|over| (over, Hits::new())),
        |(over, _), bounds| over.may_meet(&grid, &spanning(bounds)),
        |(over, _), corners| over.may_meet(&grid, corners),
        |(_, hits): &mut (Over, Hits), triangle, region| {
            let corners = record::corners(&survey.records[triangle as usize]);
            let sign = if reversed.regions[region as usize] { -1 } else { 1 };
            hit(&corners, components.of_region[region as usize], sign, hits);
        },
    );
    let mut hits: Hits = per_chunk.into_iter().flat_map(|(_, hits)| hits).collect();
    for t in submesh.living() {
        let component = components.of_triangle[t as usize];
        if asked[component as usize] {
            hit(&submesh.points(t), component, 1, &mut hits);
        }
    }
    hits.sort_unstable();
    let mut all = vec![Vec::new(); rays.len()];
    for same in hits.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
        let (ray, component, _) = same[0];
        let winding: i32 = same.iter().map(|(.., w)| w).sum();
        all[ray as usize].extend(Some((component, winding)).filter(|(_, w)| *w != 0));
    }
    all
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
    /// Both directions along each axis.
    pub(crate) const ALL: [Self; 6] =
        [Self::of(0, false), Self::of(0, true), Self::of(1, false), Self::of(1, true), Self::of(2, false), Self::of(2, true)];

    const fn of(axis: usize, backward: bool) -> Self {
        Self { axis, backward }
    }

    /// The coordinates of a point in a frame in which this is upwards. Exact, and even where coordinates are mirrored, an edge that two triangles
    /// share is the same for both.
    #[inline(always)]
    pub(crate) fn upright<T: Copy + Neg<Output = T>>(self, p: [T; 3]) -> [T; 3] {
        let [x, y, z] = ray_grid::upright(self.axis, p);
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
    if bundles.iter().any(|bundle| !bundle.sources.is_empty()) {
        survey.visit_regular_near(
            |region| components.of_region[region as usize] != NONE,
            |reach| {
                let over: Vec<(&Bundle, Over)> = bundles.iter().filter_map(|b| Some((b, b.upright.over(reach)?))).collect();
                (!over.is_empty()).then_some(over)
            },
            |over, bounds| over.iter().any(|(bundle, over)| bundle.upright.may_meet_box(over, bounds)),
            |over, corners| over.iter().any(|(bundle, over)| bundle.upright.may_meet(over, corners)),
            |over, triangle, region| {
                let corners = record::corners(&survey.records[triangle as usize]);
                let component = components.of_region[region as usize];
                let under = over.iter().filter(|(bundle, over)| bundle.upright.may_meet(over, &corners));
                under.for_each(|(bundle, _)| bundle.meet(&corners, component));
            },
        );
        for t in submesh.living().filter(|t| counts(*t)) {
            bundles.iter().for_each(|bundle| bundle.meet(&submesh.points(t), components.of_triangle[t as usize]));
        }
    }
    bundles.into_iter().map(Bundle::met).collect()
}

/// Rays of one direction, in a frame in which it is upright.
struct Upright {
    direction: Direction,
    rays: Vec<Ray>,
    grid: RayGrid,
}

impl Upright {
    fn of(direction: Direction, points: impl Iterator<Item = [f64; 3]>) -> Self {
        let rays: Vec<Ray> = points.map(|p| direction.upright(p)).collect();
        Self { direction, grid: grid_of(&rays), rays }
    }

    /// The rays that may meet what lies in a box of the file.
    fn over(&self, reach: &Bounds) -> Option<Over> {
        Over::new(&self.rays, &self.grid, &self.direction.upright_box(reach))
    }

    #[inline(always)]
    fn may_meet(&self, over: &Over, corners: &[[f32; 3]; 3]) -> bool {
        over.may_meet(&self.grid, &self.direction.upright_corners(corners))
    }

    fn may_meet_box(&self, over: &Over, bounds: &Bounds) -> bool {
        over.may_meet(&self.grid, &spanning(&self.direction.upright_box(bounds)))
    }
}

/// Such rays, and which of them met anything; in the order of the grid, so that those under a triangle lie side by side.
struct Bundle {
    upright: Upright,
    /// Where the rays begin, upright, and the components that are not in their way.
    sources: Vec<Source>,
    met: Vec<AtomicBool>,
}

impl Bundle {
    fn of(direction: Direction, sources: &[Source]) -> Self {
        let upright = Upright::of(direction, sources.iter().map(|source| source.from));
        let met = sources.iter().map(|_| AtomicBool::new(false)).collect();
        let source = |r: &u32| Source { from: upright.rays[*r as usize], component: sources[*r as usize].component };
        Self { sources: upright.grid.order().iter().map(source).collect(), upright, met }
    }

    fn meet(&self, corners: &[[f32; 3]; 3], component: u32) {
        let corners = self.upright.direction.upright_corners(corners);
        for place in self.upright.grid.places_under(flat(&corners)) {
            let (met, source) = (&self.met[place], &self.sources[place]);
            // Whoever meets it first: it is met. Most are, and whether they are lies nearest.
            if !met.load(Relaxed) && source.component != component && crossing(&corners, source.from) != 0 {
                met.store(true, Relaxed);
            }
        }
    }

    /// Which rays met anything, in the order of the sources.
    fn met(self) -> Vec<bool> {
        let mut met = vec![false; self.met.len()];
        let places = self.upright.grid.order().iter().zip(self.met);
        places.for_each(|(ray, is_met)| met[*ray as usize] = is_met.into_inner());
        met
    }
}

/// The components asked about whose boxes lie in closed ones', ascending, and a ray for each.
fn rays(survey: &Survey<'_>, submesh: &Submesh, list: &[Component], asks: impl Fn(&Component) -> bool) -> (Vec<u32>, Vec<Ray>) {
    if list.len() < 2 || list.iter().all(|c| c.open) {
        return Default::default();
    }
    let (closed, tree) = closed_ones(list);
    let (mut of_rays, mut rays) = (Vec::new(), Vec::new());
    for (component, inner) in (0..).zip(list).filter(|(_, inner)| asks(inner)) {
        let is_around = |c: u32| c != component && list[c as usize].bounds.contains(&inner.bounds);
        if tree.any_around(&inner.bounds, |j| is_around(closed[j as usize])) {
            let Sample { record, in_submesh } = inner.sample;
            let corners = in_submesh.map_or_else(|| record::corners(&survey.records[record as usize]), |t| submesh.points(t));
            of_rays.push(component);
            rays.push(inner_point(&corners));
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
    fn new(rays: &[Ray], grid: &RayGrid, reach: &Bounds) -> Option<Self> {
        if reach.is_empty() {
            return None;
        }
        let inside = |ray: &&Ray| {
            let within = |k: usize| f64::from(reach.lo[k]) <= ray[k] && ray[k] <= f64::from(reach.hi[k]);
            within(0) && within(1) && ray[2] <= f64::from(reach.hi[2])
        };
        let mut few = Vec::new();
        for ray in grid.under(flat(&spanning(reach))).map(|r| &rays[r]).filter(inside) {
            if few.len() == Self::FEW {
                return Some(Self::Many);
            }
            few.push([0, 1].map(|k| around(ray[k])));
        }
        (!few.is_empty()).then_some(Self::Few(few))
    }

    /// Asked of every triangle.
    #[inline(always)]
    fn may_meet(&self, grid: &RayGrid, corners: &[[f32; 3]; 3]) -> bool {
        match self {
            Self::Few(few) => {
                let low = |k: usize| corners[0][k].min(corners[1][k]).min(corners[2][k]);
                let high = |k: usize| corners[0][k].max(corners[1][k]).max(corners[2][k]);
                let (lo, hi) = ([low(0), low(1)], [high(0), high(1)]);
                few.iter().any(|[x, y]| (lo[0] <= x[0]) & (hi[0] >= x[1]) & (lo[1] <= y[0]) & (hi[1] >= y[1]))
            }
            Self::Many => grid.may_meet(flat(corners)),
        }
    }
}

/// Three points that have this box.
fn spanning(bounds: &Bounds) -> [[f32; 3]; 3] {
    [bounds.lo, bounds.hi, bounds.hi]
}

/// The largest f32 that is not above `x`, and the smallest that is not below.
pub(crate) fn around(x: f64) -> [f32; 2] {
    let near = x as f32;
    [if f64::from(near) > x { near.next_down() } else { near }, if f64::from(near) < x { near.next_up() } else { near }]
}

/// The smallest box of f32 that holds what is so near to a point along each axis.
pub(crate) fn box_around(p: [f64; 3], by: f64) -> Bounds {
    Bounds { lo: p.map(|x| around(x - by)[0]), hi: p.map(|x| around(x + by)[1]) }
}

/// Several cells a ray, so that most small triangles are over with at the first look.
fn grid_of(rays: &[Ray]) -> RayGrid {
    RayGrid::new(rays.iter().copied(), 8, 1024)
}

/// Tells `hit` of every ray, by number, that `counts` and crosses the triangle, and how.
#[inline(always)]
fn cross(grid: &RayGrid, rays: &[Ray], corners: &[[f32; 3]; 3], counts: impl Fn(usize) -> bool, mut hit: impl FnMut(usize, i32)) {
    for ray in grid.under(flat(corners)).filter(|ray| counts(*ray)) {
        let w = crossing(corners, rays[ray]);
        if w != 0 {
            hit(ray, w);
        }
    }
}

/// How the ray upwards from `p` crosses a triangle: 1 from inside to outside, −1 from outside to inside, 0 not at all. A point on
/// the triangle's plane does not cross it.
pub(crate) fn crossing([a, b, c]: &[[f32; 3]; 3], p: [f64; 3]) -> i32 {
    let is_beside = f64::from(a[0].max(b[0]).max(c[0])) < p[0] || f64::from(a[0].min(b[0]).min(c[0])) > p[0];
    if is_beside || f64::from(a[2].max(b[2]).max(c[2])) < p[2] {
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
