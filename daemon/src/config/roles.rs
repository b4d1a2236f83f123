//! A daemon that leaves a part of the work to others needs a store and folders that others see.

use suture_store::Role;

use super::Config;

/// Refuses a daemon that lacks a role where no other one could have it: what a folder on this machine needs, only a daemon on this machine can do.
///
/// # Errors
/// A line for people.
pub(crate) fn check(config: &Config) -> Result<(), String> {
    if config.roles.are_all() {
        return Ok(());
    }
    let roles = config.roles;
    if let Some(near) = config.folders.iter().find(|folder| !folder.is_for_many()) {
        return Err(format!(
            "the folder `{}` lies on this machine, and is served by one daemon with all roles; this one has {roles} alone: serve folders in \
             buckets (`path = \"s3://…\"`) or on a share (`shared = true`), or leave the roles out",
            near.name
        ));
    }
    if config.store.is_none() {
        return Err(format!(
            "a daemon with the roles {roles} leaves work to others, which must know of its jobs: name their database with --store, or `store` in \
             the configuration, or leave the roles out"
        ));
    }
    Ok(())
}

/// Takes from a configuration for many daemons what is for other roles.
pub(crate) fn narrow(config: &mut Config) {
    if !config.roles.has(Role::Control) {
        config.api = None;
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use suture_store::Address;

    use super::*;
    use crate::config::{BucketConfig, FolderConfig};

    #[test]
    fn a_part_of_the_work_is_done_in_buckets_with_a_store_that_others_see() {
        let mut config = Config::for_folder(Path::new("/srv/prints"));
        check(&config).expect("all roles, for which nothing is needed");
        config.roles = "intake,control".parse().unwrap();
        let why = check(&config).unwrap_err();
        assert!(why.contains("`prints` lies on this machine") && why.contains("intake,control alone"), "{why}");
        let address = crate::bucket::address::BucketAddress::parse("s3://farm").unwrap().unwrap();
        config.folders = vec![FolderConfig { bucket: Some(BucketConfig { address, cache: 1 }), ..config.folders[0].clone() }];
        assert!(check(&config).unwrap_err().contains("--store"));
        config.store = Some(Address::parse("postgres://farm@db/jobs").unwrap());
        check(&config).unwrap();
        config.api = Some(crate::config::api::Api::at(([127, 0, 0, 1], 1).into()));
        narrow(&mut config);
        assert!(config.api.is_some());
        config.roles = "worker".parse().unwrap();
        narrow(&mut config);
        assert_eq!(config.api, None);
    }
}
