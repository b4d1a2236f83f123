//! Surfaces that are there twice, the second time a little off.

use super::clearances::joint;
use super::damage::{flip_patch, lose_some, patch};
use super::draft::{Draft, Entry};
use super::mesh::{Face, Mesh, dot, key, minus, plus, times, unit};
use super::random::Chance;
use super::shapes::any;
use super::turned::{drained, shells};

pub(super) const FAMILIES: [Entry; 5] = [
    ("part-skin-doubled", "10 to 50 % of a hollow solid's skin twice, the copy off by 6e-5 to 1e-3 of the size", true, part_skin),
    (
        "whole-copy-and-flip",
        "a shell or body of a hollow thing twice, off by 1e-4 to 5e-4, and a patch flipped",
        true,
        whole_copy,
    ),
    (
        "copy-under-skin",
        "a solid that lost triangles or a face, a copy of it 1e-4 to 1e-3 of the size below its skin",
        true,
        under,
    ),
    (
        "copy-under-skin-inside-out",
        "a solid and a copy 1e-4 to 1e-3 of the size below its skin, both inside out",
        true,
        under_turned,
    ),
    ("copy-deeper", "either, 1e-3 to 5e-3 below: it may be meant as a thin shell", false, deeper),
];

/// Bodies in one another with clearance, shell by shell from the outside: a host and its cavity, and up to two bodies within, of
/// which only the last may be massive.
fn nested(chance: &mut Chance, within: usize) -> Vec<Mesh> {
    let (outer, inner) = shells(chance);
    let middle = times(plus(inner.corners()[0], inner.corners()[1]), 0.5);
    let smaller = |mesh: &Mesh, by: f64| mesh.map(|p| plus(middle, times(minus(p, middle), by)));
    let mut shells = vec![outer, inner.turned()];
    for left in (0..within).rev() {
        let body = smaller(&shells[shells.len() - 1], chance.from(0.6, 0.95)).turned();
        let cavity = smaller(&body, chance.from(0.7, 0.9)).turned();
        shells.push(body);
        if left > 0 || chance.is(0.5) {
            shells.push(cavity);
        }
    }
    shells
}

/// One mesh of many.
fn all(meshes: &[Mesh]) -> Mesh {
    meshes.iter().fold(Mesh::default(), |all, mesh| all.and(mesh))
}

/// A hollow thing, its bodies, and the least distance of its surfaces where that may be small.
fn hollow(chance: &mut Chance) -> (Mesh, u64, f64) {
    match chance.count(0, 4) {
        0 => (all(&nested(chance, 0)), 1, f64::INFINITY),
        1 => (drained(chance), 1, f64::INFINITY),
        2 => {
            let (ball, socket, _, gap) = joint(chance);
            (ball.and(&socket), 2, gap)
        }
        _ => {
            let within = chance.count(1, 2);
            (all(&nested(chance, within)), 1 + within as u64, f64::INFINITY)
        }
    }
}

/// As much of the intended volume as lies between a surface and its copy: nobody can tell which of both it was.
fn between(copied: &Mesh, by: f64, intended: &Mesh) -> f64 {
    (by * copied.area() / intended.volume()).max(0.01)
}

fn part_skin(chance: &mut Chance) -> Draft {
    let (body, bodies, room) = hollow(chance);
    let by = (body.size() * chance.scale(6e-5, 1e-3)).min(room / 4.0);
    let share = chance.from(0.1, 0.5);
    let is_of = patch(chance, &body, share);
    let copied = Mesh(body.0.iter().zip(is_of).filter(|(_, is_of)| *is_of).map(|(face, _)| *face).collect());
    let copy = match chance.count(0, 2) {
        0 => copied.moved(times(chance.direction(), by)),
        way => {
            let (normals, far) = (body.normals(), if way == 1 { by } else { -by });
            copied.map(|p| normals.get(&key(p)).map_or(p, |normal| plus(p, times(*normal, far))))
        }
    };
    let tolerance = between(&copied, by, &body);
    Draft::of(body.and(&copy), body).within(tolerance).bodies(bodies..=bodies)
}

fn whole_copy(chance: &mut Chance) -> Draft {
    let within = chance.count(0, 1);
    let shells = nested(chance, within);
    let body = all(&shells);
    // The host with its cavity, the cavity alone, or what lies within.
    let copied = match chance.count(0, 1 + within) {
        0 => all(&shells[..2]),
        1 => shells[1].clone(),
        _ => all(&shells[2..]),
    };
    let by = body.size() * chance.scale(1e-4, 5e-4);
    let copy = copied.moved(times(chance.direction(), by));
    let share = chance.from(0.03, 0.2);
    let damaged =
        if chance.is(0.5) { body.and(&flip_patch(chance, &copy, share)) } else { flip_patch(chance, &body, share).and(&copy) };
    let (tolerance, bodies) = (between(&copied, by, &body), 1 + within as u64);
    Draft::of(damaged, body).within(tolerance).bodies(bodies..=bodies)
}

/// A solid, a copy of it below its skin, and how far below.
fn shrunk(chance: &mut Chance, share: f64) -> (Mesh, Mesh, f64) {
    loop {
        let body = any(chance);
        let (by, normals) = (body.size() * share, body.normals());
        let copy = body.map(|p| normals.get(&key(p)).map_or(p, |normal| minus(p, times(*normal, by))));
        // Not if thin triangles of it fold, or if a corner does not go below each of its triangles.
        let keeps = |(a, b): (&Face, &Face)| {
            let is_below = |k: usize| dot(minus(a.p[k], b.p[k]), unit(a.normal())) > 0.1 * by;
            dot(a.normal(), b.normal()) > 0.5 * dot(a.normal(), a.normal()) && (0..3).all(is_below)
        };
        if body.0.iter().zip(&copy.0).all(keeps) {
            return (body, copy, by);
        }
    }
}

/// A copy of a solid below its skin, and the solid, which lost something if `is_worn`; both inside out if `is_turned`. What is so near
/// below is no wall that could be printed, and that both face one way says that it is none.
fn below(chance: &mut Chance, share: f64, is_worn: bool, is_turned: bool) -> Draft {
    let (body, copy, by) = shrunk(chance, share);
    let skin = if is_worn { worn(chance, &body) } else { body.clone() };
    let all = skin.and(&copy);
    // Where the skin is lost, that of the copy may stand for it.
    let tolerance = (by * (body.area() - skin.area()) / body.volume()).max(0.01);
    Draft::of(if is_turned { all.turned() } else { all }, body).within(tolerance)
}

/// A few triangles are lost, or one of several faces of CAD.
fn worn(chance: &mut Chance, body: &Mesh) -> Mesh {
    let part = body.0[chance.count(0, body.0.len() - 1)].part;
    let left = body.only(|face| face.part != part);
    if chance.is(0.5) && left.area() > 0.6 * body.area() {
        return left;
    }
    let count = chance.count(1, 5);
    lose_some(chance, body, count)
}

fn under(chance: &mut Chance) -> Draft {
    let share = chance.scale(1e-4, 1e-3);
    below(chance, share, true, false)
}

fn under_turned(chance: &mut Chance) -> Draft {
    let (share, is_worn) = (chance.scale(1e-4, 1e-3), chance.is(0.3));
    below(chance, share, is_worn, true)
}

fn deeper(chance: &mut Chance) -> Draft {
    let (share, is_turned) = (chance.scale(1e-3, 5e-3), chance.is(0.5));
    let is_worn = !is_turned || chance.is(0.3);
    below(chance, share, is_worn, is_turned)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_copy_below_the_skin_is_smaller_and_keeps_its_directions() {
        for seed in 0..40 {
            let (body, copy, by) = shrunk(&mut Chance::new(seed, 1), 5e-3);
            let lost = body.volume() - copy.volume();
            // Less than a layer everywhere, since vertices at edges move aslant.
            assert!(lost > 0.3 * by * body.area() && lost < 1.05 * by * body.area(), "{seed}: {lost}");
        }
    }

    #[test]
    fn shells_in_one_another_face_out_and_in_by_turns() {
        for seed in 0..20 {
            let shells = nested(&mut Chance::new(seed, 1), 2);
            assert!(shells.len() == 5 || shells.len() == 6);
            for (k, pair) in shells.windows(2).enumerate() {
                assert!(pair[0].volume().abs() > 1.05 * pair[1].volume().abs(), "{seed}");
                assert_eq!(pair[0].volume() > 0.0, k % 2 == 0, "{seed}");
            }
        }
    }

    #[test]
    fn what_is_doubled_is_a_tenth_to_a_half() {
        for seed in 0..20 {
            let draft = part_skin(&mut Chance::new(seed, 1));
            let share = draft.damaged.0.len() as f64 / draft.intended.0.len() as f64 - 1.0;
            assert!(share > 0.05 && share <= 0.51, "{seed}: {share}");
        }
    }
}
