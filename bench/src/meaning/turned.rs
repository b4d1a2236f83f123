//! Surfaces whose triangles do not say what is outside.

use super::damage::{flip, lose};
use super::draft::{Draft, Entry};
use super::mesh::Mesh;
use super::random::Chance;
use super::shapes::{any, arc, beside_of, cuboid, revolved, sphere};

pub(super) const FAMILIES: [Entry; 7] = [
    ("drain-flipped", "hollow with a drain: half of the triangles flipped, 1 % lost", true, drain),
    ("hollow-flipped", "two shells: up to a third of the triangles flipped, 1 % lost", true, hollow),
    ("inner-outward", "hollow, and the inner shell faces outward, too", false, inner_outward),
    ("half-flipped", "one surface, up to half of the triangles flipped", true, half),
    ("flipped-and-holes", "the same, 1 % lost", true, half_and_holes),
    ("inside-out", "the whole body inside out", true, inside_out),
    ("one-inside-out", "several bodies, some inside out", true, one_inside_out),
];

/// Two shells of one kind.
pub(super) fn shells(chance: &mut Chance) -> (Mesh, Mesh) {
    let sides = chance.count(18, 32);
    if chance.is(0.5) {
        let radius = chance.from(8.0, 30.0);
        (sphere(radius, sides), sphere(radius * chance.from(0.8, 0.97), sides))
    } else {
        let (size, wall) = (chance.from(14.0, 30.0), chance.from(0.6, 2.0));
        let tall = size * chance.from(0.6, 1.6);
        let outer = cuboid([0.0; 3], [size, size, tall]).finer(size / 6.0);
        (outer, cuboid([wall; 3], [size - wall, size - wall, tall - wall]).finer(size / 6.0))
    }
}

/// A hollow egg with an opening.
pub(super) fn drained(chance: &mut Chance) -> Mesh {
    let (radius, sides) = (chance.from(8.0, 18.0), 2 * chance.count(10, 16));
    let wall = radius * chance.from(0.05, 0.15);
    let opening = chance.from(0.03, 0.08);
    let mut profile = arc(radius, 0.0, opening, 0.5, sides / 2);
    profile.extend(arc(radius - wall, 0.0, 0.5, opening, sides / 2));
    let tall = chance.from(0.7, 1.5);
    revolved(&profile, |_| 0, sides).map(|[x, y, z]| [x, y, tall * z])
}

fn drain(chance: &mut Chance) -> Draft {
    let body = drained(chance);
    let share = chance.from(0.3, 0.5);
    let flipped = flip(chance, &body, share);
    Draft::of(lose(chance, &flipped, 0.01), body).within(0.03)
}

fn hollow(chance: &mut Chance) -> Draft {
    let (outer, inner) = shells(chance);
    let body = outer.and(&inner.turned());
    let share = chance.from(0.05, 0.33);
    let flipped = flip(chance, &body, share);
    Draft::of(lose(chance, &flipped, 0.01), body).within(0.03)
}

fn inner_outward(chance: &mut Chance) -> Draft {
    let (outer, inner) = shells(chance);
    Draft::of(outer.and(&inner), outer.and(&inner.turned())).within(0.01)
}

fn half(chance: &mut Chance) -> Draft {
    let body = any(chance);
    let share = chance.from(0.05, 0.5);
    Draft::of(flip(chance, &body, share), body)
}

fn half_and_holes(chance: &mut Chance) -> Draft {
    let body = any(chance);
    let share = chance.from(0.05, 0.5);
    let flipped = flip(chance, &body, share);
    Draft::of(lose(chance, &flipped, 0.01), body).within(0.03)
}

fn inside_out(chance: &mut Chance) -> Draft {
    let body = any(chance);
    Draft::of(body.turned(), body)
}

fn one_inside_out(chance: &mut Chance) -> Draft {
    let (mut damaged, mut intended) = (Mesh::default(), Mesh::default());
    let bodies = chance.count(2, 4);
    for number in 0..bodies {
        let body = any(chance);
        let gap = chance.from(0.5, 10.0);
        let body = if number == 0 { body } else { beside_of(&body, &intended, gap) };
        let is_turned = number == 0 || chance.is(0.3);
        damaged = damaged.and(&if is_turned { body.turned() } else { body.clone() });
        intended = intended.and(&body);
    }
    Draft::of(damaged, intended).bodies(bodies as u64..=bodies as u64)
}
