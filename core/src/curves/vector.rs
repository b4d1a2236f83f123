//! Points, vectors and affine maps of space.

/// A point or a vector: three coordinates in the unit of the file.
pub type Point = [f64; 3];

/// `a + b`.
#[inline]
#[must_use]
pub fn add(a: Point, b: Point) -> Point {
    let ([x, y, z], [u, v, w]) = (a, b);
    [x + u, y + v, z + w]
}

/// `a − b`.
#[inline]
#[must_use]
pub fn sub(a: Point, b: Point) -> Point {
    let ([x, y, z], [u, v, w]) = (a, b);
    [x - u, y - v, z - w]
}

/// `a · factor`.
#[inline]
#[must_use]
pub fn scale(a: Point, factor: f64) -> Point {
    let [x, y, z] = a;
    [x * factor, y * factor, z * factor]
}

/// Scalar product.
#[inline]
#[must_use]
pub fn dot(a: Point, b: Point) -> f64 {
    let ([x, y, z], [u, v, w]) = (a, b);
    x * u + y * v + z * w
}

/// Vector product.
#[inline]
#[must_use]
pub fn cross(a: Point, b: Point) -> Point {
    let ([x, y, z], [u, v, w]) = (a, b);
    [y * w - z * v, z * u - x * w, x * v - y * u]
}

/// Length of a vector.
#[inline]
#[must_use]
pub fn norm(a: Point) -> f64 {
    let [x, y, z] = a;
    x.hypot(y).hypot(z)
}

/// Distance of two points.
#[inline]
#[must_use]
pub fn distance(a: Point, b: Point) -> f64 {
    norm(sub(a, b))
}

/// The point at `t` between `a` (0) and `b` (1); exact at both.
#[inline]
#[must_use]
pub fn between(a: Point, b: Point, t: f64) -> Point {
    add(scale(a, 1.0 - t), scale(b, t))
}

/// The direction of a vector; `None` of one that has none.
#[inline]
#[must_use]
pub fn unit(a: Point) -> Option<Point> {
    let length = norm(a);
    (length > 0.0 && length.is_finite()).then(|| scale(a, 1.0 / length))
}

/// Length of a vector by a plain root: much faster than [`norm`], for lengths whose squares do not overflow.
#[inline]
pub(crate) fn plain_norm(a: Point) -> f64 {
    dot(a, a).sqrt()
}

/// Distance of two points by [`plain_norm`].
#[inline]
pub(crate) fn plain_distance(a: Point, b: Point) -> f64 {
    plain_norm(sub(a, b))
}

/// The direction of a vector by [`plain_norm`]; `None` of one that has none.
#[inline]
pub(crate) fn plain_unit(a: Point) -> Option<Point> {
    let length = plain_norm(a);
    (length > 0.0 && length.is_finite()).then(|| scale(a, 1.0 / length))
}

/// Whether all coordinates are numbers.
#[must_use]
pub fn is_finite(a: Point) -> bool {
    a.iter().all(|x| x.is_finite())
}

/// An affine map: rows of the matrix, and the image of the origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Affine {
    /// Rows of the linear part.
    pub rows: [Point; 3],
    /// Added behind it.
    pub shift: Point,
}

impl Affine {
    /// Leaves everything where it is.
    pub const IDENTITY: Self = Self { rows: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], shift: [0.0; 3] };

    /// The map that takes the axes to `x`, `y`, `z` and the origin to `origin`.
    #[must_use]
    pub fn from_axes([x, y, z]: [Point; 3], origin: Point) -> Self {
        let ([a, b, c], [d, e, f], [g, h, i]) = (x, y, z);
        Self { rows: [[a, d, g], [b, e, h], [c, f, i]], shift: origin }
    }

    /// Scales by a factor about the origin.
    #[must_use]
    pub fn scaling(factor: f64) -> Self {
        Self { rows: Self::IDENTITY.rows.map(|row| scale(row, factor)), shift: [0.0; 3] }
    }

    /// The image of a point.
    #[must_use]
    pub fn point(&self, point: Point) -> Point {
        add(self.vector(point), self.shift)
    }

    /// The image of a vector.
    #[must_use]
    pub fn vector(&self, vector: Point) -> Point {
        let [x, y, z] = self.rows;
        [dot(x, vector), dot(y, vector), dot(z, vector)]
    }

    /// This map behind another one: `x ↦ self(first(x))`.
    #[must_use]
    pub fn after(&self, first: &Self) -> Self {
        let [x, y, z] = first.columns();
        let axes = [self.vector(x), self.vector(y), self.vector(z)];
        Self::from_axes(axes, self.point(first.shift))
    }

    /// The inverse; `None` of a map that is flat.
    #[must_use]
    pub fn inverse(&self) -> Option<Self> {
        let [a, b, c] = self.rows;
        let determinant = dot(a, cross(b, c));
        if determinant == 0.0 || !determinant.is_finite() {
            return None;
        }
        let axes = [cross(b, c), cross(c, a), cross(a, b)].map(|axis| scale(axis, 1.0 / determinant));
        let linear = Self::from_axes(axes, [0.0; 3]);
        Some(Self { shift: scale(linear.vector(self.shift), -1.0), ..linear })
    }

    /// Whether all its numbers are numbers.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        self.rows.into_iter().all(is_finite) && is_finite(self.shift)
    }

    /// Images of the axes.
    pub(crate) fn columns(&self) -> [Point; 3] {
        let [[a, b, c], [d, e, f], [g, h, i]] = self.rows;
        [[a, d, g], [b, e, h], [c, f, i]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_map_and_its_inverse_cancel() {
        let map = Affine::from_axes([[0.0, 2.0, 0.0], [-1.0, 0.5, 0.0], [0.0, 0.0, 3.0]], [7.0, 8.0, 9.0]);
        assert_eq!(map.point([1.0, 0.0, 0.0]), [7.0, 10.0, 9.0]);
        let back = map.inverse().unwrap().after(&map);
        assert!(distance(back.point([1.0, 2.0, 3.0]), [1.0, 2.0, 3.0]) < 1e-14);
        assert!(Affine::scaling(0.0).inverse().is_none());
    }
}
