//! What a result must keep of what was there to be called faithful: one table of rules, from which both the review and the certificate are made,
//! so that they cannot disagree.
//!
//! A rule measures one figure, and the profile says how large it may be. Its version is raised when it measures anything else for any file.
//! `core/REPORT.md` has the same table for readers; a test holds the two together.

use crate::contract::report::{Faithful, Fidelity, RuleOutcome};

/// One rule of the second half of a certificate.
pub struct FidelityRule {
    /// Its name, which stays.
    pub id: &'static str,
    /// Raised when it measures anything else for any file.
    pub version: u32,
    /// The quantity that it measures, in one sentence.
    pub measures: &'static str,
}

/// All rules, in the order in which reasons are given.
pub const FIDELITY_RULES: [FidelityRule; 15] = [
    FidelityRule {
        id: "volume",
        version: 1,
        measures: "Change of the volume, less what counted twice, as a share of what was meant.",
    },
    FidelityRule {
        id: "swallowed",
        version: 1,
        measures: "Volume of bodies that lay wholly in the material of others and are gone, as a share of the result's.",
    },
    FidelityRule {
        id: "area",
        version: 1,
        measures: "Change of the area, less patches that nothing speaks against, as a share of what there was.",
    },
    FidelityRule { id: "box", version: 1, measures: "Largest move of a side of the bounding box, as a share of its diagonal." },
    FidelityRule { id: "bodies", version: 1, measures: "Bodies that are gone, but for those in the material of others." },
    FidelityRule { id: "guesses", version: 1, measures: "Guesses that may be wrong." },
    FidelityRule { id: "bodies_outside", version: 1, measures: "Bodies no point of which is in the result." },
    FidelityRule {
        id: "volume_outside",
        version: 1,
        measures: "Volume that bodies enclosed and the result does not, as a share, by points in each body.",
    },
    FidelityRule {
        id: "cavities_filled",
        version: 1,
        measures: "Volume of cavities all of which is material now, as a share of the result's, by points in each cavity.",
    },
    FidelityRule {
        id: "skin_lost",
        version: 1,
        measures: "Area that could be seen and is farther than the reach from the result, as a share of all that could be seen.",
    },
    FidelityRule {
        id: "skin_invented",
        version: 1,
        measures: "Area that can be seen and is farther than the reach from all that was there, less plausible patches, as a share of all that could be seen.",
    },
    FidelityRule {
        id: "sheets",
        version: 1,
        measures: "Area of open sheets that were dropped, but for those in material, as a share.",
    },
    FidelityRule {
        id: "free_sheets",
        version: 1,
        measures: "Area of those of them that cross nothing and could be seen, as a share.",
    },
    FidelityRule { id: "wrapped", version: 1, measures: "Area that wraps have replaced, as a share." },
    FidelityRule { id: "missing", version: 1, measures: "Parts that the file itself has lost." },
];

/// The measurement of a rule.
#[derive(Debug)]
pub(crate) struct Measured {
    pub(crate) rule: &'static str,
    /// `None`: there was nothing to compare with.
    pub(crate) figure: Option<f64>,
    pub(crate) limit: f64,
    /// Each a line for people, if the figure is beyond the limit.
    pub(crate) words: Vec<String>,
}

impl Measured {
    fn outcome(&self) -> RuleOutcome {
        match self.figure {
            None => RuleOutcome::Unchecked,
            Some(figure) if figure > self.limit => RuleOutcome::Failed,
            Some(_) => RuleOutcome::Passed,
        }
    }

    /// How much of the model it is about: nearly all rules measure a share. A part that the file itself lacks comes before all, a wrap before what it
    /// explains; bodies stand among the larger shares, guesses behind all.
    fn weight(&self) -> f64 {
        match (self.rule, self.figure) {
            (_, None) | ("guesses", _) => 0.0,
            ("missing", _) => 3.0,
            ("wrapped", Some(share)) => 1.0 + share,
            ("bodies" | "bodies_outside", _) => 0.25,
            (_, Some(share)) => share.min(1.0),
        }
    }

    /// Why a person must look; none within the limit.
    pub(crate) fn concerns(self) -> Vec<String> {
        if self.outcome() == RuleOutcome::Failed { self.words } else { Vec::new() }
    }
}

/// Why a person must look, the chief reason first. If there is any, `beside` is told as well, in the place of its share.
pub(crate) fn concerns(all: Vec<Measured>, beside: Option<(f64, String)>) -> Vec<String> {
    let weighed = |measured: Measured| (measured.weight(), measured.concerns());
    let mut all: Vec<_> = all.into_iter().map(weighed).filter(|(_, lines)| !lines.is_empty()).collect();
    if !all.is_empty() {
        all.extend(beside.map(|(share, line)| (share, vec![line])));
    }
    all.sort_by(|(a, _), (b, _)| b.total_cmp(a));
    all.into_iter().flat_map(|(_, lines)| lines).collect()
}

/// The second half of the certificate of what was made of a file with this hash and length.
pub(crate) fn certify((original, bytes): (&str, u64), measured: &[Measured]) -> Faithful {
    let version = |id: &str| FIDELITY_RULES.iter().find(|rule| rule.id == id).map_or(0, |rule| rule.version);
    let rules: Vec<Fidelity> = measured
        .iter()
        .map(|m| Fidelity {
            rule: m.rule.into(),
            version: version(m.rule),
            outcome: m.outcome(),
            // A sum of nothing is −0.
            figure: m.figure.filter(|figure| figure.is_finite()).map(|figure| figure + 0.0),
            limit: m.limit,
        })
        .collect();
    let failed = rules.iter().filter(|rule| rule.outcome == RuleOutcome::Failed).map(|rule| rule.rule.clone()).collect();
    Faithful { original: original.into(), bytes, failed, rules }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The table that readers see is this one, rule by rule.
    #[test]
    fn the_documents_have_the_same_table() {
        let rows = FIDELITY_RULES.map(|rule| format!("| `{}` | {} | {} |", rule.id, rule.version, rule.measures));
        let table = format!("| rule | version | what it measures |\n|---|---|---|\n{}\n\n", rows.join("\n"));
        assert!(include_str!("../../REPORT.md").contains(&table), "core/REPORT.md should have:\n{table}");
    }

    /// The larger share first, whatever the table's order; a part that is missing before all, guesses behind all.
    #[test]
    fn the_chief_reason_comes_first() {
        let of = |rule: &'static str, figure: f64| Measured { rule, figure: Some(figure), limit: 0.0, words: vec![rule.into()] };
        let all = [
            ("guesses", 9.0),
            ("skin_lost", 0.006),
            ("bodies_outside", 144.0),
            ("skin_invented", 0.75),
            ("wrapped", 0.1),
            ("missing", 1.0),
        ];
        let told = concerns(all.map(|(rule, figure)| of(rule, figure)).into(), Some((0.3, "openings".into())));
        assert_eq!(told, ["missing", "wrapped", "skin_invented", "openings", "bodies_outside", "skin_lost", "guesses"]);
        assert!(concerns(Vec::new(), Some((0.3, "openings".into()))).is_empty(), "it is no reason by itself");
    }

    #[test]
    fn a_figure_at_its_limit_passes_and_none_is_unchecked() {
        let of = |figure: Option<f64>| {
            let measured = Measured { rule: "volume", figure, limit: 0.5, words: vec!["too much".into()] };
            let certificate = certify(("ab", 684), std::slice::from_ref(&measured));
            (certificate.rules[0].outcome, certificate.failed.len(), measured.concerns().len())
        };
        assert_eq!(of(Some(0.5)), (RuleOutcome::Passed, 0, 0));
        assert_eq!(of(Some(0.6)), (RuleOutcome::Failed, 1, 1));
        assert_eq!(of(None), (RuleOutcome::Unchecked, 0, 0));
    }
}
