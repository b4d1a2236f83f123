//! Parts that are printed in place: bodies with a small gap between them.

use super::damage::{lose, lose_near};
use super::draft::{Draft, Entry};
use super::mesh::{Mesh, V};
use super::random::Chance;
use super::shapes::{BORE, P, apart, arc, cuboid, cylinder, revolved, sleeve, torus};

pub(super) const FAMILIES: [Entry; 9] = [
    ("clearance-sound", "parts with a gap between them, nothing broken", true, sound),
    ("ball-joint", "ball in its socket, a region of one or both lost at the gap", true, ball),
    ("hinge", "pin in its knuckle, a region of one or both lost at the gap", true, hinge),
    ("sleeve-bore", "a sleeve around a shaft lost its bore", true, bore),
    ("sleeve-triangles", "sleeve and shaft, triangles of both lost", true, sleeve_triangles),
    ("double-wall", "two thin walls with a gap less than their width, 3 % of the triangles lost", true, double_wall),
    ("boxes-one-face", "parallel boxes; one lost the face towards the other", true, boxes_one),
    ("boxes-both-faces", "parallel boxes; both lost the faces towards each other", false, boxes_both),
    ("linked-rings", "two linked rings, a region of one or both lost where they are near", true, rings),
];

/// A ball on a stem, and the cup around it.
pub(super) fn joint(chance: &mut Chance) -> (Mesh, Mesh, f64, f64) {
    let (radius, sides) = (chance.from(5.0, 12.0), 2 * chance.count(9, 16));
    let gap = radius * chance.scale(0.01, 0.06);
    let opening = chance.from(0.1, 0.2);
    let mut profile = arc(radius * 1.4 + gap, 0.0, opening, 0.5, sides / 2);
    profile.extend(arc(radius + gap, 0.0, 0.5, opening, sides / 2));
    let socket = revolved(&profile, |edge| u32::from(edge > sides / 2), sides);
    let neck = opening * 0.45;
    let mut ball: Vec<P> = arc(radius, 0.0, 0.5, neck, sides / 2);
    let stem = ball.last().map_or(0.0, |last| last[0]);
    ball.extend([[stem, radius * chance.from(1.6, 2.4)], [0.0, 0.0]]);
    if let [.., before, last] = &mut ball[..] {
        *last = [0.0, before[1]];
    }
    (revolved(&ball, |_| 0, sides), socket, radius, gap)
}

/// A pin, and the knuckle around it.
pub(super) fn pin(chance: &mut Chance) -> (Mesh, Mesh, f64, f64) {
    let (radius, sides) = (chance.from(2.0, 6.0), 2 * chance.count(8, 18));
    let gap = radius * chance.scale(0.015, 0.1);
    let length = radius * chance.from(2.0, 5.0);
    let pin = cylinder(radius, -chance.from(1.0, 5.0), length + chance.from(1.0, 5.0), sides);
    let knuckle = sleeve(radius + gap, radius * chance.from(1.5, 2.2), 0.0, length, sides);
    let fine = radius * chance.from(0.5, 1.0);
    (pin.finer(fine), knuckle.finer(fine), radius, gap)
}

fn sound(chance: &mut Chance) -> Draft {
    let (a, b, _, _) = if chance.is(0.5) { joint(chance) } else { pin(chance) };
    let all = a.and(&b);
    Draft::of(all.clone(), all).bodies(2..=2)
}

/// A region is lost of either or both bodies where they are near each other.
fn region_lost(chance: &mut Chance, inner: &Mesh, outer: &Mesh, place: V, radius: f64) -> Mesh {
    let which = chance.count(0, 3);
    // Where triangles are larger than the region, one is.
    let left = |mesh: &Mesh| {
        let nearest = mesh.0.iter().map(|face| apart(face.middle(), place)).fold(f64::INFINITY, f64::min);
        lose_near(mesh, place, radius.max(nearest * 1.01))
    };
    match which {
        0 => left(inner).and(outer),
        1 => inner.and(&left(outer)),
        _ => left(inner).and(&left(outer)),
    }
}

fn ball(chance: &mut Chance) -> Draft {
    let (ball, socket, radius, gap) = joint(chance);
    let down = loop {
        let to = chance.direction();
        if to[2] < 0.1 {
            break to;
        }
    };
    let place = down.map(|x| x * (radius + gap / 2.0));
    let wide = radius * chance.from(0.15, 0.45);
    let damaged = region_lost(chance, &ball, &socket, place, wide);
    Draft::of(damaged, ball.and(&socket)).within(0.03).bodies(2..=2)
}

fn hinge(chance: &mut Chance) -> Draft {
    let (pin, knuckle, radius, gap) = pin(chance);
    let side = chance.direction();
    let flat = (side[0] * side[0] + side[1] * side[1]).sqrt().max(1e-3);
    let far = (radius + gap / 2.0) / flat;
    let height = knuckle.corners()[1][2] * chance.from(0.3, 0.7);
    let place = [side[0] * far, side[1] * far, height];
    let wide = radius * chance.from(0.25, 0.45);
    let damaged = region_lost(chance, &pin, &knuckle, place, wide);
    Draft::of(damaged, pin.and(&knuckle)).within(0.03).bodies(2..=2)
}

fn bore(chance: &mut Chance) -> Draft {
    let (radius, sides) = (chance.from(3.0, 8.0), chance.count(16, 40));
    let gap = radius * chance.scale(0.015, 0.1);
    let length = radius * chance.from(1.0, 4.0);
    let shaft = cylinder(radius, -chance.from(1.0, 8.0), length + chance.from(1.0, 8.0), sides);
    let sleeve = sleeve(radius + gap, radius * chance.from(1.4, 2.0), 0.0, length, sides);
    let fine = radius * chance.from(0.6, 2.0);
    let (shaft, sleeve) = (shaft.finer(fine), sleeve.finer(fine));
    Draft::of(shaft.and(&sleeve.only(|face| face.part != BORE)), shaft.and(&sleeve)).within(0.01).bodies(2..=2)
}

fn sleeve_triangles(chance: &mut Chance) -> Draft {
    let (pin, knuckle, _, _) = pin(chance);
    let (a, b) = (lose(chance, &pin, 0.02), lose(chance, &knuckle, 0.02));
    Draft::of(a.and(&b), pin.and(&knuckle)).within(0.03).bodies(2..=2)
}

fn double_wall(chance: &mut Chance) -> Draft {
    let (width, height, thick) = (chance.from(15.0, 40.0), chance.from(10.0, 30.0), chance.from(0.3, 1.0));
    let gap = thick * chance.from(0.2, 0.8);
    let fine = chance.from(4.0, 9.0);
    let all = if chance.is(0.6) {
        let wall = cuboid([0.0; 3], [width, thick, height]).finer(fine);
        wall.and(&wall.moved([0.0, thick + gap, 0.0]))
    } else {
        let (radius, sides) = (chance.from(6.0, 14.0), chance.count(20, 36));
        let inner = sleeve(radius, radius + thick, 0.0, height, sides);
        let outer = sleeve(radius + thick + gap, radius + 2.0 * thick + gap, 0.0, height, sides);
        inner.finer(fine).and(&outer.finer(fine))
    };
    Draft::of(lose(chance, &all, 0.03), all).within(0.03).bodies(2..=2)
}

/// Two boxes, some way apart along x; the parts of their faces towards each other are [`TOWARDS`].
fn boxes(chance: &mut Chance) -> (Mesh, Mesh) {
    let [a, b]: [V; 2] = std::array::from_fn(|_| std::array::from_fn(|_| chance.from(8.0, 25.0)));
    let gap = chance.scale(0.2, 8.0);
    let b = if chance.is(0.5) { [b[0], a[1], a[2]] } else { b };
    let shift = if chance.is(0.5) { [0.0; 2] } else { [chance.from(-3.0, 3.0), chance.from(-3.0, 3.0)] };
    let fine = if chance.is(0.5) { 100.0 } else { chance.from(4.0, 10.0) };
    let other = cuboid([a[0] + gap, shift[0], shift[1]], [a[0] + gap + b[0], shift[0] + b[1], shift[1] + b[2]]);
    (cuboid([0.0; 3], a).finer(fine), other.finer(fine))
}

/// High x of the first box, low x of the second.
const TOWARDS: [u32; 2] = [1, 0];

fn boxes_one(chance: &mut Chance) -> Draft {
    let (a, b) = boxes(chance);
    let which = chance.count(0, 1);
    let left = [&a, &b].map(|mesh| mesh.only(|face| face.part != TOWARDS[which]));
    let damaged = if which == 0 { left[0].and(&b) } else { a.and(&left[1]) };
    Draft::of(damaged, a.and(&b)).within(0.005).bodies(2..=2)
}

fn boxes_both(chance: &mut Chance) -> Draft {
    let (a, b) = boxes(chance);
    let damaged = a.only(|face| face.part != TOWARDS[0]).and(&b.only(|face| face.part != TOWARDS[1]));
    Draft::of(damaged, a.and(&b)).within(0.005).bodies(2..=2)
}

fn rings(chance: &mut Chance) -> Draft {
    let (ring, radius) = (chance.from(8.0, 14.0), chance.from(1.5, 2.5));
    let (sides, section) = (chance.count(28, 44), chance.count(10, 16));
    let a = torus(ring, radius, sides, section);
    let gap = radius * chance.scale(0.03, 0.3);
    // The second one stands upright and passes through the first, near its inner side.
    let b = torus(ring, radius, sides, section).map(|[x, y, z]| [x, z, y]).turned().moved([
        2.0 * ring - 2.0 * radius - gap,
        0.0,
        0.0,
    ]);
    let place = [ring - radius - gap / 2.0, 0.0, 0.0];
    let wide = radius * chance.from(0.5, 1.0);
    let damaged = region_lost(chance, &a, &b, place, wide);
    Draft::of(damaged, a.and(&b)).within(0.03).bodies(2..=2)
}
