//! One input of a command line: what is asked for, the worker's turn, the result's way to its name, and what is said of it.

use std::path::{Path, PathBuf};

use suture_core::report::{Certificate, Outcome, RuleOutcome, Simplified, Task};
use suture_core::{ErrorClass, Limits, Profile, Report};

use crate::beside;
use crate::course::Course;
use crate::draft::Draft;
use crate::exit::Exit;
use crate::fence::Fence;
use crate::fsx::{self, Identity};
use crate::naming::Naming;
use crate::protocol::Request;
use crate::rights::Rights;
use crate::signals::Stop;
use crate::supervise::{Cause, Ended, Worker};
use crate::table;
use crate::units::show_count;

/// Why there is no result for a file.
#[derive(Debug)]
pub(crate) struct Failure {
    pub class: ErrorClass,
    pub line: String,
    /// It was stopped by a signal.
    pub stopped: bool,
}

impl Failure {
    pub(crate) fn new(class: ErrorClass, line: impl Into<String>) -> Self {
        Self { class, line: line.into(), stopped: false }
    }

    /// The exit status: where the machine runs short, trying again may help.
    fn exit(&self) -> Exit {
        match self.class {
            _ if self.stopped => Exit::Interrupted,
            ErrorClass::Shortage => Exit::TryAgain,
            _ => Exit::Refused,
        }
    }

    /// More memory may help, so that the file is to be tried again with all of the budget.
    pub(crate) fn is_starved(&self) -> bool {
        self.class == ErrorClass::Starved
    }

    pub(crate) fn io(path: &Path, what: &str, error: &std::io::Error) -> Self {
        Self::new(ErrorClass::Environment, format!("{}: {what}: {error}", path.display()))
    }
}

/// What a command line asks for.
pub(crate) struct Order<'a> {
    pub inputs: &'a [PathBuf],
    pub profile: Profile,
    pub limits: Limits,
    /// Where results go; `None` for an inspection.
    pub naming: Option<Naming>,
    /// What is said to be true of the input: that is checked, and nothing else told.
    pub certificate: Option<Certificate>,
    pub json: bool,
}

/// One input, ready to be worked on.
pub(crate) struct Item {
    pub request: Request,
    /// The input as it was before anyone worked on it.
    before: Identity,
    /// What is made of it gets these.
    rights: Rights,
    /// The result and the report in the making, with the names they are to have.
    pub output: Option<(Draft, PathBuf)>,
    pub report: Option<(Draft, PathBuf)>,
}

/// A result that is not in place yet.
pub(crate) struct Finished {
    pub report: Box<Report>,
    pub item: Item,
}

impl Order<'_> {
    /// Makes an input ready, its result to be called `target`.
    ///
    /// # Errors
    /// When it cannot be read, or nothing may be written where its result would go.
    pub(crate) fn item(&self, input: &Path, target: Option<&Path>, limits: Limits) -> Result<Item, Failure> {
        let (before, rights) = std::fs::metadata(input)
            .map(|m| (Identity::from(&m), Rights::of(&m)))
            .map_err(|e| Failure { class: ErrorClass::Unreadable, ..Failure::io(input, "cannot be opened", &e) })?;
        let mut request = Request {
            task: if self.naming.is_some() { Task::Repair } else { Task::Inspect },
            input: input.to_owned(),
            output: None,
            report: None,
            witness: None,
            mark: None,
            shown_input: input.display().to_string(),
            shown_output: None,
            profile: self.profile.clone(),
            companions: beside::of_command(&self.profile, input),
            limits,
        };
        let (mut output, mut report) = (None, None);
        if let (Some(naming), Some(target)) = (&self.naming, target) {
            let refused = |line| Failure::new(ErrorClass::Refused, line);
            if !naming.is_folder() {
                naming.check(target).map_err(refused)?;
            }
            let draft =
                |path: &Path| Draft::new(fsx::folder_of(path)).map_err(|error| Failure::io(path, "cannot be written", &error));
            if let Some(path) = naming.report(target).map_err(refused)? {
                let made = draft(&path)?;
                request.report = Some(made.path());
                report = Some((made, path));
            }
            let made = draft(target)?;
            request.output = Some(made.path());
            request.limits.spool.get_or_insert_with(|| fsx::folder_of(target).to_owned());
            request.shown_output = Some(target.display().to_string());
            output = Some((made, target.to_owned()));
        }
        Ok(Item { request, before, rights, output, report })
    }
}

impl Item {
    /// Runs the request in a worker of its memory and threads, which is started when there is none (for `many` small files, or for
    /// one); it is there again afterwards if it survived.
    ///
    /// # Errors
    /// When the file has no result, for whatever reason.
    pub(crate) fn work(
        &self,
        worker: &mut Option<Worker>,
        many: bool,
        stop: &Stop,
        on_progress: &mut dyn FnMut(&Course),
    ) -> Result<Box<Report>, Failure> {
        let Request { limits, shown_input: shown, .. } = &self.request;
        let mut running = match worker.take() {
            Some(worker) => worker,
            // A draft has no name but the number of a handle of this process, which a fenced worker could not open.
            None => Worker::spawn(limits.memory_bytes, limits.threads, many, &Fence::default())
                .map_err(|e| Failure::new(ErrorClass::Environment, format!("cannot start a worker process: {e}")))?,
        };
        let ended = running.run(&self.request, None, &|| stop.asked(), on_progress);
        let changed = || std::fs::metadata(&self.request.input).map_or(true, |m| Identity::from(&m) != self.before);
        let changed_line =
            || Failure::new(ErrorClass::Changed, format!("{shown}: changed while it was being worked on; try again"));
        match ended {
            Ended::Done { .. } if changed() => Err(changed_line()),
            Ended::Done { report, .. } => {
                *worker = Some(running);
                Ok(report)
            }
            Ended::Failed { class, message } => {
                *worker = Some(running);
                Err(Failure::new(class, message))
            }
            Ended::Died(death) if matches!(death.cause, Cause::Fault(_)) && changed() => Err(changed_line()),
            Ended::Died(death) => Err(Failure::new(death.class(), format!("{shown}: {}", death.line()))),
            Ended::Stopped => {
                let line = format!("{shown}: interrupted; nothing was written");
                Err(Failure { stopped: true, ..Failure::new(ErrorClass::Environment, line) })
            }
        }
    }

    /// Makes the content of result and report durable.
    ///
    /// # Errors
    /// When the disk fails.
    pub(crate) fn sync(&self) -> Result<(), Failure> {
        for (draft, path) in [&self.output, &self.report].into_iter().flatten() {
            if draft.is_written() {
                draft.sync().map_err(|error| Failure::io(path, "cannot be synced", &error))?;
            }
        }
        Ok(())
    }
}

impl Finished {
    /// Gives result and report their names; durable once their folders, which are added to `folders`, are synced.
    ///
    /// # Errors
    /// When a name cannot be had.
    pub(crate) fn place(mut self, naming: &Naming, folders: &mut Vec<PathBuf>) -> Result<Box<Report>, Failure> {
        let mut note = |path: &Path| {
            let folder = fsx::folder_of(path);
            if !folders.iter().any(|known| known == folder) {
                folders.push(folder.to_owned());
            }
        };
        // Where no triangle was left, the draft is no mesh, and the report knows of no output.
        let is_mesh = self.report.output.is_some();
        if let Some((draft, target)) = self.item.output.filter(|(draft, _)| is_mesh && draft.is_written()) {
            let placed = place_result(&draft, target, self.item.rights, &self.item.request.input, naming)?;
            note(&placed);
            if let Some(facts) = &mut self.report.output {
                facts.path = placed;
            }
        }
        if let Some((draft, path)) = self.item.report {
            draft.place(&path, self.item.rights, naming.force).map_err(|error| not_placed(&path, &error))?;
            note(&path);
        }
        Ok(self.report)
    }
}

fn place_result(draft: &Draft, mut target: PathBuf, rights: Rights, input: &Path, naming: &Naming) -> Result<PathBuf, Failure> {
    loop {
        match draft.place(&target, rights, naming.force) {
            Ok(()) => return Ok(target),
            Err(error) if error.kind() == std::io::ErrorKind::AlreadyExists => match naming.next(input) {
                Some(next) => target = next,
                None => return Err(not_placed(&target, &error)),
            },
            Err(error) => return Err(not_placed(&target, &error)),
        }
    }
}

fn not_placed(path: &Path, error: &std::io::Error) -> Failure {
    if error.kind() == std::io::ErrorKind::AlreadyExists {
        let line = format!("{}: has come to exist meanwhile; nothing was replaced", path.display());
        return Failure::new(ErrorClass::Refused, line);
    }
    Failure::io(path, "cannot be written", error)
}

/// What is printed of one input, on standard output and on standard error, and what it means for the exit code.
pub(crate) fn tell(input: &Path, result: &Result<Box<Report>, Failure>, order: &Order<'_>) -> (String, Option<String>, Exit) {
    match (result, &order.certificate) {
        (Ok(report), Some(certificate)) => {
            let check = if order.naming.is_some() { check_original } else { check };
            let (text, exit) = check(input, certificate, report);
            (text + "\n", None, exit)
        }
        (Ok(report), None) => {
            let text = if order.json { serde_json::to_string(&report).unwrap_or_default() + "\n" } else { table::render(report) };
            (text, None, exit_of(report))
        }
        (Err(failure), _) => {
            let line = failure.line.clone();
            let text = if order.json {
                let input = input.display().to_string();
                format!("{}\n", serde_json::json!({ "input": input, "error": failure.line, "class": failure.class }))
            } else {
                String::new()
            };
            (text, Some(line), failure.exit())
        }
    }
}

/// Good if the result is, and each step was taken that was asked for: none was left because the mesh is not good without it, for want of memory, or for a file
/// that it needs.
fn exit_of(report: &Report) -> Exit {
    let is_as_before = |told: &Simplified| told.after == told.before && told.why_not.is_some();
    let is_left = report.features.as_ref().is_some_and(|told| told.why_not.is_some())
        || report.residue.as_ref().is_some_and(|told| told.why_not.is_some())
        || report.smoothed.as_ref().is_some_and(|told| told.why_not.is_some())
        || report.simplified.as_ref().is_some_and(is_as_before);
    if report.outcome.is_good() && !is_left { Exit::Good } else { Exit::NotGood }
}

/// Whether `certificate` holds for the file that `report` is of, in one line; good only if it says that the file is printable.
fn check(input: &Path, certificate: &Certificate, report: &Report) -> (String, Exit) {
    let shown = input.display();
    let contradictions =
        report.certificate.as_ref().map_or(vec!["the file has none".into()], |now| certificate.contradictions(now));
    let rules = certificate.rules.len();
    if !contradictions.is_empty() {
        return (format!("{shown}: the certificate does not hold: {}", contradictions.join("; ")), Exit::NotGood);
    }
    let of = format!("of these {} bytes with BLAKE3 {}", show_count(certificate.bytes), certificate.blake3);
    if certificate.printable {
        let said = said_of_fidelity(certificate);
        return (format!("{shown}: the certificate holds: printable, {rules} of {rules} rules passed, {of}{said}"), Exit::Good);
    }
    let missing = &certificate.missing;
    let passed = rules.saturating_sub(missing.len());
    let line = format!("{shown}: not certified: {passed} of {rules} rules passed, {of}, but not {}", missing.join(", "));
    (line, Exit::NotGood)
}

/// What a certificate says of fidelity, which nobody has looked at yet.
fn said_of_fidelity(certificate: &Certificate) -> String {
    match &certificate.faithful {
        None => String::new(),
        Some(half) if half.failed.is_empty() => "; said to be faithful: --original FILE checks that".into(),
        Some(half) => format!("; said to need a look, for {}", half.failed.join(", ")),
    }
}

/// Whether `certificate` holds for what has just been made of the original, in one line; good only if it says that it is faithful.
fn check_original(original: &Path, certificate: &Certificate, report: &Report) -> (String, Exit) {
    let shown = original.display();
    let contradictions =
        report.certificate.as_ref().map_or(vec!["nothing comes of it".into()], |now| certificate.contradictions(now));
    if !contradictions.is_empty() {
        let line = format!("{shown}: repaired anew, it does not give what the certificate says: {}", contradictions.join("; "));
        return (line, Exit::NotGood);
    }
    match &certificate.faithful {
        None if report.outcome == Outcome::Clean => {
            (format!("{shown}: repaired anew, it gives the same bytes; nothing was changed"), Exit::Good)
        }
        None => (
            format!("{shown}: repaired anew, it gives the same bytes; how far it is from the original was not measured"),
            Exit::Good,
        ),
        Some(half) if half.failed.is_empty() => {
            let passed = half.rules.iter().filter(|rule| rule.outcome == RuleOutcome::Passed).count();
            let rest = match half.rules.len() - passed {
                0 => String::new(),
                rest => format!(", {rest} with nothing to compare"),
            };
            let line =
                format!("{shown}: repaired anew, it gives the same bytes: faithful, {passed} rules within their limits{rest}");
            (line, Exit::Good)
        }
        Some(half) => {
            let line = format!(
                "{shown}: repaired anew, it gives the same bytes, but a person must look, for {}",
                half.failed.join(", ")
            );
            (line, Exit::NotGood)
        }
    }
}

#[cfg(test)]
mod tests {
    use suture_core::report::{Features, Outcome};

    use super::*;

    /// A file of too many triangles is refused with any memory: to run it again would be in vain.
    #[test]
    fn only_a_file_refused_for_memory_gets_all_of_it() {
        use ErrorClass::{Changed, Environment, Refused, Shortage, Starved, Unreadable};
        let starved = |class| Failure::new(class, "refused").is_starved();
        assert_eq!(
            [Starved, Refused, Unreadable, Environment, Shortage, Changed].map(starved),
            [true, false, false, false, false, false]
        );
    }

    /// Where the machine has no room, trying again may help; a file that cannot be read stays so.
    #[test]
    fn a_shortage_is_no_fault_of_the_call() {
        let exit = |class| Failure::new(class, "x").exit();
        assert_eq!([ErrorClass::Shortage, ErrorClass::Unreadable].map(exit), [Exit::TryAgain, Exit::Refused]);
        assert_eq!(Failure { stopped: true, ..Failure::new(ErrorClass::Shortage, "x") }.exit(), Exit::Interrupted);
    }

    /// A mesh that keeps all of its features is not what was asked for, good as it is.
    #[test]
    fn features_that_had_to_stay_are_told_by_the_exit() {
        let mut report = table::tests::sample(Outcome::Clean);
        assert_eq!(exit_of(&report), Exit::Good);
        report.features = Some(Features::default());
        assert_eq!(exit_of(&report), Exit::Good, "there was none to remove");
        let mut features = Features::default();
        features.why_not = Some("without its features the mesh is not good".into());
        report.features = Some(features);
        assert_eq!(exit_of(&report), Exit::NotGood);
    }

    /// A mesh whose tool path cannot be read keeps its residue, good as it is; more triangles than were asked for are told of, and no fault if some have gone.
    #[test]
    fn steps_that_were_not_taken_are_told_by_the_exit() {
        let with = |change: &dyn Fn(&mut Report)| {
            let mut report = table::tests::sample(Outcome::Clean);
            change(&mut report);
            exit_of(&report)
        };
        let why = || Some("a reason".to_owned());
        let residue =
            |why_not: Option<String>| with(&|report| report.residue.get_or_insert_default().why_not.clone_from(&why_not));
        assert_eq!([residue(None), residue(why())], [Exit::Good, Exit::NotGood]);
        let smoothed =
            |why_not: Option<String>| with(&|report| report.smoothed.get_or_insert_default().why_not.clone_from(&why_not));
        assert_eq!([smoothed(None), smoothed(why())], [Exit::Good, Exit::NotGood]);
        let simplified = |after| {
            with(&|report| {
                let told = report.simplified.get_or_insert_default();
                (told.before, told.after, told.why_not) = (100, after, why());
            })
        };
        assert_eq!([simplified(99), simplified(100)], [Exit::Good, Exit::NotGood]);
    }

    /// One line each, and only what is certified and the same is good.
    #[test]
    fn a_certificate_holds_contradicts_or_certifies_nothing() {
        let mut report = table::tests::sample(Outcome::Clean);
        let text = r#"{"printable": true, "blake3": "ab", "bytes": 684, "triangles": 12, "rules": []}"#;
        let certificate: Certificate = serde_json::from_str(text).unwrap();
        assert_eq!(check(Path::new("a"), &certificate, &report).1, Exit::NotGood, "the file has none");
        report.certificate = Some(certificate.clone());
        let (text, exit) = check(Path::new("a"), &certificate, &report);
        assert!(text.starts_with("a: the certificate holds: printable") && exit == Exit::Good, "{text}");
        let mut other = certificate.clone();
        other.blake3 = "cd".into();
        let (text, exit) = check(Path::new("a"), &other, &report);
        assert!(text.contains("does not hold: these are not the bytes") && exit == Exit::NotGood, "{text}");
        let mut open = certificate;
        open.printable = false;
        report.certificate = Some(open.clone());
        let (text, exit) = check(Path::new("a"), &open, &report);
        assert!(text.starts_with("a: not certified") && exit == Exit::NotGood, "{text}");
    }
}
