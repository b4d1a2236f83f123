//! What a daemon of a farm does. One that is not told otherwise does all of it.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Deserializer, Serialize, Serializer, de};

/// A part of the work.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Role {
    /// Looks at folders, and has jobs made of what is dropped.
    Intake,
    /// Works on jobs, and publishes their results.
    Worker,
    /// Shows how things stand, tells of events, and lets go what is to go.
    Control,
}

impl Role {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Intake, Self::Worker, Self::Control];

    /// The word for it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Intake => "intake",
            Self::Worker => "worker",
            Self::Control => "control",
        }
    }
}

impl fmt::Display for Role {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// Some parts of the work, at least one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Roles(u8);

impl Default for Roles {
    /// All of it.
    fn default() -> Self {
        Self(Role::ALL.into_iter().map(Self::bit).sum())
    }
}

impl Roles {
    fn bit(role: Role) -> u8 {
        1 << role as u8
    }

    /// These; `None` where there is none.
    pub fn of(roles: impl IntoIterator<Item = Role>) -> Option<Self> {
        let bits = roles.into_iter().fold(0, |bits, role| bits | Self::bit(role));
        (bits != 0).then_some(Self(bits))
    }

    /// Is that part among them?
    pub fn has(self, role: Role) -> bool {
        self.0 & Self::bit(role) != 0
    }

    /// Are they all?
    pub fn are_all(self) -> bool {
        self == Self::default()
    }

    /// Each of them, in the order of a job's life.
    pub fn each(self) -> impl Iterator<Item = Role> {
        Role::ALL.into_iter().filter(move |role| self.has(*role))
    }
}

impl fmt::Display for Roles {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(&self.each().map(Role::name).collect::<Vec<_>>().join(","))
    }
}

/// A word that is no role.
#[derive(Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{0}` is no role; name some of intake, worker, control")]
pub struct NoRole(String);

impl FromStr for Role {
    type Err = NoRole;

    fn from_str(text: &str) -> Result<Self, NoRole> {
        Self::ALL.into_iter().find(|role| role.name() == text).ok_or_else(|| NoRole(text.to_owned()))
    }
}

impl FromStr for Roles {
    type Err = NoRole;

    /// Words with commas between them.
    fn from_str(text: &str) -> Result<Self, NoRole> {
        let roles = text.split(',').map(|word| word.trim().parse()).collect::<Result<Vec<Role>, _>>()?;
        Self::of(roles).ok_or_else(|| NoRole(text.to_owned()))
    }
}

impl Serialize for Roles {
    fn serialize<S: Serializer>(&self, s: S) -> Result<S::Ok, S::Error> {
        s.collect_seq(self.each().map(Role::name))
    }
}

impl<'de> Deserialize<'de> for Roles {
    fn deserialize<D: Deserializer<'de>>(d: D) -> Result<Self, D::Error> {
        let words = Vec::<String>::deserialize(d)?;
        words.join(",").parse().map_err(de::Error::custom)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn roles_are_read_as_they_are_written() {
        for bits in 1..8 {
            let roles = Roles(bits);
            assert_eq!(roles.to_string().parse(), Ok(roles));
            let json = serde_json::to_string(&roles).unwrap();
            assert_eq!(serde_json::from_str::<Roles>(&json).unwrap(), roles, "{json}");
        }
        assert_eq!("control, intake".parse(), Ok(Roles::of([Role::Intake, Role::Control]).unwrap()));
        assert_eq!(Roles::of([Role::Control, Role::Intake]).unwrap().to_string(), "intake,control");
        assert!(Roles::default().are_all() && Roles::of([]).is_none());
        for text in ["", "boss", "intake,,worker"] {
            assert!(text.parse::<Roles>().unwrap_err().to_string().contains("is no role; name some of intake, worker, control"));
        }
    }
}
