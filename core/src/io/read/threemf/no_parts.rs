//! What of a build a slicer does not print.

use std::collections::HashSet;

use super::model::{Model, Place};
use super::roles::Role;

/// What of a build is no part of it.
#[derive(Debug, Default)]
pub(crate) struct NoParts {
    /// Objects that are built, and are a part nowhere.
    pub(crate) objects: HashSet<Place>,
    /// Places where an object is built that is no part there.
    pub(crate) uses: u64,
    /// Some of it is cut away from parts.
    pub(crate) any_negative: bool,
}

impl Model {
    /// Looks at each object where it is built. O(1) where a package names no roles.
    pub(crate) fn no_parts(&self) -> NoParts {
        let (mut all, mut parts) = (NoParts::default(), HashSet::new());
        if self.roles.are_all_parts() {
            return all;
        }
        for item in self.items() {
            self.instances(item, |place, _, role| {
                if role == Role::Part {
                    parts.insert(place);
                } else {
                    all.objects.insert(place);
                    all.uses += 1;
                    all.any_negative |= role == Role::Negative;
                }
            });
        }
        all.objects.retain(|place| !parts.contains(place));
        all
    }
}
