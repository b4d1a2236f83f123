//! Engine: the way of one mesh through all of it.
//!
//! **In:** a path or a [`Mesh`](mesh::Mesh), a profile, limits, a progress.
//! **Out:** a report; for a repair, the file at the path for it, or a mesh and where each of its faces comes from.
//! **Promise:** what stands at that path is complete and synced when a report is returned. The input is what it was at the beginning, or
//! the result is thrown away. A mesh from memory becomes the mesh that its file would become, face by face.

mod carried;
mod clock;
mod copying;
pub(crate) mod curve_mesh;
mod edited_mesh;
pub(crate) mod entry;
mod everywhere;
pub(crate) mod files;
pub(crate) mod formats;
mod judging;
mod making;
pub(crate) mod memory;
pub(crate) mod memory_making;
pub(crate) mod mesh;
mod nameless_stl;
pub mod operations;
mod package;
mod parts;
mod shaping;
mod shared_vertices;
mod together;
mod welding;
mod work;
