//! The published page.

use std::fmt::Write;

use super::{Cost, Judged, Results, Side, Trial};

const ABOUT: &str = "\
Written by `suture-bench compare`; every single run is in `results.json` beside this page.

Each program runs as a whole process over the same file, in alternation. The input is in the page cache, everything else is
written back before the start, and the time ends when the output is synced to the disk. Times are medians over the runs, a ratio
is the median of the ratios of runs that followed each other. CPU is user and system time; memory is the largest resident set, in
which Suture's mapped input counts although the system can take it back. *plain* and *competent* are two pymeshlab scripts
(`pipelines/`): every filter with its defaults, and what someone who knows pymeshlab well would write.

The outputs of all programs are judged by the same check, which shares no code with Suture (`src/judge`): *good* is closed,
manifold and consistently oriented, with the sound model's volume within 1 %. Self-intersection is not looked at. *Kept* is the
share of input records that stand in the output byte for byte and in order; where another program writes its own normals or
attributes, the share by corners alone follows.

PyMeshLab is under GPL-3; it is installed by the command, runs as a separate process, and no part of it is in Suture.
";

/// The table of words among tables of numbers.
const OUTCOME: &str = "Outcome";

const REPAIRERS: [Side; 3] = [Side::Suture, Side::Plain, Side::Competent];

/// The whole page, in Markdown.
pub(super) fn page(results: &Results) -> String {
    let machine = &results.machine;
    let mut page = format!("# Suture beside pymeshlab\n\n{ABOUT}\n```\n{}\n```\n\n", results.command);
    let facts = [
        format!("{}, {} processors, {:.1} GB", machine.processor, machine.processors, machine.memory_bytes as f64 / 1e9),
        format!("{}, files on {}, load {} at the start", machine.kernel, machine.file_system, machine.load),
        machine.versions.join(", "),
    ];
    for fact in facts {
        let _ = writeln!(page, "* {fact}");
    }
    let mut sizes: Vec<u64> = results.trials.iter().map(|trial| trial.size).collect();
    sizes.sort_unstable();
    sizes.dedup();
    for size in sizes {
        let trials: Vec<_> = results.trials.iter().filter(|trial| trial.size == size).collect();
        let runs = trials.iter().flat_map(|trial| &trial.runs).map(|run| run.run + 1).max().unwrap_or(0);
        let _ = write!(page, "\n## About {} triangles, {runs} runs\n", spaced(size));
        page += &times(&trials);
        page += &costs(&trials);
        page += &outcomes(&trials);
        page += &bounds(&trials);
    }
    page
}

/// A table of the trials' rows.
fn table(title: &str, head: &[&str], trials: &[&Trial], row: impl Fn(&Trial) -> Vec<String>) -> String {
    let rule = if title == OUTCOME { "---|" } else { "---:|" }.repeat(head.len());
    let mut text = format!("\n### {title}\n\n| case | {} |\n|---|{rule}\n", head.join(" | "));
    for trial in trials {
        let _ = writeln!(text, "| {} | {} |", trial.case, row(trial).join(" | "));
    }
    text
}

fn times(trials: &[&Trial]) -> String {
    let head = ["triangles", "suture s", "million triangles/s", "plain s", "competent s", "× plain", "× competent"];
    table("Time", &head, trials, |trial| {
        let wall = |side| median(trial, side, |cost| cost.wall_seconds);
        let speed = wall(Side::Suture).map(|seconds| trial.counts.triangles as f64 / seconds / 1e6);
        vec![
            spaced(trial.counts.triangles),
            seconds(trial, Side::Suture, wall(Side::Suture)),
            number(speed),
            seconds(trial, Side::Plain, wall(Side::Plain)),
            seconds(trial, Side::Competent, wall(Side::Competent)),
            number(ratio(trial, Side::Plain, Side::Suture)),
            number(ratio(trial, Side::Competent, Side::Suture)),
        ]
    })
}

fn costs(trials: &[&Trial]) -> String {
    let head = ["suture CPU s", "plain CPU s", "competent CPU s", "suture MB", "plain MB", "competent MB"];
    table("CPU and memory", &head, trials, |trial| {
        let cpu = REPAIRERS.map(|side| number(median(trial, side, |cost| cost.cpu_seconds)));
        let memory = REPAIRERS.map(|side| number(median(trial, side, |cost| cost.peak_resident_bytes as f64 / 1e6)));
        [cpu, memory].concat()
    })
}

fn outcomes(trials: &[&Trial]) -> String {
    let head = ["suture", "plain", "competent", "suture kept", "plain kept", "competent kept"];
    table(OUTCOME, &head, trials, |trial| {
        let judged = |side| trial.outcomes.iter().find(|outcome| outcome.side == side);
        let verdicts = REPAIRERS.map(|side| match judged(side) {
            None => "–".into(),
            Some(outcome) => outcome.judged.as_ref().map_or_else(|| outcome.reason.clone(), |judged| verdict(trial, judged)),
        });
        let shares = REPAIRERS.map(|side| judged(side).and_then(|outcome| outcome.judged.as_ref()).map_or("–".into(), kept));
        [verdicts, shares].concat()
    })
}

fn bounds(trials: &[&Trial]) -> String {
    let head = ["cp s", "cp, synced s", "suture / cp, synced", "inspect s", "inspect / cp"];
    table("Beside a plain copy, and topology alone", &head, trials, |trial| {
        let wall = |side| median(trial, side, |cost| cost.wall_seconds);
        vec![
            seconds(trial, Side::Copy, wall(Side::Copy)),
            seconds(trial, Side::CopySynced, wall(Side::CopySynced)),
            number(ratio(trial, Side::Suture, Side::CopySynced)),
            seconds(trial, Side::Inspect, wall(Side::Inspect)),
            number(ratio(trial, Side::Inspect, Side::Copy)),
        ]
    })
}

/// Did it do its work? (1: done, but the file is not good.)
fn done(side: Side, cost: &Cost) -> bool {
    let output = side == Side::Inspect || cost.output_bytes.is_some();
    output && (cost.code == Some(0) || cost.code == Some(1) && matches!(side, Side::Suture | Side::Inspect))
}

/// The median of a side's runs; `None` unless all did their work.
fn median(trial: &Trial, side: Side, value: impl Fn(&Cost) -> f64) -> Option<f64> {
    let costs: Vec<_> = trial.costs(side).map(|(_, cost)| cost).collect();
    let all = costs.iter().all(|cost| done(side, cost));
    all.then(|| middle(costs.into_iter().map(value).collect())).flatten()
}

/// The median over pairs of runs of how much longer `slow` took than `fast`.
fn ratio(trial: &Trial, slow: Side, fast: Side) -> Option<f64> {
    let pairs = trial.costs(slow).filter(|(_, cost)| done(slow, cost)).filter_map(|(run, slow)| {
        let (_, fast) = trial.costs(fast).find(|(other, cost)| *other == run && done(fast, cost))?;
        Some(slow.wall_seconds / fast.wall_seconds)
    });
    middle(pairs.collect())
}

/// The middle value, or the mean of the two in the middle.
fn middle(mut values: Vec<f64>) -> Option<f64> {
    values.sort_unstable_by(f64::total_cmp);
    let upper = *values.get(values.len() / 2)?;
    let lower = *values.get((values.len() - 1) / 2)?;
    Some((lower + upper) / 2.0)
}

/// Seconds, or why there are none.
fn seconds(trial: &Trial, side: Side, seconds: Option<f64>) -> String {
    let failed = || trial.costs(side).find(|(_, cost)| !done(side, cost)).map(|(_, cost)| cost.end.clone());
    seconds.map_or_else(|| failed().unwrap_or("–".into()), |seconds| number(Some(seconds)))
}

/// Three digits that count.
fn number(value: Option<f64>) -> String {
    value.map_or("–".into(), |value| match value {
        100.0.. => spaced(value.round() as u64),
        10.0.. => format!("{value:.1}"),
        1.0.. => format!("{value:.2}"),
        _ => format!("{value:.3}"),
    })
}

/// Thousands apart.
fn spaced(number: u64) -> String {
    let digits = number.to_string();
    let groups: Vec<_> = digits.as_bytes().rchunks(3).rev().map(|group| String::from_utf8_lossy(group)).collect();
    groups.join(" ")
}

/// `good`, or all that is wrong.
fn verdict(trial: &Trial, judged: &Judged) -> String {
    if trial.is_good(judged) {
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
    let change = judged.judgement.volume / trial.volume - 1.0;
    if judged.judgement.sound() {
        faults.push(format!("volume {:+.1} %", 100.0 * change));
    }
    if faults.is_empty() { "not closed".into() } else { faults.join(", ") }
}

/// Share of records kept; by corners, too, where that is another number.
fn kept(judged: &Judged) -> String {
    // Never rounded up to all.
    let percent = |share: f64| format!("{:.2} %", (share * 1e4).floor() / 100.0);
    let (records, corners) = (percent(judged.records.share()), percent(judged.corners.share()));
    if records == corners { records } else { format!("{records} (corners {corners})") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_keep_three_digits() {
        let shown = [0.01234, 1.234, 12.34, 123.4, 12_345_678.0].map(|value| number(Some(value)));
        assert_eq!(shown, ["0.012", "1.23", "12.3", "123", "12 345 678"]);
    }

    #[test]
    fn middle_of_an_even_number_of_values_is_between_two() {
        assert_eq!(middle(vec![]), None);
        assert_eq!(middle(vec![3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(middle(vec![4.0, 1.0, 2.0, 9.0]), Some(3.0));
    }

    fn cost(wall_seconds: f64, code: i32) -> Cost {
        Cost {
            wall_seconds,
            cpu_seconds: 0.0,
            peak_resident_bytes: 0,
            end: format!("exit {code}"),
            exited: true,
            code: Some(code),
            output_bytes: (code == 0).then_some(84),
            complaint: String::new(),
        }
    }

    fn trial(runs: &[(Side, f64, i32)]) -> Trial {
        let mut counts = std::collections::BTreeMap::new();
        let runs = runs.iter().map(|&(side, seconds, code)| {
            let run = counts.entry(side).or_insert(0);
            *run += 1;
            super::super::Run { side, run: *run - 1, cost: cost(seconds, code) }
        });
        Trial {
            case: "holes".into(),
            size: 1,
            seed: 1,
            bytes: 134,
            counts: Default::default(),
            injected: Default::default(),
            volume: 1.0,
            runs: runs.collect(),
            outcomes: Vec::new(),
        }
    }

    #[test]
    fn ratio_is_the_median_of_pairs_not_the_ratio_of_medians() {
        let runs = [(1.0, 10.0), (2.0, 30.0), (4.0, 20.0)];
        let runs: Vec<_> = runs.iter().flat_map(|&(a, b)| [(Side::Suture, a, 0), (Side::Plain, b, 0)]).collect();
        assert_eq!(ratio(&trial(&runs), Side::Plain, Side::Suture), Some(10.0));
    }

    #[test]
    fn a_side_that_failed_has_no_time() {
        let trial = trial(&[(Side::Suture, 1.0, 2), (Side::Plain, 5.0, 0)]);
        assert_eq!(seconds(&trial, Side::Suture, median(&trial, Side::Suture, |c| c.wall_seconds)), "exit 2");
        assert_eq!(ratio(&trial, Side::Plain, Side::Suture), None);
        assert_eq!(median(&trial, Side::Plain, |c| c.wall_seconds), Some(5.0));
    }
}
