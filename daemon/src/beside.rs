//! The files that a profile names for a mesh beside the mesh itself: its tool path, a brush and a mask that correct what is residue. Each is a file,
//! or, by a name with a `*`, the one beside the mesh that has the mesh's name in the star's place (`*.nc` for `part.stl` is `part.nc`).
//!
//! **In:** a profile, and where the mesh lies. **Out:** where these files are to be read, and how they are called; or why the mesh is to wait.
//! **Promise:** a file of a hot folder is copied into the attempt's own folder, since a worker reaches nothing else; it is never changed nor moved.

use std::ffi::{OsStr, OsString};
use std::io;
use std::os::unix::ffi::{OsStrExt, OsStringExt};
use std::path::{Component, Path, PathBuf};
use std::time::Duration;

use serde::{Deserialize, Serialize};
use suture_core::{Profile, Report, ResidueSettings};
use suture_store::{Job, Time};

use crate::claim::Original;
use crate::create;
use crate::folder::Folder;
use crate::fsx::{self, Identity};
use crate::writers::Writers;

/// A file for one mesh.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Companion {
    role: Role,
    /// Where it is to be read.
    at: PathBuf,
    /// Its name as people know it.
    shown: String,
}

/// The setting of a profile that names it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Role {
    Toolpath,
    Brush,
    Mask,
}

impl Role {
    const ALL: [Self; 3] = [Self::Toolpath, Self::Brush, Self::Mask];

    fn words(self) -> &'static str {
        match self {
            Self::Toolpath => "tool path",
            Self::Brush => "brush",
            Self::Mask => "mask",
        }
    }

    /// The name of its copy, before its own ending.
    fn copy(self) -> &'static str {
        match self {
            Self::Toolpath => "toolpath",
            Self::Brush => "brush",
            Self::Mask => "mask",
        }
    }

    fn setting(self, of: &mut ResidueSettings) -> &mut String {
        match self {
            Self::Toolpath => &mut of.toolpath,
            Self::Brush => &mut of.brush,
            Self::Mask => &mut of.mask,
        }
    }

    /// As the profile names it; empty where residue is not asked for.
    fn pattern(self, profile: &Profile) -> &str {
        let of = &profile.residue;
        match self {
            Self::Toolpath => &of.toolpath,
            _ if of.toolpath.is_empty() && !of.without_path => "",
            Self::Brush => &of.brush,
            Self::Mask => &of.mask,
        }
    }
}

/// Does a profile name any? Another file of the same name makes another result.
pub(crate) fn has_any(profile: &Profile) -> bool {
    Role::ALL.into_iter().any(|role| !role.setting(&mut profile.residue.clone()).is_empty())
}

/// Lets a profile name these files where they are to be read.
pub(crate) fn put(companions: &[Companion], profile: &mut Profile) {
    for companion in companions {
        if let Some(path) = companion.at.to_str() {
            *companion.role.setting(&mut profile.residue) = path.into();
        }
    }
}

/// Lets a report name these files as people know them, as its profile did before.
pub(crate) fn take_back(companions: &[Companion], profile: &Profile, report: &mut Report) {
    report.profile.residue.clone_from(&profile.residue);
    let Some(why) = report.residue.as_mut().and_then(|residue| residue.why_not.as_mut()) else { return };
    for companion in companions {
        *why = why.replace(&*companion.at.to_string_lossy(), &companion.shown);
    }
}

/// The files of a mesh on the command line whose names have a star.
pub(crate) fn of_command(profile: &Profile, mesh: &Path) -> Vec<Companion> {
    let of = |role: Role| {
        let at = Some(role.pattern(profile)).filter(|pattern| pattern.contains('*')).map(|pattern| beside(pattern, mesh))?;
        Some(Companion { role, shown: at.display().to_string(), at })
    };
    Role::ALL.into_iter().filter_map(of).collect()
}

/// The files of a job's mesh, copied into `work`; none where its profile names none. A file that is not there, or still being written, is waited for as long as the
/// profile says, from when the job was there; then the mesh is worked on, and its report says what is missing. `settle`: how long a file must rest.
///
/// # Errors
/// A line for people: why the job is to wait.
pub(crate) fn of_job(
    profile: &Profile,
    of: (&Folder, &Job),
    work: &Path,
    times: (Time, Duration),
) -> Result<Vec<Companion>, String> {
    let named = Role::ALL.into_iter().filter(|role| !role.pattern(profile).is_empty());
    named.map(|role| copied(role, profile, of, work, times)).collect()
}

/// One of them, copied.
fn copied(
    role: Role,
    profile: &Profile,
    (folder, job): (&Folder, &Job),
    work: &Path,
    (now, settle): (Time, Duration),
) -> Result<Companion, String> {
    let (pattern, words) = (role.pattern(profile), role.words());
    let leads_out = |part: Component<'_>| matches!(part, Component::ParentDir);
    let is_absolute = Path::new(pattern).is_absolute();
    if Path::new(pattern).components().any(leads_out) || !(is_absolute || pattern.contains('*')) {
        let advice = "name an absolute path, or a name beside the mesh with `*` for the mesh's own";
        return Err(format!("its profile's {words}, `{pattern}`, is no file that a hot folder can find: {advice}"));
    }
    if role == Role::Mask && !is_absolute {
        let advice = "name an absolute path outside of it, where a `*` is the mesh's own name";
        return Err(format!("its profile's mask, `{pattern}`, is a mesh that the hot folder would repair itself: {advice}"));
    }
    if folder.bucket.is_some() && !is_absolute {
        let advice = "name an absolute path on this machine";
        return Err(format!(
            "its profile's {words}, `{pattern}`, lies beside the mesh, which is not done for folders in buckets: {advice}"
        ));
    }
    let from = beside(pattern, &folder.inbox().join(job.source.path.to_path()));
    let shown = if is_absolute { from.display().to_string() } else { name(&from) };
    let mut own = OsString::from(role.copy());
    if let Some(ending) = from.extension() {
        own.push(".");
        own.push(ending);
    }
    let at = work.join(own);
    let waited = now.0.saturating_sub(job.retried.unwrap_or(job.submitted).0);
    let is_patient = (waited as f64) < 60_000.0 * profile.residue.wait_minutes;
    // A job that waited for another file has a copy of this one already.
    fsx::remove_if_there(&at).map_err(|error| format!("{shown}, its {words}: an older copy stays: {error}"))?;
    match copy(&from, &at, (now, settle)) {
        Ok(true) => {}
        Ok(false) if is_patient => return Err(format!("{shown}, its {words}, is still being written")),
        Err(error) if error.kind() == io::ErrorKind::NotFound && is_patient => {
            return Err(format!("{shown}, its {words}, is not beside it yet"));
        }
        // The worker's report says that it is not there.
        Ok(false) => {}
        Err(error) if error.kind() == io::ErrorKind::NotFound => {}
        Err(error) => return Err(format!("{shown}, its {words}, cannot be read: {error}")),
    }
    Ok(Companion { role, at, shown })
}

/// Copies a file that is at rest; false if it is not.
fn copy(from: &Path, to: &Path, (now, settle): (Time, Duration)) -> io::Result<bool> {
    let original = Original::open(from)?;
    let before = original.identity()?;
    let age = i128::from(now.0) * 1_000_000 - i128::from(before.mtime_ns);
    // A time to come is another machine's clock, and says nothing.
    let is_young = age >= 0 && age < settle.as_nanos() as i128;
    if is_young || Writers::default().has(original.file(), &before) {
        return Ok(false);
    }
    create::copy_new(original.file(), to)?;
    let is_same = Identity::of(from).is_ok_and(|after| after == before);
    if !is_same {
        fsx::remove_if_there(to)?;
    }
    Ok(is_same)
}

/// The file that a pattern names beside a mesh; where the case of its letters alone is another one, that file.
fn beside(pattern: &str, mesh: &Path) -> PathBuf {
    let stem = mesh.file_stem().unwrap_or_default().as_bytes();
    let parts: Vec<&[u8]> = pattern.as_bytes().split(|byte| *byte == b'*').collect();
    let wanted = mesh.parent().unwrap_or(Path::new("")).join(OsString::from_vec(parts.join(stem)));
    if !pattern.contains('*') || std::fs::symlink_metadata(&wanted).is_ok() {
        return wanted;
    }
    let is_it = |found: &OsStr| wanted.file_name().is_some_and(|name| name.eq_ignore_ascii_case(found));
    let folder = wanted.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut found: Vec<OsString> = std::fs::read_dir(folder)
        .into_iter()
        .flatten()
        .flatten()
        .map(|entry| entry.file_name())
        .filter(|name| is_it(name))
        .collect();
    found.sort();
    found.into_iter().next().map_or_else(|| wanted.clone(), |name| wanted.with_file_name(name))
}

fn name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

#[cfg(test)]
mod tests {
    use std::fs::File;

    use super::*;

    #[test]
    fn a_star_is_the_name_of_the_mesh_whatever_the_case_of_the_ending() {
        let dir = tempfile::tempdir().unwrap();
        let put = |name: &str| std::fs::write(dir.path().join(name), b"G0").unwrap();
        put("part.nc");
        put("Other.NC");
        let of = |pattern: &str, mesh: &str| name(&beside(pattern, &dir.path().join(mesh)));
        assert_eq!(of("*.nc", "part.stl"), "part.nc");
        assert_eq!(of("*.nc", "other.stl"), "Other.NC");
        assert_eq!(of("*_op1.nc", "part.v2.stl"), "part.v2_op1.nc");
        assert_eq!(beside("/paths/*.nc", Path::new("in/part.stl")), Path::new("/paths/part.nc"));
        assert_eq!(beside("/paths/all.nc", Path::new("in/part.stl")), Path::new("/paths/all.nc"));
        assert_eq!(beside("../*.nc", Path::new("part.stl")), Path::new("../part.nc"));
    }

    #[test]
    fn a_file_that_is_young_or_open_for_writing_is_not_copied() {
        let dir = tempfile::tempdir().unwrap();
        let (from, to) = (dir.path().join("part.nc"), dir.path().join("copy.nc"));
        std::fs::write(&from, b"G0 X1").unwrap();
        let of = Identity::of(&from).unwrap();
        let at = |seconds: u64| (Time((of.mtime_ns / 1_000_000) as u64 + 1000 * seconds), Duration::from_secs(5));
        assert!(!copy(&from, &to, at(1)).unwrap() && !to.exists());
        let writer = File::options().append(true).open(&from).unwrap();
        assert!(!copy(&from, &to, at(60)).unwrap());
        drop(writer);
        assert!(copy(&from, &to, at(60)).unwrap());
        assert_eq!(std::fs::read(&to).unwrap(), b"G0 X1");
        assert_eq!(copy(&dir.path().join("none.nc"), &to, at(60)).unwrap_err().kind(), io::ErrorKind::NotFound);
    }
}
