//! Does a cell's surface cross itself where it was changed? The search is the one by which whole meshes are judged: exact, and most stars are certified in
//! linear time ([`crate::topology::intersect`]).

use crate::geometry::collinear::is_collinear;
use crate::geometry::exact::Point;
use crate::simplify::cell::Work;
use crate::simplify::patch::{CREASE, Patch, Star};
use crate::stream::plan::HomeBox;
use crate::topology::intersect::{CellView, Effort, Finder, Standing};
use crate::topology::vertex_table::{BATCH, Weld};
use crate::util::ids::NONE;

/// Looks at one cell after the other, and keeps its memory.
#[derive(Default)]
pub(super) struct Look {
    finder: Finder,
    weld: Weld,
    star: Star,
}

/// The triangles of a cell and its obstacles, by numbers of their own for the vertices that they have.
struct Scene {
    positions: Vec<Point>,
    triangles: Vec<[u32; 3]>,
    /// Of the cell's own vertices, their number in the patch; [`NONE`] for others.
    own: Vec<u32>,
    has_moved: Vec<bool>,
    /// By triangles.
    is_changed: Vec<bool>,
}

impl Scene {
    /// `vertices`: the numbers of the cell's vertices in the mesh, ascending; `was`: the triangles and the points as they were.
    fn new(work: &Work, vertices: &[u32], was: &Patch) -> Self {
        let patch = &work.patch;
        let has_moved = |v: u32| patch.points[v as usize] != was.points[v as usize];
        let (mut triangles, mut is_changed) = (Vec::with_capacity(patch.live), Vec::with_capacity(patch.live));
        let (mut numbers, mut own) = (vec![NONE; patch.points.len()], Vec::new());
        let mut number = |v: u32, own: &mut Vec<u32>| {
            let number = &mut numbers[v as usize];
            if *number == NONE {
                *number = own.len() as u32;
                own.push(v);
            }
            *number
        };
        for (f, face) in patch.faces() {
            is_changed.push(was.face(f) != face || face.iter().any(|v| has_moved(*v)));
            triangles.push(face.map(|v| number(v, &mut own)));
        }
        let mut beyond: Vec<(u32, Point)> = Vec::new();
        for (face, triangle) in &work.obstacles {
            beyond.extend(face.iter().copied().zip(*triangle).filter(|(v, _)| vertices.binary_search(v).is_err()));
        }
        beyond.sort_unstable_by_key(|(v, _)| *v);
        beyond.dedup_by_key(|(v, _)| *v);
        let mut corner = |v: u32| match vertices.binary_search(&v) {
            Ok(own_vertex) => Ok(number(own_vertex as u32, &mut own)),
            Err(_) => Err(beyond.partition_point(|(w, _)| *w < v) as u32),
        };
        let corners: Vec<_> = work.obstacles.iter().map(|(face, _)| face.map(&mut corner)).collect();
        let first = own.len() as u32;
        triangles.extend(corners.into_iter().map(|face| face.map(|v| v.unwrap_or_else(|v| first + v))));
        is_changed.resize(triangles.len(), false);
        let moved = own.iter().map(|v| has_moved(*v)).collect();
        // The search knows no −0.0.
        let points = own.iter().map(|v| patch.points[*v as usize]).chain(beyond.iter().map(|(_, p)| *p));
        let positions: Vec<Point> = points.map(|p| p.map(|x| x + 0.0)).collect();
        let mut scene = Self { positions, triangles, own, has_moved: moved, is_changed };
        scene.own.resize(scene.positions.len(), NONE);
        scene.has_moved.resize(scene.positions.len(), false);
        scene
    }

    /// Has a vertex come upon another one? `same`: the number of each one's position.
    fn is_met(&self, same: &[u32]) -> bool {
        let mut is_of_changed = vec![false; self.positions.len()];
        let changed = self.triangles.iter().zip(&self.is_changed).filter(|(_, is_changed)| **is_changed);
        changed.flat_map(|(face, _)| face).for_each(|v| is_of_changed[*v as usize] = true);
        let mut first = vec![NONE; self.positions.len()];
        let mut is_met = false;
        for (v, position) in same.iter().enumerate() {
            let one = &mut first[*position as usize];
            if *one == NONE {
                *one = v as u32;
                continue;
            }
            let w = *one as usize;
            is_met |= self.has_moved[v] || self.has_moved[w] || (is_of_changed[v] && is_of_changed[w]);
            if is_of_changed[v] {
                *one = v as u32;
            }
        }
        is_met
    }
}

impl Look {
    /// Does a triangle that was changed cross another one, or has a vertex that was moved come upon another one? `vertices`: their numbers in the mesh,
    /// ascending; `was`: the triangles and the points as they were. O(n log n).
    pub(super) fn is_crossed(&mut self, work: &Work, vertices: &[u32], was: &Patch) -> bool {
        let mut scene = Scene::new(work, vertices, was);
        if !scene.is_changed.contains(&true) {
            return false;
        }
        let same = self.weld(&scene.positions);
        let are_apart = self.weld.positions().len() == scene.positions.len();
        if !are_apart {
            if scene.is_met(&same) {
                return true;
            }
            for face in &mut scene.triangles {
                let welded = face.map(|v| same[v as usize]);
                let [a, b, c] = welded;
                *face = if a == b || b == c || c == a { [NONE; 3] } else { welded };
            }
        }
        let positions = self.weld.positions();
        let at = |v: u32| &positions[v as usize];
        let is_flat = |face: &[u32; 3]| face[0] != NONE && is_collinear(at(face[0]), at(face[1]), at(face[2]));
        let left_out: Vec<u32> = (0..).zip(&scene.triangles).filter(|(_, face)| is_flat(face)).map(|(f, _)| f).collect();
        // Where vertices coincide, nothing is known of their stars.
        let mut standing = vec![Standing::Irregular; positions.len()];
        if are_apart {
            for (standing, v) in standing.iter_mut().zip(&scene.own) {
                if *v != NONE && is_regular(&work.patch, *v, &mut self.star) {
                    *standing = Standing::Regular;
                }
            }
            left_out.iter().flat_map(|f| scene.triangles[*f as usize]).for_each(|v| standing[v as usize] = Standing::Irregular);
        }
        let view =
            CellView { positions, triangles: &scene.triangles, left_out: &left_out, standing: &standing, cell: HomeBox::ALL };
        let effort = Effort { allowance: u64::MAX, askew: false, around: None };
        let mut is_crossed = false;
        self.finder.pairs(&view, effort, |some, others, contact| {
            is_crossed |= contact.is_crossing() && some.iter().chain(others).any(|t| scene.is_changed[*t as usize]);
        });
        is_crossed
    }

    /// The number of the position of each point.
    fn weld(&mut self, points: &[Point]) -> Vec<u32> {
        self.weld.reset(points.len());
        let mut same = vec![0; points.len()];
        for (points, same) in points.chunks(BATCH).zip(same.chunks_mut(BATCH)) {
            self.weld.vertices(points, same);
        }
        same
    }
}

/// Is a vertex of a cell in the middle of one closed fan whose triangles run the same way?
fn is_regular(patch: &Patch, v: u32, star: &mut Star) -> bool {
    if patch.kinds[v as usize] > CREASE || !patch.star(v, star) {
        return false;
    }
    let rings = &star.ring[..star.len];
    let mut at = rings[0][1];
    for _ in 1..rings.len() {
        let mut next = rings.iter().filter(|ring| ring[0] == at);
        let (Some(one), None) = (next.next(), next.next()) else { return false };
        if one[0] == rings[0][0] {
            return false;
        }
        at = one[1];
    }
    rings.len() > 2 && at == rings[0][0]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simplify::cell::{LIMITS, Rules};
    use crate::simplify::legal;
    use crate::simplify::partition::{Cell, EVERYWHERE};
    use crate::simplify::patch::FREE;
    use crate::simplify::quadric::Quadric;

    /// A tetrahedron, and beside it a triangle of other cells; `to`: where its tip goes.
    fn is_crossed(to: Point, tip: Point) -> bool {
        let points = vec![[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0], tip];
        let corners = vec![0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3];
        let patch =
            |points: Vec<Point>| Patch::new(points, vec![Quadric::default(); 4], [vec![FREE; 4], vec![0; 4]], corners.clone());
        let was = patch(points);
        let [lo, hi] = EVERYWHERE;
        let shape = legal::Bounds { turn: 0.0, feature: -2.0 };
        let rules = Rules { shape, limits: [1.0; LIMITS], optimal: false };
        let obstacle = ([7, 8, 9], [[0.0, 0.0, 9.0], [4.0, 0.0, 9.0], [0.0, 4.0, 9.0]]);
        let mut work = Work::new(was.clone(), Cell { lo, hi, start: 0, end: 4 }, (vec![obstacle], Vec::new()), rules, false);
        work.patch.points[3] = to;
        Look::default().is_crossed(&work, &[0, 1, 2, 3], &was)
    }

    #[test]
    fn only_what_was_changed_can_cross() {
        let (below, through, upon) = ([1.0, 1.0, 5.0], [1.0, 1.0, 10.0], [0.0, 0.0, 9.0]);
        assert!(!is_crossed(below, [1.0, 1.0, 4.0]), "it is apart");
        assert!(is_crossed(through, below), "it goes through the obstacle");
        assert!(!is_crossed(through, through), "it did so before");
        assert!(is_crossed(upon, below), "it comes upon a vertex");
        assert!(is_crossed([1.0, 1.0, 0.0], below), "it is flat, on its own base");
    }
}
