//! Finding a repair profile: by name, or in a TOML file.

use std::path::Path;

use serde::de::DeserializeOwned;
use suture_core::Profile;

/// Settings that a folder of `in/` may carry for itself.
pub(crate) const FOLDER_FILE: &str = ".suture.toml";

/// Reads settings in TOML.
///
/// # Errors
/// One line for people, with the number of the line at fault.
pub(crate) fn parse<T: DeserializeOwned>(text: &str) -> Result<T, String> {
    toml::from_str(text).map_err(|error| {
        let what = error.message().trim_end().replace('\n', ", ");
        let Some(at) = error.span().and_then(|span| text.get(..span.start)) else { return what };
        let before = at.matches('\n').count();
        let shown = text.lines().nth(before).unwrap_or_default().trim();
        format!("line {}, `{shown}`: {what}", before + 1)
    })
}

/// Reads a profile file. Unknown settings are errors, with their line; the name is the file's unless it gives one.
///
/// # Errors
/// A line for people.
pub(crate) fn from_file(path: &Path) -> Result<Profile, String> {
    let text = std::fs::read_to_string(path).map_err(|e| format!("{}: cannot read the profile: {e}", path.display()))?;
    let mut profile: Profile = parse(&text).map_err(|e| format!("{}: {e}", path.display()))?;
    profile.validate().map_err(|e| format!("{}: {e}", path.display()))?;
    if profile.name == Profile::default().name {
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        profile.name = if stem.starts_with('.') { "folder".into() } else { stem.into_owned() };
    }
    Ok(profile)
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
    if path.is_file() {
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
        std::fs::write(&path, "weld_relative = -1.0\n").unwrap();
        assert!(from_file(&path).unwrap_err().contains("weld_relative"));
        std::fs::write(&path, "max_separation_relative = inf\n").unwrap();
        assert!(from_file(&path).unwrap_err().contains("`max_separation_relative` must be a number from 0 to 1, not inf"));
    }

    #[test]
    fn an_unknown_name_says_what_there_is() {
        assert!(from_name_or_file("cautios").unwrap_err().contains("cautious"));
    }
}
