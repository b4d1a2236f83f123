//! Triangles made better in space: edges flipped, places moved, edges split.

use super::lifted::Lifted;
use super::mesh::of_triangle;
use crate::curves::vector::{Point, cross, plain_distance, plain_norm, sub};
use crate::util::each::Each;

/// Rounds, at most.
const ROUNDS: u32 = 5;
/// Passes over all edges that may flip in a round, at most.
const FLIPS: u32 = 4;
/// Triangles below this are made better.
const WANTED: f64 = 0.5;
/// Edges of triangles below this may be flipped.
const FLIPPED: f64 = 0.5;
/// Triangles below this are split at last.
const POOR: f64 = 0.42;

/// Triangles with their points in space; neighbours are not kept up.
#[derive(Debug)]
pub(super) struct Improved<'a> {
    pub(super) lifted: Lifted<'a>,
}

impl<'a> Improved<'a> {
    pub(super) fn new(lifted: Lifted<'a>) -> Self {
        Self { lifted }
    }

    fn place(&self, place: [f64; 2]) -> Point {
        self.lifted.lift(place)
    }

    fn point(&self, number: u32) -> Point {
        self.lifted.point(number)
    }

    fn quality(&self, [a, b, c]: [u32; 3]) -> f64 {
        of_triangle(self.point(a), self.point(b), self.point(c))
    }

    /// Twice the area of a triangle of places.
    fn area(&self, numbers: [u32; 3]) -> f64 {
        self.lifted.area(numbers)
    }

    /// Makes triangles better until none is poor that can be helped, by no more than `most` new places and a quarter of those
    /// that there are. O(triangles · log) a round, at most 5 rounds.
    pub(super) fn run(&mut self, most: usize) {
        let most = self.lifted.points.len() + most.min(self.lifted.points.len() / 4 + 4);
        for round in 0..ROUNDS {
            let qualities = self.qualities();
            // After the first round, what is left of those that are not poor is not worth a round.
            let enough = POOR;
            if qualities.iter().all(|quality| *quality >= enough) {
                return;
            }
            let flipped = self.flip(qualities);
            let moved = self.smooth();
            let split = (2..4).contains(&round) && self.split(most);
            if !(flipped || moved || split) {
                return;
            }
        }
        self.flip(self.qualities());
    }

    /// Edges within of triangles that are below a quality, each with its triangles and the places of its opposite corners there.
    fn edges(&self, qualities: &[f64], below: f64) -> Vec<[(usize, usize); 2]> {
        let mut is_near = vec![false; self.lifted.points.len()];
        for (triangle, quality) in self.lifted.flat.triangles.iter().zip(qualities) {
            if *quality < below {
                triangle.iter().for_each(|corner| is_near[*corner as usize] = true);
            }
        }
        let mut halves = Vec::new();
        for (number, triangle) in self.lifted.flat.triangles.iter().enumerate() {
            for (corner, [a, b]) in [[1, 2], [2, 0], [0, 1]].into_iter().enumerate() {
                let (a, b) = (triangle[a], triangle[b]);
                if is_near[a as usize] && is_near[b as usize] {
                    halves.push((a.min(b), a.max(b), number, corner));
                }
            }
        }
        halves.sort_unstable();
        let pairs = halves.windows(2).filter(|pair| (pair[0].0, pair[0].1) == (pair[1].0, pair[1].1));
        let worse = |pair: &&[(u32, u32, usize, usize)]| qualities[pair[0].2].min(qualities[pair[1].2]) < below;
        pairs.filter(worse).map(|pair| [(pair[0].2, pair[0].3), (pair[1].2, pair[1].3)]).collect()
    }

    fn qualities(&self) -> Vec<f64> {
        self.lifted.flat.triangles.iter().map(|triangle| self.quality(*triangle)).collect()
    }

    /// The corners around an edge: its left opposite one, its start, its right opposite one, its end.
    fn around(&self, [(first, corner), (second, other)]: [(usize, usize); 2]) -> Option<[u32; 4]> {
        let (left, right) = (self.lifted.flat.triangles.get(first)?, self.lifted.flat.triangles.get(second)?);
        Some([left[corner], left[(corner + 1) % 3], right[other], left[(corner + 2) % 3]])
    }

    /// Flips edges where the worse triangle becomes better; whether any was.
    fn flip(&mut self, mut qualities: Vec<f64>) -> bool {
        let mut is_any = false;
        for _ in 0..FLIPS {
            let mut touched = vec![false; self.lifted.flat.triangles.len()];
            let mut is_changed = false;
            for edge in self.edges(&qualities, FLIPPED) {
                let [(first, _), (second, _)] = edge;
                if touched[first] || touched[second] {
                    continue;
                }
                let Some([p, a, q, b]) = self.around(edge) else { continue };
                let before = qualities[first].min(qualities[second]);
                let pair = [[p, a, q], [q, b, p]];
                let both = pair.each(|one| self.quality(one));
                let after = both[0].min(both[1]);
                let floor = 1e-9 * (self.area([p, a, b]) + self.area([q, b, a]));
                if p != q
                    && after > before + 1e-9
                    && pair.iter().all(|one| self.area(*one) > floor)
                    && self.keeps_side([p, a, q, b])
                {
                    (self.lifted.flat.triangles[first], self.lifted.flat.triangles[second]) = (pair[0], pair[1]);
                    (qualities[first], qualities[second]) = (both[0], both[1]);
                    (touched[first], touched[second]) = (true, true);
                    is_changed = true;
                }
            }
            is_any |= is_changed;
            if !is_changed {
                break;
            }
        }
        is_any
    }

    /// Whether both triangles behind a flip face as those before did.
    fn keeps_side(&self, [p, a, q, b]: [u32; 4]) -> bool {
        let [p, a, q, b] = [p, a, q, b].each(|number| self.point(number));
        let normal = |a: Point, b: Point, c: Point| cross(sub(b, a), sub(c, a));
        let before = crate::curves::vector::add(normal(p, a, b), normal(q, b, a));
        [normal(p, a, q), normal(q, b, p)].into_iter().all(|one| crate::curves::vector::dot(one, before) > 0.0)
    }

    /// Places within that a triangle below what is wanted has, each with all of its triangles.
    fn stars(&self) -> Vec<(usize, Vec<usize>)> {
        let mut numbers = vec![usize::MAX; self.lifted.points.len()];
        for triangle in self.lifted.flat.triangles.iter().filter(|triangle| self.quality(**triangle) < WANTED) {
            triangle.iter().for_each(|corner| numbers[*corner as usize] = 0);
        }
        let mut stars = Vec::new();
        for (place, number) in numbers.iter_mut().enumerate().skip(self.lifted.rim).filter(|(_, number)| **number == 0) {
            *number = stars.len();
            stars.push((place, Vec::new()));
        }
        for (number, triangle) in self.lifted.flat.triangles.iter().enumerate() {
            for corner in triangle.iter().filter(|corner| **corner as usize >= self.lifted.rim) {
                if let Some((_, star)) = stars.get_mut(numbers[*corner as usize]) {
                    star.push(number);
                }
            }
        }
        stars
    }

    fn worst(&self, star: &[usize]) -> f64 {
        star.iter()
            .filter_map(|number| self.lifted.flat.triangles.get(*number))
            .map(|one| self.quality(*one))
            .fold(f64::INFINITY, f64::min)
    }

    /// Moves places within towards the middle of their stars where that makes the worst triangle better; whether any was.
    fn smooth(&mut self) -> bool {
        let mut is_any = false;
        for (number, star) in self.stars() {
            let before = self.worst(&star);
            if before >= WANTED || star.is_empty() {
                continue;
            }
            let (mut sum, mut weight) = ([0.0; 2], 0.0);
            let corners: Vec<[u32; 3]> = star.iter().filter_map(|one| self.lifted.flat.triangles.get(*one)).copied().collect();
            for triangle in &corners {
                // Triangles count by their size in space.
                let [a, b, c] = triangle.each(|corner| self.point(corner));
                let share = plain_norm(cross(sub(b, a), sub(c, a)));
                weight += share;
                for corner in triangle {
                    let [x, y] = self.lifted.flat.places[*corner as usize];
                    sum = [sum[0] + x * share / 3.0, sum[1] + y * share / 3.0];
                }
            }
            let (old, point) = (self.lifted.flat.places[number], self.lifted.points[number]);
            let mut is_better = false;
            for share in [1.0, 0.5, 1.5, 0.2] {
                let towards = |axis: usize| old[axis] + share * (sum[axis] / weight - old[axis]);
                self.lifted.flat.places[number] = [towards(0), towards(1)];
                self.lifted.points[number] = self.place(self.lifted.flat.places[number]);
                is_better = corners.iter().all(|one| self.area(*one) > 0.0) && self.worst(&star) > before + 1e-6;
                if is_better {
                    break;
                }
            }
            if is_better {
                is_any = true;
            } else {
                (self.lifted.flat.places[number], self.lifted.points[number]) = (old, point);
            }
        }
        is_any
    }

    /// Splits the longest edge of poor triangles, if it is within, at its middle; whether any was.
    fn split(&mut self, most: usize) -> bool {
        let mut touched = vec![false; self.lifted.flat.triangles.len()];
        let mut is_any = false;
        let qualities = self.qualities();
        for edge in self.edges(&qualities, POOR) {
            let [(first, _), (second, _)] = edge;
            let Some([p, a, q, b]) = self.around(edge) else { continue };
            let poor = [first, second].each(|number| qualities[number] < POOR);
            let length = |a: u32, b: u32| plain_distance(self.point(a), self.point(b));
            let is_longest = |c: u32| length(a, b) >= length(b, c).max(length(c, a));
            let is_wanted = (poor[0] && is_longest(p)) || (poor[1] && is_longest(q));
            if !is_wanted || self.lifted.points.len() >= most || touched[first] || touched[second] || p == q {
                continue;
            }
            let [[x, y], [u, v]] = [a, b].each(|number| self.lifted.flat.places[number as usize]);
            let middle = self.lifted.points.len() as u32;
            let place = [0.5 * (x + u), 0.5 * (y + v)];
            self.lifted.flat.places.push(place);
            self.lifted.points.push(self.place(place));
            (self.lifted.flat.triangles[first], self.lifted.flat.triangles[second]) = ([p, a, middle], [q, b, middle]);
            self.lifted.flat.triangles.extend([[p, middle, b], [q, middle, a]]);
            (touched[first], touched[second]) = (true, true);
            is_any = true;
        }
        is_any
    }
}

#[cfg(test)]
mod tests {
    use super::super::chart::Chart;
    use super::super::triangles::Flat;
    use super::*;
    use crate::curves::elementary::Frame;

    #[test]
    fn an_even_triangle_is_1_and_a_flat_one_0() {
        let even = of_triangle([0.0; 3], [1.0, 0.0, 0.0], [0.5, 0.75_f64.sqrt(), 0.0]);
        assert!((even - 1.0).abs() < 1e-12);
        assert_eq!(of_triangle([0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]), 0.0);
    }

    /// Two flat triangles over the long diagonal of a rhomb, 0.2 each: flipped, they are 0.87.
    #[test]
    fn a_rhomb_is_flipped() {
        let chart = Chart::Plane(Frame { origin: [0.0; 3], axes: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]] });
        let places = vec![[-3.0, 0.0], [0.0, -1.0], [3.0, 0.0], [0.0, 1.0]];
        let rim = places.iter().map(|[x, y]| [*x, *y, 0.0]).collect();
        let flat = Flat { places, triangles: vec![[0, 1, 2], [0, 2, 3]] };
        let mut lifted = Lifted::new(flat);
        lifted.raise(rim, &chart, false);
        let mut improved = Improved::new(lifted);
        improved.run(0);
        assert!(improved.lifted.flat.triangles.iter().all(|one| improved.quality(*one) > 0.8));
        assert!(improved.lifted.flat.triangles.iter().all(|one| improved.area(*one) > 0.0));
    }
}
