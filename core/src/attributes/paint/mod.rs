//! Paint: a triangle in areas, each of which has a state (a filament, or whether supports, seams or fuzzy skin are wanted there).
//!
//! Slicers attach it to a `<triangle>` of a 3MF, as hexadecimal digits: PrusaSlicer in `slic3rpe:custom_supports`, `slic3rpe:custom_seam`
//! and `slic3rpe:mmu_segmentation`, Bambu Studio and OrcaSlicer in `paint_supports`, `paint_seam` and `paint_color`. They have no other
//! specification than their source: `src/libslic3r/TriangleSelector.cpp` (`serialize`, `deserialize`, `perform_split`), and
//! `src/libslic3r/Model.cpp` (`FacetsAnnotation::get_triangle_as_string`, `set_triangle_from_string`).
//!
//! **In:** these digits.
//! **Out:** a tree, [`Paint`]; its areas; the paint of the turned or mirrored triangle; the paint of a piece of the triangle ([`Paint::piece`]).
//! **Promise:** each text that slicers write comes back digit by digit. Turns and mirrors are exact. A piece's share of each state is right
//! to 10⁻⁴ of the piece.

mod areas;
mod clip;
mod digits;
mod piece;
#[cfg(test)]
mod samples;
mod split;
#[cfg(test)]
mod tests;
mod tree;
mod turn;

pub(crate) use tree::Paint;
