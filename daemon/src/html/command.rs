//! `suture report`: a report as a page for a browser.

use std::path::PathBuf;

use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
use suture_core::Report;
use suture_core::read::MeshFile;
use suture_core::report::FileFacts;

use super::report;
use crate::cli::ReportArgs;
use crate::exit::Exit;
use crate::picture::{self, Options};
use crate::say::complain;
use crate::{create, fsx, naming};

/// Pixels of each mesh.
const SIZE: (usize, usize) = (640, 480);

/// Writes the page.
pub(crate) fn run(args: &ReportArgs) -> Exit {
    match write(args) {
        Ok(()) => Exit::Good,
        Err(line) => {
            complain(&line);
            Exit::Refused
        }
    }
}

fn write(args: &ReportArgs) -> Result<(), String> {
    let shown = args.report.display();
    let file = create::open_to_read(&args.report).map_err(|error| format!("{shown}: cannot be read: {error}"))?;
    let report: Report =
        serde_json::from_reader(std::io::BufReader::new(file)).map_err(|error| format!("{shown}: is no report: {error}"))?;
    let files = files_of(args, &report);
    naming::check_one(&[&[args.report.clone()][..], &files].concat(), &args.output, args.force)?;
    let picture = pictured(args, &files)?;
    let page = report::whole(&report, picture.as_deref()).into_string();
    create::place(&args.output, page.as_bytes(), args.force)
        .map_err(|error| format!("{}: cannot be written: {error}", args.output.display()))
}

/// The files to draw: those that are named, else those of the report, where they are still what it speaks of.
fn files_of(args: &ReportArgs, report: &Report) -> Vec<PathBuf> {
    if !args.files.is_empty() {
        return args.files.clone();
    }
    let is_it = |facts: &&FileFacts| fsx::hash(&facts.path).is_ok_and(|hash| hash.to_string() == facts.blake3);
    let input = Some(&report.input).filter(is_it).map(|facts| facts.path.clone());
    let output = report.output.as_ref().filter(is_it).map(|facts| facts.path.clone());
    // The result alone would stand where the file as it came belongs.
    input.into_iter().flat_map(|input| [Some(input), output.clone()]).flatten().collect()
}

fn pictured(args: &ReportArgs, files: &[PathBuf]) -> Result<Option<String>, String> {
    if files.is_empty() {
        return Ok(None);
    }
    let limits = args.spend.limits(false);
    let meshes = files.iter().map(|path: &PathBuf| picture::open(path, &limits)).collect::<Result<Vec<MeshFile>, _>>()?;
    let records: Vec<_> = meshes.iter().map(MeshFile::records).collect();
    let options = Options { size: SIZE, eye: None, behind: false, threads: limits.threads, memory: limits.memory_bytes };
    let Some(drawn) = picture::draw(&records, &options) else { return Ok(None) };
    let png = drawn.png().map_err(|error| format!("the picture cannot be made: {error}"))?;
    // The bytes that were drawn were those of one state of the files.
    meshes.iter().try_for_each(MeshFile::check_unchanged).map_err(|error| error.to_string())?;
    Ok(Some(BASE64_STANDARD.encode(&png)))
}
