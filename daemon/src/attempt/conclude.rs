//! The way on from the end of an attempt: the intent to publish, a second attempt to compare with, or another step of the job.

use std::path::Path;

use suture_core::Report;
use suture_core::report::Outcome;
use suture_store::patience::brief;
use suture_store::{Claim, Ending, Job, State, Step, Witness};

use super::Slot;
use super::worked::{Onward, Worked};
use crate::beside;
use crate::event::Happening;
use crate::folder::Folder;
use crate::force::is_forced;
use crate::fsx::Identity;
use crate::publish::{Conclusion, Desk, OUTPUT};
use crate::publish_error::PublishError;
use crate::reuse::recipe_of;
use crate::sample::{self as samples, Compared, Second};
use crate::shared::daemon_name;

impl Slot {
    /// Makes the intent durable of what was made, or says what comes instead. `ctime_ns`: last change of the original's inode.
    pub(super) fn conclude(
        &self,
        folder: &Folder,
        claim: &Claim,
        job: &Job,
        ctime_ns: i64,
        worked: Worked,
    ) -> Result<Onward, PublishError> {
        let context = &self.context;
        let conclusion = match worked {
            Worked::Lost => return Ok(Onward::Lost),
            Worked::Step(step) => return Ok(Onward::Step(Box::new(step))),
            Worked::None(ending, reason) => Conclusion::None { ending, reason },
            Worked::Report { report, written, reused } => {
                if let Err(reason) = verify(&report, written.as_ref(), &folder.work(claim.token)) {
                    return Ok(Onward::Step(Box::new(Step::Environment { reason })));
                }
                if reused.is_none() {
                    context.bus.tell(&Happening::Reported { report: &report });
                }
                Conclusion::Report { report, ctime_ns, reused }
            }
        };
        if let Some(witness) = self.sampled(job, &conclusion) {
            return Ok(Onward::Step(Box::new(Step::Sampled(Box::new(witness)))));
        }
        let compared = job.witness.as_ref().map(|witness| (witness, self.compared(witness, &conclusion)));
        let conclusion = match &compared {
            Some((witness, compared)) => judged(conclusion, witness, compared),
            None => conclusion,
        };
        let next = Desk::new(&*context.store, folder, claim, &self.committed).intend(job, &conclusion)?;
        if let Some((_, compared)) = &compared {
            context.bus.tell(&Happening::Compared { job: &next, compared });
        }
        Ok(Onward::Job(Box::new(next)))
    }

    /// Of a first attempt whose result is to be made once more: what there will be to compare with.
    fn sampled(&self, job: &Job, conclusion: &Conclusion) -> Option<Witness> {
        let Conclusion::Report { report, reused: None, .. } = conclusion else { return None };
        let config = self.context.settings.now();
        let is_one = job.witness.is_none() && samples::is_one(job.id, config.check_one_in());
        // A file beside the mesh may be another one by then.
        if !is_one || !report.outcome.is_good() || is_forced(&job.source.path) || beside::has_any(&report.profile) {
            return None;
        }
        let output = report.output.as_ref()?.blake3.parse().ok()?;
        Some(samples::witness(&self.daemon(), recipe_of(report), output))
    }

    fn compared(&self, witness: &Witness, conclusion: &Conclusion) -> Compared {
        samples::compare(witness, &self.daemon(), second(conclusion))
    }

    /// Is the second attempt another host's, if it comes soon?
    pub(super) fn is_for_another(&self, job: &Job) -> bool {
        // A store that fails here fails at the next step too, and is dealt with there.
        let hosts = || brief(|| self.context.store.hosts()).unwrap_or_default();
        // With `once` nothing is left to others.
        !self.context.once && job.witness.is_some() && samples::is_for_another(job, &self.daemon(), &hosts)
    }

    /// Tells what it means that a job of which there was a result comes to an end without any: `next`, which was `job`.
    pub(super) fn tell_condemned(&self, job: &Job, next: &Job) {
        if let (Some(_), State::Concluded { ending, reason, .. }) = (&job.witness, &next.state) {
            let is_the_files = *ending == Ending::Quarantined;
            let compared = if is_the_files { Compared::Different(reason.clone()) } else { Compared::Unlike };
            self.context.bus.tell(&Happening::Compared { job: next, compared: &compared });
        }
    }

    /// Its name among those that share the store.
    fn daemon(&self) -> String {
        daemon_name(&self.context.settings.now().state)
    }
}

/// The end of a second attempt.
fn second(conclusion: &Conclusion) -> Second {
    match conclusion {
        Conclusion::None { ending: Ending::Refused, .. } => Second::Refused,
        Conclusion::None { .. } => Second::Bad { recipe: None },
        Conclusion::Report { report, .. } => {
            let recipe = recipe_of(report);
            let output = report.output.as_ref().and_then(|facts| facts.blake3.parse().ok());
            match output.filter(|_| report.outcome.is_good()) {
                Some(output) => Second::Good { recipe, output },
                None => Second::Bad { recipe: Some(recipe) },
            }
        }
    }
}

/// The conclusion of the second attempt, now that it was compared: nothing is good of which there are two results.
fn judged(conclusion: Conclusion, witness: &Witness, compared: &Compared) -> Conclusion {
    match (conclusion, compared) {
        (Conclusion::Report { mut report, ctime_ns, reused }, Compared::Different(words)) => {
            report.outcome = Outcome::NeedsReview;
            report.verdict.reasons.insert(0, words.clone());
            Conclusion::Report { report, ctime_ns, reused }
        }
        (Conclusion::None { reason, .. }, Compared::Different(words)) => {
            Conclusion::None { ending: Ending::NeedsReview, reason: format!("{words}; {reason}") }
        }
        (Conclusion::Report { mut report, ctime_ns, reused }, _) => {
            if !report.outcome.is_good() {
                report.verdict.reasons.push(witness.to_string());
            }
            Conclusion::Report { report, ctime_ns, reused }
        }
        (Conclusion::None { ending, reason }, _) => Conclusion::None { ending, reason: format!("{reason}; {witness}") },
    }
}

/// Is the output the very file that the worker wrote, synced and read back?
fn verify(report: &Report, written: Option<&Identity>, work: &Path) -> Result<(), String> {
    match (&report.output, written) {
        (None, _) if report.outcome.is_good() => Err("the engine reports a result, but there is none".into()),
        (None, _) => Ok(()),
        (Some(facts), Some(written)) => match Identity::of(&work.join(OUTPUT)) {
            Ok(found) if found == *written && found.size == facts.bytes => Ok(()),
            Ok(_) => Err("the result is not the file any more that was written and read back".into()),
            Err(error) => Err(format!("the result cannot be looked at: {error}")),
        },
        (Some(_), None) => Err("the result could not be looked at when it was written".into()),
    }
}

#[cfg(test)]
mod tests {
    use suture_store::{Hash, Recipe};

    use super::*;
    use crate::table::tests::sample;

    fn made(outcome: Outcome) -> Conclusion {
        let mut report = sample(outcome);
        report.output.as_mut().unwrap().blake3 = Hash([2; 32]).to_string();
        Conclusion::Report { report: Box::new(report), ctime_ns: 5, reused: None }
    }

    fn of(conclusion: &Conclusion) -> &Report {
        let Conclusion::Report { report, .. } = conclusion else { panic!("there is a report") };
        report
    }

    fn unreadable() -> Conclusion {
        Conclusion::None { ending: Ending::Unreadable, reason: "no mesh".into() }
    }

    /// A result is what may go to `out/`, whatever else is written.
    #[test]
    fn what_a_second_attempt_came_to_is_told_by_its_outcome() {
        for outcome in [Outcome::Clean, Outcome::Repaired] {
            let made = made(outcome);
            let recipe = recipe_of(of(&made));
            assert_eq!(second(&made), Second::Good { recipe, output: Hash([2; 32]) });
        }
        for outcome in [Outcome::NeedsReview, Outcome::NotGood] {
            let made = made(outcome);
            assert_eq!(second(&made), Second::Bad { recipe: Some(recipe_of(of(&made))) });
        }
        assert_eq!(second(&unreadable()), Second::Bad { recipe: None });
        assert_eq!(second(&Conclusion::None { ending: Ending::Refused, reason: String::new() }), Second::Refused);
    }

    /// Nothing that differs is good any more, and all that was said of it is kept.
    #[test]
    fn what_differs_needs_review_and_all_else_ends_as_it_would() {
        let witness = samples::witness("a:/state", Recipe(7), Hash([1; 32]));
        let differs = || Compared::Different("two results".into());
        for outcome in [Outcome::Clean, Outcome::Repaired, Outcome::NotGood] {
            let mut made = made(outcome);
            if let Conclusion::Report { report, .. } = &mut made {
                report.verdict.reasons = vec!["of the engine".into()];
            }
            let judged = judged(made, &witness, &differs());
            let report = of(&judged);
            assert_eq!(
                (report.outcome, &*report.verdict.reasons),
                (Outcome::NeedsReview, &["two results".into(), "of the engine".into()][..])
            );
        }
        let none = judged(unreadable(), &witness, &differs());
        assert!(matches!(none, Conclusion::None { ending: Ending::NeedsReview, reason } if reason == "two results; no mesh"));
        for compared in [Compared::Equal, Compared::OtherVersion, Compared::Unlike] {
            let judged = judged(made(Outcome::Clean), &witness, &compared);
            let report = of(&judged);
            assert_eq!((report.outcome, report.verdict.reasons.len()), (Outcome::Clean, 0), "{compared:?}");
        }
        let worse = judged(made(Outcome::NotGood), &witness, &Compared::OtherVersion);
        let told = &of(&worse).verdict.reasons;
        assert!(
            of(&worse).outcome == Outcome::NotGood && told.last().is_some_and(|told| *told == witness.to_string()),
            "{told:?}"
        );
        let refused = Conclusion::None { ending: Ending::Refused, reason: "too large".into() };
        let Conclusion::None { ending, reason } = judged(refused, &witness, &Compared::Unlike) else { panic!("none") };
        assert!(ending == Ending::Refused && reason.starts_with("too large; an earlier attempt, by a:/state"), "{reason}");
    }
}
