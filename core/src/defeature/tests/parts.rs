//! A small generator of parts.

use spade::handles::FixedVertexHandle;
use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation};
use std::collections::BTreeMap;

type Outline = Vec<[f64; 2]>;

/// An indexed mesh.
#[derive(Default)]
pub(super) struct Part {
    pub(super) points: Vec<[f32; 3]>,
    pub(super) triangles: Vec<[u32; 3]>,
    known: BTreeMap<[u32; 3], u32>,
}

impl Part {
    fn vertex(&mut self, [x, y, z]: [f64; 3]) -> u32 {
        let point = [x as f32, y as f32, z as f32].map(|x| x + 0.0);
        *self.known.entry(point.map(f32::to_bits)).or_insert_with(|| {
            self.points.push(point);
            self.points.len() as u32 - 1
        })
    }

    fn triangle(&mut self, corners: [[f64; 3]; 3]) {
        let triangle = corners.map(|p| self.vertex(p));
        self.triangles.push(triangle);
    }

    /// A flat face at a height, between outlines that have it on their left; turned over where it looks down.
    fn face(&mut self, outlines: &[Outline], z: f64, is_up: bool) {
        for [a, b, c] in fill(outlines) {
            let corners = if is_up { [a, b, c] } else { [a, c, b] };
            self.triangle(corners.map(|[x, y]| [x, y, z]));
        }
    }

    /// A ring between two circles of equally many points.
    fn band(&mut self, low: &Outline, high: &Outline, [z, w]: [f64; 2]) {
        for k in 0..low.len() {
            let next = (k + 1) % low.len();
            let [a, b] = [k, next].map(|k| [low[k][0], low[k][1], z]);
            let [c, d] = [k, next].map(|k| [high[k][0], high[k][1], w]);
            self.triangle([a, b, d]);
            self.triangle([a, d, c]);
        }
    }

    /// Walls over outlines that have the material on their left, from one height up to another.
    fn wall(&mut self, outline: &Outline, low: f64, high: f64) {
        for (k, [x, y]) in outline.iter().copied().enumerate() {
            let [u, v] = outline[(k + 1) % outline.len()];
            self.triangle([[x, y, low], [u, v, low], [u, v, high]]);
            self.triangle([[x, y, low], [u, v, high], [x, y, high]]);
        }
    }

    /// Turns the part around an oblique axis and scales it.
    pub(super) fn turn(&mut self, angle: f64, scale: f64) {
        for point in &mut self.points {
            let [x, y, z] = point.map(f64::from);
            let (c, s) = (angle.cos(), angle.sin());
            let (x, y) = (c * x - s * y, s * x + c * y);
            let (y, z) = (0.8 * y - 0.6 * z, 0.6 * y + 0.8 * z);
            *point = [x, y, z].map(|w| (w * scale) as f32);
        }
    }
}

pub(super) fn circle([x, y]: [f64; 2], radius: f64, sides: usize) -> Outline {
    let angle = |k: usize| std::f64::consts::TAU * k as f64 / sides as f64;
    (0..sides).map(|k| [x + radius * angle(k).cos(), y + radius * angle(k).sin()]).collect()
}

/// Points from one angle to another, both ends among them, degrees.
pub(super) fn arc([x, y]: [f64; 2], radius: f64, [from, to]: [f64; 2], steps: usize) -> Outline {
    let angle = |k: usize| (from + (to - from) * k as f64 / steps as f64).to_radians();
    (0..=steps).map(|k| [x + radius * angle(k).cos(), y + radius * angle(k).sin()]).collect()
}

fn rectangle([x, y]: [f64; 2]) -> Outline {
    vec![[0.0, 0.0], [x, 0.0], [x, y], [0.0, y]]
}

fn reversed(outline: &[[f64; 2]]) -> Outline {
    outline.iter().rev().copied().collect()
}

/// A plate with holes through it.
pub(super) fn plate([x, y, z]: [f64; 3], holes: &[Outline]) -> Part {
    let mut part = Part::default();
    let mut outlines = vec![rectangle([x, y])];
    outlines.extend(holes.iter().map(|hole| reversed(hole)));
    part.face(&outlines, z, true);
    part.face(&outlines, 0.0, false);
    outlines.iter().for_each(|outline| part.wall(outline, 0.0, z));
    part
}

/// A plate with a boss (positive) or a pocket on it.
pub(super) fn stepped([x, y, z]: [f64; 3], outline: &[[f64; 2]], height: f64) -> Part {
    let mut part = Part::default();
    part.face(&[rectangle([x, y])], 0.0, false);
    part.wall(&rectangle([x, y]), 0.0, z);
    part.face(&[rectangle([x, y]), reversed(outline)], z, true);
    part.face(&[outline.to_vec()], z + height, true);
    if height > 0.0 {
        part.wall(&outline.to_vec(), z, z + height);
    } else {
        part.wall(&reversed(outline), z + height, z);
    }
    part
}

/// A plate with a round boss, in it a hole: (diameter, height) of each, that of the hole negative.
pub(super) fn tower([x, y, z]: [f64; 3], place: [f64; 2], [(wide, up), (narrow, down)]: [(f64, f64); 2]) -> Part {
    let (boss, hole) = (circle(place, wide / 2.0, 32), circle(place, narrow / 2.0, 16));
    let mut part = Part::default();
    part.face(&[rectangle([x, y])], 0.0, false);
    part.wall(&rectangle([x, y]), 0.0, z);
    part.face(&[rectangle([x, y]), reversed(&boss)], z, true);
    part.wall(&boss, z, z + up);
    part.face(&[boss, reversed(&hole)], z + up, true);
    part.wall(&reversed(&hole), z + up + down, z + up);
    part.face(&[hole], z + up + down, true);
    part
}

/// A bar of an outline.
pub(super) fn bar(outline: &[[f64; 2]], length: f64) -> Part {
    let mut part = Part::default();
    part.face(&[outline.to_vec()], 0.0, false);
    part.face(&[outline.to_vec()], length, true);
    part.wall(&outline.to_vec(), 0.0, length);
    part
}

/// A bar whose ends have outlines of equally many points.
pub(super) fn lofted(bottom: &[[f64; 2]], top: &[[f64; 2]], length: f64) -> Part {
    let mut part = Part::default();
    part.face(&[bottom.to_vec()], 0.0, false);
    part.face(&[top.to_vec()], length, true);
    for k in 0..bottom.len() {
        let next = (k + 1) % bottom.len();
        let [a, b] = [k, next].map(|k| [bottom[k][0], bottom[k][1], 0.0]);
        let [c, d] = [k, next].map(|k| [top[k][0], top[k][1], length]);
        part.triangle([a, b, d]);
        part.triangle([a, d, c]);
    }
    part
}

/// A body turned around the z axis: (radius, height) from the foot up, each end closed by a disc.
pub(super) fn shaft(profile: &[[f64; 2]], columns: usize) -> Part {
    let ring = |[radius, _]: [f64; 2]| circle([0.0; 2], radius, columns);
    let mut part = Part::default();
    let (Some(foot), Some(head)) = (profile.first(), profile.last()) else { return part };
    part.face(&[ring(*foot)], foot[1], false);
    part.face(&[ring(*head)], head[1], true);
    for pair in profile.windows(2) {
        let (low, high) = (ring(pair[0]), ring(pair[1]));
        for k in 0..columns {
            let next = (k + 1) % columns;
            let [a, b] = [k, next].map(|k| [low[k][0], low[k][1], pair[0][1]]);
            let [c, d] = [k, next].map(|k| [high[k][0], high[k][1], pair[1][1]]);
            part.triangle([a, b, d]);
            part.triangle([a, d, c]);
        }
    }
    part
}

/// A ring around the z axis, of a closed profile: (radius, height), counter-clockwise.
pub(super) fn ring(profile: &[[f64; 2]], columns: usize) -> Part {
    let mut part = Part::default();
    for (k, low) in profile.iter().enumerate() {
        let high = profile[(k + 1) % profile.len()];
        part.band(&circle([0.0; 2], low[0], columns), &circle([0.0; 2], high[0], columns), [low[1], high[1]]);
    }
    part
}

/// A plate with a hole whose edges are bevelled at both ends.
pub(super) fn bevelled([x, y, z]: [f64; 3], place: [f64; 2], radius: f64, bevel: f64) -> Part {
    let mut part = Part::default();
    let (wide, narrow) = (reversed(&circle(place, radius + bevel, 32)), reversed(&circle(place, radius, 32)));
    part.face(&[rectangle([x, y]), wide.clone()], 0.0, false);
    part.face(&[rectangle([x, y]), wide.clone()], z, true);
    part.wall(&rectangle([x, y]), 0.0, z);
    part.band(&wide, &narrow, [0.0, bevel]);
    part.wall(&narrow, bevel, z - bevel);
    part.band(&narrow, &wide, [z - bevel, z]);
    part
}

/// A step of 12 by 20 by 3 on a plate of 30 by 20 by 5, and a hole of 2 mm through both, its axis in the step's wall.
pub(super) fn stepped_hole() -> Part {
    let mut part = Part::default();
    let hole = circle([12.0, 10.0], 1.0, 32);
    let arc = |range: &mut dyn Iterator<Item = usize>| -> Outline { range.map(|k| hole[k % 32]).collect() };
    let plate = vec![[0.0, 0.0], [12.0, 0.0], [30.0, 0.0], [30.0, 20.0], [12.0, 20.0], [0.0, 20.0]];
    part.face(&[plate.clone(), reversed(&hole)], 0.0, false);
    part.wall(&plate, 0.0, 5.0);
    part.wall(&reversed(&hole), 0.0, 5.0);
    let mut step = vec![[0.0, 0.0], [12.0, 0.0]];
    step.extend(arc(&mut (8..=24).rev()));
    step.extend([[12.0, 20.0], [0.0, 20.0]]);
    part.wall(&step, 5.0, 8.0);
    part.face(&[step], 8.0, true);
    let mut rest = vec![[12.0, 0.0], [30.0, 0.0], [30.0, 20.0], [12.0, 20.0]];
    rest.extend(arc(&mut (24..=40).rev()));
    part.face(&[rest], 5.0, true);
    part
}

/// A block of 10 by 10 by 6 around the origin, and two bores of 2 mm through it, along x and y: they meet in two ellipses.
pub(super) fn crossed_bores() -> Part {
    let mut part = Part::default();
    let square = vec![[-5.0, -5.0], [5.0, -5.0], [5.0, 5.0], [-5.0, 5.0]];
    part.face(std::slice::from_ref(&square), 3.0, true);
    part.face(&[square], -3.0, false);
    let side = vec![[-5.0, -3.0], [5.0, -3.0], [5.0, 3.0], [-5.0, 3.0]];
    // Rounding may not part what is one point.
    let clean = |x: f64| if x.abs() < 1e-9 { 0.0 } else { x };
    let hole: Outline = circle([0.0; 2], 1.0, 32).into_iter().map(|p| p.map(clean)).collect();
    for turn in 0..4 {
        // The side that looks along x, turned around z.
        let place = |[x, y, z]: [f64; 3]| [[x, y, z], [-y, x, z], [-x, -y, z], [y, -x, z]][turn];
        for corners in fill(&[side.clone(), reversed(&hole)]) {
            part.triangle(corners.map(|[y, z]| place([5.0, y, z])));
        }
        for k in 0..32 {
            let [[a, b], [c, d]] = [hole[k], hole[(k + 1) % 32]];
            let [p, q, r, s] = [[5.0, a, b], [5.0, c, d], [c.abs(), c, d], [a.abs(), a, b]].map(place);
            for triangle in [[p, q, r], [p, r, s]] {
                part.triangle(triangle);
            }
        }
    }
    part
}

/// Boxes of a grid between planes: those that a test says are there, by their numbers.
pub(super) fn cells(planes: [&[f64]; 3], is_solid: impl Fn([usize; 3]) -> bool) -> Part {
    let mut part = Part::default();
    let count = planes.map(|p| p.len() - 1);
    let inside = |at: [isize; 3]| {
        let is_there = (0..3).all(|k| at[k] >= 0 && (at[k] as usize) < count[k]);
        is_there && is_solid(at.map(|x| x as usize))
    };
    for number in 0..count.iter().product::<usize>() {
        let at = [number % count[0], number / count[0] % count[1], number / count[0] / count[1]].map(|x| x as isize);
        for (axis, up) in (0..3).flat_map(|axis| [(axis, 0), (axis, 1)]).filter(|_| inside(at)) {
            let mut beside = at;
            beside[axis] += 2 * up - 1;
            if inside(beside) {
                continue;
            }
            let corner = |u: isize, v: isize| {
                let (mut point, steps) = ([0.0; 3], [up, u, v]);
                (0..3).for_each(|k| point[(axis + k) % 3] = planes[(axis + k) % 3][(at[(axis + k) % 3] + steps[k]) as usize]);
                point
            };
            let [a, b, c, d] = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
            let faces = if up == 1 { [[a, b, c], [a, c, d]] } else { [[a, c, b], [a, d, c]] };
            faces.into_iter().for_each(|face| part.triangle(face));
        }
    }
    part
}

/// Triangles between outlines: those of the constrained triangulation whose middle lies inside by the even-odd rule.
fn fill(outlines: &[Outline]) -> Vec<[[f64; 2]; 3]> {
    let mut mesh = ConstrainedDelaunayTriangulation::<Point2<f64>>::new();
    for outline in outlines {
        let handles: Vec<FixedVertexHandle> = outline.iter().map(|[x, y]| mesh.insert(Point2::new(*x, *y)).unwrap()).collect();
        for (k, handle) in handles.iter().enumerate() {
            mesh.add_constraint(*handle, handles[(k + 1) % handles.len()]);
        }
    }
    let is_inside = |x: f64, y: f64| {
        let crossings = outlines
            .iter()
            .flat_map(|o| o.iter().zip(o.iter().cycle().skip(1)))
            .filter(|(a, b)| (a[1] <= y) != (b[1] <= y) && x < a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0]));
        crossings.count() % 2 == 1
    };
    let corners = mesh.inner_faces().map(|face| face.vertices().map(|v| [v.position().x, v.position().y]));
    corners.filter(|[a, b, c]| is_inside((a[0] + b[0] + c[0]) / 3.0, (a[1] + b[1] + c[1]) / 3.0)).collect()
}

/// A ball around the origin of `n` latitudes and `2 n` longitudes; `far` is the distance of a direction's point.
pub(super) fn ball(n: u32, far: impl Fn([f64; 3]) -> f64) -> Part {
    let point = |row: u32, column: u32| {
        // Columns lean, so that no four neighbours are symmetric.
        let (s, t) =
            (f64::from(row) / f64::from(n), f64::from(column) / f64::from(n) + 0.37 / f64::from(n) * f64::from(row).sin());
        let [lat, lon] = [s, t].map(|x| x * std::f64::consts::PI);
        let way = [lat.sin() * lon.cos(), lat.sin() * lon.sin(), lat.cos()];
        way.map(|x| (x * far(way)) as f32)
    };
    let mut points = vec![point(0, 0)];
    points.extend((1..n).flat_map(|row| (0..2 * n).map(move |column| (row, column))).map(|(row, column)| point(row, column)));
    points.push(point(n, 0));
    let at = |row: u32, column: u32| match row {
        0 => 0,
        _ if row == n => 1 + (n - 1) * 2 * n,
        _ => 1 + (row - 1) * 2 * n + column % (2 * n),
    };
    let quad =
        |row: u32, k: u32| [[at(row, k), at(row + 1, k), at(row + 1, k + 1)], [at(row, k), at(row + 1, k + 1), at(row, k + 1)]];
    let all = (0..n).flat_map(|row| (0..2 * n).map(move |k| (row, k))).flat_map(|(row, k)| quad(row, k));
    let triangles = all.filter(|[a, b, c]| a != b && b != c && c != a).collect();
    Part { points, triangles, ..Part::default() }
}
