//! The lattice, its points and cubes, and the surface in it.
//!
//! Points go by their place in half cubes: corners have even coordinates, centres odd ones.

use std::collections::{HashMap, HashSet};

use glam::DVec3;

use super::tree::{Corners, Tree};
use crate::contract::progress::Progress;
use crate::geometry::distance::place;
use crate::geometry::sums::Bounds;
use crate::util::parallel;
use crate::util::scatter::Hashing;

/// A wrapped surface.
pub(crate) struct Wrapping {
    pub(crate) triangles: Vec<Corners>,
    /// Edge of a cube of the lattice, in the file's units.
    pub(crate) cell: f64,
    /// The volume that it encloses, in the file's units, cubed.
    pub(crate) volume: f64,
}

/// The lattice is never finer than this share of the diagonal, nor coarser than that, but for what f32 can hold.
const FINEST: f64 = 1.0 / 1024.0;
const COARSEST: f64 = 1.0 / 128.0;
/// Lattice cubes that are cut for each cube-sided square of surface; a plane cuts about 2.
const CUBES_A_SQUARE: f64 = 2.0;
/// Steps of an edge's share of its length, at least: no vertex lies nearer to its ends than one of so many.
const LEAST_STEPS: i64 = 16;
/// Half a cube's side is at least two to this many steps, and at most two to that many.
const STEP_BITS: [i32; 2] = [4, 10];
/// Cubes that are looked at for each that was asked for, at most.
const MOST_LOOKED_AT: usize = 16;
/// Cubes around the box of the triangles.
const MARGIN: i64 = 2;
/// Points or cubes that a thread takes at a time.
const BLOCK: usize = 512;

/// Wraps the surface that winds around something; `tree` is made of the same triangles by [`Tree::winding`]. The lattice is chosen so that about
/// `cubes` of it hold the surface. Deterministic, whatever `threads` says. `None` if there is no area, or the lattice would be finer than f32
/// can tell apart there, or goes on and on, or the work is cancelled. O(cubes · log triangles); about 200 bytes a cube.
pub(crate) fn wrap(triangles: &[Corners], tree: &Tree, cubes: u32, threads: usize, progress: &dyn Progress) -> Option<Wrapping> {
    let lattice = Lattice::of(triangles, f64::from(cubes))?;
    let field = Field::follow(triangles, tree, &lattice, cubes as usize * MOST_LOOKED_AT, (threads, progress))?;
    let polygons = field.polygons(threads);
    let mut names: Vec<u64> = polygons.iter().flatten().copied().filter(|name| *name != NO_EDGE).collect();
    names.sort_unstable();
    names.dedup();
    let blocks = parallel::map(threads, names.len().div_ceil(BLOCK), |block| {
        let names = &names[block * BLOCK..names.len().min((block + 1) * BLOCK)];
        if progress.cancelled() {
            return Vec::new();
        }
        names.iter().map(|name| field.vertex(tree, *name)).collect::<Vec<_>>()
    });
    if progress.cancelled() {
        return None;
    }
    let vertices: Vec<[i64; 3]> = blocks.into_iter().flatten().collect();
    let blocks = parallel::map(threads, polygons.len().div_ceil(BLOCK), |block| {
        let mut halves = Vec::new();
        for polygon in &polygons[block * BLOCK..polygons.len().min((block + 1) * BLOCK)] {
            let number = |name: &u64| names.partition_point(|other| other < name) as u32;
            cut(polygon.iter().filter(|name| **name != NO_EDGE).map(number).collect(), &vertices, &mut halves);
        }
        halves
    });
    let faces: Vec<[u32; 3]> = blocks.into_iter().flatten().collect();
    drop((polygons, names));
    let (faces, volume) = drop_specks(&faces, &vertices, lattice.half as f64 * 2.0);
    let positions: Vec<[f32; 3]> = vertices.iter().map(|v| lattice.position(*v)).collect();
    Some(Wrapping {
        triangles: faces.iter().map(|f| f.map(|v| positions[v as usize])).collect(),
        cell: 2.0 * lattice.half as f64 * lattice.step,
        volume: volume * lattice.step * lattice.step * lattice.step,
    })
}

/// Where points are. Coordinates of vertices are whole numbers of steps.
struct Lattice {
    /// A power of two, in the file's units.
    step: f64,
    /// Half a cube's side, in steps: a power of two.
    half: i64,
    /// Of the point 0, 0, 0.
    origin: [i64; 3],
    /// Points with coordinates beyond these are outside.
    hi: [u32; 3],
}

impl Lattice {
    fn of(triangles: &[Corners], cubes: f64) -> Option<Self> {
        let mut bounds = Bounds::EMPTY;
        let mut area = 0.0;
        for t in triangles {
            bounds.include(t);
            let [a, b, c] = t.map(place);
            area += (b - a).cross(c - a).length() / 2.0;
        }
        let (diagonal, largest) = (bounds.diagonal(), f64::from(bounds.largest_coordinate()));
        if area.is_nan() || area <= 0.0 {
            return None;
        }
        let wanted = (CUBES_A_SQUARE * area / cubes).sqrt().max(FINEST * diagonal).min(COARSEST * diagonal);
        let (side, bits, exponent) = (log2_up(wanted)..)
            .take_while(|side| power_of_two(*side) <= diagonal && largest + 16.0 * power_of_two(*side) < f64::from(f32::MAX))
            .find_map(|side| {
                // Up to what margin and origin may add to a coordinate.
                let exact = log2_up(largest + 16.0 * power_of_two(side)) - 24;
                let exponent = exact.max(-149).max(side - 1 - STEP_BITS[1]);
                let bits = side - 1 - exponent;
                (bits >= STEP_BITS[0]).then_some((power_of_two(side), bits, exponent))
            })?;
        let step = power_of_two(exponent);
        let half = 1 << bits;
        // The lowest planes of a box lie a third of a cube above corners, a sixth above centres: far from both, so that they stay flat.
        let origin = bounds.lo.map(|x| (f64::from(x) / step).floor() as i64 - 2 * half / 3 - MARGIN * 2 * half);
        let across = std::array::from_fn(|k| ((f64::from(bounds.hi[k]) - origin[k] as f64 * step) / side) as i64);
        let hi = across.map(|cube: i64| (2 * (cube + MARGIN)) as u32);
        Some(Self { step, half, origin, hi })
    }

    /// A whole number of steps, exact in f32.
    fn position(&self, v: [i64; 3]) -> [f32; 3] {
        std::array::from_fn(|k| ((self.origin[k] + v[k]) as f64 * self.step) as f32)
    }

    fn point(&self, p: [u32; 3]) -> DVec3 {
        DVec3::from_array(std::array::from_fn(|k| (self.origin[k] + i64::from(p[k]) * self.half) as f64 * self.step))
    }

    /// A position in cubes.
    fn in_cubes(&self, p: [f32; 3]) -> DVec3 {
        let side = 2.0 * self.half as f64;
        DVec3::from_array(std::array::from_fn(|k| (f64::from(p[k]) / self.step - self.origin[k] as f64) / side))
    }

    /// The winding numbers of some points, by name, or on which side of ½ they are, as [`Tree::windings_or_sides`] says it. Best in the order of [`upright`].
    fn windings(&self, tree: &Tree, points: &[u64]) -> Vec<f32> {
        let points: Vec<[u32; 3]> = points.iter().map(|p| named(*p)).collect();
        let asked: Vec<DVec3> = points.iter().filter(|p| !self.is_beyond(**p)).map(|p| self.point(*p)).collect();
        let mut windings = tree.windings_or_sides(&asked).into_iter();
        let of = |p: &[u32; 3]| if self.is_beyond(*p) { 0.0 } else { windings.next().unwrap_or(0.0) as f32 };
        points.iter().map(of).collect()
    }

    /// Beyond the margin there is nothing, whatever an odd soup may wind around there.
    fn is_beyond(&self, p: [u32; 3]) -> bool {
        (0..3).any(|k| p[k] < 2 || p[k] > self.hi[k])
    }
}

/// The least power of two that is not below a positive number, as an exponent.
fn log2_up(x: f64) -> i32 {
    let exponent = (x.to_bits() >> 52) as i32 - 1023;
    if x.to_bits() << 12 == 0 { exponent } else { exponent + 1 }
}

fn power_of_two(exponent: i32) -> f64 {
    f64::from_bits(((exponent + 1023) as u64) << 52)
}

/// Names of points: 20 bits a coordinate, x lowest. Of edges: the lower end's, and three bits for where to.
const COORDINATE_BITS: u32 = 20;
const NO_EDGE: u64 = u64::MAX;

fn name(p: [u32; 3]) -> u64 {
    u64::from(p[0]) | u64::from(p[1]) << COORDINATE_BITS | u64::from(p[2]) << (2 * COORDINATE_BITS)
}

/// Orders names so that points above each other stand in a row, the lowest first.
fn upright(name: u64) -> u64 {
    name.rotate_left(64 - 2 * COORDINATE_BITS)
}

fn named(name: u64) -> [u32; 3] {
    [0, 1, 2].map(|k| (name >> (k * COORDINATE_BITS)) as u32 & ((1 << COORDINATE_BITS) - 1))
}

/// Where the edges of a point go that are named after it: to the next cubes, and half as far along the diagonals.
const WAYS: [[i32; 3]; 7] = [[2, 0, 0], [0, 2, 0], [0, 0, 2], [1, 1, 1], [-1, 1, 1], [1, -1, 1], [-1, -1, 1]];

fn edge(a: u64, b: u64) -> u64 {
    let (low, high) = (named(a.min(b)), named(a.max(b)));
    let way: [i32; 3] = std::array::from_fn(|k| high[k] as i32 - low[k] as i32);
    a.min(b) << 3 | WAYS.iter().position(|w| *w == way).unwrap_or(0) as u64
}

/// Winding numbers where the surface is.
struct Field<'l> {
    lattice: &'l Lattice,
    /// By point; infinite where only the side of ½ is known.
    winding: HashMap<u64, f32, Hashing>,
    /// All cubes that were looked at, ascending, by their lowest corner.
    cubes: Vec<u64>,
    known: HashSet<u64, Hashing>,
}

/// A cube's corners, bit k of the number: the upper one along axis k; and its centre.
fn points_of(cube: [u32; 3]) -> [[u32; 3]; 9] {
    std::array::from_fn(|n| {
        std::array::from_fn(|k| if n == 8 { cube[k] + 1 } else { cube[k] + if n >> k & 1 == 1 { 2 } else { 0 } })
    })
}

/// Corners of a cube's upper face along each axis, counter-clockwise seen from above it.
fn face(axis: usize) -> [usize; 4] {
    let (up, b, c) = (1 << axis, 1 << ((axis + 1) % 3), 1 << ((axis + 2) % 3));
    [up, up | b, up | b | c, up | c]
}

impl<'l> Field<'l> {
    fn follow(
        triangles: &[Corners],
        tree: &Tree,
        lattice: &'l Lattice,
        most: usize,
        (threads, progress): (usize, &dyn Progress),
    ) -> Option<Self> {
        let mut field = Self { lattice, winding: HashMap::default(), cubes: Vec::new(), known: HashSet::default() };
        let mut wave = touched(triangles, lattice, threads);
        while !wave.is_empty() {
            if field.known.len() + wave.len() > most || progress.cancelled() {
                return None;
            }
            field.known.extend(&wave);
            let mut points: Vec<u64> = wave
                .iter()
                .flat_map(|cube| points_of(named(*cube)).map(name))
                .filter(|p| !field.winding.contains_key(p))
                .collect();
            points.sort_unstable_by_key(|p| upright(*p));
            points.dedup();
            let blocks = parallel::map(threads, points.len().div_ceil(BLOCK), |block| {
                let points = &points[block * BLOCK..points.len().min((block + 1) * BLOCK)];
                if progress.cancelled() {
                    return vec![0.0; points.len()];
                }
                lattice.windings(tree, points)
            });
            field.winding.extend(points.iter().copied().zip(blocks.into_iter().flatten()));
            let mut next: Vec<u64> =
                wave.iter().flat_map(|cube| field.goes_on(*cube)).filter(|c| !field.known.contains(c)).collect();
            next.sort_unstable();
            next.dedup();
            field.cubes.append(&mut wave);
            wave = next;
        }
        field.cubes.sort_unstable();
        Some(field)
    }

    fn is_inside(&self, point: u64) -> bool {
        self.winding.get(&point).is_some_and(|w| *w > 0.5)
    }

    /// How often the surface winds around a point.
    fn winding(&self, tree: &Tree, p: [u32; 3]) -> f64 {
        match self.winding.get(&name(p)) {
            Some(side) if side.is_infinite() => f64::from(tree.winding_number(self.lattice.point(p)) as f32),
            known => known.map_or(0.0, |w| f64::from(*w)),
        }
    }

    /// The cubes across faces whose corners and this cube's centre are of both kinds.
    fn goes_on(&self, cube: u64) -> impl Iterator<Item = u64> + use<> {
        let at = named(cube);
        let inside = points_of(at).map(|p| self.is_inside(name(p)));
        let (mut found, mut count) = ([0; 6], 0);
        for axis in 0..3 {
            for upper in [false, true] {
                let corners = face(axis).map(|n| if upper { n } else { n & !(1 << axis) });
                if corners.iter().any(|n| inside[*n] != inside[8]) {
                    let mut next = at;
                    next[axis] = if upper { next[axis] + 2 } else { next[axis].wrapping_sub(2) };
                    found[count] = name(next);
                    count += 1;
                }
            }
        }
        found.into_iter().take(count)
    }

    /// The surface as triangles (the last name is none) and quadrilaterals of edges' names, seen from outside.
    fn polygons(&self, threads: usize) -> Vec<[u64; 4]> {
        let blocks = parallel::map(threads, self.cubes.len().div_ceil(BLOCK), |block| {
            let mut polygons = Vec::new();
            for cube in &self.cubes[block * BLOCK..self.cubes.len().min((block + 1) * BLOCK)] {
                let at = named(*cube);
                let points = points_of(at).map(name);
                let inside = points.map(|p| self.is_inside(p));
                for axis in 0..3 {
                    let mut next = at;
                    next[axis] += 2;
                    if !self.known.contains(&name(next)) {
                        continue;
                    }
                    let above = name(next.map(|x| x + 1));
                    let corners = face(axis);
                    for k in 0..4 {
                        let (p, q) = (corners[k], corners[(k + 1) % 4]);
                        let tetrahedron = [points[8], above, points[p], points[q]];
                        march(tetrahedron, [inside[8], self.is_inside(above), inside[p], inside[q]], &mut polygons);
                    }
                }
            }
            polygons
        });
        blocks.into_iter().flatten().collect()
    }

    /// The vertex on an edge, in steps: where the edge leaves the surface, or where it would wind half a time if its winding number fell
    /// evenly.
    fn vertex(&self, tree: &Tree, edge: u64) -> [i64; 3] {
        let low = named(edge >> 3);
        let way = WAYS[(edge & 7) as usize];
        let high: [u32; 3] = std::array::from_fn(|k| low[k].wrapping_add_signed(way[k]));
        let [from, to] = [low, high].map(|p| self.lattice.point(p));
        let rises = self.is_inside(name(high));
        let share = if rises { tree.leaves(to, from).map(|s| 1.0 - s) } else { tree.leaves(from, to) };
        let share = share.unwrap_or_else(|| {
            let [a, b] = [low, high].map(|p| self.winding(tree, p));
            (a - 0.5) / (a - b)
        });
        let is_long = way.contains(&0);
        let steps = if is_long { 2 * self.lattice.half } else { self.lattice.half };
        let least = steps / LEAST_STEPS;
        let along = ((share * steps as f64 + 0.5) as i64).clamp(least, steps - least);
        std::array::from_fn(|k| i64::from(low[k]) * self.lattice.half + i64::from(way[k].signum()) * along)
    }
}

/// The surface in a tetrahedron whose corners 1, 2 and 3 run clockwise seen from corner 0.
fn march(points: [u64; 4], inside: [bool; 4], polygons: &mut Vec<[u64; 4]>) {
    let between = |a: usize, b: usize| edge(points[a], points[b]);
    let count = inside.iter().filter(|i| **i).count();
    if count == 0 || count == 4 {
        return;
    }
    if count == 2 {
        // Even permutations that bring the two inside to the front.
        let [a, b, c, d] = match inside {
            [true, true, _, _] => [0, 1, 2, 3],
            [true, _, true, _] => [0, 2, 3, 1],
            [true, ..] => [0, 3, 1, 2],
            [_, true, true, _] => [1, 2, 0, 3],
            [_, true, ..] => [1, 3, 2, 0],
            _ => [2, 3, 0, 1],
        };
        polygons.push([between(a, c), between(a, d), between(b, d), between(b, c)]);
        return;
    }
    let is_lone = |k: usize| inside[k] == (count == 1);
    let lone = (0..4).find(|k| is_lone(*k)).unwrap_or(0);
    let [a, b, c, d] = [[0, 1, 2, 3], [1, 0, 3, 2], [2, 3, 0, 1], [3, 2, 1, 0]][lone];
    // Where the lone one is outside, the triangle is seen from the other side.
    let [b, c] = if count == 1 { [b, c] } else { [c, b] };
    polygons.push([between(a, b), between(a, c), between(a, d), NO_EDGE]);
}

/// Cuts a polygon into triangles, a quadrilateral along its shorter diagonal.
fn cut(polygon: Vec<u32>, vertices: &[[i64; 3]], triangles: &mut Vec<[u32; 3]>) {
    let square = |a: u32, b: u32| (0..3).map(|k| (vertices[a as usize][k] - vertices[b as usize][k]).pow(2)).sum::<i64>();
    match polygon[..] {
        [a, b, c] => triangles.push([a, b, c]),
        [a, b, c, d] if square(a, c) <= square(b, d) => triangles.extend([[a, b, c], [a, c, d]]),
        [a, b, c, d] => triangles.extend([[a, b, d], [b, c, d]]),
        _ => {}
    }
}

/// Leaves out closed parts of less than two cubes and less than a millionth of all: bodies and cavities that the lattice made. What is left, and
/// its volume in steps.
fn drop_specks(faces: &[[u32; 3]], vertices: &[[i64; 3]], side: f64) -> (Vec<[u32; 3]>, f64) {
    let mut parents: Vec<u32> = (0..vertices.len() as u32).collect();
    for [a, b, c] in faces {
        crate::util::union_find::unite(&mut parents, *a, *b);
        crate::util::union_find::unite(&mut parents, *a, *c);
    }
    let mut volumes = vec![0.0; vertices.len()];
    for face in faces {
        let [a, b, c] = face.map(|v| DVec3::from_array(vertices[v as usize].map(|x| x as f64)));
        volumes[crate::util::union_find::find(&mut parents, face[0]) as usize] += a.dot(b.cross(c)) / 6.0;
    }
    let all: f64 = volumes.iter().sum();
    let least = (2.0 * side * side * side).min(1e-6 * all);
    let stays = |face: &&[u32; 3]| volumes[crate::util::union_find::find(&mut parents, face[0]) as usize].abs() >= least;
    let kept: Vec<[u32; 3]> = faces.iter().filter(stays).copied().collect();
    (kept, volumes.iter().filter(|v| v.abs() >= least).sum())
}

/// The cubes that triangles touch, ascending.
fn touched(triangles: &[Corners], lattice: &Lattice, threads: usize) -> Vec<u64> {
    const AT_ONCE: usize = 4096;
    let found = parallel::map(threads, triangles.len().div_ceil(AT_ONCE), |block| {
        let mut cubes = Vec::new();
        for t in &triangles[block * AT_ONCE..triangles.len().min((block + 1) * AT_ONCE)] {
            let t = t.map(|p| lattice.in_cubes(p));
            let [lo, hi] = [t[0].min(t[1]).min(t[2]), t[0].max(t[1]).max(t[2])].map(|p| p.to_array().map(|x| x as u32));
            touch(&t, lo, hi, &mut cubes);
        }
        cubes.sort_unstable();
        cubes.dedup();
        cubes
    });
    let mut all: Vec<u64> = found.into_iter().flatten().collect();
    all.sort_unstable();
    all.dedup();
    all
}

/// Notes the cubes from `lo` to `hi` that a triangle touches.
fn touch(t: &[DVec3; 3], lo: [u32; 3], hi: [u32; 3], cubes: &mut Vec<u64>) {
    let size: [u32; 3] = std::array::from_fn(|k| hi[k] - lo[k]);
    if size.iter().any(|s| *s > 0) && !may_touch(t, lo, hi) {
        return;
    }
    if size == [0; 3] {
        if may_touch(t, lo, hi) {
            cubes.push(name(lo.map(|x| 2 * x)));
        }
        return;
    }
    let axis = (1..3).fold(0, |best, k| if size[k] > size[best] { k } else { best });
    let half = lo[axis] + size[axis] / 2;
    let (mut below, mut above) = (hi, lo);
    (below[axis], above[axis]) = (half, half + 1);
    touch(t, lo, below, cubes);
    touch(t, above, hi, cubes);
}

/// Does no plane separate a triangle and the box of cubes from `lo` to `hi`? (Akenine-Möller, "Fast 3D triangle-box overlap testing", J.
/// Graphics Tools 6(1), 2001.) Rounding may err; what it misses the surface leads to.
fn may_touch(t: &[DVec3; 3], lo: [u32; 3], hi: [u32; 3]) -> bool {
    const SLACK: f64 = 1e-9;
    let lo = DVec3::from_array(lo.map(f64::from));
    let hi = DVec3::from_array(hi.map(|x| f64::from(x) + 1.0));
    let (middle, half) = ((lo + hi) / 2.0, (hi - lo) / 2.0 + SLACK);
    let v = t.map(|p| p - middle);
    let edges = [v[1] - v[0], v[2] - v[1], v[0] - v[2]];
    let overlaps = |axis: DVec3| {
        let d = v.map(|p| p.dot(axis));
        let reach = half.dot(axis.abs());
        d[0].min(d[1]).min(d[2]) <= reach && d[0].max(d[1]).max(d[2]) >= -reach
    };
    let axes = [DVec3::X, DVec3::Y, DVec3::Z];
    axes.iter().all(|a| overlaps(*a))
        && overlaps(edges[0].cross(edges[1]))
        && axes.iter().all(|a| edges.iter().all(|e| overlaps(a.cross(*e))))
}

#[cfg(test)]
mod tests;
