//! Settings of a work on a package.

use crate::contract::progress::Progress;
use crate::contract::settings::{Limits, Profile};

/// Settings of a work on a package.
#[derive(Clone, Copy)]
pub(crate) struct Work<'a> {
    pub(crate) profile: &'a Profile,
    pub(crate) limits: &'a Limits,
    pub(crate) progress: &'a dyn Progress,
}
