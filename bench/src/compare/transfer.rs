//! A process that read or wrote one file of a format: the measurement that is kept, and which program reads and writes which format.

use serde::{Deserialize, Serialize};

use super::child::Cost;
use super::sides::Side;
use super::way::Way;

/// A format that is read and written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Format {
    #[serde(rename = "3mf")]
    ThreeMf,
    Ply,
    Off,
    Obj,
    Amf,
}

/// To read a file, or to write one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Direction {
    Read,
    Write,
}

/// One process.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Transfer {
    pub(crate) direction: Direction,
    pub(crate) format: Format,
    /// Of the mesh.
    pub(crate) triangles: u64,
    /// Length of the file that was read.
    pub(crate) input_bytes: u64,
    #[serde(flatten)]
    pub(crate) way: Way,
    /// From 0; processes of equal round are a pair.
    pub(crate) round: usize,
    /// Its place among all processes of the session.
    pub(crate) order: usize,
    pub(crate) command: String,
    /// Share of the input's pages in the page cache at the start.
    pub(crate) cached_share: f64,
    pub(crate) cost: Cost,
}

/// The largest mesh, in triangles, that trimesh is given as 3MF: one of 5 M takes it a minute and 8 GB.
const MOST_OF_TRIMESH_AS_3MF: u64 = 1_100_000;

impl Format {
    pub(crate) const ALL: [Self; 5] = [Self::ThreeMf, Self::Ply, Self::Off, Self::Obj, Self::Amf];

    /// The ending of a file's name.
    pub(crate) fn ending(self) -> &'static str {
        match self {
            Self::ThreeMf => "3mf",
            Self::Ply => "ply",
            Self::Off => "off",
            Self::Obj => "obj",
            Self::Amf => "amf",
        }
    }

    /// Is `side` measured at this format, with a mesh of so many triangles?
    pub(crate) fn is_of(self, side: Side, direction: Direction, triangles: u64) -> bool {
        let knows = match (side, direction) {
            (Side::InspectNoSi, Direction::Read) | (Side::Convert, Direction::Write) => true,
            (Side::TrimeshFormats, _) => {
                matches!(self, Self::Ply | Self::Off | Self::Obj) || self == Self::ThreeMf && triangles <= MOST_OF_TRIMESH_AS_3MF
            }
            (Side::Lib3mf, _) => self == Self::ThreeMf,
            (Side::PymeshlabFormats, _) | (Side::MeshlibFormats, Direction::Write) => self != Self::Amf,
            // It reads a 3MF as a scene alone.
            (Side::MeshlibFormats, Direction::Read) => matches!(self, Self::Ply | Self::Off | Self::Obj),
            (Side::Tobj, Direction::Read) => self == Self::Obj,
            _ => false,
        };
        knows && triangles <= side.facts().most_triangles
    }
}

impl Transfer {
    /// Why it does not count; `None`: it did its work.
    pub(crate) fn failure(&self) -> Option<String> {
        let seen = self.cost.facts.get("triangles").copied();
        // Exit code 1 of an inspection: the file is read, and is not good.
        let has_read = self.direction == Direction::Read && self.way.side.may_exit_1() && self.cost.code == Some(1);
        match seen {
            _ if self.cost.code != Some(0) && !has_read => Some(self.cost.end.clone()),
            Some(seen) if seen != self.triangles => Some(format!("{seen} triangles")),
            _ if self.direction == Direction::Write && self.cost.output_bytes.is_none() => Some("nothing written".into()),
            _ => None,
        }
    }

    /// What is compared: seconds of reading alone, by the process's own word, or from the start of a process until its output was synced.
    /// `None` unless it did its work.
    pub(crate) fn seconds(&self) -> Option<f64> {
        match self.direction {
            _ if self.failure().is_some() => None,
            Direction::Read => self.cost.stage_seconds(if self.way.side.is_suture() { "read" } else { "load" }),
            Direction::Write => Some(self.cost.wall_seconds),
        }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::compare::child::Stage;

    /// A process whose reading takes `seconds`, and the whole of it one second more; it holds 2 MB, reads 4 MB and may write 3 MB.
    pub(in crate::compare) fn transfer(direction: Direction, format: Format, side: Side, round: usize, seconds: f64) -> Transfer {
        let name = if side.is_suture() { "read" } else { "load" };
        let cost = Cost {
            wall_seconds: seconds + 1.0,
            peak_resident_bytes: 2_000_000,
            end: "exit 0".into(),
            exited: true,
            code: Some(0),
            output_bytes: (direction == Direction::Write).then_some(3_000_000),
            stages: vec![Stage { name: name.into(), seconds }],
            facts: [("triangles".into(), 1000)].into(),
            ..Cost::default()
        };
        let (triangles, input_bytes, way, command) = (1000, 4_000_000, Way::plain(side), side.facts().name.into());
        Transfer { direction, format, triangles, input_bytes, way, round, order: 0, command, cached_share: 1.0, cost }
    }

    #[test]
    fn reading_is_a_stage_and_writing_is_the_process() {
        let of = |direction, side| transfer(direction, Format::Ply, side, 0, 0.5).seconds();
        assert_eq!(of(Direction::Read, Side::InspectNoSi), Some(0.5));
        assert_eq!(of(Direction::Read, Side::MeshlibFormats), Some(0.5));
        assert_eq!(of(Direction::Write, Side::Convert), Some(1.5));
    }

    #[test]
    fn a_process_that_did_not_do_its_work_has_no_seconds_but_a_reason() {
        let good = transfer(Direction::Write, Format::Ply, Side::Convert, 0, 1.0);
        let with = |change: fn(&mut Transfer)| {
            let mut bad = good.clone();
            change(&mut bad);
            (bad.failure(), bad.seconds())
        };
        assert_eq!(with(|_| ()), (None, Some(2.0)));
        assert_eq!(with(|bad| bad.cost.output_bytes = None), (Some("nothing written".into()), None));
        assert_eq!(with(|bad| *bad.cost.facts.get_mut("triangles").unwrap() = 999), (Some("999 triangles".into()), None));
        // Only an inspection says by exit code 1 that it has read.
        let one = |bad: &mut Transfer| (bad.cost.code, bad.cost.end) = (Some(1), "exit 1".into());
        assert_eq!(with(one), (Some("exit 1".into()), None));
        let mut read = transfer(Direction::Read, Format::Ply, Side::InspectNoSi, 0, 1.0);
        one(&mut read);
        assert_eq!(read.seconds(), Some(1.0));
        read.way.side = Side::TrimeshFormats;
        assert_eq!(read.seconds(), None);
    }

    #[test]
    fn a_line_reads_back_and_names_the_format_by_its_ending() {
        for format in Format::ALL {
            let line = serde_json::to_value(transfer(Direction::Read, format, Side::Lib3mf, 2, 1.0)).unwrap();
            assert_eq!(line["format"], format.ending());
            let back: Transfer = serde_json::from_value(line).unwrap();
            assert_eq!((back.format, back.way, back.round), (format, Way::plain(Side::Lib3mf), 2));
        }
    }

    #[test]
    fn suture_has_every_format_and_a_large_3mf_is_too_much_for_trimesh() {
        for format in Format::ALL {
            assert!(format.is_of(Side::InspectNoSi, Direction::Read, u64::MAX));
            assert!(format.is_of(Side::Convert, Direction::Write, u64::MAX));
            assert!(!format.is_of(Side::Tobj, Direction::Write, 1));
        }
        let trimesh = |triangles| Format::ThreeMf.is_of(Side::TrimeshFormats, Direction::Read, triangles);
        assert!(trimesh(1_003_520) && !trimesh(5_000_000));
    }
}
