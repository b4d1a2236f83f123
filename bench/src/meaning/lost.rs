//! Large pieces of the surface are missing.

use std::collections::BTreeMap;

use super::clearances::pin;
use super::damage::{lose_near, patch};
use super::draft::{Draft, Entry};
use super::mesh::{Face, Mesh, V, cross, dot, key, minus, plus, times, unit};
use super::random::Chance;
use super::shapes::{
    LETTERS, LOWER, UPPER, any, apart, arc, blob, cuboid, edged, letter, rectangle, regular, revolved, sleeve, smooth, star, tube,
};

pub(super) const FAMILIES: [Entry; 11] = [
    ("one-face-lost", "a box, prism or cylinder without one of its flat faces", true, one_face),
    ("two-faces-lost", "a box without two adjacent faces", false, two_faces),
    ("corner-lost", "a box without one corner", true, corner),
    ("edge-chipped", "a box without a piece of one edge", true, edge),
    (
        "edge-face-lost",
        "a patch lost across sharp edges (rims, hinges, a box and its lid) that is no flat one",
        false,
        across_edges,
    ),
    ("ends-lost", "a box or prism without top and bottom", true, ends),
    ("tube-ends-lost", "a bent tube or pipe without its ends", true, tube_ends),
    ("plate-both-skins", "a plate that lost both of its skins at one place", false, plate),
    ("half-lost", "half of a body lost", false, half),
    ("rib-end-lost", "the end of a rib lost", false, rib),
    ("scan-bottom-lost", "a scanned form that stood flat, its bottom lost", true, scan),
];

fn any_box(chance: &mut Chance) -> (Mesh, V) {
    let size: V = std::array::from_fn(|_| chance.from(8.0, 30.0));
    (cuboid([0.0; 3], size), size)
}

fn prism(chance: &mut Chance) -> Mesh {
    let high = chance.from(4.0, 20.0);
    match chance.count(0, 3) {
        0 => any_box(chance).0.map(|[x, y, z]| [y, z, x]),
        1 => regular(chance.count(3, 28)).placed(10.0, [0.0; 2]).prism(0.0, high),
        2 => star(chance.count(4, 8), 0.6).placed(10.0, [0.0; 2]).prism(0.0, high),
        _ => letter(chance.one(&LETTERS)).placed(8.0, [0.0; 2]).prism(0.0, high),
    }
}

fn one_face(chance: &mut Chance) -> Draft {
    let body = prism(chance).finer(chance.from(4.0, 30.0));
    let part = chance.one(&[LOWER, UPPER]);
    Draft::of(body.only(|face| face.part != part), body)
}

fn two_faces(chance: &mut Chance) -> Draft {
    let body = any_box(chance).0.finer(chance.from(4.0, 40.0));
    let first = chance.count(0, 5) as u32;
    let second = loop {
        let other = chance.count(0, 5) as u32;
        if other / 2 != first / 2 {
            break other;
        }
    };
    Draft::of(body.only(|face| face.part != first && face.part != second), body)
}

fn corner(chance: &mut Chance) -> Draft {
    let (body, size) = any_box(chance);
    let least = size.iter().fold(f64::INFINITY, |a, &b| a.min(b));
    let body = body.finer(least * chance.from(0.12, 0.3));
    let place = size.map(|x| chance.one(&[0.0, x]));
    Draft::of(lose_near(&body, place, least * chance.from(0.2, 0.4)), body)
}

fn edge(chance: &mut Chance) -> Draft {
    let (body, size) = any_box(chance);
    let least = size.iter().fold(f64::INFINITY, |a, &b| a.min(b));
    let body = body.finer(least * chance.from(0.12, 0.25));
    let place = [size[0] * chance.from(0.4, 0.6), chance.one(&[0.0, size[1]]), chance.one(&[0.0, size[2]])];
    Draft::of(lose_near(&body, place, least * chance.from(0.15, 0.3)), body)
}

fn ends(chance: &mut Chance) -> Draft {
    let body = prism(chance).finer(chance.from(4.0, 30.0));
    Draft::of(body.only(|face| face.part != LOWER && face.part != UPPER), body)
}

fn tube_ends(chance: &mut Chance) -> Draft {
    let turns = chance.from(0.15, 0.45);
    let bend = chance.from(8.0, 20.0);
    let path: Vec<V> = arc(bend, 0.0, 0.0, turns, chance.count(8, 16)).into_iter().map(|[x, z]| [x, 0.0, z]).collect();
    let sides = chance.count(10, 24);
    let outside = chance.from(1.5, 4.0);
    let rod = tube(&path, outside, sides);
    if chance.is(0.5) {
        return Draft::of(rod.only(|face| face.part == 0), rod);
    }
    // A pipe: its ends are rings, which a straight one has as well.
    let high = chance.from(8.0, 30.0);
    let bore = outside * chance.from(0.6, 0.85);
    let profile = [[bore, high], [bore, 0.0], [outside, 0.0], [outside, high]];
    let pipe = revolved(&profile, |edge| edge as u32, sides).finer(4.0);
    Draft::of(pipe.only(|face| face.part % 2 == 0), pipe)
}

fn plate(chance: &mut Chance) -> Draft {
    let (width, depth, high) = (chance.from(20.0, 50.0), chance.from(20.0, 40.0), chance.from(1.0, 4.0));
    let body = cuboid([0.0; 3], [width, depth, high]).finer(chance.from(1.5, 3.0));
    let place = [width * chance.from(0.4, 0.6), depth * chance.from(0.4, 0.6)];
    let radius = chance.from(2.5, 7.0);
    let damaged = body.only(|face| {
        let [x, y, _] = face.middle();
        apart([x, y, 0.0], [place[0], place[1], 0.0]) > radius
    });
    Draft::of(damaged, body)
}

fn half(chance: &mut Chance) -> Draft {
    let body = any(chance).finer(4.0);
    let to = chance.direction();
    let [lo, hi] = body.corners();
    let at = dot(times(plus(lo, hi), 0.5), to);
    Draft::of(body.only(|face| dot(face.middle(), to) < at), body).within(0.02)
}

fn rib(chance: &mut Chance) -> Draft {
    let (length, thick, high) = (chance.from(15.0, 35.0), chance.from(1.0, 3.0), chance.from(4.0, 12.0));
    let body = cuboid([0.0; 3], [length, thick, high]).finer(chance.from(0.8, 2.0));
    let base = cuboid([-3.0, -6.0, -4.0], [length * 0.8, 6.0 + thick, -0.5]).finer(6.0);
    let end = length * chance.from(0.85, 0.97);
    let ragged = thick * 0.5;
    let damaged = body.only(|face| face.middle()[0] < end + chance_of(face.middle()) * ragged);
    Draft::of(damaged.and(&base), body.and(&base)).within(0.02).bodies(2..=2)
}

/// From −1 to 1, by place alone.
fn chance_of(p: V) -> f64 {
    let x = p[0] * 12.989 + p[1] * 78.233 + p[2] * 37.719;
    2.0 * (x - x.floor()) - 1.0
}

/// Cut flat by a plane: what is below is gone, and the cut's rim lies in the plane.
fn scan(chance: &mut Chance) -> Draft {
    let body = if chance.is(0.6) { blob(chance, 12.0, 28) } else { smooth(chance).finer(3.0) };
    let to = if chance.is(0.6) { [0.0, 0.0, 1.0] } else { chance.direction() };
    let extent = body
        .0
        .iter()
        .flat_map(|face| face.p)
        .map(|p| dot(p, to))
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], x| [a.min(x), b.max(x)]);
    let at = extent[0] + (extent[1] - extent[0]) * chance.from(0.1, 0.45);
    // Everything below is pressed flat onto the plane: the bottom is where the form stood.
    let pressed = body.map(|p| if dot(p, to) < at { plus(p, times(to, at - dot(p, to))) } else { p });
    let is_bottom = |face: &Face| face.p.iter().all(|p| (dot(*p, to) - at).abs() < 1e-9);
    Draft::of(pressed.only(|face| !is_bottom(face)), pressed).within(0.01)
}

/// A block with a pocket of the given depth in its upper face, or with a step on it.
fn stepped(size: V, wall: f64, depth: f64) -> Mesh {
    let ([x, y], z) = ([size[0] / 2.0, size[1] / 2.0], size[2]);
    let (outer, inner) = (rectangle(2.0 * x, 2.0 * y), rectangle(2.0 * (x - wall), 2.0 * (y - wall)));
    let block = cuboid([-x, -y, 0.0], [x, y, z]).only(|face| face.part != 5);
    let ([a, b], low) = (inner.outer[2], z - depth.max(0.0));
    let step = cuboid([-a, -b, low], [a, b, z + (-depth).max(0.0)]);
    let step = if depth > 0.0 { step.only(|face| face.part != 5).turned() } else { step.only(|face| face.part != 4) };
    block.and(&outer.without(&inner).end(z, 0)).and(&step)
}

/// Bodies with sharp edges.
fn sharp(chance: &mut Chance) -> (Mesh, u64) {
    match chance.count(0, 3) {
        0 => {
            let (bore, sides) = (chance.from(4.0, 10.0), chance.count(20, 48));
            let pipe = sleeve(bore, bore + chance.from(0.4, 2.0), 0.0, bore * chance.from(1.0, 8.0), sides);
            (if chance.is(0.5) { pipe } else { pipe.finer(chance.from(2.0, 5.0)) }, 1)
        }
        1 => {
            let (pin, knuckle, _, _) = pin(chance);
            (pin.and(&knuckle), 2)
        }
        2 => {
            let (size, wall): (V, f64) = (std::array::from_fn(|_| chance.from(12.0, 30.0)), chance.from(0.8, 2.0));
            let (open, gap) = (stepped(size, wall, size[2] - wall), chance.from(0.1, 0.4));
            let lid = stepped([size[0], size[1], wall], wall + gap, -chance.from(1.0, 3.0));
            let over = lid.map(|[x, y, z]| [x, y, size[2] + gap + wall - z]).turned();
            (open.and(&over).finer(chance.from(2.0, 30.0)), 2)
        }
        _ => (edged(chance), 1),
    }
}

/// Whether a patch has two directions that differ by more than 40°.
fn is_bent(patch: &Mesh) -> bool {
    let normals: Vec<V> = patch.0.iter().map(|face| unit(face.normal())).collect();
    normals.iter().any(|normal| dot(*normal, normals[0]) < 0.76)
}

/// The volume between a patch and what runs straight from its rim to the rim's middle.
fn beyond_flat(patch: &Mesh) -> f64 {
    let mut rim = BTreeMap::new();
    for face in &patch.0 {
        for (k, &a) in face.p.iter().enumerate() {
            let b = face.p[(k + 1) % 3];
            if rim.remove(&(key(b), key(a))).is_none() {
                rim.insert((key(a), key(b)), [a, b]);
            }
        }
    }
    let long: f64 = rim.values().map(|[a, b]| apart(*a, *b)).sum();
    let sum = rim.values().fold([0.0; 3], |sum, [a, b]| plus(sum, times(plus(*a, *b), 0.5 * apart(*a, *b))));
    let middle = times(sum, 1.0 / long);
    let solid = |face: &Face| {
        let [a, b, c] = face.p.map(|p| minus(p, middle));
        dot(a, cross(b, c)) / 6.0
    };
    patch.0.iter().map(solid).sum::<f64>().abs()
}

fn across_edges(chance: &mut Chance) -> Draft {
    loop {
        let (body, bodies) = sharp(chance);
        let share = chance.from(0.01, 0.12);
        let is_of = patch(chance, &body, share);
        let of = |lost| Mesh(body.0.iter().zip(&is_of).filter(|(_, is_of)| **is_of == lost).map(|(face, _)| *face).collect());
        let lost: Mesh = of(true);
        if is_bent(&lost) && beyond_flat(&lost) > 0.015 * body.volume() {
            return Draft::of(of(false), body).within(0.01).bodies(bodies..=bodies);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of a box, a side is flat; a corner's three sides are not, and a straight patch cuts the corner off.
    #[test]
    fn what_a_straight_patch_cuts_off() {
        let cube = cuboid([0.0; 3], [1.0; 3]);
        let side = cube.only(|face| face.part == 5);
        assert!(!is_bent(&side) && beyond_flat(&side) < 1e-12);
        let corner = cube.only(|face| face.part % 2 == 1);
        assert!(is_bent(&corner) && (beyond_flat(&corner) - 0.5).abs() < 1e-12, "{}", beyond_flat(&corner));
    }

    #[test]
    fn a_pocket_is_empty_and_a_step_is_massive() {
        assert!((stepped([4.0, 4.0, 3.0], 1.0, 2.0).volume() - (48.0 - 8.0)).abs() < 1e-9);
        assert!((stepped([4.0, 4.0, 3.0], 1.0, -2.0).volume() - (48.0 + 8.0)).abs() < 1e-9);
    }
}
