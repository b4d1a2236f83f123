//! Networks of curves whose size can be chosen, as JSON of knots and control points, and how good the triangles are that fill them.

use std::f64::consts::TAU;
use std::fmt::Write;

use crate::space::{Vector, cross, length, minus};

/// The form of a network.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// The outline of fourteen cubic curves, in no plane: the number of curves of the paper on filling holes bounded by B-spline curves.
    Fourteen,
    /// One outline: a square, its sides divided into straight curves.
    Square,
    /// One outline: a circle of cubic curves.
    Ring,
    /// One outline: rays of a star, concave at every second corner.
    Star,
    /// Loops of four straight curves each, apart from each other, none of them flat.
    Quads,
    /// Loops of four cubic curves each, a little bent, apart from each other.
    BentQuads,
}

impl Shape {
    /// All of them.
    pub const ALL: [Self; 6] = [Self::Fourteen, Self::Square, Self::Ring, Self::Star, Self::Quads, Self::BentQuads];

    /// A word for it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Fourteen => "fourteen",
            Self::Square => "square",
            Self::Ring => "ring",
            Self::Star => "star",
            Self::Quads => "quads",
            Self::BentQuads => "bent-quads",
        }
    }

    /// Whether each loop has four curves, so that sizes are counts of loops; else they are counts of curves of one loop.
    #[must_use]
    pub fn is_many(self) -> bool {
        matches!(self, Self::Quads | Self::BentQuads)
    }

    /// The network of a size as JSON, and how many curves it has. A length of 1 is 1 mm.
    #[must_use]
    pub fn json(self, size: u64) -> (String, u64) {
        let mut text = String::from("{\"unit\":\"mm\",\"curves\":[\n");
        let mut count = 0;
        let mut put = |corners: &[Vector]| {
            if count > 0 {
                text += ",\n";
            }
            count += 1;
            curve(&mut text, corners);
        };
        match self {
            Self::Fourteen => (0..14).for_each(|k| put(&bent(wave(k, 14, 10.0), wave(k + 1, 14, 10.0), 0.2))),
            Self::Ring => (0..size).for_each(|k| put(&arc(k, size))),
            Self::Square => (0..size).for_each(|k| put(&[side(k, size), side(k + 1, size)])),
            Self::Star => {
                let point = |k: u64| {
                    // Rays are as slender whatever their number, else the triangles of each would grow with it.
                    let depth = 2.0 * TAU * 100.0 / size as f64;
                    let wide = if k.is_multiple_of(2) { 100.0 } else { 100.0 - depth };
                    around(k, size, wide)
                };
                (0..size).for_each(|k| put(&[point(k), point((k + 1) % size)]));
            }
            Self::Quads | Self::BentQuads => {
                for corners in (0..size).map(|k| quad(k, size)) {
                    for k in 0..4 {
                        let (a, b) = (corners[k], corners[(k + 1) % 4]);
                        if self == Self::Quads { put(&[a, b]) } else { put(&bent(a, b, 0.1)) }
                    }
                }
            }
        }
        text += "\n]}\n";
        (text, count)
    }
}

/// A curve through its control points: a line of two, a cubic of four.
fn curve(text: &mut String, corners: &[Vector]) {
    let points: Vec<String> = corners.iter().map(|[x, y, z]| format!("[{x},{y},{z}]")).collect();
    let points = points.join(",");
    let _ = match corners.len() {
        2 => write!(text, "{{\"line\":[{points}]}}"),
        _ => write!(text, "{{\"degree\":3,\"knots\":[0,0,0,0,1,1,1,1],\"points\":[{points}]}}"),
    };
}

fn around(k: u64, count: u64, wide: f64) -> Vector {
    let (sin, cos) = (TAU * (k % count) as f64 / count as f64).sin_cos();
    [wide * cos, wide * sin, 0.0]
}

/// A corner of the outline of fourteen: up and down around a circle.
fn wave(k: u64, count: u64, wide: f64) -> Vector {
    let [x, y, _] = around(k, count, wide);
    [x, y, 0.2 * wide * (2.0 * TAU * (k % count) as f64 / count as f64).sin()]
}

/// The cubic nearest to an arc of a circle around the z axis.
fn arc(k: u64, count: u64) -> [Vector; 4] {
    let [a, b] = [k, k + 1].map(|k| around(k, count, 100.0));
    let reach = 4.0 / 3.0 * (TAU / count as f64 / 4.0).tan();
    let off = |p: Vector, sign: f64| [p[0] - sign * reach * p[1], p[1] + sign * reach * p[0], 0.0];
    [a, off(a, 1.0), off(b, -1.0), b]
}

/// A corner on the sides of a square of 100.
fn side(k: u64, count: u64) -> Vector {
    let way = 4.0 * (k % count) as f64 / count as f64;
    let (along, number) = (100.0 * way.fract(), way as u64);
    match number {
        0 => [along, 0.0, 0.0],
        1 => [100.0, along, 0.0],
        2 => [100.0 - along, 100.0, 0.0],
        _ => [0.0, 100.0 - along, 0.0],
    }
}

/// A cubic from one point to another that bends upwards by a share of its length.
fn bent(a: Vector, b: Vector, share: f64) -> [Vector; 4] {
    let up = share * length(minus(b, a));
    let at = |t: f64| std::array::from_fn(|k| a[k] + t * (b[k] - a[k]) + if k == 2 { up } else { 0.0 });
    [a, at(1.0 / 3.0), at(2.0 / 3.0), b]
}

/// The corners of one of many squares of 1, apart, one corner lifted.
fn quad(k: u64, count: u64) -> [Vector; 4] {
    let row = (count as f64).sqrt().ceil() as u64;
    let (x, y) = ((k % row) as f64 * 1.5, (k / row) as f64 * 1.5);
    [[x, y, 0.0], [x + 1.0, y, 0.0], [x + 1.0, y + 1.0, 0.2], [x, y + 1.0, 0.0]]
}

/// Twice the inradius over the circumradius of each triangle: 1 of equal sides, 0 of none.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Quality {
    /// Its mean.
    pub mean: f64,
    /// Triangles below 0.4.
    pub below: u64,
    /// All triangles.
    pub triangles: u64,
}

impl Quality {
    /// Of triangles.
    #[must_use]
    pub fn of(triangles: &[[[f32; 3]; 3]]) -> Self {
        let mut quality = Self { triangles: triangles.len() as u64, ..Self::default() };
        let mut sum = 0.0;
        for triangle in triangles {
            let [a, b, c] = triangle.map(|p| p.map(f64::from));
            let sides = [length(minus(b, c)), length(minus(c, a)), length(minus(a, b))];
            let twice = length(cross(minus(b, a), minus(c, a)));
            // r = 2 A / (a + b + c) and R = a b c / (4 A), A being the area.
            let [p, q, r] = sides;
            let value = 4.0 * twice * twice / ((p + q + r) * p * q * r).max(f64::MIN_POSITIVE);
            sum += value;
            quality.below += u64::from(value < 0.4);
        }
        quality.mean = sum / triangles.len().max(1) as f64;
        quality
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quality_is_that_of_the_triangle() {
        let height = 3.0_f32.sqrt() / 2.0;
        let equal = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.5, height, 0.0]];
        assert!((Quality::of(&[equal]).mean - 1.0).abs() < 1e-6);
        // Of 3, 4, 5: r = 1, R = 2.5.
        let right = [[0.0, 0.0, 0.0], [3.0, 0.0, 0.0], [0.0, 4.0, 0.0]];
        assert!((Quality::of(&[right]).mean - 0.8).abs() < 1e-12);
        let sliver = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.5, 0.01, 0.0]];
        assert_eq!(Quality::of(&[right, sliver]).below, 1);
    }

    #[test]
    fn networks_have_the_curves_they_say_and_close() {
        for shape in Shape::ALL {
            let (text, count) = shape.json(100);
            let json: serde_json::Value = serde_json::from_str(&text).unwrap();
            let curves = json["curves"].as_array().unwrap();
            let expected = [14, 100, 400][usize::from(shape != Shape::Fourteen) + usize::from(shape.is_many())];
            assert_eq!((curves.len(), count), (expected, expected as u64), "{shape:?}");
            let end = |curve: &serde_json::Value, last: bool| {
                let points = curve.get("line").unwrap_or(&curve["points"]).as_array().unwrap().clone();
                points[if last { points.len() - 1 } else { 0 }].clone()
            };
            for (k, curve) in curves.iter().enumerate() {
                let next = if shape.is_many() { k / 4 * 4 + (k + 1) % 4 } else { (k + 1) % curves.len() };
                assert_eq!(end(curve, true), end(&curves[next], false), "{shape:?} {k}");
            }
        }
    }
}
