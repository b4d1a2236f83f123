//! Detect: what is wrong, told from the survey and the submesh; and what that says about the file.

pub(crate) mod bodies;
pub(crate) mod certificate;
pub(crate) mod defects;
pub(crate) mod difference;
pub(crate) mod fresh;
pub(crate) mod holes;
pub(crate) mod rules;
pub(crate) mod verdict;
