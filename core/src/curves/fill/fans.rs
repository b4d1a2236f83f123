//! A surface for each curve, straight to a centre (paper S2, where curves cannot be joined), as parts of a cone that are unrolled
//! one by one.
//!
//! Parts share the points of the spokes between them, and so do their triangles.

use super::chart::Chart;
use super::fan::{Fan, angle};
use super::layout::{Corner, Layout, Rim, Wish};
use super::options::Options;
use super::space;
use super::strand::Strand;
use crate::curves::Use;
use crate::curves::curve::Spline;
use crate::curves::vector::{Point, between, distance};

/// A part is seen under no more than this angle but for an edge, radians; so it can be unrolled.
const WIDEST: f64 = 2.0;
/// Samples of a curve that is alone.
const SAMPLES: u32 = 64;
/// Edges of a spoke, at most at first.
const MOST: f64 = 64.0;
/// Points of a spoke are no nearer to each other, in parts of its length.
const LEAST: f64 = 1.0 / 2048.0;

/// The mean of the ends and middles of curves, and of 64 points of one alone.
pub(super) fn centre(parts: &[(&Strand<'_>, Use)]) -> Point {
    let samples: Vec<Point> = match parts {
        [(strand, _)] => (0..SAMPLES).map(|at| strand.point(f64::from(at) / f64::from(SAMPLES))).collect(),
        parts => {
            let start = |one: &Use| if one.is_reversed { 1.0 } else { 0.0 };
            parts.iter().flat_map(|(strand, one)| [start(one), 0.5].map(|t| strand.point(t))).collect()
        }
    };
    space::mean(&samples)
}

/// A curve in the direction of the outline: as it was fitted, exact where that failed.
pub(super) fn curve(strand: &Strand<'_>, one: &Use, options: &Options) -> Option<Spline> {
    let fitted = strand.fitted(options.fit(strand.length)).as_ref().ok().map(|(spline, _)| spline.clone());
    let spline = fitted.or_else(|| strand.shape.to_spline().ok())?;
    Some(if one.is_reversed { spline.reversed() } else { spline })
}

/// Parts of a ring: numbers of the first and the last point of each, where the last part ends with the first point. Each curve
/// begins one, and any that is too wide is divided; there are three at least, since two would share both their spokes, and could have the same edge between these.
pub(super) fn parts(ring: &[Rim], centre: Point) -> Vec<[usize; 2]> {
    let found = parted(ring, centre, WIDEST);
    if found.len() > 2 {
        return found;
    }
    let next = ring.iter().cycle().skip(1);
    let all: f64 = ring.iter().zip(next).map(|(a, b)| angle(centre, a.point, b.point)).sum();
    parted(ring, centre, all / 3.0)
}

fn parted(ring: &[Rim], centre: Point, widest: f64) -> Vec<[usize; 2]> {
    let mut parts = Vec::new();
    let (mut first, mut wide) = (0, 0.0);
    for (at, (rim, next)) in ring.iter().zip(ring.iter().cycle().skip(1)).enumerate() {
        wide += angle(centre, rim.point, next.point);
        let is_last = at + 1 == ring.len();
        let further = ring.get(at + 2).map_or(0.0, |further| angle(centre, next.point, further.point));
        if is_last || next.part != rim.part || wide + further > widest {
            parts.push([first, at + 1]);
            (first, wide) = (at + 1, 0.0);
        }
    }
    parts
}

/// Shares of each spoke at which it has points, from the centre outwards and without both ends: edges of spokes are as long as those of the ring in
/// the mean, and all spokes have no more than about `inner` points.
pub(super) fn even(ring: &[Rim], centre: Point, inner: usize) -> Vec<Vec<f64>> {
    let next = ring.iter().cycle().skip(1);
    let around: f64 = ring.iter().zip(next).map(|(a, b)| distance(a.point, b.point)).sum();
    let curves = ring.last().map_or(1, |rim| rim.part as usize + 1);
    let most = (inner as f64 / curves as f64).clamp(1.0, MOST);
    let edge = around / ring.len().max(1) as f64;
    let spoke = |rim: &Rim| {
        let steps = (distance(rim.point, centre) / edge).round().clamp(1.0, most) as u32;
        (1..steps).map(|step| f64::from(step) / f64::from(steps)).collect()
    };
    ring.iter().map(spoke).collect()
}

/// Shares of each spoke in order, those of two parts that wish the same once, and none too near to another one.
pub(super) fn merge(shares: &mut [Vec<f64>]) {
    for spoke in shares {
        spoke.sort_by(f64::total_cmp);
        spoke.dedup_by(|a, b| *a - *b < LEAST);
    }
}

/// The centre, the points of spokes, and the triangles of parts so far.
pub(super) struct Spokes<'a> {
    ring: &'a [Rim],
    centre: Point,
    /// For each point of the ring, the shares of its spoke that have points.
    shares: &'a [Vec<f64>],
    /// The number of the first one; none before it is needed.
    firsts: Vec<Option<u32>>,
    /// The centre, and points of spokes and within parts.
    pub(super) points: Vec<Point>,
    pub(super) triangles: Vec<[Corner; 3]>,
}

impl<'a> Spokes<'a> {
    pub(super) fn new(ring: &'a [Rim], centre: Point, shares: &'a [Vec<f64>]) -> Self {
        Self { ring, centre, shares, firsts: vec![None; ring.len()], points: vec![centre], triangles: Vec::new() }
    }

    fn rim(&self, at: usize) -> Option<Rim> {
        self.ring.get(at % self.ring.len().max(1)).copied()
    }

    fn shares(&self, at: usize) -> &'a [f64] {
        self.shares.get(at % self.ring.len().max(1)).map_or(&[], Vec::as_slice)
    }

    /// Numbers of the points of a spoke, from the centre outwards, without both ends.
    fn spoke(&mut self, at: usize) -> std::ops::Range<u32> {
        let place = at % self.ring.len().max(1);
        let (Some(rim), Some(known)) = (self.rim(at), self.firsts.get(place).copied()) else { return 0..0 };
        let shares = self.shares(at);
        let first = known.unwrap_or_else(|| {
            let first = self.points.len() as u32;
            self.points.extend(shares.iter().map(|share| between(self.centre, rim.point, *share)));
            first
        });
        self.firsts.iter_mut().skip(place).take(1).for_each(|known| *known = Some(first));
        first..first + shares.len() as u32
    }

    /// Numbers among all points of those that a part has for its own first ones.
    fn shared(&mut self, [first, last]: &[usize; 2]) -> Vec<u32> {
        let (out, back) = (self.spoke(*first), self.spoke(*last));
        std::iter::once(0).chain(out).chain(back).collect()
    }

    /// A part, unrolled, and its points of the ring.
    pub(super) fn laid(&mut self, part: &[usize; 2]) -> (Layout, Vec<Rim>) {
        let [first, last] = *part;
        let rims: Vec<Rim> = (first..=last).filter_map(|at| self.rim(at)).collect();
        let fan = Fan::new(self.centre, rims.iter().map(|rim| rim.point).collect());
        let shared = self.shared(part);
        let (out, back) = (self.shares(first), self.shares(last));
        let on = |number: usize, share: f64| fan.place(number).map(|x| x * share);
        let inner = |number: usize| Corner::Inner(number as u32);
        let mut ring = vec![(Corner::Inner(0), [0.0; 2])];
        ring.extend(out.iter().enumerate().map(|(step, share)| (inner(1 + step), on(0, *share))));
        ring.extend(rims.iter().enumerate().map(|(number, rim)| (Corner::Rim(rim.vertex), fan.place(number))));
        let end = rims.len() - 1;
        ring.extend(back.iter().enumerate().rev().map(|(step, share)| (inner(1 + out.len() + step), on(end, *share))));
        let added = shared.iter().filter_map(|number| self.points.get(*number as usize)).copied().collect();
        (Layout { chart: Chart::Fan(Box::new(fan)), rings: vec![ring], added, is_mirrored: false }, rims)
    }

    /// Adds the shares at which a part wishes its spokes to be divided; whether there are any.
    pub(super) fn divide(&self, [first, last]: &[usize; 2], wishes: &[Wish], shares: &mut [Vec<f64>]) -> bool {
        let (out, back) = (self.shares(*first), self.shares(*last));
        // Places of both spokes along the ring of the part: outwards from 0 to 1, and back from 1 to 2 at the centre.
        let place = |corner: Corner, is_end: bool| match corner {
            Corner::Inner(0) => Some(if is_end { 2.0 } else { 0.0 }),
            Corner::Inner(number) => {
                let at = number as usize - 1;
                out.get(at).copied().or_else(|| back.get(at - out.len()).map(|share| 2.0 - share))
            }
            Corner::Rim(vertex) => {
                let is = |at: usize| self.rim(at).is_some_and(|rim| rim.vertex == vertex);
                (is(*first) || is(*last)).then_some(1.0)
            }
        };
        let mut is_any = false;
        for ([a, b], share) in wishes {
            let is_spoke = !matches!((a, b), (Corner::Rim(_), Corner::Rim(_)));
            let (Some(from), Some(to)) = (place(*a, false), place(*b, true)) else { continue };
            let at = from + share * (to - from);
            if is_spoke && at > 0.0 && at < 2.0 {
                let (spoke, share) = if at < 1.0 { (*first, at) } else { (*last, 2.0 - at) };
                shares.iter_mut().skip(spoke % self.ring.len().max(1)).take(1).for_each(|own| own.push(share));
                is_any = true;
            }
        }
        is_any
    }

    /// Takes over the triangles of a part.
    pub(super) fn take(&mut self, part: &[usize; 2], (points, triangles): (Vec<Point>, Vec<[Corner; 3]>)) {
        let shared = self.shared(part);
        let first = self.points.len();
        self.points.extend(points.iter().skip(shared.len()));
        let corner = |corner: Corner| match corner {
            Corner::Inner(number) => Corner::Inner(
                shared.get(number as usize).copied().unwrap_or((first + number as usize).saturating_sub(shared.len()) as u32),
            ),
            rim => rim,
        };
        self.triangles.extend(triangles.into_iter().map(|triangle| triangle.map(corner)));
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;
    use std::f64::consts::TAU;

    use super::*;
    use crate::curves::curve::Shape;
    use crate::curves::fill::{Filled, Method, Outline, Surface, fill};
    use crate::curves::vector::{add, cross, norm, scale, sub};

    /// A closed curve in so many pieces, each a cubic through its ends with its tangents.
    fn filled(count: u32, point: impl Fn(f64) -> Point) -> Filled {
        let at = |number: u32| TAU * f64::from(number % count) / f64::from(count);
        let step = TAU / f64::from(count);
        let slope = |t: f64| scale(sub(point(t + 1e-5), point(t - 1e-5)), 0.5e5 * step / 3.0);
        let curve = |number: u32| {
            let [a, b] = [at(number), at(number + 1)];
            let points = vec![point(a), add(point(a), slope(a)), sub(point(b), slope(b)), point(b)];
            Shape::Spline(Spline::new(3, vec![0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0], points, None, None).unwrap())
        };
        let shapes: Vec<Shape> = (0..count).map(curve).collect();
        let outer = (0..count as usize).map(|curve| Use { curve, is_reversed: false }).collect();
        fill(&shapes.iter().collect::<Vec<_>>(), &[Outline { outer, inner: Vec::new() }], &Options::default()).unwrap()
    }

    /// The seam of a tennis ball: no plane shows it without crossings, and a cone over all of it turns by more than a right angle;
    /// from its middle, it is simple.
    fn seam(t: f64) -> Point {
        [t.cos() + 0.4 * (3.0 * t).cos(), t.sin() - 0.4 * (3.0 * t).sin(), 1.2 * (2.0 * t).sin()]
    }

    #[test]
    fn a_seam_gets_a_surface_for_each_curve() {
        for count in [4, 7, 12] {
            let filled = filled(count, seam);
            let Surface::Fans { curves, centre } = &filled.surfaces[0] else { panic!("{count}: {:?}", filled.reports) };
            assert_eq!((curves.len(), filled.reports[0].method), (count as usize, Method::Fans));
            let mesh = &filled.mesh;
            let point = |number: u32| mesh.points[number as usize];
            let mut edges: BTreeMap<(u32, u32), i32> = BTreeMap::new();
            let mut whole = 0.0;
            for &[a, b, c] in &mesh.triangles {
                whole += norm(cross(sub(point(b), point(a)), sub(point(c), point(a))));
                for (a, b) in [(a, b), (b, c), (c, a)] {
                    *edges.entry((a, b)).or_default() += 1;
                }
            }
            assert!(edges.values().all(|times| *times == 1));
            let open: Vec<(u32, u32)> = edges.keys().copied().filter(|(a, b)| !edges.contains_key(&(*b, *a))).collect();
            // The outline alone is open. Triangles of its edges and the centre have the area of the mesh, but for what that cuts
            // off where they are bent, so no two of it overlap.
            let cone: f64 = open.iter().map(|(a, b)| norm(cross(sub(point(*a), *centre), sub(point(*b), *centre)))).sum();
            assert!(whole <= cone * (1.0 + 1e-12) && whole >= 0.97 * cone, "{whole} {cone}");
            assert!(open.len() >= 2 * count as usize);
        }
    }

    /// Twice around a drum, at two heights: from no point, a curve is seen beside itself.
    #[test]
    fn what_crosses_itself_is_left() {
        let filled =
            filled(9, |t| [(2.0 * t).cos() * (1.0 + 0.3 * t.cos()), (2.0 * t).sin() * (1.0 + 0.3 * t.cos()), 0.3 * t.sin()]);
        assert_eq!(filled.reports[0].method, Method::Fallback, "{:?}", filled.reports);
    }
}
