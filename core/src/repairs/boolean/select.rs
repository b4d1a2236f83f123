//! What stays of the pieces, in f32.

use glam::DVec3;

use crate::detect::defects;
use crate::geometry::distance::place;
use crate::geometry::position::Position;
use crate::repairs::boolean::cells::{SpaceCells, Windings};
use crate::repairs::boolean::cut::Cut;
use crate::repairs::boolean::state::{Failure, State, Stuck, Tried};
use crate::repairs::cleanup::degenerate;
use crate::repairs::cleanup::duplicates;
use crate::repairs::shared::work::Work;
use crate::submesh::{Submesh, Vertex};
use crate::util::ids::NONE;
use crate::util::radix::sort_by_number;
use crate::util::steps;

/// The fate of a triangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Fate {
    Stays,
    Turns,
    Goes,
    /// Nobody knows.
    Unknown,
}

fn fate(front: Option<i32>, back: Option<i32>) -> Fate {
    match (front, back) {
        (Some(front), Some(back)) => match (front > 0, back > 0) {
            (false, true) => Fate::Stays,
            (true, false) => Fate::Turns,
            _ => Fate::Goes,
        },
        _ => Fate::Unknown,
    }
}

impl State<'_, '_, '_> {
    /// Makes of the submesh what the windings say. Returns how far new vertices were moved.
    pub(crate) fn apply(&mut self, cut: &Cut, sides: &SpaceCells, windings: &Windings<'_>) -> Tried<f64> {
        let of = |[front, back]: [u32; 2]| fate(windings.at(front), windings.at(back));
        let fates: Vec<Fate> = cut.arrangement.pieces.iter().map(|piece| of(piece.cells)).collect();
        let unknown = cut.arrangement.pieces.iter().zip(&fates).filter(|(_, fate)| **fate == Fate::Unknown);
        let triangles: Vec<u32> = unknown.map(|(piece, _)| cut.sources[piece.source as usize]).collect();
        if !triangles.is_empty() {
            return Err(Stuck { failure: Failure::Contradiction, triangles }.into());
        }
        let (work, reversed) = (&mut *self.work, &mut *self.reversed);
        for p in (0..sides.regions).filter(|p| self.clusters.holds_region(*p)) {
            match of(sides.of_region(p)) {
                Fate::Goes => reversed.dropped[p as usize] = true,
                Fate::Turns => reversed.regions[p as usize] ^= true,
                Fate::Stays | Fate::Unknown => {}
            }
        }
        let living: Vec<u32> = work.living().filter(|t| cut.sources.binary_search(t).is_err()).collect();
        for t in living {
            match of(sides.of_triangle(t)) {
                Fate::Goes => work.kill(t),
                Fate::Turns => work.flip(t),
                Fate::Stays | Fate::Unknown => {}
            }
        }
        let whole = whole_sources(work, cut, &fates);
        let mut new = Vec::new();
        for (s, (t, whole)) in cut.sources.iter().zip(whole).enumerate() {
            match whole {
                Some(Fate::Stays | Fate::Unknown) => {}
                Some(Fate::Turns) => work.flip(*t),
                Some(Fate::Goes) => work.kill(*t),
                None => {
                    work.kill(*t);
                    for (piece, fate) in cut.pieces(s).iter().zip(&fates[cut.range(s)]) {
                        let [a, b, c] = piece.v;
                        match fate {
                            Fate::Stays => new.push((*t, [a, b, c])),
                            Fate::Turns => new.push((*t, [a, c, b])),
                            Fate::Goes | Fate::Unknown => {}
                        }
                    }
                }
            }
        }
        Ok(self.put_in(cut, &new))
    }

    /// Puts pieces of triangles into the submesh, their points rounded to f32, and takes out what comes to nothing by that. Returns how far
    /// a point was moved.
    fn put_in(&mut self, cut: &Cut, new: &[(u32, [u32; 3])]) -> f64 {
        let mut displaced = 0f64;
        let mut points: Vec<u32> = new.iter().flat_map(|(_, v)| *v).filter(|p| cut.vertices[*p as usize] == NONE).collect();
        points.sort_unstable();
        points.dedup();
        let mut cut_from = vec![NONE; cut.vertices.len()];
        new.iter().for_each(|(t, v)| v.iter().for_each(|point| cut_from[*point as usize] = *t));
        let step = self.step;
        let rounded = |point: u32| Position::of(cut.arrangement.points[point as usize].map(|x| place_of(x, step)));
        // There may be a vertex already, here or elsewhere in the file.
        self.complete(points.iter().map(|point| rounded(*point).coordinates()).collect());
        let mut known = self.work.by_position_of(points.iter().map(|point| rounded(*point)));
        let mut vertex_of: Vec<Vertex> = cut.vertices.clone();
        for point in points {
            let position = rounded(point);
            let exact = DVec3::from_array(cut.arrangement.points[point as usize]);
            let by = exact.distance(place(position.coordinates()));
            displaced = displaced.max(by);
            self.track.moved(&self.clusters, cut_from[point as usize], by);
            let v = *known.entry(position).or_insert_with(|| self.work.add_vertex(position));
            vertex_of[point as usize] = v;
        }
        let first = self.work.triangles.len() as u32;
        for (t, points) in new {
            let v = points.map(|point| vertex_of[point as usize]);
            let origin = self.work.triangles[*t as usize].origin.of_part();
            if v[0] != v[1] && v[1] != v[2] && v[2] != v[0] {
                self.work.add(v, origin, NONE);
                self.clusters.of_triangle.push(self.clusters.of_triangle[*t as usize]);
            }
        }
        let added: Vec<u32> = (first..self.work.triangles.len() as u32).collect();
        self.clean(&added);
        displaced
    }

    /// Takes out what came to nothing: these triangles have new vertices.
    pub(crate) fn clean(&mut self, changed: &[u32]) {
        duplicates::drop_repeated(self.work);
        cancel(self.work, changed);
        let first = self.work.triangles.len() as u32;
        degenerate::remove(self.work);
        duplicates::drop_repeated(self.work);
        let split: Vec<u32> = (first..self.work.triangles.len() as u32).collect();
        cancel(self.work, &split);
        self.follow();
    }
}

/// A coordinate in f32: what it is, if it has a place there, as in a plane along the axes, else the nearest on the grid.
fn place_of(x: f64, step: f64) -> f32 {
    let nearest = x as f32;
    if f64::from(nearest) == x { nearest } else { on_grid(x, step).clamp(-f32::MAX, f32::MAX) }
}

/// The nearest multiple of a power of two, which is not too small for f32 to have them.
fn on_grid(x: f64, step: f64) -> f32 {
    ((x / step).round() * step) as f32
}

/// A source stays whole if all its pieces share one fate, no other edge that stays crosses its interior (as of a body that stands on it with an
/// edge), and no divided neighbour ends in its interior or on its edges.
fn whole_sources(submesh: &Submesh, cut: &Cut, fates: &[Fate]) -> Vec<Option<Fate>> {
    let count = cut.sources.len();
    let range = |s: usize| cut.range(s);
    let corners = |s: usize| submesh.triangles[cut.sources[s] as usize].v;
    let is_corner = |s: usize, point: &u32| corners(s).contains(&cut.vertices[*point as usize]);
    let mut whole: Vec<Option<Fate>> = (0..count)
        .map(|s| {
            let fates = &fates[range(s)];
            let Some(first) = fates.first() else { return Some(Fate::Goes) };
            if fates.contains(&Fate::Unknown) {
                return Some(Fate::Unknown);
            }
            if !fates.iter().all(|f| f == first) {
                return None;
            }
            if *first == Fate::Goes {
                return Some(Fate::Goes);
            }
            (!cut.arrangement.covered[s]).then_some(*first)
        })
        .collect();
    for around in cut.at_edges().filter(|around| around.len() > 2) {
        let staying = || around.iter().map(|(_, piece)| *piece as usize).filter(|piece| fates[*piece] != Fate::Goes);
        if staying().count() > 2 {
            // In the middle of a source, two of its pieces have the edge.
            let sources: Vec<u32> = staying().map(|piece| cut.arrangement.pieces[piece].source).collect();
            let own = sources.chunk_by(|a, b| a == b).filter(|own| own.len() == 2);
            own.for_each(|own| whole[own[0] as usize] = None);
        }
    }
    let mut uses: Vec<Use> = Vec::new();
    for s in 0..count {
        for piece in cut.pieces(s).iter().zip(&fates[range(s)]).filter(|(_, f)| **f != Fate::Goes).map(|(p, _)| p) {
            uses.extend(piece.v.map(|point| Use { point, source: s as u32, is_corner: is_corner(s, &point) }));
        }
    }
    let is_whole: Vec<bool> = whole.iter().map(|fate| matches!(fate, Some(Fate::Stays | Fate::Turns))).collect();
    let mut stays = is_whole.clone();
    divide_beside(uses, |s| cut.pieces(s).len() > 1, &mut stays);
    for (fate, _) in whole.iter_mut().zip(is_whole.iter().zip(&stays)).filter(|(_, (was, is))| **was && !**is) {
        *fate = None;
    }
    whole
}

/// A source has a piece that stays at a point, and the point may be a corner of its.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Use {
    point: u32,
    source: u32,
    is_corner: bool,
}

/// Sources that would stay whole do not, if they are in several pieces and another source ends at a point of theirs that is no corner of theirs:
/// one that has a corner there, or does not stay whole. O(uses · log): each point is looked at once.
fn divide_beside(mut uses: Vec<Use>, is_divided: impl Fn(usize) -> bool, stays: &mut [bool]) {
    sort_by_number(&mut uses, |used| used.source);
    sort_by_number(&mut uses, |used| used.point);
    uses.dedup();
    let points: Vec<&[Use]> = uses.chunk_by(|a, b| a.point == b.point).collect();
    let mut points_of: Vec<Vec<u32>> = vec![Vec::new(); stays.len()];
    for (number, there) in (0..).zip(&points) {
        there.iter().for_each(|used| points_of[used.source as usize].push(number));
    }
    let ends = |there: &[Use]| there.iter().any(|used| used.is_corner || !stays[used.source as usize]);
    let mut is_end: Vec<bool> = points.iter().map(|there| ends(there)).collect();
    let mut left: Vec<u32> = (0..).zip(&is_end).filter(|(_, is_end)| **is_end).map(|(number, _)| number).collect();
    while let Some(number) = left.pop() {
        for used in points[number as usize] {
            steps::count(1);
            let s = used.source as usize;
            if !used.is_corner && stays[s] && is_divided(s) {
                stays[s] = false;
                left.extend(points_of[s].iter().filter(|p| !std::mem::replace(&mut is_end[**p as usize], true)));
            }
        }
    }
}

/// Takes out triangles on the same three vertices that run against each other, two by two, and all but one of those that do not.
fn cancel(work: &mut Work<'_>, added: &[u32]) {
    for t in added {
        if !work.lives(*t) {
            continue;
        }
        let v = work.triangles[*t as usize].v;
        let mut same: Vec<(u32, bool)> = work
            .star(v[0])
            .map(|(o, _)| o)
            .filter(|o| work.triangles[*o as usize].v.iter().all(|w| v.contains(w)))
            .map(|o| (o, defects::same_direction(v, work.triangles[o as usize].v)))
            .collect();
        same.sort_unstable();
        let with = same.iter().filter(|(_, with)| *with).count();
        let against = same.len() - with;
        // Of those in the majority, the first ones stay.
        let (majority, stay) = (with > against, with.abs_diff(against));
        let mut left = stay;
        for (o, with) in same {
            if with == majority && left > 0 {
                left -= 1;
            } else {
                work.kill(o);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_chain_of_divided_sources_takes_steps_in_proportion() {
        // Each has a point in the middle in common with the next one, and the last one does not stay whole.
        steps::assert_near_linear(1000, |n| {
            let shared = |s: u32| [s, s + 1].map(|point| Use { point, source: s, is_corner: false });
            let uses: Vec<Use> = (0..n as u32).flat_map(shared).collect();
            let mut stays = vec![true; n];
            stays[n - 1] = false;
            let (steps, ()) = steps::of(|| divide_beside(uses, |_| true, &mut stays));
            assert!(!stays.contains(&true));
            steps
        });
    }

    #[test]
    fn a_source_is_divided_where_another_one_ends_but_not_at_its_own_corners() {
        let used = |point, source, is_corner| Use { point, source, is_corner };
        let stay = |uses: &[Use], pieces: [usize; 3], mut stays: [bool; 3]| {
            divide_beside(uses.to_vec(), |s| pieces[s] > 1, &mut stays);
            stays
        };
        let meet = [used(0, 0, false), used(0, 1, true), used(1, 1, true), used(1, 2, true)];
        assert_eq!(stay(&meet, [2; 3], [true; 3]), [false, true, true], "1 ends in the middle of 0");
        assert_eq!(stay(&meet, [1, 2, 2], [true; 3]), [true; 3], "0 is in one piece");
        let middle = [used(0, 0, false), used(0, 1, false), used(1, 1, false), used(1, 2, false)];
        assert_eq!(stay(&middle, [2; 3], [true; 3]), [true; 3], "nothing ends");
        assert_eq!(stay(&middle, [2; 3], [true, true, false]), [false; 3], "2 is cut, and so all are");
    }
}
