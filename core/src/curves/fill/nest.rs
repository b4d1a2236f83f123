//! Loops within others in the same plane: the outlines of holes.

use super::options::Outline;
use crate::curves::Use;
use crate::curves::curve::Shape;
use crate::curves::vector::{Point, add, cross, distance, dot, norm, scale, sub, unit};

/// Points of each curve that tell where a loop lies.
const SAMPLES: u32 = 8;
/// A loop lies in a plane, and two lie in the same one, within this share of their sizes.
const FLAT: f64 = 1e-5;

/// A loop in a plane.
struct Flat {
    number: usize,
    points: Vec<Point>,
    /// Of the plane; its largest coordinate is positive.
    normal: Point,
    offset: f64,
    area: f64,
    size: f64,
    low: Point,
    high: Point,
}

/// Outlines of these loops: a loop that lies within another one of its plane, and shares no curve with it, bounds a hole of that one; one within the hole is
/// an outline again. O(n log n + pairs whose boxes overlap).
pub(super) fn outlines(shapes: &[&Shape], loops: &[Vec<Use>]) -> Vec<Outline> {
    let mut flat: Vec<Flat> = loops.iter().enumerate().filter_map(|(number, uses)| Flat::of(number, shapes, uses)).collect();
    flat.sort_by(|a, b| a.low[0].total_cmp(&b.low[0]).then(a.number.cmp(&b.number)));
    let mut within: Vec<Vec<usize>> = vec![Vec::new(); flat.len()];
    let mut open: Vec<usize> = Vec::new();
    for (at, own) in flat.iter().enumerate() {
        open.retain(|other| flat.get(*other).is_some_and(|other| other.high[0] >= own.low[0]));
        for other in &open {
            let Some(there) = flat.get(*other) else { continue };
            for (inner, outer, place, around) in [(own, there, at, *other), (there, own, *other, at)] {
                if outer.holds(inner) && !share_a_curve(loops, inner.number, outer.number) {
                    within.get_mut(place).into_iter().for_each(|all| all.push(around));
                }
            }
        }
        open.push(at);
    }
    let mut all: Vec<Option<Outline>> =
        loops.iter().map(|uses| Some(Outline { outer: uses.clone(), inner: Vec::new() })).collect();
    for (own, around) in flat.iter().zip(&within) {
        if around.len() % 2 == 0 {
            continue;
        }
        let nearest = around.iter().filter_map(|at| flat.get(*at)).min_by(|a, b| a.area.total_cmp(&b.area));
        let hole = all.get_mut(own.number).and_then(Option::take);
        if let (Some(outer), Some(hole)) = (nearest.and_then(|outer| all.get_mut(outer.number)?.as_mut()), hole) {
            outer.inner.push(hole.outer);
        }
    }
    all.into_iter().flatten().collect()
}

fn share_a_curve(loops: &[Vec<Use>], a: usize, b: usize) -> bool {
    let [a, b] = [a, b].map(|number| loops.get(number).map(Vec::as_slice).unwrap_or_default());
    a.iter().any(|own| b.iter().any(|other| other.curve == own.curve))
}

impl Flat {
    /// `None` if its curves are in no plane.
    fn of(number: usize, shapes: &[&Shape], uses: &[Use]) -> Option<Self> {
        let mut points = Vec::new();
        for one in uses {
            let shape = shapes.get(one.curve)?;
            let [low, high] = shape.domain();
            for k in 0..SAMPLES {
                let share = f64::from(k) / f64::from(SAMPLES);
                let share = if one.is_reversed { 1.0 - share } else { share };
                points.push(shape.point(low + (high - low) * share));
            }
        }
        let (mut lo, mut hi) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        points
            .iter()
            .flat_map(|point| point.iter().enumerate())
            .for_each(|(k, x)| (lo[k], hi[k]) = (lo[k].min(*x), hi[k].max(*x)));
        let size = distance(lo, hi);
        let first = *points.first()?;
        let next = points.iter().cycle().skip(1);
        let twice = points.iter().zip(next).fold([0.0; 3], |sum, (a, b)| add(sum, cross(sub(*a, first), sub(*b, first))));
        let normal = unit(twice)?;
        let largest = normal.into_iter().fold(0.0, |most: f64, x| if x.abs() > most.abs() { x } else { most });
        let normal = scale(normal, largest.signum());
        let offset = dot(normal, first);
        let is_flat = points.iter().all(|point| (dot(normal, *point) - offset).abs() <= FLAT * size);
        is_flat.then(|| Self { number, points, normal, offset, area: norm(twice), size, low: lo, high: hi })
    }

    /// The other loop lies within, in the same plane.
    fn holds(&self, other: &Self) -> bool {
        let room = FLAT * self.size;
        let in_box = (0..3).all(|k| other.low[k] >= self.low[k] - room && other.high[k] <= self.high[k] + room);
        let in_plane = in_box && other.points.iter().all(|point| (dot(self.normal, *point) - self.offset).abs() <= room);
        in_plane
            && other.area < self.area
            && other.points.iter().filter(|point| self.is_around(**point)).count() * 2 > other.points.len()
    }

    /// Does it go around a point of its plane? By the even-odd rule, along the two coordinates in which it is largest.
    fn is_around(&self, [px, py, pz]: Point) -> bool {
        let [nx, ny, nz] = self.normal.map(f64::abs);
        let flat = |[x, y, z]: Point| {
            if nx >= ny && nx >= nz {
                [y, z]
            } else if ny >= nz {
                [x, z]
            } else {
                [x, y]
            }
        };
        let [x, y] = flat([px, py, pz]);
        let next = self.points.iter().cycle().skip(1);
        let crosses = |(a, b): (&Point, &Point)| {
            let ([ax, ay], [bx, by]) = (flat(*a), flat(*b));
            (ay > y) != (by > y) && x < ax + (y - ay) * (bx - ax) / (by - ay)
        };
        self.points.iter().zip(next).filter(|pair| crosses(*pair)).count() % 2 == 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Closed squares around the origin, by half their sizes, at heights.
    fn squares(all: &[(f64, f64)]) -> (Vec<Shape>, Vec<Vec<Use>>) {
        let ring = |(half, z): &(f64, f64)| {
            let corners =
                [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0]].map(|[x, y]| [x * half, y * half, *z]);
            Shape::polyline(corners.to_vec()).unwrap()
        };
        let loops = (0..all.len()).map(|curve| vec![Use { curve, is_reversed: false }]).collect();
        (all.iter().map(ring).collect(), loops)
    }

    #[test]
    fn loops_in_loops_are_holes_by_turns() {
        let (shapes, loops) = squares(&[(1.0, 0.0), (4.0, 0.0), (2.0, 0.0), (1.5, 3.0)]);
        let all = outlines(&shapes.iter().collect::<Vec<_>>(), &loops);
        let told: Vec<(usize, Vec<usize>)> =
            all.iter().map(|own| (own.outer[0].curve, own.inner.iter().map(|hole| hole[0].curve).collect())).collect();
        assert_eq!(told, [(0, vec![]), (1, vec![2]), (3, vec![])]);
    }
}
