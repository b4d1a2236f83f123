//! Which settings count for a file: those of its folder in `in/`, or of the nearest one above it that has some, else those of the profile
//! that its first sub-folder or the hot folder names. A sub-folder that forces work does not count ([`crate::force`]).

use std::io;
use std::path::PathBuf;

use suture_core::Profile;
use suture_store::{Job, Priority, RelPath};

use crate::config::Config;
use crate::folder::Folder;
use crate::profiles;
use crate::{force, fsx};

/// The nearest file of settings for a file of `in/`. One that cannot be looked at is no reason to take another.
fn nearest(folder: &Folder, path: &RelPath) -> io::Result<Option<PathBuf>> {
    let inbox = folder.inbox();
    let path = path.to_path();
    for above in path.ancestors().skip(1) {
        let plain = force::without(above);
        for folder in std::iter::once(above).chain((plain != above).then_some(&*plain)) {
            let own = inbox.join(folder).join(profiles::FOLDER_FILE);
            if fsx::is_file(&own)? {
                return Ok(Some(own));
            }
        }
    }
    Ok(None)
}

/// The profile to repair a file with.
///
/// # Errors
/// A line for people, when a person has to mend a setting first.
pub(crate) fn profile(config: &Config, folder: &Folder, job: &Job) -> Result<Profile, String> {
    let own = nearest(folder, &job.source.path);
    match own.map_err(|error| format!("the settings of its folder cannot be looked at: {error}"))? {
        Some(own) => profiles::from_file(&own),
        None => {
            let name = &job.source.profile;
            config.profile(name).ok_or_else(|| format!("there is no profile `{name}` any more"))
        }
    }
}

/// How soon a file is wanted: its profile says it, else its hot folder. What is wrong in a profile is told when the file is to be repaired.
pub(crate) fn priority(config: &Config, folder: &Folder, path: &RelPath, profile: &str) -> Priority {
    let of_profile = match nearest(folder, path) {
        Err(_) => None,
        Ok(Some(own)) => profiles::own_from_file(&own).ok().and_then(|own| own.priority),
        Ok(None) => config.profiles.get(profile).and_then(|own| own.priority),
    };
    let of_folder = config.folders.iter().find(|known| known.name == folder.name).map(|known| known.priority);
    of_profile.or(of_folder).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::FolderConfig;
    use crate::own_profile::OwnProfile;

    #[test]
    fn the_profile_says_how_soon_else_the_folder() {
        let number = |n| Priority::try_from(n).unwrap();
        let dir = tempfile::tempdir().unwrap();
        let mut config = Config::for_folder(dir.path());
        let folder = Folder::open(&config.folders[0], None).unwrap();
        let write = |name: &str, text: &str| {
            std::fs::create_dir_all(folder.inbox().join(name)).unwrap();
            std::fs::write(folder.inbox().join(name).join(profiles::FOLDER_FILE), text).unwrap();
        };
        let asked = |config: &Config, path: &str, profile| priority(config, &folder, &RelPath::new(path).unwrap(), profile);
        assert_eq!(asked(&config, "a.stl", "default"), Priority::default());
        config.folders = vec![FolderConfig { priority: number(2), ..config.folders[0].clone() }];
        let rush = OwnProfile { priority: Some(number(8)), ..OwnProfile::default() };
        config.profiles.insert("rush".into(), rush);
        config.profiles.insert("resin".into(), OwnProfile::default());
        assert_eq!(["default", "resin", "rush"].map(|profile| asked(&config, "x/a.stl", profile)), [2, 2, 8].map(number));
        write("rush", "max_hole_edges = 7\n");
        assert_eq!(asked(&config, "rush/a.stl", "rush"), number(2), "its own settings take the place of the profile's");
        write("rush/now", "priority = 9\n");
        assert_eq!(asked(&config, "rush/now/deep/a.stl", "rush"), number(9), "the nearest");
        assert_eq!(asked(&config, "!force/rush/now/a.stl", "rush"), number(9), "without the word, it would lie there");
        write("!force/rush/now", "priority = 7\n");
        assert_eq!(asked(&config, "!force/rush/now/a.stl", "rush"), number(7), "it lies here all the same");
        write("rush/now", "priority = 99\n");
        assert_eq!(asked(&config, "rush/now/a.stl", "rush"), number(2), "a mistake says nothing");
    }
}
