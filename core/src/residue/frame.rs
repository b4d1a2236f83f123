//! The axes of a path beside those of a mesh: programs write meshes with another axis up, or with axes exchanged.

use std::fmt;
use std::ops::Neg;

use super::found::Fit;
use super::options::Region;

/// Vertices that a frame is tried on, at most.
pub(super) const SAMPLES: usize = 4096;
/// The least share of vertices where the tool left the material ([`Fit::share`]) with which a path counts as the mesh's own.
pub const FIT_LEAST: f64 = 0.5;
/// A frame must touch this share of the sample, at least: a few vertices lie anywhere by chance.
const TOUCHED_LEAST: f64 = 0.01;
/// The next frame must touch less than this share of the vertices that the best one does.
const CLEAR: f64 = 0.5;

/// For each axis of the path, the axis of the mesh that it is, and whether it runs the other way. Coordinates keep their bits, but for their signs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frame {
    axes: [usize; 3],
    is_turned: [bool; 3],
}

impl Frame {
    /// All 48 of them, that of the mesh first.
    pub fn all() -> impl Iterator<Item = Self> {
        let orders = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
        orders.into_iter().flat_map(|axes| (0..8).map(move |bits| Self { axes, is_turned: [1, 2, 4].map(|bit| bits & bit != 0) }))
    }

    /// A point of the mesh in the axes of the path.
    #[must_use]
    pub fn into_path<T: Copy + Neg<Output = T>>(self, point: [T; 3]) -> [T; 3] {
        [0, 1, 2].map(|axis: usize| {
            let x = point[self.axes[axis]];
            if self.is_turned[axis] { -x } else { x }
        })
    }

    /// A point of the path in the axes of the mesh.
    #[must_use]
    pub fn into_mesh(self, point: [f32; 3]) -> [f32; 3] {
        let mut place = [0.0; 3];
        for ((axis, is_turned), x) in self.axes.into_iter().zip(self.is_turned).zip(point) {
            place[axis] = if is_turned { -x } else { x };
        }
        place
    }

    /// A box of the mesh in the axes of the path.
    #[must_use]
    pub fn of_box(self, corners: Region) -> Region {
        let [a, b] = corners.map(|corner| self.into_path(corner));
        [[0, 1, 2].map(|axis: usize| a[axis].min(b[axis])), [0, 1, 2].map(|axis: usize| a[axis].max(b[axis]))]
    }

    /// Whether left and right are exchanged.
    #[must_use]
    pub fn is_mirrored(self) -> bool {
        let is_odd = matches!(self.axes, [0, 2, 1] | [1, 0, 2] | [2, 1, 0]);
        self.is_turned.into_iter().fold(is_odd, |odd, is_turned| odd != is_turned)
    }

    /// A triangle of the mesh as the path sees it, counter-clockwise still.
    #[must_use]
    pub fn face(self, [a, b, c]: [u32; 3]) -> [u32; 3] {
        if self.is_mirrored() { [a, c, b] } else { [a, b, c] }
    }
}

/// As `y, -x, z`: the axes of the mesh that those of the path are.
impl fmt::Display for Frame {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (number, (axis, is_turned)) in self.axes.into_iter().zip(self.is_turned).enumerate() {
            let (comma, sign) = (if number > 0 { ", " } else { "" }, if is_turned { "-" } else { "" });
            write!(formatter, "{comma}{sign}{}", ["x", "y", "z"][axis])?;
        }
        Ok(())
    }
}

/// The one frame that fits a sample; `None` if none does, or several do.
pub(super) fn clear(fits: &[(Frame, Fit)], samples: usize) -> Option<Frame> {
    let mut fitting: Vec<_> = fits.iter().filter(|(_, fit)| fit.share() >= FIT_LEAST).collect();
    fitting.sort_by_key(|(_, fit)| std::cmp::Reverse(fit.touched));
    let (frame, best) = fitting.first()?;
    let next = fitting.get(1).map_or(0, |(_, fit)| fit.touched);
    let is_clear = (next as f64) < CLEAR * best.touched as f64 && best.touched as f64 >= TOUCHED_LEAST * samples as f64;
    is_clear.then_some(*frame)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_different_and_lead_back() {
        let point = [1.0, 2.0, 3.0];
        let mut seen: Vec<[f32; 3]> = Frame::all().map(|frame| frame.into_path(point)).collect();
        assert!(Frame::all().all(|frame| frame.into_mesh(frame.into_path(point)) == point));
        assert_eq!(seen.first(), Some(&point));
        seen.sort_by(|a, b| a.partial_cmp(b).unwrap());
        seen.dedup();
        assert_eq!((seen.len(), Frame::all().filter(|frame| frame.is_mirrored()).count()), (48, 24));
    }

    /// A quarter turn about z is no mirror, and the exchange of two axes is one.
    #[test]
    fn a_turn_is_no_mirror() {
        let turn = Frame { axes: [1, 0, 2], is_turned: [true, false, false] };
        let exchange = Frame { axes: [1, 0, 2], is_turned: [false; 3] };
        assert_eq!((turn.to_string(), turn.is_mirrored()), ("-y, x, z".into(), false));
        assert_eq!((exchange.to_string(), exchange.is_mirrored(), exchange.face([1, 2, 3])), ("y, x, z".into(), true, [1, 3, 2]));
        assert_eq!(turn.of_box([[1.0, 2.0, 3.0], [4.0, 6.0, 8.0]]), [[-6.0, 1.0, 3.0], [-2.0, 4.0, 8.0]]);
    }

    #[test]
    fn a_frame_is_taken_where_no_other_fits() {
        let [a, b, c] = [0, 1, 2].map(|n| Frame::all().nth(n).unwrap());
        let fit = |touched, uncut| Fit { touched, uncut };
        assert_eq!(clear(&[(a, fit(5, 500)), (b, fit(300, 10)), (c, fit(20, 0))], 1000), Some(b));
        assert_eq!(clear(&[(a, fit(200, 0)), (b, fit(300, 10))], 1000), None, "two fit");
        assert_eq!(clear(&[(a, fit(9, 0))], 1000), None, "by chance");
        assert_eq!(clear(&[(a, fit(300, 400))], 1000), None, "none fits");
    }
}
