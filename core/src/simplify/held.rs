//! Vertices that are held back: those that stay, and those for which less is aimed at, since the deviation was missed there.

use crate::simplify::cell::LIMITS;
use crate::simplify::task::Input;

/// Vertices that are held back, and more of them with each attempt.
pub(super) struct Held {
    pub(super) fixed: Vec<bool>,
    /// By which of the limits vertices are judged.
    pub(super) strict: Vec<u8>,
    pub(super) attempt: usize,
    /// For which less is aimed at since the last attempt.
    pub(super) is_raised: Vec<bool>,
}

impl Held {
    /// Only what may not change, at first.
    pub(super) fn new(input: &Input<'_>) -> Self {
        let count = input.points.len();
        Self { fixed: fixed(input), strict: vec![0; count], attempt: 0, is_raised: vec![false; count] }
    }

    /// All are free again but what may not change, for all is to be done anew.
    pub(super) fn free(&mut self, input: &Input<'_>) {
        *self = Self { attempt: self.attempt, ..Self::new(input) };
    }

    /// Less is aimed at for the vertices of triangles that went too far, by as much as they did, and for more around them each time.
    pub(super) fn hold(&mut self, input: &Input<'_>, far: &[(u32, f64)], most: f64) {
        // By how many limits each vertex is judged more strictly; each one is of half the distance of the one before.
        let mut more = vec![0_u8; self.fixed.len()];
        for (f, bound) in far {
            let halves = (bound / most).log2().ceil().clamp(1.0, LIMITS as f64) as u8;
            input.faces[*f as usize].into_iter().for_each(|v| more[v as usize] = more[v as usize].max(halves));
        }
        for _ in 0..=self.attempt {
            let before = more.clone();
            for face in input.faces {
                let most = face.iter().map(|v| before[*v as usize]).fold(0, u8::max);
                face.iter().for_each(|v| more[*v as usize] = more[*v as usize].max(most));
            }
        }
        self.is_raised = more.iter().map(|more| *more > 0).collect();
        for ((fixed, strict), more) in self.fixed.iter_mut().zip(&mut self.strict).zip(more) {
            *strict = strict.saturating_add(more);
            *fixed |= usize::from(*strict) >= LIMITS;
        }
        self.attempt += 1;
    }
}

/// Vertices that stay as they are: those of faces that may not change.
fn fixed(input: &Input<'_>) -> Vec<bool> {
    let mut fixed = vec![false; input.points.len()];
    if let Some(own) = input.fixed {
        fixed.iter_mut().zip(own).for_each(|(fixed, own)| *fixed = *own);
    }
    if let Some(region) = input.region {
        for (f, face) in input.faces.iter().enumerate() {
            if !region.get(f).copied().unwrap_or(false) {
                face.iter().for_each(|v| fixed[*v as usize] = true);
            }
        }
    }
    fixed
}
