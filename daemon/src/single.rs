//! `suture repair` and `suture inspect`: files named on the command line, one after the other, each by all threads, in a
//! supervised worker process.

use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use suture_core::report::Task;
use suture_core::{ErrorClass, Limits, Profile, Report};

use crate::cli::{InspectArgs, RepairArgs};
use crate::exit::Exit;
use crate::fsx::{self, Identity};
use crate::protocol::Request;
use crate::receipt::REPORT;
use crate::signals::Stop;
use crate::supervise::{Cause, Ended, Worker};
use crate::{profiles, table};

/// Work that is done sooner shows no progress bar.
const BAR_AFTER: Duration = Duration::from_secs(1);
/// Free names (`part~2.stl`, …) are looked for this far.
const MAX_VERSIONS: u32 = 100_000;

/// Repairs every input and prints what was done.
pub(crate) fn repair(args: &RepairArgs) -> Exit {
    let plan = match Plan::new(args) {
        Ok(plan) => plan,
        Err(line) => return refuse(&line),
    };
    let mut run = match Run::new(args.spend.limits(args.list_edit), args.json) {
        Ok(run) => run,
        Err(line) => return refuse(&line),
    };
    let mut worst = Exit::Good;
    for input in &args.inputs {
        let ended = run.repair(input, &plan);
        worst = worst.max(run.tell(input, ended));
        if run.stop.asked() {
            return Exit::Interrupted;
        }
    }
    worst
}

/// Diagnoses every input.
pub(crate) fn inspect(args: &InspectArgs) -> Exit {
    let profile = match profiles::from_name_or_file(&args.profile) {
        Ok(profile) => profile,
        Err(line) => return refuse(&line),
    };
    let mut run = match Run::new(args.spend.limits(false), args.json) {
        Ok(run) => run,
        Err(line) => return refuse(&line),
    };
    let mut worst = Exit::Good;
    for input in &args.inputs {
        let ended = run.inspect(input, &profile);
        worst = worst.max(run.tell(input, ended));
        if run.stop.asked() {
            return Exit::Interrupted;
        }
    }
    worst
}

fn refuse(line: &str) -> Exit {
    eprintln!("suture: {line}");
    Exit::Refused
}

/// Why there is no result for a file.
struct Failure {
    class: ErrorClass,
    line: String,
}

impl Failure {
    fn new(class: ErrorClass, line: impl Into<String>) -> Self {
        Self { class, line: line.into() }
    }

    fn io(path: &Path, what: &str, error: &std::io::Error) -> Self {
        Self::new(ErrorClass::Environment, format!("{}: {what}: {error}", path.display()))
    }
}

/// Where results go.
struct Plan {
    profile: Profile,
    output: PathBuf,
    folder: bool,
    report: Option<PathBuf>,
    inputs: Vec<PathBuf>,
    force: bool,
}

impl Plan {
    fn new(args: &RepairArgs) -> Result<Self, String> {
        let profile = profiles::from_name_or_file(&args.profile)?;
        let output = args.output.clone();
        let folder = output.is_dir();
        if !folder && args.inputs.len() > 1 {
            return Err(format!("{}: with several inputs the output must be an existing folder", output.display()));
        }
        if !folder && output.as_os_str().as_encoded_bytes().ends_with(b"/") {
            return Err(format!("{}: no such folder", output.display()));
        }
        if !folder && !fsx::folder_of(&output).is_dir() {
            return Err(format!("{}: its folder does not exist", output.display()));
        }
        let plan = Self { profile, output, folder, report: args.report.clone(), inputs: args.inputs.clone(), force: args.force };
        if !folder {
            plan.check(&plan.output)?;
        }
        if let Some(report) = &plan.report {
            let several = args.inputs.len() > 1;
            if several && !report.is_dir() {
                return Err(format!("{}: with several inputs --report must be an existing folder", report.display()));
            }
            if !several && report.is_dir() {
                return Err(format!("{}: is a folder; name a file for the report", report.display()));
            }
            if !several {
                plan.check(report)?;
            }
            if !folder && same_name(report, &plan.output) {
                return Err(format!("{}: cannot be both the result and the report", report.display()));
            }
        }
        Ok(plan)
    }

    /// The name the result is to have, `n` being the attempt to find a free one.
    fn target(&self, input: &Path, n: u32) -> PathBuf {
        if self.folder {
            self.output.join(fsx::versioned(input.file_name().unwrap_or_default(), n, 0))
        } else {
            self.output.clone()
        }
    }

    /// Is this a name that something may be written to? Never an input, by whatever name, nor anything but a regular file; an existing
    /// file only by force, or in a folder, where the next free name is taken.
    fn check(&self, target: &Path) -> Result<(), String> {
        let Ok(there) = std::fs::metadata(target) else {
            // A link that leads nowhere would be replaced, too.
            let dangling = fsx::exists(target) && !self.force;
            return if dangling {
                Err(format!("{}: exists already; choose another name or add --force", target.display()))
            } else {
                Ok(())
            };
        };
        let id = |m: &std::fs::Metadata| {
            let identity = Identity::from(m);
            (identity.dev, identity.ino)
        };
        if self.inputs.iter().any(|input| std::fs::metadata(input).is_ok_and(|m| id(&m) == id(&there))) {
            return Err(format!("{}: is an input itself; an input is never overwritten", target.display()));
        }
        if !there.is_file() {
            return Err(format!("{}: is no regular file, and is not replaced", target.display()));
        }
        if !self.force {
            return Err(format!("{}: exists already; choose another name or add --force", target.display()));
        }
        Ok(())
    }
}

/// Whether two paths name one file, which need not exist.
fn same_name(a: &Path, b: &Path) -> bool {
    let whole = |p: &Path| (fsx::folder_of(p).canonicalize().ok(), p.file_name().map(ToOwned::to_owned));
    whole(a) == whole(b)
}

/// What all inputs share.
struct Run {
    limits: Limits,
    json: bool,
    stop: Stop,
    worker: Option<Worker>,
}

impl Run {
    fn new(limits: Limits, json: bool) -> Result<Self, String> {
        let stop = Stop::listen().map_err(|e| format!("cannot listen for signals: {e}"))?;
        Ok(Self { limits, json, stop, worker: None })
    }

    fn inspect(&mut self, input: &Path, profile: &Profile) -> Result<Report, Failure> {
        let request = Request {
            task: Task::Inspect,
            input: input.to_owned(),
            output: None,
            report: None,
            witness: None,
            shown_input: input.display().to_string(),
            shown_output: None,
            profile: profile.clone(),
            limits: self.limits.clone(),
        };
        self.work(&request)
    }

    fn repair(&mut self, input: &Path, plan: &Plan) -> Result<Report, Failure> {
        // The report names the result before it is placed: begin with a name that looks free.
        let first = if plan.folder { (1..MAX_VERSIONS).find(|n| !fsx::exists(&plan.target(input, *n))).unwrap_or(1) } else { 1 };
        let target = plan.target(input, first);
        let refused = |line| Failure::new(ErrorClass::Refused, line);
        if !plan.folder {
            plan.check(&target).map_err(refused)?;
        }
        let folder = fsx::folder_of(&target);
        let output = fsx::temporary_in(folder);
        let report = plan.report.as_deref().map(|path| {
            let path = if path.is_dir() {
                let mut name = fsx::versioned(input.file_name().unwrap_or_default(), 1, REPORT.len());
                name.push(REPORT);
                path.join(name)
            } else {
                path.to_owned()
            };
            plan.check(&path).map_err(refused).map(|()| (fsx::temporary_in(fsx::folder_of(&path)), path))
        });
        let report = report.transpose()?;
        let request = Request {
            task: Task::Repair,
            input: input.to_owned(),
            output: Some(output.clone()),
            report: report.as_ref().map(|(temporary, _)| temporary.clone()),
            witness: None,
            shown_input: input.display().to_string(),
            shown_output: Some(target.display().to_string()),
            profile: plan.profile.clone(),
            limits: self.limits.clone(),
        };
        let result = self.work(&request).and_then(|mut done| {
            if fsx::exists(&output) {
                let placed = place(&output, first, |n| plan.target(input, n), plan.folder, plan.force)?;
                if let Some(facts) = &mut done.output {
                    facts.path = placed;
                }
            }
            if let Some((temporary, path)) = &report {
                place(temporary, 1, |_| path.clone(), false, plan.force)?;
            }
            Ok(done)
        });
        // Nothing there after success; after anything else, what is there is of no use.
        let _ = fsx::remove_if_there(&output);
        if let Some((temporary, _)) = &report {
            let _ = fsx::remove_if_there(temporary);
        }
        result
    }

    /// Runs one request in the worker, which is started when there is none.
    fn work(&mut self, request: &Request) -> Result<Report, Failure> {
        let before = std::fs::metadata(&request.input).map(|m| Identity::from(&m));
        let before = before
            .map_err(|e| Failure { class: ErrorClass::Unreadable, ..Failure::io(&request.input, "cannot be opened", &e) })?;
        let mut worker = match self.worker.take() {
            Some(worker) => worker,
            None => Worker::spawn(self.limits.memory_bytes, self.limits.threads)
                .map_err(|e| Failure::new(ErrorClass::Environment, format!("cannot start a worker process: {e}")))?,
        };
        let mut bar = Bar::new(&request.shown_input);
        let ended = worker.run(request, None, &|| self.stop.asked(), &mut |stage, done, total| bar.at(stage, done, total));
        bar.clear();
        let changed = || std::fs::metadata(&request.input).map_or(true, |m| Identity::from(&m) != before);
        let shown = &request.shown_input;
        let changed_line =
            || Failure::new(ErrorClass::Changed, format!("{shown}: changed while it was being worked on; try again"));
        match ended {
            Ended::Done(_) if changed() => Err(changed_line()),
            Ended::Done(report) => {
                self.worker = Some(worker);
                Ok(*report)
            }
            Ended::Failed { class, message } => {
                self.worker = Some(worker);
                Err(Failure::new(class, message))
            }
            Ended::Died(death) if matches!(death.cause, Cause::Fault(_)) && changed() => Err(changed_line()),
            Ended::Died(death) => {
                let class = if death.blames_file() { ErrorClass::Refused } else { ErrorClass::Environment };
                Err(Failure::new(class, format!("{shown}: {}", death.line())))
            }
            Ended::Stopped => Err(Failure::new(ErrorClass::Environment, format!("{shown}: interrupted; nothing was written"))),
        }
    }

    /// Prints what came of one input.
    fn tell(&self, input: &Path, result: Result<Report, Failure>) -> Exit {
        match result {
            Ok(report) => {
                let text =
                    if self.json { serde_json::to_string(&report).unwrap_or_default() + "\n" } else { table::render(&report) };
                // A reader that has gone away has seen enough.
                let _ = std::io::stdout().write_all(text.as_bytes());
                if report.outcome.is_good() { Exit::Good } else { Exit::NotGood }
            }
            Err(failure) => {
                eprintln!("suture: {}", failure.line.replace('\n', " "));
                if self.json {
                    let line = serde_json::json!({
                        "input": input.display().to_string(), "error": failure.line, "class": failure.class,
                    });
                    let _ = writeln!(std::io::stdout(), "{line}");
                }
                Exit::Refused
            }
        }
    }
}

/// Gives a finished temporary file its name, whole and durable; with `versions` the first free one from the `first` on.
fn place(temporary: &Path, first: u32, name: impl Fn(u32) -> PathBuf, versions: bool, force: bool) -> Result<PathBuf, Failure> {
    for n in first..MAX_VERSIONS {
        let target = name(n);
        let folder = fsx::folder_of(&target);
        let placed = fsx::fit_in(temporary, folder).and_then(|()| {
            if force && !versions { std::fs::rename(temporary, &target) } else { fsx::rename_new(temporary, &target) }
        });
        match placed.and_then(|()| fsx::sync_dir(folder)) {
            Ok(()) => return Ok(target),
            Err(e) if e.kind() == std::io::ErrorKind::AlreadyExists && versions => {}
            Err(e) if e.kind() == std::io::ErrorKind::AlreadyExists => {
                let line = format!("{}: has come to exist meanwhile; nothing was replaced", target.display());
                return Err(Failure::new(ErrorClass::Refused, line));
            }
            Err(e) => return Err(Failure::io(&target, "cannot be written", &e)),
        }
    }
    Err(Failure::new(ErrorClass::Refused, format!("{}: no free name is left", name(1).display())))
}

/// A progress bar that appears only when there is a terminal and the work takes a while.
struct Bar {
    bar: ProgressBar,
    name: String,
    start: Instant,
    shown: bool,
}

impl Bar {
    fn new(name: &str) -> Self {
        Self { bar: ProgressBar::hidden(), name: name.to_owned(), start: Instant::now(), shown: !std::io::stderr().is_terminal() }
    }

    fn at(&mut self, stage: &str, done: u64, total: u64) {
        if !self.shown && self.start.elapsed() >= BAR_AFTER {
            self.shown = true;
            self.bar.set_draw_target(ProgressDrawTarget::stderr());
            // The template is a constant that parses; the plain style would do as well.
            if let Ok(style) = ProgressStyle::with_template("{prefix} {wide_bar} {percent:>3} % {msg} {elapsed}") {
                self.bar.set_style(style);
            }
            self.bar.set_prefix(self.name.clone());
        }
        self.bar.set_length(total.max(1));
        self.bar.set_position(done);
        self.bar.set_message(stage.to_owned());
    }

    fn clear(&self) {
        self.bar.finish_and_clear();
    }
}
