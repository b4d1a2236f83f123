//! Cutting moves, sorted by the tool that makes them.

use super::chains::Chains;
use super::options::Error;
use super::profile::Profile;
use super::tree::{Reach, Tree};
use crate::curves::vector::{Point, add, distance, dot, plain_norm, plain_unit, scale, sub};
use crate::toolpath::{Move, Moves, Tool};

/// An axis this close to Z is upright.
const UPRIGHT: f64 = 1.0 - 1e-12;
/// The axis of all tools that are upright.
const UP: Point = [0.0, 0.0, 1.0];

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
pub(crate) struct Family {
    pub(crate) profile: Profile,
    pub(crate) is_upright: bool,
    chains: Chains,
    pub(crate) tree: Tree,
}

impl Family {
    /// The places that a piece reaches; `None` where no piece has that number.
    fn reach(&self, piece: u32) -> Option<Reach> {
        let Segment { from, to, axis } = self.segment(piece)?;
        Some(Reach { ends: [from, to], shank: (!self.is_upright).then(|| scale(axis, self.profile.length)) })
    }

    /// A piece's ends; `None` where no piece has that number. O(1).
    pub(crate) fn segment(&self, piece: u32) -> Option<Segment> {
        let [from, to] = self.chains.ends(piece)?;
        let axis = if self.is_upright { UP } else { self.chains.axis(piece)? };
        Some(Segment { from, to, axis })
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
        let (way, before) = (self.segment(next)?.way(), own.way());
        (dot(way, before) >= 0.7 * plain_norm(way) * plain_norm(before)).then_some(next)
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

/// All that tools cut, ready to be asked for the cut nearest to a place.
///
/// Memory: about 30 bytes a piece, of which there are at most as many as moves and chords of arcs, and far fewer where moves are short; the moves
/// are not needed any more.
pub struct Cuts {
    pub(crate) families: Vec<Family>,
}

impl Cuts {
    /// Sorts the cutting moves by tool and builds a hierarchy over each tool's. O(n log n) for n moves.
    ///
    /// # Errors
    /// [`Error::Tool`] if a move's tool is not known; [`Error::NoCuts`]; [`Error::Stopped`] if `go_on` says so, which is asked at least every
    /// second.
    pub fn new(moves: &Moves, tools: &[Tool], go_on: &(dyn Fn() -> bool + Sync)) -> Result<Self, Error> {
        let mut sorted = Sorted { tools, keys: Vec::new(), families: Vec::new() };
        for (number, one) in moves.iter().enumerate() {
            if number % (1 << 16) == 0 && !go_on() {
                return Err(Error::Stopped);
            }
            if one.is_cut() && one.length() != 0.0 {
                sorted.push(&one)?;
            }
        }
        let mut families = sorted.families;
        for family in &mut families {
            family.chains.end();
            family.tree = Tree::new(family.chains.len(), &|piece| family.reach(piece));
            if !go_on() {
                return Err(Error::Stopped);
            }
        }
        if families.is_empty() { Err(Error::NoCuts) } else { Ok(Self { families }) }
    }

    /// The memory that they take.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.families.iter().map(|family| family.chains.bytes() + family.tree.bytes()).sum()
    }
}

/// Families that grow.
struct Sorted<'a> {
    tools: &'a [Tool],
    /// For each family its tool, and whether that is upright.
    keys: Vec<(u32, bool)>,
    families: Vec<Family>,
}

impl Sorted<'_> {
    fn push(&mut self, one: &Move) -> Result<(), Error> {
        let key = (one.tool, one.axis[2] >= UPRIGHT);
        if !self.keys.contains(&key) {
            let tool = self.tools.iter().find(|tool| tool.number == one.tool).ok_or(Error::Tool(one.tool))?;
            let profile = Profile::new(tool, key.1).ok_or(Error::Tool(one.tool))?;
            self.keys.push(key);
            self.families.push(Family { profile, is_upright: key.1, chains: Chains::default(), tree: Tree::default() });
        }
        let family = self.keys.iter().zip(&mut self.families).find(|(other, _)| **other == key);
        if let Some((_, Family { profile, is_upright, chains, .. })) = family {
            chains.push(one, profile, *is_upright);
        }
        Ok(())
    }
}
