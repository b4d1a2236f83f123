//! May an edge collapse? What it does to connectivity, and to the triangles around it; what these may cross is asked elsewhere.

use glam::DVec3;

use crate::geometry::exact::Point;
use crate::simplify::patch::{CREASE, FIXED, FREE, Patch, RIM, Star, longest};

/// Triangles flatter than this share of an equilateral one's area are not made, unless the surface was as thin or as flat there before.
const LEAST_SHAPE: f64 = 0.03;

/// The share of the square of the least height that there was before: in a strip, triangles whose sides are four times as long on one side as on the other.
const LEAST_HEIGHT: f64 = 1.0 / 16.0;

/// The square of the doubled area by that of the sum of the squared sides from which on an area is more than rounding.
const NO_AREA: f64 = 1e-20;

/// Bounds of what a collapse may do.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    /// The cosine of the largest angle by which a triangle may turn.
    pub(super) turn: f64,
    /// The cosine of the angle of triangles from which on their edge is a feature.
    pub(super) feature: f64,
}

/// Scratch for marks of vertices.
#[derive(Default)]
pub(super) struct Marks {
    of: Vec<u32>,
    now: u32,
}

impl Marks {
    pub(super) fn new(vertices: usize) -> Self {
        Self { of: vec![0; vertices], now: 0 }
    }

    /// None is marked any more.
    pub(super) fn clear(&mut self) {
        if self.now == u32::MAX {
            self.of.fill(0);
            self.now = 0;
        }
        self.now += 1;
    }

    /// Marks one, and says whether it was not.
    #[inline]
    pub(super) fn mark(&mut self, v: u32) -> bool {
        std::mem::replace(&mut self.of[v as usize], self.now) != self.now
    }

    #[inline]
    pub(super) fn has(&self, v: u32) -> bool {
        self.of[v as usize] == self.now
    }
}

/// The link condition for an edge of one fan around `u` (Dey, Edelsbrunner, Guha & Nekhayev, "Topology preserving edge contraction", 1999): what both
/// ends are joined to is joined to the edge, too. Where `u` lies on a rim, the edge does; the outside counts as one more vertex, that all of the rim is
/// joined to. `is_joined`: by an edge of other cells' triangles, to `v`.
pub(super) fn keeps_topology(
    ([u, v], is_rim): ([u32; 2], bool),
    of_u: &Star,
    of_v: &Star,
    marks: &mut Marks,
    is_joined: impl Fn(u32) -> bool,
) -> bool {
    marks.clear();
    for (_, [a, b]) in of_v.iter() {
        marks.mark(a);
        marks.mark(b);
    }
    let (mut common, mut shared, mut wings) = (0, 0, [u; 2]);
    for (_, [a, b]) in of_u.iter() {
        common += usize::from(marks.has(a));
        // The last one of an open fan is the first of no triangle.
        common += usize::from(is_rim && marks.has(b) && of_u.iter().all(|(_, ring)| ring[0] != b));
        if a == v || b == v {
            if shared < 2 {
                wings[shared] = if a == v { b } else { a };
            }
            shared += 1;
        }
    }
    // The triangles of u and v beside an edge between the wings would become one with two sides.
    let closes = |star: &Star| star.iter().any(|(_, ring)| ring == wings || ring == [wings[1], wings[0]]);
    let is_wing = |w: u32| wings[..shared.min(2)].contains(&w);
    if of_u.iter().any(|(_, ring)| ring.iter().any(|w| *w != v && !is_wing(*w) && is_joined(*w))) {
        return false;
    }
    if is_rim {
        // The last triangle of a surface does not go.
        let goes_on = |star: &Star, other: u32| star.iter().any(|(_, ring)| ring.contains(&wings[0]) && !ring.contains(&other));
        return common == 1 && shared == 1 && (goes_on(of_u, v) || goes_on(of_v, u));
    }
    common == 2 && shared == 2 && wings[0] != wings[1] && !closes(of_u) && !closes(of_v)
}

/// Does each triangle of a star, but those with `gone`, keep its direction and its shape when its vertex goes to `to`?
///
/// A flat triangle is made where it is about as high as the lowest one around both was at first, so that those of thin walls, and needles, become longer.
#[inline]
pub(super) fn keeps_shape(patch: &Patch, [v, gone]: [u32; 2], star: &Star, to: &Point, turn: f64) -> bool {
    let from = patch.place_of(v);
    let to = patch.place(to);
    star.iter().filter(|(_, ring)| !ring.contains(&gone)).all(|(_, [a, b])| {
        let [a, b] = [a, b].map(|w| patch.place_of(w));
        let (old, new) = ((a - from).cross(b - from), (a - to).cross(b - to));
        let (old_square, new_square, dot) = (old.length_squared(), new.length_squared(), old.dot(new));
        let edge = (b - a).length_squared();
        let sides = |p: DVec3| edge + (a - p).length_squared() + (b - p).length_squared();
        let keeps_direction =
            if old_square > 0.0 { dot > 0.0 && dot * dot >= turn * turn * old_square * new_square } else { true };
        // 2√3 times the doubled area over the sum of the squared sides: 1 for an equilateral triangle.
        let new_sides = sides(to);
        let bound = LEAST_SHAPE * LEAST_SHAPE / 12.0;
        let keeps_form = new_square > bound * new_sides * new_sides
            || (new_square > NO_AREA * new_sides * new_sides
                && new_square >= LEAST_HEIGHT * patch.low([v, gone]) * longest([a, b, to]));
        keeps_direction && keeps_form
    })
}

/// May they become one where features are kept? The less free one is the second.
pub(super) fn keeps_features(patch: &Patch, [u, v]: [u32; 2], of_u: &Star, feature: f64) -> bool {
    let kinds = [u, v].map(|w| patch.kinds[w as usize]);
    match kinds {
        [FREE, _] => true,
        // That its edge is of the rim, the link condition has told.
        [RIM, RIM | FIXED] => true,
        [CREASE, CREASE | FIXED] => angle_at(patch, v, of_u).is_some_and(|cosine| cosine < feature),
        _ => false,
    }
}

/// The cosine of the angle of the two triangles of a star that have `v`.
fn angle_at(patch: &Patch, v: u32, star: &Star) -> Option<f64> {
    let mut normals = star.iter().filter(|(_, ring)| ring.contains(&v)).map(|(corner, _)| {
        let [a, b, c] = patch.face(corner as usize / 3).map(|w| patch.place_of(w));
        (b - a).cross(c - a).normalize_or_zero()
    });
    let (first, second) = (normals.next()?, normals.next()?);
    Some(first.dot(second))
}
