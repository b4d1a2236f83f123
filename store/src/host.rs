//! Daemons that share a store, as each tells of itself with its signs of life.

use serde::{Deserialize, Serialize};

use crate::id::Time;
use crate::role::{Role, Roles};

/// What a daemon tells of itself.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Station {
    /// The name of its machine.
    pub host: String,
    /// Its process.
    pub pid: u32,
    /// Of the program, and so of the engine that makes its results.
    pub version: String,
    /// What it does.
    pub roles: Roles,
    /// Small files that it works on at a time.
    pub workers: u32,
    /// Bytes that its workers may hold together.
    pub memory: u64,
    /// Bytes of the largest file that it takes; `None`: of any size.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub largest: Option<u64>,
    /// The hot folders in which it looks for drops, by name. Of a share, one daemon does.
    #[serde(default)]
    pub keeps: Vec<String>,
}

/// A daemon that shares the store.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Host {
    /// Its name in the store, of which there is one at a time.
    pub daemon: String,
    /// As it told last.
    #[serde(flatten)]
    pub station: Station,
    /// The hot folders that it serves, by name.
    pub folders: Vec<String>,
    /// Its life began then.
    pub began: Time,
    /// Its last sign of life.
    pub seen: Time,
    /// It gave that sign lately: nobody takes its jobs from it.
    pub is_alive: bool,
    /// It finishes what it has, and claims nothing.
    pub is_draining: bool,
    /// Jobs that it holds.
    pub running: u64,
}

impl Host {
    /// May it claim a job of that folder and size, now or as soon as it has time?
    pub fn takes(&self, folder: &str, size: u64) -> bool {
        let serves = self.folders.iter().any(|name| name == folder);
        self.works() && serves && self.station.largest.is_none_or(|largest| size <= largest)
    }

    /// Does it look for drops in that folder?
    pub fn keeps(&self, folder: &str) -> bool {
        self.station.roles.has(Role::Intake) && self.station.keeps.iter().any(|name| name == folder)
    }

    /// Its folders in which it looks for drops.
    pub fn kept(&self) -> impl Iterator<Item = &str> {
        self.folders.iter().map(String::as_str).filter(|folder| self.keeps(folder))
    }

    /// Does it claim anything at all?
    pub fn works(&self) -> bool {
        self.is_alive && !self.is_draining && self.station.roles.has(Role::Worker)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_host_takes_what_it_serves_and_can_hold() {
        let host = Host {
            daemon: "a:/state".into(),
            station: Station { largest: Some(100), ..Station::default() },
            folders: vec!["farm".into()],
            began: Time(1),
            seen: Time(2),
            is_alive: true,
            is_draining: false,
            running: 0,
        };
        assert!(host.takes("farm", 100) && !host.takes("farm", 101) && !host.takes("other", 1));
        let largest = Station { largest: None, ..host.station.clone() };
        assert!(Host { station: largest, ..host.clone() }.takes("farm", u64::MAX));
        assert!(!Host { is_alive: false, ..host.clone() }.works() && !Host { is_draining: true, ..host.clone() }.works());
        let keeper = Station { keeps: vec!["farm".into()], ..host.station.clone() };
        assert!(!host.keeps("farm") && Host { station: keeper.clone(), ..host.clone() }.keeps("farm"));
        let works = Station { roles: Roles::of([Role::Worker]).unwrap(), ..keeper };
        assert!(!Host { station: works, ..host.clone() }.keeps("farm"));
        let shows = Station { roles: Roles::of([Role::Intake, Role::Control]).unwrap(), ..host.station.clone() };
        assert!(!Host { station: shows, ..host }.works());
    }
}
