//! Four pairs of triangles at once: those that a plane separates for sure.
//!
//! Two convex bodies are apart when, along some direction, one ends before the other begins. Directions are guessed and
//! the gap is computed in f32; any direction will do, so the guess need not be exact, only the gap must exceed its error.
//! Coordinates are taken from the first corner of the first triangle, with a relative error of ε = 2⁻²⁴ each; a product of three
//! terms with the direction w is then off by less than 4ε|w|₁ times the largest coordinate, and the gap by less than 9ε of that. 16ε
//! are asked for. Where something may have underflowed, the bound is no normal number, where something may have overflowed, it is
//! large; neither passes.

use std::ops::{Add, Sub};

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
    fn new(a: &[f32; 3], b: &[f32; 3], c: &[f32; 3], d: &[f32; 3]) -> Self {
        Self { x: Vec4::new(a[0], b[0], c[0], d[0]), y: Vec4::new(a[1], b[1], c[1], d[1]), z: Vec4::new(a[2], b[2], c[2], d[2]) }
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

impl Add for Points {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        Self { x: self.x + o.x, y: self.y + o.y, z: self.z + o.z }
    }
}

impl Sub for Points {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        Self { x: self.x - o.x, y: self.y - o.y, z: self.z - o.z }
    }
}

/// Four pairs, from the first corner of the first triangle of each, which is left out.
struct Pairs {
    a: [Points; 2],
    b: [Points; 3],
    /// Largest coordinate times 16ε.
    error: Vec4,
}

impl Pairs {
    /// The pairs that this direction separates.
    #[inline(always)]
    fn separated(&self, w: Points) -> u32 {
        let (p, q) = (self.a[0].dot(w), self.a[1].dot(w));
        let (r, s, t) = (self.b[0].dot(w), self.b[1].dot(w), self.b[2].dot(w));
        let (a_low, a_high) = (p.min(q).min(Vec4::ZERO), p.max(q).max(Vec4::ZERO));
        let (b_low, b_high) = (r.min(s).min(t), r.max(s).max(t));
        let gap = (b_low - a_high).max(a_low - b_high);
        let bound = (w.x.abs() + w.y.abs() + w.z.abs()) * self.error;
        (gap.cmpgt(bound) & bound.cmplt(Vec4::splat(LARGEST)) & bound.cmpgt(Vec4::splat(f32::MIN_POSITIVE))).bitmask()
    }
}

/// The corners of two triangles.
pub(super) type Pair<'a> = [&'a [f32; 3]; 6];

/// Which directions are tried.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Round {
    /// From one middle to the other, and upright on either triangle: enough for nearly all pairs of a surface that bends.
    Planes,
    /// In the plane of either, upright on its edges: for triangles that lie nearly in one plane.
    Edges,
}

/// Which of four pairs of triangles are certainly apart (bit k: pair k).
#[inline]
pub(super) fn apart(p: &[Pair<'_>; 4], round: Round) -> u32 {
    let corner = |k: usize| Points::new(p[0][k], p[1][k], p[2][k], p[3][k]);
    let origin = corner(0);
    let (u, v) = (corner(1) - origin, corner(2) - origin);
    let (r, s, t) = (corner(3) - origin, corner(4) - origin, corner(5) - origin);
    let largest = u.largest().max(v.largest()).max(r.largest()).max(s.largest()).max(t.largest());
    let pairs = Pairs { a: [u, v], b: [r, s, t], error: largest * ERROR };
    let (e, f) = (s - r, t - r);
    let (m, n) = (u.cross(v), e.cross(f));
    if round == Round::Planes {
        return pairs.separated(r + s + t - u - v) | pairs.separated(m) | pairs.separated(n);
    }
    let mut found = pairs.separated(u.cross(m));
    for w in [v.cross(m), (v - u).cross(m), e.cross(n), f.cross(n), (f - e).cross(n)] {
        if found == 15 {
            break;
        }
        found |= pairs.separated(w);
    }
    found
}
