//! Surfaces that enclose nothing, and specks.

use super::clearances::{joint, pin};
use super::damage::{patch, somewhere};
use super::draft::{Draft, Entry};
use super::mesh::{Face, Mesh, V, beside, length, minus, plus, times, unit};
use super::random::{Chance, around};
use super::shapes::{BORE, any, beside_of, cuboid, edged, rectangle, regular, sleeve, sphere, torus};
use super::turned::shells;

pub(super) const FAMILIES: [Entry; 12] = [
    ("terrain-beside", "a sheet of terrain beside a body", false, terrain_beside),
    ("folds-beside", "folded sheets beside a body", false, folds_beside),
    ("moebius-beside", "a Möbius strip beside a body", false, moebius_beside),
    ("terrain-alone", "a sheet of terrain and nothing else: no solid was meant", false, terrain_alone),
    ("folds-alone", "folded sheets and nothing else", false, folds_alone),
    ("fins", "triangles that stand on edges of the surface", false, fins),
    ("walls-of-no-thickness", "a wall of one sheet, or of two back to back, on a body", false, walls),
    ("spikes", "needles without thickness", false, spikes),
    ("dust", "closed specks beside a body", true, dust),
    ("stray-triangles", "single triangles beside a body", true, strays),
    ("stray-patch-in-gap", "an open patch in a clearance, a cavity, a bore or a ring, which touches nothing", false, in_gap),
    ("inner-sheets", "sheets within a body, which cannot be seen", true, inner),
];

/// A grid of a square of points, `rule` of two numbers from 0 to 1.
fn grid(steps: usize, rule: impl Fn(f64, f64) -> V) -> Mesh {
    let at = |i: usize, j: usize| rule(i as f64 / steps as f64, j as f64 / steps as f64);
    let mut faces = Vec::new();
    for i in 0..steps {
        for j in 0..steps {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            faces.extend([Face { p: [a, b, c], part: 0 }, Face { p: [a, c, d], part: 0 }]);
        }
    }
    Mesh(faces)
}

fn terrain(chance: &mut Chance) -> Mesh {
    let (size, high) = (chance.from(15.0, 40.0), chance.from(1.0, 8.0));
    let waves: Vec<[f64; 4]> =
        (0..4).map(|_| [chance.from(-2.0, 2.0), chance.from(-2.0, 2.0), chance.from(0.0, 1.0), chance.from(0.1, 0.5)]).collect();
    grid(chance.count(10, 26), |u, v| {
        let height: f64 = waves.iter().map(|[a, b, phase, tall]| tall * around(a * u + b * v + phase).1).sum();
        [size * u, size * v, high * height]
    })
}

/// Layers of ground, folded, on each other.
fn folds(chance: &mut Chance) -> Mesh {
    let (size, high, turns) = (chance.from(15.0, 40.0), chance.from(2.0, 6.0), chance.from(0.7, 1.8));
    let (steps, over) = (chance.count(10, 18), chance.from(0.0, 0.35));
    let mut all = Mesh::default();
    for layer in 0..chance.count(1, 4) {
        let phase = chance.from(0.0, 0.2);
        all = all.and(&grid(steps, |u, v| {
            let (c, s) = around(turns * u + phase);
            // Overturned: the fold leans over itself.
            [size * (u + 0.3 * over * c), size * v, high * s + layer as f64 * high * 0.7]
        }));
    }
    all
}

fn moebius(chance: &mut Chance) -> Mesh {
    let (radius, width) = (chance.from(8.0, 15.0), chance.from(2.0, 6.0));
    let (around_it, across) = (chance.count(30, 60), chance.count(2, 5));
    let half_turns = chance.one(&[1.0, 1.0, 3.0]);
    let at = |i: usize, j: usize| -> V {
        // After one way round, rows meet in reverse.
        let (i, j) = if i == around_it { (0, across - j) } else { (i, j) };
        let t = i as f64 / around_it as f64;
        let ((c, s), (ct, st)) = (around(t), around(half_turns * t / 2.0));
        let w = width * (j as f64 / across as f64 - 0.5);
        [(radius + w * ct) * c, (radius + w * ct) * s, w * st]
    };
    let mut faces = Vec::new();
    for i in 0..around_it {
        for j in 0..across {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            faces.extend([Face { p: [a, b, c], part: 0 }, Face { p: [a, c, d], part: 0 }]);
        }
    }
    Mesh(faces)
}

/// A body, and a sheet beside that is nothing to print.
fn with_sheet(chance: &mut Chance, sheet: &Mesh) -> Draft {
    let body = any(chance);
    let gap = chance.from(1.0, 20.0);
    Draft::of(body.and(&beside_of(sheet, &body, gap)), body)
}

fn terrain_beside(chance: &mut Chance) -> Draft {
    let sheet = terrain(chance);
    with_sheet(chance, &sheet)
}

fn folds_beside(chance: &mut Chance) -> Draft {
    let sheet = folds(chance);
    with_sheet(chance, &sheet)
}

fn moebius_beside(chance: &mut Chance) -> Draft {
    let sheet = moebius(chance);
    with_sheet(chance, &sheet)
}

fn terrain_alone(chance: &mut Chance) -> Draft {
    Draft::of(terrain(chance), Mesh::default())
}

fn folds_alone(chance: &mut Chance) -> Draft {
    Draft::of(folds(chance), Mesh::default())
}

fn fins(chance: &mut Chance) -> Draft {
    let body = any(chance);
    let mut damaged = body.clone();
    for _ in 0..chance.count(1, 6) {
        let face = body.0[chance.count(0, body.0.len() - 1)];
        let [a, b, _] = face.p;
        let out = plus(unit(face.normal()), times(chance.direction(), 0.4));
        let tip = plus(times(plus(a, b), 0.5), times(out, length(minus(a, b)) * chance.from(0.2, 0.8)));
        let fin = Face { p: [a, b, tip], ..face };
        damaged.0.push(if chance.is(0.5) { fin } else { fin.turned() });
    }
    Draft::of(damaged, body)
}

/// A wall on top of a plate, which stands in its surface or starts from its vertices.
fn walls(chance: &mut Chance) -> Draft {
    let (width, depth) = (chance.from(15.0, 30.0), chance.from(15.0, 30.0));
    let plate = cuboid([0.0; 3], [width, depth, chance.from(2.0, 6.0)]).finer(chance.from(4.0, 40.0));
    let top = plate.corners()[1][2];
    let (y, high) = (depth * chance.from(0.3, 0.7), chance.from(2.0, 10.0));
    let foot = chance.one(&[0.0, 0.0, -1.0]);
    let sheet = grid(chance.count(1, 5), |u, v| [width * (0.2 + 0.6 * u), y, top + foot + (high - foot) * v]);
    let sheet = if chance.is(0.5) { sheet.and(&sheet.turned()) } else { sheet };
    Draft::of(plate.and(&sheet), plate)
}

fn spikes(chance: &mut Chance) -> Draft {
    let body = any(chance);
    let mut damaged = body.clone();
    for _ in 0..chance.count(1, 4) {
        let face = body.0[chance.count(0, body.0.len() - 1)];
        let tip = plus(face.p[0], times(unit(face.normal()), body.size() * chance.from(0.05, 0.4)));
        let wide = plus(face.p[0], times(minus(face.p[1], face.p[0]), chance.scale(1e-4, 1e-2)));
        let needle = Face { p: [face.p[0], wide, tip], ..face };
        damaged.0.push(needle);
        if chance.is(0.5) {
            damaged.0.push(needle.turned());
        }
    }
    Draft::of(damaged, body)
}

fn dust(chance: &mut Chance) -> Draft {
    let body = any(chance);
    let mut damaged = body.clone();
    let count = chance.count(1, 12);
    for _ in 0..count {
        let grain = body.size() * chance.scale(2e-5, 1e-3);
        let speck = if chance.is(0.5) { cuboid([0.0; 3], [grain; 3]) } else { sphere(grain, 6) };
        let out = times(chance.direction(), 0.6 * body.size());
        let place = plus(somewhere(chance, &body), out);
        damaged = damaged.and(&speck.moved(place));
    }
    Draft::of(damaged, body).bodies(1..=1 + count as u64)
}

fn strays(chance: &mut Chance) -> Draft {
    let body = any(chance);
    let mut damaged = body.clone();
    for _ in 0..chance.count(1, 5) {
        let far = plus(somewhere(chance, &body), times(chance.direction(), body.size() * chance.from(0.3, 1.5)));
        let [u, v] = beside(chance.direction());
        let wide = body.size() * chance.scale(1e-3, 3e-2);
        damaged.0.push(Face { p: [far, plus(far, times(u, wide)), plus(far, times(v, wide))], part: 0 });
    }
    Draft::of(damaged, body)
}

fn inner(chance: &mut Chance) -> Draft {
    let body = edged(chance);
    let hull = cuboid([-20.0; 3], [20.0, 20.0, chance.from(10.0, 30.0)]).finer(chance.from(6.0, 20.0));
    let sheet = grid(chance.count(1, 6), |u, v| [-15.0 + 28.0 * u, -14.0 + 20.0 * v, -12.0 + 6.0 * u * v]);
    let sheet = if chance.is(0.3) { sheet.and(&sheet.turned()) } else { sheet };
    let beside = beside_of(&body, &hull, chance.from(1.0, 9.0));
    let all = hull.and(&beside);
    Draft::of(all.and(&sheet), all).bodies(2..=2)
}

/// A connected piece of a surface.
fn piece(chance: &mut Chance, surface: &Mesh) -> Mesh {
    let share = chance.from(0.05, 0.5);
    let is_of = patch(chance, surface, share);
    Mesh(surface.0.iter().zip(is_of).filter(|(_, is_of)| *is_of).map(|(face, _)| *face).collect())
}

/// A flat or waved sheet any way round about a place, which stays within `reach` of it.
fn loose(chance: &mut Chance, place: V, reach: f64) -> Mesh {
    let axis = chance.direction();
    let [x, y] = beside(axis);
    let (wide, long) = (reach * chance.from(0.3, 1.3), reach * chance.from(0.3, 1.3));
    let (wave, phase) = (if chance.is(0.5) { 0.0 } else { reach * 0.2 }, chance.from(0.0, 1.0));
    grid(chance.count(1, 6), |u, v| {
        let flat = plus(times(x, wide * (u - 0.5)), times(y, long * (v - 0.5)));
        plus(place, plus(flat, times(axis, wave * around(u + phase).1)))
    })
}

/// A ball in its socket, or a pin in its knuckle, and surfaces midway between.
fn clearance(chance: &mut Chance) -> (Mesh, Mesh) {
    loop {
        let is_joint = chance.is(0.5);
        let (inner, outer, radius, gap) = if is_joint { joint(chance) } else { pin(chance) };
        let to = (radius + gap / 2.0) / (radius + gap);
        let [lo, hi] = outer.corners();
        let (all, wide) = (inner.and(&outer), 1.001 * (radius + gap));
        let wall = if is_joint {
            outer.only(|face| face.p.iter().all(|p| length(*p) < wide)).map(|p| times(p, to))
        } else {
            let is_within = |p: &V| (p[0] * p[0] + p[1] * p[1]).sqrt() < wide && p[2] > lo[2] && p[2] < hi[2];
            outer.only(|face| face.p.iter().filter(|p| is_within(p)).count() > 1).map(|[x, y, z]| [x * to, y * to, z])
        };
        // Facets of both must leave room between them.
        if gap > 0.03 * radius && !wall.0.is_empty() {
            return (all, piece(chance, &wall));
        }
    }
}

/// A ring, a plate with a bore, or a sleeve, and a patch in the hole.
fn hole(chance: &mut Chance) -> (Mesh, Mesh) {
    let (sides, bore) = (chance.count(16, 32), chance.from(3.0, 8.0));
    let high = bore * chance.from(0.5, 4.0);
    let thick = chance.from(1.0, 4.0);
    let tube = sleeve(bore, bore + thick, 0.0, high, sides).finer(bore);
    let (body, height) = match chance.count(0, 2) {
        0 => (torus(bore + thick, thick, sides, 14), 0.0),
        1 => {
            let outline = rectangle(2.0 * bore + chance.from(4.0, 20.0), 2.0 * bore + chance.from(4.0, 20.0));
            (outline.without(&regular(sides).placed(bore, [0.0; 2])).prism(0.0, high), high / 2.0)
        }
        _ => (tube.clone(), high / 2.0),
    };
    if height > 0.0 && chance.is(0.5) {
        let to = chance.from(0.3, 0.95);
        let wall = tube.only(|face| face.part == BORE).map(|[x, y, z]| [x * to, y * to, height + (z - height) * 0.9]);
        return (body, piece(chance, &wall));
    }
    let stray = loose(chance, [0.0, 0.0, height], 0.9 * bore);
    (body, stray)
}

fn in_gap(chance: &mut Chance) -> Draft {
    let (body, stray, bodies) = match chance.count(0, 2) {
        0 => {
            let (body, stray) = clearance(chance);
            (body, stray, 2)
        }
        1 => {
            let (outer, inner) = shells(chance);
            let [lo, hi] = inner.corners();
            let (middle, to) = (times(plus(lo, hi), 0.5), chance.from(0.2, 0.9));
            let reach = (0..3).map(|k| hi[k] - lo[k]).fold(f64::INFINITY, f64::min) / 2.0;
            let smaller = inner.map(|p| plus(middle, times(minus(p, middle), to)));
            let stray = if chance.is(0.5) { piece(chance, &smaller) } else { loose(chance, middle, 0.9 * reach) };
            (outer.and(&inner.turned()), stray, 1)
        }
        _ => {
            let (body, stray) = hole(chance);
            (body, stray, 1)
        }
    };
    let stray = if chance.is(0.5) { stray.turned() } else { stray };
    Draft::of(body.and(&stray), body).bodies(bodies..=bodies)
}

#[cfg(test)]
mod tests {
    use super::super::mesh::{cross, dot};
    use super::*;

    /// Full turns of a closed surface about a point, by solid angles.
    fn turns(mesh: &Mesh, at: V) -> f64 {
        let angle = |face: &Face| {
            let [a, b, c] = face.p.map(|p| unit(minus(p, at)));
            dot(a, cross(b, c)).atan2(1.0 + dot(a, b) + dot(b, c) + dot(c, a))
        };
        mesh.0.iter().map(angle).sum::<f64>() / std::f64::consts::TAU
    }

    #[test]
    fn a_patch_in_a_gap_lies_in_no_material() {
        for seed in 0..60 {
            let draft = in_gap(&mut Chance::new(seed, 1));
            let stray = &draft.damaged.0[draft.intended.0.len()..];
            assert!(!stray.is_empty());
            for place in stray.iter().flat_map(|face| face.p.into_iter().chain([face.middle()])) {
                assert!(turns(&draft.intended, place).abs() < 1e-6, "{seed}: {place:?}");
            }
        }
    }
}
