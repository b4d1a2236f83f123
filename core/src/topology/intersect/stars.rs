//! Stars that cannot intersect themselves, recognised in linear time.
//!
//! Most boxes that overlap belong to triangles around one vertex. Let v be regular: its triangles (v, next, previous) form one closed
//! coherent fan. Let d be any vector, and look at the star along d.
//!
//! 1. If the normal of every triangle has a positive component along d, each triangle is seen with positive area and turns the same
//!    way, so it is seen as a sector at v, from its next to its previous corner, counter-clockwise, of less than half a turn. The fan
//!    is one cycle in which the previous corner of each triangle is the next of another, so together the sectors go round v a whole
//!    number of times, without gap or turning back.
//! 2. Cut the view by a line through v: e·x = 0 for an e perpendicular to d. A sector whose next corner has e·x < 0 and whose
//!    previous corner has e·x > 0 runs, being less than half a turn, across that half of the line which is seen first after the
//!    negative side; no other sector meets this half line. So if no corner lies on the line, the number of such sectors is how many
//!    times the fan goes round.
//! 3. If that is once, the sectors tile the view of the star: two of them have a half line in common when they follow each other,
//!    and v otherwise. What lies over a point of a sector belongs to one point of its triangle at most, so triangles
//!    that do not follow each other meet in v only, and those that do meet over their common half line, where each has nothing
//!    but the edge that they share.
//!
//! So **no two triangles of a certified star meet beyond what they share**. Nothing is claimed of the others, which are
//! tested.
//!
//! Signs are computed in f32. With ε = 2⁻²⁴ and differences that carry a relative error of ε, a component of u × v has an
//! error below 5ε(|uⱼvₖ| + |uₖvⱼ|), and (u × v)·d one below 8ε |u|₁|v|₁|d|∞; e = d × k for a fixed k of largest component 1 is off
//! by at most 4ε|d|∞ in a component from a vector that is perpendicular to d exactly, and e·w by at most 12ε|w|₁|d|∞. Both bounds
//! are taken as 16ε, which leaves room for rounding the bounds. What may have underflowed is too small for the bound to be a
//! normal number, and what overflowed is not finite: neither passes.
//!
//! d is the sum of the unit normals in the order in which the triangles are given, the mesh's; so the certificate is a property
//! of the mesh, not of the chunk. (Correcting d by the normals it does not go with, as a perceptron does, certified few stars
//! more and cost more than it saved.)

use super::lanes::{Line, Triangles, WIDTH};
use super::view::{Batch, CellView};

/// 16ε.
const ERROR: f32 = 1.0 / (1 << 20) as f32;

/// Turns the view's line away from directions that meshes like: multiples of the axes, of diagonals, of a regular fan.
const LINE: [f32; 3] = [0.3247, 1.0, -0.7713];

/// d of a vertex, and the number of triangles around it.
pub(super) type View = [f32; 4];

/// Reused from chunk to chunk.
#[derive(Default)]
pub(super) struct Stars {
    views: Vec<View>,
    /// Sectors across the half line, at most [`REFUSED`].
    turns: Vec<u8>,
}

/// More than once round, or a sign that is not safe.
const REFUSED: u8 = 3;

#[inline(always)]
fn minus(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
fn cross(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[inline(always)]
fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

impl Stars {
    /// Looks at all vertices of the view. O(triangles).
    #[inline(always)]
    pub(super) fn look(&mut self, view: &CellView<'_>) {
        self.views.clear();
        self.views.resize(view.positions.len(), View::default());
        let (mut batch, mut solid) = (Batch::EMPTY, view.solid_triangles());
        while batch.fill(view, &mut solid) {
            let normals = unit_normals(&batch.triangles);
            for (i, number) in batch.numbers().iter().enumerate() {
                let normal = [normals[0].0[i], normals[1].0[i], normals[2].0[i], 1.0];
                for v in view.triangles[*number as usize] {
                    let view = &mut self.views[v as usize];
                    for k in 0..4 {
                        view[k] += normal[k];
                    }
                }
            }
        }
        self.turns.clear();
        self.turns.resize(view.positions.len(), 0);
        let (mut views, mut solid) = (Triangles::NONE, view.solid_triangles());
        while batch.fill(view, &mut solid) {
            for (i, number) in batch.numbers().iter().enumerate() {
                let along = view.triangles[*number as usize].map(|v| {
                    let [x, y, z, _] = self.views[v as usize];
                    [x, y, z]
                });
                views.set(i, &along);
            }
            let turns = sectors(&batch.triangles, &views);
            for (i, number) in batch.numbers().iter().enumerate() {
                for (v, more) in view.triangles[*number as usize].iter().zip(&turns) {
                    let turns = &mut self.turns[*v as usize];
                    *turns = (*turns + more[i] as u8).min(REFUSED);
                }
            }
        }
    }

    /// Is the star of a regular vertex certified?
    #[inline]
    pub(super) fn is_certified(&self, vertex: usize) -> bool {
        self.turns[vertex] == 1
    }

    /// Triangles around a vertex, exact below 2²⁴.
    #[inline]
    pub(super) fn degree(&self, vertex: usize) -> f32 {
        self.views[vertex][3]
    }
}

/// The normals, of about unit length; any other vectors would be as right.
#[inline(always)]
fn unit_normals(triangles: &Triangles) -> [Line; 3] {
    let mut normals = [Line([0.0; WIDTH]); 3];
    for i in 0..WIDTH {
        let [a, b, c] = [triangles.corner(0, i), triangles.corner(1, i), triangles.corner(2, i)];
        let normal = cross(minus(b, a), minus(c, a));
        let scale = 1.0 / dot(normal, normal).sqrt();
        for k in 0..3 {
            normals[k].0[i] = normal[k] * scale;
        }
    }
    normals
}

/// What each corner of a triangle, seen along its view, adds to the sectors across the half line: 1 if its own is, [`REFUSED`] if
/// a sign is not safe.
#[inline(always)]
fn sectors(triangles: &Triangles, views: &Triangles) -> [[u32; WIDTH]; 3] {
    let mut turns = [[0; WIDTH]; 3];
    for (k, turns) in turns.iter_mut().enumerate() {
        for (i, turns) in turns.iter_mut().enumerate() {
            let at = triangles.corner(k, i);
            *turns = sector(
                minus(triangles.corner((k + 1) % 3, i), at),
                minus(triangles.corner((k + 2) % 3, i), at),
                views.corner(k, i),
            );
        }
    }
    turns
}

/// The same for one corner, from which the edges go to the next and the previous. Without branches, so that it is compiled to
/// vectors.
#[inline(always)]
fn sector(next: [f32; 3], previous: [f32; 3], along: [f32; 3]) -> u32 {
    let larger = |a: f32, b: f32| if a > b { a } else { b };
    let size = larger(larger(along[0].abs(), along[1].abs()), along[2].abs());
    // Below this, e could have underflowed.
    let error = if size > 1e-30 { size * ERROR } else { f32::INFINITY };
    let line = cross(along, LINE);
    let length = |e: [f32; 3]| e[0].abs() + e[1].abs() + e[2].abs();
    let (next_length, previous_length) = (length(next), length(previous));
    let area = next_length * previous_length;
    let height = dot(cross(next, previous), along);
    let bound = area * error;
    let smallest = f32::MIN_POSITIVE;
    let upward = (height > bound) & (height <= f32::MAX) & (bound > smallest) & (area * ERROR > smallest);
    let (at_next, at_previous) = (dot(next, line), dot(previous, line));
    let clear = |at: f32, bound: f32| (at.abs() > bound) & (at.abs() <= f32::MAX) & (bound > smallest);
    let safe = upward & clear(at_next, next_length * error) & clear(at_previous, previous_length * error);
    let crossing = (at_next < 0.0) & (at_previous > 0.0);
    if safe { u32::from(crossing) } else { u32::from(REFUSED) }
}
