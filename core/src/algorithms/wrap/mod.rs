//! A wrapped surface: what separates the points that a triangle soup winds around from those it does not, on a lattice. It follows the soup
//! where that is a surface, and is a valid one whatever the soup is.
//!
//! The lattice is the body-centred cubic one: the corners of a grid of cubes and their centres. Two cubes that share a face make four tetrahedra
//! about it, each of both centres and an edge of the face; together they fill space (Sommerville's tetrahedra). A lattice point is **inside**
//! if the surface winds around it more than half a time ([`tree`]). A tetrahedron with points of both kinds gets one triangle or two, with
//! corners on its edges between points of different kinds (marching tetrahedra: Doi & Koide, IEICE Trans. E74(1), 1991; on this lattice: Labelle
//! & Shewchuk, "Isosurface stuffing", ACM TOG 26(3), 2007).
//!
//! **Valid by construction**, whichever points are inside. Every vertex lies strictly inside an edge of the lattice, and there is one an edge.
//! * *Distinct and exact.* Open edges of a simplicial complex are disjoint, so that no two vertices share a position. Points and steps are whole
//!   numbers of a power of two, below 2²⁴ of it: exact in f32, so that this holds of the written positions.
//! * *No area lacks.* The three corners of a triangle lie on three edges of a tetrahedron that meet in a point, or are two on one of its faces and
//!   a third on an edge that meets the face's plane in its far end only: never on a line.
//! * *Closed and 2-manifold.* A face of the lattice whose points differ is met in one segment, by the two tetrahedra beside it alike: every
//!   edge there has two triangles. The diagonal of a quadrilateral has two inside its tetrahedron. Around an edge of the lattice that carries a
//!   vertex all tetrahedra are cut, each in a fan of triangles between two faces: together one closed fan.
//! * *Oriented.* Every triangle faces from the points inside to those outside, so that neighbours agree.
//! * *Free of self-intersection.* Every triangle lies in its own tetrahedron. Tetrahedra meet in faces, edges or points, triangles of different
//!   ones in a shared segment or vertex of theirs therefore. The two of a quadrilateral share its diagonal; its four rims lie in four faces of the
//!   tetrahedron, so that they lie in one plane only if they are the halves of a convex section.
//!
//! **Sparse.** Only cubes that a triangle touches are looked at, and from there those across a face whose corners and centre are not all of one
//! kind, as holes have no triangles. By that rule every tetrahedron beside a cut face is looked at if one of the two is: parts of the surface
//! are found whole or not at all.

mod angle;
mod lattice;
pub(crate) mod tree;

pub(crate) use lattice::{Wrapping, wrap};
