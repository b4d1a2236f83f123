//! The weights of parts of a triangulation, and of triangles upon them, many at a time.

use std::ops::Range;

use glam::DVec3;

/// The weight that is minimised first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Weight {
    /// The sharpest bend, then the area.
    Bend,
    /// The area, then the sharpest bend.
    Area,
}

/// Steps of 1 − cos of the angle between normals; one step is 14° near flat.
const BEND_STEPS: f64 = 32.0;

/// Triangles that are weighed together.
const BLOCK: usize = 32;

/// The weight of a part: the sharpest bend in it, in steps, and its area, which is infinite if there is no such part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Weighs {
    pub(super) bend: f64,
    pub(super) area: f64,
}

impl Weighs {
    pub(super) const NOTHING_LIKE_IT: Self = Self { bend: f64::MAX, area: f64::INFINITY };

    #[inline(always)]
    pub(super) fn is_before(self, other: Self, weight: Weight) -> bool {
        match weight {
            Weight::Bend => (self.bend < other.bend) | ((self.bend == other.bend) & (self.area < other.area)),
            Weight::Area => (self.area < other.area) | ((self.area == other.area) & (self.bend < other.bend)),
        }
    }
}

/// The sharpest bends and the areas of parts, and the unit normals of the triangles at which they begin; zero: unknown.
#[derive(Clone)]
pub(super) struct Weights {
    bends: Vec<f64>,
    areas: Vec<f64>,
    normals: [Vec<f64>; 3],
}

/// Those of some parts in a row.
#[derive(Clone, Copy)]
pub(super) struct Row<'a> {
    bends: &'a [f64],
    areas: &'a [f64],
    normals: [&'a [f64]; 3],
}

impl Weights {
    /// No part of `count`.
    pub(super) fn none(count: usize) -> Self {
        let Weighs { bend, area } = Weighs::NOTHING_LIKE_IT;
        let zeros = || vec![0.0; count];
        Self { bends: vec![bend; count], areas: vec![area; count], normals: [zeros(), zeros(), zeros()] }
    }

    pub(super) fn set(&mut self, at: usize, weighs: Weighs, normal: DVec3) {
        (self.bends[at], self.areas[at]) = (weighs.bend, weighs.area);
        self.normals.iter_mut().zip(normal.to_array()).for_each(|(all, x)| all[at] = x);
    }

    pub(super) fn get(&self, at: usize) -> Weighs {
        Weighs { bend: self.bends[at], area: self.areas[at] }
    }

    pub(super) fn normal(&self, at: usize) -> DVec3 {
        DVec3::from(self.normals.each_ref().map(|all| all[at]))
    }

    pub(super) fn row(&self, at: Range<usize>) -> Row<'_> {
        let normals = self.normals.each_ref().map(|all| &all[at.clone()]);
        Row { bends: &self.bends[at.clone()], areas: &self.areas[at], normals }
    }
}

impl<'a> Row<'a> {
    #[inline(always)]
    fn at(self, places: Range<usize>) -> Self {
        let normals = self.normals.map(|all| &all[places.clone()]);
        Row { bends: &self.bends[places.clone()], areas: &self.areas[places], normals }
    }
}

/// A chord, with the apexes that a triangle on it may have.
#[derive(Clone, Copy)]
pub(super) struct Chord<'a> {
    /// By apex: what is beyond the two other edges of the triangle.
    pub(super) parts: [Row<'a>; 2],
    /// Coordinates of the apexes.
    pub(super) apexes: [&'a [f64]; 3],
    pub(super) ends: [DVec3; 2],
    /// Unit normal of what lies beyond the chord; zero: nothing that is known.
    pub(super) beyond: DVec3,
    pub(super) weight: Weight,
}

/// The weight of the triangle on one of the apexes, with the parts beyond it, and its unit normal.
pub(super) fn with_triangle(chord: &Chord<'_>, place: usize) -> (Weighs, DVec3) {
    let weighs = Block::default().weigh(chord, place..place + 1).next().unwrap_or(Weighs::NOTHING_LIKE_IT);
    (weighs, DVec3::from(triangle(chord, chord.apexes.map(|all| all[place])).0))
}

/// The place of the lightest of all triangles, of equal ones the first, with the parts beyond it; none if none weighs less than this.
pub(super) fn lightest(chord: &Chord<'_>, than: Weighs) -> Option<usize> {
    #[cfg(target_arch = "x86_64")]
    {
        if is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512vl") && is_x86_feature_detected!("avx512dq") {
            // SAFETY: the processor has what it is compiled for.
            return unsafe { lightest_avx512(chord, than) };
        }
        if is_x86_feature_detected!("avx2") {
            // SAFETY: as above.
            return unsafe { lightest_avx2(chord, than) };
        }
    }
    search(chord, than)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512vl,avx512dq")]
fn lightest_avx512(chord: &Chord<'_>, than: Weighs) -> Option<usize> {
    search(chord, than)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn lightest_avx2(chord: &Chord<'_>, than: Weighs) -> Option<usize> {
    search(chord, than)
}

/// Adds what each triangle weighs with the parts beyond it, in the order of the apexes.
pub(super) fn weigh_all(chord: &Chord<'_>, all: &mut Vec<Weighs>) {
    #[cfg(target_arch = "x86_64")]
    {
        if is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512vl") && is_x86_feature_detected!("avx512dq") {
            // SAFETY: the processor has what it is compiled for.
            return unsafe { weigh_all_avx512(chord, all) };
        }
        if is_x86_feature_detected!("avx2") {
            // SAFETY: as above.
            return unsafe { weigh_all_avx2(chord, all) };
        }
    }
    collect(chord, all);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512vl,avx512dq")]
fn weigh_all_avx512(chord: &Chord<'_>, all: &mut Vec<Weighs>) {
    collect(chord, all);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn weigh_all_avx2(chord: &Chord<'_>, all: &mut Vec<Weighs>) {
    collect(chord, all);
}

#[inline(always)]
fn collect(chord: &Chord<'_>, all: &mut Vec<Weighs>) {
    let mut block = Block::default();
    let count = chord.parts[0].bends.len();
    for first in (0..count).step_by(BLOCK) {
        all.extend(block.weigh(chord, first..count.min(first + BLOCK)));
    }
}

#[inline(always)]
fn search(chord: &Chord<'_>, than: Weighs) -> Option<usize> {
    let mut block = Block::default();
    let count = chord.parts[0].bends.len();
    let mut found = (than, None);
    for first in (0..count).step_by(BLOCK) {
        let places = first..count.min(first + BLOCK);
        if any_before(chord, places.clone(), found.0) {
            for (place, weighs) in places.clone().zip(block.weigh(chord, places)) {
                if weighs.area != f64::INFINITY && weighs.is_before(found.0, chord.weight) {
                    found = (weighs, Some(place));
                }
            }
        }
    }
    found.1
}

/// Do the parts at one of these places weigh less together, without a triangle between them?
#[inline(always)]
fn any_before(chord: &Chord<'_>, places: Range<usize>, than: Weighs) -> bool {
    let [left, right] = chord.parts.map(|row| row.at(places.clone()));
    let mut any = false;
    for l in 0..places.len() {
        let weighs = Weighs { bend: larger(left.bends[l], right.bends[l]), area: left.areas[l] + right.areas[l] };
        any |= (weighs.area != f64::INFINITY) & weighs.is_before(than, chord.weight);
    }
    any
}

/// The weights of some triangles with the parts beyond them. In arrays of their own, so that several are weighed at a time.
struct Block {
    bends: [f64; BLOCK],
    areas: [f64; BLOCK],
}

impl Default for Block {
    fn default() -> Self {
        Self { bends: [0.0; BLOCK], areas: [0.0; BLOCK] }
    }
}

impl Block {
    #[inline(always)]
    fn weigh(&mut self, chord: &Chord<'_>, places: Range<usize>) -> impl Iterator<Item = Weighs> {
        let [left, right] = chord.parts.map(|row| row.at(places.clone()));
        let [x, y, z] = chord.apexes.map(|all| &all[places.clone()]);
        let ([ax, ay, az], [bx, by, bz]) = (left.normals, right.normals);
        let count = places.len();
        let (bends, areas) = (&mut self.bends[..count], &mut self.areas[..count]);
        for l in 0..count {
            let (unit, area) = triangle(chord, [x[l], y[l], z[l]]);
            let beside = larger(bend(unit, [ax[l], ay[l], az[l]]), bend(unit, [bx[l], by[l], bz[l]]));
            let around = larger(beside, bend(unit, chord.beyond.to_array()));
            bends[l] = larger(larger(left.bends[l], right.bends[l]), around);
            areas[l] = left.areas[l] + right.areas[l] + area;
        }
        self.bends[..count].iter().zip(&self.areas[..count]).map(|(bend, area)| Weighs { bend: *bend, area: *area })
    }
}

/// The unit normal of the triangle that a chord makes with an apex, and its area.
#[inline(always)]
fn triangle(chord: &Chord<'_>, apex: [f64; 3]) -> ([f64; 3], f64) {
    let [from, to] = chord.ends;
    let (v, u) = (to - from, [apex[0] - from.x, apex[1] - from.y, apex[2] - from.z]);
    let normal = [u[1] * v.z - v.y * u[2], u[2] * v.x - v.z * u[0], u[0] * v.y - v.x * u[1]];
    let length = (normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]).sqrt();
    let unit = normal.map(|n| if length > 0.0 { n / length } else { 0.0 });
    (unit, 0.5 * length)
}

#[inline(always)]
fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// Whole steps of the bend between two unit normals; none where one is unknown.
#[inline(always)]
fn bend(a: [f64; 3], b: [f64; 3]) -> f64 {
    let is_zero = |n: [f64; 3]| (n[0] == 0.0) & (n[1] == 0.0) & (n[2] == 0.0);
    let steps = (1.0 - (a[0] * b[0] + a[1] * b[1] + a[2] * b[2])) * BEND_STEPS;
    if is_zero(a) | is_zero(b) { 0.0 } else { larger(steps.floor(), 0.0) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Parts with few different bends, areas and normals, some of them unknown, so that there are equal ones.
    fn parts() -> impl Strategy<Value = Vec<[(u8, u8, u8); 2]>> {
        prop::collection::vec(prop::array::uniform2((0u8..4, 0u8..5, 0u8..4)), 0..80)
    }

    proptest! {
        #[test]
        fn the_lightest_is_found_as_if_all_were_weighed_one_by_one(
            parts in parts(),
            apexes in prop::collection::vec(prop::array::uniform3(-2i8..3), 80),
            than in (0u8..70, 0u8..20),
            (none, beyond) in (any::<bool>(), 0u8..4),
        ) {
            let normal = |k: u8| [DVec3::ZERO, DVec3::X, DVec3::new(0.6, 0.0, 0.8), -DVec3::Y][usize::from(k)];
            // No area at all is less than 4.
            let area = |x: u8| if x == 4 { f64::INFINITY } else { f64::from(x) };
            let mut rows = [Weights::none(parts.len()), Weights::none(parts.len())];
            for (at, two) in parts.iter().enumerate() {
                let set = |(row, (bend, x, n)): (&mut Weights, &(u8, u8, u8))| {
                    row.set(at, Weighs { bend: f64::from(*bend), area: area(*x) }, normal(*n));
                };
                rows.iter_mut().zip(two).for_each(set);
            }
            let coordinates: [Vec<f64>; 3] =
                std::array::from_fn(|k| apexes[..parts.len()].iter().map(|p| f64::from(p[k])).collect());
            let than = Weighs { bend: f64::from(than.0), area: f64::from(than.1) };
            let than = if none { Weighs::NOTHING_LIKE_IT } else { than };
            // By vectors, one by one.
            let bend = |a: DVec3, b: DVec3| {
                if a == DVec3::ZERO || b == DVec3::ZERO { 0.0 } else { f64::from(((1.0 - a.dot(b)) * BEND_STEPS) as u32) }
            };
            let ends = [DVec3::ZERO, DVec3::new(1.0, 2.0, 0.5)];
            for weight in [Weight::Bend, Weight::Area] {
                let row = |k: usize| rows[k].row(0..parts.len());
                let apexes = coordinates.each_ref().map(|all| &all[..]);
                let chord = Chord { parts: [row(0), row(1)], apexes, ends, beyond: normal(beyond), weight };
                let one = |m: usize| {
                    let [left, right] = [rows[0].get(m), rows[1].get(m)];
                    let apex = DVec3::from(coordinates.each_ref().map(|all| all[m]));
                    let long = (apex - ends[0]).cross(ends[1] - ends[0]);
                    let unit = if long.length() > 0.0 { long / long.length() } else { DVec3::ZERO };
                    let others = [rows[0].normal(m), rows[1].normal(m), normal(beyond)];
                    let bends = others.map(|other| bend(unit, other));
                    let most = bends.into_iter().fold(left.bend.max(right.bend), f64::max);
                    (Weighs { bend: most, area: left.area + right.area + 0.5 * long.length() }, unit)
                };
                let mut want = (than, None);
                let mut all = Vec::new();
                for m in 0..parts.len() {
                    let weighs = one(m).0;
                    all.push(weighs);
                    if weighs.area < f64::INFINITY && weighs.is_before(want.0, weight) {
                        want = (weighs, Some(m));
                    }
                    prop_assert_eq!(with_triangle(&chord, m), one(m));
                }
                prop_assert_eq!(lightest(&chord, than), want.1);
                prop_assert_eq!(search(&chord, than), want.1);
                let mut found = Vec::new();
                weigh_all(&chord, &mut found);
                prop_assert_eq!(found, all);
            }
        }
    }
}
