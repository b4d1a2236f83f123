//! What was done to a file, for its report.

use crate::contract::report::{BoundaryLoops, LoopLeft, Region, Repair, RepairName, SheetDropped, Skin, Volumes, Wrap};
use crate::detect::review::{Asked, Enclosed, Explained};

/// All that the report says of the repairs.
#[derive(Default)]
pub(crate) struct Account {
    /// By kind, in order of first use.
    done: Vec<(RepairName, Repair)>,
    /// The boundary loops as they were recognised, before any was closed.
    pub(crate) loops: Option<BoundaryLoops>,
    pub(crate) loops_left: Vec<LoopLeft>,
    pub(crate) sheets: Vec<SheetDropped>,
    /// Bodies in the material of others, which are gone.
    pub(crate) enclosed: Enclosed,
    /// Guesses of repairs that a person must look at, each a line that names the guess, its place and its size. A good result with any needs review.
    pub(crate) doubts: Vec<String>,
    /// Changes that nobody need look at.
    pub(crate) explained: Explained,
    /// Rims of lone sheets that stay open.
    pub(crate) open_sheets: u64,
    /// Surface that was added because the profile asked for it.
    pub(crate) asked: Asked,
    /// What was replaced because nothing else made it a solid, or would have been.
    pub(crate) wraps: Vec<Wrap>,
    /// What became of the volume of bodies; `None` where nothing was done that might have lost any.
    pub(crate) volumes: Option<Volumes>,
    /// What became of the surface that can be seen; `None` where it was not measured.
    pub(crate) skin: Option<Skin>,
    /// Where something was cut, snapped, taken apart, or dropped.
    pub(crate) regions: Vec<Region>,
}

impl Account {
    /// Adds to what was done of a kind. A kind is listed when something was done; later notes of the same kind are not needed.
    pub(crate) fn add(&mut self, name: RepairName, count: u64, note: String, seconds: f64) {
        match self.done.iter_mut().find(|(other, _)| *other == name) {
            Some((_, repair)) => {
                repair.count += count;
                repair.seconds += seconds;
            }
            None if count > 0 => self.done.push((name, Repair { name, count, note, seconds })),
            None => {}
        }
    }

    /// Counts less of what was done.
    pub(crate) fn take_back(&mut self, name: RepairName, count: u64) {
        if let Some((_, repair)) = self.done.iter_mut().find(|(other, _)| *other == name) {
            repair.count -= count;
        }
    }

    /// Says something of a repair that has changed nothing.
    pub(crate) fn say(&mut self, name: RepairName, note: String) {
        tracing::info!(name = name.as_str(), note, "A repair changed nothing.");
        self.done.push((name, Repair { name, count: 0, note, seconds: 0.0 }));
    }

    /// Some that lay in the material of others, or were made one with them, are gone.
    pub(crate) fn enclose(&mut self, bodies: u64, volume: f64) {
        self.enclosed.bodies += bodies;
        self.enclosed.volume += volume;
    }

    /// The list of repairs as it stands in the report.
    pub(crate) fn repairs(&mut self) -> Vec<Repair> {
        std::mem::take(&mut self.done).into_iter().map(|(_, repair)| repair).collect()
    }
}
