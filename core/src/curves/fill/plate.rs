//! Thin plates: the height of least bending through points, and what rings of points lack beside it by mean values.
//!
//! Based on: J. Duchon, *Splines minimizing rotation-invariant semi-norms in Sobolev spaces*, 1977 (the function `r² log r`).

use super::linear::solve_dense;
use super::weights::{self, Ring};

/// Points of rings that the plate goes through, at most: the system is dense.
const MOST: usize = 120;

/// Heights over a plane between rings of points.
#[derive(Clone, Debug)]
pub(super) struct Plate {
    /// Rings with what their heights are beside the plate.
    rest: Vec<Ring>,
    /// Places, and how much each one pulls.
    pulls: Vec<([f64; 2], f64)>,
    /// Height at the origin, and slopes.
    plane: [f64; 3],
    /// Places are divided by this.
    size: f64,
}

impl Plate {
    /// Of rings, of which places are chosen evenly. O(points + 120³).
    pub(super) fn new(rings: Vec<Ring>) -> Self {
        let all: Vec<([f64; 2], f64)> = rings.iter().flatten().copied().collect();
        let size = all.iter().fold(0.0_f64, |most, ([x, y], _)| most.max(x.abs()).max(y.abs()));
        let mut plate = Self { rest: rings, pulls: Vec::new(), plane: [0.0; 3], size };
        let chosen = chosen(&all);
        if size > 0.0 {
            plate.bend(&chosen);
        }
        let rest: Vec<Ring> =
            plate.rest.iter().map(|ring| ring.iter().map(|(at, high)| (*at, high - plate.smooth(*at))).collect()).collect();
        plate.rest = rest;
        plate
    }

    /// Solves for the pulls; without a solution, there are none.
    fn bend(&mut self, chosen: &[([f64; 2], f64)]) {
        let count = chosen.len();
        let places: Vec<[f64; 2]> = chosen.iter().map(|(at, _)| at.map(|x| x / self.size)).collect();
        let mut rows = vec![vec![0.0; count + 4]; count + 3];
        for (i, (a, (_, high))) in places.iter().zip(chosen).enumerate() {
            for (j, b) in places.iter().enumerate() {
                rows[i][j] = kernel(*a, *b);
            }
            for (k, value) in [1.0, a[0], a[1]].into_iter().enumerate() {
                rows[i][count + k] = value;
                rows[count + k][i] = value;
            }
            rows[i][count + 3] = *high;
        }
        if let Some(solved) = solve_dense(rows) {
            self.pulls = places.into_iter().zip(solved.iter().copied()).collect();
            self.plane = [0, 1, 2].map(|k| solved.get(count + k).copied().unwrap_or_default());
        }
    }

    fn smooth(&self, place: [f64; 2]) -> f64 {
        let at = place.map(|x| x / self.size.max(f64::MIN_POSITIVE));
        let [c, x, y] = self.plane;
        self.pulls.iter().fold(c + x * at[0] + y * at[1], |sum, (other, pull)| sum + pull * kernel(at, *other))
    }

    /// The height at a place; those of rings at their places. O(points).
    pub(super) fn height(&self, place: [f64; 2]) -> f64 {
        self.smooth(place) + weights::height(&self.rest, place)
    }
}

/// Places at even distances in their order; all if they are few.
fn chosen(all: &[([f64; 2], f64)]) -> Vec<([f64; 2], f64)> {
    if all.len() <= MOST {
        return all.to_vec();
    }
    let step = |pair: &[([f64; 2], f64)]| (pair[0].0[0] - pair[1].0[0]).hypot(pair[0].0[1] - pair[1].0[1]);
    let whole: f64 = all.windows(2).map(step).sum();
    let (mut along, mut next) = (0.0, 0.0);
    let mut chosen = Vec::with_capacity(MOST);
    for (number, one) in all.iter().enumerate() {
        along += number.checked_sub(1).and_then(|before| all.get(before..=number)).map_or(0.0, step);
        if along >= next && chosen.len() < MOST {
            chosen.push(*one);
            next = along + whole / MOST as f64;
        }
    }
    chosen
}

/// `r² log r`.
fn kernel(a: [f64; 2], b: [f64; 2]) -> f64 {
    let (x, y) = (a[0] - b[0], a[1] - b[1]);
    let squared = x * x + y * y;
    if squared > 0.0 { 0.5 * squared * squared.ln() } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A plane stays one, rings keep their heights, and half a wave is met better than by mean values alone.
    #[test]
    fn plates_go_through_their_rings() {
        let ring = |height: &dyn Fn([f64; 2]) -> f64| -> Ring {
            let around = (0..200).map(|at| f64::from(at) / 200.0 * std::f64::consts::TAU);
            around.map(|angle| [2.0 * angle.cos(), angle.sin()]).map(|at| (at, height(at))).collect()
        };
        let plane = |[x, y]: [f64; 2]| 1.0 + 2.0 * x - y;
        assert!((Plate::new(vec![ring(&plane)]).height([0.3, 0.2]) - plane([0.3, 0.2])).abs() < 1e-9);
        let wave = |[x, _]: [f64; 2]| (0.7 * x).cos();
        let plate = Plate::new(vec![ring(&wave)]);
        for at in [[0.0, 0.0], [0.5, 0.4], [-1.0, 0.2]] {
            let [smooth, mean] = [plate.height(at), weights::height(&[ring(&wave)], at)].map(|high| (high - wave(at)).abs());
            assert!(smooth < 0.5 * mean, "{smooth} {mean}");
        }
    }
}
