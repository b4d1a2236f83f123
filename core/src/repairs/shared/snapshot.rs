//! The triangles of a submesh as they were, to go back to: half of what a copy of them takes.

use crate::contract::repair_name::RepairName;
use crate::submesh::{Origin, Since, Triangle, Vertex};

/// Triangles as they were at `Work::snapshot`. Where they come from and which regions they continue is not kept: that does not change, but for
/// what `Work` notes.
pub(crate) struct Snapshot {
    corners: Vec<[Vertex; 3]>,
    states: Vec<(bool, Option<RepairName>, Since)>,
    /// Triangles that were fetched since.
    fetched: Vec<Triangle>,
    /// So many triangles had been attributed to a repair.
    attributed: usize,
}

impl Snapshot {
    pub(super) fn of(triangles: &[Triangle], attributed: usize) -> Self {
        let corners = triangles.iter().map(|t| t.v).collect();
        let states = triangles.iter().map(|t| (t.alive, t.by, t.since)).collect();
        Self { corners, states, fetched: Vec::new(), attributed }
    }

    /// How many triangles there were, with those that were fetched since.
    pub(crate) fn len(&self) -> usize {
        self.corners.len() + self.fetched.len()
    }

    /// The vertices of a triangle.
    pub(crate) fn corners(&self, t: u32) -> [Vertex; 3] {
        let t = t as usize;
        self.corners.get(t).copied().unwrap_or_else(|| self.fetched[t - self.corners.len()].v)
    }

    fn lived(&self, t: u32) -> bool {
        let t = t as usize;
        self.states.get(t).map_or_else(|| self.fetched[t - self.states.len()].alive, |state| state.0)
    }

    /// Adds a triangle of the file that was fetched since, as it was.
    pub(crate) fn push(&mut self, fetched: Triangle) {
        self.fetched.push(fetched);
    }

    /// Puts everything back. Returns the triangles that were others, and those that had gone from the end.
    pub(super) fn put_back(&self, triangles: &mut Vec<Triangle>, attributed: &mut Vec<(u32, Origin)>) -> Vec<u32> {
        let both = triangles.len().min(self.len()) as u32;
        let is_other = |t: &u32| {
            let now = &triangles[*t as usize];
            now.v != self.corners(*t) || now.alive != self.lived(*t)
        };
        let others = (0..both).filter(is_other).chain(both..self.len() as u32).collect();
        for (t, origin) in attributed.drain(self.attributed..).rev() {
            triangles[t as usize].origin = origin;
        }
        triangles.truncate(self.corners.len());
        for (triangle, (v, (alive, by, since))) in triangles.iter_mut().zip(self.corners.iter().zip(&self.states)) {
            *triangle = Triangle { v: *v, since: *since, alive: *alive, by: *by, ..*triangle };
        }
        triangles.extend_from_slice(&self.fetched);
        others
    }
}

#[cfg(test)]
mod tests {
    use crate::contract::report::RepairName;
    use crate::repairs::shared::work::Work;
    use crate::submesh::Origin;
    use crate::testing::{diagnose, plate, records};
    use crate::util::ids::NONE;

    #[test]
    fn everything_is_as_it_was() {
        let records = records(&plate(2, |_, _| true));
        let mut d = diagnose(&records);
        let mut work = Work::new(&mut d.submesh);
        let (before, count) = (format!("{:?}", work.triangles), work.triangles.len());
        let mut snapshot = work.snapshot();
        work.is_changed_by(RepairName::Fill);
        work.kill(1);
        work.flip(2);
        work.attribute(3, RepairName::Rebuild);
        work.add([0, 1, 4], Origin::Added(RepairName::Fill), NONE);
        work.attribute(4, RepairName::Rebuild);
        work.restore(&snapshot);
        assert_eq!(format!("{:?}", work.triangles), before);
        let fetched = work.triangles[0];
        snapshot.push(fetched);
        work.restore(&snapshot);
        assert_eq!((work.triangles.len(), snapshot.len()), (snapshot.len(), count + 1));
        assert_eq!(snapshot.corners(snapshot.len() as u32 - 1), fetched.v);
    }
}
