//! Raw runs: what is kept of a comparison, one JSON object a line, one file a session. Pages and plots are made from these alone.

use std::collections::{BTreeMap, HashSet};
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use suture_bench::Counts;
use suture_bench::judge::{Judgement, Kept};

use super::child::Cost;
use super::error::Error;
use super::filled::Filled;
use super::machine::Machine;
use super::made::{Closed, Shaped, Skinned, Solved, Understood};
use super::sides::Side;
use super::simplified::Simplified;
use super::statistics::spaced;
use super::stored::Stored;
use super::transfer::Transfer;
use super::way::Way;

/// A line of a raw file.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub(crate) enum Line {
    /// A comparison began; a file that was resumed has several.
    Session(Session),
    Input(Input),
    Run(Run),
    Outcome(Outcome),
    Shaped(Shaped),
    Closed(Closed),
    Solved(Box<Solved>),
    Understood(Understood),
    Skinned(Box<Skinned>),
    Transfer(Transfer),
    Filled(Box<Filled>),
    Simplified(Box<Simplified>),
    Stored(Box<Stored>),
    /// Something was left out, and why.
    Skipped {
        side: Side,
        reason: String,
    },
}

/// When, how and where a comparison ran.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Session {
    /// Seconds since 1970, UTC.
    pub(crate) began: u64,
    /// The command line.
    pub(crate) command: String,
    pub(crate) machine: Machine,
}

/// A file, or a folder of files, that programs ran over.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Input {
    /// Names it in runs and outcomes.
    pub(crate) key: String,
    /// The generated case, or the name of a file from elsewhere.
    pub(crate) case: String,
    /// The size asked for, of each file; of a file from elsewhere, its triangles.
    pub(crate) size: u64,
    pub(crate) files: u64,
    /// Of a generated file.
    pub(crate) seed: Option<u64>,
    /// In all files together.
    pub(crate) triangles: u64,
    pub(crate) bytes: u64,
    /// Its defects, where they are known.
    pub(crate) counts: Option<Counts>,
    #[serde(default)]
    pub(crate) injected: BTreeMap<String, u64>,
    /// Volume of the sound model, where that is known.
    pub(crate) volume: Option<f64>,
}

/// One process.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Run {
    /// [`Input::key`].
    pub(crate) input: String,
    #[serde(flatten)]
    pub(crate) way: Way,
    /// From 0; runs of equal round are a pair.
    pub(crate) round: usize,
    /// Its place among all processes of the session.
    pub(crate) order: usize,
    pub(crate) command: String,
    /// Share of the input's pages in the page cache at the start.
    pub(crate) cached_share: Option<f64>,
    pub(crate) cost: Cost,
    /// BLAKE3 of suture's output.
    pub(crate) output_hash: Option<String>,
    /// Suture's counts of the input are those that the generator put there.
    pub(crate) counts_right: Option<bool>,
}

/// The output that a side made of an input, judged.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Outcome {
    pub(crate) input: String,
    pub(crate) side: Side,
    /// Of a single file. `None` when there was nothing to judge.
    pub(crate) judged: Option<Judged>,
    /// Why there was nothing to judge.
    #[serde(default)]
    pub(crate) reason: String,
    /// Of a folder: how many outputs are good.
    pub(crate) good_files: Option<u64>,
}

impl Outcome {
    /// `good`, or all that is wrong.
    pub(super) fn verdict(&self, input: &Input) -> String {
        if let Some(good) = self.good_files {
            return format!("{} of {} good", spaced(good), spaced(input.files));
        }
        let Some(judged) = &self.judged else { return self.reason.replace(['|', '\n'], " ") };
        if is_good(&judged.judgement, input.volume) {
            return "good".into();
        }
        let counts = &judged.judgement.counts;
        let faults = [
            (counts.boundary_edges, "boundary edges"),
            (counts.nonmanifold_edges, "non-manifold edges"),
            (counts.nonmanifold_vertices, "non-manifold vertices"),
            (counts.inconsistent_edges, "disagreeing edges"),
        ];
        let mut faults: Vec<_> =
            faults.into_iter().filter(|&(count, _)| count > 0).map(|(count, name)| format!("{} {name}", spaced(count))).collect();
        if let Some(volume) = input.volume.filter(|_| judged.judgement.sound()) {
            faults.push(format!("volume {:+.1} %", 100.0 * (judged.judgement.volume / volume - 1.0)));
        }
        if faults.is_empty() { "not closed".into() } else { faults.join(", ") }
    }
}

/// The judge's word on an output.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Judged {
    pub(crate) judgement: Judgement,
    /// Records of the input that stand in the output byte for byte, in order.
    pub(crate) records: Kept,
    /// The same by the 36 bytes of their corners alone.
    pub(crate) corners: Kept,
}

/// Closed, manifold, oriented, and of the model's volume within a hundredth where that is known.
pub(crate) fn is_good(judgement: &Judgement, volume: Option<f64>) -> bool {
    judgement.sound() && volume.is_none_or(|volume| (judgement.volume / volume - 1.0).abs() <= 0.01)
}

/// One raw file, being written: every line is in the file before the next process starts.
pub(super) struct Journal {
    file: File,
    path: PathBuf,
    /// The lines that are in it.
    pub(super) lines: Vec<Line>,
}

impl Journal {
    /// Opens `path`, to go on where it ends if `resume`, else anew.
    pub(super) fn open(path: &Path, resume: bool) -> Result<Self, Error> {
        let action = || format!("opening {}", path.display());
        if let Some(folder) = path.parent() {
            std::fs::create_dir_all(folder).map_err(Error::io(action()))?;
        }
        let lines = if resume && path.exists() { read(path)? } else { Vec::new() };
        let file = if resume { File::options().create(true).append(true).open(path) } else { File::create(path) };
        Ok(Self { file: file.map_err(Error::io(action()))?, path: path.into(), lines })
    }

    pub(super) fn understood(&self) -> impl Iterator<Item = &Understood> {
        self.lines.iter().filter_map(|line| if let Line::Understood(understood) = line { Some(understood) } else { None })
    }

    /// Has such a line been written?
    pub(super) fn has(&self, is: impl Fn(&Line) -> bool) -> bool {
        self.lines.iter().any(is)
    }

    /// Of lines that have the same key, drops all but the last one.
    pub(super) fn retain_newest(&mut self, key: impl Fn(&Line) -> Option<(String, Side)>) -> Result<(), Error> {
        self.retain(|lines| {
            let mut seen = HashSet::new();
            let mut keep: Vec<bool> = lines.iter().rev().map(|line| key(line).is_none_or(|key| seen.insert(key))).collect();
            keep.reverse();
            keep
        })
    }

    /// Drops those lines that `keep` says no to, in the file as well: all at once, so that it is never half of what it was.
    fn retain(&mut self, keep: impl Fn(&[Line]) -> Vec<bool>) -> Result<(), Error> {
        let mut kept = keep(&self.lines).into_iter();
        self.lines.retain(|_| kept.next().unwrap_or(true));
        let mut text = String::new();
        for line in &self.lines {
            text += &serde_json::to_string(line)?;
            text.push('\n');
        }
        let action = || format!("writing {}", self.path.display());
        let fresh = self.path.with_extension("new");
        std::fs::write(&fresh, text).map_err(Error::io(action()))?;
        std::fs::rename(&fresh, &self.path).map_err(Error::io(action()))?;
        self.file = File::options().append(true).open(&self.path).map_err(Error::io(action()))?;
        Ok(())
    }

    pub(super) fn write(&mut self, line: Line) -> Result<(), Error> {
        let text = serde_json::to_string(&line)? + "\n";
        self.lines.push(line);
        self.file.write_all(text.as_bytes()).map_err(Error::io(format!("writing {}", self.path.display())))
    }
}

/// The lines of a raw file. A last line that was cut off is left out.
///
/// # Errors
/// When the file cannot be read, or a line in it is none.
pub(crate) fn read(path: &Path) -> Result<Vec<Line>, Error> {
    let text = std::fs::read_to_string(path).map_err(Error::io(format!("reading {}", path.display())))?;
    parse(&text).map_err(|(line, source)| Error::Line { path: path.into(), line, source })
}

fn parse(text: &str) -> Result<Vec<Line>, (usize, serde_json::Error)> {
    let whole = text.rfind('\n').map_or("", |end| &text[..=end]);
    whole.lines().enumerate().map(|(at, line)| serde_json::from_str(line).map_err(|error| (at + 1, error))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(round: usize) -> Line {
        let way = Way { threads: Some(1), ..Way::plain(Side::Suture) };
        let cost = Cost { wall_seconds: 1.5, ..Cost::default() };
        let (input, command) = ("mixed-1000".into(), "suture repair IN -o OUT".into());
        let (cached_share, output_hash, counts_right) = (Some(1.0), None, Some(true));
        Line::Run(Run { input, way, round, order: round, command, cached_share, cost, output_hash, counts_right })
    }

    #[test]
    fn lines_read_back_and_a_cut_one_is_dropped() {
        let text: String = (0..3).map(|round| serde_json::to_string(&run(round)).unwrap() + "\n").collect();
        let cut = &text[..text.len() - 5];
        let lines = parse(cut).unwrap();
        assert_eq!(lines.len(), 2);
        let Line::Run(back) = &lines[1] else { panic!("{lines:?}") };
        assert_eq!((back.round, back.way.threads, back.way.side), (1, Some(1), Side::Suture));
        assert_eq!(back.way.name(), "suture, 1 thread");
    }

    #[test]
    fn a_spoilt_line_is_named() {
        assert_eq!(parse("{\"kind\":\"nonsense\"}\n").unwrap_err().0, 1);
    }

    #[test]
    fn a_journal_goes_on_where_it_ended() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("new/raw.jsonl");
        Journal::open(&path, true).unwrap().write(run(0)).unwrap();
        let mut journal = Journal::open(&path, true).unwrap();
        assert_eq!(journal.lines.len(), 1);
        journal.write(run(1)).unwrap();
        assert_eq!(read(&path).unwrap().len(), 2);
        journal.retain(|lines| vec![false; lines.len() - 1]).unwrap();
        journal.write(run(2)).unwrap();
        let rounds: Vec<_> =
            read(&path).unwrap().iter().map(|line| if let Line::Run(run) = line { run.round } else { 9 }).collect();
        assert_eq!(rounds, [1, 2]);
        assert!(Journal::open(&path, false).unwrap().lines.is_empty());
        assert_eq!(read(&path).unwrap().len(), 0);
    }
}
