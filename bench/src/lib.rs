//! Generators of broken meshes.
