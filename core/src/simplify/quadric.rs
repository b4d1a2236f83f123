//! Sums of squared distances from planes (Garland & Heckbert, "Surface simplification using quadric error metrics", SIGGRAPH 1997).
//!
//! A quadric is stored around the position of its vertex, in single precision: there its numbers are as small as the edges, and nothing
//! cancels out, however far from the origin the mesh lies. Sums are worked out in f64.

use glam::DVec3;

/// q(x) = xᵀAx + 2b·x + c for x from the vertex on.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Quadric {
    /// xx, xy, xz, yy, yz, zz.
    a: [f32; 6],
    b: [f32; 3],
    c: f32,
}

/// The same in f64, around any place.
#[derive(Clone, Copy, Debug)]
pub(super) struct Wide {
    a: [f64; 6],
    b: DVec3,
    c: f64,
}

impl Quadric {
    /// Of planes through the vertex, by their unit normals.
    pub(super) fn of_normals(normals: impl Iterator<Item = DVec3>) -> Self {
        let mut a = [0.0; 6];
        // Chains of iterators go faster so than by a loop.
        normals.for_each(|n| {
            let products = [n.x * n.x, n.x * n.y, n.x * n.z, n.y * n.y, n.y * n.z, n.z * n.z];
            for (sum, product) in a.iter_mut().zip(products) {
                *sum += product;
            }
        });
        Self { a: a.map(|x| x as f32), b: [0.0; 3], c: 0.0 }
    }

    #[inline]
    pub(super) fn wide(&self) -> Wide {
        Wide { a: self.a.map(f64::from), b: DVec3::new(self.b[0].into(), self.b[1].into(), self.b[2].into()), c: self.c.into() }
    }
}

impl Wide {
    #[inline]
    fn times(&self, x: DVec3) -> DVec3 {
        let [xx, xy, xz, yy, yz, zz] = self.a;
        DVec3::new(xx * x.x + xy * x.y + xz * x.z, xy * x.x + yy * x.y + yz * x.z, xz * x.x + yz * x.y + zz * x.z)
    }

    /// The same function around the place `d` from the old one.
    #[inline]
    pub(super) fn around(&self, d: DVec3) -> Self {
        let ad = self.times(d);
        Self { a: self.a, b: self.b + ad, c: self.c + d.dot(ad + 2.0 * self.b) }
    }

    /// The sum of two around one place.
    #[inline]
    pub(super) fn plus(&self, other: &Self) -> Self {
        let mut a = self.a;
        for (sum, term) in a.iter_mut().zip(other.a) {
            *sum += term;
        }
        Self { a, b: self.b + other.b, c: self.c + other.c }
    }

    /// Its value at a place; never negative, as it is in truth.
    #[inline]
    pub(super) fn at(&self, x: DVec3) -> f64 {
        (x.dot(self.times(x) + 2.0 * self.b) + self.c).max(0.0)
    }

    /// How many planes it is of, by their weights: the sum of the squares of their unit normals.
    #[inline]
    pub(super) fn weight(&self) -> f64 {
        self.a[0] + self.a[3] + self.a[5]
    }

    /// Where q(x) + w|x − m|² is least, for w > 0. By Cramer's rule: the matrix is positive definite.
    #[inline]
    pub(super) fn least(&self, w: f64, m: DVec3) -> DVec3 {
        let [xx, xy, xz, yy, yz, zz] = self.a;
        let (xx, yy, zz) = (xx + w, yy + w, zz + w);
        let r = w * m - self.b;
        let (p, q, s) = (yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy);
        let (t, u, v) = (xx * zz - xz * xz, xy * xz - xx * yz, xx * yy - xy * xy);
        let inverse = (xx * p + xy * q + xz * s).recip();
        DVec3::new(p * r.x + q * r.y + s * r.z, q * r.x + t * r.y + u * r.z, s * r.x + u * r.y + v * r.z) * inverse
    }

    /// For storage.
    #[inline]
    pub(super) fn narrow(&self) -> Quadric {
        Quadric { a: self.a.map(|x| x as f32), b: self.b.to_array().map(|x| x as f32), c: self.c.max(0.0) as f32 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Against the sum of the squared distances, at any place and around any other one.
        #[test]
        fn is_the_sum_of_squared_distances(n in prop::collection::vec(prop::array::uniform3(-9i8..10), 1..6), c in prop::array::uniform9(-9i8..10)) {
            let vector = |v: [i8; 3]| DVec3::from_array(v.map(f64::from));
            let normals: Vec<DVec3> = n.into_iter().map(|v| vector(v).normalize_or(DVec3::X)).collect();
            let [d, x, m] = [[c[0], c[1], c[2]], [c[3], c[4], c[5]], [c[6], c[7], c[8]]].map(vector);
            let q = Quadric::of_normals(normals.iter().copied()).wide();
            let truth = |x: DVec3| normals.iter().map(|n| n.dot(x).powi(2)).sum::<f64>();
            prop_assert!((q.at(x) - truth(x)).abs() < 1e-3 && (q.around(d).at(x - d) - truth(x)).abs() < 1e-2);
            prop_assert!((q.around(d).narrow().wide().at(x - d) - truth(x)).abs() < 1e-2);
            let w = 0.5;
            let at = q.around(d).least(w, m);
            let cost = |x: DVec3| truth(x + d) + w * x.distance_squared(m);
            prop_assert!([DVec3::X, DVec3::Y, DVec3::Z].iter().all(|s| cost(at) <= cost(at + *s) && cost(at) <= cost(at - *s)));
        }
    }
}
