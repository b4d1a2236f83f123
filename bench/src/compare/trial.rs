//! All runs over one input, and the verdicts on what came out.

use std::path::{Path, PathBuf};
use std::process::Command;

use serde::Deserialize;
use suture_bench::Counts;
use suture_bench::generate::{self, Case, Density};
use suture_bench::judge;

use super::cache;
use super::cgroup::Group;
use super::child::{self, Cost, Ended, Stage};
use super::error::Error;
use super::options::Options;
use super::programs::Programs;
use super::record::{Input, Journal, Line, Outcome, Run, is_good};
use super::sides::Side;
use super::way::Way;

/// The trials of one input after the other.
pub(super) struct Trials<'a> {
    options: &'a Options,
    programs: Programs,
    journal: Journal,
    folder: PathBuf,
    group: Option<Group>,
    /// Processes so far.
    order: usize,
}

/// The part of a report, or of a script's last line, that is looked at here.
#[derive(Deserialize, Default)]
#[serde(default)]
pub(super) struct Said {
    pub(super) stages: Vec<Stage>,
    pub(super) facts: std::collections::BTreeMap<String, u64>,
    pub(super) before: Option<serde_json::Value>,
}

impl<'a> Trials<'a> {
    pub(super) fn new(options: &'a Options, programs: Programs, journal: Journal, folder: &Path) -> Result<Self, Error> {
        let group = options.cgroup.map(Group::make).transpose().map_err(Error::Cgroup)?;
        let order = journal.lines.iter().filter(|line| matches!(line, Line::Run(_))).count();
        Ok(Self { options, programs, journal, folder: folder.into(), group, order })
    }

    /// Over a file from elsewhere.
    pub(super) fn foreign(&mut self, path: &Path) -> Result<(), Error> {
        let bytes = std::fs::metadata(path).map_err(Error::io(format!("looking at {}", path.display())))?.len();
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        // Of binary files, which are what is judged.
        let triangles = bytes.saturating_sub(84) / 50;
        let (size, counts, volume, injected) = (triangles, None, None, Default::default());
        let key = format!("file {name}");
        self.run(Input { key, case: name, size, files: 1, seed: None, triangles, bytes, counts, injected, volume }, path)
    }

    /// Over a generated file, or a folder of them, which is removed afterwards.
    pub(super) fn generated(&mut self, case: Case, density: Density, size: u64) -> Result<(), Error> {
        let (seed, files) = (self.options.seed, self.options.many.max(1));
        let name = density.of_case(case);
        let mut input = Input {
            key: format!("{name} {size} {files} {seed}"),
            case: name,
            size,
            files,
            seed: Some(seed),
            triangles: 0,
            bytes: 0,
            counts: None,
            injected: Default::default(),
            volume: None,
        };
        let ways = self.options.ways();
        if !(0..self.options.runs).any(|round| ways.iter().any(|way| self.is_due(&input, way, round))) {
            return Ok(());
        }
        let path = self.folder.join(if files == 1 { format!("{case}-{size}.stl") } else { format!("{case}-{size}") });
        if files > 1 {
            std::fs::create_dir(&path).map_err(Error::io("making a folder of inputs"))?;
        }
        for number in 0..files {
            let file = if files == 1 { path.clone() } else { path.join(format!("{number:04}.stl")) };
            let truth = generate::write_file_at(case, density, size, seed + number, &file)?;
            input.triangles += truth.counts.triangles;
            input.bytes += std::fs::metadata(&file).map_err(Error::io("looking at an input"))?.len();
            if files == 1 {
                input.counts = Some(truth.counts);
                input.volume = Some(truth.volume);
                input.injected = truth.injected.into_iter().map(|(name, count)| (name.into(), count)).collect();
            }
        }
        self.run(input, &path)?;
        remove(&path)
    }

    fn run(&mut self, input: Input, path: &Path) -> Result<(), Error> {
        eprintln!("{}, {} triangles{}", input.case, input.triangles, if input.files > 1 { " in all" } else { "" });
        let ways = self.options.ways();
        let known = |line: &Line| matches!(line, Line::Input(other) if other.key == input.key);
        if !self.journal.lines.iter().any(known) {
            self.journal.write(Line::Input(input.clone()))?;
        }
        for round in 0..self.options.runs {
            let mut turns: Vec<_> = ways.iter().collect();
            if round % 2 == 1 {
                turns.reverse();
            }
            for way in turns {
                if self.is_due(&input, way, round) {
                    self.once(&input, path, way, round)?;
                }
            }
        }
        Ok(())
    }

    /// Is this run still to be done? Not if it was done in the file that is resumed, if a run of this way over this input had to be
    /// killed, or if one more of them would take too much time.
    fn is_due(&self, input: &Input, way: &Way, round: usize) -> bool {
        let runs = self.journal.lines.iter().filter_map(|line| match line {
            Line::Run(run) if run.input == input.key && run.way == *way => Some(run),
            _ => None,
        });
        let (mut all, mut last) = (0.0, 0.0);
        for run in runs {
            if run.round == round || !run.cost.exited {
                return false;
            }
            last = run.cost.wall_seconds;
            all += last;
        }
        self.options.reaches(way.side, input.size) && (all == 0.0 || all + last <= self.options.patience.as_secs_f64())
    }

    /// One process.
    fn once(&mut self, input: &Input, path: &Path, way: &Way, round: usize) -> Result<(), Error> {
        let output = self.folder.join(if input.files == 1 { "out.stl" } else { "out" });
        let facts = way.side.facts();
        // suture wants a folder for several outputs to be there already; cp makes its own.
        if input.files > 1 && facts.writes && way.side.is_suture() {
            std::fs::create_dir(&output).map_err(Error::io("making a folder of outputs"))?;
        }
        let paths = files(path);
        let cached = cache::bring(way.cache, paths.iter().map(PathBuf::as_path));
        let cached_share = cached.map_err(Error::io("filling or emptying the page cache"))?;
        let command = self.programs.command(way, input.files, path, &output);
        let words = worded(&command, path, &output);
        let command = match &self.group {
            Some(group) => group.hold(&command),
            None => command,
        };
        let target = facts.writes.then_some(output.as_path());
        let Ended { mut cost, said } = child::measure(command, target, way.side.synced(), self.options.limit)?;
        let said = listen(&said);
        cost.stages = said.stages;
        cost.facts = said.facts;
        if let Some(peak) = self.group.as_ref().and_then(Group::peak_bytes) {
            cost.facts.insert("cgroup peak bytes".into(), peak);
        }
        eprintln!("  {:40} {:>9.3} s wall {:>9.3} s CPU  {}", way.name(), cost.wall_seconds, cost.cpu_seconds, cost.end);
        let whole = input.files == 1 && way.side.is_suture();
        let counts_right = said.before.filter(|_| whole).zip(input.counts).map(|(before, counts)| agrees(&before, &counts));
        let output_hash = if whole && output.is_file() { Some(hash(&output)?) } else { None };
        if facts.judged && input.size <= self.options.judge_up_to && !self.is_judged(input, way.side) {
            let outcome = outcome(way.side, input, path, &output, &cost)?;
            self.journal.write(Line::Outcome(outcome))?;
        }
        let (way, order) = (way.clone(), self.order);
        self.order += 1;
        self.journal.write(Line::Run(Run {
            input: input.key.clone(),
            way,
            round,
            order,
            command: words,
            cached_share: Some(cached_share),
            cost,
            output_hash,
            counts_right,
        }))?;
        if output.exists() { remove(&output) } else { Ok(()) }
    }

    fn is_judged(&self, input: &Input, side: Side) -> bool {
        let same = |outcome: &Outcome| outcome.input == input.key && outcome.side == side;
        self.journal.lines.iter().any(|line| matches!(line, Line::Outcome(outcome) if same(outcome)))
    }
}

/// A file itself, or the files of a folder, by name.
fn files(path: &Path) -> Vec<PathBuf> {
    let Ok(entries) = std::fs::read_dir(path) else { return vec![path.into()] };
    let mut files: Vec<_> = entries.flatten().map(|entry| entry.path()).collect();
    files.sort_unstable();
    files
}

/// Removes a file, or a folder with all in it.
pub(super) fn remove(path: &Path) -> Result<(), Error> {
    let removed = if path.is_dir() { std::fs::remove_dir_all(path) } else { std::fs::remove_file(path) };
    removed.map_err(Error::io(format!("removing {}", path.display())))
}

/// A command line with IN and OUT for the paths, and programs by their names.
pub(super) fn worded(command: &Command, input: &Path, output: &Path) -> String {
    let name = |path: &Path| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let mut words = vec![name(Path::new(command.get_program()))];
    for word in command.get_args() {
        let path = Path::new(word);
        let text = word.to_string_lossy();
        let word = match () {
            () if path == input => "IN".into(),
            () if path == output => "OUT".into(),
            () if path.starts_with(input) => "IN/*".into(),
            () if path.is_absolute() => name(path),
            () => text.replace(&*output.to_string_lossy(), "OUT"),
        };
        if words.last() != Some(&word) {
            words.push(word);
        }
    }
    words.join(" ")
}

/// What a program says of itself: its stages summed over all files, in the order of their first appearance.
pub(super) fn listen(text: &str) -> Said {
    let mut all = Said::default();
    for said in text.lines().filter_map(|line| serde_json::from_str::<Said>(line).ok()) {
        for stage in said.stages {
            match all.stages.iter_mut().find(|other| other.name == stage.name) {
                Some(known) => known.seconds += stage.seconds,
                None => all.stages.push(stage),
            }
        }
        let count = |name: &str| said.before.as_ref().and_then(|before| before["self_intersections"][name].as_u64());
        let pairs = count("crossing_pairs").zip(count("overlapping_pairs")).map(|(crossing, overlapping)| crossing + overlapping);
        for (name, count) in said.facts.into_iter().chain(pairs.map(|pairs| ("pairs".into(), pairs))) {
            *all.facts.entry(name).or_insert(0) += count;
        }
        all.before = said.before;
    }
    all
}

/// Does suture count what the generator put there?
fn agrees(before: &serde_json::Value, truth: &Counts) -> bool {
    let count = |name: &str| before[name].as_u64();
    let duplicates = count("duplicates_same").zip(count("duplicates_opposite")).map(|(same, opposite)| same + opposite);
    duplicates == Some(truth.duplicates)
        && [
            ("triangles", truth.triangles),
            ("degenerate_index", truth.degenerate_index),
            ("degenerate_area", truth.degenerate_area),
            ("boundary_edges", truth.boundary_edges),
            ("boundary_loops", truth.boundary_loops),
            ("nonmanifold_edges", truth.nonmanifold_edges),
            ("nonmanifold_vertices", truth.nonmanifold_vertices),
            ("inconsistent_edges", truth.inconsistent_edges),
            ("unbalanced_edges", truth.unbalanced_edges),
            ("components", truth.components),
        ]
        .into_iter()
        .all(|(name, expected)| count(name) == Some(expected))
}

fn hash(path: &Path) -> Result<String, Error> {
    let mut hasher = blake3::Hasher::new();
    hasher.update_mmap_rayon(path).map_err(Error::io("hashing an output"))?;
    Ok(hasher.finalize().to_hex().to_string())
}

/// Judges an output, a large one by another process of this program.
fn outcome(side: Side, input: &Input, path: &Path, output: &Path, cost: &Cost) -> Result<Outcome, Error> {
    let mut outcome = Outcome { input: input.key.clone(), side, judged: None, reason: String::new(), good_files: None };
    if input.files > 1 {
        let good = files(output).iter().filter(|file| judge::judge(file).is_ok_and(|judged| is_good(&judged, None))).count();
        outcome.good_files = Some(good as u64);
        return Ok(outcome);
    }
    if !cost.exited || cost.output_bytes.is_none() {
        let last = cost.complaint.lines().last().unwrap_or_default();
        outcome.reason = if last.is_empty() { cost.end.clone() } else { last.into() };
        return Ok(outcome);
    }
    let program = std::env::current_exe().map_err(Error::io("finding this program"))?;
    let judged = Command::new(program).arg("judge").arg(output).arg("--json").arg("--reference").arg(path).output();
    let judged = judged.map_err(Error::io("starting the judge"))?;
    match serde_json::from_slice(&judged.stdout) {
        Ok(judged) => outcome.judged = Some(judged),
        Err(_) => outcome.reason = String::from_utf8_lossy(&judged.stderr).trim().into(),
    }
    Ok(outcome)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stages_of_several_files_are_summed_in_order() {
        let said = listen(
            "noise\n{\"stages\":[{\"name\":\"read\",\"seconds\":1.0},{\"name\":\"emit\",\"seconds\":2.0}]}\n\
             {\"stages\":[{\"name\":\"emit\",\"seconds\":0.5}],\"facts\":{\"pairs\":3}}\n\
             {\"before\":{\"self_intersections\":{\"crossing_pairs\":2,\"overlapping_pairs\":1}}}\n\
             {\"before\":{\"self_intersections\":null}}\n",
        );
        let stages: Vec<_> = said.stages.iter().map(|stage| (stage.name.as_str(), stage.seconds)).collect();
        assert_eq!(stages, [("read", 1.0), ("emit", 2.5)]);
        assert_eq!(said.facts["pairs"], 6);
    }

    #[test]
    fn a_command_is_published_without_places() {
        let mut command = Command::new("/somewhere/bin/suture");
        command.args(["repair", "/tmp/x/many/0000.stl", "/tmp/x/many/0001.stl", "-o", "/tmp/x/out", "--json"]);
        assert_eq!(worded(&command, Path::new("/tmp/x/many"), Path::new("/tmp/x/out")), "suture repair IN/* -o OUT --json");
        let mut command = Command::new("admesh");
        command.args(["--write-binary-stl=/tmp/x/out", "/tmp/x/in"]);
        assert_eq!(worded(&command, Path::new("/tmp/x/in"), Path::new("/tmp/x/out")), "admesh --write-binary-stl=OUT IN");
    }

    #[test]
    fn one_wrong_count_is_disagreement() {
        let truth = Counts { triangles: 9, duplicates: 3, ..Counts::default() };
        let mut before = serde_json::json!({"duplicates_same": 2, "duplicates_opposite": 1, "triangles": 9});
        for name in ["degenerate_index", "degenerate_area", "boundary_edges", "boundary_loops", "nonmanifold_edges"] {
            before[name] = 0.into();
        }
        for name in ["nonmanifold_vertices", "inconsistent_edges", "unbalanced_edges", "components"] {
            before[name] = 0.into();
        }
        assert!(agrees(&before, &truth));
        before["components"] = 1.into();
        assert!(!agrees(&before, &truth));
    }
}
