//! Types of numbers, and how a row is made of them.

/// A type of number in a binary file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::io) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    /// Bytes it takes.
    pub(in crate::io) fn bytes(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// It may have a fraction.
    pub(in crate::io) fn is_float(self) -> bool {
        matches!(self, Self::F32 | Self::F64)
    }
}

/// A part of a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::io) enum Step {
    /// Numbers that are passed over.
    Skip { values: usize, bytes: usize },
    /// A coordinate of a vertex: its axis and its type.
    Coordinate(usize, Scalar),
    /// A length, and so many items.
    List { length: Scalar, item: Scalar, indices: bool },
}

/// The parts of a row, in their order.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(in crate::io) struct Layout {
    steps: Vec<Step>,
}

/// A row of one list with a length of one byte: the bytes before the length, of each item, and behind the list.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::io) struct ShortList {
    pub(in crate::io) before: usize,
    pub(in crate::io) item: usize,
    pub(in crate::io) behind: usize,
}

impl Layout {
    /// Appends a part; numbers to pass over are joined.
    pub(in crate::io) fn push(&mut self, step: Step) {
        match (self.steps.last_mut(), step) {
            (Some(Step::Skip { values, bytes }), Step::Skip { values: more, bytes: wider }) => {
                *values += more;
                *bytes += wider;
            }
            _ => self.steps.push(step),
        }
    }

    /// The parts.
    pub(in crate::io) fn steps(&self) -> &[Step] {
        &self.steps
    }

    /// The fewest bytes of a row: with empty lists.
    pub(in crate::io) fn least_bytes(&self) -> usize {
        let bytes = |step: &Step| match *step {
            Step::Skip { bytes, .. } => bytes,
            Step::Coordinate(_, kind) => kind.bytes(),
            Step::List { length, .. } => length.bytes(),
        };
        self.steps.iter().map(bytes).sum()
    }

    /// The bytes of every row, if there are no lists.
    pub(in crate::io) fn stride(&self) -> Option<usize> {
        let lists = self.steps.iter().any(|step| matches!(step, Step::List { .. }));
        (!lists).then(|| self.least_bytes())
    }

    /// This as a row of one list with a length of one byte, if it is one.
    pub(in crate::io) fn short_list(&self) -> Option<ShortList> {
        let (before, item, behind) = match *self.steps.as_slice() {
            [list] => (0, list, 0),
            [Step::Skip { bytes, .. }, list] => (bytes, list, 0),
            [list, Step::Skip { bytes, .. }] => (0, list, bytes),
            [Step::Skip { bytes: before, .. }, list, Step::Skip { bytes: behind, .. }] => (before, list, behind),
            _ => return None,
        };
        let Step::List { length: Scalar::U8, item, .. } = item else { return None };
        Some(ShortList { before, item: item.bytes(), behind })
    }

    /// Where x, y and z stand in a row, if they are three little-endian `f32` side by side, as [`super::super::vertices::Vertices`] reads them.
    pub(in crate::io) fn side_by_side(&self) -> Option<usize> {
        let mut at = 0;
        for (place, step) in self.steps.iter().enumerate() {
            match step {
                Step::Skip { bytes, .. } => at += bytes,
                Step::List { .. } => return None,
                Step::Coordinate(..) => {
                    let three = self.steps.get(place..place + 3)?;
                    let plain = three.iter().enumerate().all(|(axis, step)| *step == Step::Coordinate(axis, Scalar::F32));
                    return plain.then_some(at);
                }
            }
        }
        None
    }
}
