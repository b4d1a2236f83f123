//! The verdict: what counts of defects say about a file.

use crate::contract::report::{Defects, RuleOutcome, Verdict};
use crate::contract::settings::Guarantee;
use crate::detect::rules::{self, Aspect, Found, Subject};

/// What was not looked at is called unchecked, never assumed.
const SELF_INTERSECTION: &str = "self-intersection";

/// Judges a file by the defects counted on its bytes and by what is wrong with the file itself. All of it follows from the rules, as its
/// certificate does.
pub(crate) fn judge(defects: &Defects, flaws: &[String]) -> Verdict {
    let subject = Subject { defects, flaws };
    let found = rules::look(&subject);
    let outcomes = |aspect| found.iter().filter(move |found| found.rule.aspect == aspect).map(Found::outcome);
    let [closed, manifold, oriented] =
        [Aspect::Closed, Aspect::Manifold, Aspect::Oriented].map(|aspect| outcomes(aspect).all(|o| o == RuleOutcome::Passed));
    let is_unchecked = outcomes(Aspect::FreeOfSelfIntersection).any(|o| o == RuleOutcome::Unchecked);
    let free = (!is_unchecked).then(|| outcomes(Aspect::FreeOfSelfIntersection).all(|o| o == RuleOutcome::Passed));
    let words: Vec<&str> = [
        (closed, "closed", "open"),
        (manifold, "manifold", "not manifold"),
        (oriented, "oriented", "not oriented"),
        (free == Some(true), "free of self-intersection", "self-intersecting"),
    ]
    .iter()
    .take(if free.is_some() { 4 } else { 3 })
    .map(|(holds, yes, no)| if *holds { *yes } else { *no })
    .collect();
    let unchecked: Vec<String> = is_unchecked.then(|| SELF_INTERSECTION.into()).into_iter().collect();
    let rest: String = unchecked.iter().map(|what| format!("; {what} unchecked")).collect();
    Verdict {
        good: found.iter().all(|found| found.outcome() != RuleOutcome::Failed),
        statement: words.join(", ") + &rest,
        closed,
        manifold,
        oriented,
        free_of_self_intersection: free,
        reasons: found.iter().flat_map(|found| found.reasons(&subject)).collect(),
        unchecked,
    }
}

impl Verdict {
    /// The same, strictly: what was not checked is not good.
    pub(crate) fn under(mut self, guarantee: Guarantee) -> Self {
        if guarantee == Guarantee::Strict && self.good && !self.unchecked.is_empty() {
            self.good = false;
            self.reasons.push(format!("{} unchecked", self.unchecked.join(", ")));
        }
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contract::report::SelfIntersections;

    /// The counts of a unit cube.
    fn cube() -> Defects {
        let self_intersections = Some(SelfIntersections::default());
        Defects {
            triangles: 12,
            bodies: 1,
            volume: 1.0,
            bounds: Some([[0.0; 3], [1.0; 3]]),
            self_intersections,
            ..Defects::default()
        }
    }

    #[test]
    fn a_cube_is_good_and_free_of_self_intersection() {
        let verdict = judge(&cube(), &[]);
        assert!(verdict.good && verdict.reasons.is_empty() && verdict.unchecked.is_empty());
        assert_eq!(verdict.statement, "closed, manifold, oriented, free of self-intersection");
        assert_eq!(verdict.free_of_self_intersection, Some(true));
    }

    #[test]
    fn what_was_not_looked_at_is_called_unchecked() {
        let verdict = judge(&Defects { self_intersections: None, ..cube() }, &[]);
        assert!(verdict.good && verdict.reasons.is_empty());
        assert_eq!(verdict.statement, "closed, manifold, oriented; self-intersection unchecked");
        assert_eq!((verdict.free_of_self_intersection, verdict.unchecked), (None, vec!["self-intersection".to_string()]));
    }

    #[test]
    fn each_defect_alone_is_a_reason_and_the_only_one() {
        type Break = fn(&mut Defects);
        let cases: [(Break, &str); 16] = [
            (|d| d.nonfinite = 1, "NaN"),
            (|d| d.degenerate_index = 1, "repeated vertex"),
            (|d| d.degenerate_area = 1, "no area"),
            (|d| d.duplicates_same = 1, "duplicate"),
            (|d| d.duplicates_opposite = 1, "back to back"),
            (|d| d.boundary_edges = 1, "1 boundary edge"),
            (|d| d.nonmanifold_edges = 1, "1 non-manifold edge"),
            (|d| d.nonmanifold_vertices = 1, "1 non-manifold vertex"),
            (|d| d.inconsistent_edges = 1, "1 edge whose triangles face opposite ways"),
            (|d| d.unbalanced_edges = 1, "both directions"),
            (|d| d.inverted_components = 1, "1 component inside out"),
            (|d| d.self_intersections = Some(SelfIntersections { triangles: 2, ..Default::default() }), "self-intersecting"),
            (|d| d.self_intersections = Some(SelfIntersections { given_up: true, ..Default::default() }), "pair by pair"),
            (|d| d.volume = 0.0, "volume is not positive"),
            (|d| d.volume = -1.0, "volume is not positive"),
            (|d| *d = Defects::default(), "no triangle"),
        ];
        for (damage, words) in cases {
            let mut defects = cube();
            damage(&mut defects);
            let verdict = judge(&defects, &[]);
            assert!(!verdict.good, "{words}");
            assert!(verdict.reasons.len() == 1 && verdict.reasons[0].contains(words), "{words}: {:?}", verdict.reasons);
        }
        let verdict = judge(&cube(), &["cut short".into()]);
        assert!(!verdict.good && verdict.closed && verdict.reasons == ["cut short"], "what is wrong with the file itself counts");
    }
}
