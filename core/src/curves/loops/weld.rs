//! Which ends are the same point: by vertices of the file, and by place.

use std::collections::HashMap;

use crate::curves::curve::Curve;
use crate::curves::vector::{Point, distance};

/// Ends in the same cell of the grid that an end is compared with, at most.
const MOST: usize = 64;
/// Of the length of its curve, as much as an end may move.
const SHARE: f64 = 0.125;

/// Sets that are joined: each by its lowest member.
struct Sets(Vec<u32>);

impl Sets {
    fn root(&mut self, mut of: u32) -> u32 {
        loop {
            let next = self.get(of);
            if next == of {
                return of;
            }
            let after = self.get(next);
            self.set(of, after);
            of = after;
        }
    }

    fn get(&self, of: u32) -> u32 {
        self.0.get(of as usize).copied().unwrap_or(of)
    }

    fn set(&mut self, of: u32, to: u32) {
        self.0.iter_mut().skip(of as usize).take(1).for_each(|place| *place = to);
    }

    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.set(a.max(b), a.min(b));
    }
}

struct End {
    point: Point,
    vertex: Option<u64>,
    radius: f64,
}

/// The points between which curves run, and how many there are. O(n) expected for ends that are not all in one place.
pub(super) fn nodes(curves: &[Curve], taken: &[(usize, f64)], tolerance: f64, trusts: bool) -> (Vec<[u32; 2]>, usize) {
    let mut ends = Vec::with_capacity(2 * taken.len());
    for (number, length) in taken {
        let Some(curve) = curves.get(*number) else { continue };
        let vertices = curve.vertices.filter(|_| trusts);
        let radius = tolerance.min(SHARE * length);
        for (side, point) in curve.shape.ends().into_iter().enumerate() {
            let vertex = vertices.and_then(|vertices| vertices.get(side).copied());
            ends.push(End { point, vertex, radius });
        }
    }
    let mut sets = Sets((0..ends.len() as u32).collect());
    by_vertex(&ends, &mut sets);
    by_place(&ends, tolerance, &mut sets);
    // Numbers without gaps, in the order of the curves.
    let mut numbers: HashMap<u32, u32> = HashMap::new();
    let mut number = |end: u32| {
        let next = numbers.len() as u32;
        *numbers.entry(sets.root(end)).or_insert(next)
    };
    let nodes: Vec<[u32; 2]> = (0..ends.len() as u32 / 2).map(|curve| [number(2 * curve), number(2 * curve + 1)]).collect();
    (nodes, numbers.len())
}

fn by_vertex(ends: &[End], sets: &mut Sets) {
    let mut first: HashMap<u64, u32> = HashMap::new();
    for (number, end) in ends.iter().enumerate() {
        if let Some(vertex) = end.vertex {
            let other = *first.entry(vertex).or_insert(number as u32);
            sets.join(number as u32, other);
        }
    }
}

/// Joins ends that are within the tolerance of both, by a grid of cells of that size. Two ends that both have a vertex are not joined here.
fn by_place(ends: &[End], tolerance: f64, sets: &mut Sets) {
    let mut same: HashMap<([u64; 3], bool), u32> = HashMap::new();
    let mut grid: HashMap<[i64; 3], Vec<u32>> = HashMap::new();
    for (number, end) in ends.iter().enumerate() {
        let number = number as u32;
        // −0 is 0.
        let bits = end.point.map(|x| (x + 0.0).to_bits());
        if let Some(first) = same.get(&(bits, false)) {
            sets.join(number, *first);
        }
        match end.vertex {
            None => {
                if let Some(first) = same.get(&(bits, true)) {
                    sets.join(number, *first);
                }
                if same.insert((bits, false), number).is_some() {
                    continue;
                }
            }
            Some(_) => drop(same.insert((bits, true), number)),
        }
        if tolerance > 0.0 {
            near(ends, number, end, tolerance, &grid, sets);
            grid.entry(cell(end.point, tolerance)).or_default().push(number);
        }
    }
}

fn cell(point: Point, size: f64) -> [i64; 3] {
    // A cast saturates, and the tolerance is above 10⁻⁷ of all coordinates unless someone asks for less.
    point.map(|x| (x / size).floor() as i64)
}

fn near(ends: &[End], number: u32, end: &End, size: f64, grid: &HashMap<[i64; 3], Vec<u32>>, sets: &mut Sets) {
    let [x, y, z] = cell(end.point, size);
    for step in 0..27 {
        let [i, j, k] = [step % 3 - 1, step / 3 % 3 - 1, step / 9 - 1];
        let place = [x.saturating_add(i), y.saturating_add(j), z.saturating_add(k)];
        for other in grid.get(&place).into_iter().flatten().take(MOST) {
            let Some(near) = ends.get(*other as usize) else { continue };
            let are_both_known = end.vertex.is_some() && near.vertex.is_some();
            // The two ends of one curve meet if they are that near: it is closed.
            if !are_both_known && distance(end.point, near.point) <= end.radius.min(near.radius) {
                sets.join(number, *other);
            }
        }
    }
}
