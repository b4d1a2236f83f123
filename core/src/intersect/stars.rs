//! Stars that cannot intersect themselves, recognised in linear time.
//!
//! Most boxes that overlap belong to triangles around one vertex. Let v be sound: its triangles (v, next, previous) form one closed
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

use glam::{Mat4, Vec3, Vec4, Vec4Swizzles};

use super::Region;

/// 16ε.
const ERROR: f32 = 1.0 / (1 << 20) as f32;

/// Turns the view's line away from directions that meshes like: multiples of the axes, of diagonals, of a regular fan.
const LINE: Vec3 = Vec3::new(0.3247, 1.0, -0.7713);

/// How a vertex is looked at.
#[derive(Clone, Copy, Default)]
pub(super) struct View {
    /// d, and the number of triangles around the vertex.
    along: Vec4,
    /// e, and the error that goes with an edge of length one.
    line: Vec4,
}

impl View {
    /// Sets e for d.
    #[inline(always)]
    fn set_line(&mut self) {
        let along = self.along.truncate();
        let size = along.abs().max_element();
        // Below this, e could have underflowed.
        let error = if size > 1e-30 { size * ERROR } else { f32::INFINITY };
        self.line = along.cross(LINE).extend(error);
    }
}

/// Reused from chunk to chunk.
#[derive(Default)]
pub(super) struct Stars {
    views: Vec<View>,
    /// Sectors across the half line, at most [`REFUSED`].
    turns: Vec<u8>,
}

/// More than once round, or a sign that is not safe.
const REFUSED: u8 = 3;

/// The normal, of about unit length; any other vector would be as right.
#[inline(always)]
fn unit_normal(region: &Region<'_>, t: [u32; 3]) -> Vec3 {
    let [a, b, c] = region.corners(t);
    let [a, b, c] = [Vec3::from_array(a), Vec3::from_array(b), Vec3::from_array(c)];
    let normal = (b - a).cross(c - a);
    normal * (1.0 / normal.length())
}

impl Stars {
    /// Looks at all vertices of the region. O(triangles).
    pub(super) fn look(&mut self, region: &Region<'_>) {
        self.views.clear();
        self.views.resize(region.positions.len(), View::default());
        for (_, t) in region.solid_triangles() {
            let normal = unit_normal(region, t).extend(1.0);
            for v in t {
                self.views[v as usize].along += normal;
            }
        }
        for view in &mut self.views {
            view.set_line();
        }
        self.turns.clear();
        self.turns.resize(region.positions.len(), 0);
        for (_, t) in region.solid_triangles() {
            self.count_turns(region, t);
        }
    }

    /// Adds a triangle to what its vertices see.
    #[inline(always)]
    fn count_turns(&mut self, region: &Region<'_>, t: [u32; 3]) {
        let view = |k: usize| &self.views[t[k] as usize];
        let (crossing, unsafe_signs) = sector_signs(&region.corners(t), [view(0), view(1), view(2)]);
        for (k, v) in t.iter().enumerate() {
            let turns = &mut self.turns[*v as usize];
            let more = if unsafe_signs >> k & 1 == 1 { REFUSED } else { (crossing >> k & 1) as u8 };
            *turns = (*turns + more).min(REFUSED);
        }
    }

    /// Is the star of a sound vertex certified?
    #[inline]
    pub(super) fn is_certified(&self, vertex: usize) -> bool {
        self.turns[vertex] == 1
    }

    /// Triangles around a vertex, exact below 2²⁴.
    #[inline]
    pub(super) fn degree(&self, vertex: usize) -> f32 {
        self.views[vertex].along.w
    }
}

/// For each corner of a triangle (bit k), seen as its view says: does its sector run across the half line, and is a sign unsafe?
#[inline]
fn sector_signs(corners: &[[f32; 3]; 3], views: [&View; 3]) -> (u32, u32) {
    let [a, b, c] = corners;
    // One lane a corner.
    let along = Mat4::from_cols(views[0].along, views[1].along, views[2].along, Vec4::ZERO).transpose();
    let line = Mat4::from_cols(views[0].line, views[1].line, views[2].line, Vec4::ZERO).transpose();
    let (x, y, z) = (Vec4::new(a[0], b[0], c[0], 0.0), Vec4::new(a[1], b[1], c[1], 0.0), Vec4::new(a[2], b[2], c[2], 0.0));
    let next = [x.yzxw() - x, y.yzxw() - y, z.yzxw() - z];
    let previous = [x.zxyw() - x, y.zxyw() - y, z.zxyw() - z];
    let normal = [
        next[1] * previous[2] - next[2] * previous[1],
        next[2] * previous[0] - next[0] * previous[2],
        next[0] * previous[1] - next[1] * previous[0],
    ];
    let length = |e: &[Vec4; 3]| e[0].abs() + e[1].abs() + e[2].abs();
    let (next_length, previous_length) = (length(&next), length(&previous));
    let largest = Vec4::splat(f32::MAX);
    let smallest = Vec4::splat(f32::MIN_POSITIVE);
    let area = next_length * previous_length;
    let height = normal[0] * along.x_axis + normal[1] * along.y_axis + normal[2] * along.z_axis;
    let bound = area * line.w_axis;
    let upward = height.cmpgt(bound) & height.cmple(largest) & bound.cmpgt(smallest) & (area * ERROR).cmpgt(smallest);
    let place = |e: &[Vec4; 3]| e[0] * line.x_axis + e[1] * line.y_axis + e[2] * line.z_axis;
    let (at_next, at_previous) = (place(&next), place(&previous));
    let (next_bound, previous_bound) = (next_length * line.w_axis, previous_length * line.w_axis);
    let clear = |at: Vec4, bound: Vec4| at.abs().cmpgt(bound) & at.abs().cmple(largest) & bound.cmpgt(smallest);
    let safe = upward & clear(at_next, next_bound) & clear(at_previous, previous_bound);
    let crossing = at_next.cmplt(Vec4::ZERO) & at_previous.cmpgt(Vec4::ZERO);
    (crossing.bitmask(), !safe.bitmask())
}
