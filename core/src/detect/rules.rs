//! What a file must pass to be called printable: one table of rules, from which both the verdict and the certificate are made, so that they
//! cannot disagree.
//!
//! A rule counts what violates it; it is passed when there is nothing. Its version is raised when what it counts changes for any file, so that an old
//! certificate does not speak for a new rule. `core/REPORT.md` has the same table for readers; a test holds the two together.

use crate::contract::report::{Defects, RuleOutcome, RuleResult};
use crate::util::words::{Count, Counted};

/// What the rules look at: counts on the bytes of a file, and what is wrong with the file itself.
pub(crate) struct Subject<'a> {
    pub(crate) defects: &'a Defects,
    pub(crate) flaws: &'a [String],
}

impl Subject<'_> {
    fn has_surface(&self) -> bool {
        self.defects.triangles > self.defects.degenerate_index
    }

    /// No surface that has a rim, or two sides that do not agree, encloses anything.
    fn is_shell(&self) -> bool {
        let d = self.defects;
        self.has_surface() && d.boundary_edges + d.inconsistent_edges + d.unbalanced_edges == 0
    }
}

/// The word of the verdict that a rule belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Aspect {
    Closed,
    Manifold,
    Oriented,
    FreeOfSelfIntersection,
    /// None of them.
    Other,
}

/// The finding of a rule.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Finding {
    Count(u64),
    /// There was too much to look at: not passed, and no count.
    GivenUp,
    NotLookedFor,
}

/// How a violation is told to people.
enum Words {
    /// After its count: of one, and of several.
    Counted(&'static str, &'static str),
    /// In words of its own; in none where others have said so already.
    Own(fn(&Subject<'_>) -> Vec<String>),
}

/// One rule of a certificate.
pub struct Rule {
    /// Its name, which stays.
    pub id: &'static str,
    /// Raised when it counts anything else for any file.
    pub version: u32,
    /// The defect that it counts, in one sentence.
    pub counts: &'static str,
    pub(crate) aspect: Aspect,
    find: fn(&Subject<'_>) -> Finding,
    words: Words,
}

/// All rules, in the order in which reasons are given.
pub const RULES: [Rule; 15] = [
    Rule {
        id: "file",
        version: 1,
        counts: "Flaws of the file itself, such as an end that is cut off.",
        aspect: Aspect::Other,
        find: |s| Finding::Count(s.flaws.len() as u64),
        words: Words::Own(|s| s.flaws.to_vec()),
    },
    Rule {
        id: "finite",
        version: 1,
        counts: "Triangles with a NaN or infinite coordinate.",
        aspect: Aspect::Other,
        find: |s| Finding::Count(s.defects.nonfinite),
        words: Words::Counted("triangle with NaN or infinite coordinates", "triangles with NaN or infinite coordinates"),
    },
    Rule {
        id: "distinct_corners",
        version: 1,
        counts: "Triangles with two or three equal corners.",
        aspect: Aspect::Other,
        find: |s| Finding::Count(s.defects.degenerate_index),
        words: Words::Counted("triangle with a repeated vertex", "triangles with a repeated vertex"),
    },
    Rule {
        id: "area",
        version: 1,
        counts: "Triangles of three distinct corners exactly on one line.",
        aspect: Aspect::Other,
        find: |s| Finding::Count(s.defects.degenerate_area),
        words: Words::Counted("triangle of no area", "triangles of no area"),
    },
    Rule {
        id: "duplicates",
        version: 1,
        counts: "Triangles on the three vertices, and in the direction, of an earlier one.",
        aspect: Aspect::Other,
        find: |s| Finding::Count(s.defects.duplicates_same),
        words: Words::Counted("duplicate triangle", "duplicate triangles"),
    },
    Rule {
        id: "back_to_back",
        version: 1,
        counts: "Triangles on the three vertices of earlier ones, none of which runs in their direction.",
        aspect: Aspect::Other,
        find: |s| Finding::Count(s.defects.duplicates_opposite),
        words: Words::Counted("pair of triangles back to back", "pairs of triangles back to back"),
    },
    Rule {
        id: "closed",
        version: 1,
        counts: "Edges of one triangle.",
        aspect: Aspect::Closed,
        find: |s| Finding::Count(s.defects.boundary_edges),
        words: Words::Counted("boundary edge", "boundary edges"),
    },
    Rule {
        id: "manifold_edges",
        version: 1,
        counts: "Edges of three or more triangles.",
        aspect: Aspect::Manifold,
        find: |s| Finding::Count(s.defects.nonmanifold_edges),
        words: Words::Counted("non-manifold edge", "non-manifold edges"),
    },
    Rule {
        id: "manifold_vertices",
        version: 1,
        counts: "Vertices whose triangles do not form one fan, and ends of non-manifold edges.",
        aspect: Aspect::Manifold,
        find: |s| Finding::Count(s.defects.nonmanifold_vertices),
        words: Words::Counted("non-manifold vertex", "non-manifold vertices"),
    },
    Rule {
        id: "coherent",
        version: 1,
        counts: "Edges that both of their triangles run through in the same direction.",
        aspect: Aspect::Oriented,
        find: |s| Finding::Count(s.defects.inconsistent_edges),
        words: Words::Counted("edge whose triangles face opposite ways", "edges whose triangles face opposite ways"),
    },
    Rule {
        id: "balanced",
        version: 1,
        counts: "Edges not used equally often in both directions, boundary edges among them.",
        aspect: Aspect::Oriented,
        find: |s| Finding::Count(s.defects.unbalanced_edges),
        words: Words::Own(|s| match s.defects {
            d if d.boundary_edges + d.inconsistent_edges > 0 => Vec::new(),
            d => {
                let what = Counted(d.unbalanced_edges, "edge", "edges");
                vec![format!("{what} that triangles do not use equally often in both directions")]
            }
        }),
    },
    Rule {
        id: "outward",
        version: 1,
        counts: "Closed components of negative volume inside no body: inside out.",
        aspect: Aspect::Other,
        find: |s| Finding::Count(s.defects.inverted_components),
        words: Words::Counted("component inside out", "components inside out"),
    },
    Rule {
        id: "self_intersection",
        version: 1,
        counts: "Triangles that meet another one in more than they share and in more than a touch.",
        aspect: Aspect::FreeOfSelfIntersection,
        find: |s| match &s.defects.self_intersections {
            None => Finding::NotLookedFor,
            Some(found) if found.given_up => Finding::GivenUp,
            Some(found) => Finding::Count(found.triangles),
        },
        words: Words::Own(|s| {
            let Some(found) = &s.defects.self_intersections else { return Vec::new() };
            vec![if found.given_up {
                "too many triangles come close to each other to be compared pair by pair".into()
            } else {
                let [crossing, overlapping] = [found.crossing_pairs, found.overlapping_pairs].map(Count);
                let triangles = Counted(found.triangles, "self-intersecting triangle", "self-intersecting triangles");
                format!("{triangles} ({crossing} crossing and {overlapping} overlapping pairs)")
            }]
        }),
    },
    Rule {
        id: "surface",
        version: 1,
        counts: "1 if no triangle has three distinct vertices, else 0.",
        aspect: Aspect::Closed,
        find: |s| Finding::Count(u64::from(!s.has_surface())),
        words: Words::Own(|_| vec!["no triangle with three distinct vertices".into()]),
    },
    Rule {
        id: "positive_volume",
        version: 1,
        counts: "1 if the surface is not closed and oriented around a positive volume, all bodies less their cavities, else 0.",
        aspect: Aspect::Other,
        find: |s| Finding::Count(u64::from(!(s.is_shell() && s.defects.volume > 0.0))),
        // Of what is no shell, its rules have said so.
        words: Words::Own(|s| s.is_shell().then(|| "the enclosed volume is not positive".into()).into_iter().collect()),
    },
];

/// A rule, and what it has found in a file.
pub(crate) struct Found {
    pub(crate) rule: &'static Rule,
    finding: Finding,
}

/// The findings of all rules.
pub(crate) fn look(subject: &Subject<'_>) -> Vec<Found> {
    RULES.iter().map(|rule| Found { rule, finding: (rule.find)(subject) }).collect()
}

impl Found {
    pub(crate) fn outcome(&self) -> RuleOutcome {
        match self.finding {
            Finding::Count(0) => RuleOutcome::Passed,
            Finding::Count(_) | Finding::GivenUp => RuleOutcome::Failed,
            Finding::NotLookedFor => RuleOutcome::Unchecked,
        }
    }

    /// As it stands in a certificate.
    pub(crate) fn result(&self) -> RuleResult {
        let count = match self.finding {
            Finding::Count(count) => Some(count),
            Finding::GivenUp | Finding::NotLookedFor => None,
        };
        RuleResult { rule: self.rule.id.into(), version: self.rule.version, outcome: self.outcome(), count }
    }

    /// Why the file fails, in words; none if it does not fail, or others say why.
    pub(crate) fn reasons(&self, subject: &Subject<'_>) -> Vec<String> {
        match (&self.rule.words, self.finding) {
            (_, Finding::Count(0) | Finding::NotLookedFor) => Vec::new(),
            (Words::Counted(one, many), Finding::Count(count)) => vec![Counted(count, one, many).to_string()],
            (Words::Counted(_, many), Finding::GivenUp) => vec![format!("too many {many} to count")],
            (Words::Own(say), _) => say(subject),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The table that readers see is this one, rule by rule.
    #[test]
    fn the_documents_have_the_same_table() {
        let rows = RULES.map(|rule| format!("| `{}` | {} | {} |", rule.id, rule.version, rule.counts));
        let table = format!("| rule | version | what it counts |\n|---|---|---|\n{}\n\n", rows.join("\n"));
        assert!(include_str!("../../REPORT.md").contains(&table), "core/REPORT.md should have:\n{table}");
    }

    #[test]
    fn every_rule_has_a_name_of_its_own() {
        let mut ids = RULES.map(|rule| rule.id);
        ids.sort_unstable();
        assert!(ids.windows(2).all(|pair| pair[0] != pair[1]));
    }
}
