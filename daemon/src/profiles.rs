//! Finding a repair profile: by name, or in a TOML file.

use std::path::Path;

use serde::de::DeserializeOwned;
use suture_core::Profile;

use crate::fsx;
use crate::own_profile::OwnProfile;

/// Settings that a folder of `in/` may carry for itself.
pub(crate) const FOLDER_FILE: &str = ".suture.toml";

/// Reads settings in TOML.
///
/// # Errors
/// One line for people, with the number of the line at fault.
pub(crate) fn parse<T: DeserializeOwned>(text: &str) -> Result<T, String> {
    toml::from_str(text).map_err(|error| {
        let what = error.message().trim_end().replace('\n', ", ");
        match error.span() {
            Some(span) => with_line(text, span.start, &what),
            None => what,
        }
    })
}

/// What is wrong at this byte of a text, after the number of its line and the line itself.
pub(crate) fn with_line(text: &str, at: usize, what: &str) -> String {
    let before = text.get(..at).unwrap_or_default().matches('\n').count();
    let shown = text.lines().nth(before).unwrap_or_default().trim();
    // An address may have a password in it.
    let shown =
        if shown.contains("://") && shown.contains('@') { shown.split('=').next().unwrap_or_default().trim() } else { shown };
    format!("line {}, `{shown}`: {what}", before + 1)
}

/// Where the line begins on which a setting stands, in the table that begins at `from`; else `from`.
pub(crate) fn place_of(text: &str, from: usize, setting: &str) -> usize {
    let mut at = from;
    for (n, line) in text.get(from..).unwrap_or_default().split_inclusive('\n').enumerate() {
        let words = line.trim_start();
        if n > 0 && words.starts_with('[') {
            break;
        }
        if words.strip_prefix(setting).is_some_and(|rest| rest.trim_start().starts_with('=')) {
            return at;
        }
        at += line.len();
    }
    from
}

/// Refuses a profile with a setting that means nothing. `from`: where its table begins in the text.
///
/// # Errors
/// One line for people, with the number of the line at fault.
pub(crate) fn validate(profile: &Profile, text: &str, from: usize) -> Result<(), String> {
    profile.validate().map_err(|error| with_line(text, place_of(text, from, error.setting), &error.to_string()))
}

/// The engine's settings in a profile file.
///
/// # Errors
/// As [`own_from_file`].
pub(crate) fn from_file(path: &Path) -> Result<Profile, String> {
    own_from_file(path).map(|own| own.profile)
}

/// Reads a profile file. Unknown settings are errors, with their line; the name is the file's unless it gives one.
///
/// # Errors
/// A line for people.
pub(crate) fn own_from_file(path: &Path) -> Result<OwnProfile, String> {
    let wrong = |line: String| format!("{}: {line}", path.display());
    let text = std::fs::read_to_string(path).map_err(|e| wrong(format!("cannot read the profile: {e}")))?;
    let mut own: OwnProfile = parse(&text).map_err(wrong)?;
    let profile = &mut own.profile;
    validate(profile, &text, 0).map_err(wrong)?;
    if profile.name == Profile::default().name {
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        profile.name = if stem.starts_with('.') { "folder".into() } else { stem.into_owned() };
    }
    Ok(own)
}

/// A built-in name, or else a file.
///
/// # Errors
/// A line for people.
pub(crate) fn from_name_or_file(text: &str) -> Result<Profile, String> {
    if let Some(profile) = Profile::built_in(text) {
        return Ok(profile);
    }
    let path = Path::new(text);
    if fsx::is_file(path).map_err(|error| format!("{text}: cannot be looked at: {error}"))? {
        return from_file(path);
    }
    Err(format!("there is no profile `{text}`: neither a file nor one of {}", Profile::BUILT_IN.join(", ")))
}

/// The profile that a command line asks for: `name` as for [`from_name_or_file`], with what its switches turn off.
///
/// # Errors
/// A line for people.
pub(crate) fn of_command(name: &str, no_self_intersections: bool) -> Result<Profile, String> {
    let mut profile = from_name_or_file(name)?;
    profile.check_self_intersections &= !no_self_intersections;
    Ok(profile)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_profile_file_is_strict_and_named_after_itself() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("resin.toml");
        std::fs::write(&path, "max_hole_edges = 7\n").unwrap();
        let profile = from_name_or_file(path.to_str().unwrap()).unwrap();
        assert_eq!((profile.name.as_str(), profile.max_hole_edges), ("resin", 7));
        std::fs::write(&path, "\nmax_hole_edgse = 7\n").unwrap();
        let error = from_file(&path).unwrap_err();
        assert!(
            error.contains("line 2, `max_hole_edgse = 7`: unknown field `max_hole_edgse`") && !error.contains('\n'),
            "{error}"
        );
        std::fs::write(&path, "a = [\n1,\n").unwrap();
        let error = from_file(&path).unwrap_err();
        assert!(!error.contains('\n') && error.contains(": line "), "{error}");
        std::fs::write(&path, "fill_holes = true\n# no weld\nweld_relative = -1.0\n").unwrap();
        assert!(from_file(&path).unwrap_err().contains("line 3, `weld_relative = -1.0`: `weld_relative` must be"));
        std::fs::write(&path, "max_separation_relative = inf\n").unwrap();
        assert!(from_file(&path).unwrap_err().contains("`max_separation_relative` must be a number from 0 to 1, not inf"));
    }

    #[test]
    fn an_unknown_name_says_what_there_is() {
        assert!(from_name_or_file("cautios").unwrap_err().contains("cautious"));
    }
}
