//! Cutting moves as straight pieces, sorted by the tool that makes them.

use super::options::Error;
use super::profile::Profile;
use super::tree::{Reach, Tree};
use crate::curves::vector::{Point, add, distance, dot, plain_norm, plain_unit, scale, sub};
use crate::toolpath::{Kind, Move, Moves, Tool};

/// How far a chord may be from its arc, as a part of the tool's radius.
const CHORD: f64 = 1e-4;
/// Length of a piece, at most, in radii of the tool: boxes of long oblique pieces are mostly empty.
const LONGEST: f64 = 8.0;
/// An axis this close to Z is upright.
const UPRIGHT: f64 = 1.0 - 1e-12;

/// A part of a move: 8 bytes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Piece {
    number: u32,
    part: u16,
    parts: u16,
}

/// A piece's ends, which are places of the tool's tip.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Segment {
    pub(crate) from: Point,
    pub(crate) to: Point,
    pub(crate) axis: Point,
}

impl Segment {
    pub(crate) fn way(&self) -> Point {
        sub(self.to, self.from)
    }
}

/// The cuts of one tool, either with an upright axis or with leaning ones.
pub(crate) struct Family<'a> {
    moves: &'a Moves,
    pub(crate) profile: Profile,
    pub(crate) is_upright: bool,
    pieces: Vec<Piece>,
    pub(crate) tree: Tree,
}

impl Family<'_> {
    /// The places that a piece reaches; `None` beyond the last one.
    fn reach(&self, piece: u32) -> Option<Reach> {
        let Segment { from, to, axis } = self.segment(piece)?;
        Some(Reach { ends: [from, to], shank: (!self.is_upright).then(|| scale(axis, self.profile.length)) })
    }

    /// A piece's ends; `None` beyond the last one. O(1).
    pub(crate) fn segment(&self, piece: u32) -> Option<Segment> {
        let piece = self.pieces.get(piece as usize)?;
        let one = self.moves.get(piece.number as usize)?;
        let at = |part: u16| match part {
            0 => one.from,
            part if part == piece.parts => one.to,
            part => one.point(f64::from(part) / f64::from(piece.parts)),
        };
        Some(Segment { from: at(piece.part), to: at(piece.part + 1), axis: one.axis })
    }

    /// Direction of the path about a place of a piece, and how far the path goes on behind and ahead without a corner, up to `window`.
    pub(crate) fn direction(&self, piece: u32, at: f64, window: f64) -> Option<(Point, [f64; 2])> {
        let own = self.segment(piece)?;
        let course = plain_unit(own.way())?;
        let foot = add(own.from, scale(own.way(), at));
        let (ahead, far) = self.walk((piece, own), (foot, course), (window, 1));
        let (behind, near) = self.walk((piece, own), (foot, course), (window, -1));
        Some((plain_unit(sub(far, near)).unwrap_or(course), [behind, ahead]))
    }

    /// The piece that goes on where one ends (`step` 1) or begins (−1), without a corner.
    pub(crate) fn next(&self, piece: u32, own: &Segment, step: i64) -> Option<u32> {
        let next = u32::try_from(i64::from(piece) + step).ok()?;
        let segment = self.segment(next)?;
        let (end, begin) = if step > 0 { (own.to, segment.from) } else { (own.from, segment.to) };
        let (way, before) = (segment.way(), own.way());
        (begin == end && dot(way, before) >= 0.7 * plain_norm(way) * plain_norm(before)).then_some(next)
    }

    /// Walks along the path, and says how far it came and where it is.
    fn walk(
        &self,
        (mut piece, mut own): (u32, Segment),
        (foot, course): (Point, Point),
        (window, step): (f64, i64),
    ) -> (f64, Point) {
        let (mut gone, mut here) = (0.0, foot);
        loop {
            let end = if step > 0 { own.to } else { own.from };
            let length = distance(here, end);
            if gone + length >= window {
                let share = if length > 0.0 { (window - gone) / length } else { 0.0 };
                return (window, add(here, scale(sub(end, here), share)));
            }
            gone += length;
            here = end;
            let Some(next) = self.next(piece, &own, step) else { return (gone, here) };
            let Some(segment) = self.segment(next) else { return (gone, here) };
            if dot(segment.way(), course) < 0.7 * plain_norm(segment.way()) {
                return (gone, here);
            }
            (piece, own) = (next, segment);
        }
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

/// Sorts the cutting moves by tool and builds a hierarchy over each tool's. O(n log n) for n pieces; 9 to 14 bytes a piece.
///
/// # Errors
/// [`Error::Tool`] if a move's tool is not known; [`Error::Stopped`].
pub(crate) fn families<'a>(
    moves: &'a Moves,
    tools: &[Tool],
    go_on: &(dyn Fn() -> bool + Sync),
) -> Result<Vec<Family<'a>>, Error> {
    let mut keys: Vec<((u32, bool), Profile, Vec<Piece>)> = Vec::new();
    for (one, number) in moves.iter().zip(0u32..) {
        if number % (1 << 16) == 0 && !go_on() {
            return Err(Error::Stopped);
        }
        if !one.is_cut() || one.length() == 0.0 {
            continue;
        }
        let key = (one.tool, one.axis[2] >= UPRIGHT);
        let place = match keys.iter().position(|(other, ..)| *other == key) {
            Some(place) => place,
            None => {
                let tool = tools.iter().find(|tool| tool.number == one.tool).ok_or(Error::Tool(one.tool))?;
                keys.push((key, Profile::new(tool, key.1).ok_or(Error::Tool(one.tool))?, Vec::new()));
                keys.len() - 1
            }
        };
        let Some((_, profile, pieces)) = keys.get_mut(place) else { continue };
        let parts = parts(&one, profile);
        pieces.extend((0..parts).map(|part| Piece { number, part, parts }));
    }
    let mut families = Vec::new();
    for ((_, is_upright), profile, mut pieces) in keys {
        pieces.shrink_to_fit();
        let mut family = Family { moves, profile, is_upright, pieces, tree: Tree::default() };
        family.tree = Tree::new(family.pieces.len(), &|piece| family.reach(piece));
        if !go_on() {
            return Err(Error::Stopped);
        }
        families.push(family);
    }
    Ok(families)
}
