//! `suture fill-curves`: surfaces between curves of CAD programs, as a mesh or as surfaces.

mod sketch;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};
use suture_core::curves::fill::{self, Continuity, FilledNetwork, Method, Options};
use suture_core::curves::{self, Network, export, loops};
use suture_core::words::{self, Counted};
use suture_core::{CurveMesh, OutputFormat, Quiet};

use crate::cli::meshes::FillCurvesArgs;
use crate::create;
use crate::draft::Draft;
use crate::exit::Exit;
use crate::fsx;
use crate::naming;
use crate::say::{complain, plain, print};

/// Outlines that are named one by one.
const LISTED: usize = 20;

/// The kind of file that is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Mesh(OutputFormat),
    Iges,
    Step,
}

/// The outcome of one file.
struct Done {
    network: Network,
    filled: FilledNetwork,
    /// Outlines that the written file does not have.
    left: Vec<usize>,
    mesh: Option<CurveMesh>,
}

impl Done {
    /// Whether every face has its surface, and the mesh is none that no network of curves can want: one that crosses itself, has edges of more than two triangles, or
    /// is closed inside out.
    fn is_sound(&self) -> bool {
        let is_mesh = self.mesh.as_ref().is_none_or(|mesh| {
            let verdict = &mesh.report.verdict;
            verdict.manifold && verdict.free_of_self_intersection != Some(false) && (verdict.oriented || !verdict.closed)
        });
        self.left.is_empty() && self.filled.bare.is_empty() && is_mesh
    }
}

/// Fills the curves of a file; with 1 if an outline is left or the mesh is not sound, with 2 if nothing is written.
pub(crate) fn run(args: &FillCurvesArgs) -> Exit {
    match fill(args) {
        Ok(done) => {
            let text = if args.json { format!("{}\n", as_json(args, &done)) } else { as_text(args, &done) };
            print(text.as_bytes(), if done.is_sound() { Exit::Good } else { Exit::NotGood })
        }
        Err(line) => {
            complain(&line);
            Exit::Refused
        }
    }
}

fn fill(args: &FillCurvesArgs) -> Result<Done, String> {
    let kind = kind_of(&args.output)?;
    // No format of results ends so: the picture never goes over the result.
    if let Some(path) = args.picture.as_ref().filter(|path| path.extension().is_none_or(|ending| ending != "png")) {
        return Err(format!("{}: a picture's name ends with .png", path.display()));
    }
    for path in std::iter::once(&args.output).chain(&args.picture) {
        naming::check_one(&args.inputs, path, args.force)?;
    }
    let network = read(&args.inputs)?;
    let shown = shown(args);
    let mut how = loops::Options::default();
    how.closes_gaps = args.close_gaps.is_some();
    how.longest_gap = args.close_gaps.unwrap_or_default();
    let mut options = Options::default();
    (options.tolerance, options.chord, options.size) = (args.tolerance, args.chord, args.edge);
    options.told = !args.curves_alone;
    options.continuity = if args.tangent { Continuity::Tangent } else { Continuity::Position };
    options.fans = !matches!(kind, Kind::Mesh(_));
    options.threads = args.spend.threads.map(usize::from);
    options.angle = args.angle.map_or(options.angle, f64::to_radians);
    let filled = fill::fill_network(&network, (!args.loops, &how), &options).map_err(|error| format!("{shown}: {error}"))?;
    if filled.outlines.is_empty() {
        return Err(format!(
            "{shown}: its curves form no closed loop; `suture curves` says which lead nowhere, and --close-gaps may help"
        ));
    }
    let (left, mesh) = write(args, kind, &network, &filled)?;
    if let Some(path) = &args.picture {
        sketch::write(path, (&network, &filled, &left), args)?;
    }
    Ok(Done { network, filled, left, mesh })
}

/// All files as one network.
fn read(inputs: &[PathBuf]) -> Result<Network, String> {
    let mut whole: Option<Network> = None;
    for path in inputs {
        let shown = path.display();
        let bytes = std::fs::read(path).map_err(|error| format!("{shown}: cannot be read: {error}"))?;
        let network = curves::read(&bytes).map_err(|error| format!("{shown}: cannot be read as curves: {error}"))?;
        match &mut whole {
            Some(whole) => whole.append(network),
            None => whole = Some(network),
        }
    }
    whole.ok_or_else(|| "no file of curves".into())
}

/// The inputs for people.
fn shown(args: &FillCurvesArgs) -> String {
    let [first, others @ ..] = args.inputs.as_slice() else { return String::new() };
    let more = Counted(others.len() as u64, "other file", "other files");
    if others.is_empty() { first.display().to_string() } else { format!("{} and {more}", first.display()) }
}

/// The first input, whose name and rights the result has.
fn first(args: &FillCurvesArgs) -> &Path {
    args.inputs.first().map_or(Path::new(""), PathBuf::as_path)
}

fn kind_of(output: &Path) -> Result<Kind, String> {
    let ending = output.extension().and_then(|ending| ending.to_str()).unwrap_or_default().to_ascii_lowercase();
    match ending.as_str() {
        "igs" | "iges" => Ok(Kind::Iges),
        "stp" | "step" => Ok(Kind::Step),
        other => OutputFormat::of_ending(other).map(Kind::Mesh).ok_or_else(|| {
            format!(
                "{}: its ending says no format; one of stl, 3mf, ply, off, obj, amf for a mesh, igs or step for surfaces",
                output.display()
            )
        }),
    }
}

/// Writes the file; the outlines that it lacks, and what is said of a mesh.
fn write(
    args: &FillCurvesArgs,
    kind: Kind,
    network: &Network,
    filled: &FilledNetwork,
) -> Result<(Vec<usize>, Option<CurveMesh>), String> {
    match kind {
        Kind::Mesh(format) => write_mesh(args, format, network, filled).map(|mesh| (mesh.open.clone(), Some(mesh))),
        Kind::Iges | Kind::Step => write_surfaces(args, kind, network, filled).map(|left| (left, None)),
    }
}

fn write_mesh(
    args: &FillCurvesArgs,
    format: OutputFormat,
    network: &Network,
    filled: &FilledNetwork,
) -> Result<CurveMesh, String> {
    let output = &args.output;
    let failed = |error: std::io::Error| format!("{}: cannot be written: {error}", output.display());
    let draft = Draft::new(fsx::folder_of(output)).map_err(failed)?;
    let mut limits = args.spend.limits(false);
    limits.spool.get_or_insert_with(|| fsx::folder_of(output).to_owned());
    let of = (first(args), &filled.filled, network.unit.millimetres);
    let mut mesh = suture_core::write_curve_mesh(of, (&draft.path(), format), &limits, &Quiet)
        .map_err(|error| draft.told(&error, output))?;
    // The report is of the file by its name, not of the draft.
    output.clone_into(&mut mesh.report.input.path);
    draft.place_like(first(args), output, args.force).map_err(failed)?;
    Ok(mesh)
}

fn write_surfaces(args: &FillCurvesArgs, kind: Kind, network: &Network, filled: &FilledNetwork) -> Result<Vec<usize>, String> {
    let shown = args.output.display();
    let (body, left) = fill::body(&filled.shapes(network), &filled.outlines, &filled.filled, &network.unit);
    let name = first(args).file_stem().unwrap_or_default().to_string_lossy();
    let header = export::Header { name: &name, time: None, system: concat!("Suture ", env!("CARGO_PKG_VERSION")) };
    let mut text = Vec::new();
    let written = if kind == Kind::Iges {
        export::write_iges(&body, &header, &mut text)
    } else {
        export::write_step(&body, &header, &mut text)
    };
    written.map_err(|error| format!("{shown}: {error}"))?;
    create::place(&args.output, &text, args.force).map_err(|error| format!("{shown}: cannot be written: {error}"))?;
    Ok(left)
}

/// The name of a method for people.
fn name(method: Method) -> &'static str {
    match method {
        Method::Plane => "plane",
        Method::Recognised => "cylinder, cone, sphere or torus",
        Method::Coons => "four sides blended",
        Method::Triangle => "three sides blended",
        Method::Ruled => "ruled between two sides",
        Method::Heights => "heights over a plane",
        Method::Centre => "ruled to a centre",
        Method::Fans => "each curve ruled to a centre",
        _ => "no surface",
    }
}

/// A table for people.
fn as_text(args: &FillCurvesArgs, done: &Done) -> String {
    let Done { network, filled, mesh, .. } = done;
    let unit = &network.unit.name;
    let outlines = Counted(filled.outlines.len() as u64, "outline", "outlines");
    let made =
        mesh.as_ref().map_or_else(|| "surfaces".to_owned(), |mesh| words::triangles(mesh.report.input.triangles).to_string());
    let from = if filled.loops.is_none() { "faces of the file" } else { "loops of its curves" };
    let mut lines = vec![format!("{}: {outlines} ({from}) -> {}: {made}", shown(args), args.output.display())];
    if mesh.is_some() && network.unit.millimetres != 1.0 {
        lines.push(format!("  unit    {unit}, {} mm; the mesh is in millimetres", network.unit.millimetres));
    }
    let mut methods: BTreeMap<Method, (u64, f64)> = BTreeMap::new();
    for report in &filled.filled.reports {
        let (count, error) = methods.entry(report.method).or_default();
        (*count, *error) = (*count + 1, error.max(report.error));
    }
    for (method, (count, error)) in methods {
        let of = Counted(count, "outline", "outlines");
        let within = if method == Method::Fallback { String::new() } else { format!(", curves within {error:.1e} {unit} of it") };
        lines.push(format!("  filled  {}: {of}{within}", name(method)));
    }
    let bent: Vec<_> = filled.filled.reports.iter().filter(|report| report.tangent > 0).collect();
    if !bent.is_empty() {
        let curves = Counted(bent.iter().map(|report| report.tangent as u64).sum(), "curve", "curves");
        let kink = bent.iter().fold(0.0_f64, |most, report| most.max(report.kink)).to_degrees();
        let of = Counted(bent.len() as u64, "outline", "outlines");
        lines.push(format!("  tangent along {curves} of {of}, normals within {kink:.1e} degrees of those beside"));
    }
    if let Some(mesh) = mesh {
        if !mesh.closed_as_holes.is_empty() {
            let of = Counted(mesh.closed_as_holes.len() as u64, "outline", "outlines");
            lines.push(format!("  filled  {of} that no surface fits closed as holes of meshes are"));
        }
        if mesh.too_small > 0 {
            lines.push(format!("  lost    {} too small for single precision", words::triangles(mesh.too_small)));
        }
    }
    lines.extend(doubts(network, filled));
    lines.extend(left_over(done));
    if let Some(mesh) = mesh {
        let verdict = &mesh.report.verdict;
        lines.push(format!("  verdict {}: {}", if verdict.good { "good" } else { "not good" }, verdict.statement));
        lines.extend(verdict.reasons.iter().take(LISTED).map(|reason| format!("          {reason}")));
    }
    lines.iter().map(|line| plain(line) + "\n").collect()
}

/// Surfaces of the file that are not used, and outlines that another surface may have.
fn doubts(network: &Network, filled: &FilledNetwork) -> Vec<String> {
    let mut lines = Vec::new();
    let mut unused: BTreeMap<&str, u64> = BTreeMap::new();
    for (number, report) in filled.faces.iter().zip(&filled.filled.reports).filter(|(_, report)| !report.is_told) {
        let surface = network.faces.get(*number).map_or("", |face| face.surface.as_str());
        // The plane of its curves is the plane that a file says.
        if !surface.is_empty() && report.method != Method::Plane {
            *unused.entry(surface).or_default() += 1;
        }
    }
    if !unused.is_empty() {
        let all = unused.iter().map(|(surface, count)| format!("{count} × {surface}")).collect::<Vec<_>>().join(", ");
        lines.push(format!("  unused  surfaces of the file: {all}; their outlines are filled by their curves alone"));
    }
    let unsure = filled.filled.reports.iter().filter(|report| report.is_ambiguous).count() as u64;
    if unsure > 0 {
        let of = Counted(unsure, "outline", "outlines");
        lines.push(format!(
            "  unsure  {of}: another simple surface has the same curves, as a disc and half of a sphere have one circle"
        ));
    }
    lines
}

/// Outlines and faces that are left.
fn left_over(done: &Done) -> Vec<String> {
    let Done { network, filled, left, .. } = done;
    let mut lines = Vec::new();
    for number in left.iter().take(LISTED) {
        lines.push(format!("  left    outline {number}: {}", problem(filled, *number)));
    }
    for number in filled.bare.iter().take(LISTED) {
        lines.push(format!("  left    {}", bare(network, *number)));
    }
    if left.len().max(filled.bare.len()) > LISTED {
        let more = left.len().saturating_sub(LISTED) + filled.bare.len().saturating_sub(LISTED);
        lines.push(format!("  left    {more} more; --json has all of them"));
    }
    lines
}

/// A face that no curve bounds, for people.
fn bare(network: &Network, number: usize) -> String {
    let Some(face) = network.faces.get(number) else { return String::new() };
    let surface = if face.surface.is_empty() { "surface" } else { &face.surface };
    format!("{} {} in line {}: no curve bounds its {surface}", face.entity, face.source.id, face.source.line)
}

fn problem(filled: &FilledNetwork, number: usize) -> String {
    let problem = filled.filled.reports.get(number).and_then(|report| report.problem.as_ref());
    problem.map_or_else(|| "it has no surface that such a file can hold".into(), ToString::to_string)
}

/// All of it as one line of JSON.
fn as_json(args: &FillCurvesArgs, done: &Done) -> Value {
    let Done { network, filled, left, mesh } = done;
    let outline = |(number, (outline, report)): (usize, (&fill::Outline, &fill::Report))| {
        let uses = |uses: &[curves::Use]| -> Vec<Value> {
            uses.iter().map(|own| json!({ "curve": own.curve, "reversed": own.is_reversed })).collect()
        };
        json!({
            "outer": uses(&outline.outer),
            "inner": outline.inner.iter().map(|ring| uses(ring)).collect::<Vec<_>>(),
            "method": name(report.method),
            "sides": report.sides,
            "error": report.error,
            "chord": report.chord,
            "gap": report.gap,
            "tangent": report.tangent,
            "kink": report.kink,
            "triangles_below_0_4": json!({ "at_corners_below_15_degrees": report.sharp, "elsewhere": report.poor }),
            "folded": report.is_folded,
            "ambiguous": report.is_ambiguous,
            "surface_of_the_file": report.is_told,
            "problem": report.problem.as_ref().map(ToString::to_string),
            "left": left.contains(&number),
        })
    };
    let outlines = filled.outlines.iter().zip(&filled.filled.reports).enumerate().map(outline);
    json!({
        "inputs": args.inputs.iter().map(|path| path.to_string_lossy()).collect::<Vec<_>>(),
        "output": args.output.to_string_lossy(),
        "picture": args.picture.as_ref().map(|path| path.to_string_lossy()),
        "unit": network.unit.name,
        "millimetres": network.unit.millimetres,
        "outlines": outlines.collect::<Vec<_>>(),
        "faces_without_curves": filled.bare.iter().map(|number| bare(network, *number)).collect::<Vec<_>>(),
        "closed_as_holes": mesh.as_ref().map(|mesh| mesh.closed_as_holes.clone()),
        "mesh": mesh.as_ref().map(|mesh| &mesh.report),
    })
}
