//! How fast triangles are made fewer, and how near what is left is to what was there.
//!
//! **In:** sizes of generated meshes, a share of their triangles. **Out:** a [`Simplified`] for each process, in the raw file before the next process
//! starts. **Promise:** Suture goes first, and its peers are asked for as many triangles as it left; distances are measured here, from
//! samples on both surfaces that are the same in each run.

use std::path::Path;
use std::process::Command;

use suture_bench::generate::{self, Case, Density};
use suture_bench::judge::Near;
use suture_bench::space::{cross, length, minus, plus, times, wide};

use super::child;
use super::closing::{Bench, Options};
use super::error::Error;
use super::record::Line;
use super::sides::Side;
use super::simplified::{Nearness, Simplified, Simplifier};
use super::trial::listen;
use crate::mesh::{self, Triangle};

/// Meshes, programs and runs of a measurement.
pub(crate) struct Asked {
    /// About how many triangles the meshes have.
    pub(crate) sizes: Vec<u64>,
    /// The share of them that is left.
    pub(crate) ratio: f64,
    pub(crate) runs: usize,
    /// The memory that suture is told to use; its peers are left out then.
    pub(crate) memory: Option<String>,
    /// The largest mesh of which nearness is measured.
    pub(crate) judge_up_to: u64,
}

/// Corners of triangles of a surface that are samples, and as many places spread by area: as many as it has triangles, within these bounds. Of ten
/// million triangles, the farthest of a few hundred thousand samples is a matter of luck.
const SAMPLES: [usize; 2] = [100_000, 2_000_000];
/// The generated surface, and the numbers by which it is made.
const CASE: Case = Case::Clean;
const SEED: u64 = 1;

/// Has each program make the triangles of each mesh fewer.
///
/// # Errors
/// When suture cannot be built, or the system fails. A program that fails over a mesh is a result.
pub(crate) fn simplify(options: &Options, asked: &Asked) -> Result<(), Error> {
    let peers: Vec<&'static str> = Simplifier::ALL.iter().filter_map(|tool| tool.peer()).map(|(package, _)| package).collect();
    let mut bench = Bench::open_with(options, &[Side::Suture], &peers)?;
    let lack = |tool: &Simplifier| tool.peer().and_then(|(package, _)| bench.programs.lack_of(package));
    for (tool, reason) in Simplifier::ALL.iter().filter_map(|tool| Some((tool, lack(tool)?))) {
        eprintln!("{} is left out: {reason}", tool.name());
    }
    let is_wanted = |tool: &Simplifier| lack(tool).is_none() && (asked.memory.is_none() || *tool == Simplifier::Suture);
    let tools: Vec<Simplifier> = Simplifier::ALL.into_iter().filter(is_wanted).collect();
    for &size in &asked.sizes {
        let input = bench.folder.path().join("in.stl");
        let written = generate::write_file_at(CASE, Density::Sparse, size, SEED, &input);
        written.map_err(|error| Error::Mesh(error.to_string()))?;
        let before = mesh::read(&input).map_err(Error::Mesh)?;
        let mut left = (before.len() as f64 * asked.ratio) as u64;
        for round in 0..asked.runs {
            for &tool in &tools {
                let simplified = once(&bench, options, asked, (&input, &before), (tool, left), round)?;
                eprintln!(
                    "{:14} {:>9} of {:>9} triangles {:>9.3} s wall {:>9.3} s alone  {}",
                    tool.name(),
                    simplified.after,
                    simplified.before,
                    simplified.cost.wall_seconds,
                    simplified.core_seconds().unwrap_or(f64::NAN),
                    simplified.cost.end
                );
                // The same number for all: what Suture left, where it left anything.
                left = if tool == Simplifier::Suture && simplified.after > 0 { simplified.after } else { left };
                bench.journal.write(Line::Simplified(Box::new(simplified)))?;
            }
        }
    }
    Ok(())
}

/// One process over one mesh.
fn once(
    bench: &Bench,
    options: &Options,
    Asked { memory, judge_up_to, .. }: &Asked,
    (input, before): (&Path, &[Triangle]),
    (tool, asked): (Simplifier, u64),
    round: usize,
) -> Result<Simplified, Error> {
    let output = bench.folder.path().join("out.stl");
    let mut command = command(bench, tool, (input, &output), asked);
    command.args(memory.iter().flat_map(|memory| ["--memory", memory]));
    let child::Ended { mut cost, said } = child::measure(command, Some(&output), true, options.limit)?;
    let said = listen(&said);
    (cost.stages, cost.facts) = (said.stages, said.facts);
    let after = mesh::read(&output).unwrap_or_default();
    let is_judged = round == 0 && !after.is_empty() && before.len() as u64 <= *judge_up_to;
    let nearness = is_judged.then(|| nearness(bench, before, (&output, &after)));
    let failure = if after.is_empty() { cost.complaint.lines().last().unwrap_or(&cost.end).to_owned() } else { String::new() };
    if output.exists() {
        std::fs::remove_file(&output).map_err(Error::io("removing an output"))?;
    }
    let (case, program) = (CASE.to_string(), bench.programs.identity_of(tool.peer())?);
    let (before, after, memory) = (before.len() as u64, after.len() as u64, memory.clone());
    Ok(Simplified { case, before, asked, tool, memory, program, round, cost, after, nearness, failure })
}

fn command(bench: &Bench, tool: Simplifier, (input, output): (&Path, &Path), asked: u64) -> Command {
    let Some((_, script)) = tool.peer() else {
        let mut command = bench.programs.suture();
        command.arg("simplify").arg(input).arg("-o").arg(output).args(["--json", "--triangles"]).arg(asked.to_string());
        return command;
    };
    let mut command = bench.programs.script(script);
    command.args([input, output]).arg("--triangles").arg(asked.to_string());
    command
}

fn nearness(bench: &Bench, before: &[Triangle], (file, after): (&Path, &[Triangle])) -> Nearness {
    let found = bench.look(file);
    let (there, back) = (distances(before, after), distances(after, before));
    let diagonal = diagonal(before);
    let all = there.iter().chain(&back);
    let squares: f64 = all.clone().map(|far| far * far).sum();
    Nearness {
        hausdorff: all.fold(0.0, |most: f64, far| most.max(*far)) / diagonal,
        mean: (squares / (there.len() + back.len()).max(1) as f64).sqrt() / diagonal,
        samples: there.len().min(back.len()) as u64,
        pairs: found.as_ref().and_then(|found| found.pairs),
        boundary_edges: found.map_or(0, |found| found.counts.boundary_edges),
    }
}

fn diagonal(triangles: &[Triangle]) -> f64 {
    let side = |axis: usize| {
        let values = triangles.iter().flatten().map(move |p| f64::from(p[axis]));
        values.clone().fold(f64::NEG_INFINITY, f64::max) - values.fold(f64::INFINITY, f64::min)
    };
    length([side(0), side(1), side(2)])
}

/// How far samples on one surface are from another one: its vertices, evenly taken, and as many places spread by area.
fn distances(from: &[Triangle], to: &[Triangle]) -> Vec<f64> {
    let near = Near::new(to);
    let [least, most] = SAMPLES;
    let samples = from.len().clamp(least, most);
    let stride = (3 * from.len()).div_ceil(samples).max(1);
    let corners = from.as_flattened().iter().step_by(stride).map(|p| wide(*p));
    corners.chain(spread(from, samples)).map(|p| near.distance(p)).collect()
}

/// Places spread over triangles by area: equal steps of area decide the triangle, a sequence of low discrepancy the place in it
/// (Roberts' R₂: multiples of the powers of 1/1.32471795724, the plastic number).
fn spread(triangles: &[Triangle], count: usize) -> Vec<[f64; 3]> {
    const STEPS: [f64; 2] = [0.754_877_666_246_693, 0.569_840_290_998_053];
    let area = |t: &Triangle| {
        let [a, b, c] = t.map(wide);
        0.5 * length(cross(minus(b, a), minus(c, a)))
    };
    let total: f64 = triangles.iter().map(area).sum();
    let step = total / count.max(1) as f64;
    let (mut places, mut passed, mut next) = (Vec::with_capacity(count), 0.0, 0.5 * step);
    for triangle in triangles {
        passed += area(triangle);
        while next < passed && places.len() < count {
            let [mut u, mut v] = STEPS.map(|by| (0.5 + by * places.len() as f64).fract());
            if u + v > 1.0 {
                (u, v) = (1.0 - u, 1.0 - v);
            }
            let [a, b, c] = triangle.map(wide);
            places.push(plus(a, plus(times(minus(b, a), u), times(minus(c, a), v))));
            next += step;
        }
    }
    places
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A square of two triangles at a height.
    fn square(z: f32) -> Vec<Triangle> {
        let [a, b, c, d] = [[0.0, 0.0, z], [4.0, 0.0, z], [4.0, 4.0, z], [0.0, 4.0, z]];
        vec![[a, b, c], [a, c, d]]
    }

    #[test]
    fn samples_are_spread_by_area_and_lie_on_the_triangles() {
        let [a, b, c] = [[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0]];
        let places = spread(&[square(0.0), vec![[a, b, c]]].concat(), 3300);
        // The small triangle has half a square millimetre of 16.5.
        let small = places.iter().filter(|p| p[2] == 1.0).count();
        assert!(places.len() == 3300 && (99..=101).contains(&small), "{small}");
        assert!(places.iter().all(|p| p[2] == 0.0 || p[2] == 1.0 && p[0] + p[1] <= 1.0 + 1e-12));
        let mean = |axis: usize| places.iter().filter(|p| p[2] == 0.0).map(|p| p[axis]).sum::<f64>() / (3300 - small) as f64;
        assert!((mean(0) - 2.0).abs() < 0.01 && (mean(1) - 2.0).abs() < 0.01, "{} {}", mean(0), mean(1));
    }

    /// From a square to one a millimetre above it the distance is 1 all over; a part of it is near, and all of it is far from that part.
    #[test]
    fn distances_are_of_either_surface_from_the_other() {
        assert!(distances(&square(0.0), &square(1.0)).iter().all(|far| (far - 1.0).abs() < 1e-12));
        let half = [square(0.0)[0]];
        assert!(distances(&half, &square(0.0)).iter().all(|far| *far < 1e-12));
        let most = distances(&square(0.0), &half).into_iter().fold(0.0, f64::max);
        assert!((most - 8f64.sqrt()).abs() < 1e-12, "{most}");
        assert!((diagonal(&square(3.0)) - 32f64.sqrt()).abs() < 1e-12);
    }
}
