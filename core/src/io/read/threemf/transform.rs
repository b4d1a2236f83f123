//! Transforms of components and build items (3MF Core 3.3 and 8).

use super::super::number::{is_blank, number};

/// Four rows of three: x, y and z go where the first three rows say, the origin to the fourth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Transform(pub(crate) [[f64; 3]; 4]);

/// A determinant below this part of the product of its rows' lengths flattens whatever it is applied to.
const FLAT: f64 = 1e-12;

impl Transform {
    /// It leaves all where it is.
    pub(crate) const IDENTITY: Self = Self([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 0.0]]);

    /// Twelve numbers between blanks, as `m00 m01 m02 m10 … m32`. `None` if it is anything else.
    pub(crate) fn parse(text: &str) -> Option<Self> {
        let mut values = [[0.0; 3]; 4];
        let mut tokens = text.as_bytes().split(|byte| is_blank(*byte)).filter(|token| !token.is_empty());
        for value in values.as_flattened_mut() {
            *value = number(tokens.next()?).map(|number| number.wide).filter(|wide| wide.is_finite())?;
        }
        tokens.next().is_none().then_some(Self(values))
    }

    /// This one first, and then the other.
    pub(crate) fn then(&self, other: &Self) -> Self {
        let Self([x, y, z, origin]) = *self;
        let [ox, oy, oz, _] = Self::linear(other);
        let turned = |row: [f64; 3]| [0, 1, 2].map(|at: usize| row[0] * ox[at] + row[1] * oy[at] + row[2] * oz[at]);
        Self([turned(x), turned(y), turned(z), other.apply(origin)])
    }

    fn linear(&self) -> [[f64; 3]; 4] {
        self.0
    }

    /// Where a point goes.
    pub(crate) fn apply(&self, point: [f64; 3]) -> [f64; 3] {
        let Self([x, y, z, origin]) = self;
        [0, 1, 2].map(|at: usize| point[0] * x[at] + point[1] * y[at] + point[2] * z[at] + origin[at])
    }

    /// Volumes grow by so much; less than zero if left becomes right.
    pub(crate) fn determinant(&self) -> f64 {
        let [a, b, c, _] = self.0;
        a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) + a[2] * (b[0] * c[1] - b[1] * c[0])
    }

    /// Nothing solid is left of what it is applied to.
    pub(crate) fn flattens(&self) -> bool {
        let [a, b, c, _] = self.0;
        let size: f64 = [a, b, c].iter().map(|row| row.iter().map(|v| v * v).sum::<f64>().sqrt()).product();
        let determinant = self.determinant();
        !(determinant.is_finite() && determinant.abs() > FLAT * size)
    }

    /// It leaves all where it is.
    pub(crate) fn is_identity(&self) -> bool {
        *self == Self::IDENTITY
    }

    /// Left becomes right.
    pub(crate) fn mirrors(&self) -> bool {
        self.determinant() < 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_are_rows() {
        // A quarter turn around z: x to y, y to -x; then one to the right.
        let turn = Transform::parse("0 1 0 -1 0 0 0 0 1  1 0 0\n").unwrap();
        assert_eq!(turn.apply([1.0, 0.0, 0.0]), [1.0, 1.0, 0.0]);
        let up = Transform::parse("2 0 0 0 2 0 0 0 2 0 0 5").unwrap();
        assert_eq!(turn.then(&up).apply([1.0, 0.0, 0.0]), [2.0, 2.0, 5.0], "first the turn, then twice as large");
        assert_eq!(up.then(&turn).apply([1.0, 0.0, 0.0]), [1.0, 2.0, 5.0]);
        assert_eq!(Transform::IDENTITY.then(&up), up);
    }

    #[test]
    fn flat_and_mirrored_ones_are_told() {
        let of = |text: &str| Transform::parse(text).unwrap();
        assert!(of("1 0 0 0 1 0 0 0 0 0 0 0").flattens());
        assert!(of("1 2 3 2 4 6 0 0 1 0 0 0").flattens());
        assert!(!of("1e-9 0 0 0 1e-9 0 0 0 1e9 0 0 0").flattens(), "small, but solid");
        assert!(of("-1 0 0 0 1 0 0 0 1 0 0 0").mirrors() && !of("-1 0 0 0 -1 0 0 0 1 0 0 0").mirrors());
        for text in
            ["", "1 0 0 0 1 0 0 0 1 0 0", "1 0 0 0 1 0 0 0 1 0 0 0 0", "1 0 0 0 1 0 0 0 1 0 0 x", "1 0 0 0 1 0 0 0 1 0 0 inf"]
        {
            assert_eq!(Transform::parse(text), None, "{text}");
        }
    }
}
