//! What decides the result ([`Profile`]) kept apart from what only decides how it is computed ([`Limits`]).
//!
//! Same input and same profile give the same output bytes, whatever the limits.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::contract::access::Access;
use crate::contract::loop_class::LoopClass;
use crate::contract::residue_settings::ResidueSettings;

/// What a repair may do, and what its result must satisfy. Lengths written `…_relative` are fractions of the bounding box's
/// diagonal; `…_mm` are in the file's units, which STL users take for millimetres.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[non_exhaustive]
pub struct Profile {
    /// Name shown in reports.
    pub name: String,
    /// Repair at all. Without, a file that is good as it comes counts as clean, and of any other nothing is written.
    pub repair: bool,
    /// The format of the result.
    pub format: OutputFormat,
    /// What to do where attributes of triangles would be lost: colours, paint, texture coordinates.
    pub attributes: KeepAttributes,
    /// Boundary vertices closer than this fraction of the diagonal are one vertex. Never below what f32 can tell apart at the
    /// model's coordinates, never above [`Profile::weld_max_edge_share`] of the edges around. 0 switches the weld off.
    pub weld_relative: f64,
    /// Upper bound of the weld tolerance as a share of the shortest edge at either vertex.
    pub weld_max_edge_share: f64,
    /// Rims that run along each other as the sides of a crack do are joined while they lie within this fraction of the diagonal of each other,
    /// and within [`Profile::weld_max_edge_share`]. 0 switches sewing off.
    pub sew_relative: f64,
    /// Gaps are zipped while they are narrower than this share of the rim's edges. 0 switches zipping off.
    pub gap_edge_share: f64,
    /// Loops of more boundary edges than this are reported, not filled.
    pub max_hole_edges: u32,
    /// Loops longer than this fraction of the diagonal are reported, not filled.
    pub max_hole_perimeter_relative: f64,
    /// Loops longer than this are reported, not filled; 0: no such bound.
    pub max_hole_perimeter_mm: f64,
    /// Gaps wider than this are not zipped; 0: none wider than 0.005 of the diagonal.
    pub max_gap_mm: f64,
    /// Kinds of loops that stay open.
    pub leave_open: Vec<LoopClass>,
    /// An older word for [`Sheets::Close`] in [`Profile::sheets`]: true is the same as that, whatever stands there.
    pub close_sheets: bool,
    /// Fill holes at all.
    pub fill_holes: bool,
    /// How patches that have room for vertices of their own are shaped.
    pub patch_shape: PatchShape,
    /// Largest change of the enclosed volume, as a fraction, between a closed part of the input and the output; beyond it the
    /// result needs review.
    pub max_volume_change: f64,
    /// Largest change of the surface's area, as a fraction; beyond it the result needs review. A repair rightly removes surface that lies double or
    /// inside, so a value of 1 or more bounds growth only.
    pub max_area_change: f64,
    /// Largest growth or shrinkage of the bounding box on any side, as a fraction of the diagonal. (Triangles without area do not
    /// count; a fin that stood out does.)
    pub max_box_change_relative: f64,
    /// Surface that moves no farther than this fraction of the diagonal counts as neither lost nor invented. 0: the skin is not measured.
    pub skin_reach_relative: f64,
    /// Largest share of the surface that could be seen from outside and is lost; beyond it the result needs review.
    pub max_skin_lost: f64,
    /// Largest share of the surface that can be seen and that nothing in the file stood for, flat or small patches left out; beyond it the result
    /// needs review.
    pub max_skin_invented: f64,
    /// Cavities that become material as a whole may enclose so much without review, as a fraction of the result's volume.
    pub max_cavities_filled: f64,
    /// Bodies (components that enclose volume) the repair may lose without review.
    pub max_bodies_lost: u32,
    /// Components of fewer triangles than this that stay open after weld and splits are dropped as debris (0: never) ...
    pub debris_triangles: u32,
    /// ... if they have at most this share of the model's area, and all of them together at most ten times that; else all are kept.
    pub debris_area_share: f64,
    /// What to do with lone sheets.
    pub sheets: Sheets,
    /// How thick [`Sheets::Thicken`] makes a sheet, and how far [`Sheets::Base`] goes down below its lowest point, as a fraction of the diagonal.
    pub sheet_thickness_relative: f64,
    /// The same in the file's units; 0: by the fraction.
    pub sheet_thickness_mm: f64,
    /// Sheets that are dropped may have this share of the model's area together without review.
    pub max_sheets_share: f64,
    /// What to do with bodies inside others, or crossing others.
    pub bodies: Bodies,
    /// What a body wholly in the material of another one, which nothing crosses, is meant for.
    pub hollow: Hollow,
    /// An open shape that stands within this fraction of the diagonal above other surface gets a skirt down into that surface before it is closed,
    /// so the two become one body. 0 (default): never. 0.001 suits shapes that were drawn on top of each other.
    pub stack_gap_relative: f64,
    /// Take surfaces apart that share an edge or a vertex, so that each has positions of its own.
    pub separate: bool,
    /// How far a vertex may move for that, as a fraction of the diagonal; four steps of single precision are always allowed.
    pub max_separation_relative: f64,
    /// What to do with geometry that no repair can turn into a solid.
    pub guarantee: Guarantee,
    /// Largest share of the surface's area that wraps may replace. 1: all of it; a result with more than [`Profile::wrap_review_share`] in wraps needs
    /// review anyway.
    pub wrap_max_share: f64,
    /// Largest distance of surface from the wrap that replaces it, as a fraction of the diagonal. Surface with material on both sides does not
    /// count.
    pub wrap_max_move: f64,
    /// Beyond this fraction of the surface's area in wraps a result needs review.
    pub wrap_review_share: f64,
    /// Cut surfaces that cross each other or themselves, so that what is left is the surface of a solid.
    pub resolve_crossings: bool,
    /// Look for triangles that cross or overlap each other, in the input and in the output; without, the verdict calls it unchecked.
    pub check_self_intersections: bool,
    /// Room in the printer, along each axis in the file's units: a part that does not fit gets a hint. 0: as long as anyone likes.
    pub build_volume_mm: [f64; 3],
    /// Walls thinner than this, in the file's units, are looked for in the result, and get a hint. 0: they are not.
    pub thin_wall_mm: f64,
    /// Holes of a smaller diameter than this, in the file's units, are removed from the result, through or blind. 0: none.
    pub remove_holes_below_mm: f64,
    /// Fillets of a smaller radius than this, and narrower chamfers, are removed. 0: none.
    pub remove_fillets_below_mm: f64,
    /// Grooves, slots and pockets narrower than this are removed, engraved letters among them. 0: none.
    pub remove_grooves_below_mm: f64,
    /// Bosses lower than this are removed, embossed letters among them. 0: none.
    pub remove_bosses_below_mm: f64,
    /// Residue of a milling tool that is to be removed.
    pub residue: ResidueSettings,
    /// Waves shorter than this, in the file's units, are smoothed. 0: none.
    pub smooth_waves_below_mm: f64,
    /// Of the height of these waves, as much is left at most.
    pub smooth_leaves: f64,
    /// The result has so many triangles at most, if that is possible within the other bounds. 0: as many as it has.
    pub simplify_triangles: u64,
    /// The result has at most this share of the triangles. 0: as many as it has.
    pub simplify_ratio: f64,
    /// Triangles are made fewer where the surface, in the file's units, stays within this distance, both ways, proved. 0: no bound, and no reason to.
    pub simplify_within_mm: f64,
    /// Smoothing and simplifying keep edges where the surface turns by more degrees.
    pub keep_edges_degrees: f64,
}

/// What to do with geometry that no repair can turn into a solid.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Guarantee {
    /// Leave it. A file is good only if it passed every check; a check that was not made keeps it from being good.
    Strict,
    /// Replace it by a surface around the space that it encloses.
    #[default]
    Wrap,
    /// Leave it. A check that was not made is reported as unchecked, and the file may still be good.
    Off,
}

/// What to do with bodies that lie inside other bodies, or cross them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Bodies {
    /// Keep the surface that separates material from air: bodies inside the material of others go, bodies that cross become one. Cavities stay,
    /// and so do bodies inside a cavity.
    #[default]
    Union,
    /// Keep all bodies.
    Keep,
    /// Bodies that cross become one. Then a piece of surface, closed or open, goes if other pieces hide its largest triangle in all six directions
    /// along the axes; so cavities go, too. (After Yang et al. 2021, section 3.2.)
    Visible,
}

/// What a body wholly in the material of another one, which nothing crosses, is meant for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Hollow {
    /// Material: what it bounds is filled, as [`Profile::bodies`] says.
    #[default]
    Fill,
    /// The wall of a hollow print that was not turned: it becomes a cavity. Bodies in each other are material and air by turns.
    Keep,
}

/// What to do where attributes of triangles would be lost, or hold only about.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum KeepAttributes {
    /// A person is asked to look.
    Keep,
    /// They are carried over as well as they can be, and the report counts.
    #[default]
    Best,
    /// Nothing is written.
    Refuse,
}

/// The format of a result.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum OutputFormat {
    /// The input's; of a text STL, binary STL.
    #[default]
    Input,
    /// Binary STL.
    Stl,
    /// Binary PLY, little-endian.
    Ply,
    /// OFF, text.
    Off,
    /// OBJ, text.
    Obj,
    /// AMF, not compressed.
    Amf,
    /// A 3MF package; of an input that is none, one with a single object.
    #[serde(rename = "3mf")]
    ThreeMf,
}

impl OutputFormat {
    /// The format that names with this ending have, in any case; `None` for a format that is not written.
    ///
    /// ```
    /// # use suture_core::OutputFormat;
    /// assert_eq!(OutputFormat::of_ending("PLY"), Some(OutputFormat::Ply));
    /// assert_eq!(OutputFormat::of_ending("step"), None);
    /// ```
    pub fn of_ending(ending: &str) -> Option<Self> {
        [Self::Stl, Self::ThreeMf, Self::Ply, Self::Off, Self::Obj, Self::Amf]
            .into_iter()
            .find(|format| format.ending().is_some_and(|own| own.eq_ignore_ascii_case(ending)))
    }

    /// The ending of names of this format, without a point; `None` for the input's.
    pub fn ending(self) -> Option<&'static str> {
        match self {
            Self::Input => None,
            Self::Stl => Some("stl"),
            Self::Ply => Some("ply"),
            Self::Off => Some("off"),
            Self::Obj => Some("obj"),
            Self::Amf => Some("amf"),
            Self::ThreeMf => Some("3mf"),
        }
    }
}

/// What to do with a lone sheet: open surface that bounds no material, such as terrain, or a Möbius strip.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Sheets {
    /// Beside bodies, drop a sheet that crosses a body or another sheet: no solid can have it. Drop the others if all of them together have at most
    /// [`Profile::debris_area_share`] of the area, or the guarantee is [`Guarantee::Wrap`]. A file that holds nothing else stays open.
    #[default]
    Drop,
    /// Keep all sheets; the file stays open.
    Keep,
    /// Make each a wall of [`Profile::sheet_thickness_relative`], half of it on either side.
    Thicken,
    /// Let the rim of each down along −Z, and close it by a flat base below the lowest point of all sheets: terrain becomes a block.
    Base,
    /// Close the rims as if they were holes. What is nearly flat becomes a body of hardly any thickness; what passes through its own patch, splinters.
    Close,
}

/// How a patch is shaped.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum PatchShape {
    /// Not at all: triangles between the vertices of the rim.
    Flat,
    /// Refined, then fair: position, tangent and curvature continue the surface around (least change of mean curvature).
    #[default]
    Fair,
    /// Refined, then moved onto a surface that a triharmonic radial basis function continues.
    Implicit,
    /// Refined, then on the surface that blends the sides of the rim between its corners, whatever the surface around does: for rims that are edges of
    /// a part. Of a rim with less than two corners, as `Fair`.
    Coons,
}

impl Default for Profile {
    fn default() -> Self {
        Self {
            name: "default".into(),
            repair: true,
            format: OutputFormat::Input,
            attributes: KeepAttributes::Best,
            weld_relative: 1e-5,
            weld_max_edge_share: 0.25,
            sew_relative: 0.01,
            gap_edge_share: 0.35,
            max_hole_edges: 20_000,
            max_hole_perimeter_relative: 8.0,
            max_hole_perimeter_mm: 0.0,
            max_gap_mm: 0.0,
            leave_open: Vec::new(),
            close_sheets: false,
            fill_holes: true,
            patch_shape: PatchShape::Fair,
            max_volume_change: 0.25,
            max_area_change: 1.0,
            max_box_change_relative: 0.02,
            skin_reach_relative: 0.005,
            max_skin_lost: 0.0005,
            max_skin_invented: 0.01,
            max_cavities_filled: 0.01,
            max_bodies_lost: 0,
            debris_triangles: 4,
            debris_area_share: 1e-3,
            sheets: Sheets::Drop,
            sheet_thickness_relative: 0.01,
            sheet_thickness_mm: 0.0,
            max_sheets_share: 0.01,
            bodies: Bodies::Union,
            hollow: Hollow::Fill,
            stack_gap_relative: 0.0,
            separate: true,
            max_separation_relative: 1e-4,
            guarantee: Guarantee::Wrap,
            wrap_max_share: 1.0,
            wrap_max_move: 0.05,
            wrap_review_share: 0.01,
            resolve_crossings: true,
            check_self_intersections: true,
            build_volume_mm: [0.0; 3],
            thin_wall_mm: 0.0,
            remove_holes_below_mm: 0.0,
            remove_fillets_below_mm: 0.0,
            remove_grooves_below_mm: 0.0,
            remove_bosses_below_mm: 0.0,
            residue: ResidueSettings::default(),
            smooth_waves_below_mm: 0.0,
            smooth_leaves: 0.1,
            simplify_triangles: 0,
            simplify_ratio: 0.0,
            simplify_within_mm: 0.0,
            keep_edges_degrees: 40.0,
        }
    }
}

impl Profile {
    /// The profiles that come with the product, by name: `default`; `fast` (what takes time and is not needed for a valid surface is left out: the
    /// search for self-intersections, and the shaping of patches); `strict` (small mending only: whatever changes more, or cannot be proved, is a
    /// person's to decide); `cautious` (welds and drops surplus triangles, but closes, cuts and wraps nothing); `scan` (larger holes, wider gaps, for
    /// scanned surfaces); `inspect-only` (repairs nothing).
    pub fn built_in(name: &str) -> Option<Self> {
        let base = Self { name: name.into(), ..Self::default() };
        match name {
            "default" => Some(base),
            "fast" => Some(Self { check_self_intersections: false, patch_shape: PatchShape::Flat, ..base }),
            "strict" => Some(Self {
                max_hole_perimeter_relative: 0.25,
                max_volume_change: 0.01,
                max_area_change: 0.02,
                max_box_change_relative: 0.001,
                skin_reach_relative: 0.001,
                max_skin_lost: 1e-4,
                max_skin_invented: 1e-3,
                max_cavities_filled: 0.0,
                max_sheets_share: 1e-4,
                debris_area_share: 1e-4,
                guarantee: Guarantee::Strict,
                ..base
            }),
            "cautious" => Some(Self {
                fill_holes: false,
                gap_edge_share: 0.0,
                sheets: Sheets::Keep,
                resolve_crossings: false,
                max_volume_change: 0.02,
                guarantee: Guarantee::Strict,
                ..base
            }),
            "scan" => {
                Some(Self { max_hole_edges: 100_000, gap_edge_share: 0.5, max_volume_change: 1.0, debris_triangles: 100, ..base })
            }
            "inspect-only" => Some(Self { repair: false, ..base }),
            _ => None,
        }
    }

    /// Are the rims of lone sheets closed as if they were holes?
    pub(crate) fn closes_sheets(&self) -> bool {
        self.close_sheets || self.sheets == Sheets::Close
    }

    /// How thick a lone sheet becomes, or its base below it, in a file of this diagonal.
    pub(crate) fn sheet_thickness(&self, diagonal: f64) -> f64 {
        if self.sheet_thickness_mm > 0.0 { self.sheet_thickness_mm } else { self.sheet_thickness_relative * diagonal }
    }

    /// Names [`Profile::built_in`] knows.
    pub const BUILT_IN: [&str; 6] = ["default", "fast", "strict", "cautious", "scan", "inspect-only"];
}

/// What the machine may spend. Never changes a result: too little is an error, not another output.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Limits {
    /// Bytes of memory the system cannot reclaim (anonymous memory and dirty file pages).
    pub memory_bytes: u64,
    /// Worker threads.
    pub threads: usize,
    /// Triangles in a chunk on average; the default fits the tables of a chunk into an L2 cache.
    pub chunk_triangles: u32,
    /// Folder for spool files (text input, triangles sorted by place); `None`: the output's folder.
    pub spool: Option<PathBuf>,
    /// Whether triangles are sorted by place into a spool file first.
    pub spill: Spill,
    /// List every record of the edit in the report (may be as large as the mesh).
    pub list_edit: bool,
    /// The caller syncs the output: among many small files it can wait for the disk once for several.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub defer_sync: bool,
    /// How the input and the written output are read. Only code that answers for it can choose a map, so that no file and no message can.
    #[serde(skip)]
    pub access: Access,
}

/// When triangles are sorted by place into a spool file before their topology is worked out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Spill {
    /// If their order in the file has nothing to do with their place and the file is larger than what can stay in the page cache,
    /// or lists of them would take too much of the budget.
    #[default]
    Auto,
    /// For tests.
    Always,
    /// They are read where they lie.
    Never,
}

impl Default for Limits {
    /// 1 GiB, all processors, chunks of 32 k triangles.
    fn default() -> Self {
        Self {
            memory_bytes: 1 << 30,
            threads: std::thread::available_parallelism().map_or(1, usize::from),
            chunk_triangles: 32 * 1024,
            spool: None,
            spill: Spill::Auto,
            list_edit: false,
            defer_sync: false,
            access: Access::COPIED,
        }
    }
}

impl Limits {
    /// These limits, with spools beside `file` unless they go elsewhere already.
    pub(crate) fn spooling_beside(&self, file: &Path) -> Self {
        Self { spool: Some(self.spool.clone().unwrap_or_else(|| folder_of(file).to_owned())), ..self.clone() }
    }

    /// Where spools go.
    pub(crate) fn spool_folder(&self) -> PathBuf {
        self.spool.clone().unwrap_or_else(std::env::temp_dir)
    }
}

/// The folder that holds `file`.
pub(crate) fn folder_of(file: &Path) -> &Path {
    file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_name_has_a_profile_that_is_called_so() {
        for name in Profile::BUILT_IN {
            assert_eq!(Profile::built_in(name).unwrap().name, name);
        }
        assert_eq!(Profile::built_in("default").unwrap(), Profile::default());
        assert!(Profile::built_in("inspect_only").is_none());
    }

    /// Every limit is as tight as the default's, or tighter.
    #[test]
    fn the_strict_profile_allows_less() {
        let [usual, strict] = ["default", "strict"].map(|name| serde_json::to_value(Profile::built_in(name).unwrap()).unwrap());
        for (setting, limit) in usual.as_object().unwrap().iter().filter(|(setting, _)| setting.starts_with("max_")) {
            let allowed = strict[setting].as_f64().unwrap();
            assert!(allowed <= limit.as_f64().unwrap(), "{setting}: {allowed}");
        }
        assert_eq!(strict["guarantee"], "strict");
    }
}
