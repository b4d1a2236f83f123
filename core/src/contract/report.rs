//! The report: what was found, what was done, and the verdict on the bytes written. Documented in `core/REPORT.md`.

pub use crate::contract::defects::{Defects, SelfIntersections};
pub use crate::contract::edit_report::{EditRecords, EditSummary, FaceOrigin};
pub use crate::contract::features::{Feature, Features};
pub use crate::contract::file_facts::{Converted, FileFacts, Format};
pub use crate::contract::hint::{Hint, HintKind};
pub use crate::contract::judgement::{Certificate, Faithful, Fidelity, RuleOutcome, RuleResult, Verdict};
pub use crate::contract::loop_class::LoopClass;
pub use crate::contract::repair_name::RepairName;
pub use crate::contract::shaping::{Residue, ResidueRegion, ResidueSuspect, Simplified, Smoothed};
pub use crate::contract::skin::{Skin, SkinCause, SkinChange, SkinPlace};
pub use crate::contract::thin_walls::{ThinPlace, ThinWalls};
pub use crate::contract::volumes::{BodyLost, Volumes};
use serde::{Deserialize, Serialize};

use crate::contract::settings::{Limits, Profile};

/// Version of the report's JSON layout; raised when a field changes its meaning or goes away.
pub const SCHEMA_VERSION: u32 = 2;

/// No list of a report holds more than this many items (but for the pairs of triangles that cross, at most 100, and an edit that was asked for).
pub const MOST_LISTED: usize = 1000;

/// Everything there is to say about one file.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Report {
    /// [`SCHEMA_VERSION`].
    pub schema_version: u32,
    /// Engine version that wrote it.
    pub engine_version: String,
    /// `inspect` or `repair`.
    pub task: Task,
    /// How the file came out.
    pub outcome: Outcome,
    /// The file read.
    pub input: FileFacts,
    /// The file written, `None` when nothing was (inspection, no triangle left, or not good under a profile that repairs nothing).
    pub output: Option<FileFacts>,
    /// Settings that decide the result.
    pub profile: Profile,
    /// Settings that do not.
    pub limits: Limits,
    /// Defects of the input.
    pub before: Defects,
    /// Defects of the output, counted on the bytes written; `None` for an inspection and for a copy of the input, which is compared by its
    /// hash.
    pub after: Option<Defects>,
    /// Tolerances derived from the model.
    pub tolerances: Tolerances,
    /// Boundary loops of the input, by what kind of opening they are.
    #[serde(default)]
    pub loops: BoundaryLoops,
    /// The repairs that were made, in order.
    pub repairs: Vec<Repair>,
    /// Boundary loops that were left open, and why (at most 1000 listed).
    pub loops_left: Vec<LoopLeft>,
    /// Open sheets that were dropped since they can be no part of a solid, the largest first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub sheets_dropped: Vec<SheetDropped>,
    /// Regions that no repair made a solid: replaced by a wrap, or left, the largest first (at most 1000 listed).
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub wraps: Vec<Wrap>,
    /// The volume that the file meant to enclose: after welding and orienting, before anything is closed, cut or removed, with each boundary loop
    /// closed by a cone to its centroid. `None` where nothing was repaired, or where neighbours disagree for good, so that nobody knows.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub volume_meant: Option<f64>,
    /// What became of the volume of bodies; `None` where nothing was done that might have lost any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub volumes: Option<Volumes>,
    /// What was done to the surface that can be seen; `None` where nothing was repaired, or the profile's reach is 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub skin: Option<Skin>,
    /// Where something was cut, moved, replaced, dropped or left, and how far surface moved there.
    #[serde(default, skip_serializing_if = "Regions::is_empty")]
    pub regions: Regions,
    /// The edit in numbers.
    pub edit: EditSummary,
    /// The edit itself, when asked for.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub edit_records: Option<EditRecords>,
    /// What the written bytes (for an inspection: the read ones) are.
    pub verdict: Verdict,
    /// What every rule found in them; `None` where nothing was written.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub certificate: Option<Certificate>,
    /// Notes for people, of good files, too.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub hints: Vec<Hint>,
    /// Of a package, each of its objects, in order (at most 1000 listed); empty for a file that is one mesh. Then all counts above are of all objects
    /// together, and an outcome is the worst of theirs.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub objects: Vec<ObjectReport>,
    /// The fate of colours, paint and other attributes of triangles; `None` where the file has none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub attributes: Option<AttributesKept>,
    /// Walls thinner than the profile's minimum; `None` if there is no minimum, or a hint says why it was not looked.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub thin_walls: Option<ThinWalls>,
    /// Small features that were removed; `None` if the profile removes none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub features: Option<Features>,
    /// Residue of a tool; `None` if the profile names no tool path, and does not want it looked for without one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub residue: Option<Residue>,
    /// Waves that were smoothed; `None` if the profile smooths none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub smoothed: Option<Smoothed>,
    /// Triangles that were made fewer; `None` if the profile asks for no fewer.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub simplified: Option<Simplified>,
    /// Seconds by stage, in order.
    pub stages: Vec<Stage>,
    /// Where the time went and what it cost.
    pub cost: Cost,
}

/// The fate of attributes, in triangles that have any.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct AttributesKept {
    /// Triangles of the input that say the same of each of their places as before.
    pub kept: u64,
    /// Triangles of the result that are parts of others, and say the same of each place but for rounding.
    pub divided: u64,
    /// Triangles of the result that are parts of others or were turned, and say it about.
    pub approximated: u64,
    /// New triangles, which took the attributes of most of the rim around them.
    pub inherited: u64,
    /// Triangles of the input that had attributes, and of which nothing is left.
    pub lost: u64,
}

/// One object of a package.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[non_exhaustive]
pub struct ObjectReport {
    /// Its number in the package.
    pub id: u32,
    /// Its name; empty if it has none.
    pub name: String,
    /// The part of the package that holds it.
    pub part: String,
    /// How it came out.
    pub outcome: Outcome,
    /// Triangles in the file.
    pub triangles: u64,
    /// Defects as it came.
    pub before: Defects,
    /// Defects as it was written; `None` where it stays as it came.
    pub after: Option<Defects>,
    /// The repairs that were made, in order.
    pub repairs: Vec<Repair>,
    /// The edit in numbers.
    pub edit: EditSummary,
    /// The verdict on it as it was written, or as it came.
    pub verdict: Verdict,
    /// The finding of every rule. Its hash and length are of a binary STL of the object.
    pub certificate: Option<Certificate>,
}

/// Which of the two entry points wrote a report.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Task {
    /// The file was diagnosed.
    Inspect,
    /// The file was repaired.
    Repair,
}

/// How a file came out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// Good as it came; the output, if any, is byte for byte the input.
    Clean,
    /// Repaired, and good.
    Repaired,
    /// Good, but the repair changed the part beyond the profile's limits: a person must look.
    NeedsReview,
    /// Not good under the profile (for an inspection: the input is not).
    NotGood,
}

impl Outcome {
    /// May it reach `out/`?
    pub fn is_good(self) -> bool {
        matches!(self, Self::Clean | Self::Repaired)
    }
}

/// Lengths derived from the model, in its units.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Tolerances {
    /// Diagonal of the bounding box.
    pub diagonal: f64,
    /// Boundary vertices closer than this may be welded.
    pub weld: f64,
    /// How `weld` was chosen.
    pub weld_reason: String,
}

/// One kind of repair that did something.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Repair {
    /// The kind of the repair.
    pub name: RepairName,
    /// How often.
    pub count: u64,
    /// In words, with the method or the bound that mattered.
    pub note: String,
    /// Time that it took.
    pub seconds: f64,
}

/// A boundary loop as it was found, before any repair. Lengths in the model's units.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct BoundaryLoop {
    /// The kind of the opening.
    pub class: LoopClass,
    /// The rule that decided the class, with its measure.
    pub rule: String,
    /// A vertex on it.
    pub at: [f32; 3],
    /// Vertices on it.
    pub vertices: u64,
    /// Length of its edges together.
    pub perimeter: f64,
    /// Of its projection along the direction in which that is largest.
    pub area: f64,
    /// Largest distance of a vertex from the plane that fits best.
    pub off_plane: f64,
    /// Of a narrow loop: the largest distance between its sides.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub width: Option<f64>,
    /// How much it differs from the loop it belongs to.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub characteristic_distance: Option<f64>,
    /// The loop it belongs to, by place in the list of all: the other side, the other rim, or the hole around an island.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub partner: Option<u32>,
}

/// The boundary loops of the input.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct BoundaryLoops {
    /// How many of each class; classes without a loop are left out.
    pub classes: std::collections::BTreeMap<LoopClass, u64>,
    /// The first thousand, by their first vertex in the file.
    pub listed: Vec<BoundaryLoop>,
}

/// A boundary loop that stayed open.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[non_exhaustive]
pub struct LoopLeft {
    /// A point on it.
    pub at: [f32; 3],
    /// Edges on it.
    pub edges: u64,
    /// Length of its edges together.
    pub perimeter: f64,
    /// Why it stayed open.
    pub reason: String,
}

/// An open sheet that was dropped.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct SheetDropped {
    /// Lower and upper corner of its box.
    pub bounds: [[f32; 3]; 2],
    /// Of all its triangles.
    pub area: f64,
    /// How many it had.
    pub triangles: u64,
    /// It crossed a body, or another sheet.
    pub crosses: bool,
    /// Other surface hid it in all directions.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub hidden: bool,
    /// It lay in the material of the result: nothing is missing without it.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub in_material: bool,
}

/// A region that no repair made a solid. Lengths in the model's units.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Wrap {
    /// Smallest and largest coordinates of what was there.
    pub bounds: [[f32; 3]; 2],
    /// Triangles that were there after all other repairs.
    pub replaced: u64,
    /// Triangles that replace them.
    pub added: u64,
    /// Of what was there.
    pub area: f64,
    /// The same as a fraction of the whole surface.
    pub area_share: f64,
    /// Edge of the lattice's cubes; 0 if there is no lattice for it.
    pub cell: f64,
    /// The volume that the wrap encloses.
    pub volume: f64,
    /// Largest distance from the old surface to the new one, measured at some of its corners and middles; what had material on both sides is left
    /// out.
    pub moved: f64,
    /// Largest distance from the new surface to the old one, likewise: where holes were wide.
    pub new_ground: f64,
    /// Why it was left as it is; `None`: it was replaced.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub left: Option<String>,
}

/// Regions where the surface is not as it was.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Regions {
    /// How many there are.
    pub total: u64,
    /// The largest of them by the diagonal of their boxes, at most 1000, the largest first.
    pub listed: Vec<Region>,
}

impl Regions {
    /// The surface is as it was everywhere.
    pub fn is_empty(&self) -> bool {
        self.total == 0
    }
}

/// Where something was done to what was no solid, or left undone. Lengths in the model's units.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Region {
    /// The method that settled it. (`rung` in schema 1.)
    #[serde(alias = "rung")]
    pub method: RegionMethod,
    /// Smallest and largest coordinates of what it was done to.
    pub bounds: [[f32; 3]; 2],
    /// Triangles that it was done to; where vertices were given to surfaces, vertices.
    pub count: u64,
    /// Rounds of cutting and rounding.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub rounds: u32,
    /// Farthest that the surface moved.
    pub moved: f64,
    /// Why it was left.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
}

fn is_zero(count: &u32) -> bool {
    *count == 0
}

/// The method that settled a region, from the least intrusive to the most.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum RegionMethod {
    /// Surfaces that cross were cut along each other, and rounded to single precision.
    Cut,
    /// So they were, and what was nearly one there was made one: short edges, and vertices close to faces or edges.
    Snapped,
    /// So they were, after bodies that shared surface but for rounding were grown by steps of single precision, each by others.
    #[serde(alias = "spread")]
    Perturbed,
    /// Triangles that kept crossing were taken out, and the small holes were closed.
    Refilled,
    /// Surfaces that shared a vertex or an edge were taken apart.
    Separated,
    /// It went: a lone sheet, a body in the material of others, or dust that cutting left.
    Dropped,
    /// It was cut out with a few rings around it, and closed anew.
    Rebuilt,
    /// It was replaced by a wrap.
    Wrapped,
    /// Nothing was done, or what was done was taken back.
    Left,
}

/// One stage's share of the time.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Stage {
    /// Its name; `core/REPORT.md` lists them.
    pub name: String,
    /// Time that went by.
    pub seconds: f64,
}

/// What the work cost.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Cost {
    /// From the first look at the file to its report.
    pub wall_seconds: f64,
    /// User and system time of the process during this work.
    pub cpu_seconds: f64,
    /// Of the input, by the time that went by.
    pub triangles_per_second: f64,
    /// Largest resident set of the process, mapped file pages included.
    pub peak_resident_bytes: u64,
    /// Largest anonymous memory of the process during this work, by a look each 20 ms and at the end of each stage.
    pub peak_anonymous_bytes: u64,
}
