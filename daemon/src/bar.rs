//! The progress bar of `repair` and `inspect`: only on a terminal, and only when the work takes a while.
//!
//! One file shows its stage, its rate and the time left; several show how many are done. The engine tells how far a stage is, not
//! how long the stages after it will take: for that, their usual shares of the time are known here.

use std::io::IsTerminal;
use std::path::Path;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::exit::Exit;
use crate::say::{complain, plain, print};
use crate::units::{show_count, show_seconds};

/// Work that is done sooner shows no bar.
const BAR_AFTER: Duration = Duration::from_secs(1);
/// So often a bar moves when nothing is heard.
const TICK: Duration = Duration::from_millis(250);
/// Steps of the bar.
const STEPS: f64 = 10_000.0;
/// Time left is said from this share of the work on; before, it would be a wild guess.
const FORESEEN: f64 = 0.02;

/// Stages as the engine calls them, in order, with their shares of the time. What comes after `emit` is the written file read back, and
/// where its difference from the input does not tell all, a survey with the same stages again. (Self-intersections are looked for chunk
/// by chunk, as part of the topology.)
const FIRST_LOOK: [(&str, f64); 5] = [("read", 4.0), ("plan", 10.0), ("topology", 45.0), ("repair", 8.0), (EMISSION, 28.0)];
const SECOND_LOOK: [(&str, f64); 3] = [("hash", 9.0), ("plan", 2.0), ("topology", 9.0)];
const EMISSION: &str = "emit";

/// How far the work on one file is.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Standing {
    stage: String,
    second_look: bool,
    /// Of the whole, from 0 to 1; never falls.
    share: f64,
    triangles: u64,
}

impl Standing {
    /// `writes` says whether anything is written and looked at again.
    pub(crate) fn at(&mut self, stage: &str, done: u64, total: u64, writes: bool) {
        self.second_look |= self.stage == EMISSION && stage != EMISSION;
        if stage != self.stage {
            self.stage = stage.to_owned();
        }
        if stage != "read" {
            self.triangles = self.triangles.max(total);
        }
        let first: Vec<_> = FIRST_LOOK.iter().filter(|(name, _)| writes || !matches!(*name, "repair" | EMISSION)).collect();
        let second: Vec<_> = SECOND_LOOK.iter().filter(|_| writes).collect();
        let all = || first.iter().chain(&second);
        let from = if self.second_look { first.len() } else { 0 };
        let Some(place) = all().skip(from).position(|(name, _)| *name == stage) else { return };
        let sum: f64 = all().map(|(_, share)| share).sum();
        let before: f64 = all().take(from + place).map(|(_, share)| share).sum();
        let here = all().nth(from + place).map_or(0.0, |(_, share)| *share);
        let fraction = if total == 0 { 0.0 } else { (done as f64 / total as f64).clamp(0.0, 1.0) };
        self.share = self.share.max((before + here * fraction) / sum);
    }

    /// About how many seconds are left after so many, once that can be told.
    pub(crate) fn left(&self, seconds: u64) -> Option<u64> {
        let left = seconds as f64 * (1.0 - self.share) / self.share;
        (self.share >= FORESEEN).then_some(left.ceil() as u64)
    }

    /// What the bar says beside itself after so many seconds.
    fn message(&self, seconds: f64) -> String {
        let look = if self.second_look { "verification: " } else { "" };
        let mut text = format!("{look}{}", self.stage);
        if self.triangles > 0 && self.share > 0.0 && seconds > 0.0 {
            let rate = self.triangles as f64 * self.share / seconds;
            text += &format!(", {} triangles/s", show_count(round(rate)));
        }
        if self.share >= FORESEEN {
            text += &format!(", {} left", left(seconds, self.share));
        }
        text
    }
}

/// A name with its end cut off if it would leave no room for the bar.
fn short(name: &str) -> String {
    const MOST: usize = 20;
    if name.chars().count() <= MOST { name.to_owned() } else { name.chars().take(MOST - 1).chain(['…']).collect() }
}

/// The time that is left when `seconds` were needed for this share, in whole seconds.
fn left(seconds: f64, share: f64) -> String {
    let left = (seconds * (1.0 - share) / share).ceil();
    if left < 60.0 { format!("{left:.0} s") } else { show_seconds(left) }
}

/// To three digits: more would only flicker.
fn round(rate: f64) -> u64 {
    let unit = 10u64.pow((rate.max(1.0).log10() as u32).saturating_sub(2));
    (rate as u64 / unit) * unit
}

/// What a bar is about.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Scope {
    /// Inputs, and their bytes together.
    pub files: usize,
    pub bytes: u64,
    /// A repair, not an inspection.
    pub writes: bool,
}

/// A progress bar for all inputs of a command.
pub(crate) struct Bar {
    bar: ProgressBar,
    scope: Scope,
    start: Instant,
    shown: bool,
    wanted: bool,
    /// Inputs that are done, and their bytes.
    files: usize,
    bytes: u64,
    /// The file that is worked on alone: since when, how large, how far.
    alone: Option<(Instant, u64, Standing)>,
}

impl Bar {
    pub(crate) fn new(scope: Scope) -> Self {
        let wanted = std::io::stderr().is_terminal();
        let (bar, start) = (ProgressBar::hidden(), Instant::now());
        Self { bar, scope, start, shown: false, wanted, files: 0, bytes: 0, alone: None }
    }

    /// Work on one file of `bytes` bytes begins, and on no other meanwhile.
    pub(crate) fn alone(&mut self, input: &Path, bytes: u64) {
        self.alone = Some((Instant::now(), bytes, Standing::default()));
        if self.scope.files == 1 {
            self.bar.set_prefix(short(&plain(&input.file_name().unwrap_or_default().to_string_lossy())));
        }
        self.show();
    }

    /// As the engine tells it of the file that is worked on alone.
    pub(crate) fn at(&mut self, stage: &str, done: u64, total: u64) {
        if let Some((_, _, standing)) = &mut self.alone {
            standing.at(stage, done, total, self.scope.writes);
        }
        self.show();
    }

    /// A file of so many bytes is done.
    pub(crate) fn done(&mut self, bytes: u64) {
        self.alone = None;
        self.files += 1;
        self.bytes += bytes;
        self.show();
    }

    fn show(&mut self) {
        if !self.wanted || (!self.shown && self.start.elapsed() < BAR_AFTER) {
            return;
        }
        if !self.shown {
            self.shown = true;
            self.bar.set_length(STEPS as u64);
            // The template is a constant that parses; the plain style would do as well.
            if let Ok(style) = ProgressStyle::with_template("{prefix} {wide_bar} {percent:>3} %  {msg}") {
                self.bar.set_style(style);
            }
            // Last, for it draws.
            self.bar.set_draw_target(ProgressDrawTarget::stderr_with_hz(10));
            self.bar.enable_steady_tick(TICK);
        }
        let (share, message) = self.standing();
        self.bar.set_position((share * STEPS) as u64);
        self.bar.set_message(message);
    }

    fn standing(&self) -> (f64, String) {
        let alone = self.alone.as_ref();
        if let Some((since, _, standing)) = alone.filter(|_| self.scope.files == 1) {
            return (standing.share, standing.message(since.elapsed().as_secs_f64()));
        }
        let partly = alone.map_or(0.0, |(_, bytes, standing)| *bytes as f64 * standing.share);
        let share = ((self.bytes as f64 + partly) / self.scope.bytes.max(1) as f64).min(1.0);
        let seconds = self.start.elapsed().as_secs_f64();
        let mut text = format!("{} of {} files", show_count(self.files as u64), show_count(self.scope.files as u64));
        match alone {
            Some((_, _, standing)) => text += &format!(", {}", standing.stage),
            None if self.files as f64 >= seconds => text += &format!(", {:.0} files/s", self.files as f64 / seconds),
            None => {}
        }
        if share >= FORESEEN {
            text += &format!(", {} left", left(seconds, share));
        }
        (share, text)
    }

    /// Prints to standard output, and a line to standard error; the bar stands aside, since both may be the same terminal. Returns `exit`, or what
    /// it means that nothing can be printed.
    pub(crate) fn say(&self, text: &str, complaint: Option<&str>, exit: Exit) -> Exit {
        self.bar.suspend(|| {
            let exit = print(text.as_bytes(), exit);
            if let Some(line) = complaint {
                complain(&line);
            }
            exit
        })
    }

    /// Takes the bar off the screen.
    pub(crate) fn clear(&self) {
        self.bar.finish_and_clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Through all stages of a repair the share grows from nothing to the whole, and the second look is told from the first.
    #[test]
    fn a_repair_goes_from_nothing_to_the_whole() {
        let mut standing = Standing::default();
        let mut last = 0.0;
        for (i, (stage, _)) in FIRST_LOOK.iter().chain(&SECOND_LOOK).enumerate() {
            for done in [0, 50, 100] {
                standing.at(stage, done, 100, true);
                assert!(standing.share >= last);
                last = standing.share;
            }
            assert_eq!(standing.second_look, i >= FIRST_LOOK.len());
        }
        assert!((last - 1.0).abs() < 1e-9);
        assert!(standing.message(2.0).starts_with("verification: topology, 50 triangles/s, 0 s left"));
    }

    /// An inspection ends with the topology, and no stage that is unknown makes it jump.
    #[test]
    fn shares_are_of_what_is_to_be_done() {
        let mut standing = Standing::default();
        standing.at("topology", 5, 10, false);
        let half = standing.share;
        assert!((half - (4.0 + 10.0 + 22.5) / 59.0).abs() < 1e-9);
        standing.at("unheard-of", 9, 10, false);
        assert!((standing.share - half).abs() < 1e-9);
        standing.at("topology", 10, 10, false);
        assert!((standing.share - 1.0).abs() < 1e-9);
        assert_eq!(standing.message(0.0), "topology, 0 s left");
    }

    #[test]
    fn names_leave_room_for_the_bar() {
        assert_eq!(short("part.stl"), "part.stl");
        assert_eq!(short("Gehäuseoberteil-links.stl"), "Gehäuseoberteil-lin…");
    }

    #[test]
    fn rates_have_three_digits() {
        assert_eq!([5.4, 999.0, 12_345.0, 6_543_210.0].map(round), [5, 999, 12_300, 6_540_000]);
    }
}
