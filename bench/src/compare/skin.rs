//! What Suture does to the skin of real files: what could be seen from outside and is gone, and what was never drawn.

use std::path::PathBuf;

use suture_bench::judge;

use super::child;
use super::closing::{Bench, Options};
use super::error::Error;
use super::folders::{name_of, read_or_say};
use super::made::{Report, Skinned};
use super::page_skin;
use super::record::Line;
use super::sides::Side;
use super::together;
use super::way::Way;
use crate::mesh;

/// Has Suture repair each of `files`, and adds what became of their skins to a raw file, which is begun anew. Outputs are put into `keep`.
///
/// # Errors
/// When suture cannot be built, or the system fails. A file that is no STL is named and left out.
pub(crate) fn skins(options: &Options, files: &[PathBuf], jobs: usize, keep: Option<PathBuf>) -> Result<(), Error> {
    let mut bench = Bench::open(options, &[Side::Suture])?;
    let program = bench.programs.identity(Side::Suture)?;
    let folder = keep.unwrap_or_else(|| bench.folder.path().join("out"));
    std::fs::create_dir_all(&folder).map_err(Error::io("making a folder of outputs"))?;
    let one = |path: &PathBuf| -> Result<Option<Skinned>, Error> {
        let name = name_of(path);
        let Some(before) = read_or_say(path) else { return Ok(None) };
        let output = folder.join(&name);
        let command = bench.programs.command(&Way::plain(Side::Suture), 1, path, &output);
        let ended = child::run(command, Some(&output), false, options.limit)?;
        let after = mesh::read(&output).ok().filter(|_| ended.cost.exited);
        let said: serde_json::Value = serde_json::from_str(&ended.said).unwrap_or_default();
        let wraps = said["wraps"].as_array().into_iter().flatten();
        Ok(Some(Skinned {
            file: name,
            triangles: before.len() as u64,
            program: program.clone(),
            report: Report::read(&ended.said).filter(|_| ended.cost.exited),
            wrapped: wraps.filter_map(|wrap| wrap["area_share"].as_f64()).fold(0.0, |sum, share| sum + share),
            skin: after.map(|after| judge::skin(&before, &after)),
            seconds: ended.cost.wall_seconds,
        }))
    };
    let done = together::each(files, jobs, |path| {
        let skinned = one(path);
        if let Ok(Some(line)) = &skinned {
            println!("{}", page_skin::row(line));
        }
        skinned
    });
    let mut lines: Vec<Skinned> = done.into_iter().collect::<Result<Vec<_>, _>>()?.into_iter().flatten().collect();
    lines.sort_by(|a, b| a.file.cmp(&b.file));
    println!("{}", page_skin::summary(&lines.iter().collect::<Vec<_>>()));
    for line in lines {
        bench.journal.write(Line::Skinned(Box::new(line)))?;
    }
    Ok(())
}
