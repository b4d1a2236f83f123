//! Curves as both formats have them: clamped, with all of their knots in use.

use std::borrow::Cow;

use crate::curves::curve::Spline;

/// The same curve with clamped knots on just its domain; as it is, to the last bit, if it is so already.
pub(super) fn canonical(spline: &Spline) -> Cow<'_, Spline> {
    let (knots, count) = (spline.knots(), spline.degree() + 1);
    let [low, high] = spline.domain();
    let starts = knots.iter().take_while(|knot| **knot == low).count();
    let ends = knots.iter().rev().take_while(|knot| **knot == high).count();
    let inner = knots.get(count..knots.len().saturating_sub(count)).unwrap_or_default();
    let is_torn = inner.windows(count).any(|run| run.first() == run.last());
    if starts == count && ends == count && !is_torn {
        return Cow::Borrowed(spline);
    }
    // Numbers that overflow in between are written as they are.
    spline.clamped().map_or(Cow::Borrowed(spline), Cow::Owned)
}

/// The same way in the other direction, with the parameter `−t`: exact, as no knot is rounded.
pub(super) fn reversed(spline: &Spline) -> Cow<'_, Spline> {
    let knots = spline.knots().iter().rev().map(|knot| 0.0 - knot).collect();
    let points = spline.points().iter().rev().copied().collect();
    let weights = spline.weights().map(|weights| weights.iter().rev().copied().collect());
    Spline::new(spline.degree(), knots, points, weights, None).map_or(Cow::Borrowed(spline), Cow::Owned)
}
