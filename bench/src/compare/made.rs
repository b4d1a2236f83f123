//! What programs made of holes and of files: the measurements that are kept.

use serde::{Deserialize, Serialize};
use suture_bench::Counts;
use suture_bench::judge::{BodiesFound, Fault, Skin, Solid};

use super::sides::Side;
use crate::holes::{Change, Hole, Measured};

/// One program's patch of one hole in a known surface.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Shaped {
    /// [`Surface::name`].
    pub(crate) surface: String,
    #[serde(flatten)]
    pub(crate) hole: Hole,
    /// Of the mesh around.
    pub(crate) chord_error: f64,
    pub(crate) tool: Shaper,
    /// `None`: there is no patch.
    pub(crate) measured: Option<Measured>,
}

/// A program with its settings.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Shaper {
    Suture,
    /// With the profile's `patch_shape = "implicit"`.
    SutureImplicit,
    Pymeshlab,
    Meshlib,
    MeshlibArea,
    MeshlibEqual,
    MeshlibEqualArea,
}

impl Shaper {
    pub(super) const ALL: [Self; 7] = [
        Self::Suture,
        Self::SutureImplicit,
        Self::Pymeshlab,
        Self::Meshlib,
        Self::MeshlibArea,
        Self::MeshlibEqual,
        Self::MeshlibEqualArea,
    ];

    pub(super) fn is_meshlib(self) -> bool {
        !matches!(self, Self::Suture | Self::SutureImplicit | Self::Pymeshlab)
    }
}

/// One program's result for one real file with holes.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Closed {
    /// Its name.
    pub(crate) file: String,
    pub(crate) side: Side,
    pub(crate) before: Found,
    /// `None`: it wrote nothing that can be read.
    pub(crate) after: Option<Found>,
    pub(crate) change: Option<Change>,
    /// How the process ended.
    pub(crate) end: String,
    pub(crate) seconds: f64,
    /// Of suture: loops that its report names as left open, each with the rule that kept it so.
    pub(crate) named_open: Option<u64>,
}

/// Defects of a file.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(crate) struct Found {
    /// By the judge.
    pub(crate) counts: Counts,
    /// Pairs of triangles that cross or overlap, by `suture inspect`; `None` when it could not look.
    pub(crate) pairs: Option<u64>,
}

/// One program's result for one file of which a solid was asked.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Solved {
    /// Its name.
    pub(crate) file: String,
    pub(crate) triangles: u64,
    /// Some component of the file encloses something, as it is or when its rims are closed.
    pub(crate) may_be_solid: bool,
    /// The fault that keeps the file itself from being printed.
    pub(crate) before: Option<String>,
    /// Signed volume of the file; means something only where it is closed and oriented.
    pub(crate) volume: f64,
    pub(crate) side: Side,
    /// The program that ran: a version, and the hash of the binary or the script.
    pub(crate) program: String,
    /// How the process ended, and with which exit code.
    pub(crate) end: String,
    pub(crate) code: Option<i32>,
    /// Until the output was on the disk.
    pub(crate) seconds: f64,
    /// The judge's word on the output; `None`: there is none that can be read.
    pub(crate) after: Option<Solid>,
    /// Why there is none.
    #[serde(default)]
    pub(crate) complaint: String,
    pub(crate) change: Option<Change>,
    pub(crate) bodies: Option<BodiesFound>,
    /// Of suture: what its report says.
    pub(crate) report: Option<Report>,
}

/// Of a report of suture's.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Report {
    /// `clean`, `repaired`, `needs_review` or `not_good`.
    pub(crate) outcome: String,
    /// Its certificate's word.
    pub(crate) printable: bool,
    /// Regions that were wrapped.
    pub(crate) wraps: u64,
    /// Why it is not good, or needs review.
    pub(crate) reasons: Vec<String>,
}

impl Solved {
    /// It can be printed, by the judge's word.
    pub(crate) fn is_printable(&self) -> bool {
        self.after.as_ref().is_some_and(|after| after.fault().is_none())
    }

    /// The fault that keeps it from being printed.
    pub(crate) fn reason(&self) -> String {
        match &self.after {
            Some(after) => after.fault().map_or(String::new(), |fault| match fault {
                Fault::SelfIntersecting => format!("{}, {} triangles", fault.name(), after.meeting),
                Fault::Open => format!("{}, {} edges", fault.name(), after.judgement.counts.boundary_edges),
                _ => fault.name().into(),
            }),
            None if self.complaint.is_empty() => format!("nothing written, {}", self.end),
            None => format!("nothing written: {}", self.complaint),
        }
    }

    /// Farthest that the surface is from the other, either way, as a share of the diagonal.
    pub(crate) fn distance(&self) -> Option<f64> {
        self.change.map(|change| change.taken.max(change.added))
    }
}

impl Report {
    /// `None` when a program said no report.
    pub(super) fn read(said: &str) -> Option<Self> {
        let report: serde_json::Value = serde_json::from_str(said).ok()?;
        let reasons = report["verdict"]["reasons"].as_array().into_iter().flatten();
        Some(Self {
            outcome: report["outcome"].as_str()?.into(),
            printable: report["certificate"]["printable"].as_bool().unwrap_or(false),
            wraps: report["wraps"].as_array().map_or(0, |wraps| wraps.len() as u64),
            reasons: reasons.filter_map(|reason| reason.as_str().map(Into::into)).collect(),
        })
    }
}

/// The verdict on one program's result for one file whose meaning is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Verdict {
    /// Called good, and what was meant.
    Right,
    /// Called good, and not what was meant.
    Wrong,
    /// A person is asked, and it is what was meant.
    ReviewRight,
    /// A person is asked, and it is not.
    ReviewWrong,
    /// The program says itself that it is not good, or made nothing; of one without a word of its own: it is not closed.
    Withheld,
    /// It broke off.
    Failed,
}

impl Verdict {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Right => "right",
            Self::Wrong => "wrong",
            Self::ReviewRight => "review, right",
            Self::ReviewWrong => "review, wrong",
            Self::Withheld => "withheld",
            Self::Failed => "failed",
        }
    }

    /// Where the file does not decide, asking is as good; where no solid was meant, anything but calling one good is.
    pub(crate) fn is_wanted(self, decides: bool, is_solid: bool) -> bool {
        match self {
            Self::Right => true,
            Self::Wrong => false,
            Self::ReviewRight | Self::ReviewWrong => !decides || !is_solid,
            Self::Withheld | Self::Failed => !is_solid,
        }
    }
}

/// One program's results for the files of one family.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Understood {
    pub(crate) family: String,
    pub(crate) group: String,
    /// The file alone decides what was meant.
    pub(crate) decides: bool,
    pub(crate) side: Side,
    /// The program that ran: a version, and the hash of the binary or the script.
    pub(crate) program: String,
    /// Names the files and what they mean.
    pub(crate) cases: String,
    /// Seeds are from this one on.
    pub(crate) first: u64,
    #[serde(flatten)]
    pub(crate) tally: Tally,
    pub(crate) bad: Vec<Bad>,
}

/// How often a program's results were what, and what they cost.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Tally {
    pub(crate) seeds: u64,
    pub(crate) right: u64,
    pub(crate) wrong: u64,
    pub(crate) review_right: u64,
    pub(crate) review_wrong: u64,
    pub(crate) withheld: u64,
    pub(crate) failed: u64,
    /// As wanted: right, asked where that is as good, or nothing where nothing was meant.
    pub(crate) wanted: u64,
    /// Of those called good or handed to a person: such that cannot be printed.
    pub(crate) unprintable: u64,
    /// Of the right ones.
    pub(crate) right_unprintable: u64,
    pub(crate) seconds: f64,
    pub(crate) slowest: f64,
}

/// The skin of one real file after Suture.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Skinned {
    /// Its name.
    pub(crate) file: String,
    pub(crate) triangles: u64,
    /// The program that ran.
    pub(crate) program: String,
    /// `None`: it said none, or broke off.
    pub(crate) report: Option<Report>,
    /// Of the surface, the share that was replaced by wraps.
    pub(crate) wrapped: f64,
    /// `None`: nothing was written.
    pub(crate) skin: Option<Skin>,
    pub(crate) seconds: f64,
}

impl Skinned {
    /// `repaired`, `needs_review`, …, or that it broke off.
    pub(crate) fn outcome(&self) -> &str {
        self.report.as_ref().map_or("failed", |report| &report.outcome)
    }

    pub(crate) fn is_called_good(&self) -> bool {
        ["clean", "repaired"].contains(&self.outcome())
    }
}

/// A file that is not as wanted.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Bad {
    pub(crate) seed: u64,
    pub(crate) verdict: Verdict,
    pub(crate) why: String,
}

impl Understood {
    pub(crate) fn new(family: &str, group: &str, side: Side, program: String, cases: String) -> Self {
        Self {
            family: family.into(),
            group: group.into(),
            decides: true,
            side,
            program,
            cases,
            first: 0,
            tally: Tally::default(),
            bad: Vec::new(),
        }
    }
}

impl Tally {
    pub(crate) fn add(&mut self, verdict: Verdict, unprintable: bool, seconds: f64, wanted: bool) {
        let count = match verdict {
            Verdict::Right => &mut self.right,
            Verdict::Wrong => &mut self.wrong,
            Verdict::ReviewRight => &mut self.review_right,
            Verdict::ReviewWrong => &mut self.review_wrong,
            Verdict::Withheld => &mut self.withheld,
            Verdict::Failed => &mut self.failed,
        };
        *count += 1;
        self.seeds += 1;
        self.wanted += u64::from(wanted);
        self.unprintable += u64::from(unprintable);
        self.right_unprintable += u64::from(unprintable && verdict == Verdict::Right);
        self.seconds += seconds;
        self.slowest = self.slowest.max(seconds);
    }

    /// Of all together; `None` of none.
    pub(crate) fn sum(all: impl Iterator<Item = Self>) -> Option<Self> {
        all.reduce(|a, b| Self {
            seeds: a.seeds + b.seeds,
            right: a.right + b.right,
            wrong: a.wrong + b.wrong,
            review_right: a.review_right + b.review_right,
            review_wrong: a.review_wrong + b.review_wrong,
            withheld: a.withheld + b.withheld,
            failed: a.failed + b.failed,
            wanted: a.wanted + b.wanted,
            unprintable: a.unprintable + b.unprintable,
            right_unprintable: a.right_unprintable + b.right_unprintable,
            seconds: a.seconds + b.seconds,
            slowest: a.slowest.max(b.slowest),
        })
    }

    /// In one line.
    pub(crate) fn summary(&self) -> String {
        format!(
            "{:4} files: {:4} right, {:3} wrong, {:3} + {:3} review (right + wrong), {:3} withheld, {:3} failed, {:3} unprintable, {:6.1} s, slowest {:.1} s",
            self.seeds,
            self.right,
            self.wrong,
            self.review_right,
            self.review_wrong,
            self.withheld,
            self.failed,
            self.unprintable,
            self.seconds,
            self.slowest
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_report_is_read_as_far_as_it_is_needed() {
        let said = r#"{"outcome": "needs_review", "certificate": {"printable": true}, "wraps": [{}, {}], "verdict": {"reasons": ["far"]}}"#;
        let report = Report::read(said).unwrap();
        assert_eq!((report.outcome.as_str(), report.printable, report.wraps), ("needs_review", true, 2));
        assert_eq!(report.reasons, ["far"]);
        let plain = Report::read(r#"{"outcome": "clean"}"#).unwrap();
        assert_eq!((plain.printable, plain.wraps), (false, 0));
        assert!(Report::read("").is_none());
    }
}
