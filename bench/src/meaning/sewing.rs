//! Surfaces whose pieces do not quite meet.

use super::damage::{double, jitter, lose, unsew};
use super::draft::{Draft, Entry};
use super::mesh::{Face, Mesh, dot, plus, times};
use super::random::Chance;
use super::shapes::{any, bored_plate, cone, cylinder, edged, sleeve, smooth};

pub(super) const FAMILIES: [Entry; 7] = [
    ("sewn-fine", "faces of CAD, each off by 1e-6 to 1e-5 of the size", true, sewn_fine),
    ("sewn-coarse", "the same by 1e-5 to 1e-4", true, sewn_coarse),
    ("sewn-wide", "the same by 1e-4 to 1e-3", true, sewn_wide),
    ("cracks", "every corner of every triangle off by 1e-6 to 2e-5 of the size", true, cracks),
    ("cracks-and-holes", "the same, some triangles lost", true, cracks_and_holes),
    ("jittered-duplicates", "triangles twice, the second time off by 1e-8 to 1e-6 of the size", true, duplicates),
    ("slit", "cut along a plane, the halves off by 1e-6 to 3e-4 of the size", true, slit),
];

/// A body of several faces.
fn cad(chance: &mut Chance) -> Mesh {
    let sides = chance.count(16, 36);
    match chance.count(0, 4) {
        0 | 1 => bored_plate(chance),
        2 => cylinder(chance.from(6.0, 12.0), 0.0, chance.from(6.0, 20.0), sides),
        3 => {
            let bore = chance.from(3.0, 8.0);
            sleeve(bore, bore + chance.from(1.5, 6.0), 0.0, chance.from(5.0, 20.0), sides)
        }
        _ => {
            let body = if chance.is(0.3) { cone(10.0, chance.from(8.0, 20.0), sides) } else { edged(chance) };
            body.finer(7.0)
        }
    }
}

fn sewn(chance: &mut Chance, low: f64, high: f64) -> Draft {
    let body = cad(chance);
    let by = body.size() * chance.scale(low, high);
    // Nobody can tell where a face was that is off by so much: half of that over all faces is much of a thin body.
    let uncertain = 0.5 * by * body.area() / body.volume();
    Draft::of(unsew(chance, &body, by), body).within(uncertain.max(0.01))
}

fn sewn_fine(chance: &mut Chance) -> Draft {
    sewn(chance, 1e-6, 1e-5)
}

fn sewn_coarse(chance: &mut Chance) -> Draft {
    sewn(chance, 1e-5, 1e-4)
}

fn sewn_wide(chance: &mut Chance) -> Draft {
    sewn(chance, 1e-4, 1e-3)
}

fn cracked(chance: &mut Chance) -> (Mesh, Mesh) {
    let body = if chance.is(0.6) { smooth(chance) } else { edged(chance) };
    let by = body.size() * chance.scale(1e-6, 2e-5);
    (jitter(chance, &body, by), body)
}

fn cracks(chance: &mut Chance) -> Draft {
    let (damaged, body) = cracked(chance);
    Draft::of(damaged, body).within(0.01)
}

fn cracks_and_holes(chance: &mut Chance) -> Draft {
    let (damaged, body) = cracked(chance);
    Draft::of(lose(chance, &damaged, 0.01), body).within(0.03)
}

fn duplicates(chance: &mut Chance) -> Draft {
    let body = any(chance);
    let (share, by) = (chance.from(0.1, 1.0), body.size() * chance.scale(1e-8, 1e-6));
    Draft::of(double(chance, &body, share, by), body).within(0.01)
}

fn slit(chance: &mut Chance) -> Draft {
    let body = any(chance);
    let to = chance.direction();
    let [lo, hi] = body.corners();
    let at = dot(times(plus(lo, hi), 0.5), to);
    let most = body.size() * chance.scale(1e-6, 3e-4);
    let step = chance.step(most);
    let moved = |face: &Face| match dot(face.middle(), to) > at {
        true => Face { p: face.p.map(|p| plus(p, step)), ..*face },
        false => *face,
    };
    Draft::of(Mesh(body.0.iter().map(moved).collect()), body).within(0.01)
}
