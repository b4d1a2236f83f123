//! The daemon tries what a bucket must be able to do before it uses it: a server that does not keep a condition replaces what is there, and never says so.

use std::sync::atomic::Ordering;

use super::calls::Failed;
use super::requests::Upload;
use super::{Bucket, Put, Trouble, Version, by};

const OWNER: &str = "probe";
/// How names of probes begin, below the prefix. One whose daemon died before it was removed goes with other litter.
pub(crate) const PROBES: &str = ".suture/probe-";

impl Bucket {
    /// Was it found good in this life?
    pub(crate) fn is_proved(&self) -> bool {
        self.caller.proved.get().is_some()
    }

    /// Finds out whether the bucket is there, is ours to read and to write, and keeps conditions; once.
    ///
    /// # Errors
    /// [`Trouble::Denied`] where that is not so; others when it is not known yet.
    pub(crate) fn prove(&self) -> Result<(), Trouble> {
        if self.is_proved() {
            return Ok(());
        }
        let tried = self.try_out();
        self.caller.is_patient.store(true, Ordering::Relaxed);
        tried.map(|()| self.caller.proved.get_or_init(|| ())).copied()
    }

    fn try_out(&self) -> Result<(), Trouble> {
        self.must_be_there()?;
        let anyway = || Ok(());
        // A name of this life's own: another daemon that begins at the same time does not meet it.
        let probe = format!("{PROBES}{:016x}", self.caller.life);
        self.put_bytes_new(&b"suture"[..], &probe, OWNER, &anyway)?;
        let is_kept =
            self.put_bytes_new(&b"suture"[..], &probe, OWNER, &anyway)? == Put::There && self.is_completion_refused(&probe)?;
        let is_named = self.stat(&probe)?.is_some_and(|found| found.owner.as_deref() == Some(OWNER));
        let lacking = match (is_kept, is_named) {
            (true, true) => None,
            (false, _) => Some(
                "the object store replaces what is there although it is told not to (`If-None-Match: *`); use one that keeps conditions",
            ),
            // Whose an object is would not be known, and each try would take its own result for a stranger's.
            (true, false) => Some(
                "the object store does not tell what was written with an object (`x-amz-meta-…`); use one that keeps metadata",
            ),
        };
        if let Some(reason) = lacking {
            self.remove(&probe)?;
            return Err(Trouble::Denied(self.caller.foul(reason)));
        }
        let other = Version { etag: Some("\"00000000000000000000000000000000\"".into()), id: None, size: 0, mtime_ns: 0 };
        if self.delete(&probe, &other, &anyway)? {
            tracing::warn!(
                bucket = %self.address(),
                "The object store removes without regard to conditions (`If-Match`): a file that is put under the name of an original in the \
                 instant of its removal is lost. Switch versions on in the bucket."
            );
        }
        self.remove(&probe)
    }

    /// Is an upload in parts to a name that is taken refused at its last step?
    fn is_completion_refused(&self, probe: &str) -> Result<bool, Trouble> {
        let (key, attributes) = (self.key(probe)?, by(OWNER));
        let id = self.caller.call(|| self.requests.begin(&key, &attributes)).map_err(Failed::or_changed)?;
        let upload = Upload { key, id };
        let completed = self
            .caller
            .call(|| self.requests.put_part(&upload, 0, "suture".into()))
            .and_then(|part| self.caller.call(|| self.requests.complete_new(&upload, std::slice::from_ref(&part))));
        let is_refused = match completed {
            Ok(()) => return Ok(false),
            Err(Failed::Unmet) => true,
            Err(other) => return Err(other.or_changed()),
        };
        // The lifecycle rule removes an upload that stays.
        let _ = self.caller.call(|| self.requests.abort(&upload));
        Ok(is_refused)
    }

    /// Is the bucket there? An object that is not there may be missing with its bucket: a HEAD tells no difference.
    ///
    /// # Errors
    /// When it is not, or does not answer.
    pub(crate) fn must_be_there(&self) -> Result<(), Trouble> {
        let prefix = self.address().key("in/");
        self.caller.call(|| self.requests.list(&prefix, None)).map(drop).map_err(|failed| self.caller.gone(failed))
    }
}
