//! What a worker process and its supervisor say to each other: one JSON value a line.
//!
//! The supervisor writes [`Request`]s to the worker's standard input; for each, the worker writes one [`Message::Begun`], any number of
//! [`Message::Progress`] and then exactly one [`Message::Done`] or [`Message::Failed`] to its standard output. End of input
//! ends the worker. A worker that closes its output without an answer has died of the request.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};
use suture_core::report::Task;
use suture_core::{ErrorClass, Limits, Profile, Report};

use crate::beside::Companion;
use crate::fsx::Identity;

/// One file to work on.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Request {
    pub task: Task,
    /// The file to map. In the daemon: the claimed file, under its own name.
    #[serde(with = "path_bytes")]
    pub input: PathBuf,
    /// Temporary name to write to; must not exist. `None` for an inspection.
    #[serde(with = "path_bytes::option")]
    pub output: Option<PathBuf>,
    /// Where to write the full report (with the edit's records, which may be as large as the mesh), synced. The report in
    /// [`Message::Done`] then leaves those records out.
    #[serde(with = "path_bytes::option")]
    pub report: Option<PathBuf>,
    /// A file to leave behind when the supervisor dies during this work: the work did not kill it.
    #[serde(with = "path_bytes::option")]
    pub witness: Option<PathBuf>,
    /// A file that exists while the supervisor reads the answer: for the supervisor alone.
    #[serde(skip)]
    pub mark: Option<PathBuf>,
    /// The input's name as people know it.
    pub shown_input: String,
    /// The output's name as people will know it.
    pub shown_output: Option<String>,
    pub profile: Profile,
    /// Files to read instead of what the profile names.
    pub companions: Vec<Companion>,
    pub limits: Limits,
}

/// What a worker says.
#[derive(Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Message {
    /// The request was understood; what happens from here on, the file may be to blame for.
    Begun,
    /// Where the work stands; at most ten a second.
    Progress { stage: String, done: u64, total: u64 },
    /// The work is done; the output, if any, is complete, synced and read back, and was `written` then.
    Done { report: Box<Report>, written: Option<Identity> },
    /// The work ended without output; `message` names the file.
    Failed { class: ErrorClass, message: String },
}

/// Paths are bytes on Unix. As text where they are UTF-8, else as a list of bytes, so that every name survives.
mod path_bytes {
    use std::ffi::{OsStr, OsString};
    use std::os::unix::ffi::{OsStrExt, OsStringExt};
    use std::path::{Path, PathBuf};

    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    #[derive(Serialize, Deserialize)]
    #[serde(untagged)]
    enum Raw {
        Text(String),
        Bytes(Vec<u8>),
    }

    fn raw(path: &Path) -> Raw {
        let name: &OsStr = path.as_os_str();
        name.to_str().map_or_else(|| Raw::Bytes(name.as_bytes().to_vec()), |text| Raw::Text(text.into()))
    }

    fn path(raw: Raw) -> PathBuf {
        match raw {
            Raw::Text(text) => text.into(),
            Raw::Bytes(bytes) => OsString::from_vec(bytes).into(),
        }
    }

    pub(super) fn serialize<S: Serializer>(p: &Path, s: S) -> Result<S::Ok, S::Error> {
        raw(p).serialize(s)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(d: D) -> Result<PathBuf, D::Error> {
        Raw::deserialize(d).map(path)
    }

    pub(super) mod option {
        use super::*;

        pub(crate) fn serialize<S: Serializer>(p: &Option<PathBuf>, s: S) -> Result<S::Ok, S::Error> {
            p.as_deref().map(raw).serialize(s)
        }

        pub(crate) fn deserialize<'de, D: Deserializer<'de>>(d: D) -> Result<Option<PathBuf>, D::Error> {
            Ok(Option::<Raw>::deserialize(d)?.map(path))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::ffi::OsString;
    use std::os::unix::ffi::OsStringExt;

    /// A name that is not UTF-8 reaches the worker as it is.
    #[test]
    fn every_name_survives() {
        let odd = PathBuf::from(OsString::from_vec(b"caf\xe9 \n.stl".to_vec()));
        let request = Request {
            task: Task::Repair,
            input: odd.clone(),
            output: Some(odd.clone()),
            report: None,
            witness: None,
            mark: None,
            shown_input: "x".into(),
            shown_output: None,
            profile: Profile::default(),
            companions: Vec::new(),
            limits: Limits::default(),
        };
        let line = serde_json::to_string(&request).unwrap();
        assert!(!line.contains('\n'));
        let back: Request = serde_json::from_str(&line).unwrap();
        assert_eq!(back.input, odd);
        assert_eq!(back.output, Some(odd));
        assert_eq!(back.report, None);
    }
}
