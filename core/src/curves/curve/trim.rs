//! Parts of curves.

use super::arc::Arc;
use super::error::CurveError;
use super::shape::Shape;
use crate::curves::vector::{Point, distance};

impl Shape {
    /// The part between two parameters of the domain, the first one below the second.
    ///
    /// # Errors
    /// [`CurveError::Domain`] if there is no such part.
    pub fn part(self, [from, to]: [f64; 2]) -> Result<Self, CurveError> {
        let [low, high] = self.domain();
        let slack = 1e-9 * (high - low);
        if !(from < to && from >= low - slack && to <= high + slack) {
            return Err(CurveError::Domain);
        }
        let [from, to] = [from.max(low), to.min(high)];
        match self {
            Self::Line(_) => Ok(Self::Line([self.point(from), self.point(to)])),
            Self::Arc(arc) => Ok(Self::Arc(Arc { angles: [from, to], ..arc })),
            Self::Conic(spline) => spline.on([from, to]).map(Self::Conic),
            Self::Spline(spline) => spline.on([from, to]).map(Self::Spline),
            Self::Polyline(ref points) => {
                let mut part: Vec<Point> = vec![self.point(from)];
                let inner = (from.floor() as usize + 1)..(to.ceil() as usize);
                part.extend(points.get(inner).unwrap_or_default());
                part.push(self.point(to));
                Self::polyline(part)
            }
            Self::Composite(parts) => {
                let mut rest = Vec::new();
                for (number, part) in parts.into_iter().enumerate() {
                    let ends = [from - number as f64, to - number as f64].map(|share| share.clamp(0.0, 1.0));
                    let [low, high] = part.domain();
                    if ends[0] < ends[1] {
                        rest.push(part.part(ends.map(|share| low + (high - low) * share))?);
                    }
                }
                Self::composite(rest)
            }
        }
    }

    /// The part from one parameter on to another, across the joint of a closed curve if the second is not greater. `gap` is how far the ends of
    /// a closed curve may be apart.
    ///
    /// # Errors
    /// [`CurveError::Domain`] if there is no such part.
    pub fn onward(self, [from, to]: [f64; 2], gap: f64) -> Result<Self, CurveError> {
        let [low, high] = self.domain();
        let slack = 1e-9 * (high - low);
        if to > from + slack {
            return self.part([from, to]);
        }
        let [start, end] = self.ends();
        if distance(start, end) > gap {
            return Err(CurveError::Domain);
        }
        if let Self::Arc(arc) = self {
            return Arc::new(arc.centre, arc.axes, [from, to]).map(Self::Arc);
        }
        let mut parts = Vec::new();
        if high - from > slack {
            parts.push(self.clone().part([from, high])?);
        }
        if to - low > slack {
            parts.push(self.part([low, to])?);
        }
        Self::composite(parts)
    }
}
