//! For a result whose name in `out/` is taken: `on_taken` of a hot folder.

use serde::Deserialize;

/// The file that has the name stays in any case.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum OnTaken {
    /// The result gets the next name: `part~2.stl`.
    #[default]
    Version,
    /// The file is not repaired; it goes to `failed/`, and a person sees to it.
    Fail,
    /// The file is not repaired, and counts as done.
    Skip,
}

impl OnTaken {
    /// As it is written.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Version => "version",
            Self::Fail => "fail",
            Self::Skip => "skip",
        }
    }
}
