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
//! more and cost more than it saved.) Where triangles around one vertex are many, [`super::hubs`] looks at them once more.

use super::lanes::{Line, Triangles, WIDTH};
use super::real::{Real, cross, dot, minus};
use super::view::{Batch, CellView, Standing};

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

/// A vertex with more triangles is a hub: its sectors may be too narrow for single precision, and its triangles make as many pairs as
/// their square, so it is worth more than a regular vertex is.
const HUB: f32 = 256.0;

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
        self.count_turns(view);
    }

    /// Counts the sectors across the half line of each vertex.
    #[inline(always)]
    fn count_turns(&mut self, view: &CellView<'_>) {
        let mut batch = Batch::EMPTY;
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

    /// The hubs at home in the cell that are not regular, or not certified, ascending: [`super::hubs`] may certify them.
    pub(super) fn doubtful_hubs(&self, view: &CellView<'_>) -> Vec<u32> {
        let is_doubtful = |v: &usize| match view.standing[*v] {
            Standing::Away => false,
            Standing::Irregular => self.is_hub(*v),
            Standing::Regular => self.is_hub(*v) && self.turns[*v] != 1,
        };
        (0..view.standing.len()).filter(is_doubtful).map(|v| v as u32).collect()
    }

    /// Takes down which of these were certified.
    pub(super) fn settle(&mut self, hubs: &[u32], certified: &[bool]) {
        for (v, certified) in hubs.iter().zip(certified) {
            self.turns[*v as usize] = if *certified { 1 } else { REFUSED };
        }
    }

    /// Is the star of a vertex certified, which is regular or a hub?
    #[inline]
    pub(super) fn is_certified(&self, vertex: usize) -> bool {
        self.turns[vertex] == 1
    }

    /// Has a vertex more than [`HUB`] triangles? (They are counted exactly below 2²⁴.)
    #[inline]
    pub(super) fn is_hub(&self, vertex: usize) -> bool {
        self.views[vertex][3] > HUB
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
fn sector<T: Real>(next: [T; 3], previous: [T; 3], along: [T; 3]) -> u32 {
    let larger = |a: T, b: T| if a > b { a } else { b };
    let size = larger(larger(along[0].size(), along[1].size()), along[2].size());
    // Below this, e could have underflowed.
    let error = if size > T::SHORTEST { size * T::ERROR } else { T::INFINITY };
    let line = cross(along, T::LINE);
    let length = |e: [T; 3]| e[0].size() + e[1].size() + e[2].size();
    let (next_length, previous_length) = (length(next), length(previous));
    let area = next_length * previous_length;
    let height = dot(cross(next, previous), along);
    let bound = area * error;
    let smallest = T::SMALLEST;
    let upward = (height > bound) & (height <= T::LARGEST) & (bound > smallest) & (area * T::ERROR > smallest);
    let (at_next, at_previous) = (dot(next, line), dot(previous, line));
    let clear = |at: T, bound: T| (at.size() > bound) & (at.size() <= T::LARGEST) & (bound > smallest);
    let safe = upward & clear(at_next, next_length * error) & clear(at_previous, previous_length * error);
    let crossing = (at_next < T::ZERO) & (at_previous > T::ZERO);
    if safe { u32::from(crossing) } else { u32::from(REFUSED) }
}
