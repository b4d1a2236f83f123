//! `suture picture`: one mesh, or two side by side, as PNG.

use std::io;
use std::path::Path;

use suture_core::read::MeshFile;
use suture_core::record::Record;
use suture_core::{Access, Limits, Quiet};

use super::{Eye, Options, draw};
use crate::cli::PictureArgs;
use crate::exit::Exit;
use crate::say::complain;
use crate::{create, fsx, naming};

/// Draws what the command line asks for.
pub(crate) fn run(args: &PictureArgs) -> Exit {
    match picture(args) {
        Ok(()) => Exit::Good,
        Err(line) => {
            complain(&line);
            Exit::Refused
        }
    }
}

fn picture(args: &PictureArgs) -> Result<(), String> {
    let out = &args.output;
    let shown = out.display();
    naming::check_one(&args.inputs, out, args.force)?;
    let limits = args.spend.limits(false);
    let meshes = args.inputs.iter().map(|path| open(path, &limits)).collect::<Result<Vec<_>, _>>()?;
    let records: Vec<&[Record]> = meshes.iter().map(MeshFile::records).collect();
    let eye = args.eye.map(|(around, above)| Eye { around, above });
    let options = Options { size: args.size, eye, threads: limits.threads, memory: limits.memory_bytes };
    let picture = draw(&records, &options).ok_or("no triangle has finite coordinates: there is nothing to draw")?;
    // What was drawn was one state of the file.
    meshes.iter().try_for_each(MeshFile::check_unchanged).map_err(|error| error.to_string())?;
    let bytes = picture.png().map_err(|error| format!("{shown}: {error}"))?;
    let written = if args.force { create::replace(out, &bytes) } else { place(out, &bytes) };
    written.map_err(|error| format!("{shown}: cannot be written: {error}"))?;
    if picture.one_in > 1 {
        complain(&format_args!("{shown}: one triangle in {} is drawn; all would take too long", picture.one_in));
    }
    Ok(())
}

/// Writes a new file, whole or not at all; nothing is replaced.
fn place(out: &Path, bytes: &[u8]) -> io::Result<()> {
    let temporary = create::temporary_in(fsx::folder_of(out));
    let placed = create::write_new(&temporary, bytes).and_then(|()| fsx::rename_new(&temporary, out));
    if placed.is_err() {
        let _ = fsx::remove_if_there(&temporary);
    }
    placed
}

fn open(path: &Path, limits: &Limits) -> Result<MeshFile, String> {
    let mut limits = limits.clone();
    // SAFETY: this process does nothing else. If someone truncates the file, SIGBUS ends it; a change is found out below.
    limits.access = unsafe { Access::mapped() };
    MeshFile::open(path, &std::env::temp_dir(), &limits, &Quiet).map_err(|error| error.to_string())
}
