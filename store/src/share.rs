//! How hot folders share the workers: among jobs that are wanted equally soon, each folder has turns by its weight, so that one with very many drops
//! keeps none with few waiting.
//!
//! A turn begins where the folder's last one ended, or where the latest turn of any folder began, whichever is later: who had nothing to do has saved
//! nothing up. It is the longer the less the folder's weight is. The folder whose next turn begins first is next; of several, the one with the oldest job.

use std::collections::BTreeMap;
use std::num::NonZeroU32;

use serde::{Deserialize, Deserializer, Serialize, de};

/// The length of a turn of a folder of weight 1.
const TURN: u64 = 1_000_000;

/// A folder's weight beside others, from 1 to 100.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(transparent)]
pub struct Weight(u8);

impl Default for Weight {
    /// Of a folder of which nothing is said.
    fn default() -> Self {
        Self(10)
    }
}

/// A number that is no weight.
#[derive(Debug, PartialEq, Eq, thiserror::Error)]
#[error("a share is a whole number from 1 to 100, not {0}")]
pub struct NoWeight(i64);

impl TryFrom<i64> for Weight {
    type Error = NoWeight;

    fn try_from(number: i64) -> Result<Self, NoWeight> {
        u8::try_from(number).ok().filter(|weight| (1..=100).contains(weight)).map(Self).ok_or(NoWeight(number))
    }
}

impl From<Weight> for u8 {
    fn from(weight: Weight) -> Self {
        weight.0
    }
}

impl std::fmt::Display for Weight {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        std::fmt::Display::fmt(&self.0, f)
    }
}

impl<'de> Deserialize<'de> for Weight {
    fn deserialize<D: Deserializer<'de>>(d: D) -> Result<Self, D::Error> {
        Self::try_from(i64::deserialize(d)?).map_err(de::Error::custom)
    }
}

impl Weight {
    /// The length of its turns.
    pub(crate) fn turn(self) -> u64 {
        TURN / u64::from(self.0.max(1))
    }
}

/// A folder's part of the work.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Share {
    /// Beside other folders.
    pub weight: Weight,
    /// So many of its jobs are in work at a time, on all hosts together; `None`: any number.
    pub most_running: Option<NonZeroU32>,
}

/// Those of hot folders, by name; a folder that is not named has the usual one.
pub type Shares = BTreeMap<String, Share>;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_weight_is_from_1_to_100() {
        assert_eq!([1, 100].map(|number| Weight::try_from(number).unwrap().turn()), [TURN, TURN / 100]);
        for number in [0, 101, -1, 256 + 10] {
            assert_eq!(Weight::try_from(number), Err(NoWeight(number)));
        }
        assert_eq!(serde_json::from_str::<Weight>("7").unwrap().to_string(), "7");
        assert!(serde_json::from_str::<Weight>("0").unwrap_err().to_string().contains("from 1 to 100"));
    }
}
