//! Moves in little memory.

use super::model::{Kind, Move};

/// Words of a move that change seldom.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Setting {
    axis: [f64; 3],
    feed: f32,
    tool: u32,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Arc {
    centre: [f64; 3],
    normal: [f64; 3],
    sweep: f64,
}

/// How a move goes; the number of its arc is among the arcs before it.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Way {
    Reference,
    Rapid,
    Feed,
    Arc(u32),
}

/// A move without its beginning, which is the end of the one before it: 40 bytes.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Packed {
    to: [f64; 3],
    way: Way,
    setting: u32,
    line: u32,
}

/// Moves in their order, each of which begins where the one before it ends.
///
/// Memory: 40 bytes a move, 56 more an arc, 32 more a change of feed, tool or axis (feed as `f32`).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Moves {
    start: [f64; 3],
    packed: Vec<Packed>,
    settings: Vec<Setting>,
    arcs: Vec<Arc>,
}

impl Moves {
    /// Adds a move, which has to begin where the last one ended. O(1).
    pub(crate) fn push(&mut self, one: &Move) {
        if self.packed.is_empty() {
            self.start = one.from;
        }
        let setting = Setting { axis: one.axis, feed: one.feed as f32, tool: one.tool };
        if self.settings.last() != Some(&setting) {
            self.settings.push(setting);
        }
        let way = match one.kind {
            Kind::Reference => Way::Reference,
            Kind::Rapid => Way::Rapid,
            Kind::Feed => Way::Feed,
            Kind::Arc { centre, normal, sweep } => {
                self.arcs.push(Arc { centre, normal, sweep });
                Way::Arc(self.arcs.len() as u32 - 1)
            }
        };
        self.packed.push(Packed { to: one.to, way, setting: self.settings.len() as u32 - 1, line: one.line });
    }

    /// How many there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.packed.len()
    }

    /// The memory that they take.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        let of = |count: usize, each: usize| count as u64 * each as u64;
        of(self.packed.len(), size_of::<Packed>())
            + of(self.settings.len(), size_of::<Setting>())
            + of(self.arcs.len(), size_of::<Arc>())
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.packed.is_empty()
    }

    /// A move by its number; `None` beyond the last one. O(1).
    #[must_use]
    pub fn get(&self, number: usize) -> Option<Move> {
        let packed = self.packed.get(number)?;
        let from = number.checked_sub(1).map_or(self.start, |before| self.packed[before].to);
        let setting = self.settings.get(packed.setting as usize)?;
        let kind = match packed.way {
            Way::Reference => Kind::Reference,
            Way::Rapid => Kind::Rapid,
            Way::Feed => Kind::Feed,
            Way::Arc(arc) => {
                let Arc { centre, normal, sweep } = *self.arcs.get(arc as usize)?;
                Kind::Arc { centre, normal, sweep }
            }
        };
        let (axis, tool, feed) = (setting.axis, setting.tool, f64::from(setting.feed));
        Some(Move { from, to: packed.to, kind, axis, tool, feed, line: packed.line })
    }

    /// All of them in their order. O(1) each.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = Move> + '_ {
        let fallback =
            Move { from: self.start, to: self.start, kind: Kind::Reference, axis: [0.0, 0.0, 1.0], tool: 0, feed: 0.0, line: 0 };
        (0..self.len()).map(move |number| self.get(number).unwrap_or(fallback))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Moves come out as they go in, and a packed one is small.
    #[test]
    fn moves_are_packed_without_loss() {
        assert!(size_of::<Packed>() <= 40 && size_of::<Setting>() <= 32);
        let axis = [0.0, 0.0, 1.0];
        let arc = Kind::Arc { centre: [1.0, 0.0, 0.0], normal: axis, sweep: 3.0 };
        let list = [
            Move { from: [0.5, 0.0, 0.0], to: [0.0, 0.0, 1.0], kind: Kind::Rapid, axis, tool: 0, feed: 0.0, line: 1 },
            Move { from: [0.0, 0.0, 1.0], to: [2.0, 0.0, 1.0], kind: arc, axis, tool: 3, feed: 100.0, line: 2 },
            Move { from: [2.0, 0.0, 1.0], to: [2.0, 5.0, 1.0], kind: Kind::Feed, axis, tool: 3, feed: 100.0, line: 9 },
        ];
        let mut moves = Moves::default();
        list.iter().for_each(|one| moves.push(one));
        assert_eq!(moves.iter().collect::<Vec<_>>(), list);
        assert_eq!(moves.bytes() as usize, 3 * size_of::<Packed>() + 2 * size_of::<Setting>() + size_of::<Arc>());
        assert_eq!(moves.get(3), None);
    }
}
