//! Single operations on a mesh in memory, each with what it may do as a struct.
//!
//! The functions that find something change nothing. Those that change something return what
//! [`repair_mesh`](crate::repair_mesh) returns, and do one thing only: what else is wrong with the mesh stays, and the report says so
//! ([`Guarantee::Off`]). All of them, but for [`certificate`] of a mesh that was inspected before, begin with a diagnosis of the whole mesh,
//! O(n log n) in its faces.
//!
//! # Errors
//! All of them return the errors of [`crate::repair_mesh`].

use crate::contract::error::Result;
use crate::contract::progress::Progress;
use crate::contract::report::{BoundaryLoop, Certificate, Defects, SelfIntersections};
use crate::contract::settings::{Bodies, Guarantee, Limits, PatchShape, Profile};
use crate::detect::holes::{self, loops};
use crate::engine::judging;
use crate::engine::memory::{self, Held, RepairedMesh};
use crate::engine::mesh::MeshView;
use crate::geometry::tri_tri::Contact;
use crate::repairs::Steps;
use crate::submesh::edges::Edges;
use crate::topology::vertex_table::Weld;
use crate::util::ids::NONE;

/// Counts the defects of a mesh (`core/DEFECTS.md` defines them). Self-intersections are not looked for: see [`find_self_intersections`].
pub fn find_defects<'m>(mesh: impl Into<MeshView<'m>>, limits: &Limits, progress: &dyn Progress) -> Result<Defects> {
    let profile = Profile { check_self_intersections: false, ..unrestricted("find_defects") };
    let held = Held::of(mesh.into(), limits)?;
    Ok(held.diagnose(&profile, limits, progress)?.defects)
}

/// A boundary loop of a mesh in memory.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct FoundLoop {
    /// Its vertices in order, by their numbers in the mesh (of several at one position, the first one), so that a patch that is wound this way is
    /// wound as the surface around it.
    pub vertices: Vec<u32>,
    /// What kind of opening it is, and its measures. `partner` is a place in the list of all loops.
    pub facts: BoundaryLoop,
}

/// Finds all boundary loops of a mesh, and what kinds of openings they are (the rules are in `core/REPORT.md`).
///
/// A loop's first vertex, or any other, is what [`Fill::only_loop`] wants. The loops are those of the mesh as it is; the report of
/// [`crate::inspect_mesh`] lists them as they are after vertices within the weld tolerance were made one.
pub fn find_loops<'m>(mesh: impl Into<MeshView<'m>>, limits: &Limits, progress: &dyn Progress) -> Result<Vec<FoundLoop>> {
    let (mesh, profile) = (mesh.into(), Profile { check_self_intersections: false, ..unrestricted("find_loops") });
    let held = Held::of(mesh, limits)?;
    let diagnosis = held.diagnose(&profile, limits, progress)?;
    let submesh = &diagnosis.submesh;
    let edges = Edges::of(submesh);
    let rims = loops::find(submesh, &edges);
    let facts: Vec<BoundaryLoop> =
        holes::classify(submesh, &edges, &rims, &diagnosis.tolerance, profile.gap_edge_share).collect();
    // Numbers in the mesh, of the positions on loops.
    let mut on_loops = Weld::default();
    on_loops.reset(rims.iter().map(|rim| rim.vertices.len()).sum());
    let numbers: Vec<Vec<u32>> =
        rims.iter().map(|rim| rim.points(submesh).into_iter().map(|p| on_loops.vertex(p)).collect()).collect();
    let mut in_mesh = vec![NONE; on_loops.positions().len()];
    for v in mesh.faces().as_flattened() {
        if let Some(number) = on_loops.find(mesh.vertices()[*v as usize]) {
            let first = &mut in_mesh[number as usize];
            *first = (*first).min(*v);
        }
    }
    let found = numbers.into_iter().zip(facts);
    Ok(found.map(|(way, facts)| FoundLoop { vertices: way.into_iter().map(|n| in_mesh[n as usize]).collect(), facts }).collect())
}

/// Two faces of a mesh that cross or overlap.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct FacePair {
    /// Their numbers, the smaller one first.
    pub faces: [u32; 2],
    /// They lie in one plane and share an area; otherwise they meet along a segment inside at least one of them.
    pub overlap: bool,
}

/// The self-intersections of a mesh.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct FoundIntersections {
    /// How many there are.
    pub counts: SelfIntersections,
    /// All pairs, ascending; `None` where there are too many to be kept in memory, or to be looked at.
    pub pairs: Option<Vec<FacePair>>,
}

/// Finds all pairs of faces that cross or overlap each other, beyond the corners they share. Exact. O(n log n + pairs of faces whose
/// boxes meet).
pub fn find_self_intersections<'m>(
    mesh: impl Into<MeshView<'m>>,
    limits: &Limits,
    progress: &dyn Progress,
) -> Result<FoundIntersections> {
    let held = Held::of(mesh.into(), limits)?;
    let survey = held.diagnose(&unrestricted("find_self_intersections"), limits, progress)?.into_survey();
    let pairs = survey.crossing_pairs.map(|pairs| {
        let mut pairs: Vec<FacePair> =
            pairs.iter().map(|p| FacePair { faces: p.triangles, overlap: p.contact == Contact::Overlap }).collect();
        pairs.sort_unstable_by_key(|pair| pair.faces);
        pairs
    });
    Ok(FoundIntersections { counts: survey.self_intersections.unwrap_or_default(), pairs })
}

/// Certifies a mesh: what each of the rules of a printable file ([`crate::RULES`]) finds.
pub fn certificate<'m>(mesh: impl Into<MeshView<'m>>, limits: &Limits, progress: &dyn Progress) -> Result<Certificate> {
    let held = Held::of(mesh.into(), limits)?;
    let defects = held.diagnose(&unrestricted("certificate"), limits, progress)?.defects;
    Ok(judging::certify(&held.facts(limits), &defects, &[]))
}

/// A setter for each field of the parameters of an operation.
macro_rules! setters {
    ($parameters:ty: $($field:ident: $type:ty),*) => {
        impl $parameters {
            $(
                #[doc = concat!("The same with another `", stringify!($field), "`.")]
                #[must_use]
                pub fn $field(self, $field: $type) -> Self {
                    Self { $field, ..self }
                }
            )*
        }
    };
}

setters!(Fill: only_loop: Option<[f32; 3]>, shape: PatchShape, max_edges: u32, sheets: bool);
setters!(Orient: by_visibility: bool);
setters!(Union: visible_only: bool, separate: bool);
setters!(Wrap: max_share: f64, max_move: f64);

/// How boundary loops are closed.
///
/// ```
/// use suture_core::{PatchShape, operations::Fill};
///
/// let how = Fill::default().only_loop(Some([0.0, 0.0, 1.0])).shape(PatchShape::Flat);
/// assert_eq!(how.max_edges, 20_000);
/// ```
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Fill {
    /// Only the loop through the vertex at this position, whatever kind of opening it is; `None`: all, but for rims of lone sheets.
    pub only_loop: Option<[f32; 3]>,
    /// How a patch is shaped that has room for vertices of its own.
    pub shape: PatchShape,
    /// Loops of more edges stay open. 0 to [`u32::MAX`].
    pub max_edges: u32,
    /// Close the rims of lone sheets, too. They become bodies of hardly any thickness.
    pub sheets: bool,
}

impl Default for Fill {
    fn default() -> Self {
        let Profile { patch_shape, max_hole_edges, close_sheets, .. } = Profile::default();
        Self { only_loop: None, shape: patch_shape, max_edges: max_hole_edges, sheets: close_sheets }
    }
}

/// Closes boundary loops. A patch that would cross other surface is not put in; its loop is in the report's `loops_left`, with the reason.
pub fn fill<'m>(mesh: impl Into<MeshView<'m>>, how: &Fill, limits: &Limits, progress: &dyn Progress) -> Result<RepairedMesh> {
    let profile = Profile {
        patch_shape: how.shape,
        max_hole_edges: how.max_edges,
        close_sheets: how.sheets,
        max_hole_perimeter_relative: f64::MAX,
        resolve_crossings: false,
        ..unrestricted("fill")
    };
    memory::repair(mesh.into(), Steps::Fill(how.only_loop), &profile, limits, progress)
}

/// How faces are turned.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Orient {
    /// Where neighbours disagree and both parts are large, look from outside which of them is seen from behind (Takayama et al. 2014). Needs
    /// the self-intersections, which takes most of the time. Without it, the smaller part is turned.
    pub by_visibility: bool,
}

impl Default for Orient {
    fn default() -> Self {
        Self { by_visibility: true }
    }
}

/// Turns faces, so that neighbours agree, closed surfaces enclose what is inside of them, and cavities what is outside.
pub fn orient<'m>(mesh: impl Into<MeshView<'m>>, how: &Orient, limits: &Limits, progress: &dyn Progress) -> Result<RepairedMesh> {
    let profile =
        Profile { resolve_crossings: how.by_visibility, check_self_intersections: how.by_visibility, ..unrestricted("orient") };
    memory::repair(mesh.into(), Steps::Orient, &profile, limits, progress)
}

/// How bodies are united.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Union {
    /// Remove what cannot be seen from outside, too: bodies in cavities, and the cavities.
    pub visible_only: bool,
    /// Take surfaces apart that share an edge or a vertex, so that each has positions of its own.
    pub separate: bool,
}

impl Default for Union {
    fn default() -> Self {
        Self { visible_only: false, separate: true }
    }
}

/// Makes bodies that cross each other, or themselves, one body, and removes what lies in the material of others. Surfaces that are open
/// bound no material and are left alone.
pub fn union<'m>(mesh: impl Into<MeshView<'m>>, how: &Union, limits: &Limits, progress: &dyn Progress) -> Result<RepairedMesh> {
    let bodies = if how.visible_only { Bodies::Visible } else { Bodies::Union };
    let profile = Profile { bodies, separate: how.separate, ..unrestricted("union") };
    memory::repair(mesh.into(), Steps::Union, &profile, limits, progress)
}

/// How a wrap replaces what is no solid.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Wrap {
    /// Largest share of the surface's area that wraps may replace, from 0 to 1.
    pub max_share: f64,
    /// Largest distance of surface from the wrap that replaces it, as a fraction of the bounding box's diagonal; from 0 on.
    pub max_move: f64,
}

impl Default for Wrap {
    fn default() -> Self {
        let Profile { wrap_max_share, wrap_max_move, .. } = Profile::default();
        Self { max_share: wrap_max_share, max_move: wrap_max_move }
    }
}

/// Replaces surface that bounds no solid by a closed one around the space that it encloses.
pub fn wrap<'m>(mesh: impl Into<MeshView<'m>>, how: &Wrap, limits: &Limits, progress: &dyn Progress) -> Result<RepairedMesh> {
    let profile = Profile {
        guarantee: Guarantee::Wrap,
        wrap_max_share: how.max_share,
        wrap_max_move: how.max_move,
        ..unrestricted("wrap")
    };
    memory::repair(mesh.into(), Steps::Wrap, &profile, limits, progress)
}

/// The profile of an operation: what it does not do by itself is not asked for, and nothing that it does is held against the result.
fn unrestricted(name: &str) -> Profile {
    Profile {
        name: name.into(),
        bodies: Bodies::Keep,
        guarantee: Guarantee::Off,
        max_volume_change: f64::MAX,
        max_area_change: f64::MAX,
        max_box_change_relative: f64::MAX,
        max_cavities_filled: f64::MAX,
        max_bodies_lost: u32::MAX,
        skin_reach_relative: 0.0,
        ..Profile::default()
    }
}

#[cfg(test)]
mod tests;
