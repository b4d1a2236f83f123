//! Hot folders on a share that daemons on several machines serve, as a configuration names them: `shared = true`.

use std::path::Path;

use super::{Config, FolderConfig, real};

/// A folder of which it is said that others serve it, too. `state`: what is said of this machine's own folder.
///
/// # Errors
/// A line for people.
pub(super) fn place(folder: &mut FolderConfig, is_shared: bool, state: Option<&Path>) -> Result<(), String> {
    if !is_shared {
        return Ok(());
    }
    if folder.bucket.is_some() {
        return Err("a folder in a bucket is for any number of daemons as it is; leave `shared` out".into());
    }
    let state = state.ok_or(
        "a folder that daemons on several machines serve needs a `state` folder for each of them; add `state = \"/var/lib/suture\"`",
    )?;
    if real(state).starts_with(real(&folder.path)) {
        return Err("`state` is of this machine alone, and lies beside a folder that others serve, too, not in it".into());
    }
    folder.is_shared = true;
    Ok(())
}

/// Refuses a folder that others serve, where they could not know of its jobs.
///
/// # Errors
/// A line for people.
pub(crate) fn check(config: &Config) -> Result<(), String> {
    match config.folders.iter().find(|folder| folder.is_shared) {
        Some(folder) if config.store.is_none() => Err(format!(
            "the folder `{}` is served by other daemons, too, which must know of its jobs: name their database with --store, or `store` in the \
             configuration, or leave `shared` out",
            folder.name
        )),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use suture_store::Address;

    use super::*;
    use crate::bucket::address::BucketAddress;
    use crate::config::BucketConfig;

    #[test]
    fn a_folder_for_many_has_its_state_and_its_jobs_elsewhere() {
        let mut folder = FolderConfig::of(Path::new("/mnt/prints"));
        place(&mut folder, false, None).unwrap();
        assert!(!folder.is_shared && !folder.is_for_many());
        for (state, says) in [(None, "needs a `state` folder"), (Some("/mnt/prints/.suture/state"), "beside a folder")] {
            let why = place(&mut folder, true, state.map(Path::new)).unwrap_err();
            assert!(why.contains(says), "{why}");
        }
        let address = BucketAddress::parse("s3://farm").unwrap().unwrap();
        let mut far = FolderConfig { bucket: Some(BucketConfig { address, cache: 1 }), ..folder.clone() };
        assert!(place(&mut far, true, Some(Path::new("/s"))).unwrap_err().contains("leave `shared` out"));
        place(&mut folder, true, Some(Path::new("/var/lib/suture"))).unwrap();
        assert!(folder.is_for_many());
        let mut config = Config { folders: vec![folder], ..Config::for_folder(Path::new("/mnt/prints")) };
        assert!(check(&config).unwrap_err().contains("`prints` is served by other daemons"));
        config.store = Some(Address::parse("postgres://farm@db/jobs").unwrap());
        check(&config).unwrap();
    }
}
