//! Words of the commands that make other meshes of meshes.

use std::path::PathBuf;

use clap::{ArgGroup, Args};

use suture_core::OutputFormat;

use super::spend::{Guarantee, Spend};
use crate::units::{parse_box, parse_format, parse_length, parse_share};

/// The purpose of each profile.
pub(super) const PROFILE_HELP: &str = "\
Profile: a name, or a TOML file of settings [default: default]

default       repairs what can be repaired
fast          leaves out what takes time and no valid surface needs: the search for
              self-intersections (the verdict calls them unchecked), the shaping of patches
strict        small mending only; what changes more, or cannot be proved, is a person's
cautious      welds and drops what is surplus, closes, cuts and wraps nothing
scan          larger holes and wider gaps, for scanned surfaces
inspect-only  repairs nothing: a good file is passed on as it is, of any other nothing
              is written";

#[derive(Args, Debug)]
pub(crate) struct RepairArgs {
    /// Mesh files: STL, 3MF, PLY, OFF, OBJ, AMF
    #[arg(required = true, value_name = "IN")]
    pub inputs: Vec<PathBuf>,
    /// Where to write: a file name, or a folder (needed for several inputs; part.stl, then part~2.stl)
    #[arg(short, long, value_name = "OUT|DIR")]
    pub output: PathBuf,
    /// Format of the result: stl, 3mf, ply, off, obj or amf [default: that of OUT's ending, or else of IN]
    #[arg(long, value_name = "FORMAT", value_parser = parse_format)]
    pub format: Option<OutputFormat>,
    /// Write the full report as JSON to this file (for several inputs: into this folder)
    #[arg(long, value_name = "FILE")]
    pub report: Option<PathBuf>,
    /// Profile: default, fast, strict, cautious, scan, inspect-only, or a TOML file of settings
    #[arg(long, value_name = "NAME|FILE", default_value = "default", long_help = PROFILE_HELP, hide_default_value = true)]
    pub profile: String,
    /// Do not look for self-intersections: faster, but the verdict then calls them unchecked
    #[arg(long)]
    pub no_self_intersections: bool,
    /// What to do with geometry that no repair can turn into a solid [default: the profile's: wrap; strict in strict and cautious]
    #[arg(long, value_enum)]
    pub guarantee: Option<Guarantee>,
    #[command(flatten)]
    pub spend: Spend,
    /// Print reports as JSON, one a line, instead of tables
    #[arg(long)]
    pub json: bool,
    /// List every deleted, flipped, moved and added triangle in the report
    #[arg(long)]
    pub list_edit: bool,
    /// Replace the result and the report if they exist, in a folder too (an input is never replaced)
    #[arg(long)]
    pub force: bool,
}

#[derive(Args, Debug)]
pub(crate) struct InspectArgs {
    /// Mesh files: STL, 3MF, PLY, OFF, OBJ, AMF
    #[arg(required = true, value_name = "IN")]
    pub inputs: Vec<PathBuf>,
    /// Profile: default, fast, strict, cautious, scan, inspect-only, or a TOML file of settings
    #[arg(long, value_name = "NAME|FILE", default_value = "default", long_help = PROFILE_HELP, hide_default_value = true)]
    pub profile: String,
    /// Do not look for self-intersections: faster, but the verdict then calls them unchecked
    #[arg(long)]
    pub no_self_intersections: bool,
    /// Check the certificate in this report, as written by repair or inspect, against the bytes of IN as they are now
    #[arg(long, value_name = "REPORT", conflicts_with_all = ["json", "profile", "no_self_intersections"])]
    pub certificate: Option<PathBuf>,
    /// Check its second half, too: repair the file that IN was made of anew, and compare
    #[arg(long, value_name = "FILE", requires = "certificate")]
    pub original: Option<PathBuf>,
    #[command(flatten)]
    pub spend: Spend,
    /// Print reports as JSON, one a line, instead of tables
    #[arg(long)]
    pub json: bool,
}

#[derive(Args, Debug)]
pub(crate) struct ConvertArgs {
    /// A mesh file: STL, 3MF, PLY, OFF, OBJ, AMF
    #[arg(value_name = "IN")]
    pub input: PathBuf,
    /// The file to write; its ending says the format
    #[arg(value_name = "OUT")]
    pub output: PathBuf,
    /// Replace OUT if it exists
    #[arg(long)]
    pub force: bool,
    #[command(flatten)]
    pub spend: Spend,
}

#[derive(Args, Debug)]
#[command(group = ArgGroup::new("limits").multiple(true))]
pub(crate) struct DefeatureArgs {
    /// Remove holes of a smaller diameter, through or blind; lengths are in the file's units
    #[arg(long, value_name = "D", value_parser = parse_length, allow_negative_numbers = true, group = "limits")]
    pub holes_below: Option<f64>,
    /// Remove fillets of a smaller radius, and narrower chamfers
    #[arg(long, value_name = "R", value_parser = parse_length, allow_negative_numbers = true, group = "limits")]
    pub fillets_below: Option<f64>,
    /// Remove narrower grooves, slots and pockets, engraved letters among them
    #[arg(long, value_name = "W", value_parser = parse_length, allow_negative_numbers = true, group = "limits")]
    pub grooves_below: Option<f64>,
    /// Remove lower bosses, embossed letters among them
    #[arg(long, value_name = "H", value_parser = parse_length, allow_negative_numbers = true, group = "limits")]
    pub bosses_below: Option<f64>,
    #[command(flatten)]
    pub repair: RepairArgs,
}

/// Edges that stay where a surface is smoothed or simplified.
#[derive(Args, Debug)]
pub(crate) struct KeepEdges {
    /// Keep edges where the surface turns by more degrees [default: 40]
    #[arg(long, value_name = "DEGREES", value_parser = parse_length, allow_negative_numbers = true)]
    pub keep_edges: Option<f64>,
}

#[derive(Args, Debug)]
pub(crate) struct SimplifyArgs {
    /// So many triangles at most, as far as the surface stays within --max-deviation [default: 1 % of the diagonal]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..), group = "wanted")]
    pub triangles: Option<u64>,
    /// This share of the triangles at most, as far as the surface stays within --max-deviation [default: 1 % of the diagonal]
    #[arg(long, value_name = "SHARE", value_parser = parse_share, group = "wanted")]
    pub ratio: Option<f64>,
    /// The surface stays within this distance, both ways, proved; alone, triangles are made as few as it allows; lengths are in the file's units
    #[arg(long, value_name = "D", value_parser = parse_length, allow_negative_numbers = true)]
    pub max_deviation: Option<f64>,
    #[command(flatten)]
    pub edges: KeepEdges,
    #[command(flatten)]
    pub repair: RepairArgs,
}

#[derive(Args, Debug)]
pub(crate) struct SmoothArgs {
    /// Smooth waves that are shorter than this; lengths are in the file's units
    #[arg(long, value_name = "L", value_parser = parse_length, allow_negative_numbers = true)]
    pub waves_below: Option<f64>,
    /// Leave at most this share of their height [default: 0.1]
    #[arg(long, value_name = "SHARE", value_parser = parse_share)]
    pub leave: Option<f64>,
    #[command(flatten)]
    pub edges: KeepEdges,
    #[command(flatten)]
    pub repair: RepairArgs,
}

#[derive(Args, Debug)]
pub(crate) struct ResidueArgs {
    /// The tool path that cut the part: G-code, APT or CL data, or a project of CAMotics
    #[arg(long, value_name = "PATH")]
    pub toolpath: Option<PathBuf>,
    /// A tool that the path does not describe, as 3=ball,d=6: its number, flat, ball, bull (r=), taper (a=, tip=) or drill, its diameter; several times
    #[arg(long = "tool", value_name = "TOOL")]
    pub tools: Vec<String>,
    /// How far the mesh may be from what the tool cut, in millimetres: noise of the simulation [default: by the tool's size]
    #[arg(long, value_name = "T", value_parser = parse_length, allow_negative_numbers = true)]
    pub tolerance: Option<f64>,
    /// A box whose triangles are residue's, by two corners; several times
    #[arg(long, value_name = "X,Y,Z:X,Y,Z", value_parser = parse_box, allow_hyphen_values = true)]
    pub include: Vec<[[f64; 3]; 2]>,
    /// A box whose triangles are not; counts more
    #[arg(long, value_name = "X,Y,Z:X,Y,Z", value_parser = parse_box, allow_hyphen_values = true)]
    pub exclude: Vec<[[f64; 3]; 2]>,
    /// A text file with numbers of triangles that are residue's, from 0 in the order of IN, as 12 40-52; counts more than boxes
    #[arg(long, value_name = "FILE")]
    pub brush: Option<PathBuf>,
    /// A mesh: no triangle is residue's whose centre is neither on it nor, if it is closed, within it; counts most
    #[arg(long, value_name = "MESH")]
    pub mask: Option<PathBuf>,
    /// Without a tool path: tell where periodic waves may be what a tool left; nothing is moved, and a person must look
    #[arg(long, conflicts_with_all = ["toolpath", "tools", "tolerance", "include", "brush"])]
    pub without_path: bool,
    #[command(flatten)]
    pub repair: RepairArgs,
}

#[derive(Args, Debug)]
pub(crate) struct FillCurvesArgs {
    /// Files of curves: IGES, STEP, or JSON of knots and control points; several are filled as if they were one, in the unit of the first
    #[arg(required = true, value_name = "CURVES")]
    pub inputs: Vec<PathBuf>,
    /// Where to write: a mesh (stl, 3mf, ply, off, obj, amf; in millimetres), or surfaces (igs, step), by its ending
    #[arg(short, long, value_name = "OUT")]
    pub output: PathBuf,
    /// Fill the loops that the curves form, even if the file says which curves bound its faces
    #[arg(long)]
    pub loops: bool,
    /// Use no surface of the file, as if it had none [default: its planes, cylinders, cones, spheres and tori are used, no others]
    #[arg(long)]
    pub curves_alone: bool,
    /// Close open ends by straight curves, the nearest two first, none longer than this; lengths are in the unit of the file
    #[arg(long, value_name = "LENGTH", value_parser = parse_length, allow_negative_numbers = true)]
    pub close_gaps: Option<f64>,
    /// How far fitted curves may be from their own [default: 5e-7 of the length of each]
    #[arg(long, value_name = "LENGTH", value_parser = parse_length, allow_negative_numbers = true)]
    pub tolerance: Option<f64>,
    /// How far edges of the mesh may be from curves and surfaces [default: 1/500 of each outline]
    #[arg(long, value_name = "LENGTH", value_parser = parse_length, allow_negative_numbers = true)]
    pub chord: Option<f64>,
    /// How much curves may turn along an edge of the mesh, in degrees [default: 20]
    #[arg(long, value_name = "DEGREES", value_parser = parse_length, allow_negative_numbers = true)]
    pub angle: Option<f64>,
    /// Give blended surfaces the tangent planes of the surfaces beside them
    #[arg(long)]
    pub tangent: bool,
    /// The longest edge of the mesh [default: by the curves]
    #[arg(long, value_name = "LENGTH", value_parser = parse_length, allow_negative_numbers = true)]
    pub edge: Option<f64>,
    /// Draw the curves, and beside them the surfaces that fill them: red are curves of no surface, green those that close gaps
    #[arg(long, value_name = "PNG")]
    pub picture: Option<PathBuf>,
    #[command(flatten)]
    pub spend: Spend,
    /// Print JSON instead of a table: each outline, and the report of the mesh
    #[arg(long)]
    pub json: bool,
    /// Replace the result if it exists (the input is never replaced)
    #[arg(long)]
    pub force: bool,
}
