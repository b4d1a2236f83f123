//! Closed surfaces that are drawn several times, wholly or in part, each time with directions of its own.
//!
//! Where triangles on the same three vertices count as one, such a surface is closed, manifold and orientable by itself: at every edge there are two of
//! them. Nothing else hangs together with it, so that its copies are no walls of other bodies. It is drawn again if fewer than half of what is there more
//! than once is there as often in one direction as in the other: else it is a body with both sides, or a core and its pocket, and
//! [`super::back_to_back`] decides. Which way the file's triangles face says nothing else here, since some are turned.

use crate::detect::defects::vertex_set;
use crate::submesh::edges::{Edge, Edges};
use crate::submesh::{Submesh, Vertex};
use crate::util::bits;

/// By triangle: which way round it has to be to go with the first one of its surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Way {
    Unknown,
    AsDrawn,
    Turned,
}

impl Way {
    fn of(as_drawn: bool) -> Self {
        if as_drawn { Self::AsDrawn } else { Self::Turned }
    }
}

/// Surfaces as they are walked over.
struct Walk<'m> {
    submesh: &'m Submesh,
    edges: &'m Edges,
    way: Vec<Way>,
    /// Edges that were passed, a bit each.
    passed: Vec<u64>,
}

/// The triangles of such surfaces that are to go, ascending: of each set of vertices one stays, as more of the surface is drawn if there is one.
/// `all`: the triangles by vertex set. O(submesh).
pub(crate) fn surplus(submesh: &Submesh, edges: &Edges, all: &[([Vertex; 3], u32)]) -> Vec<u32> {
    let mut walk =
        Walk { submesh, edges, way: vec![Way::Unknown; submesh.triangles.len()], passed: vec![0; edges.len().div_ceil(64)] };
    let mut goes = Vec::new();
    for group in all.chunk_by(|a, b| a.0 == b.0).filter(|group| group.len() > 1) {
        if walk.way[group[0].1 as usize] == Way::Unknown
            && let Some(surface) = walk.surface(group[0].1)
        {
            goes.extend(walk.copies(surface));
        }
    }
    goes.sort_unstable();
    goes
}

impl Walk<'_> {
    /// All triangles that hang together with one, if they are a closed surface as above.
    fn surface(&mut self, first: u32) -> Option<Vec<u32>> {
        let (mut surface, mut next, mut is_closed) = (vec![first], 0, true);
        self.way[first as usize] = Way::AsDrawn;
        while let Some(t) = surface.get(next).copied() {
            next += 1;
            let v = self.submesh.triangles[t as usize].v;
            for (a, b) in [(v[0], v[1]), (v[1], v[2]), (v[2], v[0])] {
                // Regular surface begins at an edge that is not in the table.
                let Some(number) = self.edges.number(a, b) else {
                    is_closed = false;
                    continue;
                };
                if !bits::holds(&self.passed, number as usize) {
                    bits::put(&mut self.passed, number as usize);
                    is_closed &= self.pass(t, &self.edges.get(number as usize), &mut surface);
                }
            }
        }
        is_closed.then_some(surface)
    }

    /// Goes on to all triangles at an edge of `t`. Are they on two sets of vertices, and do they go with what is known?
    fn pass(&mut self, t: u32, edge: &Edge<'_>, surface: &mut Vec<u32>) -> bool {
        let submesh = self.submesh;
        let apex = |t: u32| submesh.triangles[t as usize].v.into_iter().find(|v| ![edge.low, edge.high].contains(v));
        let own = apex(t);
        let is_forward = |t: u32| edge.uses.iter().any(|u| u.triangle() == t && u.forward());
        let along = is_forward(t) == (self.way[t as usize] == Way::AsDrawn);
        let (mut other, mut is_closed) = (None, true);
        for used in edge.uses {
            let beyond = apex(used.triangle());
            if beyond != own {
                is_closed &= other.is_none_or(|known| known == beyond);
                other = Some(beyond);
            }
            let way = Way::of(used.forward() == (along == (beyond == own)));
            match std::mem::replace(&mut self.way[used.triangle() as usize], way) {
                Way::Unknown => surface.push(used.triangle()),
                known => is_closed &= known == way,
            }
        }
        is_closed && other.is_some()
    }

    /// All triangles of a surface but one on each set of vertices, if it is drawn again.
    fn copies(&self, surface: Vec<u32>) -> Vec<u32> {
        let mut sets: Vec<([Vertex; 3], u32)> = surface.into_iter().map(|t| (vertex_set(self.submesh, t), t)).collect();
        sets.sort_unstable();
        let as_drawn = |set: &[([Vertex; 3], u32)]| set.iter().filter(|(_, t)| self.way[*t as usize] == Way::AsDrawn).count();
        let (mut more_than_once, mut both_ways, mut more_as_drawn) = (0usize, 0usize, 0isize);
        for set in sets.chunk_by(|a, b| a.0 == b.0) {
            let forward = as_drawn(set);
            more_than_once += usize::from(set.len() > 1);
            both_ways += usize::from(2 * forward == set.len());
            more_as_drawn += 2 * forward as isize - set.len() as isize;
        }
        if 2 * both_ways >= more_than_once {
            return Vec::new();
        }
        let wanted = Way::of(more_as_drawn >= 0);
        let mut goes = Vec::new();
        for set in sets.chunk_by(|a, b| a.0 == b.0) {
            let stays = set.iter().find(|(_, t)| self.way[*t as usize] == wanted).unwrap_or(&set[0]).1;
            goes.extend(set.iter().map(|(_, t)| *t).filter(|t| *t != stays));
        }
        goes
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::detect::defects::by_vertex_set;
    use crate::testing::{Corners, cube, cuboid, diagnose, records, reversed, shifted};

    fn surplus_of(submesh: &Submesh) -> Vec<u32> {
        surplus(submesh, &Edges::of(submesh), &by_vertex_set(submesh))
    }

    fn left(triangles: &[Corners]) -> Vec<Corners> {
        let records = records(triangles);
        let d = diagnose(&records);
        let goes = surplus_of(&d.submesh);
        d.submesh.living().filter(|t| goes.binary_search(t).is_err()).map(|t| d.submesh.points(t)).collect()
    }

    fn turned(triangles: Vec<Corners>, is_turned: &[bool]) -> Vec<Corners> {
        let turn = |(t, is_turned): (Corners, &bool)| if *is_turned { [t[0], t[2], t[1]] } else { t };
        triangles.into_iter().zip(is_turned).map(turn).collect()
    }

    proptest! {
        /// Two cubes, each drawn twice, all at random: nothing or all copies of a cube go, and of each place one stays.
        #[test]
        fn a_body_never_loses_a_place(is_turned in prop::collection::vec(any::<bool>(), 48)) {
            let two = [cube(), shifted(&cube(), [3.0, 0.0, 0.0])].concat();
            let left = left(&turned([&two[..], &two[..]].concat(), &is_turned));
            for one in [&two[..12], &two[12..]] {
                let places: Vec<usize> = one
                    .iter()
                    .map(|t| left.iter().filter(|l| t.iter().all(|p| l.contains(p))).count())
                    .collect();
                prop_assert!(places == [1; 12] || places == [2; 12], "{places:?}");
            }
        }
    }

    #[test]
    fn of_three_drawings_one_of_them_turned_one_stays() {
        let mesh = [cube(), reversed(&cube()), cube()].concat();
        assert_eq!(left(&mesh).len(), 12);
        // Half of it only once, and one triangle turned.
        let mut part = [cube(), cube()[..6].to_vec()].concat();
        part[14] = reversed(&part[14..15])[0];
        assert_eq!(left(&part), cube());
    }

    #[test]
    fn walls_and_bodies_with_both_sides_are_left_to_others() {
        let goes = |mesh: &[Corners]| {
            let records = records(mesh);
            let d = diagnose(&records);
            surplus_of(&d.submesh)
        };
        assert!(goes(&[cube(), reversed(&cube())].concat()).is_empty());
        // Two boxes side by side, and two with a bottom in common.
        assert!(goes(&[cube(), cuboid([1.0, 0.0, 0.0], [2.0, 1.0, 1.0])].concat()).is_empty());
        assert!(goes(&[cube(), cuboid([0.0; 3], [1.0, 1.0, 2.0])].concat()).is_empty());
        // An open one has no inside.
        assert!(goes(&[&cube()[1..], &cube()[1..]].concat()).is_empty());
    }
}
