//! Ear clipping with exact predicates.
//!
//! Based on: M. Held, "FIST: Fast industrial-strength triangulation of polygons", Algorithmica 30, 2001: ears in the order of their shape, and a grid
//! of the corners that can lie within one. A corner that is no ear for the sake of another one waits for it.
//!
//! Only corners that do not turn left can lie within an ear without another such corner doing so. In a keyhole polygon several corners share a
//! place; the angles at them do not overlap, so those at the ear's own corners are no hindrance if the diagonal lies within the angles at its ends.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use robust::{Coord, orient2d};

use super::cells::{Cells, NONE};

/// Steps per corner and doubling of the corners, after which a polygon crosses itself too much to be cut well. Of corners that repeat, there are two a
/// position at most: bridges to holes make no more.
const PATIENCE: usize = 64;
const CORNERS_A_POSITION: usize = 2;
/// Most steps, whatever the corners: a few seconds.
const MOST_PATIENCE: usize = 1 << 26;
/// Steps that taking a corner from a queue counts for.
const QUEUE: usize = 16;
/// Steps that the predicates of one corner count for.
const PREDICATES: usize = 4;

/// Cuts the polygon with these corners, more than three of them. `false`: it took too long, and its last triangles are a fan.
pub(super) fn clip(flat: impl Iterator<Item = Coord<f64>>, mut take: impl FnMut([usize; 3])) -> bool {
    let mut polygon = Polygon::of(flat.collect());
    for _ in 3..polygon.corners.len() {
        let Some(ear) = polygon.next_ear() else { break };
        let corner = polygon.corner(ear);
        take([corner.before, ear, corner.after].map(|place| place as usize));
        polygon.remove(ear);
    }
    // Three corners, or those of a polygon that took too long: a fan.
    let first = polygon.any;
    let mut last = polygon.corner(first).after;
    loop {
        let next = polygon.corner(last).after;
        if next == first {
            return polygon.patience > 0;
        }
        take([first, last, next].map(|place| place as usize));
        last = next;
    }
}

/// A corner that is left, and what it waits for.
#[derive(Clone, Copy)]
struct Corner {
    before: u32,
    after: u32,
    /// Changes with the neighbours, which makes entries of queues outdated.
    version: u32,
    /// 1 for a turn to the left, -1 to the right; 0 for none, or back.
    turn: i8,
    gone: bool,
    /// It is in the list of its cell.
    listed: bool,
    /// It lies on an edge of an ear and hinders it by where it goes on.
    touches: bool,
    /// Its diagonal lies outside of an angle at its ends.
    outside: bool,
    /// The next in the list of the cell.
    in_cell: u32,
    /// The first of those that wait for this one.
    waiting: u32,
    /// The corner that this one waits for, and its neighbours in the list of those that do.
    hindrance: u32,
    wait_before: u32,
    wait_after: u32,
}

/// Class, shape as an `f32` that is not negative, corner, version.
type Entry = Reverse<(u8, u32, u32, u32)>;

struct Polygon {
    places: Vec<Coord<f64>>,
    corners: Vec<Corner>,
    cells: Cells,
    /// Corners that may be ears.
    ready: BinaryHeap<Entry>,
    /// Once no corner was an ear: all others, for want of a better one.
    spare: Option<BinaryHeap<Entry>>,
    patience: usize,
    /// One that is left.
    any: u32,
}

impl Polygon {
    fn of(places: Vec<Coord<f64>>) -> Self {
        let count = places.len() as u32;
        let corner = |place: u32| Corner {
            before: if place == 0 { count - 1 } else { place - 1 },
            after: if place + 1 == count { 0 } else { place + 1 },
            version: 0,
            turn: 1,
            gone: false,
            listed: false,
            touches: false,
            outside: false,
            in_cell: NONE,
            waiting: NONE,
            hindrance: NONE,
            wait_before: NONE,
            wait_after: NONE,
        };
        let corners: Vec<Corner> = (0..count).map(corner).collect();
        let at = |place: u32| places[place as usize];
        let turns_left = |place: u32, corner: &Corner| orient2d(at(corner.before), at(place), at(corner.after)) > 0.0;
        let others = (0..count).zip(&corners).filter(|(place, corner)| !turns_left(*place, corner)).count();
        let cells = Cells::of(&places, others);
        let patience = patience(&places);
        let (ready, spare) = (BinaryHeap::new(), None);
        let mut polygon = Self { places, corners, cells, ready, spare, patience, any: 0 };
        (0..count).for_each(|corner| polygon.consider(corner));
        polygon
    }

    #[inline]
    fn corner(&self, corner: u32) -> &Corner {
        &self.corners[corner as usize]
    }

    #[inline]
    fn corner_mut(&mut self, corner: u32) -> &mut Corner {
        &mut self.corners[corner as usize]
    }

    #[inline]
    fn place(&self, corner: u32) -> Coord<f64> {
        self.places[corner as usize]
    }

    /// The places of a corner's neighbours and its own.
    #[inline]
    fn triangle(&self, corner: u32) -> [Coord<f64>; 3] {
        let Corner { before, after, .. } = *self.corner(corner);
        [before, corner, after].map(|corner| self.place(corner))
    }

    /// Looks at a corner whose neighbours are new.
    fn consider(&mut self, corner: u32) {
        let triangle = self.triangle(corner);
        let [u, v, w] = triangle;
        let turn = orient2d(u, v, w);
        self.leave(corner);
        let own = self.corner_mut(corner);
        own.version += 1;
        own.turn = if turn > 0.0 { 1 } else { -i8::from(turn < 0.0) };
        own.outside = false;
        let wakes = own.turn > 0 || std::mem::take(&mut own.touches);
        let listed = own.turn > 0 || std::mem::replace(&mut own.listed, true);
        if !listed {
            let cell = self.cells.cell(v);
            let first = std::mem::replace(self.cells.first(cell), corner);
            self.corner_mut(corner).in_cell = first;
        }
        if wakes {
            self.wake(corner);
        }
        self.queue(corner);
    }

    /// Puts a corner into the queue of those that may be ears, if it may; and into the other one.
    fn queue(&mut self, corner: u32) {
        let triangle = self.triangle(corner);
        let [u, v, w] = triangle;
        let Corner { turn, version, .. } = *self.corner(corner);
        let entry = |class: u8, shape: u32| Reverse((class, shape, corner, version));
        if u == v || v == w || u == w {
            self.ready.push(entry(0, 0));
        } else if turn > 0 {
            self.ready.push(entry(1, shape(triangle)));
        }
        if let Some(spare) = &mut self.spare {
            spare.push(entry(turn.unsigned_abs() + u8::from(turn < 0), shape(triangle)));
        }
    }

    /// The next corner to clip. `None` once patience ends.
    fn next_ear(&mut self) -> Option<u32> {
        while let Some(Reverse((class, _, corner, version))) = self.ready.pop() {
            if self.is_outdated(corner, version) {
                continue;
            }
            if class == 0 {
                return Some(corner);
            }
            self.patience = self.patience.saturating_sub(QUEUE);
            if self.patience == 0 {
                return None;
            }
            if self.is_ear(corner) {
                return Some(corner);
            }
        }
        if self.spare.is_none() {
            self.spare = Some(BinaryHeap::new());
            let all = 0..self.places.len() as u32;
            all.filter(|corner| !self.corner(*corner).gone).collect::<Vec<_>>().into_iter().for_each(|corner| self.queue(corner));
            self.ready.clear();
        }
        loop {
            let Reverse((.., corner, version)) = self.spare.as_mut()?.pop()?;
            if !self.is_outdated(corner, version) {
                return Some(corner);
            }
        }
    }

    fn is_outdated(&self, corner: u32, version: u32) -> bool {
        let own = self.corner(corner);
        own.gone || own.version != version
    }

    /// Whether a corner that turns left is an ear; if another one hinders it, it will wait for that.
    fn is_ear(&mut self, corner: u32) -> bool {
        let Corner { before, after, .. } = *self.corner(corner);
        let [u, _, w] = self.triangle(corner);
        let (first, last) = (*self.corner(before), *self.corner(after));
        let is_within = |end: &Corner, a, b, c| end.turn <= 0 || orient2d(a, b, c) > 0.0;
        if !is_within(&first, u, w, self.place(first.before)) || !is_within(&last, w, self.place(last.after), u) {
            self.corner_mut(corner).outside = true;
            return false;
        }
        let hindrance = self.hindrance(corner);
        if let Some(other) = hindrance {
            self.wait(corner, other);
        }
        hindrance.is_none()
    }

    /// A corner within this one's triangle. Lists lose those that turn left by now on the way.
    fn hindrance(&mut self, corner: u32) -> Option<u32> {
        let triangle = self.triangle(corner);
        let [a, b, c] = triangle;
        let low = Coord { x: a.x.min(b.x).min(c.x), y: a.y.min(b.y).min(c.y) };
        let high = Coord { x: a.x.max(b.x).max(c.x), y: a.y.max(b.y).max(c.y) };
        for row in self.cells.rows(&triangle) {
            for cell in self.cells.in_row(row, &triangle) {
                let mut previous = NONE;
                let mut at = *self.cells.first(cell);
                self.patience = self.patience.saturating_sub(1);
                while at != NONE {
                    self.patience = self.patience.saturating_sub(1);
                    let other = *self.corner(at);
                    if other.gone || other.turn > 0 {
                        self.corner_mut(at).listed = false;
                        if previous == NONE {
                            *self.cells.first(cell) = other.in_cell;
                        } else {
                            self.corner_mut(previous).in_cell = other.in_cell;
                        }
                    } else {
                        let z = self.place(at);
                        let near = low.x <= z.x && z.x <= high.x && low.y <= z.y && z.y <= high.y;
                        if near && self.hinders(at, &triangle) {
                            return Some(at);
                        }
                        previous = at;
                    }
                    at = other.in_cell;
                }
            }
        }
        None
    }

    /// Whether a corner lies within a triangle or on its diagonal, or on an edge and goes on within.
    fn hinders(&mut self, corner: u32, &[u, v, w]: &[Coord<f64>; 3]) -> bool {
        let z = self.place(corner);
        if z == u || z == v || z == w {
            return false;
        }
        self.patience = self.patience.saturating_sub(PREDICATES);
        let sides = [orient2d(u, v, z), orient2d(v, w, z), orient2d(w, u, z)];
        if sides.iter().any(|side| *side < 0.0) {
            return false;
        }
        let (from, to) = match sides {
            [.., 0.0] => return true,
            [0.0, ..] => (u, v),
            [_, 0.0, _] => (v, w),
            _ => return true,
        };
        let Corner { before, after, .. } = *self.corner(corner);
        let goes_on = [before, after].into_iter().any(|neighbour| orient2d(from, to, self.place(neighbour)) > 0.0);
        self.corner_mut(corner).touches |= goes_on;
        goes_on
    }

    /// Makes a corner wait for another one.
    fn wait(&mut self, corner: u32, other: u32) {
        self.leave(corner);
        let first = std::mem::replace(&mut self.corner_mut(other).waiting, corner);
        if first != NONE {
            self.corner_mut(first).wait_before = corner;
        }
        let own = self.corner_mut(corner);
        (own.hindrance, own.wait_before, own.wait_after) = (other, NONE, first);
    }

    /// Ends a corner's waiting.
    fn leave(&mut self, corner: u32) {
        let Corner { hindrance, wait_before, wait_after, .. } = *self.corner(corner);
        if hindrance == NONE {
            return;
        }
        if wait_before == NONE {
            self.corner_mut(hindrance).waiting = wait_after;
        } else {
            self.corner_mut(wait_before).wait_after = wait_after;
        }
        if wait_after != NONE {
            self.corner_mut(wait_after).wait_before = wait_before;
        }
        self.corner_mut(corner).hindrance = NONE;
    }

    /// Those that wait for this corner may be ears now.
    fn wake(&mut self, corner: u32) {
        let mut at = std::mem::replace(&mut self.corner_mut(corner).waiting, NONE);
        while at != NONE {
            let own = self.corner_mut(at);
            own.hindrance = NONE;
            let (next, version) = (own.wait_after, own.version);
            let shape = shape(self.triangle(at));
            self.ready.push(Reverse((1, shape, at, version)));
            at = next;
        }
    }

    /// Clips an ear.
    fn remove(&mut self, ear: u32) {
        let Corner { before, after, .. } = *self.corner(ear);
        self.leave(ear);
        self.corner_mut(ear).gone = true;
        self.wake(ear);
        self.corner_mut(before).after = after;
        self.corner_mut(after).before = before;
        self.any = before;
        self.consider(before);
        self.consider(after);
        // Whether a diagonal lies within the angle at its end depends on the end's neighbours.
        for beyond in [self.corner(before).before, self.corner(after).after] {
            if std::mem::take(&mut self.corner_mut(beyond).outside) {
                self.consider(beyond);
            }
        }
    }
}

/// Steps that a polygon may take.
fn patience(places: &[Coord<f64>]) -> usize {
    let mut sorted = places.to_vec();
    sorted.sort_unstable_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    sorted.dedup();
    let corners = places.len().min(CORNERS_A_POSITION * sorted.len());
    (PATIENCE * corners * (places.len().ilog2() as usize + 1)).min(MOST_PATIENCE)
}

/// The radius around a triangle: the smaller, the better an ear.
#[allow(clippy::disallowed_methods, reason = "a radius is not negative, and its bits are in its order")]
fn shape([a, b, c]: [Coord<f64>; 3]) -> u32 {
    let square = |a: Coord<f64>, b: Coord<f64>| (a.x - b.x).powi(2) + (a.y - b.y).powi(2);
    let radius =
        (square(a, b) * square(b, c) * square(c, a)).sqrt() / ((b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x)).abs();
    // What is no number is the worst.
    (radius as f32).min(f32::INFINITY).to_bits()
}
