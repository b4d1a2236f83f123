//! Attributes of triangles, which they carry beside their corners.
//!
//! **In:** the text that a file attaches to a triangle.
//! **Out:** its meaning ([`paint`]), carried over to turned triangles and to pieces of triangles, and text again.
//! **Promise:** no text makes it panic, and its work is bounded by the text's length. Where the result is not exact, it says by how much.

pub(crate) mod paint;
