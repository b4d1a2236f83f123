//! What is said of a file: its verdict, and the certificate that lists every rule.

use serde::{Deserialize, Serialize};

/// What a file is, judged on its bytes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Verdict {
    /// Everything that this version checks holds.
    pub good: bool,
    /// One line for people, e.g. `closed, manifold, oriented, free of self-intersection`.
    pub statement: String,
    /// No edge has one triangle only.
    pub closed: bool,
    /// No edge has more than two triangles, and no vertex more than one fan.
    pub manifold: bool,
    /// Neighbours agree on their directions, and bodies enclose what is inside of them.
    pub oriented: bool,
    /// `None` when it was not checked.
    #[serde(default)]
    pub free_of_self_intersection: Option<bool>,
    /// Why it is not good, or why it needs review.
    pub reasons: Vec<String>,
    /// Names of rules that were not checked.
    pub unchecked: Vec<String>,
}

/// What every rule found in the bytes of one file. The rules are listed in `core/REPORT.md`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Certificate {
    /// Every rule was looked at, and passed.
    pub printable: bool,
    /// BLAKE3 of the whole file, hexadecimal.
    pub blake3: String,
    /// Length of the file.
    pub bytes: u64,
    /// Triangle records in the file.
    pub triangles: u64,
    /// Names of the rules that were not passed, or not looked at.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub missing: Vec<String>,
    /// Every rule, in the order of the table.
    pub rules: Vec<RuleResult>,
    /// Whether it is what was meant, of the result of a repair; `None` where nothing was changed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub faithful: Option<Faithful>,
}

/// What every rule of fidelity measured between a file and what a repair made of it. The rules are listed in `core/REPORT.md`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Faithful {
    /// BLAKE3 of the file that was repaired, hexadecimal.
    pub original: String,
    /// Length of that file.
    pub bytes: u64,
    /// Names of the rules whose figure is beyond the profile's limit: a person must look. Absent if there is none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub failed: Vec<String>,
    /// Every rule, in the order of the table.
    pub rules: Vec<Fidelity>,
}

/// The measurement of one rule of fidelity.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Fidelity {
    /// Its name.
    pub rule: String,
    /// Raised when the rule measures anything else.
    pub version: u32,
    /// Whether the figure is within the limit.
    pub outcome: RuleOutcome,
    /// A share or a count, as the rule says; `None`: there was nothing to compare with.
    pub figure: Option<f64>,
    /// The largest figure that needs no person, of the profile.
    pub limit: f64,
}

/// The finding of one rule.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct RuleResult {
    /// Its name.
    pub rule: String,
    /// Raised when the rule counts anything else.
    pub version: u32,
    /// Whether the file passes.
    pub outcome: RuleOutcome,
    /// What violates it; `None`: not looked at, or more than could be looked at.
    pub count: Option<u64>,
}

/// Whether a file passes a rule.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RuleOutcome {
    /// Nothing violates it.
    Passed,
    /// Something violates it.
    Failed,
    /// It was not looked at.
    Unchecked,
}
