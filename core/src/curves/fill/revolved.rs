//! Four (or three) sides as those of a surface of revolution, exactly or nearly.
//!
//! Two opposite sides are the same profile, turned about an axis; the curves between them are the same up to their size. In the
//! plane across the axis, with its points as complex numbers, each row of control points is the first one times a number: that of the
//! profile's point by that of its beginning. The product of two B-splines is one, so nothing is approximated.

use super::coons::Coons;
use super::spline::SplineSurface;
use crate::curves::curve::{CurveError, Spline};
use crate::curves::elementary::Frame;
use crate::curves::vector::{Point, add, cross, distance, dot, norm, scale, sub, unit};
use crate::util::each::Each;

/// Samples of a side.
const SAMPLES: u32 = 8;
/// Of smaller angles between profiles, their axis would be a guess.
const LEAST: f64 = 0.05;

/// Control points of a surface of revolution, at most: their number is a product of two sides.
const MOST: usize = 1 << 22;

/// A surface of revolution whose sides are no farther than a distance from those of a Coons surface, at samples: the first side along
/// and one across are the same. `None` if there is none, or if it has more than four million control points. O(control points).
pub(super) fn revolved(coons: &Coons, tolerance: f64) -> Option<SplineSurface> {
    let ways = [false, true].into_iter().filter_map(|is_turned| {
        let (along, across) = if is_turned { (&coons.across, &coons.along) } else { (&coons.along, &coons.across) };
        let product = Product::between(along.each_ref(), across.each_ref(), tolerance)?;
        let off = product.off(along.each_ref(), across.each_ref());
        (off <= tolerance).then_some((off, is_turned, product))
    });
    // The control points are many more than those of the sides, so only the surface that is taken has them made.
    let (_, is_turned, product) = ways.min_by(|a, b| a.0.total_cmp(&b.0))?;
    let surface = product.surface()?;
    if is_turned { transposed(&surface).ok() } else { Some(surface) }
}

/// The frame about whose z-axis one profile turns into the other.
fn axis(profiles: [&Spline; 2], tolerance: f64) -> Option<Frame> {
    let points = profiles.map(|side| [0.0, 0.5, 1.0].each(|t| side.point_and_derivative(t).0));
    let frame = |[a, b, c]: [Point; 3]| {
        let x = unit(sub(c, a))?;
        let z = unit(cross(x, sub(b, a)))?;
        // Of a profile that is straight, nothing tells how it is turned; such surfaces are blended exactly.
        (norm(cross(x, sub(b, a))) > 1e-3 * distance(a, c)).then(|| [x, cross(z, x), z])
    };
    let [from, to] = [frame(points[0])?, frame(points[1])?];
    // The rotation from one frame to the other: its antisymmetric part is the axis times the sine.
    let twice = from.iter().zip(&to).fold([0.0; 3], |sum, (a, b)| add(sum, cross(*a, *b)));
    let cosine = 0.5 * (from.iter().zip(&to).map(|(a, b)| dot(*a, *b)).sum::<f64>() - 1.0);
    let angle = (0.5 * norm(twice)).atan2(cosine);
    let z = unit(twice).filter(|_| angle > LEAST && angle < std::f64::consts::PI - LEAST)?;
    let mut origin = [0.0; 3];
    for (a, b) in points[0].iter().zip(&points[1]) {
        let chord = sub(*b, *a);
        let along = dot(chord, z);
        if along.abs() > tolerance {
            return None;
        }
        let middle = scale(add(*a, *b), 0.5);
        let centre = add(middle, scale(cross(z, chord), 0.5 / (0.5 * angle).tan()));
        origin = add(origin, scale(sub(centre, scale(z, dot(centre, z))), 1.0 / 3.0));
    }
    Some(Frame::around(origin, z))
}

/// The product of a row and a profile, as complex numbers across an axis.
struct Product<'a> {
    frame: Frame,
    row: &'a Spline,
    profile: &'a Spline,
    /// The point of the profile that the row begins at, and its squared distance from the axis.
    start: [f64; 2],
    squared: f64,
}

impl<'a> Product<'a> {
    /// The surface from one profile to the other.
    fn between([a, c]: [&'a Spline; 2], [d, b]: [&'a Spline; 2], tolerance: f64) -> Option<Self> {
        let frame = axis([d, b], tolerance)?;
        let flat = |point: &Point| {
            let [x, y, _] = frame.inside(*point);
            [x, y]
        };
        let ends = [flat(d.points().first()?), flat(d.points().last()?)];
        let [near, far] = ends.map(|[x, y]| x.hypot(y));
        // The row that is farther from the axis: the other one may be a point on it.
        let (row, start) = if near >= far { (a, ends[0]) } else { (c, ends[1]) };
        let squared = start[0] * start[0] + start[1] * start[1];
        (squared > tolerance * tolerance).then_some(Self { frame, row, profile: d, start, squared })
    }

    /// The point that belongs to one of the row and one of the profile.
    fn point(&self, along: Point, profile: Point) -> Point {
        let ([x, y, _], [u, v, height]) = (self.frame.inside(along), self.frame.inside(profile));
        let [p, q] = self.start;
        // (u + iv) / (p + iq) · (x + iy)
        let [re, im] = [(u * p + v * q) / self.squared, (v * p - u * q) / self.squared];
        self.frame.outside([x * re - y * im, x * im + y * re, height])
    }

    /// The largest distance of sides at samples.
    fn off(&self, along: [&Spline; 2], across: [&Spline; 2]) -> f64 {
        let on = |side: &Spline, t: f64| side.point_and_derivative(t).0;
        let own = |u: f64, v: f64| self.point(on(self.row, u), on(self.profile, v));
        let mut largest = 0.0_f64;
        for t in (0..=SAMPLES).map(|at| f64::from(at) / f64::from(SAMPLES)) {
            let pairs = [(along[0], own(t, 0.0)), (along[1], own(t, 1.0)), (across[0], own(0.0, t)), (across[1], own(1.0, t))];
            largest = pairs.into_iter().fold(largest, |most, (side, point)| most.max(distance(on(side, t), point)));
        }
        largest
    }

    fn surface(&self) -> Option<SplineSurface> {
        let [row, profile] = [self.row, self.profile].each(Spline::points);
        if row.len().saturating_mul(profile.len()) > MOST {
            return None;
        }
        let points = row.iter().map(|along| profile.iter().map(|profile| self.point(*along, *profile)).collect()).collect();
        SplineSurface::new([3, 3], [self.row.knots().to_vec(), self.profile.knots().to_vec()], points, None).ok()
    }
}

fn transposed(surface: &SplineSurface) -> Result<SplineSurface, CurveError> {
    let ([p, q], [u, v]) = (surface.degrees(), surface.knots().clone());
    let columns = surface.points().first().map_or(0, Vec::len);
    let points = (0..columns).map(|at| surface.points().iter().filter_map(|row| row.get(at).copied()).collect()).collect();
    SplineSurface::new([q, p], [v, u], points, None)
}
