//! Does a cell's surface cross itself where it was changed? The search is the one by which whole meshes are judged: exact, and most stars are certified in
//! linear time ([`crate::topology::intersect`]).

use std::collections::BTreeMap;

use crate::algorithms::fans::is_closed_fan;
use crate::geometry::boxes::BoxTree;
use crate::geometry::collinear::is_collinear;
use crate::geometry::exact::Point;
use crate::geometry::sums::Bounds;
use crate::geometry::tri_tri::Triangle;
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

/// A cell as it was before it was changed.
pub(super) struct Before {
    pub(super) points: Vec<Point>,
    /// The vertices of its triangles.
    pub(super) corners: Vec<u32>,
}

/// Where fewer than one of so many triangles have changed, those that are apart from them are not looked at.
const FEW: usize = 8;

/// The triangles of a cell and its obstacles, by numbers of their own for the vertices that they have.
#[derive(Default)]
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
    /// All of them, or where few have changed, those and what their boxes meet; `None` if none has. `vertices`: the numbers of the cell's vertices in the
    /// mesh, ascending.
    fn new(work: &Work, vertices: &[u32], was: &Before) -> Option<Self> {
        let patch = &work.patch;
        let has_moved = |v: u32| patch.points[v as usize] != was.points[v as usize];
        let is_changed = |f: usize, face: [u32; 3]| was.corners[3 * f..3 * f + 3] != face || face.iter().any(|v| has_moved(*v));
        let changed = || patch.faces().filter(|(f, face)| is_changed(*f, *face));
        let count = changed().count();
        if count == 0 {
            return None;
        }
        let boxes = || changed().map(|(_, face)| Bounds::of(&patch.triangle(face))).collect::<Vec<_>>();
        let tree = (FEW * count < patch.live).then(|| BoxTree::new(&boxes()));
        let is_near = |triangle: &Triangle| tree.as_ref().is_none_or(|tree| tree.meets(&Bounds::of(triangle)));
        let mut scene = Self::default();
        let (mut numbers, mut beyond) = (vec![NONE; patch.points.len()], BTreeMap::new());
        let mut number = |scene: &mut Self, v: u32| {
            let number = &mut numbers[v as usize];
            if *number == NONE {
                *number = scene.add(v, patch.points[v as usize], has_moved(v));
            }
            *number
        };
        for (f, face) in patch.faces().filter(|(_, face)| is_near(&patch.triangle(*face))) {
            scene.is_changed.push(is_changed(f, face));
            let face = face.map(|v| number(&mut scene, v));
            scene.triangles.push(face);
        }
        for (face, triangle) in work.obstacles.iter().filter(|(_, triangle)| is_near(triangle)) {
            let face = [0, 1, 2].map(|k: usize| match vertices.binary_search(&face[k]) {
                Ok(v) => number(&mut scene, v as u32),
                Err(_) => *beyond.entry(face[k]).or_insert_with(|| scene.add(NONE, triangle[k], false)),
            });
            scene.is_changed.push(false);
            scene.triangles.push(face);
        }
        Some(scene)
    }

    /// How many of its triangles each vertex has.
    fn counts(&self) -> Vec<usize> {
        let mut counts = vec![0; self.own.len()];
        self.triangles.iter().flatten().for_each(|v| counts[*v as usize] += 1);
        counts
    }

    /// Adds a vertex, and numbers it.
    fn add(&mut self, own: u32, position: Point, has_moved: bool) -> u32 {
        self.own.push(own);
        self.positions.push(position);
        self.has_moved.push(has_moved);
        self.own.len() as u32 - 1
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
    /// ascending. O(n log n).
    pub(super) fn is_crossed(&mut self, work: &Work, vertices: &[u32], was: &Before) -> bool {
        let Some(mut scene) = Scene::new(work, vertices, was) else { return false };
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
            for ((standing, v), count) in standing.iter_mut().zip(&scene.own).zip(scene.counts()) {
                let is_whole = || count == work.patch.count(*v);
                if *v != NONE && is_whole() && is_regular(&work.patch, *v, &mut self.star) {
                    *standing = Standing::Regular;
                }
            }
            left_out.iter().flat_map(|f| scene.triangles[*f as usize]).for_each(|v| standing[v as usize] = Standing::Irregular);
        }
        let view =
            CellView { positions, triangles: &scene.triangles, left_out: &left_out, standing: &standing, cell: HomeBox::ALL };
        let mut is_crossed = false;
        self.finder.pairs(&view, Effort::ALL, |some, others, contact| {
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
    patch.kinds[v as usize] <= CREASE && patch.star(v, star) && is_closed_fan(&mut star.ring[..star.len])
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
        let patch = |points: Vec<Point>| {
            Patch::new(points, vec![Quadric::default(); 4], [vec![FREE; 4], vec![0; 4]], corners.clone(), 1.0)
        };
        let was = Before { points: points.clone(), corners: corners.clone() };
        let [lo, hi] = EVERYWHERE;
        let shape = legal::Bounds { turn: 0.0, feature: -2.0 };
        let rules = Rules { shape, unit: 1.0, limits: [1.0; LIMITS], optimal: false };
        let obstacle = ([7, 8, 9], [[0.0, 0.0, 9.0], [4.0, 0.0, 9.0], [0.0, 4.0, 9.0]]);
        let mut work = Work::new(patch(points), Cell { lo, hi, start: 0, end: 4 }, (vec![obstacle], Vec::new()), rules, false);
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
