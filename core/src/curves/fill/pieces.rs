//! The smooth pieces of a curve, and how each comes by its parameter.

use super::measure::Measure;
use crate::curves::curve::{Shape, Spline};

/// How the parameter of a piece of the fitted curve becomes one of the curve.
#[derive(Clone, Debug)]
pub(super) enum Way {
    /// In proportion: where the piece is taken over exactly, and on circles.
    Linear,
    /// By arc length.
    Measured(Measure),
}

/// A piece of a curve without corners.
#[derive(Clone, Debug)]
pub(super) struct Piece {
    /// Parameters of the curve where it begins and ends.
    pub(super) domain: [f64; 2],
    /// The same of the fitted curve, whose domain is 0 to 1.
    pub(super) share: [f64; 2],
    /// Arc length.
    pub(super) length: f64,
    pub(super) way: Way,
    /// Whether it is a polynomial of degree 3 or less for each span.
    pub(super) is_cubic: bool,
}

impl Piece {
    /// The parameter of the curve at a parameter (0 to 1) of this piece.
    pub(super) fn parameter(&self, shape: &Shape, t: f64) -> f64 {
        let [low, high] = self.domain;
        match &self.way {
            Way::Linear if t >= 1.0 => high,
            Way::Linear => low + (high - low) * t,
            Way::Measured(measure) => measure.parameter(shape, t),
        }
    }
}

/// All pieces of a curve in their order.
#[derive(Clone, Debug)]
pub(super) struct Pieces(pub(super) Vec<Piece>);

impl Pieces {
    /// Shares are in proportion to lengths. O(spans · degree²).
    pub(super) fn new(shape: &Shape) -> Self {
        Self(pieces(shape))
    }

    pub(super) fn length(&self) -> f64 {
        self.0.iter().map(|piece| piece.length).sum()
    }

    /// The parameter of the curve that belongs to one of the fitted curve. O(log spans + degree²).
    pub(super) fn parameter(&self, shape: &Shape, t: f64) -> f64 {
        let place = self.0.partition_point(|piece| piece.share[1] <= t).min(self.0.len().saturating_sub(1));
        let Some(piece) = self.0.get(place) else { return shape.domain()[0] };
        let [low, high] = piece.share;
        piece.parameter(shape, if t >= high { 1.0 } else { ((t - low) / (high - low)).max(0.0) })
    }

    /// Ends of smooth pieces, 0 and 1 among them.
    pub(super) fn corners(&self) -> Vec<f64> {
        let first = self.0.first().map_or(0.0, |piece| piece.share[0]);
        std::iter::once(first).chain(self.0.iter().map(|piece| piece.share[1])).collect()
    }
}

fn pieces(shape: &Shape) -> Vec<Piece> {
    let mut pieces = Vec::new();
    match shape {
        Shape::Composite(parts) => {
            for (number, part) in parts.iter().enumerate() {
                let [low, high] = part.domain();
                let map = |t: f64| if t >= high { number as f64 + 1.0 } else { number as f64 + (t - low) / (high - low) };
                for (domain, is_cubic, is_even) in simple(part) {
                    pieces.push(piece(shape, domain.map(map), is_cubic, is_even));
                }
            }
        }
        other => {
            pieces.extend(simple(other).into_iter().map(|(domain, is_cubic, is_even)| piece(shape, domain, is_cubic, is_even)))
        }
    }
    let whole: f64 = pieces.iter().map(|piece| piece.length).sum();
    let count = pieces.len().max(1) as f64;
    let mut share = 0.0;
    for piece in &mut pieces {
        let next = share + if whole > 0.0 { piece.length / whole } else { 1.0 / count };
        piece.share = [share, next];
        share = next;
    }
    // A piece without length has no share.
    pieces.retain(|piece| piece.share[0] < piece.share[1]);
    if let Some(last) = pieces.last_mut() {
        last.share[1] = 1.0;
    }
    pieces
}

fn piece(shape: &Shape, domain: [f64; 2], is_cubic: bool, is_even: bool) -> Piece {
    let measure = Measure::new(shape, domain);
    let length = measure.whole();
    Piece { domain, share: [0.0, 1.0], length, way: if is_even { Way::Linear } else { Way::Measured(measure) }, is_cubic }
}

/// Pieces of what is no composite: domains, whether they are cubic, and whether their parameter is kept.
fn simple(shape: &Shape) -> Vec<([f64; 2], bool, bool)> {
    let whole = shape.domain();
    match shape {
        Shape::Line(_) => vec![(whole, true, true)],
        Shape::Polyline(points) => (1..points.len()).map(|number| ([number as f64 - 1.0, number as f64], true, true)).collect(),
        Shape::Arc(arc) => vec![(whole, false, arc.is_circular())],
        Shape::Conic(spline) | Shape::Spline(spline) => {
            let is_cubic = spline.degree() <= 3 && spline.weights().is_none();
            let cuts = corners(spline);
            let pairs = cuts.windows(2).filter_map(|pair| if let &[a, b] = pair { Some([a, b]) } else { None });
            pairs.map(|pair| (pair, is_cubic, is_cubic)).collect()
        }
        Shape::Composite(_) => Vec::new(),
    }
}

/// Ends of the domain, and knots between that are so often that the curve may have a corner there.
fn corners(spline: &Spline) -> Vec<f64> {
    let [low, high] = spline.domain();
    let mut cuts = vec![low];
    let knots = spline.knots();
    for pair in knots.windows(spline.degree().max(1)) {
        let (Some(&first), Some(&last)) = (pair.first(), pair.last()) else { continue };
        if first == last && first > low && first < high && cuts.last() != Some(&first) {
            cuts.push(first);
        }
    }
    cuts.push(high);
    cuts
}
