//! Curves of a file on their way into a network.

use super::curve::{Curve, Role, Shape};
use super::finding::Findings;
use super::network::Use;
use super::vector::is_finite;

/// Collects curves of a file; those with numbers that are not finite, and those beyond the bound of memory, become findings.
#[derive(Debug, Default)]
pub(crate) struct Collector {
    pub(crate) curves: Vec<Curve>,
    pub(crate) findings: Findings,
    room: u64,
    /// Numbers of curves that may still be fitted, which takes time whether they are kept or not.
    fits: u64,
}

impl Collector {
    /// For a file of so many bytes: the numbers of all curves together are no more than 16 for each byte, which only files that place
    /// the same over and over exceed.
    pub(crate) fn new(bytes: usize) -> Self {
        let room = 16 * bytes as u64 + (1 << 20);
        Self { room, fits: room, ..Self::default() }
    }

    /// Counts a curve that was fitted.
    ///
    /// # Errors
    /// If there are too many; the curve is left out then.
    pub(crate) fn count_fit(&mut self, shape: &Shape) -> Result<(), String> {
        self.fits = self.fits.saturating_sub(shape.size());
        self.may_fit()
    }

    /// Whether another curve may be fitted.
    ///
    /// # Errors
    /// If there are too many of them already.
    pub(crate) fn may_fit(&self) -> Result<(), String> {
        if self.fits == 0 { Err("the file has too many curves that must be fitted".into()) } else { Ok(()) }
    }

    /// Adds a curve; gives its number.
    pub(crate) fn push(&mut self, curve: Curve) -> Option<usize> {
        let line = curve.source.line;
        if !curve.shape.bounds().into_iter().all(is_finite) || !curve.shape.ends().into_iter().all(is_finite) {
            self.findings.add(line, "a curve is not finite", curve.source.id.to_string());
            return None;
        }
        let Some(room) = self.room.checked_sub(curve.shape.size() + 16) else {
            self.findings.add(line, "the file places the same curves too often; left out", curve.source.id.to_string());
            return None;
        };
        self.room = room;
        self.curves.push(curve);
        Some(self.curves.len() - 1)
    }

    /// Makes the curves of a loop edges.
    pub(crate) fn bound(&mut self, uses: &[Use]) {
        for one in uses {
            if let Some(curve) = self.curves.get_mut(one.curve) {
                curve.role = Role::Edge;
            }
        }
    }
}

/// Significant digits of a decimal number, those behind the last one that is not 0 left out.
pub(crate) fn significant(number: &[u8]) -> u32 {
    let mantissa = number.split(|byte| matches!(byte, b'e' | b'E' | b'd' | b'D')).next().unwrap_or_default();
    let (mut digits, mut zeros) = (0, 0);
    for byte in mantissa.iter().filter(|byte| byte.is_ascii_digit()) {
        match byte {
            b'0' if digits > 0 => zeros += 1,
            b'0' => {}
            _ => {
                digits += zeros + 1;
                zeros = 0;
            }
        }
    }
    digits
}
