//! Planes of triangles, and where lines and planes meet: by short integers where these are enough, else by long ones.

use std::sync::OnceLock;

use crate::geometry::arrange::point::{Corner, Int, Point};
use crate::geometry::arrange::small::Small;
use crate::geometry::arrange::wide::{View, WORDS, Wide, product};

/// Words of products of a plane's numbers and a point's.
const TWICE: usize = 2 * WORDS;

/// The plane of a triangle.
#[derive(Debug)]
pub(crate) struct Plane {
    corners: [Corner; 3],
    small: Option<Small>,
    long: OnceLock<Box<Long>>,
    near: Near,
    /// The axis along which its normal is longest; of equal ones the last.
    pub(crate) axis: usize,
}

impl Plane {
    pub(crate) fn of(corners: &[Corner; 3]) -> Self {
        let (small, long) = (Small::of(corners), OnceLock::new());
        let longest = |normal: [Int; 3]| {
            let absolute = |k: usize| if normal[k].sign() < 0 { normal[k].negated() } else { normal[k] };
            (1..3).fold(0, |best, k| if absolute(k).cmp(&absolute(best)).is_ge() { k } else { best })
        };
        let axis = match &small {
            Some(Small { normal, .. }) => {
                let absolute = normal.map(i128::unsigned_abs);
                (1..3).fold(0, |best, k| if absolute[k] >= absolute[best] { k } else { best })
            }
            None => longest(long.get_or_init(|| Box::new(Long::of(corners))).normal),
        };
        Self { corners: *corners, small, long, near: Near::of(corners), axis }
    }

    fn long(&self) -> &Long {
        self.long.get_or_init(|| Box::new(Long::of(&self.corners)))
    }

    /// Does its normal look along its axis, or against it?
    pub(crate) fn looks_along(&self) -> bool {
        match &self.small {
            Some(small) => small.normal[self.axis] > 0,
            None => self.long().normal[self.axis].sign() > 0,
        }
    }

    /// The side of a point, exactly.
    pub(crate) fn side(&self, p: &Point) -> i8 {
        match self.near.side(p) {
            0 => self.long().side(p),
            sign => sign,
        }
    }
}

/// A plane in floating point.
#[derive(Debug)]
struct Near {
    through: [f64; 3],
    normal: [f64; 3],
    /// The same of magnitudes.
    size: [f64; 3],
}

impl Near {
    fn of(t: &[Corner; 3]) -> Self {
        let less = |a: &Corner| -> [f64; 3] { std::array::from_fn(|k| (a[k] - t[0][k]) as f64) };
        let (u, v) = (less(&t[1]), less(&t[2]));
        let products = |k: usize| (u[(k + 1) % 3] * v[(k + 2) % 3], u[(k + 2) % 3] * v[(k + 1) % 3]);
        Self {
            through: t[0].map(|x| x as f64),
            normal: std::array::from_fn(|k| products(k).0 - products(k).1),
            size: std::array::from_fn(|k| products(k).0.abs() + products(k).1.abs()),
        }
    }

    /// The side of a point; 0 also if in doubt.
    fn side(&self, p: &Point) -> i8 {
        let (mut value, mut error) = (0.0, 0.0);
        for k in 0..3 {
            let away = p.high[k] - self.through[k];
            value += self.normal[k] * away;
            // Some ten are rounded, by 2⁻⁵³ each, and where the point is, too.
            error += self.size[k] * (16.0 * away.abs() + 2.0 * p.high[k].abs() + 2.0 * self.through[k].abs());
        }
        let error = error * (0.5 * f64::EPSILON);
        i8::from(value > error) - i8::from(value < -error)
    }
}

/// n · x = d.
#[derive(Debug)]
struct Long {
    normal: [Int; 3],
    offset: Int,
}

fn difference(a: &Corner, b: &Corner) -> [Int; 3] {
    std::array::from_fn(|k| Int::of(a[k] - b[k]))
}

fn minor(a: &Int, b: &Int, c: &Int, d: &Int) -> Int {
    let (p, q): (Int, Int) = (a.times(d), b.times(c));
    p.minus(&q)
}

fn cross(u: &[Int; 3], v: &[Int; 3]) -> [Int; 3] {
    [minor(&u[1], &u[2], &v[1], &v[2]), minor(&u[2], &u[0], &v[2], &v[0]), minor(&u[0], &u[1], &v[0], &v[1])]
}

fn dot<const M: usize>(u: &[Int; 3], v: &[Int; 3]) -> Wide<M> {
    let [a, b, c]: [Wide<M>; 3] = std::array::from_fn(|k| u[k].times(&v[k]));
    a.plus(&b).plus(&c)
}

fn dot_views<const M: usize>(u: &[Int; 3], v: [View<'_>; 3]) -> Wide<M> {
    let [a, b, c]: [Wide<M>; 3] = std::array::from_fn(|k| product(u[k].view(), v[k]));
    a.plus(&b).plus(&c)
}

impl Long {
    fn of(t: &[Corner; 3]) -> Self {
        Self::with(cross(&difference(&t[1], &t[0]), &difference(&t[2], &t[0])), &t[0])
    }

    /// Through an edge, and along an axis.
    fn upright([a, b]: &[Corner; 2], axis: usize) -> Self {
        let mut up = [0; 3];
        up[axis] = 1;
        Self::with(cross(&difference(b, a), &up.map(Int::of)), a)
    }

    fn with(normal: [Int; 3], through: &Corner) -> Self {
        let offset = dot(&normal, &through.map(Int::of));
        // In units that are small for one corner's sake most numbers end in many zeros.
        let power = normal.iter().map(Int::zeros).min().unwrap_or(0).min(offset.zeros());
        if power == 0 || power == u32::MAX {
            return Self { normal, offset };
        }
        Self { normal: normal.map(|x| x.without(power)), offset: offset.without(power) }
    }

    fn side(&self, p: &Point) -> i8 {
        let right: Wide<TWICE> = product(self.offset.view(), p.part(3));
        dot_views::<TWICE>(&self.normal, [p.part(0), p.part(1), p.part(2)]).minus(&right).sign()
    }

    /// Where the line through two corners meets it.
    fn meets(&self, [a, b]: &[Corner; 2]) -> Option<Point> {
        let along = difference(b, a);
        let w: Int = dot(&self.normal, &along);
        if w.sign() == 0 {
            return None;
        }
        let start = a.map(Int::of);
        let far = self.offset.minus(&dot(&self.normal, &start));
        let x = std::array::from_fn(|k| {
            let (p, q): (Int, Int) = (start[k].times(&w), along[k].times(&far));
            p.plus(&q)
        });
        Some(Point::new(&x, &w))
    }
}

/// Where the line through two corners meets a plane; `None` if they are parallel.
pub(crate) fn on_line(edge: &[Corner; 2], plane: &Plane) -> Option<Point> {
    match plane.small.as_ref().and_then(|small| small.meets(edge)) {
        Some(found) => found,
        None => plane.long().meets(edge),
    }
}

/// Where two lines through corners meet that lie in one plane, seen along an axis that is not in it.
pub(crate) fn on_lines(first: &[Corner; 2], second: &[Corner; 2], axis: usize) -> Option<Point> {
    match Small::upright(second, axis).meets(first) {
        Some(found) => found,
        None => Long::upright(second, axis).meets(first),
    }
}

/// +1 if the cross product of two normals is positive along an axis; of axes one along which it is not zero.
pub(crate) fn across(a: &Plane, b: &Plane) -> Option<(usize, i8)> {
    let (u, v) = (&a.near, &b.near);
    let along = |k: usize| {
        let (x, y) = ((k + 1) % 3, (k + 2) % 3);
        let value = u.normal[x] * v.normal[y] - u.normal[y] * v.normal[x];
        // Each factor is rounded three times, by 2⁻⁵³ of its size.
        let error = (u.size[x] * v.size[y] + u.size[y] * v.size[x]) * (8.0 * f64::EPSILON);
        (value.abs() > error).then_some((k, if value > 0.0 { 1 } else { -1 }))
    };
    let exactly = || {
        let along = cross(&a.long().normal, &b.long().normal);
        (0..3).map(|k| (k, along[k].sign())).find(|(_, sign)| *sign != 0)
    };
    (0..3).find_map(along).or_else(exactly)
}

/// Where three planes meet; `None` if that is no single point.
pub(crate) fn on_planes(a: &Plane, b: &Plane, c: &Plane) -> Option<Point> {
    let [a, b, c] = [a, b, c].map(Plane::long);
    let parts = [cross(&b.normal, &c.normal), cross(&c.normal, &a.normal), cross(&a.normal, &b.normal)];
    let w: Int = dot(&a.normal, &parts[0]);
    if w.sign() == 0 {
        return None;
    }
    let x = std::array::from_fn(|k| dot(&[a.offset, b.offset, c.offset], &[parts[0][k], parts[1][k], parts[2][k]]));
    Some(Point::new(&x, &w))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Corners of few bits and of many, near to each other and not.
    fn corners<const N: usize>() -> impl Strategy<Value = [Corner; N]> {
        let corner = prop::array::uniform3((-(1_i128 << 24)..1 << 24, 0_u32..6)).prop_map(|p| p.map(|(x, by)| x << by));
        let flat = prop::array::uniform3(-3_i128..4);
        prop_oneof![
            prop::collection::vec(corner, N),
            prop::collection::vec(flat, N),
            prop::collection::vec(prop::array::uniform3(-(1_i128 << 90)..1 << 90), N),
        ]
        .prop_flat_map(|all| (Just(all), 0_u32..9))
        .prop_map(|(all, by)| std::array::from_fn(|i| all[i].map(|x| x << by)))
    }

    proptest! {
        #[test]
        fn short_integers_say_what_long_ones_say([a, b, c, from, to] in corners::<5>()) {
            let t = [a, b, c];
            let long = Long::of(&t);
            prop_assume!(long.normal.iter().any(|x| x.sign() != 0));
            let plane = Plane::of(&t);
            prop_assert_eq!(plane.looks_along(), long.normal[plane.axis].sign() > 0);
            for p in [from, to, a].map(|p| Point::corner(&p)) {
                prop_assert_eq!(plane.side(&p), long.side(&p));
            }
            let found = [on_line(&[from, to], &plane), long.meets(&[from, to])];
            prop_assert_eq!(found[0].is_some(), found[1].is_some());
            if let [Some(short), Some(long)] = found {
                prop_assert!(short.is(&long) && long.is(&short));
                prop_assert_eq!((short.high, short.exact), (long.high, long.exact));
                prop_assert_eq!(plane.side(&short), 0);
                prop_assert!((0..3).all(|k| (short.low[k] - long.low[k]).abs() <= short.high[k].abs() / (1_u128 << 99) as f64));
            }
        }

        #[test]
        fn planes_that_cross_do_so_along_the_product_of_their_normals([a, b, c, d, e, f] in corners::<6>()) {
            let (one, other) = (Plane::of(&[a, b, c]), Plane::of(&[d, e, f]));
            let along = cross(&one.long().normal, &other.long().normal);
            match across(&one, &other) {
                Some((axis, sign)) => prop_assert_eq!(along[axis].sign(), sign),
                None => prop_assert!(along.iter().all(|x| x.sign() == 0)),
            }
        }
    }
}
