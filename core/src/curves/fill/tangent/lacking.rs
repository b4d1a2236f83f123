//! The difference that a surface lacks to have the tangent planes of its neighbours, as a surface of its own.

use super::super::basis;
use super::super::spline::{Jet, SplineSurface};
use super::flank::{self, Held, Hermite, Known, Side};
use super::ribbon::{self, Node};
use crate::curves::curve::{CurveError, Spline};
use crate::curves::vector::{Point, add, cross, dot, norm, scale, sub, unit};

/// Normals along a side are off by no more than this, radians, but near corners whose twists disagree.
const ANGLE: f64 = 1e-7;
/// Vectors across a side are off along their plane by no more than this share.
const ALONG: f64 = 1e-4;
/// The part of a neighbour at its end where slopes are taken.
const NEAR: f64 = 0.01;
/// Samples of a neighbour's part at which angles are measured.
const SAMPLES: u32 = 32;

/// The difference that a surface lacks to have the tangent planes of its neighbours, and the numbers of those whose planes it can have: of
/// others, a side at a corner leaves the plane by more than the angle of this cosine. `None` if it can have none. The surface is
/// of degree 3 both ways, on 0 to 1. O(control points).
pub(super) fn lacking(surface: &SplineSurface, known: &[Known<'_>], smooth: f64) -> Option<(SplineSurface, Vec<usize>)> {
    let sides: [Side<'_>; 4] = std::array::from_fn(|number| Side::new(surface, number));
    let mut held: Vec<Held<'_>> = (0..known.len()).filter_map(|number| Held::new(&sides, known, number, smooth)).collect();
    flank::join(&sides, &mut held, smooth);
    if held.is_empty() {
        return None;
    }
    let twists: [Option<Point>; 4] = std::array::from_fn(|corner| twist(&sides, &held, corner));
    let ribbons: Vec<Spline> = sides.iter().map(|side| ribbon(side, &held, &twists)).collect::<Option<_>>()?;
    let wanted: [Point; 4] = std::array::from_fn(|corner| {
        twists.get(corner).copied().flatten().map_or([0.0; 3], |twist| sub(twist, jet_at(surface, corner).second[1]))
    });
    let ribbons: [Spline; 4] = ribbons.try_into().ok()?;
    Some((blended(&ribbons, &wanted).ok()?, held.iter().map(|held| held.number).collect()))
}

/// Corners are at (0, 0), (1, 0), (0, 1), (1, 1).
fn jet_at(surface: &SplineSurface, corner: usize) -> Jet {
    surface.jet([(corner & 1) as f64, (corner >> 1) as f64])
}

/// The mixed derivative at a corner: the mean of what sides with neighbours want there; at a point, that of straight lines
/// between the directions of the sides that meet there, which all lie in one plane. `None` if it may stay as it is.
fn twist(sides: &[Side<'_>; 4], held: &[Held<'_>], corner: usize) -> Option<Point> {
    let ends = held.iter().flat_map(|held| [0, 1].map(|end| (held, end)));
    let here: Vec<(&Held<'_>, usize)> =
        ends.filter(|(held, end)| held.is_at_corner(*end) && Side::corner(held.side, *end) == corner).collect();
    if let Some(side) = sides.iter().find(|side| side.is_point() && side.ends().contains(&corner))
        && held
            .iter()
            .any(|held| [0, 1].iter().any(|end| held.is_at_corner(*end) && side.ends().contains(&Side::corner(held.side, *end))))
    {
        return Some(sub(side.across(1.0), side.across(0.0)));
    }
    let sum = here.iter().filter_map(|(held, end)| held.slopes.get(*end)).fold([0.0; 3], |sum, slope| add(sum, *slope));
    (!here.is_empty()).then(|| scale(sum, 1.0 / here.len() as f64))
}

/// The difference that the vectors across a side lack.
fn ribbon(side: &Side<'_>, held: &[Held<'_>], twists: &[Option<Point>; 4]) -> Option<Spline> {
    let corner = |end: usize| {
        let corner = Side::corner(side.number, end);
        let twist = twists.get(corner).copied().flatten();
        let slope = twist.map_or([0.0; 3], |twist| sub(twist, jet_at(side.surface, corner).second[1]));
        Node::smooth(end as f64, [0.0; 3], slope)
    };
    let own: Vec<&Held<'_>> = held.iter().filter(|held| held.side == side.number).collect();
    let [start, end] = side.ends();
    if side.is_point() && twists.get(start).copied().flatten().or(twists.get(end).copied().flatten()).is_some() {
        return of_point(side, [corner(0), corner(1)]);
    }
    let mut joints: Vec<f64> = own.iter().flat_map(|held| held.span).filter(|s| *s > 0.0 && *s < 1.0).collect();
    joints.sort_by(f64::total_cmp);
    joints.dedup();
    let mut nodes = vec![corner(0)];
    nodes.extend(joints.into_iter().filter_map(|s| joint(side, &own, s)));
    nodes.push(corner(1));
    let mut all = Vec::new();
    for pair in nodes.windows(2) {
        let &[from, to] = pair else { continue };
        let middle = 0.5 * (from.at + to.at);
        match own.iter().find(|held| held.span[0] <= middle && middle <= held.span[1]) {
            Some(held) => follow(&mut all, side, held, [from, to])?,
            None => all.push(from),
        }
    }
    all.extend(nodes.last());
    ribbon::spline(&all).ok()
}

/// Where neighbours end within a side.
fn joint(side: &Side<'_>, own: &[&Held<'_>], s: f64) -> Option<Node> {
    let here = || own.iter().flat_map(|held| [0, 1].map(|end: usize| (held, end))).filter(|(held, end)| held.span[*end] == s);
    let count = here().count().max(1) as f64;
    let mean =
        |of: fn(&Held<'_>, usize) -> Point| scale(here().fold([0.0; 3], |sum, (held, end)| add(sum, of(held, end))), 1.0 / count);
    let (vector, slope) = (mean(|held, end| held.ends[end]), mean(|held, end| held.slopes[end]));
    let wide = NEAR * here().map(|(held, _)| held.span[1] - held.span[0]).fold(f64::INFINITY, f64::min);
    let across = |span: [f64; 2]| {
        let inside = flank::inside(span);
        ribbon::slopes(&|s| Some(side.across(inside(s))), span)
    };
    let slopes = [across([s - wide, s])?[1], across([s, s + wide])?[0]].map(|own| sub(slope, own));
    Some(Node { at: s, vector: sub(vector, side.across(s)), slopes })
}

/// Of a side that is a point: vectors that lie in one plane, straight between those at its ends.
fn of_point(side: &Side<'_>, ends: [Node; 2]) -> Option<Spline> {
    let [from, to] = [0.0, 1.0].map(|s| side.across(s));
    let wanted = |s: f64| add(scale(from, 1.0 - s), scale(to, s));
    let vector = |s: f64| Some(sub(wanted(s), side.across(s)));
    let size = norm(from).max(norm(to));
    let is_near = |s: f64, own: Point| vector(s).is_some_and(|vector| norm(sub(own, vector)) <= ANGLE * size);
    let mut nodes = Vec::new();
    ribbon::extend(&mut nodes, ends, &side.cuts(), &vector, &is_near)?;
    nodes.push(ends[1]);
    ribbon::spline(&nodes).ok()
}

/// Nodes along a neighbour.
fn follow(all: &mut Vec<Node>, side: &Side<'_>, held: &Held<'_>, ends: [Node; 2]) -> Option<()> {
    let inside = flank::inside(held.span);
    // Slopes of what is wanted: what is lacking, and what there is.
    let own = ribbon::slopes(&|s| Some(side.across(inside(s))), held.span)?;
    let hermite = Hermite::new(side, held, [add(ends[0].slopes[1], own[0]), add(ends[1].slopes[0], own[1])])?;
    let vector = |s: f64| Some(sub(hermite.vector(&held.frame(side, s)?, s), side.across(inside(s))));
    let is_near = |s: f64, lack: Point| {
        held.frame(side, s).is_some_and(|frame| {
            let (wanted, found) = (hermite.vector(&frame, s), add(lack, side.across(inside(s))));
            dot(found, frame.normal).abs() <= ANGLE * dot(found, frame.across).abs()
                && norm(sub(found, wanted)) <= ALONG * norm(wanted)
        })
    };
    ribbon::extend(all, ends, &side.cuts(), &vector, &is_near)
}

/// Angles between the normals of a surface and those of neighbours at samples of their parts, radians: the mean and the largest.
pub(super) fn angles(surface: &SplineSurface, known: &[Known<'_>], held: &[usize]) -> [f64; 2] {
    let (mut sum, mut largest, mut count) = (0.0, 0.0_f64, 0.0);
    for one in held.iter().filter_map(|number| known.get(*number)) {
        let side = Side::new(surface, one.side);
        for s in (0..SAMPLES).map(|at| one.span[0] + (one.span[1] - one.span[0]) * (f64::from(at) + 0.5) / f64::from(SAMPLES)) {
            let [along, across] = side.derivatives(s);
            let (Some(own), Some(other)) = (unit(cross(along, across)), (one.normal)(s, side.point(s))) else { continue };
            let angle = norm(cross(own, other)).atan2(dot(own, other).abs());
            (sum, largest, count) = (sum + angle, largest.max(angle), count + 1.0);
        }
    }
    [sum / f64::max(count, 1.0), largest]
}

/// The surface that is 0 along its sides, and whose vectors across them are these: along v = 0, u = 1, v = 1, u = 0, in the
/// directions of u and v. Twists are those at (0, 0), (1, 0), (0, 1), (1, 1).
fn blended([bottom, right, top, left]: &[Spline; 4], twists: &[Point; 4]) -> Result<SplineSurface, CurveError> {
    let [u, v] = [basis::union(bottom.knots(), top.knots()), basis::union(left.knots(), right.knots())];
    let finer = |side: &Spline, knots: &[f64]| basis::refined(3, side.knots(), side.points(), knots);
    let (bottom, top, left, right) = (finer(bottom, &u), finer(top, &u), finer(left, &v), finer(right, &v));
    let (along, across) = (factors(&u), factors(&v));
    let [p, q, r, s] = *twists;
    let row = |((b, t), [x, y]): ((&Point, &Point), &[f64; 2])| {
        let column = |((l, r_), [z, w]): ((&Point, &Point), &[f64; 2])| {
            let sides = add(add(scale(*b, *z), scale(*t, *w)), add(scale(*l, *x), scale(*r_, *y)));
            let corners = add(add(scale(p, x * z), scale(q, y * z)), add(scale(r, x * w), scale(s, y * w)));
            sub(sides, corners)
        };
        left.iter().zip(&right).zip(&across).map(column).collect()
    };
    let points = bottom.iter().zip(&top).zip(&along).map(row).collect();
    SplineSurface::new([3, 3], [u, v], points, None)
}

/// Control values of Hermite's polynomials `t (1 − t)²` and `t² (t − 1)` for knots.
fn factors(knots: &[f64]) -> Vec<[f64; 2]> {
    let bezier = [0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0];
    let points = [[0.0; 3], [1.0 / 3.0, 0.0, 0.0], [0.0, -1.0 / 3.0, 0.0], [0.0; 3]];
    basis::refined(3, &bezier, &points, knots).into_iter().map(|[x, y, _]| [x, y]).collect()
}
