//! A proved bound of the distance between two surfaces, both ways, by a map from one onto the other.
//!
//! **In:** two meshes, and for each vertex of the first the vertex of the second that it has become.
//! **Out:** bounds of the distance both ways, and the triangles that are farther than a bound.
//! **Promise:** no place of either surface is farther from the other than its bound, whatever the vertices have become. The same result for any number of threads.
//!
//! Each vertex of the first surface goes to a near spot of the second, each edge to a polyline from face to face, each triangle is cut into polygons whose
//! images lie in one face each. The map is linear on each of them (fans of triangles), so that it moves no place farther than the farthest corner: that bounds the
//! distance from the first surface to the second. It is continuous, so the degree with which it covers a face is one whole number for all of the
//! inside, if no rim of what is mapped runs there; the signed areas of the images sum up to it (Cohen, Manocha & Olano, "Successive mappings", IJCGA
//! 13(1), 2003, for maps between meshes; Outerelo & Ruiz, "Mapping degree theory", 2009, for the degree). Where it is not zero, each place of the face is
//! an image, and so not farther from the first surface. The rim of the first surface is mapped onto that of the second, so that it runs inside of no face
//! ([`rim`]).
//!
//! Triangles whose image is not found, and faces without such a degree, are bounded by [`search`]: a triangle is as near to another one as the
//! farthest of its corners, as the distance from a convex set is a convex function; else it is halved.

mod again;
mod chain;
mod fill;
mod map;
mod pairing;
mod proving;
mod rim;
mod search;
mod surface;
#[cfg(test)]
mod tests;
mod ways;

pub(crate) use crate::proof::again::{Changes, prove_again};
pub(crate) use crate::proof::pairing::Pairing;
pub(crate) use crate::proof::proving::{Proved, Verdict, prove};
