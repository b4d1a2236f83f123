//! The certificate of a file: which bytes were looked at, and what every rule found in them.
//!
//! It tells files that were changed or mixed up since; it is no signature, anyone can write one. What it says is made anew from a file's bytes and
//! compared.

use crate::contract::report::{Certificate, Faithful, Fidelity, FileFacts, RuleOutcome, RuleResult};
use crate::detect::rules::{self, Subject};
use crate::util::words::Count;

/// Of the file of these `facts`, whose bytes the counts of `subject` are of.
pub(crate) fn certify(facts: &FileFacts, subject: &Subject<'_>) -> Certificate {
    let rules: Vec<RuleResult> = rules::look(subject).iter().map(rules::Found::result).collect();
    let missing: Vec<String> =
        rules.iter().filter(|result| result.outcome != RuleOutcome::Passed).map(|result| result.rule.clone()).collect();
    Certificate {
        printable: missing.is_empty(),
        blake3: facts.blake3.clone(),
        bytes: facts.bytes,
        triangles: facts.triangles,
        missing,
        rules,
        faithful: None,
    }
}

impl RuleOutcome {
    /// For people.
    pub fn word(self) -> &'static str {
        match self {
            Self::Passed => "passed",
            Self::Failed => "failed",
            Self::Unchecked => "unchecked",
        }
    }
}

impl Certificate {
    /// Was self-intersection looked for? Whoever makes the certificate anew has to do the same.
    pub fn covers_self_intersection(&self) -> bool {
        self.rules.iter().any(|result| result.rule == "self_intersection" && result.outcome != RuleOutcome::Unchecked)
    }

    /// What of this certificate is not so in `found`, which was made of a file just now; in words, empty if it holds. Of other bytes, only that
    /// they are others.
    pub fn contradictions(&self, found: &Self) -> Vec<String> {
        if (&self.blake3, self.bytes) != (&found.blake3, found.bytes) {
            return vec![format!(
                "these are not the bytes that it is of ({} bytes with BLAKE3 {}, not {} with {})",
                Count(found.bytes),
                found.blake3,
                Count(self.bytes),
                self.blake3
            )];
        }
        let mut all = Vec::new();
        if self.triangles != found.triangles {
            all.push(format!("{} triangles, not {}", Count(found.triangles), Count(self.triangles)));
        }
        for now in &found.rules {
            match self.rules.iter().find(|then| then.rule == now.rule) {
                None => all.push(format!("it knows no rule `{}`", now.rule)),
                Some(then) if then.version != now.version => {
                    all.push(format!(
                        "it is of version {} of the rule `{}`, which is at {} now",
                        then.version, now.rule, now.version
                    ));
                }
                Some(then) if then != now => all.push(format!("`{}`: {}, not {}", now.rule, told(now), told(then))),
                Some(_) => {}
            }
        }
        let unknown = self.rules.iter().filter(|then| found.rules.iter().all(|now| now.rule != then.rule));
        all.extend(unknown.map(|then| format!("there is no rule `{}` in this version", then.rule)));
        if all.is_empty() && (self.printable, &self.missing) != (found.printable, &found.missing) {
            all.push("what it sums up does not follow from its rules".into());
        }
        if let Some(now) = &found.faithful {
            all.extend(unfaithful(self.faithful.as_ref(), now));
        }
        all
    }
}

/// What of the second half is not so in the one that a repair has just made.
fn unfaithful(then: Option<&Faithful>, now: &Faithful) -> Vec<String> {
    let Some(then) = then else { return vec!["it does not say whether the file is faithful".into()] };
    if (&then.original, then.bytes) != (&now.original, now.bytes) {
        return vec![format!("it is of a file that was made of {} bytes with BLAKE3 {}", Count(then.bytes), then.original)];
    }
    let of = |rule: &Fidelity| then.rules.iter().find(|then| then.rule == rule.rule);
    let differs = now.rules.iter().filter(|rule| of(rule) != Some(rule)).map(|rule| match of(rule) {
        None => format!("it knows no rule `{}`", rule.rule),
        Some(then) if then.version != rule.version => {
            format!("it is of version {} of the rule `{}`, which is at {} now", then.version, rule.rule, rule.version)
        }
        Some(then) => format!("`{}`: {}, not {}", rule.rule, measured(rule), measured(then)),
    });
    let mut all: Vec<String> = differs.collect();
    if all.is_empty() && then != now {
        all.push("what it sums up of fidelity does not follow from its rules".into());
    }
    all
}

fn measured(rule: &Fidelity) -> String {
    let figure = rule.figure.map_or("nothing".into(), |figure| figure.to_string());
    format!("{} with {figure} of {}", rule.outcome.word(), rule.limit)
}

fn told(result: &RuleResult) -> String {
    let word = result.outcome.word();
    result.count.map_or_else(|| word.into(), |count| format!("{word} with {}", Count(count)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contract::report::{Defects, Format, SelfIntersections};
    use crate::detect::rules::RULES;
    use crate::detect::verdict::judge;

    fn facts() -> FileFacts {
        FileFacts {
            path: "cube.stl".into(),
            bytes: 684,
            blake3: "ab".into(),
            format: Format::BinaryStl,
            unit: None,
            triangles: 12,
            findings: Vec::new(),
        }
    }

    fn cube() -> Defects {
        let self_intersections = Some(SelfIntersections::default());
        Defects { triangles: 12, bodies: 1, volume: 1.0, self_intersections, ..Defects::default() }
    }

    fn of(defects: &Defects) -> Certificate {
        certify(&facts(), &Subject { defects, flaws: &[] })
    }

    #[test]
    fn a_cube_passes_every_rule() {
        let certificate = of(&cube());
        assert!(certificate.printable && certificate.missing.is_empty(), "{:?}", certificate.missing);
        assert_eq!((certificate.rules.len(), certificate.bytes, certificate.triangles), (RULES.len(), 684, 12));
        assert!(certificate.rules.iter().all(|result| result.count == Some(0)));
        assert!(certificate.contradictions(&certificate).is_empty());
    }

    /// The verdict may be good without a search; the certificate says what is missing.
    #[test]
    fn what_was_not_looked_at_is_not_certified() {
        let unchecked = Defects { self_intersections: None, ..cube() };
        let certificate = of(&unchecked);
        assert!(judge(&unchecked, &[]).good && !certificate.printable && !certificate.covers_self_intersection());
        assert_eq!(certificate.missing, ["self_intersection"]);
        assert_eq!(of(&cube()).contradictions(&certificate), ["`self_intersection`: unchecked, not passed with 0"]);
        let given_up = SelfIntersections { given_up: true, ..Default::default() };
        let certificate = of(&Defects { self_intersections: Some(given_up), ..cube() });
        assert_eq!(certificate.missing, ["self_intersection"]);
        assert!(certificate.covers_self_intersection());
    }

    #[test]
    fn a_certificate_does_not_speak_for_anything_else() {
        let certificate = of(&cube());
        let contradicted = |change: fn(&mut Certificate), words: &str| {
            let mut other = certificate.clone();
            change(&mut other);
            let all = other.contradictions(&certificate);
            assert!(all.len() == 1 && all[0].contains(words), "{words}: {all:?}");
        };
        contradicted(|c| c.blake3 = "cd".into(), "not the bytes");
        contradicted(|c| c.bytes = 683, "not the bytes");
        contradicted(|c| c.triangles = 13, "12 triangles, not 13");
        contradicted(|c| c.rules[6].version = 0, "of version 0 of the rule `closed`, which is at 1 now");
        contradicted(|c| c.rules[6].count = Some(1), "`closed`: passed with 0, not passed with 1");
        contradicted(|c| drop(c.rules.pop()), "it knows no rule `positive_volume`");
        contradicted(|c| c.rules.push(RuleResult { rule: "odd".into(), ..c.rules[0].clone() }), "no rule `odd`");
        contradicted(|c| c.printable = false, "does not follow");
    }

    #[test]
    fn the_second_half_is_held_against_a_repair_made_anew() {
        let rule =
            Fidelity { rule: "skin_lost".into(), version: 1, outcome: RuleOutcome::Passed, figure: Some(0.25), limit: 0.5 };
        let half = Faithful { original: "cd".into(), bytes: 1000, failed: Vec::new(), rules: vec![rule] };
        let now = Certificate { faithful: Some(half), ..of(&cube()) };
        assert!(now.contradictions(&now).is_empty());
        // An inspection does not know the original, and says nothing of it.
        assert!(now.contradictions(&of(&cube())).is_empty());
        assert_eq!(of(&cube()).contradictions(&now), ["it does not say whether the file is faithful"]);
        let contradicted = |change: fn(&mut Faithful), words: &str| {
            let mut other = now.clone();
            other.faithful.iter_mut().for_each(change);
            let all = other.contradictions(&now);
            assert!(all.len() == 1 && all[0].contains(words), "{words}: {all:?}");
        };
        contradicted(|half| half.original = "ef".into(), "made of 1 000 bytes with BLAKE3 ef");
        contradicted(
            |half| half.rules[0].figure = Some(0.125),
            "`skin_lost`: passed with 0.25 of 0.5, not passed with 0.125 of 0.5",
        );
        contradicted(|half| half.rules[0].version = 0, "version 0 of the rule `skin_lost`, which is at 1 now");
        contradicted(|half| half.rules.clear(), "no rule `skin_lost`");
        contradicted(|half| half.failed = vec!["skin_lost".into()], "does not follow");
    }
}
