//! The engine as the extension module `suture._suture`: arrays and JSON in, arrays and JSON out.
//!
//! What a caller sees is in `suture/`, in Python, which gives this module arrays that fit. Every function releases the interpreter while it
//! works, and ends early when Python has a signal to handle.

mod arrays;
mod errors;
mod watched;

use std::path::PathBuf;

use pyo3::prelude::*;
use suture_core::operations::{self, Fill, Orient, Union, Wrap};
use suture_core::{Limits, OutputFormat, PatchShape, Profile, RepairName};

use arrays::{Faces, Loops, Pairs, Repaired, Vertices, repaired_arrays, view};
use errors::{invalid, to_json};
use watched::watched;

/// What the caller may spend.
fn limits(memory: Option<u64>, threads: Option<usize>) -> Limits {
    let mut limits = Limits::default();
    if let Some(bytes) = memory {
        limits = limits.with_memory(bytes);
    }
    if let Some(count) = threads {
        limits = limits.with_threads(count);
    }
    limits
}

/// A profile by its name, or by its settings in JSON.
fn profile(text: &str) -> PyResult<Profile> {
    if let Some(profile) = Profile::built_in(text) {
        return Ok(profile);
    }
    if !text.starts_with('{') {
        return Err(invalid(format!("no profile is called {text:?}; there are {}", Profile::BUILT_IN.join(", "))));
    }
    let profile: Profile = serde_json::from_str(text).map_err(|error| invalid(format!("profile: {error}")))?;
    profile.validate().map_err(|error| invalid(format!("profile: {error}")))?;
    Ok(profile)
}

/// The settings of a profile that comes with the engine, in JSON.
#[pyfunction]
fn built_in_profile(name: &str) -> PyResult<String> {
    to_json(&profile(name)?)
}

#[pyfunction]
#[pyo3(signature = (vertices, faces, profile, memory, threads, progress))]
fn inspect(
    py: Python<'_>,
    vertices: Vertices<'_>,
    faces: Faces<'_>,
    profile: &str,
    memory: Option<u64>,
    threads: Option<usize>,
    progress: Option<Bound<'_, PyAny>>,
) -> PyResult<String> {
    let (mesh, profile, limits) = (view(&vertices, &faces)?, self::profile(profile)?, limits(memory, threads));
    to_json(&watched(py, progress.as_ref(), |watch| suture_core::inspect_mesh(mesh, &profile, &limits, watch))?)
}

#[pyfunction]
#[pyo3(signature = (vertices, faces, profile, memory, threads, progress))]
fn repair<'py>(
    py: Python<'py>,
    vertices: Vertices<'_>,
    faces: Faces<'_>,
    profile: &str,
    memory: Option<u64>,
    threads: Option<usize>,
    progress: Option<Bound<'_, PyAny>>,
) -> PyResult<Repaired<'py>> {
    let (mesh, profile, limits) = (view(&vertices, &faces)?, self::profile(profile)?, limits(memory, threads));
    let repaired = watched(py, progress.as_ref(), |watch| suture_core::repair_mesh(mesh, &profile, &limits, watch))?;
    repaired_arrays(py, repaired)
}

#[pyfunction]
#[pyo3(signature = (input, profile, memory, threads, spool, progress))]
fn inspect_file(
    py: Python<'_>,
    input: PathBuf,
    profile: &str,
    memory: Option<u64>,
    threads: Option<usize>,
    spool: Option<PathBuf>,
    progress: Option<Bound<'_, PyAny>>,
) -> PyResult<String> {
    let (profile, mut limits) = (self::profile(profile)?, limits(memory, threads));
    limits.spool = spool;
    to_json(&watched(py, progress.as_ref(), |watch| suture_core::inspect(&input, &profile, &limits, watch))?)
}

/// `output` must not exist.
#[pyfunction]
#[pyo3(signature = (input, output, profile, memory, threads, spool, progress))]
#[expect(clippy::too_many_arguments, reason = "they are keywords where people call it")]
fn repair_file(
    py: Python<'_>,
    input: PathBuf,
    output: PathBuf,
    profile: &str,
    memory: Option<u64>,
    threads: Option<usize>,
    spool: Option<PathBuf>,
    progress: Option<Bound<'_, PyAny>>,
) -> PyResult<String> {
    let (mut profile, mut limits) = (self::profile(profile)?, limits(memory, threads));
    limits.spool = spool;
    // A name says its format, as on the command line; a profile may say another one.
    let of_name = output.extension().and_then(|ending| OutputFormat::of_ending(ending.to_str()?));
    if profile.format == OutputFormat::Input {
        profile.format = of_name.unwrap_or(profile.format);
    }
    to_json(&watched(py, progress.as_ref(), |watch| suture_core::repair(&input, &output, &profile, &limits, watch))?)
}

#[pyfunction]
fn find_defects(
    py: Python<'_>,
    vertices: Vertices<'_>,
    faces: Faces<'_>,
    memory: Option<u64>,
    threads: Option<usize>,
) -> PyResult<String> {
    let (mesh, limits) = (view(&vertices, &faces)?, limits(memory, threads));
    to_json(&watched(py, None, |watch| operations::find_defects(mesh, &limits, watch))?)
}

#[pyfunction]
fn find_loops<'py>(
    py: Python<'py>,
    vertices: Vertices<'_>,
    faces: Faces<'_>,
    memory: Option<u64>,
    threads: Option<usize>,
) -> PyResult<Loops<'py>> {
    let (mesh, limits) = (view(&vertices, &faces)?, limits(memory, threads));
    let found = watched(py, None, |watch| operations::find_loops(mesh, &limits, watch))?;
    arrays::loops(py, found)
}

#[pyfunction]
fn find_self_intersections<'py>(
    py: Python<'py>,
    vertices: Vertices<'_>,
    faces: Faces<'_>,
    memory: Option<u64>,
    threads: Option<usize>,
) -> PyResult<Pairs<'py>> {
    let (mesh, limits) = (view(&vertices, &faces)?, limits(memory, threads));
    let found = watched(py, None, |watch| operations::find_self_intersections(mesh, &limits, watch))?;
    arrays::pairs(py, found)
}

#[pyfunction]
fn certificate(
    py: Python<'_>,
    vertices: Vertices<'_>,
    faces: Faces<'_>,
    memory: Option<u64>,
    threads: Option<usize>,
) -> PyResult<String> {
    let (mesh, limits) = (view(&vertices, &faces)?, limits(memory, threads));
    to_json(&watched(py, None, |watch| operations::certificate(mesh, &limits, watch))?)
}

/// `how`: the place of the only loop to be closed, the shape of patches, the most edges, whether sheets are closed.
#[pyfunction]
fn fill<'py>(
    py: Python<'py>,
    vertices: Vertices<'_>,
    faces: Faces<'_>,
    how: (Option<[f32; 3]>, &str, u32, bool),
    memory: Option<u64>,
    threads: Option<usize>,
) -> PyResult<Repaired<'py>> {
    let (only_loop, shape, max_edges, sheets) = how;
    let shape = match shape {
        "flat" => PatchShape::Flat,
        "fair" => PatchShape::Fair,
        "implicit" => PatchShape::Implicit,
        "coons" => PatchShape::Coons,
        other => return Err(invalid(format!("a patch is \"flat\", \"fair\", \"coons\" or \"implicit\", not {other:?}"))),
    };
    let (mesh, limits) = (view(&vertices, &faces)?, limits(memory, threads));
    let how = Fill::default().only_loop(only_loop).shape(shape).max_edges(max_edges).sheets(sheets);
    repaired_arrays(py, watched(py, None, |watch| operations::fill(mesh, &how, &limits, watch))?)
}

#[pyfunction]
fn orient<'py>(
    py: Python<'py>,
    vertices: Vertices<'_>,
    faces: Faces<'_>,
    by_visibility: bool,
    memory: Option<u64>,
    threads: Option<usize>,
) -> PyResult<Repaired<'py>> {
    let (mesh, limits) = (view(&vertices, &faces)?, limits(memory, threads));
    let how = Orient::default().by_visibility(by_visibility);
    repaired_arrays(py, watched(py, None, |watch| operations::orient(mesh, &how, &limits, watch))?)
}

/// `how`: whether only what can be seen stays, whether surfaces that share vertices are taken apart.
#[pyfunction]
fn union<'py>(
    py: Python<'py>,
    vertices: Vertices<'_>,
    faces: Faces<'_>,
    how: (bool, bool),
    memory: Option<u64>,
    threads: Option<usize>,
) -> PyResult<Repaired<'py>> {
    let (mesh, limits) = (view(&vertices, &faces)?, limits(memory, threads));
    let how = Union::default().visible_only(how.0).separate(how.1);
    repaired_arrays(py, watched(py, None, |watch| operations::union(mesh, &how, &limits, watch))?)
}

/// `how`: the largest share of the surface, and how far it may move.
#[pyfunction]
fn wrap<'py>(
    py: Python<'py>,
    vertices: Vertices<'_>,
    faces: Faces<'_>,
    how: (f64, f64),
    memory: Option<u64>,
    threads: Option<usize>,
) -> PyResult<Repaired<'py>> {
    let (mesh, limits) = (view(&vertices, &faces)?, limits(memory, threads));
    let how = Wrap::default().max_share(how.0).max_move(how.1);
    repaired_arrays(py, watched(py, None, |watch| operations::wrap(mesh, &how, &limits, watch))?)
}

#[pymodule]
fn _suture(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    let repairs = RepairName::ALL.iter().map(|name| name.as_str());
    module.add("ORIGINS", arrays::KINDS.iter().copied().chain(repairs).collect::<Vec<_>>())?;
    module.add_function(wrap_pyfunction!(built_in_profile, module)?)?;
    module.add_function(wrap_pyfunction!(inspect, module)?)?;
    module.add_function(wrap_pyfunction!(repair, module)?)?;
    module.add_function(wrap_pyfunction!(inspect_file, module)?)?;
    module.add_function(wrap_pyfunction!(repair_file, module)?)?;
    module.add_function(wrap_pyfunction!(find_defects, module)?)?;
    module.add_function(wrap_pyfunction!(find_loops, module)?)?;
    module.add_function(wrap_pyfunction!(find_self_intersections, module)?)?;
    module.add_function(wrap_pyfunction!(certificate, module)?)?;
    module.add_function(wrap_pyfunction!(fill, module)?)?;
    module.add_function(wrap_pyfunction!(orient, module)?)?;
    module.add_function(wrap_pyfunction!(union, module)?)?;
    module.add_function(wrap_pyfunction!(wrap, module)?)?;
    Ok(())
}
