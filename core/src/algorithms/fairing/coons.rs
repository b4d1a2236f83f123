//! A patch between feature curves: the rim is split at its corners into four sides, three or two, and the patch is the surface that blends them.
//!
//! The sides are polylines by their arc lengths, the surface is the bilinearly blended Coons surface of them (Farin, Hansford, "Discrete Coons patches",
//! CAGD 16, 1999); three sides have one that is a point, between two it is ruled (METHODS E). New vertices get their two parameters by an embedding into
//! the domain: edges are springs of a stiffness by their lengths, which no triangle of a disc in a convex domain turns over (Tutte, "How to draw a graph", 1963;
//! Floater, "Parametrization and smooth approximation of surface triangulations", CAGD 14, 1997).

use glam::{DVec2, DVec3};

use super::coarse::Unshaped;
use super::sheet::{Sheet, edges};
use super::sparse::{Factor, Rows};
use crate::util::ids::NONE;

/// A rim turns at a corner by an angle of at least this cosine.
const CORNER: f64 = 0.77;
/// Passes of the embedding, each with the lengths of the one before.
const PASSES: usize = 3;
/// Entries of the factor, at most.
const ENTRIES: usize = 40_000_000;

/// A side: its points with their shares of its length.
struct Side(Vec<(f64, DVec3)>);

impl Side {
    fn of(points: &[DVec3]) -> Option<Self> {
        let (mut sum, mut last) = (0.0, *points.first()?);
        let mut all: Vec<(f64, DVec3)> = Vec::with_capacity(points.len());
        for point in points {
            sum += last.distance(*point);
            last = *point;
            all.push((sum, *point));
        }
        all.iter_mut().for_each(|(at, _)| *at /= sum);
        (sum > 0.0).then_some(Self(all))
    }

    fn at(&self, share: f64) -> DVec3 {
        let next = self.0.partition_point(|(at, _)| *at <= share).clamp(1, self.0.len().max(2) - 1);
        let ((a, p), (b, q)) = (self.0[next - 1], self.0[next]);
        p.lerp(q, if b > a { ((share - a) / (b - a)).clamp(0.0, 1.0) } else { 0.0 })
    }
}

/// The surface between sides that follow each other around the patch.
struct Surface(Vec<Side>);

impl Surface {
    /// The place in the domain of a share of a side: corners of a square or of a triangle, or a lens.
    fn domain(&self, side: usize, share: f64) -> DVec2 {
        let corners: &[[f64; 2]] = match self.0.len() {
            4 => &[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]],
            3 => &[[0.0, 0.0], [1.0, 0.0], [0.5, 1.0]],
            _ => {
                let x = if side == 0 { share } else { 1.0 - share };
                let bulge = x * (1.0 - x);
                return DVec2::new(x, if side == 0 { -bulge } else { bulge });
            }
        };
        let [a, b] = [side, (side + 1) % corners.len()].map(|k| DVec2::from_array(corners[k]));
        a.lerp(b, share)
    }

    fn at(&self, place: DVec2) -> DVec3 {
        let DVec2 { x, y } = place;
        match self.0.as_slice() {
            [low, right, high, left] => coons([low, right, high, left].map(|side| |t: f64| side.at(t)), [x, y]),
            [low, right, left] => {
                let tip = right.at(1.0);
                let along = if y < 1.0 { ((x - 0.5 * y) / (1.0 - y)).clamp(0.0, 1.0) } else { 0.5 };
                let (u, v) = (along, y.clamp(0.0, 1.0));
                let [a, b] = [low.at(0.0), low.at(1.0)];
                let ruled = low.at(u) * (1.0 - v) + tip * v;
                let across = left.at(1.0 - v) * (1.0 - u) + right.at(v) * u;
                let corners = (a * (1.0 - u) + b * u) * (1.0 - v) + tip * v;
                ruled + across - corners
            }
            [low, high] => {
                let bulge = x * (1.0 - x);
                let v = if bulge > 0.0 { (0.5 * (y / bulge + 1.0)).clamp(0.0, 1.0) } else { 0.5 };
                low.at(x) * (1.0 - v) + high.at(1.0 - x) * v
            }
            _ => DVec3::ZERO,
        }
    }
}

fn coons(sides: [impl Fn(f64) -> DVec3; 4], [u, v]: [f64; 2]) -> DVec3 {
    let [low, right, high, left] = sides;
    let along = low(u) * (1.0 - v) + high(1.0 - u) * v;
    let across = left(1.0 - v) * (1.0 - u) + right(v) * u;
    let corners = (low(0.0) * (1.0 - u) + low(1.0) * u) * (1.0 - v) + (high(1.0) * (1.0 - u) + high(0.0) * u) * v;
    along + across - corners
}

/// Places the new vertices of a refined sheet on the surface between the sides of its rim.
///
/// # Errors
/// [`Unshaped`] of a rim that is not one loop with two corners at least.
pub(super) fn place(sheet: &mut Sheet<'_>) -> Result<(), Unshaped> {
    let rim = loop_of(sheet).ok_or(Unshaped::NotASurface)?;
    let points: Vec<DVec3> = rim.iter().map(|v| sheet.points[*v as usize]).collect();
    let corners = corners(&points);
    if corners.len() < 2 {
        return Err(Unshaped::Uncurved);
    }
    let mut fixed = vec![None; sheet.fixed];
    let mut sides = Vec::new();
    let around = |k: usize| points[k % points.len()];
    for (k, from) in corners.iter().enumerate() {
        let to = corners.get(k + 1).copied().unwrap_or(corners[0] + points.len());
        sides.push(Side::of(&(*from..=to).map(around).collect::<Vec<_>>()).ok_or(Unshaped::NotASurface)?);
    }
    let surface = Surface(sides);
    for (k, from) in corners.iter().enumerate() {
        for (step, (share, _)) in surface.0[k].0.iter().enumerate().take_while(|(_, (share, _))| *share < 1.0) {
            fixed[rim[(from + step) % rim.len()] as usize] = Some(surface.domain(k, *share));
        }
    }
    for _ in 0..PASSES {
        for (at, place) in (sheet.fixed..).zip(embedded(sheet, &fixed)?) {
            sheet.points[at] = surface.at(place);
        }
        sheet.relax();
    }
    Ok(())
}

/// The vertices of the rim in their order along the patch, if it is one loop.
fn loop_of(sheet: &Sheet<'_>) -> Option<Vec<u32>> {
    let sides = sheet.triangles.iter().zip(sheet.across()).flat_map(|(t, across)| edges(*t).into_iter().zip(*across));
    let mut next: Vec<[u32; 2]> = sides.filter(|(_, across)| *across == NONE).map(|(edge, _)| edge).collect();
    next.sort_unstable();
    let follow = |v: u32| next.binary_search_by_key(&v, |edge| edge[0]).ok().map(|at| next[at][1]);
    let first = next.first()?[0];
    let mut rim = vec![first];
    while let Some(v) = follow(*rim.last()?).filter(|v| *v != first) {
        rim.push(v);
        if rim.len() > next.len() {
            return None;
        }
    }
    (rim.len() == next.len()).then_some(rim)
}

/// Where the rim has corners, the four sharpest at most, in its order.
fn corners(points: &[DVec3]) -> Vec<usize> {
    let n = points.len();
    let turn = |k: usize| {
        let [a, b, c] = [k + n - 1, k, k + 1].map(|k| points[k % n]);
        (b - a).normalize_or_zero().dot((c - b).normalize_or_zero())
    };
    let mut all: Vec<(f64, usize)> = (0..n).map(|k| (turn(k), k)).filter(|(cosine, _)| *cosine < CORNER).collect();
    all.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut corners: Vec<usize> = all.into_iter().take(4).map(|(_, k)| k).collect();
    corners.sort_unstable();
    corners
}

/// The places in the domain of the new vertices, between those of the rim.
fn embedded(sheet: &Sheet<'_>, fixed: &[Option<DVec2>]) -> Result<Vec<DVec2>, Unshaped> {
    let new = sheet.points.len() - sheet.fixed;
    let mut around: Vec<Vec<(u32, f64)>> = vec![Vec::new(); new];
    for [a, b] in sheet.triangles.iter().flat_map(|t| edges(*t)) {
        let length = sheet.points[a as usize].distance(sheet.points[b as usize]).max(1e-9);
        // Each edge within has two triangles, and so it comes once in each direction.
        if let Some(own) = (a as usize).checked_sub(sheet.fixed) {
            around[own].push((b, 1.0 / length));
        }
    }
    let (mut matrix, mut sides) = (Rows::default(), Vec::new());
    for (own, around) in around.iter().enumerate() {
        let mut side = DVec3::ZERO;
        let mut row = vec![(own as u32, around.iter().map(|(_, weight)| weight).sum::<f64>())];
        for (other, weight) in around {
            match (*other as usize).checked_sub(sheet.fixed) {
                Some(other) => row.push((other as u32, -weight)),
                None => side += fixed[*other as usize].ok_or(Unshaped::NotASurface)?.extend(0.0) * *weight,
            }
        }
        matrix.push(row);
        sides.push(side);
    }
    let factor = Factor::new(&matrix, &sheet.points[sheet.fixed..], ENTRIES).ok_or(Unshaped::Unsolved)?;
    Ok(factor.solve(&sides).into_iter().map(DVec3::truncate).collect())
}
