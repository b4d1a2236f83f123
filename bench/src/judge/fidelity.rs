//! How far a result is from what was meant: the volume that is in one and not in the other.
//!
//! Along each of many lines both solids are intervals, exactly: from where the surface winds at least once to where it does not. What
//! is estimated is only the integral over the lines. They stand in three directions that no model has an edge along, one at a random
//! place in each cell of a grid across both solids; the scatter between neighbours gives the error. With 3 × 96² lines it is some
//! thousandth of the *difference* on bodies that fill their box, so that a difference of nothing is measured as nothing.
//!
//! A line that passes an edge passes one of its triangles, and not both or none: which side of an edge it is on is computed from the
//! edge's two ends in one order.
//!
//! O(triangles + crossings of lines) time, after sorting by line.

use super::judgement::Triangle;

/// A result beside the solid that was meant.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "compare", derive(serde::Serialize, serde::Deserialize))]
pub struct Fidelity {
    /// Volume of what was meant.
    pub volume: f64,
    /// Volume in one and not in the other, as a share of it. Infinite if nothing was meant and something is there.
    pub difference: f64,
    /// Of that, what is missing.
    pub missing: f64,
    /// Two standard errors of the difference, by the scatter of the lines.
    pub error: f64,
    /// Lines on which the result does not end outside, of all that met something: it is open.
    pub open: f64,
}

/// Lines along each side of the grid.
const SIDE: usize = 96;

/// Directions: columns of a rotation by no round angle.
const FRAME: [[f64; 3]; 3] = [
    [0.838_386_643_6, -0.324_518_986_4, 0.437_982_166_2],
    [0.495_437_889_3, 0.787_087_873_4, -0.367_504_879_9],
    [-0.225_469_176_6, 0.525_115_379_9, 0.820_614_663_8],
];

/// Where a line passes a surface.
#[derive(Clone, Copy)]
struct Pass {
    line: u32,
    depth: f64,
    /// Which solid, and how its winding changes for whoever goes on.
    of: usize,
    change: i32,
}

/// Compares a result with what was meant. Both solids are where their surfaces wind at least once; a result that is inside out as a
/// whole is turned first, as a slicer does.
pub fn fidelity(result: &[Triangle], intended: &[Triangle]) -> Fidelity {
    let frame = |triangles: &[Triangle]| -> Vec<[[f64; 3]; 3]> {
        let place = |p: [f32; 3]| FRAME.map(|axis| (0..3).map(|k| axis[k] * f64::from(p[k])).sum());
        triangles.iter().map(|t| t.map(place)).collect()
    };
    let solids = [frame(result), frame(intended)];
    let middle = solids[1].first().or(solids[0].first()).map_or([0.0; 3], |t| t[0]);
    let is_turned = solids[0].iter().map(|t| volume_about(middle, t)).sum::<f64>() < 0.0;
    let sides = (0..3).map(|axis| along(axis, &solids, is_turned));
    let mean: Sums = sides.fold(Sums::default(), Sums::plus);
    if mean.volume <= 0.0 {
        let difference = if mean.difference > 0.0 { f64::INFINITY } else { 0.0 };
        return Fidelity { difference, open: mean.open(), ..Fidelity::default() };
    }
    Fidelity {
        volume: mean.volume / 3.0,
        difference: mean.difference / mean.volume,
        missing: mean.missing / mean.volume,
        error: 2.0 * mean.variance.sqrt() / mean.volume,
        open: mean.open(),
    }
}

fn volume_about(o: [f64; 3], t: &[[f64; 3]; 3]) -> f64 {
    let [a, b, c] = t.map(|p| -> [f64; 3] { std::array::from_fn(|k| p[k] - o[k]) });
    a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0])
}

/// Volumes, summed over lines.
#[derive(Clone, Copy, Default)]
struct Sums {
    volume: f64,
    difference: f64,
    missing: f64,
    variance: f64,
    met: u64,
    leaks: u64,
}

impl Sums {
    fn plus(self, other: Self) -> Self {
        Self {
            volume: self.volume + other.volume,
            difference: self.difference + other.difference,
            missing: self.missing + other.missing,
            variance: self.variance + other.variance,
            met: self.met + other.met,
            leaks: self.leaks + other.leaks,
        }
    }

    fn open(&self) -> f64 {
        self.leaks as f64 / self.met.max(1) as f64
    }
}

/// The grid across both solids, seen along an axis.
struct Grid {
    low: [f64; 2],
    cell: [f64; 2],
}

impl Grid {
    fn of(points: impl Iterator<Item = [f64; 2]>) -> Self {
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for p in points {
            low = std::array::from_fn(|k| low[k].min(p[k]));
            high = std::array::from_fn(|k| high[k].max(p[k]));
        }
        let cell = std::array::from_fn(|k| ((high[k] - low[k]) / SIDE as f64).max(f64::MIN_POSITIVE));
        Self { low, cell }
    }

    /// The line of a cell: somewhere in it, always at the same place.
    fn line(&self, at: [usize; 2], axis: usize) -> [f64; 2] {
        let mut state = (at[0] + SIDE * (at[1] + SIDE * axis)) as u64;
        std::array::from_fn(|k| {
            state = state.wrapping_add(0x9E37_79B9_7F4A_7C15).wrapping_mul(0xBF58_476D_1CE4_E5B9);
            state ^= state >> 29;
            let part = (state >> 11) as f64 / (1u64 << 53) as f64;
            self.low[k] + self.cell[k] * (at[k] as f64 + part)
        })
    }

    /// Cells that a span of coordinates may have lines in.
    fn cells(&self, k: usize, span: [f64; 2]) -> std::ops::RangeInclusive<usize> {
        let cell = |x: f64| (((x - self.low[k]) / self.cell[k]) as usize).min(SIDE - 1);
        cell(span[0])..=cell(span[1])
    }
}

/// On which side of a→b is a point: left (or on it, seen from the lesser end) or right.
fn is_left(a: [f64; 2], b: [f64; 2], p: [f64; 2]) -> bool {
    let in_order = a <= b;
    let (a, b) = if in_order { (a, b) } else { (b, a) };
    let left = (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]) >= 0.0;
    left == in_order
}

/// All lines along one axis of the frame.
fn along(axis: usize, solids: &[Vec<[[f64; 3]; 3]>; 2], is_turned: bool) -> Sums {
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    let onto = |p: [f64; 3]| [p[u], p[v]];
    let grid = Grid::of(solids.iter().flatten().flatten().map(|p| onto(*p)));
    let mut passes = Vec::new();
    for (of, triangles) in solids.iter().enumerate() {
        for t in triangles {
            let flat = t.map(onto);
            let span = |k: usize| {
                let all = flat.map(|p| p[k]);
                [all.iter().fold(f64::INFINITY, |a, &b| a.min(b)), all.iter().fold(f64::NEG_INFINITY, |a, &b| a.max(b))]
            };
            for j in grid.cells(1, span(1)) {
                for i in grid.cells(0, span(0)) {
                    let sides: [bool; 3] = std::array::from_fn(|k| is_left(flat[k], flat[(k + 1) % 3], grid.line([i, j], axis)));
                    if sides[0] == sides[1] && sides[1] == sides[2] {
                        let depth = depth(t, axis, grid.line([i, j], axis));
                        // Facing along the axis: whoever goes on leaves.
                        let change = if sides[0] != (is_turned && of == 0) { -1 } else { 1 };
                        passes.push(Pass { line: (i + SIDE * j) as u32, depth, of, change });
                    }
                }
            }
        }
    }
    passes.sort_by(|a, b| a.line.cmp(&b.line).then(a.depth.total_cmp(&b.depth)));
    integrate(&passes, grid.cell[0] * grid.cell[1])
}

/// Depth of the triangle's plane on a line that passes it.
fn depth(t: &[[f64; 3]; 3], axis: usize, at: [f64; 2]) -> f64 {
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    let twice = |a: [f64; 2], b: [f64; 2], c: [f64; 2]| (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    let flat = t.map(|p| [p[u], p[v]]);
    let weights: [f64; 3] = std::array::from_fn(|k| twice(flat[(k + 1) % 3], flat[(k + 2) % 3], at));
    let all: f64 = weights.iter().sum();
    let low = t.iter().map(|p| p[axis]).fold(f64::INFINITY, f64::min);
    let high = t.iter().map(|p| p[axis]).fold(f64::NEG_INFINITY, f64::max);
    let depth = (0..3).map(|k| weights[k] * t[k][axis]).sum::<f64>() / all;
    if depth.is_finite() { depth.clamp(low, high) } else { low }
}

fn integrate(passes: &[Pass], area: f64) -> Sums {
    let mut sums = Sums::default();
    // Differences of the lines of two neighbouring cells.
    let mut last: Option<(u32, f64)> = None;
    for line in passes.chunk_by(|a, b| a.line == b.line) {
        let mut winding = [0; 2];
        let (mut differs, mut missing, mut volume) = (0.0, 0.0, 0.0);
        for pair in line.windows(2) {
            winding[pair[0].of] += pair[0].change;
            let (length, [made, meant]) = (pair[1].depth - pair[0].depth, winding.map(|w| w >= 1));
            volume += if meant { length } else { 0.0 };
            differs += if made != meant { length } else { 0.0 };
            missing += if meant && !made { length } else { 0.0 };
        }
        if let Some(end) = line.last() {
            winding[end.of] += end.change;
        }
        sums.met += u64::from(line.iter().any(|pass| pass.of == 0));
        sums.leaks += u64::from(winding[0] != 0);
        sums.volume += volume * area;
        sums.difference += differs * area;
        sums.missing += missing * area;
        let number = line.first().map_or(0, |pass| pass.line);
        // Every line is compared with its left neighbour, or with nothing: half of the squares is the variance of both.
        let before = last.filter(|(other, _)| other + 1 == number).map_or(0.0, |(_, differs)| differs);
        sums.variance += (differs - before).powi(2) * area * area / 2.0;
        last = Some((number, differs));
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::super::shells::tests::{cuboid, inside_out};
    use super::*;

    fn near(found: Fidelity, difference: f64, missing: f64) {
        let far = (found.difference - difference).abs();
        assert!(far <= 2.0 * found.error + 1e-9 && found.error < 0.1 * difference + 1e-3, "{found:?} {difference}");
        assert!((found.missing - missing).abs() <= 2.0 * found.error + 1e-9 && found.open == 0.0, "{found:?} {missing}");
    }

    #[test]
    fn boxes_differ_by_what_is_in_one_of_them() {
        let (cube, long) = (cuboid([0.0; 3], [10.0; 3]), cuboid([0.0; 3], [10.0, 10.0, 10.2]));
        let same = fidelity(&cube, &cube);
        assert!(same.difference == 0.0 && (same.volume / 1000.0 - 1.0).abs() < 2e-3, "{same:?}");
        near(fidelity(&long, &cube), 0.02, 0.0);
        near(fidelity(&cube, &long), 0.02 / 1.02, 0.02 / 1.02);
        near(fidelity(&[cube.clone(), cuboid([12.0, 0.0, 0.0], [13.0, 1.0, 1.0])].concat(), &cube), 0.001, 0.0);
        near(fidelity(&[], &cube), 1.0, 1.0);
    }

    #[test]
    fn a_corner_that_is_cut_off_is_seen() {
        // A cube of 10 without the tetrahedron of 3 at one corner: 4.5 of 1000.
        let (o, size): ([f32; 3], f32) = ([0.0; 3], 3.0);
        let [x, y, z] = [[size, 0.0, 0.0], [0.0, size, 0.0], [0.0, 0.0, size]];
        let corner = [[o, y, x], [o, z, y], [o, x, z], [x, y, z]];
        let cube = cuboid([0.0; 3], [10.0; 3]);
        near(fidelity(&[cube.clone(), inside_out(corner.to_vec())].concat(), &cube), 0.0045, 0.0045);
    }

    #[test]
    fn winding_decides_and_not_the_surface() {
        let (outer, inner) = (cuboid([0.0; 3], [10.0; 3]), cuboid([2.0; 3], [8.0; 3]));
        let hollow = [outer.clone(), inside_out(inner.clone())].concat();
        near(fidelity(&outer, &hollow), 216.0 / 784.0, 0.0);
        // Twice the same material is the same material; all of it inside out is turned.
        assert!(fidelity(&[outer.clone(), inner].concat(), &outer).difference < 1e-12);
        assert!(fidelity(&inside_out(hollow.clone()), &hollow).difference < 1e-12);
        // Nothing was meant.
        assert_eq!(fidelity(&outer, &[]).difference, f64::INFINITY);
        assert_eq!(fidelity(&[], &[]).difference, 0.0);
    }

    #[test]
    fn an_open_result_is_open() {
        let cube = cuboid([0.0; 3], [10.0; 3]);
        assert!(fidelity(&cube[1..], &cube).open > 0.05);
    }

    /// Walls of a fiftieth, and a place far from the origin.
    #[test]
    fn thin_walls_are_measured() {
        let far = |mesh: Vec<Triangle>| -> Vec<Triangle> { mesh.iter().map(|t| t.map(|p| p.map(|x| x + 512.0))).collect() };
        let (thin, thick) = (far(cuboid([0.0; 3], [20.0, 0.5, 20.0])), far(cuboid([0.0; 3], [20.0, 0.5625, 20.0])));
        near(fidelity(&thick, &thin), 0.125, 0.0);
    }
}
