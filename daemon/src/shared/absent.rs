//! The answers of a program that was built without the feature `postgres`.

use std::sync::Arc;

use suture_store::transfer::SharedStore;
use suture_store::{Address, JobStore, StoreError};

use crate::config::Config;

fn absent(address: &str) -> StoreError {
    StoreError::Unusable {
        path: address.into(),
        reason: "this program was built without PostgreSQL".into(),
        advice: "take one that was built with the feature `postgres`".into(),
    }
}

pub(super) fn connect(address: &Address, _: &Config) -> Result<Arc<dyn JobStore>, StoreError> {
    Err(absent(&address.to_string()))
}

pub(crate) fn visit(address: &Address, _: &str) -> Result<Box<dyn SharedStore>, StoreError> {
    Err(absent(&address.to_string()))
}

pub(crate) fn make(address: &Address) -> Result<(), StoreError> {
    Err(absent(&address.to_string()))
}

pub(crate) fn role(_: &str) -> Result<String, StoreError> {
    Err(absent("the role"))
}
