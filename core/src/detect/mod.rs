//! Detection: what is wrong, told from the survey and the submesh; and what that says about the file.
//!
//! **In:** a survey and a submesh.
//! **Out:** counts of defects ([`defects`]), bodies and what lies in what ([`bodies`]), boundary loops by class ([`holes`]); the rules of a
//! printable file, and what they say of this one ([`rules`], [`verdict`], [`certificate`]); what became of the surface that can be
//! seen ([`skin`]); the rules of a faithful result, and what a person should look at ([`fidelity`], [`review`]); what a person may want to
//! know of a good file, too ([`hints`], [`walls`]).
//! **Promise:** nothing is changed. What was not looked at is called unchecked, and is never certified. Verdict and certificate come from
//! one table.

pub(crate) mod bodies;
pub(crate) mod certificate;
pub(crate) mod coned_volume;
pub(crate) mod defects;
pub(crate) mod difference;
pub(crate) mod fidelity;
pub(crate) mod fresh;
pub(crate) mod hints;
pub(crate) mod holes;
pub(crate) mod review;
pub(crate) mod rules;
pub(crate) mod skin;
pub(crate) mod verdict;
pub(crate) mod walls;
