//! Where an instance places an object.

/// A rotation, scaling and shift: rows of a matrix, the shift in its last column.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Placement([[f64; 4]; 3]);

impl Placement {
    /// Everything stays where it is.
    pub(super) const NONE: Self = Self([[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]]);

    /// Scales along the axes, turns by these degrees around x, then y, then z, then shifts.
    pub(super) fn of(scale: [f64; 3], degrees: [f64; 3], shift: [f64; 3]) -> Self {
        let [[sx, cx], [sy, cy], [sz, cz]] = degrees.map(sine_and_cosine);
        let turned = [
            [cz * cy, cz * sy * sx - sz * cx, cz * sy * cx + sz * sx],
            [sz * cy, sz * sy * sx + cz * cx, sz * sy * cx - cz * sx],
            [-sy, cy * sx, cy * cx],
        ];
        let [x, y, z] = scale;
        let mut rows = [[0.0; 4]; 3];
        for ((row, [a, b, c]), shift) in rows.iter_mut().zip(turned).zip(shift) {
            *row = [a * x, b * y, c * z, shift];
        }
        Self(rows)
    }

    /// The position of a point.
    #[inline]
    pub(super) fn place(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        self.0.map(|[a, b, c, shift]| a * x + b * y + c * z + shift)
    }

    /// This after `inner`.
    pub(super) fn after(&self, inner: &Self) -> Self {
        let [p, q, r] = inner.0;
        Self(self.0.map(|[a, b, c, shift]| {
            let mut row = [0.0; 4];
            for (((value, p), q), r) in row.iter_mut().zip(p).zip(q).zip(r) {
                *value = a * p + b * q + c * r;
            }
            let [x, y, z, inner] = row;
            [x, y, z, inner + shift]
        }))
    }

    /// Outside becomes inside.
    pub(super) fn mirrors(&self) -> bool {
        let [[a, b, c, _], [d, e, f, _], [g, h, i, _]] = self.0;
        a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g) < 0.0
    }
}

/// Sine and cosine of an angle in degrees, exact for quarters of a turn. With nothing but operations that IEEE 754 fixes, so that every machine places
/// alike; the library's functions differ.
fn sine_and_cosine(degrees: f64) -> [f64; 2] {
    let within = degrees % 360.0;
    let quarters = (within / 90.0).round();
    let angle = (within - 90.0 * quarters) * (std::f64::consts::PI / 180.0);
    // Taylor's series up to π/4: the first term left out is below 2^-60.
    let square = angle * angle;
    let series =
        |first: u32| (0..9u32).rev().fold(1.0, |sum, k| 1.0 - square / f64::from((2 * k + first) * (2 * k + first + 1)) * sum);
    let (sine, cosine) = (angle * series(2), series(1));
    match quarters as i32 & 3 {
        0 => [sine, cosine],
        1 => [cosine, -sine],
        2 => [-sine, -cosine],
        _ => [-cosine, sine],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quarters_of_a_turn_are_exact_and_other_angles_right() {
        for turns in [-720.0, 0.0, 360.0, 3600.0] {
            let of = |degrees: f64| sine_and_cosine(turns + degrees);
            assert_eq!([0.0, 90.0, 180.0, 270.0].map(of), [[0.0, 1.0], [1.0, 0.0], [0.0, -1.0], [-1.0, 0.0]]);
        }
        for tenth in -7200..7200 {
            let degrees = f64::from(tenth) / 10.0;
            let [sine, cosine] = sine_and_cosine(degrees);
            let (s, c) = degrees.to_radians().sin_cos();
            assert!((sine - s).abs() < 4e-15 && (cosine - c).abs() < 4e-15, "{degrees}");
        }
    }

    #[test]
    fn around_x_then_y_then_z_then_shifted() {
        let close = |a: [f64; 3], b: [f64; 3]| a == b;
        // Around x, y becomes z; around y, z becomes x; around z, x becomes y.
        let quarter = |axis: usize| Placement::of([1.0; 3], [0, 1, 2].map(|k| if k == axis { 90.0 } else { 0.0 }), [0.0; 3]);
        assert!(close(quarter(0).place([0.0, 1.0, 0.0]), [0.0, 0.0, 1.0]));
        assert!(close(quarter(1).place([0.0, 0.0, 1.0]), [1.0, 0.0, 0.0]));
        assert!(close(quarter(2).place([1.0, 0.0, 0.0]), [0.0, 1.0, 0.0]));
        // y: to z, to x, to y again, then shifted.
        let all = Placement::of([1.0; 3], [90.0; 3], [5.0, 6.0, 7.0]);
        assert!(close(all.place([0.0, 1.0, 0.0]), [5.0, 7.0, 7.0]));
        let step = quarter(2).after(&quarter(1)).after(&quarter(0));
        assert_eq!(step.place([1.0, 2.0, 3.0]), Placement::of([1.0; 3], [90.0; 3], [0.0; 3]).place([1.0, 2.0, 3.0]));
        assert!(!all.mirrors() && Placement::of([1.0, -2.0, 1.0], [10.0, 20.0, 30.0], [0.0; 3]).mirrors());
        assert_eq!(Placement::of([1.0; 3], [0.0; 3], [0.0; 3]), Placement::NONE);
        assert_eq!(Placement::NONE.after(&all), all);
    }
}
