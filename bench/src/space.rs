//! The little arithmetic of points and directions that all parts of this crate need.

/// A point or a direction.
pub type Vector = [f64; 3];

/// From `b` to `a`.
#[inline]
pub fn minus(a: Vector, b: Vector) -> Vector {
    std::array::from_fn(|k| a[k] - b[k])
}

/// The sum.
#[inline]
pub fn plus(a: Vector, b: Vector) -> Vector {
    std::array::from_fn(|k| a[k] + b[k])
}

/// Longer by a factor.
#[inline]
pub fn times(a: Vector, factor: f64) -> Vector {
    a.map(|x| x * factor)
}

/// The scalar product.
#[inline]
pub fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The vector product.
#[inline]
pub fn cross(a: Vector, b: Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// The Euclidean length.
#[inline]
pub fn length(a: Vector) -> f64 {
    dot(a, a).sqrt()
}

/// Of length 1; nothing stays nothing.
#[inline]
pub fn unit(a: Vector) -> Vector {
    let length = length(a).max(f64::MIN_POSITIVE);
    a.map(|x| x / length)
}

/// A point of a file.
#[inline]
pub fn wide(p: [f32; 3]) -> Vector {
    p.map(f64::from)
}

/// The lowest and highest coordinates of points.
#[inline]
pub fn bounds(points: impl Iterator<Item = Vector>) -> [Vector; 2] {
    points.fold([[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]], |[lo, hi], p| {
        [std::array::from_fn(|k| lo[k].min(p[k])), std::array::from_fn(|k| hi[k].max(p[k]))]
    })
}
