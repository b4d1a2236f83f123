//! Bodies that share walls: files of several materials, inlays, stacks.

use super::damage::{flip, lose, lose_near, lose_some, somewhere};
use super::draft::{Draft, Entry};
use super::mesh::Mesh;
use super::random::Chance;
use super::shapes::{
    LETTERS, LOWER, Outline, UPPER, any, beside_of, blob, cuboid, letter, rectangle, regular, sphere, star, torus,
};

pub(super) const FAMILIES: [Entry; 10] = [
    ("core-shares-walls", "a core that fills its pocket exactly, nothing broken", true, core_sound),
    ("core-triangles-lost", "the same, triangles of either lost", true, core_lost),
    ("core-flipped", "the same, triangles of either flipped", true, core_flipped),
    ("core-far-hole", "the same, beside a body with a hole", true, core_far),
    ("inlay-sound", "a flush inlay in its pocket, nothing broken", true, inlay_sound),
    ("inlay-triangles-lost", "the same, triangles of either lost", true, inlay_lost),
    ("inlay-flipped", "the same, triangles of either flipped", true, inlay_flipped),
    ("stack-two-skins", "stacked boxes that share a face, each with its own skin", true, stack_two),
    ("stack-one-skin", "stacked boxes with one common face, triangles lost", true, stack_one),
    ("stack-offset", "a body that stands on another one, their faces in one plane", true, stack_offset),
];

/// A host with a pocket inside, and the core that fills it.
fn core(chance: &mut Chance) -> (Mesh, Mesh) {
    let sides = chance.count(14, 24);
    let (host, core) = match chance.count(0, 4) {
        0 => (cuboid([0.0; 3], [20.0; 3]), cuboid([chance.from(3.0, 7.0); 3], [chance.from(11.0, 16.0); 3])),
        1 => (sphere(14.0, sides), sphere(chance.from(4.0, 9.0), sides)),
        2 => {
            let shape = star(chance.count(4, 7), 0.6).placed(chance.from(5.0, 9.0), [0.0; 2]);
            (regular(sides).placed(12.0, [0.0; 2]).prism(0.0, 14.0), shape.prism(3.0, chance.from(6.0, 12.0)))
        }
        3 => {
            let shape = letter(chance.one(&LETTERS)).placed(chance.from(5.0, 8.0), [0.0; 2]);
            (cuboid([-12.0, -12.0, 0.0], [12.0, 12.0, 10.0]), shape.prism(2.0, chance.from(5.0, 8.0)))
        }
        _ => {
            let host = blob(chance, 16.0, sides);
            (host, torus(6.0, chance.from(1.5, 3.0), sides, 10))
        }
    };
    let fine = chance.from(4.0, 9.0);
    let core = core.finer(fine);
    (host.finer(fine).and(&core.turned()), core)
}

fn core_sound(chance: &mut Chance) -> Draft {
    let (host, core) = core(chance);
    let all = host.and(&core);
    Draft::of(all.clone(), all).bodies(1..=2)
}

/// Triangles lost of one or both: a few, or a share.
fn some_lost(chance: &mut Chance, host: &Mesh, other: &Mesh) -> Mesh {
    let (mut a, mut b) = (host.clone(), other.clone());
    let which = chance.count(0, 2);
    if which != 1 {
        let count = chance.count(1, 3);
        b = if chance.is(0.6) { lose_some(chance, &b, count) } else { lose(chance, &b, 0.05) };
    }
    if which != 0 {
        let count = chance.count(1, 3);
        a = if chance.is(0.6) { lose_some(chance, &a, count) } else { lose(chance, &a, 0.02) };
    }
    a.and(&b)
}

fn some_flipped(chance: &mut Chance, host: &Mesh, other: &Mesh) -> Mesh {
    let share = chance.scale(0.01, 0.2);
    match chance.count(0, 2) {
        0 => host.and(&flip(chance, other, share)),
        1 => flip(chance, host, share / 2.0).and(other),
        _ => flip(chance, &host.and(other), share),
    }
}

fn core_lost(chance: &mut Chance) -> Draft {
    let (host, core) = core(chance);
    Draft::of(some_lost(chance, &host, &core), host.and(&core)).within(0.02).bodies(1..=2)
}

fn core_flipped(chance: &mut Chance) -> Draft {
    let (host, core) = core(chance);
    Draft::of(some_flipped(chance, &host, &core), host.and(&core)).bodies(1..=2)
}

fn core_far(chance: &mut Chance) -> Draft {
    let (host, core) = core(chance);
    let gap = chance.from(1.0, 100.0);
    let other = any(chance);
    let other = beside_of(&other, &host, gap);
    let place = somewhere(chance, &other);
    let damaged = lose_near(&other, place, chance.from(0.03, 0.08) * other.size());
    let damaged = if damaged.0.len() == other.0.len() { lose_some(chance, &other, 1) } else { damaged };
    let both = host.and(&core);
    Draft::of(both.and(&damaged), both.and(&other)).within(0.01).bodies(2..=3)
}

/// A plate with a pocket that is open above, and what fills it.
fn inlay(chance: &mut Chance) -> (Mesh, Mesh) {
    let (width, depth, height) = (chance.from(24.0, 36.0), chance.from(20.0, 30.0), chance.from(2.5, 6.0));
    let floor = height * chance.from(0.2, 0.8);
    let shape = match chance.count(0, 3) {
        0 => regular(chance.count(3, 24)).placed(chance.from(4.0, 8.0), [0.0; 2]),
        1 => rectangle(chance.from(5.0, 14.0), chance.from(5.0, 12.0)),
        2 => star(chance.count(4, 7), 0.5).placed(8.0, [0.0; 2]),
        _ => letter(chance.one(&LETTERS)).placed(chance.from(5.0, 8.0), [0.0; 2]),
    };
    let fine = chance.from(4.0, 12.0);
    let inlay = shape.prism(floor, height).finer(fine);
    let plate: Outline = rectangle(width, depth);
    let mut host = plate.end(0.0, LOWER).turned();
    host.0.extend(plate.clone().without(&shape).end(height, UPPER).0);
    host.0.extend(plate.walls(0.0, height).0);
    let pocket = inlay.only(|face| face.part != UPPER).turned();
    (host.finer(fine).and(&pocket), inlay)
}

fn inlay_sound(chance: &mut Chance) -> Draft {
    let (host, inlay) = inlay(chance);
    let all = host.and(&inlay);
    Draft::of(all.clone(), all).bodies(1..=2)
}

fn inlay_lost(chance: &mut Chance) -> Draft {
    let (host, inlay) = inlay(chance);
    Draft::of(some_lost(chance, &host, &inlay), host.and(&inlay)).within(0.004).bodies(1..=2)
}

fn inlay_flipped(chance: &mut Chance) -> Draft {
    let (host, inlay) = inlay(chance);
    Draft::of(some_flipped(chance, &host, &inlay), host.and(&inlay)).within(0.004).bodies(1..=2)
}

/// Two prisms of one outline on each other.
fn stack(chance: &mut Chance) -> (Mesh, Mesh) {
    let outline = match chance.count(0, 2) {
        0 => rectangle(chance.from(8.0, 25.0), chance.from(8.0, 25.0)),
        1 => regular(chance.count(3, 20)).placed(10.0, [0.0; 2]),
        _ => letter(chance.one(&LETTERS)).placed(10.0, [0.0; 2]),
    };
    let fine = chance.from(4.0, 12.0);
    let (low, high) = (chance.from(4.0, 15.0), chance.from(4.0, 15.0));
    (outline.prism(0.0, low).finer(fine), outline.prism(low, low + high).finer(fine))
}

fn stack_two(chance: &mut Chance) -> Draft {
    let (low, high) = stack(chance);
    let all = low.and(&high);
    let damaged = match chance.count(0, 2) {
        0 => all.clone(),
        1 => some_flipped(chance, &low, &high),
        _ => {
            let count = chance.count(1, 3);
            lose_some(chance, &all, count)
        }
    };
    Draft::of(damaged, all).bodies(1..=2)
}

fn stack_one(chance: &mut Chance) -> Draft {
    let (low, high) = stack(chance);
    let all = low.and(&high);
    let single = low.and(&high.only(|face| face.part != LOWER));
    let count = chance.count(0, 3);
    Draft::of(lose_some(chance, &single, count), all).bodies(1..=2)
}

fn stack_offset(chance: &mut Chance) -> Draft {
    let (width, depth, height) = (chance.from(14.0, 30.0), chance.from(14.0, 30.0), chance.from(3.0, 12.0));
    let base = cuboid([0.0; 3], [width, depth, height]).finer(chance.from(4.0, 30.0));
    let tower = match chance.count(0, 2) {
        0 => regular(chance.count(3, 20)).placed(5.0, [width / 2.0, depth / 2.0]).prism(height, height + 9.0),
        1 => cuboid([2.0, 2.0, height], [width + chance.from(-1.0, 4.0), depth - 3.0, height + 7.0]),
        _ => letter(chance.one(&LETTERS)).placed(6.0, [width / 2.0, depth / 2.0]).prism(height, height + 5.0),
    };
    let all = base.and(&tower.finer(chance.from(3.0, 20.0)));
    Draft::of(all.clone(), all).bodies(1..=2)
}
