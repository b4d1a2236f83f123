//! The surface as the repairs have left it: the file's records, less those that are gone, with what the submesh has instead.

use crate::detect::fresh;
use crate::geometry::position;
use crate::geometry::tri_tri::{self, Triangle as Corners};
use crate::io::record;
use crate::output::edit;
use crate::submesh::components::Reversed;
use crate::submesh::{Origin, Submesh};
use crate::topology::crossings::Pair;
use crate::topology::survey::Survey;

/// Which records stand as they were read (perhaps turned), and which triangles of the submesh do not.
///
/// Here a triangle has one number: that of its record if it stands as it was read, else the number of records and its own in the submesh.
pub(crate) struct Overlay {
    /// Records, ascending.
    gone: Vec<u32>,
    /// Records of patches that were dropped, a bit each; empty if there are none.
    dropped: Vec<u64>,
    /// Living triangles of the submesh that are not as read, ascending.
    changed: Vec<u32>,
    records: u32,
}

impl Overlay {
    /// O(submesh), and a pass over the records of dropped patches. `None` if the file holds too many triangles to number them.
    pub(crate) fn of(survey: &Survey<'_>, submesh: &Submesh, reversed: &Reversed) -> Option<Self> {
        let records = survey.records.len() as u32;
        records.checked_add(submesh.triangles.len() as u32)?;
        let (mut gone, mut changed) = (Vec::new(), Vec::new());
        for t in 0..submesh.triangles.len() as u32 {
            let (triangle, lives) = (&submesh.triangles[t as usize], submesh.lives(t));
            let stands = match triangle.origin {
                Origin::Input(place) => {
                    let stands = lives && same_corners(record::corners(&survey.records[place as usize]), submesh.points(t));
                    if !stands {
                        gone.push(place);
                    }
                    stands
                }
                Origin::Part(_) | Origin::Patch => false,
            };
            if lives && !stands {
                changed.push(t);
            }
        }
        gone.sort_unstable();
        let (dropped, _) = edit::records_of(survey, |patch| reversed.dropped[patch as usize]);
        Some(Self { gone, dropped, changed, records })
    }

    /// Living triangles of the submesh that are not as read, ascending.
    pub(crate) fn changed(&self) -> &[u32] {
        &self.changed
    }

    /// Does this record not stand any more?
    pub(crate) fn is_gone(&self, record: u32) -> bool {
        let bit = |word: &u64| word >> (record % 64) & 1 == 1;
        self.gone.binary_search(&record).is_ok() || self.dropped.get(record as usize / 64).is_some_and(bit)
    }

    /// The number of a changed triangle.
    pub(crate) fn number(&self, changed: u32) -> u32 {
        self.records + changed
    }

    /// The triangle of the submesh that a number stands for, unless it stands for a record.
    pub(crate) fn changed_of(&self, number: u32) -> Option<u32> {
        number.checked_sub(self.records)
    }

    /// The corners of the triangle that a number stands for.
    pub(crate) fn corners(&self, survey: &Survey<'_>, submesh: &Submesh, number: u32) -> Corners {
        match self.changed_of(number) {
            Some(t) => submesh.points(t),
            None => position::corners(&survey.records[number as usize]),
        }
    }

    /// All pairs that cross or overlap, by their numbers; `None` if those of the input are not known, or it is too much work to tell. Holds what
    /// changed against everything in the file.
    pub(crate) fn crossing_pairs(&self, survey: &Survey<'_>, submesh: &Submesh) -> Option<Vec<[u32; 2]>> {
        let known = survey.crossing_pairs.as_ref()?.iter().map(|pair| pair.triangles);
        let mut pairs: Vec<[u32; 2]> = known.filter(|pair| !pair.iter().any(|record| self.is_gone(*record))).collect();
        if !self.changed.is_empty() {
            pairs.extend(self.met_by(survey, submesh, |_| true)?.iter().map(|pair| pair.triangles));
        }
        Some(pairs)
    }

    /// Which pairs with one of the changed triangles that are `fresh` cross or overlap, by their numbers; `None` if that is too much work to
    /// tell. O(boxes around them).
    pub(crate) fn met_by(&self, survey: &Survey<'_>, submesh: &Submesh, fresh: impl Fn(u32) -> bool) -> Option<Vec<Pair>> {
        let numbered = |t: &u32| (self.number(*t), submesh.points(*t));
        fresh::met_by(
            survey,
            self.changed.iter().filter(|t| fresh(**t)).map(numbered),
            self.changed.iter().filter(|t| !fresh(**t)).map(numbered),
            |place| self.is_gone(place),
            u64::from(self.records) + submesh.triangles.len() as u64,
            fresh::self_intersection,
        )
    }

    /// Which of these triangles of the submesh, ascending, have an edge that runs along an edge of another triangle without being the same, by
    /// their numbers; `None` if that is too much work to tell. O(boxes around them).
    pub(crate) fn edges_along(&self, survey: &Survey<'_>, submesh: &Submesh, of: &[u32]) -> Option<Vec<[u32; 2]>> {
        let as_read = |t: u32| match submesh.triangles[t as usize].origin {
            Origin::Input(record) if self.changed.binary_search(&t).is_err() => Some(record),
            _ => None,
        };
        let mut asked: Vec<u32> = of.iter().filter_map(|t| as_read(*t)).collect();
        asked.sort_unstable();
        let found = fresh::met_by(
            survey,
            of.iter().map(|t| (as_read(*t).unwrap_or(self.number(*t)), submesh.points(*t))),
            self.changed.iter().filter(|t| of.binary_search(t).is_err()).map(|t| (self.number(*t), submesh.points(*t))),
            |place| self.is_gone(place) || asked.binary_search(&place).is_ok(),
            u64::from(self.records) + submesh.triangles.len() as u64,
            tri_tri::edge_along_edge,
        )?;
        Some(found.iter().map(|pair| pair.triangles).collect())
    }
}

/// Comparing as numbers, whichever way round.
fn same_corners(a: Corners, b: Corners) -> bool {
    a == b || [a[0], a[2], a[1]] == b
}
