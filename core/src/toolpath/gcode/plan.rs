//! Codes of a block, sorted by what they do (NISTIR 6556, tables 5 and 8).

use super::block::Block;
use super::fault::{Fault, refused, syntax};
use super::machine::Motion;
use crate::toolpath::model::Plane;

/// Codes that act once and use the words of axes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Once {
    /// `G10`.
    Set,
    /// `G28`, `G30`.
    Home(usize),
    /// `G28.1`, `G30.1`.
    SetHome(usize),
    /// `G52`.
    Local,
    /// `G92`; `G92.1` to `G92.3`.
    Shift(u16),
    /// `G51`.
    Scale,
    /// `G68`.
    Rotate,
    /// `G4` and codes whose words belong to no motion.
    Dwell,
}

/// Cutter compensation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Side {
    Off,
    Left,
    Right,
}

/// The codes of a block, by their groups.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Plan {
    pub(super) motion: Option<Motion>,
    pub(super) once: Option<Once>,
    pub(super) plane: Option<Plane>,
    pub(super) unit: Option<f64>,
    pub(super) is_absolute: Option<bool>,
    pub(super) is_arc_absolute: Option<bool>,
    pub(super) is_inverse_time: Option<bool>,
    pub(super) is_initial_return: Option<bool>,
    pub(super) is_polar: Option<bool>,
    pub(super) side: Option<Side>,
    /// `.1` forms of it, whose D is a diameter.
    pub(super) is_side_dynamic: bool,
    pub(super) system: Option<usize>,
    /// `G54.1 P`, `G154 P`.
    pub(super) is_extended: bool,
    pub(super) ends_scaling: bool,
    pub(super) ends_rotation: bool,
    pub(super) ends_curve: bool,
    pub(super) is_machine: bool,
    /// `G43` and its kin, `G49`.
    pub(super) has_length: bool,
    /// A code that is not known to move anything.
    pub(super) ignored: Option<u16>,
}

impl Plan {
    /// Sorts the G-codes of a block.
    pub(super) fn of(block: &Block, has_rotary: bool) -> Result<Self, Fault> {
        let mut plan = Self::default();
        for code in &block.g {
            if has_rotary && matches!(*code, 434 | 435) {
                plan.has_length = true;
            } else {
                plan.add(*code, block)?;
            }
        }
        Ok(plan)
    }

    fn add(&mut self, code: u16, block: &Block) -> Result<(), Fault> {
        match code {
            0 => self.motion(Motion::Rapid)?,
            10 => self.motion(Motion::Feed)?,
            20 => self.motion(Motion::Clockwise)?,
            30 => self.motion(Motion::Counter)?,
            // G5 P, G5.1 Q, G8 P are modes of Fanuc's control.
            50 | 51 if !block.has_any(b"xyij") => self.once(Once::Dwell)?,
            50 => self.motion(Motion::Cubic)?,
            51 => self.motion(Motion::Quadratic)?,
            52 => self.motion(Motion::Nurbs)?,
            53 => self.ends_curve = true,
            62 => self.motion(Motion::Knotted)?,
            331 => self.motion(Motion::Tap)?,
            730 | 740 | 810..=860 | 880 | 890 if code.is_multiple_of(10) => self.motion(Motion::Cycle(code / 10))?,
            800 => self.motion(Motion::None)?,
            170 => self.plane = Some(Plane::Xy),
            180 => self.plane = Some(Plane::Zx),
            190 => self.plane = Some(Plane::Yz),
            700 | 710 if block.has_any(b"pqdi") => {
                return refused(format!("G{} (a cycle of a lathe, or a bolt circle) is not done", code / 10));
            }
            200 | 700 => self.unit = Some(25.4),
            210 | 710 => self.unit = Some(1.0),
            900 => self.is_absolute = Some(true),
            910 => self.is_absolute = Some(false),
            901 => self.is_arc_absolute = Some(true),
            911 => self.is_arc_absolute = Some(false),
            930 => self.is_inverse_time = Some(true),
            940 | 950 => self.is_inverse_time = Some(false),
            980 => self.is_initial_return = Some(true),
            990 => self.is_initial_return = Some(false),
            150 => self.is_polar = Some(false),
            160 => self.is_polar = Some(true),
            400 => self.side = Some(Side::Off),
            410 | 411 | 420 | 421 => {
                self.side = Some(if code < 420 { Side::Left } else { Side::Right });
                self.is_side_dynamic = code % 10 == 1;
            }
            430..=432 | 440 | 490 => self.has_length = true,
            540..=590 if code.is_multiple_of(10) => self.system = Some(usize::from(code - 540) / 10),
            591..=593 => self.system = Some(usize::from(code - 591) + 6),
            541 | 1540 => self.is_extended = true,
            500 => self.ends_scaling = true,
            690 => self.ends_rotation = true,
            530 => self.is_machine = true,
            _ => return self.add_rare(code, block),
        }
        Ok(())
    }

    fn add_rare(&mut self, code: u16, block: &Block) -> Result<(), Fault> {
        match code {
            40 => self.once(Once::Dwell),
            100 => self.once(Once::Set),
            280 | 300 => self.once(Once::Home(usize::from(code == 300))),
            281 | 301 => self.once(Once::SetHome(usize::from(code == 301))),
            520 => self.once(Once::Local),
            510 => self.once(Once::Scale),
            680 => self.once(Once::Rotate),
            920..=923 => self.once(Once::Shift(code)),
            // Radii on a lathe, exact stop, path modes, stroke limits, tapping mode, constant surface speed, look-ahead,
            // smoothing.
            80 | 90 | 110 | 220 | 230 | 600 | 610 | 611 | 620 | 630 | 640 | 641 | 960 | 970 | 1030 | 1870 => {
                self.ignored = Some(code);
                if matches!(code, 80 | 220 | 1030 | 1870) && block.has_any(b"xyz") && code != 80 {
                    return self.once(Once::Dwell);
                }
                Ok(())
            }
            _ => refused(format!("G{} ({}) is not done", name(code), meaning(code))),
        }
    }

    fn motion(&mut self, motion: Motion) -> Result<(), Fault> {
        match self.motion {
            Some(before) if before != motion && before != Motion::None && motion != Motion::None => {
                syntax("two motions on one line")
            }
            _ => {
                self.motion = Some(motion);
                Ok(())
            }
        }
    }

    fn once(&mut self, once: Once) -> Result<(), Fault> {
        if self.once.is_some_and(|before| before != once) {
            return syntax("two codes on one line that use the same words");
        }
        self.once = Some(once);
        Ok(())
    }
}

/// A code as people write it.
pub(super) fn name(code: u16) -> String {
    if code.is_multiple_of(10) { format!("{}", code / 10) } else { format!("{}.{}", code / 10, code % 10) }
}

fn meaning(code: u16) -> &'static str {
    match code {
        70 => "diameters on a lathe",
        120 | 130 => "a circular pocket",
        290 => "the way back from a reference",
        310 | 382..=389 => "probing",
        330..=339 => "threading",
        434..=439 => "tool centre control",
        501 | 511 => "mirroring",
        531 | 682..=689 => "a tilted plane",
        650 | 660 | 670 => "a macro",
        681 => "a rotation in space",
        700..=729 => "a cycle of a lathe",
        760 => "threading, fine boring",
        870 => "back boring",
        171 | 181 | 191 => "a plane of axes U, V, W",
        _ => "not known",
    }
}
