//! Which points of a surface can be seen from outside.
//!
//! From each point rays run into fourteen directions: along the axes, a little askew, so that no wall of a part that stands straight holds one,
//! and towards the corners of a cube. A point can be seen if one of the rays meets nothing. Of a cavity that pokes out of its wall, and of what is
//! new, only rays on the front of the surface count: what is seen from behind only bounds no material. What is next to the point itself does not count.
//!
//! A direction is made the upright one by a shear, in which both triangles at an edge still have the same edge; so no ray slips through.

use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

use glam::DVec3;

use crate::geometry::position;
use crate::geometry::ray_grid::{RayGrid, flat, upright};
use crate::geometry::sums::Bounds;
use crate::util::parallel;

use super::surfaces::{Surfaces, Which};

/// A point on a surface.
#[derive(Clone, Copy)]
pub(super) struct OnSurface {
    pub(super) at: [f64; 3],
    /// Where the surface faces, of any length, if it counts from there only.
    pub(super) front: Option<DVec3>,
}

/// The share of the reach within which surface is next to a point.
const BESIDE: f64 = 0.02;

/// Which of these points, which lie on a surface, can be seen from outside. O(triangles under rays), and reads the file twice at most.
pub(super) fn from_outside(surfaces: &Surfaces<'_>, which: Which, points: &[OnSurface], reach: f64) -> Vec<bool> {
    let mut seen = vec![false; points.len()];
    for directions in [straight(), corners()] {
        let hidden: Vec<u32> = (0..points.len() as u32).filter(|p| !seen[*p as usize]).collect();
        if hidden.is_empty() {
            break;
        }
        let here: Vec<OnSurface> = hidden.iter().map(|p| points[*p as usize]).collect();
        for (p, is_free) in hidden.iter().zip(are_free(surfaces, which, &here, &directions, reach * BESIDE)) {
            seen[*p as usize] = is_free;
        }
    }
    seen
}

/// Does any ray of each point meet nothing?
fn are_free(surfaces: &Surfaces<'_>, which: Which, points: &[OnSurface], directions: &[Direction], beside: f64) -> Vec<bool> {
    let bundles: Vec<Bundle> = directions.iter().map(|direction| Bundle::of(*direction, points, beside)).collect();
    let meet = |corners: &[[f32; 3]; 3]| bundles.iter().for_each(|bundle| bundle.meet(corners));
    parallel::map(surfaces.survey.threads(), surfaces.parts(), |part| surfaces.each_of_part(which, part, meet));
    surfaces.survey.visit_regular_near(
        |region| surfaces.has(which, region),
        |reach| {
            let over: Vec<&Bundle> = bundles.iter().filter(|bundle| bundle.is_over(reach)).collect();
            (!over.is_empty()).then_some(over)
        },
        |over, bounds| over.iter().any(|bundle| bundle.is_over(bounds)),
        |over, corners| over.iter().any(|bundle| bundle.may_meet(corners)),
        |over, triangle, _| {
            let corners = position::corners(&surfaces.survey.records[triangle as usize]);
            over.iter().for_each(|bundle| bundle.meet(&corners));
        },
    );
    let mut is_free = vec![false; points.len()];
    for bundle in bundles {
        let free = bundle.grid.order().iter().zip(bundle.met).filter(|(_, met)| !met.load(Relaxed));
        for p in free.map(|(p, _)| *p as usize) {
            is_free[p] |= points[p].front.is_none_or(|front| bundle.direction.along().dot(front) > 0.0);
        }
    }
    is_free
}

/// A direction, by the axis that it is nearest to.
#[derive(Clone, Copy)]
struct Direction {
    axis: usize,
    /// 1, or −1 towards smaller coordinates.
    way: f64,
    /// How far it leads along the two other axes meanwhile.
    askew: [f64; 2],
}

impl Direction {
    fn along(&self) -> DVec3 {
        let mut along = [0.0; 3];
        along[self.axis] = self.way;
        along[(self.axis + 1) % 3] = self.askew[0];
        along[(self.axis + 2) % 3] = self.askew[1];
        DVec3::from_array(along)
    }

    /// The coordinates in a frame in which it is upright.
    #[inline(always)]
    fn upright<T: Copy + Into<f64>>(&self, p: [T; 3]) -> [f64; 3] {
        let [x, y, z] = upright(self.axis, [p[0].into(), p[1].into(), p[2].into()]);
        let up = z * self.way;
        [x - self.askew[0] * up, y - self.askew[1] * up, up]
    }
}

fn straight() -> Vec<Direction> {
    let along = |axis| [1.0, -1.0].map(|way| Direction { axis, way, askew: [0.0131, 0.0297] });
    (0..3).flat_map(along).collect()
}

fn corners() -> Vec<Direction> {
    let signs = [[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]];
    let towards = |way: f64| signs.map(|[x, y]| Direction { axis: 2, way, askew: [x * 0.89, y * 0.93] });
    [1.0, -1.0].into_iter().flat_map(towards).collect()
}

/// Rays of one direction, in a grid of cells seen from above, and in the order of these.
struct Bundle {
    direction: Direction,
    beside: f64,
    /// Where the rays begin, upright.
    from: Vec<[f64; 3]>,
    met: Vec<AtomicBool>,
    grid: RayGrid,
}

impl Bundle {
    fn of(direction: Direction, points: &[OnSurface], beside: f64) -> Self {
        let from: Vec<[f64; 3]> = points.iter().map(|p| direction.upright(p.at)).collect();
        let met = from.iter().map(|_| AtomicBool::new(false)).collect();
        let grid = RayGrid::new(from.iter().copied(), 4, 512);
        Self { direction, beside, from: grid.order().iter().map(|r| from[*r as usize]).collect(), met, grid }
    }

    /// May a ray meet what lies in a box? Rays that have met something already count for none.
    fn is_over(&self, reach: &Bounds) -> bool {
        let corner = |k: usize| [0, 1, 2].map(|axis| if k >> axis & 1 == 0 { reach.lo[axis] } else { reach.hi[axis] });
        let corners: [[f64; 3]; 8] = std::array::from_fn(|k| self.direction.upright(corner(k)));
        let span =
            |axis: usize| corners.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |s, c| [s[0].min(c[axis]), s[1].max(c[axis])]);
        let (x, y, top) = (span(0), span(1), span(2)[1]);
        let is_under = |ray: usize| !self.met[ray].load(Relaxed) && self.from[ray][2] <= top;
        !reach.is_empty() && self.grid.places_under([x, y]).any(is_under)
    }

    #[inline(always)]
    fn may_meet(&self, corners: &[[f32; 3]; 3]) -> bool {
        self.grid.may_meet(flat(&self.upright(corners)))
    }

    #[inline(always)]
    fn upright(&self, [a, b, c]: &[[f32; 3]; 3]) -> [[f64; 3]; 3] {
        [self.direction.upright(*a), self.direction.upright(*b), self.direction.upright(*c)]
    }

    /// Notes the rays that a triangle is in the way of.
    fn meet(&self, corners: &[[f32; 3]; 3]) {
        let q = self.upright(corners);
        if !self.grid.may_meet(flat(&q)) {
            return;
        }
        for ray in self.grid.places_under(flat(&q)) {
            if !self.met[ray].load(Relaxed) && is_above(&q, self.from[ray], self.beside) {
                self.met[ray].store(true, Relaxed);
            }
        }
    }
}

/// Does a triangle, its rim included, lie over a point, by more than a margin?
fn is_above(q: &[[f64; 3]; 3], p: [f64; 3], beside: f64) -> bool {
    if q.iter().all(|c| c[2] <= p[2] + beside) {
        return false;
    }
    let side = |a: [f64; 3], b: [f64; 3]| (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]);
    let of = [side(q[1], q[2]), side(q[2], q[0]), side(q[0], q[1])];
    if of.iter().any(|s| *s < 0.0) && of.iter().any(|s| *s > 0.0) {
        return false;
    }
    let whole = of[0] + of[1] + of[2];
    // A triangle that is seen from its edge hides nothing.
    whole != 0.0 && (of[0] * q[0][2] + of[1] * q[1][2] + of[2] * q[2][2]) / whole > p[2] + beside
}
