//! Lines and arcs beside lines and arcs, in a plane: what cutter compensation is made of.

/// A point of the plane.
pub(super) type Flat = [f64; 2];

/// A line or an arc of a programmed path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Piece {
    pub(super) from: Flat,
    pub(super) to: Flat,
    /// Centre and angle of an arc; counter-clockwise ones are positive.
    pub(super) arc: Option<(Flat, f64)>,
}

/// How the path beside two pieces goes from one to the other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Join {
    /// Both end there.
    Point(Flat),
    /// An arc around their common point, by an angle.
    Around(f64),
}

/// Corners that turn less, in radians, are none.
const STRAIGHT: f64 = 1e-6;

/// Inner corners that turn less, in radians, may be rounded tangents; LinuxCNC's bound.
const TANGENT: f64 = 0.05;

fn turned(way: Flat) -> Flat {
    [-way[1], way[0]]
}

fn along(from: Flat, way: Flat, by: f64) -> Flat {
    [from[0] + way[0] * by, from[1] + way[1] * by]
}

fn between(from: Flat, to: Flat) -> Flat {
    [to[0] - from[0], to[1] - from[1]]
}

fn dot(a: Flat, b: Flat) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

fn cross(a: Flat, b: Flat) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

pub(super) fn distance(a: Flat, b: Flat) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

fn unit(way: Flat) -> Option<Flat> {
    let length = way[0].hypot(way[1]);
    (length > 0.0).then(|| [way[0] / length, way[1] / length])
}

impl Piece {
    /// Its direction at a point of it.
    fn direction(&self, at: Flat) -> Option<Flat> {
        match self.arc {
            None => unit(between(self.from, self.to)),
            Some((centre, sweep)) => {
                unit(turned(between(centre, at))).map(|way| [way[0] * sweep.signum(), way[1] * sweep.signum()])
            }
        }
    }

    /// The point beside one of its ends; `side` is a distance to the left.
    fn beside(&self, at: Flat, side: f64) -> Option<Flat> {
        Some(along(at, turned(self.direction(at)?), side))
    }

    pub(super) fn start_beside(&self, side: f64) -> Option<Flat> {
        self.beside(self.from, side)
    }

    pub(super) fn end_beside(&self, side: f64) -> Option<Flat> {
        self.beside(self.to, side)
    }

    /// Radius of an arc beside it; not positive if the tool does not fit into it.
    pub(super) fn radius_beside(&self, side: f64) -> Option<f64> {
        self.arc.map(|(centre, sweep)| distance(centre, self.from) - side * sweep.signum())
    }

    /// Whether the way beside it between two points is opposite to its own: what its corners take away is more than there is.
    pub(super) fn goes_back(&self, from: Flat, to: Flat) -> bool {
        match self.arc {
            None => dot(between(from, to), between(self.from, self.to)) < -1e-6 * distance(self.from, self.to),
            Some((_, sweep)) => self.sweep_between(from, to) * sweep.signum() < -1e-6,
        }
    }

    /// The angle of an arc beside it between two points.
    pub(super) fn sweep_between(&self, from: Flat, to: Flat) -> f64 {
        let Some((centre, sweep)) = self.arc else { return 0.0 };
        let [a, b] = [between(centre, from), between(centre, to)];
        let angle = cross(a, b).atan2(dot(a, b));
        // The same number of turns as the arc has, but for what the corners take away.
        angle + ((sweep - angle) / std::f64::consts::TAU).round() * std::f64::consts::TAU
    }
}

/// How to go from beside a piece to beside the next one; `None` if the tool does not fit between them.
pub(super) fn join(one: &Piece, other: &Piece, side: f64) -> Option<Join> {
    let corner = one.to;
    let (first, second) = (one.direction(corner)?, other.direction(other.from)?);
    let angle = cross(first, second).atan2(dot(first, second));
    if angle.abs() < STRAIGHT || side == 0.0 {
        return one.end_beside(side).map(Join::Point);
    }
    let is_back = angle.abs() > std::f64::consts::PI - STRAIGHT;
    if is_back {
        return Some(Join::Around(-std::f64::consts::PI * side.signum()));
    }
    if angle * side < 0.0 {
        return Some(Join::Around(angle));
    }
    // Arcs that rounding alone keeps from being tangent may not meet, or far away; what is left standing is below r · 0.0004.
    if angle.abs() < TANGENT {
        return one.end_beside(side).map(Join::Point);
    }
    meet(one, other, side).map(Join::Point)
}

/// Where the paths beside two pieces meet, next to their corner.
fn meet(one: &Piece, other: &Piece, side: f64) -> Option<Flat> {
    let (a, b) = (one.end_beside(side)?, other.start_beside(side)?);
    let candidates = match (one.arc, other.arc) {
        (None, None) => {
            let (first, second) = (one.direction(one.to)?, other.direction(other.from)?);
            let by = cross(between(a, b), second) / cross(first, second);
            [Some(along(a, first, by)), None]
        }
        (None, Some((centre, _))) => line_circle(a, one.direction(one.to)?, centre, other.radius_beside(side)?),
        (Some((centre, _)), None) => line_circle(b, other.direction(other.from)?, centre, one.radius_beside(side)?),
        (Some((centre, _)), Some((next, _))) => circles((centre, one.radius_beside(side)?), (next, other.radius_beside(side)?)),
    };
    let finite = candidates.into_iter().flatten().filter(|point| point.iter().all(|number| number.is_finite()));
    finite.min_by(|a, b| distance(*a, one.to).total_cmp(&distance(*b, one.to)))
}

/// The centre of a circle through a point and the end of an arc, whose direction there is the arc's.
pub(super) fn through(point: Flat, end: Flat, centre: Flat) -> Option<Flat> {
    let way = unit(between(end, centre))?;
    let chord = between(end, point);
    let by = dot(chord, chord) / (2.0 * dot(chord, way));
    by.is_finite().then(|| along(end, way, by))
}

fn line_circle(on: Flat, way: Flat, centre: Flat, radius: f64) -> [Option<Flat>; 2] {
    let to_centre = between(on, centre);
    let (foot, off) = (dot(to_centre, way), cross(way, to_centre));
    let square = radius * radius - off * off;
    if square < 0.0 {
        return [None; 2];
    }
    [Some(along(on, way, foot - square.sqrt())), Some(along(on, way, foot + square.sqrt()))]
}

fn circles((a, first): (Flat, f64), (b, second): (Flat, f64)) -> [Option<Flat>; 2] {
    let apart = distance(a, b);
    let Some(way) = unit(between(a, b)) else { return [None; 2] };
    let foot = (apart * apart + first * first - second * second) / (2.0 * apart);
    let square = first * first - foot * foot;
    if square < 0.0 {
        return [None; 2];
    }
    let on = along(a, way, foot);
    [Some(along(on, turned(way), square.sqrt())), Some(along(on, turned(way), -square.sqrt()))]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(from: Flat, to: Flat) -> Piece {
        Piece { from, to, arc: None }
    }

    /// A right angle to the left: beside it on the left the lines meet, on the right an arc goes around.
    #[test]
    fn corners_are_trimmed_or_gone_around() {
        let (one, other) = (line([0.0, 0.0], [10.0, 0.0]), line([10.0, 0.0], [10.0, 10.0]));
        assert_eq!(join(&one, &other, 2.0), Some(Join::Point([8.0, 2.0])));
        assert_eq!(join(&one, &other, -2.0), Some(Join::Around(std::f64::consts::FRAC_PI_2)));
        let arc = Piece { from: [10.0, 0.0], to: [20.0, 10.0], arc: Some(([20.0, 0.0], -std::f64::consts::FRAC_PI_2)) };
        let Some(Join::Point(meeting)) = join(&one, &arc, 2.0) else { panic!() };
        assert!((distance(meeting, [20.0, 0.0]) - 12.0).abs() < 1e-12 && (meeting[1] - 2.0).abs() < 1e-12);
    }
}
