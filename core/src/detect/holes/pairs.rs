//! Two loops that belong together: the rims of a missing ring, or a hole and an island in it.
//!
//! A patch over a missing ring leaves one rim and arrives at the other, so that the loops, each in its patch's direction, run opposite
//! ways round the same axis, while two holes side by side in one surface run the same way round. What remains is told by the surface
//! along the rims, and by where a strip between them would lie:
//!
//! * *One surface.* The larger loop is a hole in it and the smaller one the rim of a piece in that hole. (A plate's own rim around a hole in the
//!   plate is the other way about.)
//! * *A wall.* The surface along the larger loop faces away from the axis, that along the smaller one to it: outside and inside of a vessel, or of a
//!   pipe. What lacks is the wall's end, however thick the wall; of a thin wall, the smaller rim may lie deep. One wall may hold several bores.
//! * *A tube.* The rims look at each other from outside, or away from each other if the surface is that of a bore: the strip goes on from both.
//!   The two ends of a tube, or of a bore, are the other way about.
//! * *A way through.* Two holes back to back whose outlines agree, seen along their axis: the sides of what was drilled through a plate.
//!
//! A wall's rims may also be closed by two caps, and so may holes back to back: those belong together if a strip between them has less area
//! than the two caps, as a soap film would have it. So a hole in the top and one in the bottom of a box as high as they are wide are two holes.
//! Nor is there a way through between holes whose outlines are ragged: nobody drills along the edges of triangles.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};

use glam::DVec3;

use super::nearest::{Near, bounds};
use super::owners::Owners;
use super::shape::Shape;
use crate::contract::report::LoopClass;
use crate::geometry::boxes::BoxTree;
use crate::geometry::distance::{cosine, nearest_of_segment};
use crate::geometry::sums::Bounds;

/// Cosine between the vector areas of loops that belong together, at most.
const OPPOSITE: f64 = -0.5;
/// Loops of a ring differ by less than this: see [`characteristic_distance`].
const ANNULAR: f64 = 0.15;
/// Rims of a ring are no farther apart than so many radii of the larger one.
const FARTHEST: f64 = 3.0;
/// Rims are in one plane as long as they are no farther apart along its normal than this share of the larger one's radius.
const ONE_PLANE: f64 = 0.5;
/// Rims end at the same height if they are no farther apart so than this share of the larger one's radius.
const LEVEL: f64 = 0.1;
/// How much more the larger rim is a hole in its surface than the other one is (2 in a plane, 0 on a tube), if the ring is missing from one
/// surface that slopes by no more than some 65° there.
const ONE_SURFACE: f64 = 0.8;
/// The same for an island, which may lie on the top of a dome.
const ISLAND_SURFACE: f64 = 0.5;
/// And how much less, at most: −2 is a plate's own rim around a hole in it.
const WASHER: f64 = -0.5;
/// How much both rims' surfaces go on across them, together, at most: holes in two bodies that face each other come to 2, the ends of a
/// tube to 0.
const FACING_HOLES: f64 = 1.0;
/// How much the surface goes on across a rim, at most, if the opening is most of what is cut there: the end of a tube, or of a cone.
const MOSTLY_OPEN: f64 = 0.5;
/// How far the surface along a rim faces the axis, or away from it, to be a skin.
const SKIN: f64 = 0.3;
/// The same for the skins of a wall whose rims are not alike ...
const CLEAR_SKIN: f64 = 0.7;
/// ... and how far such a rim departs from its plane, at most, as a share of its radius.
const CLEAR_RIM: f64 = 0.25;
/// How far the surface goes on across each of two holes back to back, at least: plates may be bent a little.
const HOLE: f64 = 0.7;
/// Outlines of holes back to back agree as long as no vertex is farther from the other outline, seen along the axis, than this share of the
/// larger radius: circles of eight facets do.
const OUTLINE: f64 = 0.15;
/// And outlines of openings in two bodies, if these were one, laid upon each other by their centres: what broke may lean, and be turned
/// aside ...
const ALIKE_OUTLINE: f64 = 0.35;
/// ... by so much, at most.
const ASIDE_OUTLINE: f64 = 0.6;
/// Sine of the turn at a corner of an outline.
const CORNER: f64 = 0.3;
/// An outline is ragged if it turns the other way at this share of its vertices,
const RAGGED: f64 = 0.25;
/// of which it has at least so many: letters have fewer.
const FEWEST_RAGGED: usize = 16;
/// Cosine between the vector areas of a hole and an island in it, at most: an island is small, and may lie on a slope.
const ISLAND_OPPOSITE: f64 = -0.2;
/// An island lies no farther from the plane of its hole than this share of the hole's size.
const OFF_PLANE: f64 = 0.75;
/// Points of a loop that distances are measured from, at most.
const MOST_POINTS: usize = 2048;

/// Two loops by number, the larger first.
pub(super) struct Pair {
    pub(super) loops: [u32; 2],
    pub(super) class: LoopClass,
    pub(super) rule: String,
    pub(super) characteristic_distance: f64,
}

/// The surface that is missing between two loops.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Missing {
    /// The end of a wall; the areas of a strip and of two caps.
    Wall(f64, f64),
    /// A ring of one surface.
    OneSurface,
    /// The floor of a groove: what lies between two skins that face each other.
    Floor,
    /// A ring of a tube.
    Tube,
    /// The sides of a way through; the areas of a strip and of two caps.
    Through(f64, f64),
}

/// Two loops between which something is missing.
#[derive(Clone, Copy, Debug)]
struct Ring {
    missing: Missing,
    one_plane: bool,
    /// The rims end at the same height.
    level: bool,
    /// Characteristic distance.
    apart: f64,
}

impl Ring {
    fn class(&self) -> LoopClass {
        if self.one_plane { LoopClass::AnnularCoplanar } else { LoopClass::AnnularParallel }
    }

    fn is_wall(&self) -> bool {
        matches!(self.missing, Missing::Wall(..))
    }

    fn is_of_tube(&self) -> bool {
        matches!(self.missing, Missing::Tube | Missing::Through(..))
    }

    /// May it be missing between two bodies that can each be closed alone? Only where most of what is cut there is the opening: a hole in a
    /// surface that faces the other one's is one of each. Skins that face each other bound the air between the bodies, unless two caps
    /// would lie on each other.
    fn may_join_bodies(&self, rims: [&Shape; 2]) -> bool {
        let [a, b] = rims;
        let alike = outlines_agree(a, b, b.centre - a.centre, ALIKE_OUTLINE) && outlines_agree(a, b, DVec3::ZERO, ASIDE_OUTLINE);
        let open = alike && rims.iter().all(|rim| rim.continues <= MOSTLY_OPEN);
        match self.missing {
            Missing::Tube | Missing::OneSurface => open,
            Missing::Floor => open && self.level,
            Missing::Wall(..) | Missing::Through(..) => false,
        }
    }

    fn rule(&self) -> String {
        let planes = if self.one_plane { "one plane" } else { "two planes" };
        let less =
            |strip: f64, caps: f64| format!("the strip between them has less area than two caps: {strip:.4} against {caps:.4}");
        match self.missing {
            Missing::Wall(strip, caps) => format!(
                "outside and inside of a wall whose end is missing, in {planes}: the surfaces face away from the axis and to it, and {}",
                less(strip, caps)
            ),
            Missing::OneSurface | Missing::Floor | Missing::Tube => format!(
                "faces the loop nearest to it, in {planes}; their characteristic distance {:.4} is below {ANNULAR}",
                self.apart
            ),
            Missing::Through(strip, caps) => {
                format!(
                    "two ends of a way through whose sides are missing: back to back, the outlines agree, and {}",
                    less(strip, caps)
                )
            }
        }
    }

    fn of(self, outer: u32, inner: u32) -> Pair {
        Pair { loops: [outer, inner], class: self.class(), rule: self.rule(), characteristic_distance: self.apart }
    }
}

/// The pairs among `free` loops: walls, rings of one surface, islands, rings of tubes and ways through, each in the loops' order. A wall with several bores is in
/// several pairs, as is a hole with several islands.
pub(super) fn find(free: &[u32], shapes: &[Shape], owners: &Owners) -> Vec<Pair> {
    if free.len() < 2 {
        return Vec::new();
    }
    let shape = |place: usize| &shapes[free[place] as usize];
    let are_bodies = |i: usize, j: usize| owners.are_bodies(free[i] as usize, free[j] as usize);
    let may_be_ring = |i: usize, j: usize, ring: &Ring| {
        let is_large = |i: usize| owners.is_large(free[i] as usize, shape(i).area());
        !are_bodies(i, j) || (is_large(i) || is_large(j)) && ring.may_join_bodies([shape(i), shape(j)])
    };
    let nearest = nearest_rings(free, shape, may_be_ring);
    let larger_first = |i: usize, j: usize| if shape(j).radius() > shape(i).radius() { [j, i] } else { [i, j] };
    let mut pairs = Vec::new();
    let mut taken = vec![false; free.len()];
    for ([outer, inner], ring) in walls(&nearest, shape, larger_first) {
        (taken[outer], taken[inner]) = (true, true);
        pairs.push(ring.of(free[outer], free[inner]));
    }
    let take_rings = |of_tubes: bool, taken: &mut [bool], pairs: &mut Vec<Pair>| {
        let mutual = nearest.iter().enumerate().filter_map(|(i, found)| found.map(|(j, ring)| (i, j, ring)));
        for (i, j, ring) in mutual.filter(|(i, j, _)| j > i && nearest[*j].is_some_and(|(back, _)| back == *i)) {
            if ring.is_of_tube() == of_tubes && !taken[i] && !taken[j] {
                (taken[i], taken[j]) = (true, true);
                let [outer, inner] = larger_first(i, j);
                pairs.push(ring.of(free[outer], free[inner]));
            }
        }
    };
    take_rings(false, &mut taken, &mut pairs);
    let mut with_islands = taken.clone();
    for [outer, inner] in islands(free, shape, are_bodies, &taken) {
        (with_islands[outer], with_islands[inner]) = (true, true);
        pairs.push(Pair {
            loops: [outer, inner].map(|i| free[i]),
            class: LoopClass::Island,
            rule: "one lies inside the other's opening and runs the other way round".into(),
            characteristic_distance: characteristic_distance(shape(outer), shape(inner)),
        });
    }
    // Two holes may look at each other across a gap between bodies: one with an island in it is no end of a tube.
    take_rings(true, &mut with_islands, &mut pairs);
    pairs
}

/// For each loop, by place, the nearest one that it is a ring with.
fn nearest_rings<'s>(
    free: &[u32],
    shape: impl Fn(usize) -> &'s Shape,
    may_be: impl Fn(usize, usize, &Ring) -> bool,
) -> Vec<Option<(usize, Ring)>> {
    let near = Near::new((0..free.len()).map(&shape));
    (0..free.len()).map(|i| nearest_ring(i, &near, &shape, &may_be)).collect()
}

/// The nearest loop that this one is a ring with. Only of those that it can be a ring with: what else lies near is no reason to leave one open.
fn nearest_ring<'s>(
    i: usize,
    near: &Near,
    shape: impl Fn(usize) -> &'s Shape,
    may_be: impl Fn(usize, usize, &Ring) -> bool,
) -> Option<(usize, Ring)> {
    type Nearest = Option<(f64, usize, Ring)>;
    let put = |best: &mut Nearest, found: (f64, usize, Ring)| {
        let is_nearer = |(d, j, _): (f64, usize, Ring)| found.0.total_cmp(&d).then(found.1.cmp(&j)).is_lt();
        if best.is_none_or(is_nearer) {
            *best = Some(found);
        }
    };
    let is_settled = |best: &Nearest, bound: f64| best.is_some_and(|(d, ..)| bound > d);
    // Of pipes that end inside each other, the walls are closed, not the rooms between them, however narrow: no floor counts if there is
    // a wall whose rims are level.
    let (mut nearest, mut but_floors, mut level_wall): (Nearest, Nearest, bool) = (None, None, false);
    let within = bounds(shape(i), FARTHEST * shape(i).radius());
    for (bound, j) in near.around(i, within, |j| face(shape(i), shape(j), OPPOSITE)) {
        let is_floor = nearest.is_some_and(|(_, _, ring)| ring.missing == Missing::Floor);
        if is_settled(&nearest, bound) && (!is_floor || level_wall && is_settled(&but_floors, bound)) {
            break;
        }
        let Some(ring) = ring(shape(i), shape(j)).filter(|ring| may_be(i, j, ring)) else { continue };
        level_wall |= ring.is_wall() && ring.level;
        let best = if ring.missing == Missing::Floor { &mut nearest } else { &mut but_floors };
        if !is_settled(best, bound) {
            let found = (distance(shape(i), shape(j)), j, ring);
            put(best, found);
            put(&mut nearest, found);
        }
    }
    if level_wall { but_floors } else { nearest }.map(|(_, j, ring)| (j, ring))
}

/// Islands and the holes around them, by place: each with the smallest hole that holds it. What is `taken` is neither.
fn islands<'s>(
    free: &[u32],
    shape: impl Fn(usize) -> &'s Shape,
    are_bodies: impl Fn(usize, usize) -> bool,
    taken: &[bool],
) -> Vec<[usize; 2]> {
    // A domed island stands out of its hole's box.
    let reaches: Vec<Bounds> = (0..free.len()).map(|i| bounds(shape(i), OFF_PLANE * shape(i).area().sqrt())).collect();
    let tree = BoxTree::new(&reaches);
    // Loops that may hold an island wait, the smallest first: radii are not negative, so that their bits are in their order.
    let by_size = |outer: usize| Reverse((shape(outer).radius().to_bits(), outer));
    let (mut waiting, mut islands) = (BinaryHeap::new(), Vec::new());
    for inner in 0..free.len() {
        if taken[inner] {
            continue;
        }
        waiting.clear();
        let may_hold = |outer: &usize| !taken[*outer] && is_hole_around(shape(*outer), shape(inner));
        tree.each_meeting(&bounds(shape(inner), 0.0), |outer| waiting.extend(Some(outer as usize).filter(may_hold).map(by_size)));
        let holds = |outer: usize| {
            outer != inner
                && !are_bodies(outer, inner)
                && holds_island(shape(outer), shape(inner))
                && ring(shape(outer), shape(inner)).is_none()
        };
        let smallest = std::iter::from_fn(|| waiting.pop()).map(|Reverse((_, outer))| outer).find(|outer| holds(*outer));
        islands.extend(smallest.map(|outer| [outer, inner]));
    }
    islands
}

/// Outer and inner rims of walls, by place: each inner rim with the outer rim nearest to it, if that has a wall's rim nearest, too. In the
/// loops' order.
fn walls<'s>(
    nearest: &[Option<(usize, Ring)>],
    shape: impl Fn(usize) -> &'s Shape,
    larger_first: impl Fn(usize, usize) -> [usize; 2],
) -> Vec<([usize; 2], Ring)> {
    let mut of_outer: BTreeMap<usize, Vec<(usize, Ring)>> = BTreeMap::new();
    for (i, found) in nearest.iter().enumerate() {
        if let Some((j, ring)) = found.filter(|(_, ring)| ring.is_wall())
            && let [outer, inner] = larger_first(i, j)
            && inner == i
            && nearest[outer].is_some_and(|(_, ring)| ring.is_wall())
        {
            of_outer.entry(outer).or_default().push((inner, ring));
        }
    }
    // What lies behind another bore's mouth is not seen from the outer rim.
    let is_seen = |inner: usize, bores: &[(usize, Ring)]| {
        bores
            .iter()
            .all(|(other, _)| shape(*other).radius() <= shape(inner).radius() || !shape(*other).surrounds(shape(inner).centre))
    };
    let pairs = of_outer.iter().flat_map(|(outer, bores)| {
        bores.iter().filter(|(inner, _)| is_seen(*inner, bores)).map(|(inner, ring)| ([*outer, *inner], *ring))
    });
    pairs.collect()
}

/// The surface that is missing between two loops, if any is.
fn ring(a: &Shape, b: &Shape) -> Option<Ring> {
    if !face(a, b, OPPOSITE) {
        return None;
    }
    let apart = characteristic_distance(a, b);
    let (outer, inner) = if a.radius() < b.radius() { (b, a) } else { (a, b) };
    let way = inner.centre - outer.centre;
    let depth = way.dot(outer.normal).abs();
    let one_plane = depth <= ONE_PLANE * outer.radius();
    let level = depth <= LEVEL * outer.radius();
    let ring = |missing| Some(Ring { missing, one_plane, level, apart });
    let [strip, caps] = closings(outer, inner, depth);
    let may_be_alike = apart < ANNULAR;
    let alike = || may_be_alike && a.surrounds(b.centre) && b.surrounds(a.centre);
    let of_thick_wall = || one_plane && is_clear_skin(outer) && is_clear_skin(inner) && lies_inside(inner, outer);
    if outer.outwards >= SKIN && inner.outwards <= -SKIN && strip < caps && (alike() || of_thick_wall()) {
        return ring(Missing::Wall(strip, caps));
    }
    if !may_be_alike {
        return None;
    }
    let one_surface = outer.continues - inner.continues;
    let skins = outer.outwards.abs().min(inner.outwards.abs()) >= SKIN && outer.outwards * inner.outwards < 0.0;
    if one_plane && one_surface >= ONE_SURFACE && is_hole_around(outer, inner) {
        return alike().then(|| ring(Missing::OneSurface))?;
    }
    let holes = outer.continues + inner.continues > FACING_HOLES;
    if one_plane && skins && !holes {
        return alike().then(|| ring(Missing::Floor))?;
    }
    let two_planes = |missing| Some(Ring { missing, one_plane: false, level, apart });
    let towards = [outer.vector_area.dot(way), -inner.vector_area.dot(way)];
    let bore = outer.outwards <= -SKIN && inner.outwards <= -SKIN;
    let goes_on = if bore { towards.iter().all(|t| *t < 0.0) } else { towards.iter().all(|t| *t > 0.0) };
    if goes_on && one_surface > WASHER && !holes {
        return alike().then(|| two_planes(Missing::Tube))?;
    }
    let back_to_back = towards.iter().all(|t| *t < 0.0);
    let are_holes = outer.continues.min(inner.continues) >= HOLE;
    let is_way = back_to_back && are_holes && strip < caps && !(is_ragged(outer) && is_ragged(inner));
    (is_way && alike() && outlines_agree(outer, inner, DVec3::ZERO, OUTLINE))
        .then(|| two_planes(Missing::Through(strip, caps)))
        .flatten()
}

/// Which of `others` a strip may lead to though two caps have less area, the nearest first.
pub(super) fn across(shapes: &[Shape], of: usize, others: impl Iterator<Item = usize>) -> Vec<usize> {
    let rim = &shapes[of];
    let may = |other: &usize| {
        let other = &shapes[*other];
        face(rim, other, OPPOSITE) && characteristic_distance(rim, other) < ANNULAR
    };
    let mut found: Vec<(f64, usize)> = others.filter(may).map(|other| (distance(rim, &shapes[other]), other)).collect();
    found.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    found.into_iter().map(|(_, other)| other).collect()
}

/// Does a face end there that is to be recognised without another rim like it?
fn is_clear_skin(shape: &Shape) -> bool {
    shape.outwards.abs() >= CLEAR_SKIN && shape.off_plane <= CLEAR_RIM * shape.radius()
}

/// Areas of a strip between two loops so far apart along the axis, and of a cap on each: exact for circles about one axis.
fn closings(outer: &Shape, inner: &Shape, depth: f64) -> [f64; 2] {
    let along = 0.5 * (outer.perimeter + inner.perimeter) * depth;
    let across = outer.area() - inner.area();
    [(along * along + across * across).sqrt(), outer.area() + inner.area()]
}

/// Does the loop turn to and fro all along, as the rim of triangles that were lost does?
fn is_ragged(shape: &Shape) -> bool {
    let n = shape.points.len();
    if n < FEWEST_RAGGED {
        return false;
    }
    let turn = |i: usize| {
        let [a, b, c] = [i, i + 1, i + 2].map(|i| shape.points[i % n]);
        (b - a).normalize_or_zero().cross((c - b).normalize_or_zero()).dot(shape.normal)
    };
    let turns: Vec<f64> = (0..n).map(turn).filter(|turn| turn.abs() > CORNER).collect();
    let changes = (0..turns.len()).filter(|i| turns[*i] * turns[(i + 1) % turns.len()] < 0.0).count();
    changes as f64 >= RAGGED * n as f64
}

/// Lies all of a loop inside the other, seen along that one's axis?
fn lies_inside(inner: &Shape, outer: &Shape) -> bool {
    some_points(inner).all(|p| outer.surrounds(p))
}

/// Is neither outline far from the other, which is moved back by `way`, seen along the axis?
fn outlines_agree(a: &Shape, b: &Shape, way: DVec3, share: f64) -> bool {
    let reach = share * a.radius().max(b.radius());
    let flat = |p: DVec3| p - a.normal * p.dot(a.normal);
    let is_near = |p: DVec3, other: &Shape| {
        let n = other.points.len();
        (0..n).any(|i| {
            let [from, to] = [i, (i + 1) % n].map(|i| flat(other.points[i] - p));
            nearest_of_segment(from, to, DVec3::ZERO).length() <= reach
        })
    };
    some_points(a).all(|p| is_near(p + way, b)) && some_points(b).all(|p| is_near(p - way, a))
}

/// The one is a hole in a surface, the other the rim of a piece.
fn is_hole_around(outer: &Shape, inner: &Shape) -> bool {
    outer.continues > 0.0 && inner.continues < 0.0
}

fn holds_island(outer: &Shape, inner: &Shape) -> bool {
    face(outer, inner, ISLAND_OPPOSITE)
        && is_hole_around(outer, inner)
        && outer.continues - inner.continues >= ISLAND_SURFACE
        && outer.radius() > inner.radius()
        && (inner.centre - outer.centre).dot(outer.normal).abs() <= OFF_PLANE * outer.area().sqrt()
        && outer.surrounds(inner.centre)
}

/// Run opposite ways round.
fn face(a: &Shape, b: &Shape, opposite: f64) -> bool {
    cosine(a.vector_area, b.vector_area) <= opposite
}

/// How much two loops differ: by their extents, as a share of the larger one, and by the directions of their planes. (The
/// cube puts the threshold, [`ANNULAR`], where one loop is about half the other: rings are closer in size, islands are not.)
fn characteristic_distance(a: &Shape, b: &Shape) -> f64 {
    let size = a.radius().max(b.radius()).max(f64::MIN_POSITIVE);
    let extents = (DVec3::from_array(a.extents) - DVec3::from_array(b.extents)).length() / size;
    extents * extents * extents + 1.0 - a.normal.dot(b.normal).abs()
}

/// Between the nearest of their vertices, or of every few if there are very many.
fn distance(a: &Shape, b: &Shape) -> f64 {
    let others: Vec<DVec3> = some_points(b).collect();
    let to_others = |p: &DVec3| others.iter().map(|q| p.distance_squared(*q)).fold(f64::INFINITY, f64::min);
    some_points(a).map(|p| to_others(&p)).fold(f64::INFINITY, f64::min).sqrt()
}

/// Vertices, or every few if there are very many.
fn some_points(shape: &Shape) -> impl Iterator<Item = DVec3> + '_ {
    shape.points.iter().step_by(shape.points.len().div_ceil(MOST_POINTS)).copied()
}
