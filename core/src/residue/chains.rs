//! The way of a tool's tip, as straight pieces: short moves that go straight on are one piece.
//!
//! Programs of free surfaces are made of moves much shorter than the tool is wide, on a line or nearly so. Only the places where the way bends count.

use super::profile::Profile;
use crate::curves::vector::{Point, distance, dot, plain_norm, scale, sub};
use crate::toolpath::{Kind, Move};

/// How far a chord may be from its arc, as a part of the tool's radius.
const CHORD: f64 = 1e-4;
/// How far an end of a move may be from the piece that stands for it, as a part of the tool's radius: a quarter of the tolerance with which a
/// vertex lies where the tool left the material.
const OFF: f64 = 5e-5;
/// Ends of moves within a piece, at most: each is looked at again for each further move.
const WITHIN: usize = 32;
/// Length of a piece, at most, in radii of the tool: boxes of long oblique pieces are mostly empty.
const LONGEST: f64 = 8.0;
/// Stands behind the last place of a chain.
const GAP: Point = [f64::NAN; 3];

/// Chains of places, one behind the other: a piece goes from a place to the next one, and has the number of the place where it begins.
///
/// Memory: 24 bytes a piece and a chain, 24 more a piece of a tool that leans.
#[derive(Default)]
pub(super) struct Chains {
    places: Vec<Point>,
    /// For each place the tool's axis on the piece from there; empty where all axes are upright.
    axes: Vec<Point>,
    /// Ends of moves within the last piece.
    within: Vec<Point>,
    /// Whether the last piece stands for lines alone.
    is_line: bool,
}

impl Chains {
    /// How many numbers of pieces there are, those between chains counted.
    pub(super) fn len(&self) -> usize {
        self.places.len()
    }

    /// The memory that they take.
    pub(super) fn bytes(&self) -> u64 {
        ((self.places.capacity() + self.axes.capacity()) * size_of::<Point>()) as u64
    }

    /// The ends of a piece; `None` beyond the last one and between chains. O(1).
    pub(super) fn ends(&self, piece: u32) -> Option<[Point; 2]> {
        let &[from, to] = self.places.get(piece as usize..)?.first_chunk()?;
        (!from[0].is_nan() && !to[0].is_nan()).then_some([from, to])
    }

    /// The axis of a piece that leans.
    pub(super) fn axis(&self, piece: u32) -> Option<Point> {
        self.axes.get(piece as usize).copied()
    }

    /// Takes a cutting move, which makes a new chain where it does not begin at the end of the last one. O(1).
    pub(super) fn push(&mut self, one: &Move, profile: &Profile, is_upright: bool) {
        if self.places.last() != Some(&one.from) {
            if !self.places.is_empty() {
                self.place(GAP, one.axis, is_upright);
            }
            self.place(one.from, one.axis, is_upright);
            self.is_line = false;
        }
        let parts = parts(one, profile);
        let is_line = parts == 1 && !matches!(one.kind, Kind::Arc { .. });
        if is_line && self.goes_on(one, profile) {
            if let Some(last) = self.places.last_mut() {
                self.within.push(*last);
                *last = one.to;
            }
            return;
        }
        self.within.clear();
        self.is_line = is_line;
        if let Some(axis) = self.axes.last_mut() {
            *axis = one.axis;
        }
        for part in 1..parts {
            self.place(one.point(f64::from(part) / f64::from(parts)), one.axis, is_upright);
        }
        self.place(one.to, one.axis, is_upright);
    }

    /// Gives back memory that is not needed. To be called behind the last move.
    pub(super) fn end(&mut self) {
        self.within = Vec::new();
        self.places.shrink_to_fit();
        self.axes.shrink_to_fit();
    }

    fn place(&mut self, place: Point, axis: Point, is_upright: bool) {
        self.places.push(place);
        if !is_upright {
            self.axes.push(axis);
        }
    }

    /// Whether the last piece may go on to a move's end: all ends of moves between are as near to it as [`OFF`] says.
    fn goes_on(&self, one: &Move, profile: &Profile) -> bool {
        let Some(&[from, last]) = self.places.last_chunk() else { return false };
        let is_same = self.is_line && self.axes.iter().rev().nth(1).is_none_or(|axis| *axis == one.axis);
        if !is_same || self.within.len() >= WITHIN || distance(from, one.to) > LONGEST * profile.radius {
            return false;
        }
        let way = sub(one.to, from);
        let most = OFF * profile.radius;
        let is_near = |place: &Point| {
            let gone = sub(*place, from);
            let at = (dot(gone, way) / dot(way, way)).clamp(0.0, 1.0);
            let away = sub(gone, scale(way, at));
            dot(away, away) <= most * most
        };
        is_near(&last) && self.within.iter().all(is_near)
    }
}

/// How many pieces a move has: arcs are cut into chords, long lines into shorter ones.
fn parts(one: &Move, profile: &Profile) -> u16 {
    let long = one.length() / (LONGEST * profile.radius);
    let fine = match one.kind {
        Kind::Arc { centre, normal, sweep } => {
            let from_centre = sub(one.from, centre);
            let radius = plain_norm(sub(from_centre, scale(normal, dot(from_centre, normal))));
            let chord = (CHORD * profile.radius).max(1e-12);
            // A chord over an angle a is radius·(1 − cos(a/2)) ≈ radius·a²/8 away from its arc.
            sweep.abs() / (8.0 * chord / radius.max(chord)).sqrt()
        }
        _ => 1.0,
    };
    long.max(fine).ceil().clamp(1.0, f64::from(u16::MAX)) as u16
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::curves::vector::add;
    use crate::toolpath::{Shape, Tool};

    const UP: Point = [0.0, 0.0, 1.0];

    fn along(places: &[Point], axes: &[Point]) -> (Chains, Profile) {
        let is_upright = axes.is_empty();
        let profile = Profile::new(&Tool::new(1, Shape::Ball, 6.0), is_upright).expect("a tool");
        let mut chains = Chains::default();
        for (number, pair) in places.windows(2).enumerate() {
            let axis = axes.get(number).copied().unwrap_or(UP);
            let one = Move { from: pair[0], to: pair[1], kind: Kind::Feed, axis, tool: 1, feed: 0.0, line: 1 };
            chains.push(&one, &profile, is_upright);
        }
        chains.end();
        (chains, profile)
    }

    fn pieces(chains: &Chains) -> Vec<[Point; 2]> {
        (0..chains.len() as u32).filter_map(|piece| chains.ends(piece)).collect()
    }

    /// Steps of a line are one piece; a step back and a corner begin another one.
    #[test]
    fn what_goes_straight_on_is_a_piece() {
        let (chains, _) = along(&[0.0, 0.1, 0.2, 0.3, 0.25].map(|x| [x, 0.0, 0.0]), &[]);
        assert_eq!(pieces(&chains), [[[0.0; 3], [0.3, 0.0, 0.0]], [[0.3, 0.0, 0.0], [0.25, 0.0, 0.0]]]);
        let (chains, _) = along(&[[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [1.0, 2.0, 0.0]], &[]);
        assert_eq!(pieces(&chains), [[[0.0; 3], [1.0, 0.0, 0.0]], [[1.0, 0.0, 0.0], [1.0, 2.0, 0.0]]]);
    }

    /// A leaning tool that turns on its way has a piece for each axis.
    #[test]
    fn another_axis_is_another_piece() {
        let [a, b] = [[0.6, 0.0, 0.8], [0.0, 0.6, 0.8]];
        let (chains, _) = along(&[0.0, 1.0, 2.0, 3.0].map(|x| [x, 0.0, 0.0]), &[a, a, b]);
        assert_eq!(pieces(&chains), [[[0.0; 3], [2.0, 0.0, 0.0]], [[2.0, 0.0, 0.0], [3.0, 0.0, 0.0]]]);
        assert_eq!([0, 1].map(|piece| chains.axis(piece)), [Some(a), Some(b)]);
    }

    /// Where a move does not begin where the last one ended, no piece leads there.
    #[test]
    fn there_is_no_piece_between_chains() {
        let (mut chains, profile) = along(&[[0.0; 3], [1.0, 0.0, 0.0]], &[]);
        let from = [5.0, 0.0, 0.0];
        let one = Move { from, to: [6.0, 0.0, 0.0], kind: Kind::Feed, axis: UP, tool: 1, feed: 0.0, line: 1 };
        chains.push(&one, &profile, true);
        assert_eq!(pieces(&chains), [[[0.0; 3], [1.0, 0.0, 0.0]], [from, [6.0, 0.0, 0.0]]]);
    }

    proptest::proptest! {
        /// Each end of a move is as near to the pieces as is said, ends of chains and of pieces are ends of moves, and a way with small
        /// bends needs fewer pieces than moves.
        #[test]
        fn pieces_are_near_the_moves(turns in proptest::collection::vec(-0.02..0.02f64, 50..300)) {
            let (mut places, mut course) = (vec![[0.0; 3]], 0.0f64);
            for turn in &turns {
                course += turn;
                let last = places[places.len() - 1];
                places.push(add(last, scale([course.cos(), 0.0, course.sin()], 0.01)));
            }
            let (chains, profile) = along(&places, &[]);
            let pieces = pieces(&chains);
            proptest::prop_assert!(pieces.len() * 3 < turns.len());
            proptest::prop_assert!(pieces.iter().flatten().all(|end| places.contains(end)));
            proptest::prop_assert_eq!((pieces[0][0], pieces[pieces.len() - 1][1]), (places[0], places[turns.len()]));
            for place in &places {
                let away = |[from, to]: &[Point; 2]| {
                    let (gone, way) = (sub(*place, *from), sub(*to, *from));
                    plain_norm(sub(gone, scale(way, (dot(gone, way) / dot(way, way)).clamp(0.0, 1.0))))
                };
                let least = pieces.iter().map(away).fold(f64::INFINITY, f64::min);
                proptest::prop_assert!(least <= OFF * profile.radius * (1.0 + 1e-9), "{}", least);
            }
        }
    }
}
