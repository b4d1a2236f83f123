//! Large pieces of the surface are missing.

use super::damage::lose_near;
use super::draft::{Draft, Entry};
use super::mesh::{Mesh, V, dot, plus, times};
use super::random::Chance;
use super::shapes::{LETTERS, LOWER, UPPER, any, apart, arc, blob, cuboid, letter, regular, revolved, smooth, star, tube};

pub(super) const FAMILIES: [Entry; 10] = [
    ("one-face-lost", "a box, prism or cylinder without one of its flat faces", true, one_face),
    ("two-faces-lost", "a box without two adjacent faces", false, two_faces),
    ("corner-lost", "a box without one corner", true, corner),
    ("edge-chipped", "a box without a piece of one edge", true, edge),
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
    let is_bottom = |face: &super::mesh::Face| face.p.iter().all(|p| (dot(*p, to) - at).abs() < 1e-9);
    Draft::of(pressed.only(|face| !is_bottom(face)), pressed).within(0.01)
}
