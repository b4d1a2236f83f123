//! Damaged meshes whose *meaning* is known: what was broken is a sound solid, so that a repair can be held against what was meant.
//!
//! Each [`Family`] is one way in which files go wrong; its seeds differ in shape, size, place, dose and order. [`Meant::intended`] is
//! a mesh, too: its material is where it winds at least once, so that a cavity that leaves its host, or bodies that share a wall,
//! say what they mean by themselves.
//! [`crate::judge::fidelity`] measures how far a result is from it. Nothing here is shared with the engine.

mod cavities;
mod clearances;
mod contacts;
mod copies;
mod damage;
mod draft;
mod ears;
mod lost;
mod mesh;
mod opposite;
mod ordinary;
mod random;
mod sewing;
mod shapes;
mod sheets;
mod turned;

use std::ops::RangeInclusive;

use crate::judge::Triangle;
use draft::{Draft, Entry};
use mesh::{Mesh, V, beside, minus, plus, times};
use random::{Chance, around};

/// One way in which files go wrong.
#[derive(Clone, Copy)]
pub struct Family {
    /// On the command line and in tables.
    pub name: &'static str,
    /// The group that it belongs to.
    pub group: &'static str,
    /// The damage, in words.
    pub about: &'static str,
    /// The file alone decides what was meant; else asking a person is as good.
    pub decides: bool,
    make: fn(&mut Chance) -> Draft,
}

/// A damaged file, and what it was meant to be.
#[derive(Clone, Debug, PartialEq)]
pub struct Meant {
    /// The file.
    pub damaged: Vec<Triangle>,
    /// Material is where this winds at least once. Empty: no solid was meant, and none should be made.
    pub intended: Vec<Triangle>,
    /// A result is right within this share of the intended volume, by symmetric difference.
    pub tolerance: f64,
    /// Closed bodies of a right result.
    pub bodies: RangeInclusive<u64>,
}

/// Every family, by group.
pub fn families() -> impl Iterator<Item = Family> {
    let groups: [(&'static str, &[Entry]); 10] = [
        ("cavities", &cavities::FAMILIES),
        ("shared walls", &contacts::FAMILIES),
        ("clearances", &clearances::FAMILIES),
        ("sewing", &sewing::FAMILIES),
        ("directions", &turned::FAMILIES),
        ("large losses", &lost::FAMILIES),
        ("sheets and dust", &sheets::FAMILIES),
        ("copies", &copies::FAMILIES),
        ("lost between", &opposite::FAMILIES),
        ("ordinary", &ordinary::FAMILIES),
    ];
    groups.into_iter().flat_map(|(group, entries)| {
        entries.iter().map(move |&(name, about, decides, make)| Family { name, group, about, decides, make })
    })
}

impl Family {
    /// The case of a seed: the same bytes each time.
    pub fn case(&self, seed: u64) -> Meant {
        // By its name, so that a family keeps its cases when others come.
        let key = self.name.bytes().fold(0, |key: u64, byte| key.wrapping_mul(257).wrapping_add(byte.into()));
        let mut chance = Chance::new(seed, key);
        let draft = (self.make)(&mut chance);
        let place = place(&mut chance);
        let written = |mesh: &Mesh| -> Vec<Triangle> {
            mesh.0.iter().map(|face| face.p.map(|p| place(p).map(|x| x as f32))).filter(|t| !has_equal(t)).collect()
        };
        let damaged = damage::shuffled_if(&mut chance, &draft.damaged);
        Meant {
            intended: written(&draft.intended),
            damaged: if draft.keeps_slivers { place_all(&damaged, &place) } else { written(&damaged) },
            tolerance: draft.tolerance,
            bodies: draft.bodies,
        }
    }
}

fn place_all(mesh: &Mesh, place: impl Fn(V) -> V) -> Vec<Triangle> {
    mesh.0.iter().map(|face| face.p.map(|p| place(p).map(|x| x as f32))).collect()
}

/// Two corners became one in f32.
fn has_equal(triangle: &Triangle) -> bool {
    let [a, b, c] = *triangle;
    a == b || b == c || c == a
}

/// Half of all files stand as they were drawn, the others are turned any way; units are millimetres, inches or metres; few are at the
/// origin.
fn place(chance: &mut Chance) -> impl Fn(V) -> V + use<> {
    let unit = if chance.is(0.7) { 1.0 } else { chance.one(&[1.0 / 25.4, 0.001, 10.0]) };
    let axis = if chance.is(0.5) { [0.0, 0.0, 1.0] } else { chance.direction() };
    let [u, v] = beside(axis);
    let is_turned = axis != [0.0, 0.0, 1.0];
    let (c, s) = if is_turned { around(chance.from(0.0, 1.0)) } else { (1.0, 0.0) };
    let (x, y) = (plus(times(u, c), times(v, s)), minus(times(v, c), times(u, s)));
    let by = if chance.is(0.3) { [0.0; 3] } else { times(chance.direction(), chance.scale(1.0, 150.0)) };
    move |p: V| {
        let turned = if is_turned { plus(plus(times(x, p[0]), times(y, p[1])), times(axis, p[2])) } else { p };
        times(plus(turned, by), unit)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::judge::{fidelity, judge_triangles, volumes};

    #[test]
    fn names_are_unique_and_there_are_enough() {
        let mut names: Vec<_> = families().map(|family| family.name).collect();
        assert!(names.len() >= 50, "{}", names.len());
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), families().count());
    }

    /// What is intended is closed, winds as it says, and what is damaged is something else, or is named sound.
    #[test]
    fn what_is_intended_is_closed_and_what_is_damaged_is_not_the_same() {
        for family in families() {
            for seed in 1..=4 {
                let case = family.case(seed);
                let name = format!("{} {seed}", family.name);
                assert_eq!(case, family.case(seed), "{name}");
                assert_ne!(case.damaged, family.case(seed + 1).damaged, "{name}");
                assert!((6..12_000).contains(&case.damaged.len()), "{name}: {} triangles", case.damaged.len());
                if case.intended.is_empty() {
                    continue;
                }
                let counts = judge_triangles(&case.intended).counts;
                assert_eq!(counts.unbalanced_edges, 0, "{name}: {counts:?}");
                let own = fidelity(&case.intended, &case.intended);
                assert!(own.difference < 1e-12 && own.volume > 0.0, "{name}: {own:?}");
                let bodies = volumes(&case.intended).iter().filter(|volume| **volume > 0.0).count() as u64;
                assert!(case.bodies.contains(&bodies), "{name}: {bodies} for {:?}", case.bodies);
            }
        }
    }

    /// A length as it was drawn is as long in the file, whatever the turn.
    #[test]
    fn a_place_keeps_shapes() {
        for seed in 0..40 {
            let place = place(&mut Chance::new(seed, 1));
            let [o, x, y, z] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(place);
            let [x, y, z] = [x, y, z].map(|p| minus(p, o));
            let volume = mesh::dot(x, mesh::cross(y, z));
            assert!((volume / mesh::length(x).powi(3) - 1.0).abs() < 1e-6, "{seed}: {volume}");
        }
    }
}
