//! The smoothest surface through a patch's new vertices that continues the surroundings.
//!
//! Three rings around are fixed; the new vertices minimise how much the mean curvature vector H = Δx changes, ∫|∇H|². Where nothing
//! else is in the way, Δ³x = 0, and position, tangent plane and curvature go on across the rim (Botsch & Kobbelt, "An Intuitive Framework
//! for Real-Time Freeform Modeling", SIGGRAPH 2004). H at a vertex is that of the quadratic which fits its neighbours best: unlike the
//! usual cotangents it does not depend on how they are triangulated, which makes the result better by one to two orders of magnitude.
//! The integral's matrix is symmetric and positive definite whatever the triangles are, as its weights are cut off below.

use crate::util::ids::NONE;
use glam::DVec3;

use super::sheet::Sheet;
use super::sparse::{Factor, Rows};

/// The energy that is made small.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Energy {
    /// Area, by edges of the same stiffness: needs no geometry to begin with.
    Membrane,
    /// Curvature: continues position and tangent plane.
    Plate,
    /// Change of curvature: continues curvature, too.
    Curvature,
}

/// For each vertex, the triangles at it; or its neighbours.
struct Lists {
    starts: Vec<u32>,
    items: Vec<u32>,
}

impl Lists {
    /// By number below `count`, the sets that hold it, in their order.
    fn by<'s, const N: usize>(count: usize, sets: impl Iterator<Item = &'s [u32; N]> + Clone) -> Self {
        let mut starts = vec![0_u32; count + 1];
        for v in sets.clone().flatten() {
            starts[*v as usize + 1] += 1;
        }
        for v in 0..count {
            starts[v + 1] += starts[v];
        }
        let mut next = starts.clone();
        let mut items = vec![0; starts[count] as usize];
        for (set, i) in sets.zip(0..) {
            for &v in set {
                items[next[v as usize] as usize] = i;
                next[v as usize] += 1;
            }
        }
        Self { starts, items }
    }

    fn of(&self, v: u32) -> &[u32] {
        &self.items[self.starts[v as usize] as usize..self.starts[v as usize + 1] as usize]
    }
}

/// Largest cotangent believed: beyond, a triangle is so poor that it says nothing.
const STEEP: f64 = 20.0;
/// Smallest weight of an edge in the integral, so that it stays positive.
const LEAST: f64 = 0.02;
/// Largest residual of a solution, relative to the right-hand side.
const RESIDUAL: f64 = 1e-6;
/// Entries of the factor, at most.
const ENTRIES: usize = 40_000_000;

fn cotangent(a: DVec3, b: DVec3) -> f64 {
    let across = a.cross(b).length();
    let along = a.dot(b);
    if across * STEEP > along.abs() {
        along / across
    } else if along > 0.0 {
        STEEP
    } else if along < 0.0 {
        -STEEP
    } else {
        0.0
    }
}

/// The forms of an energy: it is ½ hᵀ W h of values h, which are linear in the vertices' positions.
#[derive(Default)]
struct Forms {
    /// By value: what it takes of the new vertices.
    of_new: Rows,
    /// The values of the surface as it is.
    values: Vec<DVec3>,
    /// W.
    weights: Rows,
}

impl Forms {
    /// Adds the value Σ `weight` x over vertices.
    fn push(&mut self, sheet: &Sheet<'_>, value: &[(u32, f64)]) {
        self.values.push(value.iter().map(|(v, weight)| sheet.points[*v as usize] * *weight).sum());
        let held = sheet.held as u32;
        self.of_new.push(value.iter().filter(|(v, _)| *v >= held).map(|(v, weight)| (v - held, *weight)));
    }
}

/// Moves the new vertices to where the energy is smallest, measured on the surface as it is now. `sharp`: vertices over which curvature
/// does not go on, by number. `None` where the system cannot be solved reliably. Gives how far the vertices moved, root mean square.
pub(super) fn solve(sheet: &mut Sheet<'_>, sharp: &[bool], energy: Energy) -> Option<f64> {
    let all: Vec<[u32; 3]> = sheet.all().collect();
    let (held, free) = (sheet.held, sheet.points.len() - sheet.held);
    let at = Lists::by(sheet.points.len(), all.iter());
    let forms = match energy {
        Energy::Membrane => membrane(sheet, &all, &at),
        Energy::Plate | Energy::Curvature => curvature(sheet, &all, &at, sharp, energy),
    };
    let by_vertex = forms.of_new.transposed(free);
    let square = by_vertex.times(free, &forms.weights.times(forms.weights.len(), &forms.of_new, free), free);
    // What is solved for is how far vertices move, so that rounding is relative to that.
    let weighted: Vec<DVec3> = forms.weights.of(&forms.values);
    let sides: Vec<DVec3> = by_vertex.of(&weighted).into_iter().map(|force| -force).collect();
    let size = (0..free).map(|i| square.row(i).map(|(_, value)| value.abs()).sum()).fold(0.0, f64::max);
    let factor = Factor::new(&square, &sheet.points[held..], ENTRIES)?;
    let mut moves = factor.solve(&sides);
    let rest = |moves: &[DVec3]| -> Vec<DVec3> {
        (0..free).map(|i| square.row(i).fold(sides[i], |rest, (c, value)| rest - moves[c as usize] * value)).collect()
    };
    // One step of iterative refinement.
    let more = factor.solve(&rest(&moves));
    for (x, more) in moves.iter_mut().zip(&more) {
        *x += *more;
    }
    let norm = |v: &[DVec3]| v.iter().map(|x| x.length_squared()).sum::<f64>().sqrt();
    // Written so that what is not a number is refused, too.
    let solved = norm(&rest(&moves)) <= RESIDUAL * norm(&sides) + 1e-12 * size;
    if !solved {
        return None;
    }
    for (point, by) in sheet.points[held..].iter_mut().zip(&moves) {
        *point += *by;
    }
    sheet.points.iter().all(|p| p.is_finite()).then(|| norm(&moves) / (free as f64).sqrt())
}

/// Differences along the edges at new vertices.
fn membrane(sheet: &Sheet<'_>, all: &[[u32; 3]], at: &Lists) -> Forms {
    let mut forms = Forms::default();
    for v in sheet.held as u32..sheet.points.len() as u32 {
        for &i in at.of(v) {
            let t = all[i as usize];
            let Some(k) = t.iter().position(|&w| w == v) else { continue };
            forms.weights.push([(forms.values.len() as u32, 1.0)]);
            forms.push(sheet, &[(v, 1.0), (t[(k + 1) % 3], -1.0)]);
        }
    }
    forms
}

/// Mean curvature at vertices, or its change between them.
fn curvature(sheet: &Sheet<'_>, all: &[[u32; 3]], at: &Lists, sharp: &[bool], energy: Energy) -> Forms {
    let n = sheet.points.len();
    let wanted = wanted(sheet, all, at);
    let mut number = vec![NONE; n];
    let mut areas = Vec::new();
    let mut forms = Forms::default();
    let mut row = Stencil::default();
    for v in 0..n as u32 {
        if !wanted[v as usize] || sharp[v as usize] {
            continue;
        }
        let area = at.of(v).iter().map(|&i| sheet.normal(all[i as usize]).length()).sum::<f64>() / 6.0;
        if row.quadratic(sheet, all, at, sharp, v) {
            number[v as usize] = forms.values.len() as u32;
            areas.push(area);
            forms.push(sheet, &row.entries);
        }
    }
    if energy == Energy::Plate {
        for (i, area) in (0..).zip(areas) {
            forms.weights.push([(i, area)]);
        }
    } else {
        forms.weights = differences_of(sheet, all, &number, areas.len() as u32);
    }
    forms
}

/// By vertex: its mean curvature H is wanted. Those of new vertices, of the rim, and of one ring beyond.
fn wanted(sheet: &Sheet<'_>, all: &[[u32; 3]], at: &Lists) -> Vec<bool> {
    let mut wanted = vec![false; sheet.points.len()];
    wanted[sheet.fixed..].fill(true);
    for v in 0..sheet.fixed {
        if sheet.on_rim[v] {
            for &i in at.of(v as u32) {
                for w in all[i as usize] {
                    wanted[w as usize] = true;
                }
            }
        }
    }
    wanted
}

/// Differences between the rows of neighbours, weighted by cotangents. `number`: the row of each vertex; so many `rows` there are.
fn differences_of(sheet: &Sheet<'_>, all: &[[u32; 3]], number: &[u32], rows: u32) -> Rows {
    // Each edge of each triangle, with its weight.
    let mut between: Vec<([u32; 2], f64)> = Vec::with_capacity(3 * all.len());
    for t in all {
        let of = t.map(|v| number[v as usize]);
        if of.contains(&NONE) {
            continue;
        }
        let corners = sheet.corners(*t);
        for k in 0..3 {
            let (a, b, c) = (corners[k], corners[(k + 1) % 3], corners[(k + 2) % 3]);
            let weight = (0.5 * cotangent(a - c, b - c)).max(LEAST);
            between.push(([of[k], of[(k + 1) % 3]], weight));
        }
    }
    let at = Lists::by(rows as usize, between.iter().map(|(ends, _)| ends));
    let mut outer = Rows::default();
    let mut row: Vec<(u32, f64)> = Vec::new();
    for i in 0..rows {
        row.clear();
        row.push((i, 0.0));
        for &e in at.of(i) {
            let ([a, b], weight) = between[e as usize];
            let other = a ^ b ^ i;
            row[0].1 += weight;
            match row.iter_mut().find(|(j, _)| *j == other) {
                Some((_, sum)) => *sum -= weight,
                None => row.push((other, -weight)),
            }
        }
        if row.len() == 1 {
            row.clear();
        }
        row.sort_unstable_by_key(|(j, _)| *j);
        outer.push(row.iter().copied());
    }
    outer
}

/// One row of the discrete Laplacian.
#[derive(Default)]
struct Stencil {
    entries: Vec<(u32, f64)>,
    near: Vec<u32>,
    /// By vertex: the last vertex that it was near to.
    near_to: Vec<u32>,
}

impl Stencil {
    /// By the quadratic that fits the neighbours best, over the tangent plane; `false` where they do not determine one.
    fn quadratic(&mut self, sheet: &Sheet<'_>, all: &[[u32; 3]], at: &Lists, sharp: &[bool], v: u32) -> bool {
        let normal: DVec3 = at.of(v).iter().map(|&i| sheet.normal(all[i as usize])).sum::<DVec3>().normalize_or_zero();
        if normal == DVec3::ZERO {
            return false;
        }
        self.near.clear();
        self.near.push(v);
        self.near_to.resize(sheet.points.len(), NONE);
        self.near_to[v as usize] = v;
        // Vertices around come from outside, with their noise: more of them even it out. Among new ones, a narrow stencil keeps the
        // matrix sparse.
        let least = if (v as usize) < sheet.fixed { 12 } else { 6 };
        let mut done = 0;
        for enough in [least, 5] {
            let there = self.near.len();
            for k in done..there {
                let w = self.near[k];
                if sharp[w as usize] {
                    continue;
                }
                for &i in at.of(w) {
                    for x in all[i as usize] {
                        if self.near_to[x as usize] != v {
                            self.near_to[x as usize] = v;
                            self.near.push(x);
                        }
                    }
                }
            }
            done = there;
            if self.near.len() > enough && self.fit(sheet, normal) {
                return true;
            }
        }
        false
    }

    fn fit(&mut self, sheet: &Sheet<'_>, normal: DVec3) -> bool {
        let p = sheet.points[self.near[0] as usize];
        let size = (self.near[1..].iter().map(|&w| sheet.points[w as usize].distance_squared(p)).sum::<f64>()
            / (self.near.len() - 1) as f64)
            .sqrt();
        let axis = (0..3).fold(0, |least, k| if normal[k].abs() < normal[least].abs() { k } else { least });
        let x = normal.cross(DVec3::AXES[axis]).normalize_or_zero();
        let y = normal.cross(x);
        let basis = |w: u32| {
            let d = (sheet.points[w as usize] - p) / size;
            let (u, v) = (d.dot(x), d.dot(y));
            ([u, v, 0.5 * u * u, u * v, 0.5 * v * v], 1.0 / (d.length_squared() + 0.1))
        };
        let mut normal_matrix = [[0.0; 5]; 5];
        for &w in &self.near[1..] {
            let (b, weight) = basis(w);
            for i in 0..5 {
                for j in 0..=i {
                    normal_matrix[i][j] += weight * b[i] * b[j];
                }
            }
        }
        let Some(g) = solve_5(normal_matrix, [0.0, 0.0, 1.0, 0.0, 1.0]) else { return false };
        self.entries.clear();
        self.entries.push((self.near[0], 0.0));
        for &w in &self.near[1..] {
            let (b, weight) = basis(w);
            let value = weight * (0..5).map(|k| b[k] * g[k]).sum::<f64>() / (size * size);
            self.entries.push((w, value));
            self.entries[0].1 -= value;
        }
        true
    }
}

/// By Cholesky's factors of the lower triangle; `None` where it is nearly singular.
fn solve_5(mut m: [[f64; 5]; 5], mut x: [f64; 5]) -> Option<[f64; 5]> {
    let size = (0..5).map(|k| m[k][k]).fold(0.0, f64::max);
    for i in 0..5 {
        for j in 0..=i {
            let sum = m[i][j] - (0..j).map(|k| m[i][k] * m[j][k]).sum::<f64>();
            if i == j {
                let regular = sum > 1e-5 * size;
                if !regular {
                    return None;
                }
                m[i][i] = sum.sqrt();
            } else {
                m[i][j] = sum / m[j][j];
            }
        }
        x[i] = (x[i] - (0..i).map(|k| m[i][k] * x[k]).sum::<f64>()) / m[i][i];
    }
    for i in (0..5).rev() {
        x[i] = (x[i] - (i + 1..5).map(|k| m[k][i] * x[k]).sum::<f64>()) / m[i][i];
    }
    Some(x)
}
