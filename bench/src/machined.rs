//! A workpiece simulated from a path that is not ours, as a height field; repaired by the built binary, measured before and after, drawn.

use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::str::FromStr;

use clap::Args;
use suture_bench::field::{Crests, Field, Move, Stock, moves};

use crate::{mesh, picture};

/// A path to simulate, its workpiece, and where to put the result.
#[derive(Args)]
pub(crate) struct Options {
    /// G-code of straight moves in absolute millimetres.
    path: PathBuf,
    /// The folder for before.stl, after.stl, report.json and machined.png, which must exist.
    #[arg(long, value_name = "DIR")]
    into: PathBuf,
    /// Diameter of the ball-nosed tool, number 1 of the program.
    #[arg(long, value_name = "D")]
    ball: f64,
    /// The stock, by two corners; a smaller box simulates a part of the workpiece.
    #[arg(long, value_name = "X,Y,Z:X,Y,Z", allow_hyphen_values = true)]
    stock: Block,
    /// Distance of neighbouring vertices: best a part of the passes' distance, and the stock's corner on a pass.
    #[arg(long, value_name = "C", default_value_t = 0.125)]
    cell: f64,
    /// The binary to repair with.
    #[arg(long)]
    suture: PathBuf,
    /// The ball that the picture shows; all of the workpiece otherwise.
    #[arg(long, value_name = "X,Y,Z,R", allow_hyphen_values = true)]
    at: Option<picture::Numbers<4>>,
}

/// Two corners.
#[derive(Clone, Copy)]
struct Block([[f64; 3]; 2]);

impl FromStr for Block {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (low, high) = text.split_once(':').ok_or("two corners, like 0,0,-7:10,10,0")?;
        let [low, high] = [low, high].map(str::parse::<picture::Numbers<3>>);
        let (low, high) = (low?.0, high?.0);
        let is_block = (0..3).all(|axis| low[axis] < high[axis]);
        if is_block { Ok(Self([low, high])) } else { Err("the second corner is to be the greater one".into()) }
    }
}

/// Parts of crests that lie below the told heights.
const PARTS: [f64; 3] = [0.1, 0.5, 0.9];
/// Crests are looked at so far apart along passes, in millimetres.
const EVERY: f64 = 0.8;
/// Where the eye of the picture is: light from there lies across the passes.
const EYE: [f64; 2] = [-80.0, 35.0];

/// Simulates, repairs, measures, draws and tells.
///
/// # Errors
/// When the path asks for more than straight moves, the binary fails, or a file cannot be read or written.
pub(crate) fn machined(options: &Options) -> Result<(), Box<dyn Error>> {
    if !(options.cell > 0.0 && options.ball > 0.0) {
        return Err("a cell and a tool of no size make no workpiece".into());
    }
    let code = std::fs::read_to_string(&options.path).map_err(|error| format!("{}: {error}", options.path.display()))?;
    let moves = moves(&code).map_err(|error| format!("{}: {error}", options.path.display()))?;
    let Block([low, high]) = options.stock;
    let [before, after, report] = ["before.stl", "after.stl", "report.json"].map(|name| options.into.join(name));
    let part = Field::cut(Stock { low, high }, options.cell, 0.5 * options.ball, &moves).triangles();
    mesh::write(&before, &part)?;
    let told = repair(options, [&before, &after, &report])?;
    let made = mesh::read(&after)?;
    println!("{}", serde_json::to_string_pretty(&figures(&moves, options.stock, [&part, &made], &told))?);
    picture::draw(&picture::Options::large(vec![before, after, options.into.join("machined.png")], EYE, options.at))
}

/// The report of the repair.
fn repair(options: &Options, [before, after, report]: [&Path; 3]) -> Result<serde_json::Value, Box<dyn Error>> {
    let mut command = Command::new(&options.suture);
    command.arg("residue").arg(before).arg("-o").arg(after).arg("--report").arg(report).arg("--force");
    command.arg("--toolpath").arg(&options.path).arg("--tool").arg(format!("1=ball,d={}", options.ball));
    let output = command.output().map_err(|error| format!("{}: {error}", options.suture.display()))?;
    if !matches!(output.status.code(), Some(0 | 1)) {
        return Err(String::from_utf8_lossy(&output.stderr).into_owned().into());
    }
    Ok(serde_json::from_slice(&std::fs::read(report)?)?)
}

/// Crests before and after, at the same places, and what the report says.
fn figures(
    moves: &[Move],
    Block([low, high]): Block,
    [before, after]: [&[mesh::Triangle]; 2],
    told: &serde_json::Value,
) -> serde_json::Value {
    let crests = Crests::of(moves, [[low[0], low[1]], [high[0], high[1]]], EVERY);
    let [was, is] = [crests.on(before), crests.on(after)];
    let ([low_before, middle_before, high_before], count) = was.shares(&was, PARTS);
    let ([low_after, middle_after, high_after], count_after) = is.shares(&was, PARTS);
    let residue = &told["residue"];
    serde_json::json!({
        "moves": moves.len(),
        "places_even": [count, count_after],
        "crest_parts": PARTS,
        "crest_before": [low_before, middle_before, high_before],
        "crest_after": [low_after, middle_after, high_after],
        "triangles": [before.len(), after.len()],
        "triangles_of_regions": [residue["triangles_before"], residue["triangles_after"]],
        "regions": residue["regions"].as_array().map_or(0, Vec::len),
        "displacement": residue["displacement"],
        "deviation": residue["deviation"],
        "why_not": residue["why_not"],
        "outcome": told["outcome"],
        "seconds": told["cost"]["wall_seconds"],
    })
}
