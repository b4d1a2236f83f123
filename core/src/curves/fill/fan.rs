//! A part of a cone over a polyline, unrolled into the plane: lengths and angles stay.

use crate::curves::vector::{Point, add, cross, dot, norm, scale, sub};

/// Triangles of a centre and the edges of a polyline, side by side in the plane around the origin.
#[derive(Clone, Debug)]
pub(super) struct Fan {
    centre: Point,
    points: Vec<Point>,
    places: Vec<[f64; 2]>,
    /// The angle of each point, from 0 on.
    angles: Vec<f64>,
}

impl Fan {
    pub(super) fn new(centre: Point, points: Vec<Point>) -> Self {
        let mut angles: Vec<f64> = Vec::with_capacity(points.len());
        for (number, point) in points.iter().enumerate() {
            let before =
                number.checked_sub(1).and_then(|before| points.get(before)).map_or(0.0, |before| angle(centre, *before, *point));
            angles.push(angles.last().copied().unwrap_or(0.0) + before);
        }
        let place = |(angle, point): (&f64, &Point)| {
            let (sin, cos) = angle.sin_cos();
            let far = norm(sub(*point, centre));
            [far * cos, far * sin]
        };
        let places = angles.iter().zip(&points).map(place).collect();
        Self { centre, points, places, angles }
    }

    /// The place of a point of the polyline.
    pub(super) fn place(&self, number: usize) -> [f64; 2] {
        self.places.get(number).copied().unwrap_or_default()
    }

    /// The point of a place. O(log points).
    pub(super) fn point(&self, place: [f64; 2]) -> Point {
        let [x, y] = place;
        let last = self.points.len().saturating_sub(1);
        let mut angle = y.atan2(x);
        if angle < -1e-9 {
            angle += std::f64::consts::TAU;
        }
        let next = self.angles.partition_point(|known| *known <= angle).clamp(1, last.max(1));
        let ([a, b], [c, d]) = (self.place(next - 1), self.place(next));
        let determinant = a * d - b * c;
        let [first, second] = [(x * d - y * c) / determinant, (a * y - b * x) / determinant];
        let from =
            |number: usize, share: f64| scale(sub(self.points.get(number).copied().unwrap_or(self.centre), self.centre), share);
        add(self.centre, add(from(next - 1, first), from(next, second)))
    }
}

/// The angle under which two points are seen.
pub(super) fn angle(centre: Point, a: Point, b: Point) -> f64 {
    let (a, b) = (sub(a, centre), sub(b, centre));
    norm(cross(a, b)).atan2(dot(a, b))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::curves::vector::distance;

    /// A part of a bent cone: places keep distances from the centre and lengths of edges, and give their points back.
    #[test]
    fn lengths_stay() {
        let points = vec![[1.0, 0.0, 0.5], [0.8, 0.9, 0.2], [-0.5, 1.2, 0.9], [-1.5, 0.1, -0.3]];
        let fan = Fan::new([0.1, 0.1, 0.0], points.clone());
        for (number, point) in points.iter().enumerate() {
            assert!(distance(fan.point(fan.place(number)), *point) < 1e-12);
            let half = fan.place(number).map(|x| 0.5 * x);
            assert!(distance(fan.point(half), add(scale(*point, 0.5), [0.05, 0.05, 0.0])) < 1e-12);
        }
        for pair in [0, 1, 2].map(|at| [at, at + 1]) {
            let [[a, b], [c, d]] = pair.map(|at| fan.place(at));
            assert!(((c - a).hypot(d - b) - distance(points[pair[0]], points[pair[1]])).abs() < 1e-12);
        }
    }
}
