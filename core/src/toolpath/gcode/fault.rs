//! Faults of a block.

/// Why a block is not executed.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Fault {
    /// It is not understood: a finding, and the reader goes on with the next one.
    Syntax(String),
    /// It asks for something that is not done, or that has no value: the file is refused.
    Refused(String),
    /// The file as a whole ends here for a reason of its own.
    Stop(crate::toolpath::program::ReadError),
}

impl From<crate::toolpath::program::ReadError> for Fault {
    fn from(error: crate::toolpath::program::ReadError) -> Self {
        Self::Stop(error)
    }
}

pub(super) fn syntax<T>(text: impl Into<String>) -> Result<T, Fault> {
    Err(Fault::Syntax(text.into()))
}

pub(super) fn refused<T>(text: impl Into<String>) -> Result<T, Fault> {
    Err(Fault::Refused(text.into()))
}
