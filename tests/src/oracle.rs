//! Says whether a hot folder is as it must be, whatever happened to the daemon: every original whole in exactly one place, every
//! result once and the same as of an undisturbed run, and nothing partial anywhere.
//!
//! A complaint begins with a word for its class, so that many runs can be summed up.

use std::collections::BTreeMap;
use std::ffi::{OsStr, OsString};
use std::os::unix::ffi::{OsStrExt, OsStringExt};
use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::scene::{Files, Scene};

/// Where originals may lie.
const AREAS: [&str; 4] = ["in", "done", "failed", "quarantine"];
/// Where anything lies that users see.
const PARTS: [&str; 5] = ["in", "out", "done", "failed", "quarantine"];

/// The end of an undisturbed run.
pub struct Expected {
    dropped: Files,
    parts: BTreeMap<&'static str, Files>,
    /// The end of each job, by the file's name as it is listed.
    kinds: BTreeMap<String, String>,
}

impl Expected {
    /// From a run without faults, which is looked at with the same eyes.
    ///
    /// # Panics
    /// When that run is not right.
    pub fn of(binary: &Path, dropped: &Files) -> Self {
        let scene = Scene::new(binary, dropped);
        scene.come_to_rest().expect("an undisturbed run comes to rest");
        let parts = PARTS.map(|part| (part, scene.files(part))).into();
        let mut kinds = BTreeMap::new();
        for job in scene.jobs().expect("jobs can be listed") {
            kinds.insert(name_of(&job), text(&job["kind"]));
        }
        let expected = Self { dropped: dropped.clone(), parts, kinds };
        assert_eq!(expected.judge(&scene), Vec::<String>::new(), "an undisturbed run is right");
        assert_eq!(expected.kinds.len(), dropped.len());
        expected
    }

    /// How many files an undisturbed run finds good.
    pub fn good(&self) -> usize {
        self.kinds.values().filter(|kind| *kind == "done").count()
    }

    /// Complaints about the folder at any time: an original that is not whole in one place, a result that is not what it must be.
    pub fn judge_now(&self, scene: &Scene) -> Vec<String> {
        let mut complaints = Vec::new();
        let mut places: BTreeMap<&Path, Vec<PathBuf>> = BTreeMap::new();
        for area in AREAS {
            for (path, bytes) in scene.files(area) {
                if is_aside(&path) {
                    continue;
                }
                let plain = unversioned(&path);
                match self.dropped.get_key_value(&plain) {
                    Some((name, dropped)) if *dropped == bytes => {
                        places.entry(name).or_default().push(Path::new(area).join(&path))
                    }
                    Some(_) => complaints.push(format!("original changed: {area}/{path:?} has {} bytes", bytes.len())),
                    None if self.is_expected(area, &plain, &bytes) => {}
                    None => complaints.push(format!("stranger: {area}/{path:?}")),
                }
            }
        }
        for name in self.dropped.keys() {
            match places.get(name.as_path()).map_or(0, Vec::len) {
                0 => complaints.push(format!("original lost: {name:?}")),
                1 => {}
                _ => complaints.push(format!("original doubled: {name:?} in {:?}", places[name.as_path()])),
            }
        }
        for (path, bytes) in scene.files("out") {
            if !is_aside(&path) && !self.is_expected("out", &unversioned(&path), &bytes) {
                complaints.push(format!("result wrong: out/{path:?} has {} bytes", bytes.len()));
            }
        }
        for part in PARTS {
            for (path, bytes) in scene.files(part) {
                if path.extension() == Some(OsStr::new("json")) && serde_json::from_slice::<Value>(&bytes).is_err() {
                    complaints.push(format!("partial: {part}/{path:?} is not whole JSON"));
                }
            }
        }
        complaints
    }

    /// Complaints about the folder at rest: what [`Expected::judge_now`] says, and whatever is not as after an undisturbed run.
    pub fn judge(&self, scene: &Scene) -> Vec<String> {
        let mut complaints = self.judge_now(scene);
        let jobs = self.judge_jobs(scene);
        if !jobs.is_empty() {
            // Files of a job that ended otherwise are elsewhere: there is no need to list them.
            complaints.extend(jobs);
            return complaints;
        }
        for part in PARTS {
            let (mut missing, mut surplus) = (names(&self.parts[part]), Vec::new());
            for path in scene.files(part).keys() {
                let plain = unversioned(path);
                match missing.iter().position(|name| *name == plain) {
                    Some(at) => drop(missing.swap_remove(at)),
                    None => surplus.push(path.clone()),
                }
            }
            complaints.extend(missing.iter().map(|name| format!("missing: {part}/{name:?}")));
            complaints.extend(surplus.iter().map(|name| format!("surplus: {part}/{name:?}")));
        }
        for path in scene.files(".suture/work").keys() {
            complaints.push(format!("left over: .suture/work/{path:?}"));
        }
        complaints
    }

    /// Numbers of jobs that ended otherwise than they must: to be retried where a fault that lasted may be the reason.
    pub fn ended_otherwise(&self, scene: &Scene) -> Vec<u64> {
        let jobs = scene.jobs().unwrap_or_default();
        let otherwise = |job: &&Value| {
            let kind = text(&job["kind"]);
            matches!(kind.as_str(), "failed" | "quarantined") && self.kinds.get(&name_of(job)).is_some_and(|right| *right != kind)
        };
        jobs.iter().filter(otherwise).filter_map(|job| job["id"].as_u64()).collect()
    }

    fn judge_jobs(&self, scene: &Scene) -> Vec<String> {
        let jobs = match scene.jobs() {
            Ok(jobs) => jobs,
            Err(line) => return vec![format!("jobs: {line}")],
        };
        let mut complaints = Vec::new();
        for (name, kind) in &self.kinds {
            let ends: Vec<_> = jobs.iter().filter(|job| name_of(job) == *name && job["kind"] != "cancelled").collect();
            match ends[..] {
                [job] if job["kind"] == kind.as_str() => {}
                [job] => complaints.push(format!("job: {name} is {} for {kind}: {}", text(&job["kind"]), job["state"])),
                _ => complaints.push(format!("job: {} jobs for {name}", ends.len())),
            }
        }
        complaints
    }

    fn is_expected(&self, part: &str, name: &Path, bytes: &[u8]) -> bool {
        self.parts.get(part).and_then(|files| files.get(name)).is_some_and(|expected| expected == bytes)
    }
}

fn names(files: &Files) -> Vec<PathBuf> {
    files.keys().cloned().collect()
}

fn name_of(job: &Value) -> String {
    text(&job["source"]["path"])
}

fn text(value: &Value) -> String {
    value.as_str().unwrap_or_default().to_owned()
}

/// A report or a receipt, or hidden: neither an original nor a result.
fn is_aside(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default().as_bytes();
    name.ends_with(b".json") || name.starts_with(b".")
}

/// `part~2.stl` → `part.stl`.
fn unversioned(path: &Path) -> PathBuf {
    let name = path.file_name().unwrap_or_default().as_bytes();
    let mut plain = Vec::new();
    let mut at = 0;
    while let Some(byte) = name.get(at) {
        let digits = name[at + 1..].iter().take_while(|byte| byte.is_ascii_digit()).count();
        if *byte == b'~' && digits > 0 {
            at += 1 + digits;
        } else {
            plain.push(*byte);
            at += 1;
        }
    }
    path.with_file_name(OsString::from_vec(plain))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn versions_are_names_of_one_file() {
        for (name, plain) in [
            ("part.stl", "part.stl"),
            ("a/part~2.stl", "a/part.stl"),
            ("p~12~3.stl.report.json", "p.stl.report.json"),
            ("a~b", "a~b"),
        ] {
            assert_eq!(unversioned(Path::new(name)), Path::new(plain));
        }
    }
}
