//! New records of an edit, with the faces that they come from: those of a repair, and after them those of steps that followed. These may be as many
//! as a mesh that is larger than memory has, and lie in a file then.

use std::ops::Deref;

use crate::contract::report::{FaceOrigin, RepairName};
use crate::io::read::MeshFile;
use crate::io::record::Record;
use crate::io::write_behind::Nameless;

/// Records in memory, or the first ones of a file.
pub(crate) enum NewRecords {
    Memory(Vec<Record>),
    /// The file is there as long as its spool is.
    File {
        mesh: Box<MeshFile>,
        _spool: Nameless,
        count: usize,
    },
}

/// All new records of an edit, in order.
#[derive(Debug, Default)]
pub(crate) struct Added {
    /// Of the repair, each from a face of its own.
    own: Vec<Record>,
    own_from: Vec<FaceOrigin>,
    /// Of each later step.
    later: Vec<(NewRecords, RepairName)>,
}

impl Deref for NewRecords {
    type Target = [Record];

    fn deref(&self) -> &[Record] {
        match self {
            Self::Memory(records) => records,
            Self::File { mesh, count, .. } => mesh.records().get(..*count).unwrap_or_default(),
        }
    }
}

impl Default for NewRecords {
    fn default() -> Self {
        Vec::new().into()
    }
}

impl From<Vec<Record>> for NewRecords {
    fn from(records: Vec<Record>) -> Self {
        Self::Memory(records)
    }
}

impl std::fmt::Debug for NewRecords {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} records", self.len())
    }
}

impl Added {
    pub(super) const NONE: Self = Self { own: Vec::new(), own_from: Vec::new(), later: Vec::new() };

    /// One more of the repair; none of a later step is there yet.
    pub(super) fn push(&mut self, record: Record, from: FaceOrigin) {
        self.own.push(record);
        self.own_from.push(from);
    }

    /// Those of a later step follow.
    pub(super) fn follow(&mut self, records: NewRecords, repair: RepairName) {
        if !records.is_empty() {
            self.later.push((records, repair));
        }
    }

    /// Those of the last step that followed.
    pub(super) fn into_last(mut self) -> NewRecords {
        self.later.pop().map(|(records, _)| records).unwrap_or_default()
    }

    pub(super) fn len(&self) -> usize {
        self.own.len() + self.later.iter().map(|(records, _)| records.len()).sum::<usize>()
    }

    pub(super) fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Each with the face that it comes from.
    pub(super) fn iter(&self) -> impl Iterator<Item = (&Record, FaceOrigin)> {
        let own = self.own.iter().zip(self.own_from.iter().copied());
        let later = self.later.iter().flat_map(|(records, repair)| {
            let from = FaceOrigin::Repair(*repair);
            records.iter().map(move |record| (record, from))
        });
        own.chain(later)
    }

    /// The same with other faces that they come from.
    pub(super) fn with_origins(mut self, other: impl Fn(FaceOrigin) -> FaceOrigin) -> Self {
        self.own_from.iter_mut().for_each(|from| *from = other(*from));
        self
    }

    /// Only those stay for whose places `stays` holds. What is taken away from records in a file leaves the rest in memory.
    pub(super) fn retain(&mut self, stays: impl Fn(usize) -> bool) {
        let mut first = self.own.len();
        let mut place = 0..;
        self.own.retain(|_| place.next().is_none_or(&stays));
        let mut place = 0..;
        self.own_from.retain(|_| place.next().is_none_or(&stays));
        for (records, _) in &mut self.later {
            let places = first..first + records.len();
            first = places.end;
            if !places.clone().all(&stays) {
                let kept = places.zip(records.iter()).filter(|(place, _)| stays(*place)).map(|(_, record)| *record);
                *records = kept.collect::<Vec<_>>().into();
            }
        }
        self.later.retain(|(records, _)| !records.is_empty());
    }
}
