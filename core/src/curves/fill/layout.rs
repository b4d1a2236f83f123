//! Outlines on the flat maps of surfaces.

use super::chart::{Chart, Turned};
use crate::curves::vector::Point;

/// A point of an outline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Rim {
    /// Its number in the mesh.
    pub(super) vertex: u32,
    pub(super) point: Point,
    /// The place of its curve in the loop, and where on that (0 to 1 in the direction of the loop).
    pub(super) part: u32,
    pub(super) share: f64,
}

/// A corner of the mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Corner {
    /// On the outline, by its number in the mesh.
    Rim(u32),
    /// Within, by its number among the added points.
    Inner(u32),
}

/// An edge that is to be divided: its ends in the direction of its ring, and how far from the first one, in parts of its length.
pub(super) type Wish = ([Corner; 2], f64);

/// Rings of corners with their places on a chart: the first one anticlockwise, those of holes clockwise.
#[derive(Clone, Debug)]
pub(super) struct Layout {
    pub(super) chart: Chart,
    pub(super) rings: Vec<Vec<(Corner, [f64; 2])>>,
    /// Points of cuts from one ring to another.
    pub(super) added: Vec<Point>,
    /// Whether the outer ring runs clockwise as it is given, so that the chart was mirrored.
    pub(super) is_mirrored: bool,
}

/// The number of a ring, and of a point in it.
type Place = (usize, usize);

impl Layout {
    /// The longest edge whose middle is no farther than a distance from the surface, and along which that turns no more than an angle. A cone's radius changes:
    /// its narrowest place within the outline decides, but where that is the apex: edges across it are off by three times the distance at most. O(places).
    pub(super) fn longest(&self, chord: f64, angle: f64) -> f64 {
        let Chart::Turned(Turned::Cone(_, half)) = self.chart else { return self.chart.longest(chord, angle) };
        let far = self.rings.iter().flatten().map(|(_, [x, y])| x.hypot(*y)).fold(f64::INFINITY, f64::min);
        (8.0 * chord * (far * half.tan()).max(4.0 * chord)).sqrt()
    }

    /// Divides edges of cuts, which are in rings once in each direction; whether any was. Both sides of a cut get the same point.
    /// O(places · log places + wishes²), where wishes are few.
    pub(super) fn divide(&mut self, wishes: &[Wish]) -> bool {
        if self.added.is_empty() {
            return false;
        }
        let mut known: Vec<([Corner; 2], usize, usize)> = Vec::new();
        for (number, ring) in self.rings.iter().enumerate() {
            let next = ring.iter().cycle().skip(1);
            known.extend(ring.iter().zip(next).enumerate().map(|(at, ((a, _), (b, _)))| ([*a, *b], number, at)));
        }
        known.sort_unstable();
        let find = |ends: [Corner; 2]| {
            let from = known.partition_point(|(other, ..)| *other < ends);
            known.get(from).filter(|(other, ..)| *other == ends).map(|(_, ring, at)| (*ring, *at))
        };
        let mut new: Vec<(Place, (Corner, [f64; 2]))> = Vec::new();
        for (ends, share) in wishes {
            let [a, b] = *ends;
            let (Some(there), Some(back)) = (find([a, b]), find([b, a])) else { continue };
            if new.iter().any(|(at, _)| *at == there) {
                continue;
            }
            let between = |(ring, at): Place, share: f64| {
                let ring = self.rings.get(ring)?;
                let ((_, p), (_, q)) = (ring.get(at)?, ring.get((at + 1) % ring.len())?);
                Some([p[0] + share * (q[0] - p[0]), p[1] + share * (q[1] - p[1])])
            };
            let (Some(place), Some(other)) = (between(there, *share), between(back, 1.0 - share)) else { continue };
            let corner = Corner::Inner(self.added.len() as u32);
            self.added.push(self.chart.point(place));
            new.extend([(there, (corner, place)), (back, (corner, other))]);
        }
        new.sort_by_key(|(at, _)| std::cmp::Reverse(*at));
        for ((ring, at), entry) in &new {
            if let Some(ring) = self.rings.get_mut(*ring) {
                ring.insert(at + 1, *entry);
            }
        }
        !new.is_empty()
    }
}

/// Twice the area within a ring.
pub(super) fn area(ring: &[(Corner, [f64; 2])]) -> f64 {
    let Some(&(_, [x, y])) = ring.first() else { return 0.0 };
    let pairs = ring.windows(2);
    pairs.map(|pair| if let &[(_, [a, b]), (_, [c, d])] = pair { (a - x) * (d - y) - (b - y) * (c - x) } else { 0.0 }).sum()
}

/// Outer ring anticlockwise (mirrored, if it is not), the others clockwise (reversed, if they are not).
pub(super) fn oriented(chart: Chart, mut rings: Vec<Vec<(Corner, [f64; 2])>>, added: Vec<Point>) -> Layout {
    let is_mirrored = rings.first().is_some_and(|ring| area(ring) < 0.0);
    let outward = if is_mirrored { -1.0 } else { 1.0 };
    for ring in rings.iter_mut().skip(1) {
        if area(ring) * outward > 0.0 {
            ring.reverse();
        }
    }
    Layout { chart, rings, added, is_mirrored }
}

/// A ring without the points that it passes there and back again at once: seams that end at a pole. O(n).
pub(super) fn without_spurs(ring: &[Rim]) -> Vec<Rim> {
    let mut kept: Vec<Rim> = Vec::with_capacity(ring.len());
    for rim in ring {
        match kept.len().checked_sub(2).and_then(|at| kept.get(at)) {
            Some(before) if before.vertex == rim.vertex => {
                kept.pop();
            }
            _ => kept.push(*rim),
        }
    }
    let mut first = 0;
    while kept.len() - first > 3 {
        let (Some(start), Some(second), Some(last)) = (kept.get(first), kept.get(first + 1), kept.last()) else { break };
        let before = kept.get(kept.len() - 2);
        if start.vertex == last.vertex {
            kept.pop();
        } else if second.vertex == last.vertex {
            first += 1;
        } else if before.is_some_and(|before| before.vertex == start.vertex) {
            kept.pop();
        } else {
            break;
        }
    }
    kept.split_off(first)
}

/// A ring with angles that count turns, and what they have grown by when it is closed.
pub(super) type Lifted = (Vec<(Corner, [f64; 2])>, [f64; 2]);

/// Edges of a cut: about as long as those of the ring.
pub(super) fn steps(turned: &Turned, ring: &[(Corner, [f64; 2])], [from, to]: [[f64; 2]; 2]) -> u32 {
    let length = |a: [f64; 2], b: [f64; 2]| {
        let ([x, y], [u, v]) = (turned.flat(a), turned.flat(b));
        (x - u).hypot(y - v)
    };
    let whole: f64 = ring.windows(2).map(|pair| length(pair[0].1, pair[1].1)).sum();
    let edge = whole / ring.len().saturating_sub(1).max(1) as f64;
    (length(from, to) / edge).round().clamp(1.0, 1000.0) as u32
}
