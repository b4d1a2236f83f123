//! The progress bar of `repair` and `inspect`: only on a terminal, and only when the work takes a while.
//!
//! One file shows what is being done, the rate and the time left; several show how many are done.

use std::io::IsTerminal;
use std::path::Path;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::course::{Course, left, show_whole};
use crate::exit::Exit;
use crate::say::{complain, plain, print};
use crate::units::show_count;

/// Work that is done sooner shows no bar.
const BAR_AFTER: Duration = Duration::from_secs(1);
/// So often a bar moves when nothing is heard.
const TICK: Duration = Duration::from_millis(250);
/// Steps of the bar.
const STEPS: f64 = 10_000.0;

/// A name with its end cut off if it would leave no room for the bar.
fn short(name: &str) -> String {
    const MOST: usize = 20;
    if name.chars().count() <= MOST { name.to_owned() } else { name.chars().take(MOST - 1).chain(['…']).collect() }
}

/// The words beside the bar of one file after so many seconds.
fn message(course: &Course, seconds: f64) -> String {
    let mut text = course.doing().to_owned();
    if course.triangles() > 0 && course.share() > 0.0 && seconds > 0.0 {
        let rate = course.triangles() as f64 * course.share() / seconds;
        text += &format!(", {} triangles/s", show_count(round(rate)));
    }
    text + &shown_left(course.left(seconds))
}

/// The seconds that are left, if that can be told.
fn shown_left(seconds: Option<f64>) -> String {
    seconds.map(|left| format!(", {} left", show_whole(left))).unwrap_or_default()
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
    /// The file that is worked on alone: since when, how large, how far once that was told.
    alone: Option<(Instant, u64, Option<Course>)>,
}

impl Bar {
    pub(crate) fn new(scope: Scope) -> Self {
        let wanted = std::io::stderr().is_terminal();
        let (bar, start) = (ProgressBar::hidden(), Instant::now());
        Self { bar, scope, start, shown: false, wanted, files: 0, bytes: 0, alone: None }
    }

    /// Work on one file of `bytes` bytes begins, and on no other meanwhile.
    pub(crate) fn alone(&mut self, input: &Path, bytes: u64) {
        self.alone = Some((Instant::now(), bytes, None));
        if self.scope.files == 1 {
            self.bar.set_prefix(short(&plain(&input.file_name().unwrap_or_default().to_string_lossy())));
        }
        self.show();
    }

    /// The file that is worked on alone is so far.
    pub(crate) fn at(&mut self, course: &Course) {
        if let Some((_, _, known)) = &mut self.alone {
            *known = Some(course.clone());
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
        if let Some((since, _, course)) = alone.filter(|_| self.scope.files == 1) {
            let said = course.as_ref().map(|course| (course.share(), message(course, since.elapsed().as_secs_f64())));
            return said.unwrap_or_default();
        }
        let partly = alone.map_or(0.0, |(_, bytes, course)| *bytes as f64 * course.as_ref().map_or(0.0, Course::share));
        let share = ((self.bytes as f64 + partly) / self.scope.bytes.max(1) as f64).min(1.0);
        let seconds = self.start.elapsed().as_secs_f64();
        let mut text = format!("{} of {} files", show_count(self.files as u64), show_count(self.scope.files as u64));
        match alone {
            Some((_, _, Some(course))) => text += &format!(", {}", course.doing()),
            None if self.files as f64 >= seconds => text += &format!(", {:.0} files/s", self.files as f64 / seconds),
            _ => {}
        }
        (share, text + &shown_left(left(seconds, share)))
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

    #[test]
    fn beside_the_bar_stands_what_is_done_how_fast_and_how_long_yet() {
        let mut course = Course::new(false, false);
        assert_eq!(message(&course, 1.0), "at work");
        course.at("topology", 0, 100, 0.5);
        course.at("topology", 50, 100, 2.0);
        assert_eq!(message(&course, 2.0), "looking for defects, 28 triangles/s, 2 s left");
        course.at("hash", 100, 100, 4.0);
        assert_eq!(message(&course, 4.0), "taking the checksum of the file, 25 triangles/s");
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
