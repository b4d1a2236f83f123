//! How fast a folder of files goes through the daemon with its jobs in a store of its own, and in a shared one on the same machine.
//!
//! **In:** sizes and numbers of generated files. **Out:** a [`Stored`] for each process, in the raw file before the next process starts. **Promise:**
//! both stores have the same files, in alternation; no run has results of an earlier one.

use std::path::{Path, PathBuf};

use suture_bench::generate::{self, Case, Density};
use suture_store::testkit::server::Server;

use super::child;
use super::closing::{Bench, Options};
use super::error::Error;
use super::record::Line;
use super::sides::Side;
use super::stored::{Keeper, Stored};

const CASE: Case = Case::Holes;

/// Has the daemon work through each folder with each store.
///
/// # Errors
/// When suture cannot be built, there is no PostgreSQL, or the system fails.
pub(crate) fn stores(options: &Options, sizes: &[(u64, u64)], runs: usize) -> Result<(), Error> {
    let mut bench = Bench::open(options, &[Side::Suture])?;
    let server = Server::start().ok_or_else(|| Error::Mesh("there is no PostgreSQL on this machine".into()))?;
    for &(triangles, files) in sizes {
        let made = bench.folder.path().join(format!("files-{triangles}"));
        std::fs::create_dir(&made).map_err(Error::io("making a folder of inputs"))?;
        for n in 1..=files {
            let written = generate::write_file_at(CASE, Density::Sparse, triangles, n, &made.join(format!("{n}.stl")));
            written.map_err(|error| Error::Mesh(error.to_string()))?;
        }
        for round in 0..runs {
            for keeper in Keeper::ALL {
                let stored = once(&bench, options, (&server, keeper), (&made, triangles, files), round)?;
                eprintln!(
                    "{:26} {:>5} files of {:>7} triangles {:>8.2} files/s {:>8.3} s CPU  {}",
                    keeper.name(),
                    stored.done,
                    triangles,
                    stored.files_a_second(),
                    stored.cost.cpu_seconds,
                    stored.cost.end
                );
                bench.journal.write(Line::Stored(Box::new(stored)))?;
            }
        }
    }
    Ok(())
}

/// One process over one folder.
fn once(
    bench: &Bench,
    options: &Options,
    (server, keeper): (&Server, Keeper),
    (made, triangles, files): (&Path, u64, u64),
    round: usize,
) -> Result<Stored, Error> {
    let folder = tempfile::tempdir_in(bench.folder.path()).map_err(Error::io("making a folder"))?;
    let hot = folder.path().join("hot");
    let drops = hot.join("in");
    std::fs::create_dir_all(&drops).map_err(Error::io("making a hot folder"))?;
    for n in 1..=files {
        let name = format!("{n}.stl");
        std::fs::copy(made.join(&name), drops.join(&name)).map_err(Error::io("dropping a file"))?;
    }
    let mut command = bench.programs.suture();
    command.args(["watch", "--once", "--config"]).arg(configured(folder.path(), &hot)?);
    if keeper == Keeper::Postgres {
        command.args(["--store", &server.url()]);
    }
    let cost = child::measure(command, Some(&hot), true, options.limit)?.cost;
    let is_result = |entry: &std::fs::DirEntry| entry.path().extension().is_some_and(|extension| extension == "stl");
    let out = std::fs::read_dir(hot.join("out")).into_iter().flatten().flatten();
    let (done, program) = (out.filter(is_result).count() as u64, bench.programs.identity(Side::Suture)?);
    Ok(Stored { keeper, triangles, files, done, program, round, cost })
}

/// The configuration of a run: the name of its folder is its own, and nothing is taken from earlier results.
fn configured(folder: &Path, hot: &Path) -> Result<PathBuf, Error> {
    let at = folder.join("suture.toml");
    let name = folder.file_name().unwrap_or_default().to_string_lossy();
    let text = format!(
        "state = {:?}\nsettle = \"0s\"\nreuse = false\n[[folders]]\npath = {hot:?}\nname = {name:?}\n",
        folder.join("state")
    );
    std::fs::write(&at, text).map_err(Error::io("writing a configuration"))?;
    Ok(at)
}
