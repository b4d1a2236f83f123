//! The surface as the repairs have left it: the file's records, less those that are gone, with what the submesh has instead.

use crate::detect::fresh::{self, Listed};
use crate::geometry::position;
use crate::geometry::tri_tri::{self, Contact, Triangle as Corners};
use crate::output::edit;
use crate::submesh::components::Reversed;
use crate::submesh::{Origin, Submesh};
use crate::topology::crossings::Pair;
use crate::topology::survey::Survey;

/// A triangle of the surface as it is now: a record that stands as it was read, or a triangle of the submesh that does not. Records come first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) struct Standing(u32);

/// A triangle of the surface, or of others that are held against it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Held {
    Surface(Standing),
    /// So many others come before it.
    Other(u32),
}

/// Whose number a [`Standing`] is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Which {
    Record(u32),
    Submesh(u32),
}

impl Which {
    pub(crate) fn record(self) -> Option<u32> {
        match self {
            Self::Record(record) => Some(record),
            Self::Submesh(_) => None,
        }
    }
}

/// Two triangles that cross or overlap, the smaller number first, and how they meet.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StandingPair {
    pub(crate) triangles: [Standing; 2],
    pub(crate) contact: Contact,
}

/// Which records stand as they were read (perhaps turned), and which triangles of the submesh do not.
///
/// A [`Standing`] is the record's number if it stands as it was read, else the number of records plus its number in the submesh.
pub(crate) struct Overlay {
    /// Records, ascending.
    gone: Vec<u32>,
    /// Records of regions that were dropped, a bit each; empty if there are none.
    dropped: Vec<u64>,
    /// Living triangles of the submesh that are not as read, ascending.
    changed: Vec<u32>,
    records: u32,
}

impl StandingPair {
    fn of(pair: Pair) -> Self {
        Self { triangles: pair.triangles.map(Standing), contact: pair.contact }
    }
}

impl Overlay {
    /// O(submesh), and a pass over the records of dropped regions. `None` if the file holds too many triangles to number them.
    pub(crate) fn of(survey: &Survey<'_>, submesh: &Submesh, reversed: &Reversed) -> Option<Self> {
        let records = survey.records.len() as u32;
        records.checked_add(submesh.triangles.len() as u32)?;
        let (mut gone, mut changed) = (Vec::new(), Vec::new());
        for t in submesh.beside_records(survey) {
            let stands = submesh.stands(survey.records, t);
            if let Origin::Input(place) = submesh.triangles[t as usize].origin
                && !stands
            {
                gone.push(place);
            }
            if submesh.lives(t) && !stands {
                changed.push(t);
            }
        }
        gone.sort_unstable();
        let (dropped, _) = edit::records_of(survey, |region| reversed.dropped[region as usize]);
        Some(Self { gone, dropped, changed, records })
    }

    /// Does this record not stand any more?
    fn is_gone(&self, record: u32) -> bool {
        let bit = |word: &u64| word >> (record % 64) & 1 == 1;
        self.gone.binary_search(&record).is_ok() || self.dropped.get(record as usize / 64).is_some_and(bit)
    }

    /// The number of a changed triangle.
    fn number(&self, changed: u32) -> u32 {
        self.records + changed
    }

    /// Changed triangles by their places in a list.
    fn numbered(&self, submesh: &Submesh, list: &[u32]) -> impl Fn(usize) -> (u32, Corners) + Sync {
        move |i| (self.number(list[i]), submesh.points(list[i]))
    }

    /// The record or the triangle of the submesh that a number stands for.
    pub(crate) fn which(&self, number: Standing) -> Which {
        match self.changed_of(number) {
            Some(t) => Which::Submesh(t),
            None => Which::Record(number.0),
        }
    }

    /// The triangle of the submesh that a number stands for, unless it stands for a record.
    pub(crate) fn changed_of(&self, number: Standing) -> Option<u32> {
        number.0.checked_sub(self.records)
    }

    /// The record that a number stands for, unless it stands for a triangle of the submesh.
    pub(crate) fn record_of(&self, number: Standing) -> Option<u32> {
        self.which(number).record()
    }

    /// The corners of the triangle that a number stands for.
    pub(crate) fn corners(&self, survey: &Survey<'_>, submesh: &Submesh, number: Standing) -> Corners {
        match self.which(number) {
            Which::Submesh(t) => submesh.points(t),
            Which::Record(record) => position::corners(&survey.records[record as usize]),
        }
    }

    /// All pairs that cross or overlap, by their numbers; `None` if those of the input are not known, or it is too much work to tell. Holds what
    /// changed against everything in the file.
    pub(crate) fn crossing_pairs(&self, survey: &Survey<'_>, submesh: &Submesh) -> Option<Vec<[Standing; 2]>> {
        let known = survey.crossing_pairs.as_ref()?.iter().map(|pair| pair.triangles);
        let known = known.filter(|pair| !pair.iter().any(|record| self.is_gone(*record)));
        let mut pairs: Vec<[Standing; 2]> = known.map(|pair| pair.map(Standing)).collect();
        if !self.changed.is_empty() {
            pairs.extend(self.met_by(survey, submesh, |_| true)?.iter().map(|pair| pair.triangles));
        }
        Some(pairs)
    }

    /// The same, by what the numbers stand for.
    pub(crate) fn crossing_triangles(&self, survey: &Survey<'_>, submesh: &Submesh) -> Option<Vec<[Which; 2]>> {
        let pairs = self.crossing_pairs(survey, submesh)?;
        Some(pairs.into_iter().map(|pair| pair.map(|number| self.which(number))).collect())
    }

    /// Which pairs with one of the changed triangles that are `fresh` cross or overlap, by their numbers; `None` if that is too much work to
    /// tell. O(boxes around them).
    pub(crate) fn met_by(
        &self,
        survey: &Survey<'_>,
        submesh: &Submesh,
        fresh: impl Fn(u32) -> bool,
    ) -> Option<Vec<StandingPair>> {
        let (fresh, beside): (Vec<u32>, Vec<u32>) = self.changed.iter().partition(|t| fresh(**t));
        let [of_fresh, of_beside] = [&fresh, &beside].map(|list| self.numbered(submesh, list));
        let found = fresh::met_by(
            survey,
            Listed { count: fresh.len(), of: &of_fresh },
            Listed { count: beside.len(), of: &of_beside },
            |place| self.is_gone(place),
            u64::from(self.records) + submesh.triangles.len() as u64,
            fresh::self_intersection,
        )?;
        Some(found.into_iter().map(StandingPair::of).collect())
    }

    /// Which pairs with one of these other triangles, which are not of the surface, cross or overlap. They are some of so many, and go by their numbers
    /// among these. `stays`: whether a changed triangle is held against them; `goes`: a record is not. `None` if there are too many to number, or it is too much work to tell. O(boxes around them).
    pub(crate) fn met_by_others(
        &self,
        survey: &Survey<'_>,
        submesh: &Submesh,
        (count, others): (u32, &[(u32, Corners)]),
        stays: impl Fn(u32) -> bool,
        goes: impl Fn(u32) -> bool + Sync,
    ) -> Option<Vec<[Held; 2]>> {
        let first = self.records.checked_add(submesh.triangles.len() as u32)?;
        let total = first.checked_add(count)?;
        let beside: Vec<u32> = self.changed.iter().copied().filter(|t| stays(*t)).collect();
        let (of_beside, of_others) = (self.numbered(submesh, &beside), |i: usize| (first + others[i].0, others[i].1));
        let found = fresh::met_by(
            survey,
            Listed { count: others.len(), of: &of_others },
            Listed { count: beside.len(), of: &of_beside },
            |record| self.is_gone(record) || goes(record),
            u64::from(total),
            fresh::self_intersection,
        )?;
        let held = |number: u32| match number.checked_sub(first) {
            Some(other) => Held::Other(other),
            None => Held::Surface(Standing(number)),
        };
        Some(found.into_iter().map(|pair| pair.triangles.map(held)).collect())
    }

    /// Which of these triangles of the submesh, ascending, have an edge that runs along an edge of another triangle without being the same, by
    /// their numbers; `None` if that is too much work to tell. O(boxes around them).
    pub(crate) fn edges_along(&self, survey: &Survey<'_>, submesh: &Submesh, of: &[u32]) -> Option<Vec<[Standing; 2]>> {
        let as_read = |t: u32| match submesh.triangles[t as usize].origin {
            Origin::Input(record) if self.changed.binary_search(&t).is_err() => Some(record),
            _ => None,
        };
        let mut asked: Vec<u32> = of.iter().filter_map(|t| as_read(*t)).collect();
        asked.sort_unstable();
        let beside: Vec<u32> = self.changed.iter().copied().filter(|t| of.binary_search(t).is_err()).collect();
        let of_fresh = |i: usize| (as_read(of[i]).unwrap_or(self.number(of[i])), submesh.points(of[i]));
        let of_beside = self.numbered(submesh, &beside);
        let found = fresh::met_by(
            survey,
            Listed { count: of.len(), of: &of_fresh },
            Listed { count: beside.len(), of: &of_beside },
            |place| self.is_gone(place) || asked.binary_search(&place).is_ok(),
            u64::from(self.records) + submesh.triangles.len() as u64,
            tri_tri::edge_along_edge,
        )?;
        Some(found.into_iter().map(|pair| StandingPair::of(pair).triangles).collect())
    }
}
