//! Residue of a tool, by the path that a profile names; or places that may be residue, where it wants them looked for without one.

use std::ops::ControlFlow;
use std::path::Path;

use super::change::{Change, Told, is_moved, replaced, vertices_moved};
use super::corrections::{self, FromFiles, Origins};
use crate::contract::report::{MOST_LISTED, Outcome, Report, Residue, ResidueRegion, ResidueSuspect};
use crate::engine::mesh::Mesh;
use crate::engine::work::Work;
use crate::residue::{self, Corrections, Cuts, FIT_LEAST, Fit, Found, Frame, Kind, Repaired};
use crate::simplify::{self, Input, Options};
use crate::smooth;
use crate::toolpath::{self, Header, Moves, Program, ReadError, Tool, project, tools};
use crate::util::words::Counted;

/// Memory for each triangle of the mesh while residue is taken away; measured: 194 (of 5 M) to 203 (of 0.5 M).
pub(super) const BYTES_A_TRIANGLE: u64 = 208;
/// A part of that: while the cuts of the path are there too; measured: 71, of 5 M.
const SEARCH_BYTES_A_TRIANGLE: u64 = 80;
/// Regions keep this share of their triangles, where that keeps to the surface.
const SHARE: f64 = 0.2;
/// Of the lowest region's height, the simplified surface may be so far from the moved one.
const OFF: f64 = 0.5;
/// The share of vertices where the tool left the material ([`Fit::share`]) below which a person has to look.
const FIT_GOOD: f64 = 0.9;
/// Oddities of a path that are listed.
const FINDINGS: usize = 20;

/// The mesh without residue, or why that cannot be.
pub(super) fn find(mesh: &Mesh, origins: &dyn Fn() -> Origins, work: Work<'_>) -> Result<Change, String> {
    let settings = &work.profile.residue;
    let go_on = || !work.progress.cancelled();
    let FromFiles { triangles, mask } = corrections::read(mesh, origins, work)?;
    let corrections = Corrections { include: &settings.include, exclude: &settings.exclude, triangles: &triangles, mask: &mask };
    let options = residue::Options {
        tolerance: (settings.tolerance_mm > 0.0).then_some(settings.tolerance_mm),
        feature_degrees: work.profile.keep_edges_degrees,
        corrections,
        go_on: &go_on,
        ..Default::default()
    };
    if settings.toolpath.is_empty() { suspect(mesh, &options) } else { removed(mesh, &options, work) }
}

/// Places that may be residue; the mesh stays as it is.
fn suspect(mesh: &Mesh, options: &residue::Options<'_>) -> Result<Change, String> {
    let view = residue::Mesh { points: mesh.vertices(), faces: mesh.faces() };
    let found = residue::suspects(view, options).map_err(|error| error.to_string())?;
    let told = |suspect: &residue::Suspect| ResidueSuspect {
        height: suspect.height,
        pitch: suspect.pitch,
        across: suspect.across,
        confidence: suspect.confidence,
        area: suspect.area,
        triangles: suspect.triangles.len() as u64,
        within: suspect.within,
    };
    let suspects = Some(found.iter().take(MOST_LISTED).map(told).collect());
    Ok(Change::none(Told::Residue(Residue { suspects, ..Residue::default() })))
}

/// Puts residue into a report. Where it was looked for without a path, a person has to look at the result.
pub(super) fn put(told: Residue, report: &mut Report) {
    if let Some(suspects) = told.suspects.as_ref().filter(|_| report.verdict.good) {
        report.outcome = Outcome::NeedsReview;
        report.verdict.reasons.push(match suspects.len() {
            0 => "no waves of a tool were found, which is no proof without its path".into(),
            found => {
                format!("{} may be what a tool left, or be meant", Counted(found as u64, "place with waves", "places with waves"))
            }
        });
    }
    if let Some(axes) = told.path_axes.as_ref().filter(|_| report.verdict.good) {
        report.outcome = Outcome::NeedsReview;
        report
            .verdict
            .reasons
            .push(format!("the tool path fits the mesh only with other axes: its x, y, z are {axes} of the mesh"));
    }
    if let Some(share) = told.path_fit.filter(|share| *share < FIT_GOOD && report.verdict.good) {
        report.outcome = Outcome::NeedsReview;
        let share = format!("{:.0} % of the vertices that the tool reaches lie where it left the material", 100.0 * share);
        report.verdict.reasons.push(format!("the tool path does not fit the mesh: {share}"));
    }
    report.residue = Some(told);
}

/// Why the path is not believed to have cut this mesh.
fn misfit(fit: Fit) -> Option<String> {
    if fit.reached() == 0 {
        return Some("the tool reaches no vertex of the mesh: the path's origin, unit or axes may be others".into());
    }
    (fit.share() < FIT_LEAST).then(|| {
        let reached = Counted(fit.reached() as u64, "vertex", "vertices");
        format!(
            "of {reached} that the tool reaches, {:.0} % lie where it left the material: the path may be another part's, its origin, unit or axes may be others, \
             or the simulation is coarser than the tolerance",
            100.0 * fit.share()
        )
    })
}

/// The mesh without residue, by the path.
fn removed(mesh: &Mesh, options: &residue::Options<'_>, work: Work<'_>) -> Result<Change, String> {
    let settings = &work.profile.residue;
    let named = |error: residue::Error| format!("{}: {error}", settings.toolpath);
    let Program { header, moves } = program(Path::new(&settings.toolpath), &settings.tools, work.limits.memory_bytes)?;
    let cuts = Cuts::new(&moves, &header.tools, options.go_on).map_err(named)?;
    // They may be larger than the mesh.
    drop(moves);
    let needed = cuts.bytes() + mesh.faces().len() as u64 * SEARCH_BYTES_A_TRIANGLE;
    if needed > work.limits.memory_bytes {
        return Err(too_much(Path::new(&settings.toolpath), work.limits.memory_bytes));
    }
    let view = residue::Mesh { points: mesh.vertices(), faces: mesh.faces() };
    let (mut found, frame) = found(view, &cuts, options).map_err(named)?;
    drop(cuts);
    if let Some(why_not) = misfit(found.fit) {
        let told = Residue { why_not: Some(why_not), path_fit: Some(found.fit.share()), ..Residue::default() };
        return Ok(Change::none(Told::Residue(told)));
    }
    let mut repaired = residue::repair(view, &found, options).map_err(named)?;
    found.targets = Vec::new();
    let mut told = told(&found, &header);
    told.path_axes = frame.map(|frame| frame.to_string());
    if told.triangles_before == 0 {
        return Ok(Change::none(Told::Residue(told)));
    }
    let settled = smooth::settle(mesh.vertices(), mesh.faces(), &repaired.points);
    repaired.points = Vec::new();
    let fewer = fewer(mesh, (&found, &repaired), &settled.points, work)?;
    let (gone, added) = replaced(mesh, (&fewer.points, &fewer.faces, &fewer.origins));
    told.moved = vertices_moved(mesh, &settled.points);
    told.displacement = settled.largest;
    told.volume_change = fewer.volume[1] - smooth::volume(mesh.vertices(), mesh.faces());
    let proved = fewer.proved.unwrap_or_default();
    told.deviation = proved.forward.max(proved.backward);
    told.triangles_after = (fewer.faces.len() as u64 + told.triangles_before).saturating_sub(mesh.faces().len() as u64);
    Ok(Change { gone, added: added.into(), told: Told::Residue(told) })
}

/// The path and its tools: tools of the profile count more than those of the path; a project of CAMotics names both. Text and moves may take `most`
/// bytes.
fn program(path: &Path, listed: &[String], most: u64) -> Result<Program, String> {
    let shown = path.display();
    let tools: Result<Vec<Tool>, _> = listed.iter().map(|text| tools::parse(text)).collect();
    let mut options = toolpath::Options { tools: tools.map_err(|error| error.to_string())?, ..Default::default() };
    let text = text(path, most)?;
    match moves(&text, &options, most) {
        Err(ReadError::Project) => {
            let project = project::read(&text).map_err(|error| format!("{shown}: {error}"))?;
            let [file] = project.files.as_slice() else {
                return Err(format!("{shown}: a project of {} tool paths; name one of them", project.files.len()));
            };
            let known: Vec<u32> = options.tools.iter().map(|tool| tool.number).collect();
            options.tools.extend(project.tools.into_iter().filter(|tool| !known.contains(&tool.number)));
            let beside = path.parent().unwrap_or(Path::new("")).join(file);
            let text = self::text(&beside, most)?;
            moves(&text, &options, most).map_err(|error| refused(&beside, &error, most))
        }
        other => other.map_err(|error| refused(path, &error, most)),
    }
}

/// The text of a path, if it leaves half of the memory to the moves.
fn text(path: &Path, most: u64) -> Result<Vec<u8>, String> {
    let shown = path.display();
    let length = std::fs::metadata(path).map_or(0, |about| about.len());
    if length > most / 2 {
        return Err(too_much(path, most));
    }
    std::fs::read(path).map_err(|error| format!("{shown}: cannot be read: {error}"))
}

/// The moves of a text, as long as both take no more than `most` bytes.
fn moves(text: &[u8], options: &toolpath::Options, most: u64) -> Result<Program, ReadError> {
    let most = most.saturating_sub(text.len() as u64);
    let mut moves = Moves::default();
    let header = toolpath::stream(text, options, &mut |one| {
        moves.push(one);
        if moves.bytes() > most { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    })?;
    Ok(Program { header, moves })
}

fn refused(path: &Path, error: &ReadError, most: u64) -> String {
    match error {
        ReadError::Stopped { .. } => too_much(path, most),
        error => format!("{}: {error}", path.display()),
    }
}

fn too_much(path: &Path, most: u64) -> String {
    format!("{}: the tool path takes more memory than the {} MiB that may be used", path.display(), most >> 20)
}

/// Residue in the axes of the mesh, and in which frame the path fits, if not as it is.
fn found(view: residue::Mesh<'_>, cuts: &Cuts, options: &residue::Options<'_>) -> Result<(Found, Option<Frame>), residue::Error> {
    let found = residue::find(view, cuts, options)?;
    if found.fit.share() >= FIT_LEAST {
        return Ok((found, None));
    }
    let Some(frame) = residue::frame(view, cuts, options)? else { return Ok((found, None)) };
    let points: Vec<[f32; 3]> = view.points.iter().map(|point| frame.into_path(*point)).collect();
    let faces: Vec<[u32; 3]> = view.faces.iter().map(|face| frame.face(*face)).collect();
    let boxes = |boxes: &[residue::Region]| boxes.iter().map(|one| frame.of_box(*one)).collect::<Vec<_>>();
    let [include, exclude] = [options.corrections.include, options.corrections.exclude].map(boxes);
    let corrections = Corrections { include: &include, exclude: &exclude, ..options.corrections };
    let options = residue::Options { corrections, ..options.clone() };
    let mut found = residue::find(residue::Mesh { points: &points, faces: &faces }, cuts, &options)?;
    found.targets.iter_mut().for_each(|target| *target = frame.into_mesh(*target));
    Ok((found, Some(frame)))
}

/// The moved mesh with fewer triangles in its regions.
fn fewer(
    mesh: &Mesh,
    (found, repaired): (&Found, &Repaired),
    places: &[[f32; 3]],
    work: Work<'_>,
) -> Result<simplify::Outcome, String> {
    let region: Vec<bool> = found.labels.iter().map(|label| *label != u32::MAX).collect();
    let inside = region.iter().filter(|is_in| **is_in).count();
    let height = found.regions.iter().map(|region| region.height).fold(f64::INFINITY, f64::min);
    let options = Options {
        triangles: Some(mesh.faces().len() - inside + (inside as f64 * SHARE) as usize),
        max_deviation: height.is_finite().then_some(OFF * height),
        feature_angle: Some(work.profile.keep_edges_degrees.to_radians()),
        ..Options::default()
    };
    let input =
        Input { points: places, faces: mesh.faces(), region: Some(&region), fixed: Some(&repaired.is_fixed), within: None };
    let mut outcome = simplify::simplify(&input, &options).map_err(|error| error.to_string())?;
    // A triangle that only moved is a new one, too.
    for origin in &mut outcome.origins {
        if mesh.faces().get(*origin as usize).is_some_and(|face| is_moved(mesh, places, face)) {
            *origin = u32::MAX;
        }
    }
    Ok(outcome)
}

fn told(found: &Found, header: &Header) -> Residue {
    let region = |region: &residue::RegionReport| ResidueRegion {
        kind: match region.kind {
            Kind::Stairs => "stairs".into(),
            Kind::Ripples => "ripples".into(),
        },
        confidence: region.confidence,
        height: region.height,
        pitch: region.pitch,
        area: region.area,
        triangles: region.triangles as u64,
    };
    let findings = header.findings.iter().take(FINDINGS);
    Residue {
        regions: found.regions.iter().take(MOST_LISTED).map(region).collect(),
        triangles_before: found.labels.iter().filter(|label| **label != u32::MAX).count() as u64,
        path_fit: Some(found.fit.share()),
        findings: findings.map(|finding| format!("line {}: {}", finding.line, finding.text)).collect(),
        ..Residue::default()
    }
}
