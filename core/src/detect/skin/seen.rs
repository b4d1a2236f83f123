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
use crate::geometry::ray_grid::RayGrid;
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
    let meet = |corners: &[[f32; 3]; 3]| {
        let corners = corners.map(|p| p.map(f64::from));
        bundles.iter().for_each(|bundle| bundle.meet(&corners));
    };
    parallel::map(surfaces.survey.threads(), surfaces.parts(), |part| surfaces.each_of_part(which, part, meet));
    surfaces.survey.visit_regular(
        |region| surfaces.has(which, region),
        |_| Some(()),
        |(), _| true,
        |(), triangle, _| meet(&position::corners(&surfaces.survey.records[triangle as usize])),
    );
    let is_free = |p: usize| {
        let in_front =
            bundles.iter().filter(|bundle| points[p].front.is_none_or(|front| bundle.direction.along().dot(front) > 0.0));
        in_front.into_iter().any(|bundle| !bundle.met[p].load(Relaxed))
    };
    (0..points.len()).map(is_free).collect()
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
    #[inline]
    fn upright(&self, p: [f64; 3]) -> [f64; 3] {
        let [x, y, z] = match self.axis {
            0 => [p[1], p[2], p[0]],
            1 => [p[2], p[0], p[1]],
            _ => p,
        };
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

/// Rays of one direction, in a grid of cells seen from above.
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
        Self { direction, beside, from, met, grid }
    }

    /// Notes the rays that a triangle is in the way of.
    fn meet(&self, corners: &[[f64; 3]; 3]) {
        let [a, b, c] = *corners;
        let q = [self.direction.upright(a), self.direction.upright(b), self.direction.upright(c)];
        for rays in self.grid.under(&q) {
            for ray in rays.iter().map(|r| *r as usize) {
                if !self.met[ray].load(Relaxed) && is_above(&q, self.from[ray], self.beside) {
                    self.met[ray].store(true, Relaxed);
                }
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
