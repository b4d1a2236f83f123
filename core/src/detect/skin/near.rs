//! Which points are far from a surface, and how far.

use std::sync::OnceLock;
use std::sync::atomic::AtomicU64;
use std::sync::atomic::Ordering::Relaxed;

use glam::DVec3;

use crate::detect::bodies::box_around;
use crate::geometry::boxes::BoxTree;
use crate::geometry::distance::{place, square_distance};
use crate::geometry::grid::Grid;
use crate::geometry::position;
use crate::geometry::sums::Bounds;
use crate::util::parallel;

use super::surfaces::{Surfaces, Which};

/// How much wider each look for the nearest surface is.
const WIDER: f64 = 2.0;

/// The points that are farther than `reach` from a surface, ascending. What is in memory is looked at first, so that files are read only around
/// points that are far from that.
pub(super) fn beyond(surfaces: &Surfaces<'_>, which: Which, points: &[[f64; 3]], reach: f64) -> Vec<u32> {
    let all: Vec<u32> = (0..points.len() as u32).collect();
    let squares = squares_within(surfaces, which, points, &all, (reach, Asked::IfAny));
    all.into_iter().filter(|p| squares[*p as usize] > reach * reach).collect()
}

/// How far each point is from a surface; the diagonal if nothing is nearer.
pub(super) fn distances(surfaces: &Surfaces<'_>, which: Which, points: &[[f64; 3]], reach: f64) -> Vec<f64> {
    // Nothing in the file is farther away.
    let farthest = surfaces.survey.bounds.diagonal();
    let mut distances = vec![farthest; points.len()];
    let mut left: Vec<u32> = (0..points.len() as u32).collect();
    let mut wide = reach * WIDER;
    while !left.is_empty() && wide > 0.0 {
        let squares = squares_within(surfaces, which, points, &left, (wide, Asked::HowFar));
        let mut squares = squares.into_iter();
        left.retain(|p| {
            let is_near = squares.next().filter(|square| *square <= wide * wide);
            is_near.iter().for_each(|square| distances[*p as usize] = square.sqrt());
            is_near.is_none()
        });
        if wide >= farthest {
            break;
        }
        wide = (wide * WIDER).min(farthest);
    }
    distances
}

/// What is asked of a point.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Asked {
    /// Is anything within reach?
    IfAny,
    /// How far is the nearest?
    HowFar,
}

/// For each of these points the squared distance from a surface, if it is within `reach`; beyond that anything larger.
fn squares_within(
    surfaces: &Surfaces<'_>,
    which: Which,
    points: &[[f64; 3]],
    of: &[u32],
    (reach, asked): (f64, Asked),
) -> Vec<f64> {
    if of.is_empty() {
        return Vec::new();
    }
    let nothing = || AtomicU64::new(bits(f64::INFINITY));
    let squares: Vec<AtomicU64> = std::iter::repeat_with(nothing).take(of.len()).collect();
    let boxes: Vec<Bounds> = of.iter().map(|p| box_around(points[*p as usize], reach)).collect();
    let at = |i: u32| DVec3::from_array(points[of[i as usize] as usize]);
    let wanted = Wanted { reach, asked };
    let in_memory = Near::of((0..of.len() as u32).collect(), &squares, wanted);
    let threads = surfaces.survey.threads();
    parallel::map(threads, surfaces.parts(), |part| {
        surfaces.each_of_part(which, part, |corners| {
            if in_memory.may_meet(&boxes, &Bounds::of(corners)) {
                in_memory.visit(&boxes, at, corners);
            }
        });
    });
    let is_left = |i: &u32| asked == Asked::HowFar || value(&squares[*i as usize]) > reach * reach;
    let left: Vec<u32> = (0..of.len() as u32).filter(is_left).collect();
    let tree = BoxTree::new(&left.iter().map(|i| boxes[*i as usize]).collect::<Vec<_>>());
    if !left.is_empty() {
        surfaces.survey.visit_regular_near(
            |region| surfaces.has(which, region),
            |chunk| {
                let mut here = Vec::new();
                tree.meeting(chunk, &mut here);
                (!here.is_empty()).then(|| Near::of(here.into_iter().map(|i| left[i as usize]).collect(), &squares, wanted))
            },
            |near, bounds| near.may_meet(&boxes, bounds),
            |near, corners| near.may_meet(&boxes, &Bounds::of(corners)),
            |near, triangle, _| near.visit(&boxes, at, &position::corners(&surfaces.survey.records[triangle as usize])),
        );
    }
    squares.iter().map(value).collect()
}

/// Squares are not negative, so that their bits are in their order.
fn bits(square: f64) -> u64 {
    square.to_bits()
}

fn value(square: &AtomicU64) -> f64 {
    f64::from_bits(square.load(Relaxed))
}

/// The question that is asked of points, and the distance beyond which nothing is.
#[derive(Clone, Copy)]
struct Wanted {
    reach: f64,
    asked: Asked,
}

/// A triangle that is longer than so many times the reach is compared with points along itself: its box holds much that is far from it.
const LONG: f64 = 8.0;

/// Rounding of distances, relative, at most.
const EXACT: f64 = 1.0 - 1e-9;

/// Some of the points; the squared distance of the nearest that was found to each, by whoever found it, is kept with all points'.
struct Near<'s> {
    here: Vec<u32>,
    squares: &'s [AtomicU64],
    /// Made when the first triangle is seen.
    index: OnceLock<(BoxTree, Grid)>,
    wanted: Wanted,
}

impl<'s> Near<'s> {
    fn of(here: Vec<u32>, squares: &'s [AtomicU64], wanted: Wanted) -> Self {
        Self { here, squares, index: OnceLock::new(), wanted }
    }

    fn index(&self, boxes: &[Bounds]) -> &(BoxTree, Grid) {
        self.index.get_or_init(|| {
            let boxes: Vec<Bounds> = self.here.iter().map(|i| boxes[*i as usize]).collect();
            let mut grid = Grid::default();
            grid.mark(boxes.iter().copied());
            (BoxTree::new(&boxes), grid)
        })
    }

    /// Asked of every triangle.
    fn may_meet(&self, boxes: &[Bounds], bounds: &Bounds) -> bool {
        self.index(boxes).1.may_meet(bounds)
    }

    /// A triangle is compared with the points whose boxes it meets, but for those of which something nearer is known than its box or its plane: the
    /// nearest of all is the same in any order.
    fn visit(&self, boxes: &[Bounds], at: impl Fn(u32) -> DVec3, corners: &[[f32; 3]; 3]) {
        let around = Bounds::of(corners);
        let [lo, hi] = [around.lo, around.hi].map(place);
        let triangle = corners.map(place);
        let [a, b, c] = triangle;
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let Wanted { reach, asked } = self.wanted;
        let compare = |i: u32| {
            let i = self.here[i as usize];
            let square = &self.squares[i as usize];
            let known = value(square);
            let most = known.min(reach * reach);
            if asked == Asked::IfAny && known <= most {
                return;
            }
            let p = at(i);
            let beside = (lo - p).max(p - hi).max(DVec3::ZERO) * EXACT;
            let height = normal.dot(p - a) * EXACT;
            if beside.length_squared() <= most && height * height <= most {
                square.fetch_min(bits(square_distance(p, triangle)), Relaxed);
            }
        };
        let tree = &self.index(boxes).0;
        if (hi - lo).max_element() > LONG * reach {
            tree.each_along(corners, compare);
        } else {
            tree.each_meeting(&around, compare);
        }
    }
}
