//! Which points are far from a surface, and how far.

use std::cell::OnceCell;

use glam::DVec3;

use crate::detect::bodies::box_around;
use crate::geometry::boxes::BoxTree;
use crate::geometry::distance::{place, square_distance};
use crate::geometry::grid::Grid;
use crate::geometry::position;
use crate::geometry::sums::Bounds;

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
    let mut squares = vec![f64::INFINITY; of.len()];
    if of.is_empty() {
        return squares;
    }
    let boxes: Vec<Bounds> = of.iter().map(|p| box_around(points[*p as usize], reach)).collect();
    let at = |i: u32| DVec3::from_array(points[of[i as usize] as usize]);
    let wanted = Wanted { square: reach * reach, asked };
    let mut in_memory = Near::of((0..of.len() as u32).collect(), wanted);
    surfaces.each_in_memory(which, |corners| {
        if in_memory.may_meet(&boxes, corners) {
            in_memory.visit(&boxes, at, corners);
        }
    });
    in_memory.put_into(&mut squares);
    let is_left = |i: &u32| asked == Asked::HowFar || squares[*i as usize] > reach * reach;
    let left: Vec<u32> = (0..of.len() as u32).filter(is_left).collect();
    if left.is_empty() {
        return squares;
    }
    let tree = BoxTree::new(&left.iter().map(|i| boxes[*i as usize]).collect::<Vec<_>>());
    let per_chunk = surfaces.survey.visit_regular(
        |region| surfaces.has(which, region),
        |chunk| {
            let mut here = Vec::new();
            tree.meeting(chunk, &mut here);
            (!here.is_empty()).then(|| Near::of(here.into_iter().map(|i| left[i as usize]).collect(), wanted))
        },
        |near, corners| near.may_meet(&boxes, corners),
        |near, triangle, _| near.visit(&boxes, at, &position::corners(&surfaces.survey.records[triangle as usize])),
    );
    per_chunk.into_iter().for_each(|near| near.put_into(&mut squares));
    squares
}

/// What is asked of points, and the squared distance beyond which nothing is.
#[derive(Clone, Copy)]
struct Wanted {
    square: f64,
    asked: Asked,
}

/// Some of the points, and the nearest that was found to each.
struct Near {
    here: Vec<u32>,
    squares: Vec<f64>,
    /// Made when the first triangle is seen.
    index: OnceCell<(BoxTree, Grid)>,
    wanted: Wanted,
}

impl Near {
    fn of(here: Vec<u32>, wanted: Wanted) -> Self {
        let squares = vec![f64::INFINITY; here.len()];
        Self { here, squares, index: OnceCell::new(), wanted }
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
    fn may_meet(&self, boxes: &[Bounds], corners: &[[f32; 3]; 3]) -> bool {
        self.index(boxes).1.may_meet(&Bounds::of(corners))
    }

    fn visit(&mut self, boxes: &[Bounds], at: impl Fn(u32) -> DVec3, corners: &[[f32; 3]; 3]) {
        let mut squares = std::mem::take(&mut self.squares);
        let triangle = corners.map(place);
        let [a, b, c] = triangle;
        let normal = (b - a).cross(c - a).normalize_or_zero();
        self.index(boxes).0.each_meeting(&Bounds::of(corners), |i| {
            let square = &mut squares[i as usize];
            let most = square.min(self.wanted.square);
            if self.wanted.asked == Asked::IfAny && *square <= most {
                return;
            }
            let p = at(self.here[i as usize]);
            // Nothing of a triangle is nearer than its plane, up to rounding.
            let height = normal.dot(p - a) * (1.0 - 1e-9);
            if height * height <= most {
                *square = square.min(square_distance(p, triangle));
            }
        });
        self.squares = squares;
    }

    fn put_into(self, squares: &mut [f64]) {
        for (i, square) in self.here.iter().zip(self.squares) {
            let into = &mut squares[*i as usize];
            *into = into.min(square);
        }
    }
}
