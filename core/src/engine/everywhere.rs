//! Files in which most triangles are copies of others, or disagree with their neighbours, are set right in the stream before they are repaired.
//!
//! The repairs work on a nameless copy, in which the surface is drawn once and its triangles agree. The edit is told of the input all the same: what a copy
//! turned and a repair turned back is untouched.

use std::path::Path;

use memmap2::Mmap;

use crate::contract::error::{Error, Result};
use crate::contract::progress::Progress;
use crate::contract::report::{RepairName, Report};
use crate::contract::settings::{Limits, Profile};
use crate::diagnosis::Diagnosis;
use crate::engine::judging;
use crate::io::read::MeshFile;
use crate::io::read_ahead::Guide;
use crate::io::record::{self, Record};
use crate::io::write_behind;
use crate::output::edit::Edit;
use crate::repairs::{DUPLICATE_NOTE, ORIENT_NOTE};
use crate::topology::everywhere::{self, Everywhere};
use crate::topology::survey::Survey;
use crate::util::bits;

/// Counts of the input that are those of the copy.
const NOT_COUNTED: [&str; 8] = [
    "edges",
    "boundary_edges",
    "nonmanifold_edges",
    "unbalanced_edges",
    "inconsistent_edges",
    "nonmanifold_vertices",
    "duplicates_opposite",
    "bodies",
];

/// The records to work on, and how they differ from those of the file.
pub(crate) struct SetRight {
    records: Mmap,
    /// Of these records, a bit each.
    turned: Vec<u64>,
    found: Everywhere,
}

/// The survey of a file; where most of its corners are not regular, what was set right instead, if anything was.
pub(crate) fn survey<'m>(
    mesh: &'m MeshFile,
    profile: &Profile,
    limits: &Limits,
    progress: &dyn Progress,
) -> Result<(Option<Survey<'m>>, Option<SetRight>)> {
    let (path, records) = (mesh.path(), mesh.records());
    let Some(most) = everywhere::most_irregular(records.len()) else { return Ok((None, None)) };
    let survey = Survey::unless_irregular(path, records, profile.check_self_intersections, most, limits, progress)?;
    if survey.is_some() {
        return Ok((survey, None));
    }
    let Some(found) = everywhere::look(path, records, limits, progress)? else { return Ok((None, None)) };
    tracing::info!(copies = found.copies, turned = found.turns, "Set right in the stream: most triangles lay at defects.");
    let (records, turned) = copied(path, records, &found, limits)?;
    Ok((None, Some(SetRight { records, turned, found })))
}

/// The diagnosis of what [`survey`] found.
pub(crate) fn diagnose<'m>(
    (survey, set_right): (Option<Survey<'m>>, Option<&'m SetRight>),
    mesh: &'m MeshFile,
    profile: &Profile,
    limits: &Limits,
    progress: &dyn Progress,
) -> Result<Diagnosis<'m>> {
    let path = mesh.path();
    let survey = match (survey, set_right) {
        (Some(survey), _) => survey,
        (None, None) => Survey::new(path, mesh.records(), profile.check_self_intersections, limits, progress)?,
        (None, Some(set_right)) => {
            let mut survey = Survey::new(path, set_right.records(), profile.check_self_intersections, limits, progress)?;
            survey.turned.clone_from(&set_right.turned);
            survey
        }
    };
    Diagnosis::after(survey, path, profile)
}

impl SetRight {
    fn records(&self) -> &[Record] {
        self.records.as_chunks().0
    }

    /// An edit of these records as one of the file's.
    pub(crate) fn edit(&self, edit: Edit, mesh: &MeshFile) -> Edit {
        edit.over(&self.found.gone, &self.found.turned, mesh.records().len())
    }

    /// Adds to a report what was done before all else.
    pub(crate) fn tell(&self, report: &mut Report) {
        let Everywhere { copies, turns, contradictions, .. } = self.found;
        let before = &mut report.before;
        before.triangles += copies;
        before.duplicates_same += copies;
        before.inconsistent_edges = before.inconsistent_edges.max(contradictions);
        before.unbalanced_edges = before.unbalanced_edges.max(contradictions);
        before.at_least.extend(NOT_COUNTED.map(String::from));
        before.at_least.sort_unstable();
        before.at_least.dedup();
        for (name, count, note) in [(RepairName::Orient, turns, ORIENT_NOTE), (RepairName::Duplicate, copies, DUPLICATE_NOTE)] {
            if count > 0 {
                judging::add_first(report, name, count, note);
            }
        }
    }
}

/// The records as they are set right, in a file without a name, and those of them that were turned.
fn copied(path: &Path, records: &[Record], found: &Everywhere, limits: &Limits) -> Result<(Mmap, Vec<u64>)> {
    const PIECE: usize = 1 << 14;
    let left = records.len() - found.copies as usize;
    let need = ((left * size_of::<Record>()) as u64, "the triangles as they are set right");
    let guide = Guide::new(records.as_flattened(), limits);
    let (mut piece, mut t) = (Vec::with_capacity(PIECE), 0);
    let (mut turned, mut to) = (vec![0; left.div_ceil(64)], 0);
    let file = write_behind::spooled(path, limits, need, |append| {
        for block in guide.blocks(records).flat_map(|block| block.chunks(PIECE)) {
            piece.clear();
            for record in block {
                if !bits::holds(&found.gone, t) {
                    let turns = bits::holds(&found.turned, t);
                    piece.push(if turns { record::flip(record) } else { *record });
                    turned[to / 64] |= u64::from(turns) << (to % 64);
                    to += 1;
                }
                t += 1;
            }
            append(piece.as_flattened())?;
        }
        Ok(())
    })?;
    // SAFETY: the file has no name and this is its only handle: nobody else changes or truncates it.
    let map = unsafe { Mmap::map(&file) }.map_err(Error::io(&limits.spool_folder(), "mapping"))?;
    Ok((map, turned))
}
