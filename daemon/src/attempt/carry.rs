//! The attempt at a file that goes along with an OBJ: there is nothing to work on.

use std::io;

use suture_core::ErrorClass;
use suture_store::job::Withdrawal;
use suture_store::{Claim, Hash, Step};

use super::Slot;
use crate::carry;
use crate::claim::{CLAIMED, Claimed};
use crate::folder::Folder;
use crate::publish::OUTPUT;

impl Slot {
    /// Has a copy of the claimed file in the attempt's folder.
    ///
    /// # Errors
    /// The step that the job goes instead.
    pub(super) fn carry(&self, folder: &Folder, claim: &Claim, claimed: &Claimed) -> Result<Hash, Box<Step>> {
        let work = folder.work(claim.token);
        let content = carry::copy(&work.join(CLAIMED), &work.join(OUTPUT), &|| self.context.halted());
        self.computed();
        let failed = |error: io::Error| {
            let reason = format!("the file cannot be copied: {error}");
            Box::new(match (error.kind(), ErrorClass::of(&error)) {
                (io::ErrorKind::Interrupted, _) => Step::HandBack,
                (_, ErrorClass::Shortage) => Step::Wait { reason },
                _ => Step::Environment { reason },
            })
        };
        match claimed.is_unchanged() {
            Ok(true) => content.map_err(failed),
            Ok(false) => Err(Box::new(Step::Withdrawn(Withdrawal::Changed))),
            Err(error) => Err(Box::new(Step::Environment { reason: format!("the file cannot be looked at: {error}") })),
        }
    }
}
