//! What is made of a stretch of vertices or triangles, however it was read.

use super::super::faces::{Faces, Tally};
use super::super::finding::{Finding, Rejection};
use super::super::number::{self, COMMA};
use super::super::rounding::Rounding;
use super::super::spool::POSITION_BYTES;
use super::super::vertices::{Vertices, packed};
use crate::util::words::{Count, Counted};

/// An attribute's value without the blanks around it.
#[inline]
fn trimmed(value: &[u8]) -> &[u8] {
    match value {
        [first, .., last] if !number::is_blank(*first) && !number::is_blank(*last) => value,
        _ => value.trim_ascii(),
    }
}

/// A whole number, as an attribute has it. `None` if it is none, or beyond 64 bits.
#[inline]
fn whole(value: &[u8]) -> Option<u64> {
    let value = trimmed(value);
    let digits = value.strip_prefix(b"+").unwrap_or(value);
    if digits.is_empty() || digits.len() > 19 {
        return None;
    }
    digits.iter().try_fold(0u64, |sum, digit| {
        let digit = digit.wrapping_sub(b'0');
        (digit < 10).then(|| sum * 10 + u64::from(digit))
    })
}

/// Vertices of a stretch.
#[derive(Default)]
pub(super) struct Points {
    pub(super) positions: Vec<[u8; POSITION_BYTES]>,
    pub(super) counts: PointCounts,
}

/// What is told of vertices.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct PointCounts {
    pub(super) rounding: Rounding,
    /// With a coordinate that is missing or no number.
    damaged: u64,
    commas: u64,
}

impl Points {
    /// Appends a vertex. One that is damaged keeps its number, and has NaN where the number should be; then this is `false`.
    #[inline]
    pub(super) fn push(&mut self, coordinates: [Option<&[u8]>; 3]) -> bool {
        let counts = &mut self.counts;
        let mut sound = true;
        let mut read = |value: Option<&[u8]>| {
            let text = trimmed(value.unwrap_or_default());
            match number::number(text).filter(|number| number.length == text.len()) {
                Some(number) => {
                    counts.rounding.of_decimal(text, number.length, number.wide, number.value);
                    counts.commas += u64::from(number.separator & COMMA != 0);
                    number.value
                }
                None => {
                    sound = false;
                    f32::NAN
                }
            }
        };
        // Without `map`, which is not unrolled.
        let [x, y, z] = coordinates;
        let point = [read(x), read(y), read(z)];
        counts.damaged += u64::from(!sound);
        self.positions.push(packed(point));
        sound
    }
}

impl PointCounts {
    pub(super) fn append(&mut self, other: Self) {
        self.rounding.append(other.rounding);
        self.damaged += other.damaged;
        self.commas += other.commas;
    }

    /// Refuses vertices that are damaged for the most part.
    pub(super) fn judge(&self, vertices: u64) -> Result<(), Rejection> {
        if self.damaged <= vertices / 2 {
            return Ok(());
        }
        let vertices = Counted(vertices, "vertex", "vertices");
        Err(Rejection::Unreadable(format!("{} of {vertices} have coordinates that are no numbers", Count(self.damaged))))
    }

    pub(super) fn findings(&self) -> Vec<Finding> {
        let mut found = Vec::new();
        if self.damaged > 0 {
            let vertices = Counted(self.damaged, "vertex", "vertices");
            found.push(Finding::flaw(format!("{vertices} with a coordinate that is no number, read as NaN")));
        }
        if self.commas > 0 {
            found.push(Finding::flaw("decimal commas, read as points"));
        }
        found
    }
}

/// Attributes of a triangle that are asked for.
#[derive(Clone, Copy, Default)]
pub(super) struct Corners<'t> {
    pub(super) indices: [Option<&'t [u8]>; 3],
    /// It has a property of its own: `pid`, `p1`, `p2`, `p3`.
    pub(super) property: bool,
    /// It has attributes that 3MF Core does not have.
    pub(super) vendor: bool,
}

/// Triangles of a stretch.
pub(super) struct Shard<'v> {
    pub(super) faces: Faces<'v>,
    pub(super) counts: TriangleCounts,
}

/// What is told of triangles besides their vertices.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct TriangleCounts {
    pub(super) tally: Tally,
    /// With the same vertex twice.
    pub(super) repeated: u64,
    /// With properties of their own, or attributes of vendors.
    pub(super) with_any: u64,
}

impl<'v> Shard<'v> {
    pub(super) fn of(vertices: Vertices<'v>) -> Self {
        Self { faces: Faces::of(vertices), counts: TriangleCounts::default() }
    }

    /// Appends a triangle. An index that is missing or no number leads to no vertex; then this is `false`.
    #[inline]
    pub(super) fn push(&mut self, corners: Corners<'_>) -> bool {
        let read = |value: Option<&[u8]>| value.and_then(whole).unwrap_or(u64::MAX);
        let [a, b, c] = corners.indices;
        let [a, b, c] = [read(a), read(b), read(c)];
        self.counts.repeated += u64::from((a == b || b == c || c == a) && a.max(b).max(c) != u64::MAX);
        self.counts.with_any += u64::from(corners.property || corners.vendor);
        self.faces.triangle([a, b, c]);
        a.max(b).max(c) != u64::MAX
    }

    /// All that is told of these.
    pub(super) fn told(&self) -> TriangleCounts {
        TriangleCounts { tally: self.faces.tally, ..self.counts }
    }
}

impl TriangleCounts {
    pub(super) fn append(&mut self, behind: Self) {
        self.tally.append(behind.tally);
        self.repeated += behind.repeated;
        self.with_any += behind.with_any;
    }

    pub(super) fn findings(&self) -> Vec<Finding> {
        let mut found = self.tally.findings();
        if self.repeated > 0 {
            found.push(Finding::flaw(format!("{} with the same vertex twice", crate::util::words::triangles(self.repeated))));
        }
        found
    }
}
