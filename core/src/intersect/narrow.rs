//! Four pairs of triangles at once: those that a plane separates for sure.
//!
//! Two convex bodies are apart when, along some direction, one ends before the other begins. Directions are guessed and
//! the gap is computed in f32; any direction will do, so the guess need not be exact, only the gap must exceed its error.
//! Coordinates are taken from the first corner of the first triangle, with a relative error of ε = 2⁻²⁴ each; a product of three
//! terms with the direction w is then off by less than 4ε|w|₁ times the largest coordinate, and the gap by less than 9ε of that. 16ε
//! are asked for. Where something may have underflowed, the bound is no normal number, where something may have overflowed, it is
//! large; neither passes.

use glam::Vec4;

/// 16ε.
const ERROR: f32 = 1.0 / (1 << 20) as f32;

/// A bound below this comes from sums of products below 2¹²⁷.
const LARGEST: f32 = (1_u128 << 107) as f32;

/// Four points or vectors.
#[derive(Clone, Copy)]
struct Points {
    x: Vec4,
    y: Vec4,
    z: Vec4,
}

impl Points {
    #[inline(always)]
    fn new(p: [[f32; 3]; 4]) -> Self {
        let [x, y, z] = [0, 1, 2].map(|k| Vec4::new(p[0][k], p[1][k], p[2][k], p[3][k]));
        Self { x, y, z }
    }

    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        Self { x: self.x - o.x, y: self.y - o.y, z: self.z - o.z }
    }

    #[inline(always)]
    fn add(self, o: Self) -> Self {
        Self { x: self.x + o.x, y: self.y + o.y, z: self.z + o.z }
    }

    #[inline(always)]
    fn cross(self, o: Self) -> Self {
        Self { x: self.y * o.z - self.z * o.y, y: self.z * o.x - self.x * o.z, z: self.x * o.y - self.y * o.x }
    }

    #[inline(always)]
    fn dot(self, o: Self) -> Vec4 {
        self.x * o.x + self.y * o.y + self.z * o.z
    }

    #[inline(always)]
    fn largest(self) -> Vec4 {
        self.x.abs().max(self.y.abs()).max(self.z.abs())
    }
}

/// Four pairs, from the first corner of the first triangle of each.
struct Pairs {
    a: [Points; 3],
    b: [Points; 3],
    /// Largest coordinate times 16ε.
    error: Vec4,
}

impl Pairs {
    /// The pairs that this direction separates.
    #[inline(always)]
    fn separated(&self, w: Points) -> u32 {
        let (a, b) = (self.a.map(|p| p.dot(w)), self.b.map(|p| p.dot(w)));
        let low = |v: [Vec4; 3]| v[0].min(v[1]).min(v[2]);
        let high = |v: [Vec4; 3]| v[0].max(v[1]).max(v[2]);
        let gap = (low(b) - high(a)).max(low(a) - high(b));
        let bound = (w.x.abs() + w.y.abs() + w.z.abs()) * self.error;
        (gap.cmpgt(bound) & bound.cmplt(Vec4::splat(LARGEST)) & bound.cmpgt(Vec4::splat(f32::MIN_POSITIVE))).bitmask()
    }
}

/// Which of four pairs of triangles are certainly apart (bit k: pair k).
#[inline]
pub(super) fn apart(pairs: [[[[f32; 3]; 3]; 2]; 4]) -> u32 {
    let corner = |side: usize, k: usize| Points::new(pairs.map(|p| p[side][k]));
    let origin = corner(0, 0);
    let a = [origin.sub(origin), corner(0, 1).sub(origin), corner(0, 2).sub(origin)];
    let b = [0, 1, 2].map(|k| corner(1, k).sub(origin));
    let largest = [a[1], a[2], b[0], b[1], b[2]].map(Points::largest);
    let error = largest[0].max(largest[1]).max(largest[2]).max(largest[3]).max(largest[4]) * ERROR;
    let pairs = Pairs { a, b, error };
    // Between the middles; this is nearly always enough where neighbours bend away from each other.
    let mut found = pairs.separated(b[0].add(b[1]).add(b[2]).sub(a[1]).sub(a[2]));
    let normals = [&a, &b].map(|t| t[1].sub(t[0]).cross(t[2].sub(t[0])));
    for normal in normals {
        if found == 15 {
            return found;
        }
        found |= pairs.separated(normal);
    }
    // Upright planes on the edges, for triangles that lie nearly in one plane.
    for (t, normal) in [(&a, normals[0]), (&b, normals[1])] {
        for k in 0..3 {
            if found == 15 {
                return found;
            }
            found |= pairs.separated(t[(k + 1) % 3].sub(t[k]).cross(normal));
        }
    }
    found
}
