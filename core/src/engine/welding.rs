//! Files whose triangles hardly share a position are welded in the stream, before anything else is asked of them.
//!
//! All later steps work on the welded records. The report counts what there was before, as far as the weld saw it.

use crate::contract::error::Result;
use crate::contract::progress::Progress;
use crate::contract::report::{Defects, EditSummary, RepairName, Report};
use crate::contract::settings::{Limits, Profile};
use crate::diagnosis;
use crate::engine::judging;
use crate::geometry::distance::Tolerance;
use crate::io::read::MeshFile;
use crate::io::read_ahead::Guide;
use crate::output::edit::Edit;
use crate::repairs::WELD_NOTE;
use crate::stream::weld::{self, Counts};

/// Counts that the weld does not make.
const NOT_COUNTED: [&str; 10] = [
    "vertices_used",
    "degenerate_area",
    "degenerate_index",
    "duplicates_same",
    "duplicates_opposite",
    "boundary_loops",
    "nonmanifold_vertices",
    "components",
    "bodies",
    "noncommon_vertices",
];

/// The mesh to go on with, and what was welded, if anything was. Where every record of the edit is to be listed, all is done in one edit instead.
pub(crate) fn in_the_stream(
    mesh: MeshFile,
    profile: &Profile,
    limits: &Limits,
    progress: &dyn Progress,
) -> Result<(MeshFile, Option<Counts>)> {
    let records = mesh.records();
    let tolerance = |bounds: &_| diagnosis::tolerance(bounds, profile);
    let guide = Guide::new(records.as_flattened(), limits);
    if limits.list_edit {
        return Ok((mesh, None));
    }
    let Some(widest) = weld::widest_if_nothing_is_shared(records, &guide, tolerance) else { return Ok((mesh, None)) };
    let of_box = tolerance(&weld::bounds(records, &guide));
    let tolerance = Tolerance { weld: of_box.weld.min(widest), ..of_box };
    let welded = weld::weld(mesh.path(), records, tolerance, limits, progress)?;
    if !welded.keeps_all() {
        tracing::info!(
            crushed = welded.counts.crushed,
            "Not welded in the stream: some triangles are as small as what is welded."
        );
        return Ok((mesh, None));
    }
    tracing::info!(
        vertices = welded.counts.moved,
        farthest = welded.counts.farthest,
        "Welded in the stream: hardly a position was shared."
    );
    Ok((mesh.welded(welded.records), Some(welded.counts)))
}

/// Adds to a report what the weld counted and did before all else.
pub(crate) fn tell(report: &mut Report, counts: &Counts, (mesh, edit): (&MeshFile, &Edit)) {
    report.before = Defects {
        triangles: counts.triangles,
        vertices: counts.vertices,
        edges: counts.edges,
        boundary_edges: counts.boundary_edges,
        nonmanifold_edges: counts.nonmanifold_edges,
        inconsistent_edges: counts.inconsistent_edges,
        unbalanced_edges: counts.unbalanced_edges,
        weldable_vertices: counts.weldable,
        nonfinite: report.before.nonfinite,
        bounds: report.before.bounds,
        area: report.before.area,
        volume: report.before.volume,
        at_least: NOT_COUNTED.map(String::from).to_vec(),
        ..Defects::default()
    };
    judging::add_first(report, RepairName::ToleranceWeld, counts.moved, WELD_NOTE);
    let (before, after) = (mesh.as_it_came(), mesh.records());
    let twice = edit.gone_records().filter(|t| before.get(*t as usize) != after.get(*t as usize)).count() as u64;
    let only_welded = counts.moved_triangles - twice;
    let EditSummary { untouched, moved, max_move, .. } = report.edit;
    report.edit.untouched = untouched - only_welded;
    report.edit.moved = moved + only_welded;
    report.edit.max_move = max_move.max(counts.farthest);
}
