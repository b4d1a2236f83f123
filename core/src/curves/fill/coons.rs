//! Surfaces between two, three or four sides.
//!
//! Based on: S. A. Coons, *Surfaces for computer-aided design of space forms*, MIT 1967 (bilinearly blended), as a B-spline in
//! paper S2.

use super::basis;
use super::spline::SplineSurface;
use super::sum::sum;
use crate::curves::curve::{CurveError, Spline};
use crate::curves::vector::{Point, add, cross, dot, plain_norm, scale, sub};
use crate::util::each::Each;

/// Control points of a surface, at most.
const MOST: usize = 1 << 22;
/// The width of a surface by its length that is rounding alone: of an outline that goes back the way it came.
const THINNEST: f64 = 1e-12;
/// Of the longest normal, one below this part has no direction to speak of.
const FLATTEST: f64 = 1e-9;

/// A bilinearly blended Coons surface: ruled along v, and along u, less the bilinear surface of the four corners. Parameters are
/// 0 to 1.
#[derive(Clone, Debug, PartialEq)]
pub struct Coons {
    /// At v = 0 and v = 1, from u = 0 to 1; cubic, on 0 to 1. A side that is a point is a curve whose control points are all the
    /// same.
    pub along: [Spline; 2],
    /// At u = 0 and u = 1, from v = 0 to 1.
    pub across: [Spline; 2],
    /// Corners at (0, 0), (1, 0), (0, 1), (1, 1).
    pub corners: [Point; 4],
    /// Of the four sides that the outline has: which is a point (three sides), or both across (two).
    pub sides: usize,
    /// Of each curve of the outline: the number of its side, and where it begins and ends on that, 0 to 1 in the direction of the
    /// outline.
    pub spans: Vec<(usize, f64, f64)>,
    /// A surface to which another one is added: one of revolution that nearly has these sides, so that blended is what it lacks; or
    /// what bends the blended surface into the tangent planes of its neighbours.
    pub base: Option<Box<Base>>,
}

/// A surface, and the Coons surface that is added to it.
#[derive(Clone, Debug, PartialEq)]
pub struct Base {
    /// Of degree 3 both ways, on 0 to 1.
    pub surface: SplineSurface,
    /// A surface that is added.
    pub rest: Coons,
}

impl Coons {
    /// The surface whose outline is `sides` in their order: four of them, three (the third is opposite to the side that becomes a
    /// point, so that the end of the first and the beginning of the third differ, and the second one is whole), or two.
    ///
    /// # Errors
    /// [`CurveError::Degenerate`] of any other number.
    pub(super) fn new(sides: &[Spline], spans: Vec<(usize, f64, f64)>) -> Result<Self, CurveError> {
        let (along, across) = match sides {
            [a, b, c, d] => ([a.clone(), c.clone().reversed()], [d.clone().reversed(), b.clone()]),
            // Around (0, 0), (1, 0), and the point at v = 1.
            [a, b, c] => ([a.clone(), point(end_of(b))?], [c.clone().reversed(), b.clone()]),
            [a, b] => ([a.clone(), b.clone().reversed()], [point(start(a))?, point(end_of(a))?]),
            _ => return Err(CurveError::Degenerate("a Coons surface of neither two, three nor four sides")),
        };
        let corners = [start(&along[0]), end_of(&along[0]), start(&along[1]), end_of(&along[1])];
        Ok(Self { along, across, corners, sides: sides.len(), spans, base: None })
    }

    /// The surface with the same sides that differs from another one, of degree 3 both ways on 0 to 1, by what is blended of the
    /// differences of their sides. O(control points).
    pub(super) fn on(mut self, surface: SplineSurface) -> Result<Self, CurveError> {
        let [u, v] = surface.knots();
        let end = |row: &Vec<Point>, is_last: bool| if is_last { row.last() } else { row.first() }.copied();
        let column = |is_last| surface.points().iter().filter_map(|row| end(row, is_last)).collect::<Vec<Point>>();
        let row = |row: Option<&Vec<Point>>| row.cloned().unwrap_or_default();
        let along = [lacking(&self.along[0], u, &column(false))?, lacking(&self.along[1], u, &column(true))?];
        let across = [
            lacking(&self.across[0], v, &row(surface.points().first()))?,
            lacking(&self.across[1], v, &row(surface.points().last()))?,
        ];
        let corners = [start(&along[0]), end_of(&along[0]), start(&along[1]), end_of(&along[1])];
        let rest = Self { along, across, corners, sides: self.sides, spans: Vec::new(), base: None };
        self.base = Some(Box::new(Base { surface, rest }));
        Ok(self)
    }

    /// The sum of this surface and one of degree 3 both ways on 0 to 1, which is 0 along its sides.
    pub(super) fn bent(mut self, surface: SplineSurface) -> Self {
        let rest = self.clone();
        self.base = Some(Box::new(Base { surface, rest }));
        self
    }

    /// Parameters of a place on a side of the outline.
    pub(super) fn parameters(&self, side: usize, t: f64) -> [f64; 2] {
        match (self.sides, side) {
            (_, 0) => [t, 0.0],
            (4, 1) | (3, 1) => [1.0, t],
            (4, 2) | (2, _) => [1.0 - t, 1.0],
            _ => [0.0, 1.0 - t],
        }
    }

    /// Point and first derivatives. O(log knots).
    #[must_use]
    pub fn point_and_derivatives(&self, [u, v]: [f64; 2]) -> (Point, [Point; 2]) {
        if let Some(base) = &self.base {
            return base.sum([u, v], base.rest.point_and_derivatives([u, v]));
        }
        let along = [&self.along[0], &self.along[1]].each(|side| side.point_and_derivative(u));
        let across = [&self.across[0], &self.across[1]].each(|side| side.point_and_derivative(v));
        self.blended([u, v], along, across)
    }

    /// Of points and derivatives of the sides.
    #[inline]
    fn blended(
        &self,
        [u, v]: [f64; 2],
        [(b, bu), (t, tu)]: [(Point, Point); 2],
        [(l, lv), (r, rv)]: [(Point, Point); 2],
    ) -> (Point, [Point; 2]) {
        let [p, q, s, e] = self.corners;
        let mix = |a: Point, b: Point, t: f64| add(scale(a, 1.0 - t), scale(b, t));
        let point = sub(add(mix(b, t, v), mix(l, r, u)), mix(mix(p, q, u), mix(s, e, u), v));
        let du = sub(add(mix(bu, tu, v), sub(r, l)), mix(sub(q, p), sub(e, s), v));
        let dv = sub(add(mix(lv, rv, u), sub(t, b)), sub(mix(s, e, u), mix(p, q, u)));
        (point, [du, dv])
    }

    /// Points and first derivatives at all pairs of parameters, a row for each u. Each side is evaluated once for each parameter.
    pub(super) fn grid(&self, us: &[f64], vs: &[f64]) -> Vec<Vec<(Point, [Point; 2])>> {
        if let Some(base) = &self.base {
            let mut rows = base.rest.grid(us, vs);
            for (row, u) in rows.iter_mut().zip(us) {
                row.iter_mut().zip(vs).for_each(|(entry, v)| *entry = base.sum([*u, *v], *entry));
            }
            return rows;
        }
        let jets = |side: &Spline, ts: &[f64]| -> Vec<(Point, Point)> {
            if side.points().iter().all(|point| *point == start(side)) {
                return vec![(start(side), [0.0; 3]); ts.len()];
            }
            ts.iter().map(|t| side.point_and_derivative(*t)).collect()
        };
        let along = [jets(&self.along[0], us), jets(&self.along[1], us)];
        let across = [jets(&self.across[0], vs), jets(&self.across[1], vs)];
        let pairs = |[a, b]: [Vec<(Point, Point)>; 2]| a.into_iter().zip(b).map(|(a, b)| [a, b]).collect::<Vec<_>>();
        let (along, across) = (pairs(along), pairs(across));
        let row = |(u, along): (&f64, &[(Point, Point); 2])| {
            vs.iter().zip(&across).map(|(v, across)| self.blended([*u, *v], *along, *across)).collect()
        };
        us.iter().zip(&along).map(row).collect()
    }

    /// The same surface as one B-spline, of degree 3 both ways: knots of opposite sides merged, and the linear factors written in
    /// the same functions by Greville's abscissae. Exact. O(control points).
    ///
    /// # Errors
    /// [`CurveError::Degenerate`] of more than four million control points.
    pub fn to_spline(&self) -> Result<SplineSurface, CurveError> {
        if let Some(base) = &self.base {
            return base.to_spline();
        }
        let [u, v] = [&self.along, &self.across].each(|[a, b]| basis::union(a.knots(), b.knots()));
        if u.len().saturating_mul(v.len()) > MOST {
            return Err(CurveError::Degenerate("a surface of more than 4,194,304 control points"));
        }
        let [bottom, top] = [&self.along[0], &self.along[1]].each(|side| basis::refined(3, side.knots(), side.points(), &u));
        let [left, right] = [&self.across[0], &self.across[1]].each(|side| basis::refined(3, side.knots(), side.points(), &v));
        let (means, heights) = (basis::greville(3, &u), basis::greville(3, &v));
        let [p, q, s, e] = self.corners;
        let mix = |a: Point, b: Point, t: f64| add(scale(a, 1.0 - t), scale(b, t));
        let row = |((&b, &t), &x): ((&Point, &Point), &f64)| -> Vec<Point> {
            let column = |((&l, &r), &y): ((&Point, &Point), &f64)| {
                sub(add(mix(b, t, y), mix(l, r, x)), mix(mix(p, q, x), mix(s, e, x), y))
            };
            left.iter().zip(&right).zip(&heights).map(column).collect()
        };
        let points = bottom.iter().zip(&top).zip(&means).map(row).collect();
        SplineSurface::new([3, 3], [u, v], points, None)
    }

    /// Whether it folds, or is no wider than rounding makes it: where its normal, on a grid of `count` × `count` inner points,
    /// turns away from the mean normal, or between neighbours by more than a right angle.
    #[must_use]
    pub fn is_folded(&self, count: u32) -> bool {
        let at = |number: u32| (f64::from(number) + 0.5) / f64::from(count);
        let ts: Vec<f64> = (0..count).map(at).collect();
        self.is_folded_on(&ts, &ts)
    }

    /// The same on any grid of parameters that grow.
    pub(super) fn is_folded_on(&self, us: &[f64], vs: &[f64]) -> bool {
        let rows: Vec<Vec<[Point; 2]>> =
            self.grid(us, vs).into_iter().map(|row| row.into_iter().map(|(_, slopes)| slopes).collect()).collect();
        let normals: Vec<Point> = rows.iter().flatten().map(|[du, dv]| cross(*du, *dv)).collect();
        let longest = |all: &mut dyn Iterator<Item = &Point>| all.fold(0.0_f64, |most, one| most.max(plain_norm(*one)));
        let size = longest(&mut rows.iter().flatten().flatten());
        let largest = longest(&mut normals.iter());
        if largest <= THINNEST * size * size || super::space::turns_away(&normals) {
            return true;
        }
        let is_back = |(a, b): (&Point, &Point)| dot(*a, *b) < 0.0 && plain_norm(*a).min(plain_norm(*b)) > FLATTEST * largest;
        let rows: Vec<&[Point]> = normals.chunks(vs.len().max(1)).collect();
        rows.iter().any(|row| row.iter().zip(row.iter().skip(1)).any(is_back))
            || rows.windows(2).any(|pair| pair[0].iter().zip(pair[1]).any(is_back))
    }
}

impl Base {
    fn sum(&self, place: [f64; 2], (point, [du, dv]): (Point, [Point; 2])) -> (Point, [Point; 2]) {
        let jet = self.surface.jet(place);
        (add(jet.point, point), [add(jet.first[0], du), add(jet.first[1], dv)])
    }

    fn to_spline(&self) -> Result<SplineSurface, CurveError> {
        sum(&self.rest.to_spline()?, &self.surface)
    }
}

/// What a side is beside a curve of these knots and points.
fn lacking(side: &Spline, knots: &[f64], points: &[Point]) -> Result<Spline, CurveError> {
    let union = basis::union(side.knots(), knots);
    let own = basis::refined(3, side.knots(), side.points(), &union);
    let other = basis::refined(3, knots, points, &union);
    let points = own.into_iter().zip(other).map(|(a, b)| sub(a, b)).collect();
    Spline::new(3, union, points, None, None)
}

fn start(side: &Spline) -> Point {
    side.points().first().copied().unwrap_or_default()
}

fn end_of(side: &Spline) -> Point {
    side.points().last().copied().unwrap_or_default()
}

fn point(point: Point) -> Result<Spline, CurveError> {
    Spline::new(3, vec![0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0], vec![point; 4], None, None)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::curves::vector::{between, distance};
    use proptest::prelude::*;

    fn side(a: Point, b: Point, bump: Point, knot: f64) -> Spline {
        let points = vec![a, add(between(a, b, 0.2), bump), between(a, b, 0.5), sub(between(a, b, 0.8), bump), b];
        Spline::new(3, vec![0.0, 0.0, 0.0, 0.0, knot, 1.0, 1.0, 1.0, 1.0], points, None, None).unwrap()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        /// The surface runs through its sides, and as a B-spline it is the same; derivatives agree.
        #[test]
        fn a_surface_has_its_sides(corners in prop::array::uniform4(prop::array::uniform3(-3.0..3.0_f64)),
            bumps in prop::array::uniform4(prop::array::uniform3(-1.0..1.0_f64)),
            u in 0.0..1.0_f64, v in 0.0..1.0_f64, count in 2_usize..5) {
            let all: Vec<Spline> = (0..count).map(|at| side(corners[at], corners[(at + 1) % count], bumps[at],
                0.3 + 0.1 * at as f64)).collect();
            let coons = Coons::new(&all, Vec::new()).unwrap();
            let at = |u: f64, v: f64| coons.point_and_derivatives([u, v]).0;
            let on = |number: usize, t: f64| all[number].point_and_derivative(t).0;
            prop_assert!(distance(at(u, 0.0), on(0, u)) < 1e-12);
            match count {
                4 => prop_assert!(distance(at(1.0, v), on(1, v)) < 1e-12 && distance(at(u, 1.0), on(2, 1.0 - u)) < 1e-12
                    && distance(at(0.0, v), on(3, 1.0 - v)) < 1e-12),
                3 => prop_assert!(distance(at(1.0, v), on(1, v)) < 1e-12 && distance(at(u, 1.0), corners[2]) < 1e-12
                    && distance(at(0.0, v), on(2, 1.0 - v)) < 1e-12),
                _ => prop_assert!(distance(at(u, 1.0), on(1, 1.0 - u)) < 1e-12),
            }
            let jet = coons.to_spline().unwrap().jet([u, v]);
            let (point, [du, dv]) = coons.point_and_derivatives([u, v]);
            prop_assert!(distance(jet.point, point) < 1e-12 && distance(jet.first[0], du) < 1e-10 && distance(jet.first[1],
                dv) < 1e-10);
        }
    }

    /// An outline that goes back the way it came has no width.
    #[test]
    fn a_slit_is_no_surface() {
        let bent = side([0.1, 0.2, 0.3], [1.3, 0.7, 0.1], [0.3, 0.1, 0.7], 0.4);
        assert!(Coons::new(&[bent.clone(), bent.reversed()], Vec::new()).unwrap().is_folded(8));
    }

    /// Straight sides of a square do not fold; with the order of two corners changed, they do.
    #[test]
    fn a_bow_tie_folds() {
        let square = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
        let all = |order: [usize; 4]| -> Vec<Spline> {
            (0..4).map(|at| side(square[order[at]], square[order[(at + 1) % 4]], [0.0; 3], 0.5)).collect()
        };
        assert!(!Coons::new(&all([0, 1, 2, 3]), Vec::new()).unwrap().is_folded(8));
        assert!(Coons::new(&all([0, 1, 3, 2]), Vec::new()).unwrap().is_folded(8));
    }

    /// A side of a square with a bump that is higher than the square: the surface folds above it.
    #[test]
    fn a_bump_through_the_opposite_side_folds() {
        let line = |a: Point, b: Point| side(a, b, [0.0; 3], 0.5);
        let knots = vec![0.0, 0.0, 0.0, 0.0, 0.5, 0.51, 0.52, 1.0, 1.0, 1.0, 1.0];
        let points = [0.0, 0.16, 0.33, 0.5, 0.66, 0.83, 1.0].map(|x| [x, if x == 0.5 { 1.5 } else { 0.0 }, 0.0]).to_vec();
        let bottom = Spline::new(3, knots, points, None, None).unwrap();
        let [b, c, d, a] = [[1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.0]];
        let coons = Coons::new(&[bottom, line(b, c), line(c, d), line(d, a)], Vec::new()).unwrap();
        let near: Vec<f64> = (1..200).map(|at| f64::from(at) / 200.0).collect();
        assert!(coons.is_folded_on(&near, &near));
    }
}
