//! The database that holds the jobs of many machines, as a configuration names it.

use serde::{Deserialize, Deserializer, de};
use suture_store::Address;

/// `store = "postgres://…"`.
#[derive(Debug)]
pub(super) struct StoreFile(pub Address);

impl<'de> Deserialize<'de> for StoreFile {
    fn deserialize<D: Deserializer<'de>>(d: D) -> Result<Self, D::Error> {
        Address::parse(&String::deserialize(d)?).map(Self).map_err(de::Error::custom)
    }
}
