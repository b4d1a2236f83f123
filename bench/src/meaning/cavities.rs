//! Hollow bodies.

use super::damage::{lose, lose_near, somewhere};
use super::draft::{Draft, Entry};
use super::mesh::{Mesh, V, key, minus, plus, times};
use super::random::Chance;
use super::shapes::{
    LETTERS, apart, blob, bored_plate, cone, cuboid, cylinder, farthest, letter, rectangle, regular, sphere, star,
};

pub(super) const FAMILIES: [Entry; 7] = [
    ("cavity-pokes-out", "a cavity that leaves its host at one place", true, pokes_out),
    ("cavity-in-wall", "a cavity that touches its host's wall from within to a hair", true, near_wall),
    ("cutter-through", "a subtraction that was never done: an inverted body right through another", false, cutter_through),
    ("cutter-blind", "the same, from one side", false, cutter_blind),
    ("offset-shell", "hollowed by moving vertices inward; the inner shell folds where the body is thin", true, offset_shell),
    ("hollow-sound", "hollow and sound: cavities, bodies in cavities", true, sound),
    ("hollow-holes", "hollow, triangles of both shells lost", true, holes),
];

/// A host and a cavity like it (facing inward as it should), each as thick as the wall says.
fn hollow(chance: &mut Chance) -> (Mesh, Mesh, f64) {
    let sides = chance.count(16, 32);
    match chance.count(0, 3) {
        0 => {
            let (radius, wall) = (chance.from(8.0, 20.0), chance.from(0.6, 2.0));
            (sphere(radius, sides), sphere(radius - wall, sides).turned(), wall)
        }
        1 => {
            let (radius, wall) = (chance.from(8.0, 14.0), chance.from(0.6, 2.0));
            let host = blob(chance, radius, sides);
            let inner = host.map(|p| times(p, 1.0 - 1.2 * wall / radius)).turned();
            (host, inner, wall)
        }
        2 => {
            let (radius, height, wall) = (chance.from(8.0, 14.0), chance.from(10.0, 30.0), chance.from(0.6, 2.0));
            let host = cylinder(radius, 0.0, height, sides).finer(5.0);
            (host, cylinder(radius - wall, wall, height - wall, sides).turned().finer(5.0), wall)
        }
        _ => {
            let (size, wall): (V, _) = (std::array::from_fn(|_| chance.from(10.0, 30.0)), chance.from(0.6, 2.0));
            let host = cuboid([0.0; 3], size).finer(6.0);
            (host, cuboid([wall; 3], size.map(|x| x - wall)).turned().finer(6.0), wall)
        }
    }
}

/// The cavity moved so that it passes its host's wall by `beyond` in about one direction.
fn pushed(chance: &mut Chance, host: &Mesh, cavity: &Mesh, beyond: f64) -> Mesh {
    let to = if chance.is(0.5) { chance.one(&[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]) } else { chance.direction() };
    let is_box = host.0.iter().any(|face| face.part > 0);
    let to = if is_box { axis_of(to) } else { to };
    let gap = super::mesh::dot(minus(farthest(host, to), farthest(cavity, to)), to);
    cavity.moved(times(to, gap + beyond))
}

/// The axis that a direction is nearest to.
fn axis_of(to: V) -> V {
    let most = (0..3).max_by(|&a, &b| to[a].abs().total_cmp(&to[b].abs())).unwrap_or(0);
    std::array::from_fn(|k| if k == most { to[k].signum() } else { 0.0 })
}

fn pokes_out(chance: &mut Chance) -> Draft {
    let (host, cavity, wall) = hollow(chance);
    let beyond = wall * chance.scale(0.02, 1.0);
    let cavity = pushed(chance, &host, &cavity, beyond);
    let all = host.and(&cavity);
    // Where facets of both pass each other, islands of the wall may be left.
    Draft::of(all.clone(), all).within(0.02).bodies(1..=u64::MAX)
}

fn near_wall(chance: &mut Chance) -> Draft {
    let (host, cavity, wall) = hollow(chance);
    let beyond = -wall * chance.scale(0.002, 0.1);
    let cavity = pushed(chance, &host, &cavity, beyond);
    let all = host.and(&cavity);
    // Facets of round walls may meet all the same, and leave islands.
    Draft::of(all.clone(), all).within(0.02).bodies(1..=u64::MAX)
}

/// A solid that is cut, and the outline of the cutter, which fits into it.
fn cut(chance: &mut Chance) -> (Mesh, f64, super::shapes::Outline) {
    let height = chance.from(4.0, 12.0);
    let host = match chance.count(0, 3) {
        0 => rectangle(chance.from(20.0, 40.0), chance.from(18.0, 30.0)).prism(0.0, height),
        1 => cylinder(chance.from(10.0, 16.0), 0.0, height, chance.count(18, 36)),
        2 => regular(chance.count(5, 8)).placed(14.0, [0.0; 2]).prism(0.0, height),
        _ => star(chance.count(5, 8), 0.8).placed(15.0, [0.0; 2]).prism(0.0, height),
    };
    let radius = chance.from(2.5, 6.0);
    let cutter = match chance.count(0, 3) {
        0 => regular(chance.count(16, 30)).placed(radius, [0.0; 2]),
        1 => rectangle(1.5 * radius, radius),
        2 => letter(chance.one(&LETTERS)).placed(radius, [0.0; 2]),
        _ => regular(chance.count(3, 8)).placed(radius, [0.0; 2]),
    };
    let by = [chance.from(-1.5, 1.5), chance.from(-1.5, 1.5)];
    (host.finer(8.0), height, cutter.placed(1.0, by))
}

fn cutter_through(chance: &mut Chance) -> Draft {
    let (host, height, outline) = cut(chance);
    let cutter = outline.prism(-chance.from(0.2, 6.0), height + chance.from(0.2, 6.0)).turned().finer(6.0);
    let all = host.and(&cutter);
    Draft::of(all.clone(), all).within(0.01)
}

fn cutter_blind(chance: &mut Chance) -> Draft {
    let (host, height, outline) = cut(chance);
    let cutter = outline.prism(chance.from(0.2, 0.7) * height, height + chance.from(0.2, 6.0)).turned().finer(6.0);
    let all = host.and(&cutter);
    Draft::of(all.clone(), all).within(0.01)
}

fn offset_shell(chance: &mut Chance) -> Draft {
    let host = match chance.count(0, 3) {
        0 => cone(chance.from(8.0, 14.0), chance.from(15.0, 30.0), chance.count(16, 32)).finer(4.0),
        1 => star(chance.count(4, 7), chance.from(0.4, 0.6)).placed(14.0, [0.0; 2]).prism(0.0, chance.from(8.0, 16.0)).finer(3.0),
        2 => letter(chance.one(&LETTERS)).placed(14.0, [0.0; 2]).prism(0.0, chance.from(6.0, 12.0)).finer(3.0),
        _ => {
            let sides = chance.count(20, 30);
            blob(chance, 12.0, sides)
        }
    };
    let (normals, wall) = (host.normals(), chance.from(0.4, 1.2));
    let inward = |p: V| normals.get(&key(p)).map_or(p, |normal| minus(p, times(*normal, wall)));
    let all = host.and(&host.map(inward).turned());
    Draft::of(all.clone(), all).within(0.05).bodies(1..=u64::MAX)
}

fn sound(chance: &mut Chance) -> Draft {
    let (host, cavity, _) = hollow(chance);
    let mut all = host.and(&cavity);
    let mut bodies = 1;
    if chance.is(0.4) {
        let middle = times(plus(cavity.corners()[0], cavity.corners()[1]), 0.5);
        let core = cavity.turned().map(|p| plus(middle, times(minus(p, middle), 0.6)));
        all = all.and(&core);
        bodies = 2;
    }
    if chance.is(0.4) {
        let gap = chance.from(0.1, 5.0);
        let other = bored_plate(chance);
        all = all.and(&super::shapes::beside_of(&other, &host, gap));
        bodies += 1;
    }
    Draft::of(all.clone(), all).bodies(bodies..=bodies)
}

fn holes(chance: &mut Chance) -> Draft {
    let (host, cavity, _) = hollow(chance);
    let (mut outer, mut inner) = (host.clone(), cavity.clone());
    if chance.is(0.5) {
        outer = lose(chance, &outer, 0.01);
        inner = lose(chance, &inner, 0.01);
    } else {
        let (a, b) = (somewhere(chance, &outer), somewhere(chance, &inner));
        let radius = chance.from(0.06, 0.12) * host.size();
        outer = lose_near(&outer, a, radius);
        inner = if apart(a, b) > 3.0 * radius { lose_near(&inner, b, radius) } else { inner };
    }
    Draft::of(outer.and(&inner), host.and(&cavity)).within(0.03)
}
