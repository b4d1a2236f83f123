//! Solid angles, of single triangles and of many that are seen from afar.
//!
//! A solid angle is twice the argument of a complex number (van Oosterom & Strackee, IEEE Trans. Biomed. Eng. 30(2), 1983): the numbers of
//! all near triangles are multiplied and the turns of the product counted, so that the angle itself is needed once a query, from a series of
//! our own rather than from the platform's `atan2`.
//!
//! The product waits for each of its factors. Eight points at once wait side by side: the loops over them are written for one, without branches,
//! and say of each exactly what is said of it alone.

use glam::DVec3;

use crate::geometry::distance::place;

/// A triangle by its positions.
pub(crate) type Corners = [[f32; 3]; 3];

/// Points that are asked for at once.
pub(super) const WIDTH: usize = 8;

/// A node is far from a point beyond so many of its radii. The error of a winding number is then below some 10⁻², which matters only where
/// it is near ½: in the air of a hole.
pub(super) const FAR: f64 = 2.0;

/// Points side by side.
pub(super) struct Lanes([[f64; WIDTH]; 3]);

impl Lanes {
    /// Up to eight.
    #[inline(always)]
    pub(super) fn of(points: &[DVec3]) -> Self {
        let mut lanes = [[0.0; WIDTH]; 3];
        for (l, p) in points.iter().enumerate() {
            (lanes[0][l], lanes[1][l], lanes[2][l]) = (p.x, p.y, p.z);
        }
        Self(lanes)
    }

    #[inline(always)]
    pub(super) fn get(&self, l: usize) -> DVec3 {
        DVec3::new(self.0[0][l], self.0[1][l], self.0[2][l])
    }
}

/// A node as it is seen from afar.
#[derive(Clone, Default)]
pub(super) struct Moments {
    pub(super) centre: DVec3,
    /// Squared distance beyond which this stands for the triangles.
    pub(super) far: f64,
    /// Of all triangles.
    pub(super) area: f64,
    /// Sum of the vector areas.
    dipole: DVec3,
    /// Vector areas times the places of their triangles: xx, yy, zz, and the sums of xy and yx, yz and zy, zx and xz.
    spread: [f64; 6],
}

impl Moments {
    pub(super) fn of(triangles: &[Corners]) -> Self {
        let parts = triangles.iter().map(|t| {
            let [a, b, c] = t.map(place);
            ((a + b + c) / 3.0, (b - a).cross(c - a) / 2.0)
        });
        let (mut centre, mut total) = (DVec3::ZERO, 0.0);
        for (at, area) in parts.clone() {
            centre += at * area.length();
            total += area.length();
        }
        let centre = if total > 0.0 { centre / total } else { place(triangles[0][0]) };
        let mut moments = Self { centre, area: total, ..Self::default() };
        for (at, area) in parts {
            let by = at - centre;
            moments.dipole += area;
            let terms = [
                area.x * by.x,
                area.y * by.y,
                area.z * by.z,
                area.x * by.y + area.y * by.x,
                area.y * by.z + area.z * by.y,
                area.z * by.x + area.x * by.z,
            ];
            moments.spread.iter_mut().zip(terms).for_each(|(sum, term)| *sum += term);
        }
        let radius = triangles.iter().flatten().map(|p| (place(*p) - centre).length_squared()).fold(0.0, f64::max);
        moments.far = FAR * FAR * radius;
        moments
    }

    /// The solid angle, seen from where the centre lies in direction `to`.
    #[inline(always)]
    pub(super) fn seen_along(&self, to: DVec3, square: f64) -> f64 {
        let cube = square * square.sqrt();
        let [xx, yy, zz, xy, yz, zx] = self.spread;
        let bent =
            xx * to.x * to.x + yy * to.y * to.y + zz * to.z * to.z + xy * to.x * to.y + yz * to.y * to.z + zx * to.z * to.x;
        (self.dipole.dot(to) + (xx + yy + zz) - 3.0 * bent / square) / cube
    }

    /// Adds the solid angles from where this stands for its triangles, of the points that take part. Returns of which.
    #[inline(always)]
    pub(super) fn add_far(&self, points: &Lanes, takes_part: [bool; WIDTH], sums: &mut [f64; WIDTH]) -> [bool; WIDTH] {
        let (mut is_far, mut square) = ([false; WIDTH], [0.0; WIDTH]);
        for l in 0..WIDTH {
            square[l] = (self.centre - points.get(l)).length_squared();
            is_far[l] = takes_part[l] & (square[l] > self.far);
        }
        if is_far.contains(&true) {
            for l in 0..WIDTH {
                let sum = sums[l] + self.seen_along(self.centre - points.get(l), square[l]);
                sums[l] = if is_far[l] { sum } else { sums[l] };
            }
        }
        is_far
    }
}

/// A sum of half solid angles, as the argument of a product of complex numbers and how often that went round.
pub(super) struct Angle {
    re: f64,
    im: f64,
    rounds: f64,
}

impl Default for Angle {
    fn default() -> Self {
        Self { re: 1.0, im: 0.0, rounds: 0.0 }
    }
}

impl Angle {
    /// Adds a triangle as seen from a point.
    pub(super) fn add(&mut self, t: &Corners, from: DVec3) {
        let (re, mut im, hardly) = half_angle(place(t[0]) - from, place(t[1]) - from, place(t[2]) - from);
        if re.abs() + im.abs() < hardly {
            // On an edge: half of what the triangle takes up beside one of its inner points.
            im = hardly * side(t, from);
        } else if re < 0.0 && im.abs() < hardly {
            // Hardly off the triangle: which side it is decides by half a turn, and rays must agree with that.
            im = im.abs().max(1e-9 * hardly) * side(t, from);
        }
        let size = re.abs() + im.abs();
        if size.is_nan() || size <= 0.0 {
            // The point is a corner.
            return;
        }
        let (re, im) = (re / size, im / size);
        let product = (self.re * re - self.im * im, self.re * im + self.im * re);
        if self.im >= 0.0 && im >= 0.0 && product.1 < 0.0 {
            self.rounds += 1.0;
        } else if self.im < 0.0 && im < 0.0 && product.1 >= 0.0 {
            self.rounds -= 1.0;
        }
        let size = product.0.abs() + product.1.abs();
        (self.re, self.im) = (product.0 / size, product.1 / size);
    }

    /// In full turns, a sphere's solid angle being one.
    pub(super) fn turns(&self) -> f64 {
        self.rounds + argument(self.re, self.im)
    }
}

/// As many [`Angle`]s as there are points.
pub(super) struct Angles {
    re: [f64; WIDTH],
    im: [f64; WIDTH],
    rounds: [f64; WIDTH],
}

impl Default for Angles {
    fn default() -> Self {
        Self { re: [1.0; WIDTH], im: [0.0; WIDTH], rounds: [0.0; WIDTH] }
    }
}

impl Angles {
    /// Adds a triangle as seen from those points that take part.
    #[inline(always)]
    pub(super) fn add(&mut self, t: &Corners, points: &Lanes, takes_part: [bool; WIDTH]) {
        let corners = t.map(place);
        let mut is_odd = [false; WIDTH];
        for l in 0..WIDTH {
            let from = points.get(l);
            let (re, im, hardly) = half_angle(corners[0] - from, corners[1] - from, corners[2] - from);
            let size = re.abs() + im.abs();
            let odd = (size < hardly) | ((re < 0.0) & (im.abs() < hardly)) | size.is_nan() | (size <= 0.0);
            let (re, im) = (re / size, im / size);
            let product = (self.re[l] * re - self.im[l] * im, self.re[l] * im + self.im[l] * re);
            let up = (self.im[l] >= 0.0) & (im >= 0.0) & (product.1 < 0.0);
            let down = (self.im[l] < 0.0) & (im < 0.0) & (product.1 >= 0.0);
            let turned = (if up { 1.0 } else { 0.0 }) - (if down { 1.0 } else { 0.0 });
            let size = product.0.abs() + product.1.abs();
            let counts = takes_part[l] & !odd;
            self.re[l] = if counts { product.0 / size } else { self.re[l] };
            self.im[l] = if counts { product.1 / size } else { self.im[l] };
            self.rounds[l] = if counts { self.rounds[l] + turned } else { self.rounds[l] };
            is_odd[l] = takes_part[l] & odd;
        }
        if is_odd.contains(&true) {
            (0..WIDTH).filter(|l| is_odd[*l]).for_each(|l| self.add_odd(t, l, points.get(l)));
        }
    }

    /// Adds a triangle of which it is close on which side a point is.
    #[cold]
    fn add_odd(&mut self, t: &Corners, l: usize, from: DVec3) {
        let mut angle = Angle { re: self.re[l], im: self.im[l], rounds: self.rounds[l] };
        angle.add(t, from);
        (self.re[l], self.im[l], self.rounds[l]) = (angle.re, angle.im, angle.rounds);
    }

    pub(super) fn turns(&self) -> [f64; WIDTH] {
        std::array::from_fn(|l| Angle { re: self.re[l], im: self.im[l], rounds: self.rounds[l] }.turns())
    }
}

/// The complex number of a triangle as it is seen from the origin, and below what it is next to nothing.
#[inline(always)]
fn half_angle(a: DVec3, b: DVec3, c: DVec3) -> (f64, f64, f64) {
    let (x, y, z) = (a.length(), b.length(), c.length());
    let (re, im) = (x * y * z + a.dot(b) * z + b.dot(c) * x + c.dot(a) * y, a.dot(b.cross(c)));
    (re, im, 1e-9 * x * y * z)
}

/// 1 from within, −1 from without; a point in a triangle's plane counts as above it, as it does for a ray upwards.
fn side(t: &Corners, from: DVec3) -> f64 {
    let at = |p: DVec3| robust::Coord3D { x: p.x, y: p.y, z: p.z };
    let [a, b, c] = t.map(place);
    let below = robust::orient3d(at(a), at(b), at(c), at(from));
    if below != 0.0 { below.signum() } else { -(b - a).cross(c - a).z.signum() }
}

/// The argument of a complex number in turns, from −½ to ½; to some 10⁻¹⁰.
pub(super) fn argument(re: f64, im: f64) -> f64 {
    let (small, large) = if im.abs() > re.abs() { (re.abs(), im.abs()) } else { (im.abs(), re.abs()) };
    let t = small / large;
    // Beyond an eighth of a right angle or so, what is left to a quarter of a half turn.
    let (base, t) = if t > 0.414 { (std::f64::consts::FRAC_PI_4, (t - 1.0) / (t + 1.0)) } else { (0.0, t) };
    let square = t * t;
    let series = (0..12).rev().fold(0.0, |sum, k| {
        let odd = f64::from(2 * k + 1);
        (if k % 2 == 0 { 1.0 } else { -1.0 }) / odd + square * sum
    });
    let mut angle = base + t * series;
    if im.abs() > re.abs() {
        angle = std::f64::consts::FRAC_PI_2 - angle;
    }
    if re < 0.0 {
        angle = std::f64::consts::PI - angle;
    }
    (if im < 0.0 { -angle } else { angle }) / (2.0 * std::f64::consts::PI)
}
