//! `suture curves`: which curves are in files of CAD programs, and which closed loops they form.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::Path;

use serde_json::{Value, json};
use suture_core::curves::loops::{self, Loops, Options};
use suture_core::curves::{self, Network, Use};
use suture_core::words::Counted;

use crate::cli::service::CurvesArgs;
use crate::exit::Exit;
use crate::say::{complain, plain, print};

/// Findings, loops and loose curves that are listed one by one.
const LISTED: usize = 20;
/// Lengths are right to this part of them.
const PART: f64 = 1e-9;

/// Says what is in each file; with 2 if one cannot be read.
pub(crate) fn run(args: &CurvesArgs) -> Exit {
    let mut options = Options::default();
    options.tolerance = args.tolerance;
    options.closes_gaps = args.close_gaps.is_some();
    options.longest_gap = args.close_gaps.unwrap_or_default();
    let (mut text, mut exit) = (String::new(), Exit::Good);
    for path in &args.files {
        match read(path) {
            Ok(network) => {
                let loops = loops::find(&network, &options);
                text += &if args.json { as_json(path, &network, &loops) } else { as_text(path, &network, &loops) };
            }
            Err(reason) => {
                complain(&format_args!("{}: {reason}", path.display()));
                exit = Exit::Refused;
            }
        }
    }
    print(text.as_bytes(), exit)
}

fn read(path: &Path) -> Result<Network, String> {
    let bytes = std::fs::read(path).map_err(|error| format!("cannot be read: {error}"))?;
    curves::read(&bytes).map_err(|error| format!("cannot be read as curves: {error}"))
}

/// The curves by what they are: how many, and how long together.
fn kinds(network: &Network) -> BTreeMap<&'static str, (u64, f64)> {
    let size = network.bounds().map_or(0.0, |[low, high]| (0..3).map(|axis| high[axis] - low[axis]).fold(0.0, f64::max));
    let mut kinds = BTreeMap::new();
    for curve in &network.curves {
        let (count, length) = kinds.entry(curve.shape.kind()).or_insert((0, 0.0));
        *count += 1;
        *length += curve.shape.length(size * PART);
    }
    kinds
}

/// A table for people.
fn as_text(path: &Path, network: &Network, loops: &Loops) -> String {
    let unit = &network.unit.name;
    let mut lines = vec![format!(
        "{}: {}, {}, {}",
        path.display(),
        Counted(network.curves.len() as u64, "curve", "curves"),
        Counted(loops.loops.len() as u64, "closed loop", "closed loops"),
        Counted(network.faces.len() as u64, "face", "faces"),
    )];
    lines.push(format!("  unit    {unit}, {} mm; ends within {:.3e} {unit} meet", network.unit.millimetres, loops.tolerance));
    for (kind, (count, length)) in kinds(network) {
        lines.push(format!("  curves  {kind} × {count}, {length:.6} {unit}"));
    }
    let mut sizes: BTreeMap<usize, u64> = BTreeMap::new();
    loops.loops.iter().for_each(|own| *sizes.entry(own.uses.len()).or_default() += 1);
    for (size, count) in sizes {
        let curves = Counted(size as u64, "curve", "curves");
        lines.push(format!("  loops   {} of {curves}", Counted(count, "loop", "loops")));
    }
    let named = |numbers: &[usize]| {
        let names: Vec<_> = numbers.iter().take(LISTED).filter_map(|number| network.curves.get(*number)).map(named).collect();
        let more = if numbers.len() > LISTED { ", …" } else { "" };
        format!("{}{more}", names.join(", "))
    };
    for (numbers, words) in [(&loops.loose, "in no loop"), (&loops.unresolved, "of a network whose faces were not found")] {
        if !numbers.is_empty() {
            let curves = Counted(numbers.len() as u64, "curve", "curves");
            lines.push(format!("  loose   {curves} {words}: {}", named(numbers)));
        }
    }
    for gap in &loops.added {
        lines.push(format!("  closed  a gap of {:.6} {unit} by a straight curve", gap.shape.length(0.0)));
    }
    for finding in network.findings.iter().take(LISTED) {
        let place = if finding.line == 0 { String::new() } else { format!("line {}: ", finding.line) };
        lines.push(format!("  file    {place}{}", finding.text));
    }
    if let Some(more) = network.findings.len().checked_sub(LISTED).filter(|more| *more > 0) {
        lines.push(format!("  file    {more} more; --json has all of them"));
    }
    lines.into_iter().fold(String::new(), |mut text, line| {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{}", plain(&line));
        text
    })
}

fn named(curve: &curves::curve::Curve) -> String {
    match curve.source.line {
        0 => curve.source.id.to_string(),
        line => format!("{} (line {line})", curve.source.id),
    }
}

/// All of it as one line of JSON. Curves are named by their numbers in `curves`; those that close gaps go on behind the last one.
fn as_json(path: &Path, network: &Network, loops: &Loops) -> String {
    let uses = |uses: &[Use]| -> Vec<Value> {
        uses.iter().map(|own| json!({ "curve": own.curve, "reversed": own.is_reversed })).collect()
    };
    let curve = |curve: &curves::curve::Curve| {
        let [start, end] = curve.shape.ends();
        json!({
            "id": curve.source.id.to_string(),
            "line": curve.source.line,
            "name": curve.name,
            "kind": curve.shape.kind(),
            "length": curve.shape.length(0.0),
            "start": start,
            "end": end,
        })
    };
    let face = |face: &curves::Face| {
        let inner: Vec<_> = face.inner.iter().map(|own| uses(own)).collect();
        json!({ "id": face.source.id.to_string(), "line": face.source.line, "entity": face.entity, "surface": face.surface, "outer": uses(&face.outer), "inner": inner })
    };
    let all = json!({
        "path": path.to_string_lossy(),
        "unit": network.unit.name,
        "millimetres": network.unit.millimetres,
        "tolerance": loops.tolerance,
        "curves": network.curves.iter().chain(&loops.added).map(curve).collect::<Vec<_>>(),
        "faces": network.faces.iter().map(face).collect::<Vec<_>>(),
        "loops": loops.loops.iter().map(|own| uses(&own.uses)).collect::<Vec<_>>(),
        "loose": loops.loose,
        "unresolved": loops.unresolved,
        "doubles": loops.doubles,
        "left_out": loops.left_out,
        "findings": network.findings.iter().map(|finding| json!({ "line": finding.line, "text": finding.text })).collect::<Vec<_>>(),
    });
    format!("{all}\n")
}
