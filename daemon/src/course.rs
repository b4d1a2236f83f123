//! How far the work on one file is: its share of the whole, and words for people, from the stages that the engine tells.
//!
//! The engine tells how far a stage is, not how long the stages after it will take: for that, their usual shares of the time are known
//! here. Some stages come only with some files, and some come again: what such a stage takes is taken from what was left, so that the share
//! never falls. The seconds that are left are reckoned apart from the share: from the pace of the stage itself, and for what follows from that of the
//! stages before.

use suture_core::report::Task;

use crate::protocol::Request;
use crate::units::show_seconds;

/// Time left is said from this share of the work on, and reckoned from a stage's own pace from this share of the stage on; before, it would be a wild
/// guess.
const FORESEEN: f64 = 0.02;
/// Nothing more is said of work that has not ended.
const MOST_PERCENT: u8 = 99;

/// Parts of the work, in order. A stage's name alone does not tell which of them it belongs to: the result is looked at as the input was.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Part {
    Look,
    Repair,
    Write,
    ReadBack,
    LookAgain,
    Walls,
    Encode,
}

/// In which work a stage is reckoned with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Comes {
    Always,
    IfItWrites,
    IfItDoesNot,
    IfWallsMatter,
    /// It depends on the file.
    Sometimes,
}

/// A stage of the work.
struct Step {
    part: Part,
    /// As the engine calls it.
    stage: &'static str,
    /// Of the time, against the others.
    weight: f64,
    comes: Comes,
    /// For people.
    doing: &'static str,
}

const fn step(part: Part, stage: &'static str, weight: f64, comes: Comes, doing: &'static str) -> Step {
    Step { part, stage, weight, comes, doing }
}

/// The weight that a repair has beyond that of its step when every triangle of the file is at a defect.
const DEFECTS: f64 = 200.0;

/// In the words for people of all that comes after the result was written.
const CHECKING: &str = "checking the result";
const LOOKING: &str = "looking for defects";

/// All stages, in order. The result is surveyed only where its difference from the input does not tell all: the weights are those of a mean.
/// (Self-intersections are looked for chunk by chunk, as part of the topology.)
/// A repair's weight is that of a file with few defects; [`DEFECTS`] is added for the part of the triangles that are at defects.
const STEPS: [Step; 15] = [
    step(Part::Look, "read", 4.0, Comes::Always, "reading the file"),
    step(Part::Look, "weld", 20.0, Comes::Sometimes, "joining corners that nearly meet"),
    step(Part::Look, "plan", 10.0, Comes::Always, "sorting triangles by place"),
    step(Part::Look, "everywhere", 20.0, Comes::Sometimes, "setting right what is wrong everywhere"),
    step(Part::Look, "topology", 45.0, Comes::Always, LOOKING),
    step(Part::Repair, "repair", 8.0, Comes::IfItWrites, "repairing"),
    step(Part::Write, "emit", 28.0, Comes::IfItWrites, "writing the result"),
    step(Part::ReadBack, "hash", 9.0, Comes::IfItWrites, CHECKING),
    step(Part::ReadBack, "hash", 4.0, Comes::IfItDoesNot, "taking the checksum of the file"),
    step(Part::LookAgain, "plan", 2.0, Comes::IfItWrites, CHECKING),
    step(Part::LookAgain, "topology", 9.0, Comes::IfItWrites, CHECKING),
    step(Part::Walls, "walls", 15.0, Comes::IfWallsMatter, "looking for thin walls"),
    // Of results in other formats than STL.
    step(Part::Encode, "number", 10.0, Comes::Sometimes, "numbering vertices"),
    step(Part::Encode, "encode", 20.0, Comes::Sometimes, "writing the result in its format"),
    step(Part::Encode, "pack", 20.0, Comes::Sometimes, "packing the result"),
];

/// How far the work on one file is.
#[derive(Clone, Debug)]
pub(crate) struct Course {
    writes: bool,
    walls: bool,
    /// The writing has begun.
    written: bool,
    stage: String,
    /// Of [`STEPS`]: the last one that was told and is known, and the share when it began.
    step: Option<usize>,
    base: f64,
    /// Of the whole, from 0 to 1; never falls.
    share: f64,
    triangles: u64,
    /// Of them, the part at defects, once that is known.
    at_defects: f64,
    pace: Pace,
}

/// When the work moved on, in seconds since it began.
#[derive(Clone, Copy, Debug, Default)]
struct Pace {
    /// The step began.
    began: f64,
    /// The step was so far, from 0 to 1, and told so last.
    fraction: f64,
    told: f64,
}

impl Course {
    /// Of work that has just begun. `writes`: something is repaired and written; `walls`: thin walls are looked for.
    pub(crate) fn new(writes: bool, walls: bool) -> Self {
        let (stage, pace) = (String::new(), Pace::default());
        Self { writes, walls, written: false, stage, step: None, base: 0.0, share: 0.0, triangles: 0, at_defects: 0.0, pace }
    }

    /// Of what this asks for.
    pub(crate) fn of(Request { task, profile, .. }: &Request) -> Self {
        Self::new(*task == Task::Repair && profile.repair, profile.thin_wall_mm > 0.0)
    }

    /// As the engine tells it, so many seconds after the work has begun.
    pub(crate) fn at(&mut self, stage: &str, done: u64, total: u64, seconds: f64) {
        if stage != self.stage {
            stage.clone_into(&mut self.stage);
        }
        match stage {
            "read" => {}
            "repair" => self.at_defects = (total as f64 / self.triangles.max(1) as f64).min(1.0),
            _ => self.triangles = self.triangles.max(total),
        }
        // A repair looks at parts of the file anew, which brings it no nearer to its end.
        let Some((place, step)) = self.find(stage) else { return };
        if self.step != Some(place) {
            self.base = self.share.max(self.weight(|other| other < place) / self.weight(|_| true));
            self.step = Some(place);
            self.pace = Pace { began: seconds, fraction: 0.0, told: seconds };
            self.written |= step.part == Part::Write;
        }
        let (own, rest) = (self.weight_of(step), self.weight(|other| other > place));
        let fraction = if total == 0 { 0.0 } else { (done as f64 / total as f64).clamp(0.0, 1.0) };
        if fraction > self.pace.fraction {
            self.pace = Pace { fraction, told: seconds, ..self.pace };
        }
        self.share = self.share.max(self.base + (1.0 - self.base) * fraction * own / (own + rest));
    }

    fn weight_of(&self, step: &Step) -> f64 {
        step.weight + if step.part == Part::Repair { DEFECTS * self.at_defects } else { 0.0 }
    }

    /// The step that a stage is, by where the work is already.
    fn find(&self, stage: &str) -> Option<(usize, &'static Step)> {
        let now = self.step.and_then(|step| STEPS.get(step)).map_or(Part::Look, |step| step.part);
        let may_be = |step: &Step| {
            step.stage == stage
                && step.part >= now
                && (step.part != Part::LookAgain || now >= Part::Write)
                && (step.part != Part::ReadBack || (step.comes == Comes::IfItWrites) == (self.writes || self.written))
        };
        STEPS.iter().enumerate().find(|(_, step)| may_be(step))
    }

    /// The weight of some of the steps that are reckoned with.
    fn weight(&self, which: impl Fn(usize) -> bool) -> f64 {
        let is_usual = |step: &Step| match step.comes {
            Comes::Always => true,
            Comes::IfItWrites => self.writes,
            Comes::IfItDoesNot => !self.writes,
            Comes::IfWallsMatter => self.walls,
            Comes::Sometimes => false,
        };
        STEPS
            .iter()
            .enumerate()
            .filter(|(place, step)| which(*place) && is_usual(step))
            .map(|(_, step)| self.weight_of(step))
            .sum()
    }

    /// The stage, as the engine calls it.
    pub(crate) fn stage(&self) -> &str {
        &self.stage
    }

    /// The work of this moment, for people.
    pub(crate) fn doing(&self) -> &'static str {
        self.step.and_then(|step| STEPS.get(step)).map_or("at work", |step| step.doing)
    }

    /// How much of the whole is done, from 0 to 1.
    pub(crate) fn share(&self) -> f64 {
        self.share
    }

    /// The same in hundredths; never all of them, for it goes on.
    pub(crate) fn percent(&self) -> u8 {
        ((self.share * 100.0) as u8).min(MOST_PERCENT)
    }

    /// Triangles of the file, once they are known.
    pub(crate) fn triangles(&self) -> u64 {
        self.triangles
    }

    /// About how many seconds are left after so many, as long as that can be told: of a repair nobody knows before it is done, nor of a stage that takes longer
    /// than was foreseen.
    pub(crate) fn left(&self, seconds: f64) -> Option<f64> {
        let place = self.step.filter(|_| self.share >= FORESEEN)?;
        let is_open = |step: &Step| self.writes && !self.written && step.part <= Part::Repair;
        if STEPS.get(place).is_some_and(is_open) {
            return None;
        }
        let own = STEPS.get(place).map_or(0.0, |step| self.weight_of(step));
        let (before, rest) = (self.weight(|other| other < place), self.weight(|other| other > place));
        let Pace { began, fraction, told } = self.pace;
        let by_itself = (fraction >= FORESEEN).then(|| (told - began) / fraction);
        // Seconds for each weight: of what came before, or else of this.
        let pace = if before > 0.0 { began / before } else { by_itself? / own };
        let step_left = (1.0 - fraction) * by_itself.unwrap_or(own * pace);
        let left = step_left + rest * pace - (seconds - told);
        (left > 0.0).then(|| left.ceil())
    }
}

/// About how many seconds are left of work when so many were needed for this share of it, once that can be told.
pub(crate) fn left(seconds: f64, share: f64) -> Option<f64> {
    (FORESEEN..1.0).contains(&share).then(|| (seconds * (1.0 - share) / share).ceil())
}

/// Seconds as they are said of work that goes on: whole ones, as more would only flicker.
pub(crate) fn show_whole(seconds: f64) -> String {
    if seconds < 60.0 { format!("{seconds:.0} s") } else { show_seconds(seconds) }
}

#[cfg(test)]
mod tests {
    use std::path::Path;
    use std::sync::Mutex;

    use suture_core::{Limits, Profile, Progress};

    use super::*;

    /// Goes through all of these stages from begin to end; the share must not fall.
    fn through(course: &mut Course, stages: &[&str]) {
        for stage in stages {
            for done in [0, 50, 100] {
                let before = course.share();
                course.at(stage, done, 100, 0.0);
                assert!(course.share() >= before && course.share() <= 1.0 + 1e-9, "{stage} {done}: {before} {}", course.share());
            }
        }
    }

    const REPAIR: [&str; 8] = ["read", "plan", "topology", "repair", "emit", "hash", "plan", "topology"];

    /// Through all stages the share grows from nothing to the whole, each by its weight, and the second look is told from the first.
    #[test]
    fn a_repair_goes_from_nothing_to_the_whole() {
        let mut course = Course::new(true, false);
        assert_eq!((course.doing(), course.percent(), course.left(9.0)), ("at work", 0, None));
        through(&mut course, &REPAIR[..2]);
        assert!((course.share() - 14.0 / 115.0).abs() < 1e-9);
        through(&mut course, &REPAIR[2..3]);
        assert!((course.share() - 59.0 / 115.0).abs() < 1e-9);
        // All of the file is at defects.
        through(&mut course, &REPAIR[3..4]);
        let repaired = 59.0 / 115.0 + 56.0 / 115.0 * (8.0 + DEFECTS) / (56.0 + DEFECTS);
        assert!((course.share() - repaired).abs() < 1e-9);
        through(&mut course, &REPAIR[4..5]);
        assert!((course.share() - repaired - (1.0 - repaired) * 28.0 / 48.0).abs() < 1e-9);
        assert_eq!((course.doing(), course.stage(), course.triangles()), ("writing the result", "emit", 100));
        through(&mut course, &REPAIR[5..]);
        assert!((course.share() - 1.0).abs() < 1e-9);
        assert_eq!((course.doing(), course.stage(), course.percent()), (CHECKING, "topology", 99));
        assert_eq!(course.left(2.0), None);
    }

    /// Stages that only some files have, and such as come again, move it on, and leave room for what follows.
    #[test]
    fn what_comes_unforeseen_takes_of_what_is_left() {
        let mut course = Course::new(true, false);
        through(&mut course, &["read", "plan", "weld", "plan"]);
        course.at("topology", 30, 100, 0.0);
        let early = course.share();
        through(&mut course, &["plan", "everywhere"]);
        assert_eq!(course.doing(), "setting right what is wrong everywhere");
        assert!(course.share() > early + 0.05);
        course.at("topology", 0, 100, 0.0);
        let begun = course.share();
        course.at("topology", 100, 100, 0.0);
        assert!(course.share() > begun + 0.1 && course.share() < 0.8, "{} {}", begun, course.share());
        // In a repair, the survey of a part is a part of the repair.
        course.at("repair", 0, 100, 0.0);
        let at_repair = course.share();
        through(&mut course, &["plan", "topology"]);
        assert_eq!((course.doing(), course.stage()), ("repairing", "topology"));
        assert!((course.share() - at_repair).abs() < 1e-9);
        through(&mut course, &["emit", "read", "hash"]);
        assert_eq!(course.doing(), CHECKING);
        assert!(course.share() < 0.99);
    }

    /// An inspection ends with the checksum, or with thin walls where these are asked for; a stage that is unknown moves nothing.
    #[test]
    fn shares_are_of_what_is_to_be_done() {
        let mut course = Course::new(false, false);
        course.at("topology", 5, 10, 0.0);
        let half = course.share();
        assert!((half - (4.0 + 10.0 + 22.5) / 63.0).abs() < 1e-9);
        course.at("unheard_of", 9, 10, 0.0);
        assert!((course.share() - half).abs() < 1e-9);
        assert_eq!((course.doing(), course.stage()), (LOOKING, "unheard_of"));
        through(&mut course, &["topology", "hash"]);
        assert_eq!(course.doing(), "taking the checksum of the file");
        assert!((course.share() - 1.0).abs() < 1e-9);
        let mut course = Course::new(false, true);
        through(&mut course, &["plan", "topology", "hash"]);
        assert!(course.share() < 0.9);
        // A file that is good as it came is copied even by who repairs nothing.
        let mut course = Course::new(false, false);
        through(&mut course, &["plan", "topology", "emit", "hash"]);
        assert_eq!(course.doing(), CHECKING);
    }

    /// Seconds count down, whatever the share does: by the pace of what came before, then by that of the stage itself.
    #[test]
    fn what_is_left_is_reckoned_from_the_pace() {
        let mut course = Course::new(false, false);
        course.at("read", 0, 100, 0.0);
        course.at("plan", 0, 100, 4.0);
        // A second for each weight so far.
        course.at("topology", 0, 100, 14.0);
        assert_eq!(course.left(20.0), Some(45.0 - 6.0 + 4.0));
        // It is twice as fast as was foreseen; the rest keeps its pace.
        course.at("topology", 50, 100, 14.0 + 11.25);
        assert_eq!(course.left(14.0 + 11.25), Some((11.25_f64 + 4.0).ceil()));
        let shown = [1.0, 4.0, 8.0, 12.0].map(|later| course.left(25.25 + later).unwrap());
        assert!(shown.is_sorted_by(|a, b| a > b), "{shown:?}");
        assert_eq!(course.left(60.0), None, "it takes longer, and nobody knows how long");
        // Nor does anybody before a repair is done; after that it is known well.
        let mut course = Course::new(true, false);
        for stage in ["read", "plan", "topology", "repair"] {
            course.at(stage, 50, 100, 50.0);
            assert_eq!(course.left(50.0), None, "{stage}");
        }
        course.at("emit", 50, 100, 80.0);
        course.at("emit", 75, 100, 110.0);
        assert!(course.left(110.0).is_some());
    }

    /// All stages that the engine told.
    #[derive(Default)]
    struct Told(Mutex<Vec<&'static str>>);

    impl Progress for Told {
        fn at(&self, stage: &'static str, _: u64, _: u64) {
            self.0.lock().unwrap().push(stage);
        }
    }

    /// No stage of the engine's is unheard of.
    #[test]
    fn the_engine_tells_of_stages_that_are_known() {
        let folder = tempfile::tempdir().unwrap();
        let input = folder.path().join("in.stl");
        // A tetrahedron without one of its faces.
        let corners = [[0.0f32, 0.0, 0.0], [9.0, 0.0, 0.0], [0.0, 9.0, 0.0], [0.0, 0.0, 9.0]];
        let mut bytes = vec![0; 80];
        bytes.extend(3u32.to_le_bytes());
        for face in [[0, 2, 1], [0, 1, 3], [0, 3, 2]] {
            bytes.extend([0; 12]);
            bytes.extend(face.iter().flat_map(|&i: &usize| corners[i]).flat_map(f32::to_le_bytes));
            bytes.extend([0; 2]);
        }
        std::fs::write(&input, bytes).unwrap();
        let told = Told::default();
        let mut profile = Profile::default();
        profile.thin_wall_mm = 0.5;
        suture_core::repair(&input, &folder.path().join("out.stl"), &profile, &Limits::default(), &told).unwrap();
        suture_core::inspect(Path::new(&input), &profile, &Limits::default(), &told).unwrap();
        let told = told.0.into_inner().unwrap();
        assert!(["topology", "repair", "emit", "walls"].iter().all(|stage| told.contains(stage)), "{told:?}");
        let unknown: Vec<_> = told.iter().filter(|told| !STEPS.iter().any(|step| step.stage == **told)).collect();
        assert!(unknown.is_empty(), "{unknown:?}");
    }
}
