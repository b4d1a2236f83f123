//! The λ|μ filter (Taubin, "A signal processing approach to fair surface design", SIGGRAPH 1995) with equal weights, and how often it is to be used.
//!
//! One pass goes by λ towards the mean of the neighbours, and then by μ away from it. The part of the surface for which the mean is off by k times its
//! height is multiplied by (1 − λk)(1 − μk). On an even mesh of equilateral triangles with edges h, a wave of length L along an edge has
//! k = 1 − (cos q + 2 cos(q∕2))∕3 with q = 2πh∕L, of the six neighbours. Waves with k up to 1∕λ + 1∕μ are kept: they are not made smaller at all.

use glam::DVec3;
use rayon::prelude::*;

/// The step in, and the step out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Filter {
    /// λ, above 0.
    pub lambda: f64,
    /// μ, below −λ.
    pub mu: f64,
}

impl Default for Filter {
    /// λ = 0.6, μ = −0.638: waves with k up to 0.0993 are kept.
    fn default() -> Self {
        Self { lambda: 0.6, mu: -0.638 }
    }
}

/// Of the frequency of waves that are to go, the band that is kept. Longer waves are made larger: N passes that leave a share of the waves multiply them by
/// (1 + λ²b²∕4)ᴺ at most, with b the band, which is about 1 − ln(share) · 0.0028.
const BAND: f64 = 0.1;

impl Filter {
    /// The filter for waves of this length, in mean edges: λ = 0.6, and μ so that longer ones are kept. None where waves are shorter than two edges.
    pub(crate) fn of_waves(wavelength: f64) -> Option<Self> {
        let usual = Self::default();
        let widest = 1.0 / usual.lambda + 1.0 / usual.mu;
        let band = (BAND * frequency(wavelength)?).min(widest);
        Some(Self { lambda: usual.lambda, mu: 1.0 / (band - 1.0 / usual.lambda) })
    }

    /// The factor of a pass.
    pub(crate) fn transfer(&self, k: f64) -> f64 {
        (1.0 - self.lambda * k) * (1.0 - self.mu * k)
    }

    /// How many passes leave no more than `share` of a wave of this length, in mean edges. None where the wave is kept, or is shorter than two edges.
    pub(crate) fn passes(&self, wavelength: f64, share: f64) -> Option<usize> {
        let factor = self.transfer(frequency(wavelength)?).abs();
        if !(share > 0.0 && share < 1.0 && factor < 1.0) {
            return None;
        }
        Some(if factor == 0.0 { 1 } else { (share.ln() / factor.ln()).ceil().max(1.0) as usize })
    }

    /// Positions after so many passes. Neighbours of vertex v: `neighbours[starts[v]..starts[v + 1]]`; a vertex without any stays. The same for any number of threads.
    pub(super) fn pass(&self, points: &mut Vec<DVec3>, starts: &[u32], neighbours: &[u32], passes: usize) {
        let mut other = points.clone();
        for step in (0..passes).flat_map(|_| [self.lambda, self.mu]) {
            let from: &[DVec3] = points;
            other.par_iter_mut().enumerate().with_min_len(1 << 12).for_each(|(v, to)| {
                let own = neighbours.get(starts[v] as usize..starts[v + 1] as usize).unwrap_or_default();
                let sum = own.iter().fold(DVec3::ZERO, |sum, w| sum + from[*w as usize]);
                *to = if own.is_empty() { from[v] } else { from[v] + step * (sum / own.len() as f64 - from[v]) };
            });
            std::mem::swap(points, &mut other);
        }
    }
}

/// k of a wave of this length, in mean edges; at least two.
pub(crate) fn frequency(wavelength: f64) -> Option<f64> {
    let q = std::f64::consts::TAU / wavelength;
    (wavelength >= 2.0).then(|| 1.0 - (q.cos() + 2.0 * (0.5 * q).cos()) / 3.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn passes_follow_from_the_wave() {
        let filter = Filter::default();
        // A wave of four edges: q is a right angle, k = 1 − (0 + √2)∕3.
        let k = 1.0 - 2.0_f64.sqrt() / 3.0;
        assert!((frequency(4.0).unwrap() - k).abs() < 1e-15);
        let factor = (1.0 - 0.6 * k) * (1.0 + 0.638 * k);
        let passes = filter.passes(4.0, 0.2).unwrap();
        assert!(factor.powi(passes as i32) <= 0.2 && factor.powi(passes as i32 - 1) > 0.2);
        assert_eq!(filter.passes(40.0, 0.2), None, "in the band that is kept");
        assert_eq!(filter.passes(1.5, 0.2), None, "a mesh has no such wave");
    }

    /// A ring of vertices with two neighbours each: there k is 1 − cos(2π∕n) for a wave of n vertices.
    #[test]
    fn a_wave_is_multiplied_by_the_transfer_function() {
        let (n, wave) = (24_u32, 6.0);
        let height = |i: u32| (f64::from(i) * std::f64::consts::TAU / wave).cos();
        let mut points: Vec<DVec3> = (0..n).map(|i| DVec3::new(0.0, 0.0, height(i))).collect();
        let starts: Vec<u32> = (0..=n).map(|i| 2 * i).collect();
        let neighbours: Vec<u32> = (0..n).flat_map(|i| [(i + 1) % n, (i + n - 1) % n]).collect();
        let filter = Filter::default();
        filter.pass(&mut points, &starts, &neighbours, 3);
        let factor = filter.transfer(1.0 - (std::f64::consts::TAU / wave).cos()).powi(3);
        assert!((0..n).all(|i| (points[i as usize].z - factor * height(i)).abs() < 1e-12));
    }
}
