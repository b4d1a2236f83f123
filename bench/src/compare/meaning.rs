//! What becomes of files whose meaning is known: is what comes out what was meant, is a person asked, or is it wrong and called good?
//!
//! Suture is a process for each file, the peers one for each family (they start slowly), and one more for each file that such a process
//! left out. A result is called good by the program's own word (Suture's outcome), or, of programs that have none, if it is closed.

use std::path::{Path, PathBuf};

use suture_bench::judge::{self, Triangle};
use suture_bench::meaning::{Family, Meant};

use super::child;
use super::closing::{Bench, Options};
use super::error::Error;
use super::made::{Bad, Report, Tally, Understood, Verdict};
use super::programs::Programs;
use super::record::{Journal, Line};
use super::sides::Side;
use super::together;
use super::way::Way;
use crate::mesh;

/// The settings of a run over families.
pub(crate) struct Asked {
    pub(crate) families: Vec<Family>,
    /// Seeds are from this one on.
    pub(crate) first: u64,
    pub(crate) seeds: u64,
    pub(crate) sides: Vec<Side>,
    /// Processes at a time.
    pub(crate) jobs: usize,
    /// Run what is in the raw file already, too.
    pub(crate) again: bool,
    /// Keep files that are not as wanted here.
    pub(crate) keep: Option<PathBuf>,
}

/// One file, and what it means.
struct Case {
    seed: u64,
    meant: Meant,
}

/// The verdict on one file of a side.
struct Made {
    verdict: Verdict,
    why: String,
    /// It is called good, and cannot be printed.
    unprintable: bool,
    seconds: f64,
}

impl Made {
    /// Verdicts where there is nothing to be printed.
    fn without(seconds: f64) -> impl Fn(Verdict, String) -> Self {
        move |verdict, why| Self { verdict, why, unprintable: false, seconds }
    }
}

/// Has every side repair every case, and adds what came out to the raw file, a line for each family and side.
///
/// # Errors
/// When suture cannot be built, or the system fails.
pub(crate) fn meaning(options: &Options, asked: &Asked) -> Result<(), Error> {
    let mut bench = Bench::open(options, &asked.sides)?;
    let present: Vec<_> = asked.sides.iter().copied().filter(|&side| bench.has(side)).collect();
    for family in &asked.families {
        let cases: Vec<_> =
            (asked.first..asked.first + asked.seeds).map(|seed| Case { seed, meant: family.case(seed) }).collect();
        let hash = hash(&cases);
        for &side in &present {
            let program = bench.programs.identity(side)?;
            if !asked.again && is_done(&bench.journal, family, side, &program, &hash) {
                continue;
            }
            let run = Run { programs: &bench.programs, side, family, cases: &cases, options, asked, folder: bench.folder.path() };
            let understood = run.family(program, hash.clone())?;
            println!("{:24} {:16} {}", family.name, side.facts().name, understood.tally.summary());
            for bad in &understood.bad {
                println!("    {} {}: {}", bad.seed, bad.verdict.name(), bad.why);
            }
            bench.journal.write(Line::Understood(understood))?;
        }
    }
    bench.journal.retain_newest(|line| match line {
        Line::Understood(done) => Some((done.family.clone(), done.side)),
        _ => None,
    })?;
    print_totals(&bench.journal, &present);
    Ok(())
}

fn print_totals(journal: &Journal, sides: &[Side]) {
    for &side in sides {
        let of_side = |line: &'_ &Understood| line.side == side;
        let lines: Vec<_> = journal.understood().filter(of_side).collect();
        for (word, decides) in [("the file decides", true), ("it does not", false)] {
            let sum = Tally::sum(lines.iter().filter(|line| line.decides == decides).map(|line| line.tally));
            println!("{:16} {word:18} {}", side.facts().name, sum.map_or(String::new(), |sum| sum.summary()));
        }
    }
}

fn is_done(journal: &Journal, family: &Family, side: Side, program: &str, cases: &str) -> bool {
    let asked = (family.name, side, program, cases);
    journal.has(|line| match line {
        Line::Understood(done) => (done.family.as_str(), done.side, done.program.as_str(), done.cases.as_str()) == asked,
        _ => false,
    })
}

/// Names the files and what they mean, so that what was made of others is not taken for what was made of these.
fn hash(cases: &[Case]) -> String {
    let mut hasher = blake3::Hasher::new();
    for Case { seed, meant } in cases {
        hasher.update(&seed.to_le_bytes());
        hasher.update(format!("{:?} {:?}", meant.tolerance, meant.bodies).as_bytes());
        for triangles in [&meant.damaged, &meant.intended] {
            triangles.as_flattened().as_flattened().iter().for_each(|x| {
                hasher.update(&x.to_le_bytes());
            });
            hasher.update(b"|");
        }
    }
    format!("{:.12}", hasher.finalize().to_hex())
}

/// One side over one family.
struct Run<'a> {
    programs: &'a Programs,
    side: Side,
    family: &'a Family,
    cases: &'a [Case],
    options: &'a Options,
    asked: &'a Asked,
    folder: &'a Path,
}

impl Run<'_> {
    fn family(&self, program: String, cases: String) -> Result<Understood, Error> {
        let folder = tempfile::tempdir_in(self.folder).map_err(Error::io("making a folder"))?;
        let (inputs, outputs) = (folder.path().join("in"), folder.path().join("out"));
        for path in [&inputs, &outputs] {
            std::fs::create_dir(path).map_err(Error::io("making a folder"))?;
        }
        let name = |case: &Case| format!("{}-{}.stl", self.family.name, case.seed);
        for case in self.cases {
            mesh::write(&inputs.join(name(case)), &case.meant.damaged).map_err(Error::Mesh)?;
        }
        if !self.side.is_suture() {
            let all = self.command(self.cases.len() as u64, &inputs, &outputs);
            child::run(all, None, false, self.options.limit)?;
        }
        let made = together::each(self.cases, self.asked.jobs, |case| {
            let (input, output) = (inputs.join(name(case)), outputs.join(name(case)));
            let made = self.one(case, &input, &output)?;
            self.keep(case, &made, &output)?;
            Ok::<Made, Error>(made)
        });
        let mut understood = Understood::new(self.family.name, self.family.group, self.side, program, cases);
        understood.decides = self.family.decides;
        understood.first = self.asked.first;
        for (case, made) in self.cases.iter().zip(made) {
            let made = made?;
            let wanted = self.is_wanted(case, &made);
            let bad = (!wanted || made.unprintable).then_some(Bad { seed: case.seed, verdict: made.verdict, why: made.why });
            understood.tally.add(made.verdict, made.unprintable, made.seconds, wanted);
            understood.bad.extend(bad);
        }
        Ok(understood)
    }

    fn command(&self, files: u64, input: &Path, output: &Path) -> std::process::Command {
        let way = Way { threads: self.side.is_suture().then_some(1), ..Way::plain(self.side) };
        self.programs.command(&way, files, input, output)
    }

    fn one(&self, case: &Case, input: &Path, output: &Path) -> Result<Made, Error> {
        if !self.side.is_suture() && output.exists() {
            return Ok(judged(case, output, true, 0.0));
        }
        let ended = child::run(self.command(1, input, output), Some(output), false, self.options.limit)?;
        let seconds = ended.cost.wall_seconds;
        let without = Made::without(seconds);
        if !ended.cost.exited {
            return Ok(without(Verdict::Failed, ended.cost.end));
        }
        if !self.side.is_suture() {
            return Ok(match output.exists() {
                true => judged(case, output, true, seconds),
                false => without(Verdict::Withheld, ended.cost.complaint.lines().last().unwrap_or_default().into()),
            });
        }
        let Some(report) = Report::read(&ended.said) else { return Ok(without(Verdict::Failed, ended.cost.end)) };
        let reasons = report.reasons.join("; ");
        Ok(match report.outcome.as_str() {
            "clean" | "repaired" => judged(case, output, false, seconds),
            "needs_review" => {
                let made = judged(case, output, false, seconds);
                let verdict = if made.verdict == Verdict::Right { Verdict::ReviewRight } else { Verdict::ReviewWrong };
                let why = if made.why.is_empty() { reasons } else { format!("{} · {reasons}", made.why) };
                Made { verdict, why, ..made }
            }
            "not_good" => without(Verdict::Withheld, reasons),
            other => without(Verdict::Failed, format!("{other} {reasons}")),
        })
    }

    fn is_wanted(&self, case: &Case, made: &Made) -> bool {
        made.verdict.is_wanted(self.family.decides, !case.meant.intended.is_empty())
    }

    /// Keeps a case that is not as wanted, and what came out.
    fn keep(&self, case: &Case, made: &Made, output: &Path) -> Result<(), Error> {
        let wanted = self.is_wanted(case, made);
        let Some(folder) = self.asked.keep.as_ref().filter(|_| !wanted || made.unprintable) else { return Ok(()) };
        let name = format!("{}-{}", self.family.name, case.seed);
        write_case(folder, self.family, case.seed, &case.meant)?;
        if output.exists() {
            let to = folder.join(format!("{name}.{}.{}.out", self.side.facts().name, made.verdict.name().replace(' ', "-")));
            std::fs::copy(output, to).map_err(Error::io("keeping an output"))?;
        }
        Ok(())
    }
}

/// A result held against what was meant. Of a program without a word of its own, one that is not closed is withheld.
fn judged(case: &Case, output: &Path, is_peer: bool, seconds: f64) -> Made {
    let without = Made::without(seconds);
    let (found, triangles) = match (judge::solid(output), mesh::read(output)) {
        (Ok(found), Ok(triangles)) => (found, triangles),
        _ if is_peer => return without(Verdict::Withheld, "nothing that can be read".into()),
        _ => return without(Verdict::Wrong, "called good, and nothing that can be read".into()),
    };
    if is_peer && !found.judgement.counts.closed() {
        return without(Verdict::Withheld, "open".into());
    }
    let why = faults(&case.meant, &triangles);
    let verdict = if why.is_empty() { Verdict::Right } else { Verdict::Wrong };
    let fault = found.fault().map(judge::Fault::name);
    let why = [why, fault.map_or(String::new(), |fault| format!("not printable: {fault}"))];
    let why: Vec<_> = why.into_iter().filter(|why| !why.is_empty()).collect();
    Made { verdict, why: why.join(", "), unprintable: fault.is_some(), seconds }
}

/// A body of a smaller share of the volume is a speck that no printer can make: it is counted by nobody.
const SPECK: f64 = 1e-6;

/// Why triangles are not what was meant; empty: they are.
fn faults(meant: &Meant, triangles: &[Triangle]) -> String {
    let found = judge::judge_triangles(triangles);
    let mut faults = Vec::new();
    if !found.counts.closed() || found.counts.unbalanced_edges > 0 {
        faults.push("open or torn".to_owned());
    }
    let fidelity = judge::fidelity(triangles, &meant.intended);
    if fidelity.difference > meant.tolerance + fidelity.error {
        let extra = fidelity.difference - fidelity.missing;
        faults.push(format!("{:.4} missing, {extra:.4} too much, of {}", fidelity.missing, meant.tolerance));
    }
    let least = SPECK * fidelity.volume;
    let is_body = |volume: &&f64| if found.volume < 0.0 { -**volume > least } else { **volume > least };
    let bodies = judge::volumes(triangles).iter().filter(is_body).count() as u64;
    if !meant.bodies.contains(&bodies) && !meant.intended.is_empty() {
        faults.push(format!("{bodies} bodies for {:?}", meant.bodies));
    }
    faults.join(", ")
}

/// Writes a case as three files: the damaged one, what was meant, and what is to be known of it.
pub(crate) fn write_case(folder: &Path, family: &Family, seed: u64, meant: &Meant) -> Result<(), Error> {
    std::fs::create_dir_all(folder).map_err(Error::io(format!("making {}", folder.display())))?;
    let name = format!("{}-{seed}", family.name);
    mesh::write(&folder.join(format!("{name}.stl")), &meant.damaged).map_err(Error::Mesh)?;
    let intended = format!("{name}.intended.stl");
    mesh::write(&folder.join(&intended), &meant.intended).map_err(Error::Mesh)?;
    let most = Some(*meant.bodies.end()).filter(|most| *most < 1000);
    let facts = serde_json::json!({
        "source": family.about,
        "intended": intended,
        "volume": judge::fidelity(&meant.intended, &meant.intended).volume,
        "bodies": most.map(|most| (*meant.bodies.start()..=most).collect::<Vec<_>>()),
        "tolerance_symmetric_difference": meant.tolerance,
        "needs_review_is_right_too": !family.decides,
    });
    let path = folder.join(format!("{name}.json"));
    std::fs::write(&path, facts.to_string()).map_err(Error::io(format!("writing {}", path.display())))
}
