//! How many jobs are computed twice, as a configuration says it.

use serde::{Deserialize, Deserializer, de};

use super::AUTO;

/// `check_one_in = 1000`, or `"auto"`.
#[derive(Debug)]
pub(super) struct OneIn(pub Option<u64>);

impl<'de> Deserialize<'de> for OneIn {
    fn deserialize<D: Deserializer<'de>>(d: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        #[serde(untagged, expecting = "a whole number, 0 for none, or \"auto\" is needed here")]
        enum Written {
            Number(u64),
            Text(String),
        }
        match Written::deserialize(d)? {
            Written::Number(number) => Ok(Self(Some(number))),
            Written::Text(text) if text == AUTO => Ok(Self(None)),
            Written::Text(text) => {
                Err(de::Error::custom(format!("`{text}` is no whole number; write 1000, 0 for none, or \"auto\"")))
            }
        }
    }
}
