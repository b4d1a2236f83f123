//! Hot folders in buckets, as a configuration names them: `path = "s3://bucket/prefix"`.

use std::path::Path;

use super::{BucketConfig, Config, FolderConfig};
use crate::bucket::address::BucketAddress;

/// Below the state folder: the scratch of folders in buckets, by name.
const SCRATCH: &str = "buckets";
/// Bytes of drops that are kept for another attempt, unless the configuration says otherwise.
const CACHE: u64 = 4 << 30;

/// The bucket of a folder, whose `path` becomes its scratch below the state folder; `None` where it lies on this machine. `cache`: what is said of it.
///
/// # Errors
/// A line for people.
pub(super) fn place(folder: &mut FolderConfig, cache: Option<u64>, state: Option<&Path>) -> Result<(), String> {
    let Some(address) = folder.path.to_str().and_then(BucketAddress::parse) else {
        return match cache {
            Some(_) => Err("`cache` is for folders in buckets; leave it out".into()),
            None => Ok(()),
        };
    };
    let (address, cache) = (address?, cache.unwrap_or(CACHE));
    let state = state.ok_or("a folder in a bucket needs a `state` folder on this machine; add `state = \"/var/lib/suture\"`")?;
    if folder.name.starts_with('.') || folder.name.contains('/') {
        return Err(format!("`{}` cannot name a folder on this machine; give it another `name`", folder.name));
    }
    folder.path = state.join(SCRATCH).join(&folder.name);
    folder.bucket = Some(BucketConfig { address, cache });
    Ok(())
}

/// Settings that nothing comes of, since all folders lie in buckets.
///
/// # Errors
/// A line for people.
pub(super) fn check(config: &Config) -> Result<(), String> {
    let keep = &config.keep;
    let is_open = keep.results.is_open() && keep.reports.is_open() && keep.originals.is_open() && keep.archive.is_none();
    if is_open || config.folders.iter().any(|folder| folder.bucket.is_none()) {
        return Ok(());
    }
    Err("`results`, `reports`, `originals`, their sizes and `archive` do not go with folders in buckets, whose lifecycle rules do that; \
         leave them out (`history` and `history_jobs` may stay)"
        .into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::keep::Bound;

    fn placed(path: &str, cache: Option<u64>, state: Option<&str>) -> Result<FolderConfig, String> {
        let mut folder = FolderConfig::of(Path::new(path));
        place(&mut folder, cache, state.map(Path::new)).map(|()| folder)
    }

    #[test]
    fn a_folder_in_a_bucket_has_its_scratch_in_the_state_folder() {
        let far = placed("s3://prints/farm", None, Some("/var/lib/suture")).unwrap();
        assert_eq!((far.path.to_str(), far.name.as_str()), (Some("/var/lib/suture/buckets/farm"), "farm"));
        assert_eq!(far.bucket.map(|bucket| (bucket.address.to_string(), bucket.cache)), Some(("s3://prints/farm".into(), CACHE)));
        assert_eq!(placed("/srv/prints", None, None).unwrap(), FolderConfig::of(Path::new("/srv/prints")));
        for (path, cache, state, says) in [
            ("s3://prints/farm", None, None, "needs a `state` folder"),
            ("s3://prints//farm", None, Some("/s"), "is no bucket"),
            ("s3://prints/.farm", None, Some("/s"), "give it another `name`"),
            ("/srv/prints", Some(1), Some("/s"), "`cache` is for folders in buckets"),
        ] {
            let why = placed(path, cache, state).unwrap_err();
            assert!(why.contains(says), "{path}: {why}");
        }
    }

    #[test]
    fn what_a_bucket_keeps_its_rules_say() {
        let (far, near) = (placed("s3://prints/farm", None, Some("/s")).unwrap(), FolderConfig::of(Path::new("/srv")));
        let mut config = Config { folders: vec![far], ..Config::for_folder(Path::new("/srv")) };
        config.keep.history = Some(std::time::Duration::ZERO);
        check(&config).unwrap();
        config.keep.results = Bound { age: None, size: Some(1) };
        assert!(check(&config).unwrap_err().contains("do not go with folders in buckets"));
        config.folders.push(near);
        check(&config).expect("they are for the other folder");
    }
}
