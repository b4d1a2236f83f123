//! `suture draw`: what the daemon's pages show, made in a process of its own, which is started by the daemon, never by hand. A mesh that is cut short while it is
//! mapped, needs too much memory or takes too long costs a picture, never the daemon.

use std::io;

use suture_core::read::MeshFile;

use super::coarse::Coarse;
use super::{Eye, Options, draw, open};
use crate::cli::DrawArgs;
use crate::exit::Exit;
use crate::say::complain;
use crate::{confine, create};

/// Files come first: whoever draws steps back.
const NICE: i32 = 10;
/// Pixels of each mesh.
const SIZE: (usize, usize) = (640, 480);
/// Beyond so many triangles, whoever waits is shown the usual side: looking for the best one takes as long as sixteen pictures.
const MOST_TO_CHOOSE: usize = 3_000_000;

/// Draws what the daemon asks for.
pub(crate) fn run(args: &DrawArgs) -> Exit {
    let bound = confine::bind(&args.worker).and_then(|()| rustix::process::nice(NICE).map_err(io::Error::from));
    if let Err(error) = bound {
        complain(&error);
        return Exit::Cut;
    }
    confine::confine(&args.worker, &args.inputs);
    match made(args) {
        Ok(()) => Exit::Good,
        Err((exit, line)) => {
            complain(&line);
            exit
        }
    }
}

/// What went wrong is the mesh's fault, or trying again may help.
fn made(args: &DrawArgs) -> Result<(), (Exit, String)> {
    let fault = |line: String| (Exit::Refused, line);
    let limits = args.spend.limits(false);
    let length = args.inputs.iter().map(|path| std::fs::metadata(path).map_or(0, |meta| meta.len())).sum();
    confine::Files::inherited().bound(confine::file_bound(length, limits.memory_bytes));
    let meshes = args.inputs.iter().map(|path| open(path, &limits)).collect::<Result<Vec<MeshFile>, _>>().map_err(fault)?;
    let records: Vec<_> = meshes.iter().map(MeshFile::records).collect();
    let nothing = || "no triangle has finite coordinates".to_owned();
    let bytes = match (args.coarse, records.as_slice()) {
        (true, [mesh]) => Coarse::of(mesh, limits.threads).ok_or_else(nothing).map_err(fault)?.bytes(),
        (true, _) => return Err(fault("only one mesh at a time is made coarse".into())),
        (false, meshes) => {
            let is_large = meshes.iter().map(|mesh| mesh.len()).sum::<usize>() > MOST_TO_CHOOSE;
            let eye = is_large.then_some(Eye::USUAL);
            let (threads, memory, behind) = (limits.threads, limits.memory_bytes, args.behind);
            let options = Options { size: SIZE, eye, behind, threads, memory };
            draw(meshes, &options).ok_or_else(nothing).map_err(fault)?.png().map_err(|error| fault(error.to_string()))?
        }
    };
    let later = |line: String| (Exit::TryAgain, line);
    meshes.iter().try_for_each(MeshFile::check_unchanged).map_err(|error| later(error.to_string()))?;
    create::place(&args.output, &bytes, false).map_err(|error| later(format!("the picture cannot be written: {error}")))
}
