//! How well holes are closed: in surfaces that are known everywhere ([`shapes`]), and in real files ([`files`]).

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, SystemTime};

use suture_bench::judge;

use super::child;
use super::error::Error;
use super::folders::{name_of, read_or_say};
use super::machine::Machine;
use super::made::{Closed, Found, Shaped, Shaper};
use super::programs::Programs;
use super::record::{Journal, Line, Session};
use super::sides::Side;
use super::way::Way;
use crate::holes::{self, Hole, Surface};
use crate::{mesh, picture};

/// One process that closes the holes of all files in a folder.
fn command(shaper: Shaper, programs: &Programs, folder: &Path, from: &Path, to: &Path) -> Result<Command, Error> {
    let meshlib = |flags: &[&str]| {
        let mut command = programs.script("close_meshlib.py");
        command.args([from, to]).args(flags);
        command
    };
    Ok(match shaper {
        Shaper::Suture => programs.command(&Way::plain(Side::Suture), 2, from, to),
        Shaper::SutureImplicit => {
            let profile = folder.join("implicit.toml");
            std::fs::write(&profile, "patch_shape = \"implicit\"\n").map_err(Error::io("writing a profile"))?;
            let mut command = programs.command(&Way::plain(Side::Suture), 2, from, to);
            command.arg("--profile").arg(profile);
            command
        }
        Shaper::Pymeshlab => {
            let mut command = programs.script("close_pymeshlab.py");
            command.args([from, to]);
            command
        }
        Shaper::Meshlib => meshlib(&[]),
        Shaper::MeshlibArea => meshlib(&["--area"]),
        Shaper::MeshlibEqual => meshlib(&["--equal"]),
        Shaper::MeshlibEqualArea => meshlib(&["--equal", "--area"]),
    })
}

/// Where and how, of either comparison.
pub(crate) struct Options {
    /// The raw file.
    pub(crate) raw: PathBuf,
    /// Where pictures go.
    pub(crate) plots: PathBuf,
    /// A binary instead of the one built now.
    pub(crate) suture: Option<PathBuf>,
    /// Go on where the raw file ends.
    pub(crate) resume: bool,
    /// A process that takes longer is killed.
    pub(crate) limit: Duration,
    /// The command line, to be published.
    pub(crate) command: String,
}

/// Who closes holes.
const SIDES: [Side; 3] = [Side::Suture, Side::PymeshlabCompetent, Side::Meshlib];

/// The programs that are there, a folder to work in, and a journal that begins with this session.
pub(super) struct Bench {
    pub(super) programs: Programs,
    pub(super) folder: tempfile::TempDir,
    pub(super) journal: Journal,
}

impl Bench {
    pub(super) fn open(options: &Options, sides: &[Side]) -> Result<Self, Error> {
        Self::open_with(options, sides, &[])
    }

    /// The same with more Python packages than sides need.
    pub(super) fn open_with(options: &Options, sides: &[Side], packages: &[&str]) -> Result<Self, Error> {
        let programs = Programs::prepare_with(sides, packages, options.suture.clone())?;
        let folder = tempfile::tempdir().map_err(Error::io("making a folder"))?;
        let mut journal = Journal::open(&options.raw, options.resume)?;
        let machine = Machine::describe(folder.path(), programs.versions());
        let began = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).map_or(0, |since| since.as_secs());
        journal.write(Line::Session(Session { began, command: options.command.clone(), machine }))?;
        for &side in sides {
            if let Some(reason) = programs.lack(side) {
                eprintln!("{} is left out: {reason}", side.facts().name);
                journal.write(Line::Skipped { side, reason })?;
            }
        }
        Ok(Self { programs, folder, journal })
    }

    pub(super) fn has(&self, side: Side) -> bool {
        self.programs.lack(side).is_none()
    }

    /// The judge's word on a binary STL, and the engine's on what crosses itself, which the judge does not look at.
    pub(super) fn look(&self, file: &Path) -> Option<Found> {
        let counts = judge::judge(file).ok()?.counts;
        let report = said_whatever(&mut self.programs.command(&Way::plain(Side::Inspect), 1, file, Path::new("")));
        let crossing = &report["before"]["self_intersections"];
        let pairs = ["crossing_pairs", "overlapping_pairs"].map(|name| crossing[name].as_u64());
        Some(Found { counts, pairs: pairs.into_iter().sum() })
    }
}

/// The JSON that a command prints, whatever its exit code.
fn said_whatever(command: &mut Command) -> serde_json::Value {
    let printed = command.stderr(std::process::Stdio::null()).output().map(|output| output.stdout).unwrap_or_default();
    serde_json::from_slice(&printed).unwrap_or_default()
}

/// Cuts holes into known surfaces, has every program close them, and keeps how far off each patch is.
///
/// # Errors
/// When suture cannot be built, or the system fails.
pub(crate) fn shapes(options: &Options) -> Result<(), Error> {
    let mut bench = Bench::open(options, &SIDES)?;
    let folder = bench.folder.path().to_owned();
    let inputs = folder.join("in");
    std::fs::create_dir(&inputs).map_err(Error::io("making a folder of inputs"))?;
    let mut cases = Vec::new();
    for surface in Surface::ALL {
        for hole in Hole::all() {
            let (triangles, path) = (holes::with_hole(surface, hole), inputs.join(format!("{:02}.stl", cases.len())));
            mesh::write(&path, &triangles).map_err(Error::Mesh)?;
            cases.push((surface, hole, triangles));
        }
    }
    let bowl = inputs.join(BOWL);
    mesh::write(&bowl, &holes::bowl()).map_err(Error::Mesh)?;
    let mut drawn = Drawn { hole: vec![PathBuf::new()], bowl: vec![bowl], meshlib: f64::INFINITY };
    for tool in Shaper::ALL {
        let side = if tool.is_meshlib() { Side::Meshlib } else { Side::PymeshlabCompetent };
        if !matches!(tool, Shaper::Suture | Shaper::SutureImplicit) && !bench.has(side) {
            continue;
        }
        eprintln!("{tool:?}");
        let outputs = folder.join(format!("{tool:?}"));
        std::fs::create_dir(&outputs).map_err(Error::io("making a folder of outputs"))?;
        let command = command(tool, &bench.programs, &folder, &inputs, &outputs)?;
        let ended = child::measure(command, None, false, options.limit)?;
        if !ended.cost.complaint.is_empty() {
            eprintln!("{}", ended.cost.complaint);
        }
        for (number, (surface, hole, before)) in cases.iter().enumerate() {
            let file = outputs.join(format!("{number:02}.stl"));
            let measured = holes::measure_file(*surface, before, &file);
            if (*surface, *hole) == PICTURED {
                drawn.add(tool, &inputs, &file, measured.and_then(|measured| measured.vertices));
            }
            let (surface, chord_error) = (*surface, hole.chord_error(*surface));
            bench.journal.write(Line::Shaped(Shaped {
                surface: surface.name().into(),
                hole: *hole,
                chord_error,
                tool,
                measured,
            }))?;
        }
    }
    drawn.draw(&options.plots)
}

/// The hole that pictures show.
const PICTURED: (Surface, Hole) = (Surface::Sphere, Hole { share: 0.4, sampling: 1.0 });
const BOWL: &str = "bowl.stl";
/// The pictures, for the page.
pub(super) const PICTURES: [&str; 2] = ["hole.png", "bowl.png"];

/// Files of the two pictures: before, and as pymeshlab, MeshLib at its best and Suture closed it.
struct Drawn {
    hole: Vec<PathBuf>,
    bowl: Vec<PathBuf>,
    /// How far off MeshLib's best patch is.
    meshlib: f64,
}

impl Drawn {
    fn add(&mut self, tool: Shaper, inputs: &Path, file: &Path, far: Option<f64>) {
        let name = file.file_name().unwrap_or_default();
        self.hole[0] = inputs.join(name);
        self.hole.resize(4, PathBuf::new());
        self.bowl.resize(4, PathBuf::new());
        let place = match tool {
            Shaper::Pymeshlab => 1,
            Shaper::Suture => 3,
            Shaper::SutureImplicit => return,
            _ if far.is_some_and(|far| far < self.meshlib) => {
                self.meshlib = far.unwrap_or(self.meshlib);
                2
            }
            _ => return,
        };
        self.hole[place] = file.into();
        self.bowl[place] = file.with_file_name(BOWL);
    }

    fn draw(mut self, plots: &Path) -> Result<(), Error> {
        std::fs::create_dir_all(plots).map_err(Error::io("making the folder of plots"))?;
        let around_hole = Some([0.0, 0.0, 0.85, 0.62]);
        for (files, name, eye, at) in
            [(&mut self.hole, PICTURES[0], [-60.0, 12.0], around_hole), (&mut self.bowl, PICTURES[1], [-60.0, 40.0], None)]
        {
            // A program that is not there, or failed, has no panel.
            files.retain(|file| file.exists());
            files.push(plots.join(name));
            let options = picture::Options::for_page(std::mem::take(files), eye, at);
            picture::draw(&options).map_err(|error| Error::Mesh(error.to_string()))?;
        }
        Ok(())
    }
}

/// Has every program repair those of `files` that have boundary edges, and keeps what came out.
///
/// # Errors
/// When suture cannot be built, or the system fails. A file that is no STL is named and left out.
pub(crate) fn files(options: &Options, files: &[PathBuf]) -> Result<(), Error> {
    let mut bench = Bench::open(options, &SIDES)?;
    let (input, output) = (bench.folder.path().join("in.stl"), bench.folder.path().join("out.stl"));
    for path in files {
        let name = name_of(path);
        let is_done =
            |side: Side| bench.journal.has(|line| matches!(line, Line::Closed(done) if done.file == name && done.side == side));
        let due: Vec<_> = SIDES.into_iter().filter(|&side| bench.has(side) && !is_done(side)).collect();
        if due.is_empty() {
            continue;
        }
        // All are given the same finite triangles in the same binary format.
        let Some(triangles) = read_or_say(path) else { continue };
        mesh::write(&input, &triangles).map_err(Error::Mesh)?;
        let open = judge::judge(&input).is_ok_and(|found| found.counts.boundary_edges > 0);
        let Some(before) = open.then(|| bench.look(&input)).flatten() else { continue };
        eprintln!("{name}, {} triangles", triangles.len());
        for side in due {
            let command = bench.programs.command(&Way::plain(side), 1, &input, &output);
            let ended = child::measure(command, Some(&output), false, options.limit)?;
            let report: serde_json::Value = serde_json::from_str(&ended.said).unwrap_or_default();
            let named_open = report["loops_left"].as_array().map(|loops| loops.len() as u64);
            let made = mesh::read(&output).ok();
            let change = made.map(|made| holes::change(&triangles, &made));
            let after = bench.look(&output);
            let (file, end, seconds) = (name.clone(), ended.cost.end, ended.cost.wall_seconds);
            bench.journal.write(Line::Closed(Closed { file, side, before, after, change, end, seconds, named_open }))?;
            if output.exists() {
                std::fs::remove_file(&output).map_err(Error::io("removing an output"))?;
            }
        }
    }
    Ok(())
}
