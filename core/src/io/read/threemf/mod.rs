//! 3MF: the models of a package, object by object.
//!
//! **In:** the bytes of a package, mapped.
//! **Out:** a [`Model`]: entries, parts with their text in spools, objects and where they stand in it, build items; the records of an object when
//! they are asked for.
//! **Promise:** memory depends on the number of objects, which is bounded, never on that of triangles. Whatever is well-formed XML is read as such:
//! a scanner for the plain form of vertices and triangles is a short cut that gives the same. Extensions that a file requires and that are not
//! understood, what is encrypted, cycles, and transforms that flatten are refused by name.
//!
//! By 3MF Core 1.3 (2 package, 3.3 units, 3.4 extensions and metadata, 4 objects, 4.1 meshes, 4.2 components, 3.4.3 build), Materials 1.2.1, Production 1.1.2 (2 paths),
//! Slice 1.0.2, Beam Lattice 1.2 (2), Triangle Sets, Secure Content 1.0.2.

mod attributes;
mod budget;
#[cfg(test)]
mod build;
mod careful;
mod expand;
mod extensions;
mod mesh;
mod model;
mod no_parts;
mod object;
mod open;
mod outline;
pub(crate) mod roles;
mod scan;
mod shards;
pub(crate) mod slicer;
#[cfg(test)]
mod tests;
mod transform;

pub(crate) use mesh::MeshRecords;
pub(crate) use model::{Content, Model, Object, Place, Purpose};
pub(crate) use no_parts::NoParts;
pub(crate) use transform::Transform;
