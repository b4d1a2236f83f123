//! One fault: which call of which process is to fail, and how. As a line: `daemon write 10 ENOSPC once`.

use std::fmt;
use std::str::FromStr;

use super::calls::{self, GROUPS, Kind, errno_name, errno_named};

/// The part a process plays.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Role {
    /// The process that was started, and its children before they become another program.
    Daemon,
    /// Any other program it started.
    Worker,
}

/// How a call fails.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum What {
    /// With this error; nothing is done.
    Errno(i32),
    /// It moves one byte (or one buffer).
    One,
    /// It moves half of the bytes.
    Half,
}

/// Which calls fail.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum When {
    /// The n-th.
    Once,
    /// The n-th and all after it.
    On,
    /// The n-th and every second one after it.
    Second,
}

/// A fault to inject.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fault {
    /// Of one role, or of all.
    pub role: Option<Role>,
    /// A kind of call, or a group: all calls that can give an error.
    pub call: String,
    /// Counted from 1, over all processes of the role.
    pub n: u64,
    /// How it fails.
    pub what: What,
    /// Which ones.
    pub when: When,
}

impl Fault {
    /// Is this a call it counts?
    pub fn counts(&self, role: Role, kind: &Kind) -> bool {
        let group = GROUPS.iter().find(|(name, _)| *name == self.call);
        let of_kind = match group {
            // A socket or a watch does not lie on a disk, though it may lack space of its own.
            Some((name, errno)) => kind.errnos.contains(errno) && !(*name == "disk" && kind.name.starts_with("inotify")),
            None => kind.name == self.call,
        };
        of_kind && self.role.is_none_or(|wanted| wanted == role)
    }

    /// Does the `n`-th of the calls it counts fail?
    pub fn hits(&self, n: u64) -> bool {
        match self.when {
            When::Once => n == self.n,
            When::On => n >= self.n,
            When::Second => n >= self.n && (n - self.n).is_multiple_of(2),
        }
    }

    /// Numbers of all system calls it may count.
    pub fn numbers(&self) -> Vec<i64> {
        let group = GROUPS.iter().find(|(name, _)| *name == self.call);
        let kinds = calls::KINDS.iter().filter(|kind| match group {
            Some((_, errno)) => kind.errnos.contains(errno),
            None => kind.name == self.call,
        });
        kinds.flat_map(calls::numbers).collect()
    }

    /// Where nothing can be written for good, no reason can be either.
    pub fn silences(&self) -> bool {
        self.when != When::Once && (self.role.is_none() || matches!(self.call.as_str(), "write" | "writev"))
    }

    /// A process that gets no memory may abort: there is nothing better to do.
    pub fn justifies_abort(&self) -> bool {
        self.what == What::Errno(libc::ENOMEM)
    }
}

impl fmt::Display for Role {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Daemon => "daemon",
            Self::Worker => "worker",
        })
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.role {
            Some(role) => write!(f, "{role}")?,
            None => f.write_str("all")?,
        }
        let what = match self.what {
            What::Errno(errno) => errno_name(errno),
            What::One => "one",
            What::Half => "half",
        };
        let when = match self.when {
            When::Once => "once",
            When::On => "on",
            When::Second => "second",
        };
        write!(f, " {} {} {what} {when}", self.call, self.n)
    }
}

impl FromStr for Fault {
    type Err = String;

    fn from_str(line: &str) -> Result<Self, String> {
        let words: Vec<&str> = line.split_whitespace().collect();
        let [role, call, n, what, when] = words[..] else { return Err(format!("`{line}`: not ROLE CALL N WHAT WHEN")) };
        let role = match role {
            "daemon" => Some(Role::Daemon),
            "worker" => Some(Role::Worker),
            "all" => None,
            _ => return Err(format!("`{role}` is no role")),
        };
        if calls::named(call).is_none() && !GROUPS.iter().any(|(name, _)| *name == call) {
            return Err(format!("`{call}` is no call"));
        }
        let n = n.parse().map_err(|_| format!("`{n}` is no number"))?;
        let what = match what {
            "one" => What::One,
            "half" => What::Half,
            name => What::Errno(errno_named(name).ok_or_else(|| format!("`{name}` is no error"))?),
        };
        let when = match when {
            "once" => When::Once,
            "on" => When::On,
            "second" => When::Second,
            _ => return Err(format!("`{when}` is no time")),
        };
        Ok(Self { role, call: call.into(), n, what, when })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_reads_back() {
        for line in ["daemon write 10 ENOSPC once", "worker read 1 half second", "all disk 3 ENOSPC on"] {
            assert_eq!(line.parse::<Fault>().unwrap().to_string(), line);
        }
        for line in ["daemon write 10 ENOSPC", "cook write 1 EIO once", "daemon dance 1 EIO once", "daemon write x EIO once"] {
            assert!(line.parse::<Fault>().is_err(), "{line}");
        }
    }

    #[test]
    fn hits_what_it_says() {
        let hits = |when: &str| {
            let fault: Fault = format!("daemon write 3 EIO {when}").parse().unwrap();
            (1..8).filter(|n| fault.hits(*n)).collect::<Vec<_>>()
        };
        assert_eq!(hits("once"), [3]);
        assert_eq!(hits("on"), [3, 4, 5, 6, 7]);
        assert_eq!(hits("second"), [3, 5, 7]);
    }
}
