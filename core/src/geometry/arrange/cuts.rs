//! The segments that every triangle is cut along: those of all pairs, each once.

use crate::geometry::arrange::contact::contact;
use crate::geometry::arrange::soup::{Contacts, Edge, End, Soup};
use crate::geometry::arrange::table::Table;
use crate::geometry::boxes::BoxTree;
use crate::geometry::sums::Bounds;
use crate::util::parallel;

/// A segment in a triangle.
pub(crate) struct Segment {
    pub(crate) ends: [u32; 2],
    /// The other triangle, and if that one lies in the same plane, the edge of either.
    pub(crate) other: u32,
    pub(crate) edge: Option<Edge>,
}

/// A part of a triangle's edge that cuts another one: its ends, and the corner where the edge begins.
pub(crate) type Side = ([u32; 2], u8);

/// By triangle.
pub(crate) struct Cuts {
    pub(crate) segments: Vec<Vec<Segment>>,
    pub(crate) sides: Vec<Vec<Side>>,
}

pub(crate) fn sorted([a, b]: [u32; 2]) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

impl Cuts {
    /// Of triangles that have an area. `corners` by their numbers in the table.
    pub(crate) fn of(soup: &Soup<'_>, threads: usize, has_area: &[bool], corners: &[[u32; 3]], table: &mut Table) -> Self {
        let boxes: Vec<Bounds> = soup.triangles.iter().map(|t| Bounds::of(t)).collect();
        let tree = BoxTree::new(&boxes);
        let of = |near: &mut Vec<u32>, t: usize| {
            let mut contacts = Contacts::default();
            if has_area[t] {
                tree.meeting(&boxes[t], near);
                let later = near.iter().map(|other| *other as usize).filter(|other| *other > t && has_area[*other]);
                later.for_each(|other| contact(soup, t, other, &mut contacts));
            }
            contacts
        };
        let all = parallel::map_with(threads, boxes.len(), Vec::new, of);
        let mut cuts = Self::with_room_for(&all);
        for (t, Contacts { all, points }) in all.into_iter().enumerate() {
            let points: Vec<u32> = points.into_iter().map(|point| table.intern(point)).collect();
            for contact in all {
                let ends = contact.ends.map(|end| match end {
                    End::Corner(Edge { triangle, k }) => corners[triangle as usize][k as usize],
                    End::Point(point) => points[point as usize],
                });
                cuts.add(t, contact.other, ends, contact.edge);
                cuts.add(contact.other as usize, t as u32, ends, contact.edge);
            }
        }
        cuts.finish();
        cuts
    }

    fn with_room_for(all: &[Contacts]) -> Self {
        let mut room = vec![[0; 2]; all.len()];
        for (t, contacts) in all.iter().enumerate() {
            for contact in &contacts.all {
                for t in [t, contact.other as usize] {
                    room[t][usize::from(is_side(t, contact.edge))] += 1;
                }
            }
        }
        Self {
            segments: room.iter().map(|room| Vec::with_capacity(room[0])).collect(),
            sides: room.iter().map(|room| Vec::with_capacity(room[1])).collect(),
        }
    }

    fn add(&mut self, t: usize, other: u32, ends: [u32; 2], edge: Option<Edge>) {
        match edge {
            Some(Edge { k, .. }) if is_side(t, edge) => self.sides[t].push((sorted(ends), k)),
            _ => self.segments[t].push(Segment { ends, other, edge }),
        }
    }

    /// An edge of two triangles cuts another one twice.
    fn finish(&mut self) {
        for segments in &mut self.segments {
            segments.sort_by_key(|segment| sorted(segment.ends));
            segments.dedup_by_key(|segment| sorted(segment.ends));
        }
        for sides in &mut self.sides {
            sides.sort_unstable();
            sides.dedup();
        }
    }
}

/// Does a triangle have this edge itself?
fn is_side(t: usize, edge: Option<Edge>) -> bool {
    edge.is_some_and(|edge| edge.triangle as usize == t)
}
