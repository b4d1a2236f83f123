//! How the cost of filling curves grows with their number.
//!
//! **In:** sizes of generated networks, how many rounds. **Out:** a [`Filled`] for each process, in the raw file before the next process
//! starts. **Promise:** triangles are counted and looked at here, not taken from what the program says.

use suture_bench::outlines::{Quality, Shape};

use super::child;
use super::closing::{Bench, Options};
use super::error::Error;
use super::filled::Filled;
use super::record::Line;
use super::sides::Side;
use crate::mesh;

/// Has Suture fill networks of each shape and size.
///
/// # Errors
/// When suture cannot be built, or the system fails. A network that is not filled is a result.
pub(crate) fn outlines(options: &Options, sizes: &[u64], runs: usize) -> Result<(), Error> {
    let mut bench = Bench::open(options, &[Side::Suture])?;
    let program = bench.programs.identity(Side::Suture)?;
    for round in 0..runs {
        for shape in Shape::ALL {
            // The outline of fourteen has one size.
            for &size in sizes.iter().take(if shape == Shape::Fourteen { 1 } else { usize::MAX }) {
                let filled = once(&bench, options, (shape, size), round, &program)?;
                eprintln!(
                    "{:12} {:>7} curves {:>9.3} s wall {:>9.3} s CPU {:>9} triangles, {} below 0.4  {}",
                    filled.shape,
                    filled.curves,
                    filled.cost.wall_seconds,
                    filled.cost.cpu_seconds,
                    filled.triangles,
                    filled.below,
                    filled.cost.end
                );
                bench.journal.write(Line::Filled(Box::new(filled)))?;
            }
        }
    }
    Ok(())
}

/// One process over one network.
fn once(bench: &Bench, options: &Options, (shape, size): (Shape, u64), round: usize, program: &str) -> Result<Filled, Error> {
    let [input, output] = ["in.json", "out.stl"].map(|name| bench.folder.path().join(name));
    let (text, curves) = shape.json(size);
    std::fs::write(&input, text).map_err(Error::io("writing a network of curves"))?;
    let mut command = bench.programs.suture();
    command.arg("fill-curves").arg(&input).arg("-o").arg(&output).arg("--force");
    let cost = child::measure(command, Some(&output), true, options.limit)?.cost;
    let triangles = mesh::read(&output).unwrap_or_default();
    let quality = Quality::of(&triangles);
    for path in [&input, &output] {
        let _ = std::fs::remove_file(path);
    }
    let loops = if shape.is_many() { curves / 4 } else { 1 };
    let (shape, program) = (shape.name().into(), program.into());
    let Quality { mean, below, triangles } = quality;
    Ok(Filled { shape, curves, loops, program, round, cost, triangles, mean, below })
}
