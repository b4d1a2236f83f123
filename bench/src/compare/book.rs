//! All raw runs together. Where sessions overlap, the last one that has what is asked for answers.

use std::path::Path;

use suture_bench::generate::Case;

use super::child::Cost;
use super::error::Error;
use super::filled::Filled;
use super::made::{Closed, Shaped, Skinned, Solved, Understood};
use super::record::{Input, Line, Outcome, Run, Session, read};
use super::sides::Side;
use super::simplified::Simplified;
use super::statistics::Spread;
use super::stored::Stored;
use super::transfer::Transfer;
use super::way::Way;

/// One raw file.
pub(super) struct Chapter {
    pub(super) name: String,
    lines: Vec<Line>,
}

/// Every raw file, the last one last.
pub(super) struct Book {
    pub(super) chapters: Vec<Chapter>,
}

impl Chapter {
    pub(super) fn sessions(&self) -> impl Iterator<Item = &Session> {
        self.lines.iter().filter_map(|line| if let Line::Session(session) = line { Some(session) } else { None })
    }

    /// Sides that were left out, and why.
    pub(super) fn skipped(&self) -> impl Iterator<Item = (Side, &str)> {
        self.lines
            .iter()
            .filter_map(|line| if let Line::Skipped { side, reason } = line { Some((*side, reason.as_str())) } else { None })
    }

    pub(super) fn shaped(&self) -> impl Iterator<Item = &Shaped> {
        self.lines.iter().filter_map(|line| if let Line::Shaped(shaped) = line { Some(shaped) } else { None })
    }

    pub(super) fn closed(&self) -> impl Iterator<Item = &Closed> {
        self.lines.iter().filter_map(|line| if let Line::Closed(closed) = line { Some(closed) } else { None })
    }

    pub(super) fn solved(&self) -> impl Iterator<Item = &Solved> {
        self.lines.iter().filter_map(|line| if let Line::Solved(solved) = line { Some(&**solved) } else { None })
    }

    pub(super) fn understood(&self) -> impl Iterator<Item = &Understood> {
        self.lines.iter().filter_map(|line| if let Line::Understood(understood) = line { Some(understood) } else { None })
    }

    pub(super) fn skinned(&self) -> impl Iterator<Item = &Skinned> {
        self.lines.iter().filter_map(|line| if let Line::Skinned(skinned) = line { Some(&**skinned) } else { None })
    }

    pub(super) fn filled(&self) -> impl Iterator<Item = &Filled> {
        self.lines.iter().filter_map(|line| if let Line::Filled(filled) = line { Some(&**filled) } else { None })
    }

    pub(super) fn simplified(&self) -> impl Iterator<Item = &Simplified> {
        self.lines.iter().filter_map(|line| if let Line::Simplified(made) = line { Some(&**made) } else { None })
    }

    pub(super) fn stored(&self) -> impl Iterator<Item = &Stored> {
        self.lines.iter().filter_map(|line| if let Line::Stored(stored) = line { Some(&**stored) } else { None })
    }

    pub(super) fn transfers(&self) -> impl Iterator<Item = &Transfer> {
        self.lines.iter().filter_map(|line| if let Line::Transfer(transfer) = line { Some(transfer) } else { None })
    }

    #[cfg(test)]
    pub(super) fn of(name: &str, lines: Vec<Line>) -> Self {
        Self { name: name.into(), lines }
    }

    #[cfg(test)]
    pub(super) fn lines_mut(&mut self) -> &mut [Line] {
        &mut self.lines
    }

    fn runs<'a, 'i>(&'a self, input: &'i Input) -> impl Iterator<Item = &'a Run> + use<'a, 'i> {
        self.lines.iter().filter_map(move |line| match line {
            Line::Run(run) if run.input == input.key => Some(run),
            _ => None,
        })
    }

    fn began(&self) -> u64 {
        self.sessions().map(|session| session.began).max().unwrap_or(0)
    }
}

impl Book {
    /// Reads every raw file of a folder.
    ///
    /// # Errors
    /// When one cannot be read, or there is none.
    pub(super) fn load(folder: &Path) -> Result<Self, Error> {
        let mut chapters = Vec::new();
        for entry in std::fs::read_dir(folder).map_err(Error::io(format!("reading {}", folder.display())))?.flatten() {
            let path = entry.path();
            if path.extension().is_some_and(|extension| extension == "jsonl") {
                let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
                chapters.push(Chapter { name, lines: read(&path)? });
            }
        }
        chapters.sort_by_key(|chapter| (chapter.began(), chapter.name.clone()));
        if chapters.is_empty() { Err(Error::NoRuns(folder.into())) } else { Ok(Self { chapters }) }
    }

    /// The lines of the last raw file that has such lines.
    pub(super) fn last<'a, T>(&'a self, lines: impl Fn(&'a Chapter) -> Vec<T>) -> Vec<T> {
        self.chapters.iter().rev().map(lines).find(|lines| !lines.is_empty()).unwrap_or_default()
    }

    /// Every input that something ran over: generated ones by case and size, then folders, then files from elsewhere.
    pub(super) fn inputs(&self) -> Vec<&Input> {
        let mut inputs: Vec<&Input> = Vec::new();
        for line in self.chapters.iter().rev().flat_map(|chapter| &chapter.lines) {
            if let Line::Input(input) = line
                && !inputs.iter().any(|other| other.key == input.key)
            {
                inputs.push(input);
            }
        }
        inputs.retain(|input| self.chapters.iter().any(|chapter| chapter.runs(input).next().is_some()));
        inputs.sort_by_key(|input| {
            let case = input.case.split(' ').next().and_then(|name| Case::ALL.iter().position(|case| case.name() == name));
            // The case that has everything first.
            let case = if input.case.starts_with("mixed") { Some(0) } else { case.map(|at| at + 1) };
            (input.seed.is_none(), input.files > 1, input.size, case, input.key.clone())
        });
        inputs
    }

    /// The ways that ran over an input.
    pub(super) fn ways(&self, input: &Input) -> Vec<Way> {
        let runs = self.chapters.iter().flat_map(|chapter| chapter.runs(input));
        let mut ways: Vec<_> = runs.map(|run| run.way.clone()).collect();
        ways.sort_unstable();
        ways.dedup();
        ways
    }

    /// The runs of a way over an input.
    pub(super) fn runs(&self, input: &Input, way: &Way) -> Vec<&Run> {
        let of = |chapter: &'_ Chapter| -> bool { chapter.runs(input).any(|run| run.way == *way) };
        let last = self.chapters.iter().rev().find(|chapter| of(chapter));
        last.map_or(Vec::new(), |chapter| chapter.runs(input).filter(|run| run.way == *way).collect())
    }

    /// A quantity over the runs of a way; `None` unless all did their work.
    pub(super) fn spread(&self, input: &Input, way: &Way, value: impl Fn(&Cost) -> Option<f64>) -> Option<Spread> {
        let runs = self.runs(input, way);
        let all = !runs.is_empty() && runs.iter().all(|run| did_its_work(input, run));
        let values: Option<Vec<f64>> = runs.iter().map(|run| value(&run.cost)).collect();
        values.filter(|_| all).and_then(Spread::of)
    }

    pub(super) fn wall(&self, input: &Input, way: &Way) -> Option<Spread> {
        self.spread(input, way, |cost| Some(cost.wall_seconds))
    }

    /// How much longer one way took than another, over the pairs of one round of one session.
    pub(super) fn wall_ratio(&self, input: &Input, slow: &Way, fast: &Way) -> Option<Spread> {
        self.ratio(input, slow, fast, |cost| Some(cost.wall_seconds))
    }

    /// The same for a part of the slow one's time.
    pub(super) fn ratio(&self, input: &Input, slow: &Way, fast: &Way, part: impl Fn(&Cost) -> Option<f64>) -> Option<Spread> {
        self.chapters.iter().rev().find_map(|chapter| {
            let good = |way: &Way| -> Vec<&Run> {
                chapter.runs(input).filter(|run| run.way == *way && did_its_work(input, run)).collect()
            };
            let quick = good(fast);
            let pairs = good(slow).into_iter().filter_map(|run| {
                let other = quick.iter().find(|other| other.round == run.round)?;
                Some(part(&run.cost)? / other.cost.wall_seconds)
            });
            Spread::of(pairs)
        })
    }

    /// Seconds that the search for self-intersections adds to `suture inspect`, seconds of MeshLib's call alone, and the ratio, over
    /// the rounds of one session that have all three processes. Suture searches while it looks at the topology, so that there is no
    /// stage to be timed.
    pub(super) fn search(&self, input: &Input) -> Option<[Spread; 3]> {
        self.chapters.iter().rev().find_map(|chapter| {
            let good = |side: Side, round: usize| {
                let mut runs = chapter.runs(input).filter(|run| run.way == Way::plain(side) && run.round == round);
                runs.find(|run| did_its_work(input, run)).map(|run| &run.cost)
            };
            let rounds = (0..).map_while(|round| good(Side::MeshlibDetect, round).map(|theirs| (round, theirs)));
            let pairs: Vec<_> = rounds
                .filter_map(|(round, theirs)| {
                    let with = good(Side::Inspect, round)?.wall_seconds;
                    let ours = with - good(Side::InspectNoSi, round)?.wall_seconds;
                    // A search shorter than the noise of two processes says nothing.
                    (ours > 0.0).then_some((ours, theirs.stage_seconds("self-intersections")?))
                })
                .collect();
            let ours = Spread::of(pairs.iter().map(|pair| pair.0))?;
            let theirs = Spread::of(pairs.iter().map(|pair| pair.1))?;
            Some([ours, theirs, Spread::of(pairs.iter().map(|pair| pair.1 / pair.0))?])
        })
    }

    /// A count that all runs of a side agree on.
    pub(super) fn fact(&self, input: &Input, side: Side, name: &str) -> Option<u64> {
        let runs = self.runs(input, &Way::plain(side));
        let first = *runs.first()?.cost.facts.get(name)?;
        runs.iter().all(|run| run.cost.facts.get(name) == Some(&first)).then_some(first)
    }

    /// The output that a side made of an input, judged.
    pub(super) fn outcome(&self, input: &Input, side: Side) -> Option<&Outcome> {
        self.chapters.iter().rev().flat_map(|chapter| &chapter.lines).find_map(|line| match line {
            Line::Outcome(outcome) if outcome.input == input.key && outcome.side == side => Some(outcome),
            _ => None,
        })
    }

    /// Of all runs of suture over an input, how many gave a file, how many different files these were, and how many counted what
    /// the generator put there, of how many. The last session only: another one may have had another version.
    pub(super) fn sameness(&self, input: &Input) -> Option<Sameness> {
        self.chapters.iter().rev().find_map(|chapter| {
            let runs: Vec<_> = chapter.runs(input).filter(|run| run.way.side.is_suture()).collect();
            let mut hashes: Vec<_> = runs.iter().filter_map(|run| run.output_hash.as_deref()).collect();
            let outputs = hashes.len();
            hashes.sort_unstable();
            hashes.dedup();
            let counted: Vec<_> = runs.iter().filter_map(|run| run.counts_right).collect();
            let right = counted.iter().filter(|right| **right).count();
            (outputs > 0).then_some(Sameness { outputs, distinct: hashes.len(), counted: counted.len(), right })
        })
    }
}

/// Promises of suture's, looked at in passing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sameness {
    pub(super) outputs: usize,
    pub(super) distinct: usize,
    pub(super) counted: usize,
    pub(super) right: usize,
}

/// Did a process do what it was to do? Exit code 1 of suture: done, but the file is not good; over a folder: one of many failed.
pub(super) fn did_its_work(input: &Input, run: &Run) -> bool {
    let output = !run.way.side.facts().writes || run.cost.output_bytes.is_some();
    let may_be_1 = run.way.side.may_exit_1() || input.files > 1;
    output && (run.cost.code == Some(0) || run.cost.code == Some(1) && may_be_1)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::compare::child::Stage;

    pub(in crate::compare) fn input(case: &str, size: u64) -> Input {
        let key = format!("{case} {size}");
        let (case, injected) = (case.to_owned(), Default::default());
        let (counts, volume, bytes) = (Some(Default::default()), Some(1.0), 84 + 50 * size);
        Input { key, case, size, files: 1, seed: Some(1), triangles: size, bytes, counts, injected, volume }
    }

    /// Runs of one round after the other, each with wall seconds and exit code.
    pub(in crate::compare) fn chapter(input: &Input, runs: &[(Side, f64, i32)]) -> Chapter {
        let mut lines = vec![Line::Input(input.clone())];
        for (order, &(side, wall_seconds, code)) in runs.iter().enumerate() {
            let round = runs[..order].iter().filter(|run| run.0 == side).count();
            let cost = Cost {
                wall_seconds,
                peak_resident_bytes: 1_000_000,
                end: format!("exit {code}"),
                exited: true,
                code: Some(code),
                output_bytes: (code < 2).then_some(84),
                stages: vec![Stage { name: "self-intersections".into(), seconds: wall_seconds / 2.0 }],
                ..Cost::default()
            };
            let (command, way) = (side.facts().name.into(), Way::plain(side));
            let run = Run {
                input: input.key.clone(),
                way,
                round,
                order,
                command,
                cached_share: None,
                cost,
                output_hash: side.is_suture().then(|| "aa".into()),
                counts_right: Some(true),
            };
            lines.push(Line::Run(run));
        }
        Chapter { name: "a".into(), lines }
    }

    fn way(side: Side) -> Way {
        Way::plain(side)
    }

    #[test]
    fn ratio_is_the_median_of_pairs_not_the_ratio_of_medians() {
        let input = input("holes", 1000);
        let runs: Vec<_> = [(1.0, 10.0), (2.0, 30.0), (4.0, 20.0)]
            .iter()
            .flat_map(|&(fast, slow)| [(Side::Suture, fast, 0), (Side::PymeshlabPlain, slow, 0)])
            .collect();
        let book = Book { chapters: vec![chapter(&input, &runs)] };
        let ratio = book.wall_ratio(&input, &way(Side::PymeshlabPlain), &way(Side::Suture)).unwrap();
        assert_eq!((ratio.median, ratio.least, ratio.most, ratio.count), (10.0, 5.0, 15.0, 3));
    }

    #[test]
    fn a_side_that_failed_has_no_time() {
        let input = input("holes", 1000);
        let book = Book { chapters: vec![chapter(&input, &[(Side::Suture, 1.0, 2), (Side::PymeshlabPlain, 5.0, 0)])] };
        assert_eq!(book.wall(&input, &way(Side::Suture)), None);
        assert_eq!(book.wall_ratio(&input, &way(Side::PymeshlabPlain), &way(Side::Suture)), None);
        assert_eq!(book.wall(&input, &way(Side::PymeshlabPlain)).map(|spread| spread.median), Some(5.0));
    }

    #[test]
    fn the_last_session_that_has_a_figure_gives_it() {
        let input = input("mixed", 1000);
        let early = chapter(&input, &[(Side::Suture, 4.0, 0), (Side::PymeshlabPlain, 8.0, 0)]);
        let late = chapter(&input, &[(Side::Suture, 1.0, 1)]);
        let book = Book { chapters: vec![early, late] };
        assert_eq!(book.wall(&input, &way(Side::Suture)).map(|spread| spread.median), Some(1.0));
        // Never a pair of runs of different sessions.
        let ratio = book.wall_ratio(&input, &way(Side::PymeshlabPlain), &way(Side::Suture)).unwrap();
        assert_eq!((ratio.median, ratio.count), (2.0, 1));
        assert_eq!(book.inputs().len(), 1);
        assert_eq!(book.sameness(&input), Some(Sameness { outputs: 1, distinct: 1, counted: 1, right: 1 }));
    }

    #[test]
    fn the_search_is_what_it_adds() {
        let input = input("mixed", 1000);
        // MeshLib's stage is half of its process.
        let runs =
            [(Side::Inspect, 3.0, 1), (Side::InspectNoSi, 2.0, 1), (Side::MeshlibDetect, 8.0, 0), (Side::MeshlibDetect, 9.0, 0)];
        let book = Book { chapters: vec![chapter(&input, &runs)] };
        let [ours, theirs, ratio] = book.search(&input).unwrap();
        assert_eq!((ours.median, theirs.median, ratio.median, ratio.count), (1.0, 4.0, 4.0, 1));
    }
}
