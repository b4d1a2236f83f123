//! Sound bodies: boxes, bodies of revolution, prisms of any outline, tubes along a path, and free forms.

use super::ears;
use super::mesh::{Face, Mesh, V, beside, cross, dot, length, minus, plus, times, unit};
use super::random::{Chance, around};

/// A point of a profile or an outline.
pub(super) type P = [f64; 2];

/// A closed profile (distance from the z axis, height), each of its edges with the part of the surface that it makes.
pub(super) fn revolved(profile: &[P], parts: impl Fn(usize) -> u32, sides: usize) -> Mesh {
    let point = |[r, z]: P, side: usize| {
        let (c, s) = around((side % sides) as f64 / sides as f64);
        if r == 0.0 { [0.0, 0.0, z] } else { [r * c, r * s, z] }
    };
    let mut faces = Vec::new();
    for (edge, &a) in profile.iter().enumerate() {
        let b = profile[(edge + 1) % profile.len()];
        for side in 0..sides {
            let [p, q, r, s] = [point(a, side), point(a, side + 1), point(b, side + 1), point(b, side)];
            let part = parts(edge);
            if a[0] > 0.0 {
                faces.push(Face { p: [p, q, if b[0] > 0.0 { r } else { s }], part });
            }
            if b[0] > 0.0 {
                faces.push(Face { p: [p, r, s], part });
            }
        }
    }
    Mesh(faces).outward()
}

/// Points of an arc about (0, `height`), from and to so many turns from the top.
pub(super) fn arc(radius: f64, height: f64, from: f64, to: f64, steps: usize) -> Vec<P> {
    let at = |k: usize| from + (to - from) * k as f64 / steps as f64;
    (0..=steps)
        .map(|k| {
            let (c, s) = around(at(k));
            let r = radius * s;
            [if r.abs() < 1e-9 * radius { 0.0 } else { r }, height + radius * c]
        })
        .collect()
}

pub(super) fn sphere(radius: f64, sides: usize) -> Mesh {
    let profile = arc(radius, 0.0, 0.0, 0.5, sides / 2);
    revolved(&profile, |_| 0, sides)
}

pub(super) fn cylinder(radius: f64, low: f64, high: f64, sides: usize) -> Mesh {
    revolved(&[[0.0, low], [radius, low], [radius, high], [0.0, high]], |edge| edge as u32, sides)
}

pub(super) fn cone(radius: f64, height: f64, sides: usize) -> Mesh {
    revolved(&[[0.0, 0.0], [radius, 0.0], [0.0, height]], |edge| edge as u32, sides)
}

/// A ring of rectangular section: bore, outside, and the two ends.
pub(super) fn sleeve(bore: f64, outside: f64, low: f64, high: f64, sides: usize) -> Mesh {
    revolved(&[[bore, high], [bore, low], [outside, low], [outside, high]], |edge| edge as u32, sides)
}

/// The part of a sleeve that is its bore.
pub(super) const BORE: u32 = 0;

pub(super) fn torus(ring: f64, radius: f64, sides: usize, section: usize) -> Mesh {
    let profile: Vec<P> = (0..section)
        .map(|k| {
            let (c, s) = around(k as f64 / section as f64);
            [ring + radius * c, radius * s]
        })
        .collect();
    revolved(&profile, |_| 0, sides)
}

/// From corner to corner, each side a part: x low, x high, y low, y high, z low, z high.
pub(super) fn cuboid(lo: V, hi: V) -> Mesh {
    let mut faces = Vec::new();
    for axis in 0..3 {
        for high in [false, true] {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            let at = |x: bool, y: bool| -> V {
                let mut p = [0.0; 3];
                p[axis] = if high { hi[axis] } else { lo[axis] };
                p[u] = if x { hi[u] } else { lo[u] };
                p[v] = if y { hi[v] } else { lo[v] };
                p
            };
            let corners = [at(false, false), at(true, false), at(true, true), at(false, true)];
            let part = 2 * axis as u32 + u32::from(high);
            for [a, b, c] in [[0, 1, 2], [0, 2, 3]] {
                let face = Face { p: [corners[a], corners[b], corners[c]], part };
                faces.push(if high { face } else { face.turned() });
            }
        }
    }
    Mesh(faces)
}

/// A shape to be extruded: an outline, and holes.
#[derive(Clone, Debug, Default)]
pub(super) struct Outline {
    /// Counterclockwise.
    pub(super) outer: Vec<P>,
    /// Clockwise.
    pub(super) holes: Vec<Vec<P>>,
}

/// The parts of a prism: its ends, then its walls, one a loop that is round, one an edge of other loops.
pub(super) const LOWER: u32 = 0;
pub(super) const UPPER: u32 = 1;

impl Outline {
    pub(super) fn of(outer: Vec<P>) -> Self {
        Self { outer, holes: Vec::new() }
    }

    /// An end at a height, facing up.
    pub(super) fn end(&self, height: f64, part: u32) -> Mesh {
        let up = |t: [P; 3]| Face { p: t.map(|[x, y]| [x, y, height]), part };
        Mesh(ears::triangles(&self.outer, &self.holes).into_iter().map(up).collect())
    }

    /// The walls from one height to another.
    pub(super) fn walls(&self, low: f64, high: f64) -> Mesh {
        let (mut faces, mut part) = (Vec::new(), 2);
        for points in [&self.outer].into_iter().chain(&self.holes) {
            let is_round = points.len() > ROUND;
            for (k, &[ax, ay]) in points.iter().enumerate() {
                let [bx, by] = points[(k + 1) % points.len()];
                let [a, b, c, d] = [[ax, ay, low], [bx, by, low], [bx, by, high], [ax, ay, high]];
                faces.extend([Face { p: [a, b, c], part }, Face { p: [a, c, d], part }]);
                part += u32::from(!is_round);
            }
            part += u32::from(is_round);
        }
        Mesh(faces)
    }

    pub(super) fn prism(&self, low: f64, high: f64) -> Mesh {
        let mut faces = self.end(low, LOWER).turned().0;
        faces.extend(self.end(high, UPPER).0);
        faces.extend(self.walls(low, high).0);
        Mesh(faces)
    }

    /// Another place and size.
    pub(super) fn placed(&self, scale: f64, by: P) -> Self {
        let place = |points: &Vec<P>| points.iter().map(|p| [p[0] * scale + by[0], p[1] * scale + by[1]]).collect();
        Self { outer: place(&self.outer), holes: self.holes.iter().map(place).collect() }
    }

    /// A hole of another outline's shape.
    pub(super) fn without(mut self, hole: &Self) -> Self {
        self.holes.push(hole.outer.iter().rev().copied().collect());
        self
    }
}

/// A loop of more edges is round.
const ROUND: usize = 14;

/// A polygon on a circle of radius 1.
pub(super) fn regular(sides: usize) -> Outline {
    Outline::of((0..sides).map(|k| <[f64; 2]>::from(around(k as f64 / sides as f64))).collect())
}

pub(super) fn rectangle(width: f64, depth: f64) -> Outline {
    let (x, y) = (width / 2.0, depth / 2.0);
    Outline::of(vec![[-x, -y], [x, -y], [x, y], [-x, y]])
}

/// Points alternate between a radius of 1 and `inner`.
pub(super) fn star(points: usize, inner: f64) -> Outline {
    let at = |k: usize| {
        let (c, s) = around(k as f64 / (2 * points) as f64);
        let r = if k.is_multiple_of(2) { 1.0 } else { inner };
        [r * c, r * s]
    };
    Outline::of((0..2 * points).map(at).collect())
}

/// A letter within about 1 of the origin.
pub(super) fn letter(which: char) -> Outline {
    let points: &[[i8; 2]] = match which {
        'L' => &[[0, 0], [4, 0], [4, 1], [1, 1], [1, 6], [0, 6]],
        'T' => &[[2, 0], [3, 0], [3, 5], [5, 5], [5, 6], [0, 6], [0, 5], [2, 5]],
        'U' => &[[0, 0], [4, 0], [4, 6], [3, 6], [3, 1], [1, 1], [1, 6], [0, 6]],
        'E' => &[[0, 0], [4, 0], [4, 1], [1, 1], [1, 2], [3, 2], [3, 4], [1, 4], [1, 5], [4, 5], [4, 6], [0, 6]],
        'H' => &[[0, 0], [1, 0], [1, 3], [3, 3], [3, 0], [4, 0], [4, 6], [3, 6], [3, 4], [1, 4], [1, 6], [0, 6]],
        'Z' => &[[0, 0], [4, 0], [4, 1], [2, 1], [4, 5], [4, 6], [0, 6], [0, 5], [2, 5], [0, 1]],
        _ => &[[1, 0], [2, 0], [2, 2], [4, 2], [4, 3], [2, 3], [2, 6], [1, 6], [1, 3], [0, 3], [0, 2], [1, 2]],
    };
    Outline::of(points.iter().map(|&[x, y]| [f64::from(x) / 3.0 - 0.7, f64::from(y) / 3.0 - 1.0]).collect())
}

pub(super) const LETTERS: [char; 7] = ['L', 'T', 'U', 'E', 'H', 'Z', '+'];

/// A circle swept along a path, with flat ends.
pub(super) fn tube(path: &[V], radius: f64, sides: usize) -> Mesh {
    let along = |k: usize| unit(minus(path[(k + 1).min(path.len() - 1)], path[k.saturating_sub(1)]));
    let [mut u, _] = beside(along(0));
    let mut rings: Vec<Vec<V>> = Vec::new();
    for (k, &middle) in path.iter().enumerate() {
        let axis = along(k);
        u = unit(minus(u, times(axis, dot(u, axis))));
        let v = cross(axis, u);
        let point = |side: usize| {
            let (c, s) = around(side as f64 / sides as f64);
            plus(middle, plus(times(u, radius * c), times(v, radius * s)))
        };
        rings.push((0..sides).map(point).collect());
    }
    let mut faces = Vec::new();
    for pair in rings.windows(2) {
        for side in 0..sides {
            let next = (side + 1) % sides;
            let [a, b, c, d] = [pair[0][side], pair[0][next], pair[1][next], pair[1][side]];
            faces.extend([Face { p: [a, b, c], part: 0 }, Face { p: [a, c, d], part: 0 }]);
        }
    }
    for side in 0..sides {
        let (next, last) = ((side + 1) % sides, path.len() - 1);
        faces.push(Face { p: [path[0], rings[0][next], rings[0][side]], part: 1 });
        faces.push(Face { p: [path[last], rings[last][side], rings[last][next]], part: 2 });
    }
    Mesh(faces).outward()
}

/// A path that winds up about the z axis.
pub(super) fn helix(radius: f64, rise: f64, turns: f64, steps: usize) -> Vec<V> {
    let at = |k: usize| {
        let t = k as f64 / steps as f64;
        let (c, s) = around(turns * t);
        [radius * c, radius * s, rise * t]
    };
    (0..=steps).map(at).collect()
}

/// A sphere with bumps: a free form.
pub(super) fn blob(chance: &mut Chance, radius: f64, sides: usize) -> Mesh {
    let waves: Vec<(V, f64, f64)> = (0..5)
        .map(|_| (times(chance.direction(), chance.from(0.2, 0.5)), chance.from(0.0, 1.0), chance.from(0.02, 0.07)))
        .collect();
    sphere(radius, sides).map(|p| {
        let to = times(p, 1.0 / radius);
        let bump: f64 = waves.iter().map(|(wave, phase, height)| height * around(dot(*wave, to) + phase).1).sum();
        times(p, 1.0 + bump)
    })
}

/// A plate with round bores.
pub(super) fn bored_plate(chance: &mut Chance) -> Mesh {
    let (width, depth, height) = (chance.from(24.0, 50.0), chance.from(16.0, 24.0), chance.from(3.0, 9.0));
    let bores = chance.count(1, 3);
    let mut outline = rectangle(width, depth);
    for bore in 0..bores {
        let x = width * ((bore as f64 + 0.5) / bores as f64 - 0.5);
        let sides = chance.count(16, 32);
        // Between two bores, and beside the last one, something is left.
        let radius = chance.from(2.0, 5.0).min(0.45 * width / bores as f64);
        let hole = regular(sides).placed(radius, [x, chance.from(-2.0, 2.0)]);
        outline = outline.without(&hole);
    }
    outline.prism(0.0, height)
}

/// Any sound body of one closed surface, some 20 in size, of some hundred to two thousand triangles.
pub(super) fn any(chance: &mut Chance) -> Mesh {
    if chance.is(0.5) { smooth(chance) } else { edged(chance) }
}

/// One of round form.
pub(super) fn smooth(chance: &mut Chance) -> Mesh {
    let sides = chance.count(18, 36);
    match chance.count(0, 4) {
        0 => sphere(chance.from(6.0, 14.0), sides),
        1 => torus(chance.from(8.0, 14.0), chance.from(2.0, 5.0), sides + 6, chance.count(10, 20)),
        2 => {
            let radius = chance.from(8.0, 14.0);
            blob(chance, radius, sides)
        }
        3 => {
            let path = helix(chance.from(7.0, 12.0), chance.from(8.0, 20.0), chance.from(0.4, 1.2), chance.count(20, 40));
            tube(&path, chance.from(1.5, 3.0), chance.count(10, 18))
        }
        _ => {
            let (a, b) = (chance.from(0.6, 1.0), chance.from(0.5, 0.9));
            sphere(12.0, sides).map(|[x, y, z]| [x, a * y, b * z])
        }
    }
}

/// One of flat sides and sharp edges.
pub(super) fn edged(chance: &mut Chance) -> Mesh {
    let fine = chance.from(3.0, 7.0);
    let height = chance.from(4.0, 14.0);
    let solid = match chance.count(0, 5) {
        0 => cuboid([0.0; 3], [chance.from(8.0, 25.0), chance.from(8.0, 25.0), chance.from(5.0, 20.0)]),
        1 => letter(chance.one(&LETTERS)).placed(10.0, [0.0; 2]).prism(0.0, height),
        2 => star(chance.count(4, 8), chance.from(0.45, 0.75)).placed(12.0, [0.0; 2]).prism(0.0, height),
        3 => bored_plate(chance),
        4 => regular(chance.count(3, 9)).placed(10.0, [0.0; 2]).prism(0.0, height),
        _ => cylinder(chance.from(5.0, 12.0), 0.0, height, chance.count(16, 40)),
    };
    solid.finer(fine)
}

/// Half of the smallest side of its box.
pub(super) fn reach(mesh: &Mesh) -> f64 {
    let [lo, hi] = mesh.corners();
    (0..3).map(|k| hi[k] - lo[k]).fold(f64::INFINITY, f64::min) / 2.0
}

/// Moved so that it stands beside another body, `gap` away along x.
pub(super) fn beside_of(mesh: &Mesh, other: &Mesh, gap: f64) -> Mesh {
    let ([lo, _], [_, hi]) = (mesh.corners(), other.corners());
    mesh.moved([hi[0] + gap - lo[0], 0.0, 0.0])
}

/// The point of a mesh that is farthest in a direction.
pub(super) fn farthest(mesh: &Mesh, direction: V) -> V {
    let points = mesh.0.iter().flat_map(|face| face.p);
    points.max_by(|a, b| dot(*a, direction).total_cmp(&dot(*b, direction))).unwrap_or([0.0; 3])
}

/// Distance of two points.
pub(super) fn apart(a: V, b: V) -> f64 {
    length(minus(a, b))
}
