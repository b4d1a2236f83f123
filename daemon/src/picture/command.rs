//! `suture picture`: one mesh, or two side by side, as PNG.

use suture_core::read::MeshFile;
use suture_core::record::Record;

use super::{Eye, Options, draw, open};
use crate::cli::PictureArgs;
use crate::exit::Exit;
use crate::say::complain;
use crate::{create, naming};

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
    let options = Options { size: args.size, eye, behind: false, threads: limits.threads, memory: limits.memory_bytes };
    let picture = draw(&records, &options).ok_or("no triangle has finite coordinates: there is nothing to draw")?;
    // What was drawn was one state of the file.
    meshes.iter().try_for_each(MeshFile::check_unchanged).map_err(|error| error.to_string())?;
    let bytes = picture.png().map_err(|error| format!("{shown}: {error}"))?;
    create::place(out, &bytes, args.force).map_err(|error| format!("{shown}: cannot be written: {error}"))?;
    if picture.one_in > 1 {
        complain(&format_args!("{shown}: one triangle in {} is drawn; all would take too long", picture.one_in));
    }
    Ok(())
}
