//! The submesh while it is repaired: changed by way of here only, so that what is known of it is known to be true.
//!
//! The edges are made when they are asked for and kept until something changes. What was changed is noted, so that a pass which
//! has seen everything once looks only at what is new to it the next time.

use std::ops::Deref;
use std::sync::Arc;

use crate::contract::report::RepairName;
use crate::geometry::position::Position;
use crate::repairs::shared::snapshot::Snapshot;
use crate::submesh::components::{Components, Reversed, Through};
use crate::submesh::edges::Edges;
use crate::submesh::{Origin, Since, Submesh, Triangle, Vertex};
use crate::topology::chunk::IrregularTriangle;
use crate::topology::survey::Survey;
use crate::util::ids::NONE;
use crate::util::lean;
use crate::util::steps;

/// A pass that makes sure of something about every triangle, or every set of three vertices, which holds until one of the triangles
/// gets another vertex.
#[derive(Clone, Copy)]
pub(crate) enum Pass {
    Repeated,
    Collinear,
    Copies,
}

/// The submesh under repair. Reading goes through to it; what changes it goes through here.
pub(crate) struct Work<'a> {
    submesh: &'a mut Submesh,
    edges: Option<Edges>,
    components: Option<Arc<Components>>,
    /// Triangles as they were added, got another vertex or came to life again. Some may be gone since.
    changed: Vec<u32>,
    /// How many of these each pass has seen; `None`: it has to look at everything.
    seen: [Option<usize>; 3],
    journal: Option<Journal>,
    /// Triangles that were attributed to a repair, with their origin before.
    attributed: Vec<(u32, Origin)>,
    /// Counts the changes.
    version: u64,
    /// Who changes it.
    by: Option<RepairName>,
}

/// Triangles as they were at a [`Work::mark`]: enough to take back everything since.
struct Journal {
    /// How many triangles there were.
    count: usize,
    /// Those of them that have changed since, each time as they were before.
    old: Vec<(u32, Triangle)>,
}

impl Deref for Work<'_> {
    type Target = Submesh;

    fn deref(&self) -> &Submesh {
        self.submesh
    }
}

impl<'a> Work<'a> {
    pub(crate) fn new(submesh: &'a mut Submesh) -> Self {
        Self {
            submesh,
            edges: None,
            components: None,
            changed: Vec::new(),
            seen: [None; 3],
            journal: None,
            attributed: Vec::new(),
            version: 0,
            by: None,
        }
    }

    /// The mesh with its edges. O(submesh) after a change, O(1) else.
    pub(crate) fn edges(&mut self) -> (&Submesh, &Edges) {
        let edges = self.edges.get_or_insert_with(|| Edges::of(self.submesh));
        (self.submesh, edges)
    }

    /// The components that hang together through edges, as they stand in the file. O(regions + submesh) after a change, O(1) else.
    pub(crate) fn components(&mut self, survey: &Survey<'_>) -> Arc<Components> {
        if let Some(known) = &self.components {
            return known.clone();
        }
        let (submesh, edges) = self.edges();
        let all = Components::of(survey, submesh, edges, &Reversed::none(survey), Through::EveryEdge);
        self.components.insert(Arc::new(all)).clone()
    }

    /// The edges as they are now, to be kept while the mesh changes.
    pub(crate) fn take_edges(&mut self) -> Edges {
        self.edges.take().unwrap_or_else(|| Edges::of(self.submesh))
    }

    /// Gives the memory of edges and components back, before it is needed for what changes the mesh.
    pub(crate) fn forget_edges(&mut self) {
        (self.edges, self.components) = (None, None);
    }

    /// What may have changed since `pass` asked last, ascending, each once; `None`: it has to look at everything.
    pub(crate) fn changed_for(&mut self, pass: Pass) -> Option<Vec<u32>> {
        let seen = self.seen[pass as usize].replace(self.changed.len())?;
        let is_there = |t: &u32| (*t as usize) < self.submesh.triangles.len();
        let mut changed: Vec<u32> = self.changed[seen..].iter().copied().filter(is_there).collect();
        changed.sort_unstable();
        changed.dedup();
        Some(changed)
    }

    /// From here on changes are noted, so that they can be taken back, until [`Self::keep`].
    pub(crate) fn mark(&mut self) {
        self.journal = Some(Journal { count: self.submesh.triangles.len(), old: Vec::new() });
    }

    /// The edges of what has changed since the mark, as they were and as they are, each once; `None` if there is no mark.
    pub(crate) fn edges_since_mark(&self) -> Option<Vec<[Vertex; 2]>> {
        let Journal { count, old } = self.journal.as_ref()?;
        let now = old.iter().map(|(t, _)| *t).chain(*count as u32..self.submesh.triangles.len() as u32);
        let triangles = old.iter().map(|(_, triangle)| triangle.v).chain(now.map(|t| self.submesh.triangles[t as usize].v));
        let mut edges: Vec<[Vertex; 2]> = triangles
            .flat_map(|[a, b, c]| [[a, b], [b, c], [c, a]])
            .map(|[a, b]| [a.min(b), a.max(b)])
            .filter(|[a, b]| a != b)
            .collect();
        edges.sort_unstable();
        edges.dedup();
        steps::count(edges.len());
        Some(edges)
    }

    /// Ends a mark: all changes since stay.
    pub(crate) fn keep(&mut self) {
        self.journal = None;
    }

    /// Puts all triangles back to what they were at the mark. Returns how many there were, and the numbers of those that were fetched
    /// since: these stay, behind the others. O(changes), and the star lists are made anew.
    pub(crate) fn take_back(&mut self) -> (usize, Vec<u32>) {
        let Some(Journal { count, old }) = self.journal.take() else { return (self.submesh.triangles.len(), Vec::new()) };
        steps::count(old.len() + self.submesh.triangles.len() - count);
        let is_fetched = |t: &u32| matches!(self.submesh.triangles[*t as usize].origin, Origin::Input(_));
        let fetched: Vec<u32> = (count as u32..self.submesh.triangles.len() as u32).filter(is_fetched).collect();
        for (place, t) in (count..).zip(&fetched) {
            self.submesh.triangles[place] = self.submesh.triangles[*t as usize];
        }
        self.submesh.triangles.truncate(count + fetched.len());
        for (t, triangle) in old.into_iter().rev() {
            self.submesh.triangles[t as usize] = triangle;
            self.changed.push(t);
        }
        self.changed.extend((count as u32..).take(fetched.len()));
        self.touch();
        self.submesh.relink();
        (count, fetched)
    }

    /// From here on this repair changes the mesh.
    pub(crate) fn is_changed_by(&mut self, repair: RepairName) {
        self.by = Some(repair);
    }

    /// Another number after every change.
    pub(crate) fn version(&self) -> u64 {
        self.version
    }

    /// The mesh is about to change.
    fn touch(&mut self) {
        self.forget_edges();
        self.version += 1;
    }

    /// This triangle is about to change.
    fn note(&mut self, t: u32) {
        if let Some(journal) = &mut self.journal
            && (t as usize) < journal.count
        {
            steps::count(1);
            journal.old.push((t, self.submesh.triangles[t as usize]));
        }
    }

    pub(crate) fn kill(&mut self, t: u32) {
        self.touch();
        self.note(t);
        self.submesh.triangles[t as usize].by = self.by;
        self.submesh.kill(t);
    }

    /// Lets dead triangles live again, as they were. O(submesh).
    pub(crate) fn revive(&mut self, dead: impl IntoIterator<Item = u32>) {
        self.touch();
        for t in dead {
            self.note(t);
            self.submesh.triangles[t as usize].alive = true;
            self.changed.push(t);
        }
        // Lists that were made meanwhile lack them.
        self.submesh.relink();
    }

    /// Vertices that no triangle uses were never there, or have nothing there any more: where they are, there may be one of the file whose star is
    /// not here. Before stars are fetched, while nothing is to be taken back.
    pub(crate) fn forget_unused(&mut self) {
        for v in 0..self.submesh.positions.len() as Vertex {
            if self.submesh.star(v).next().is_none() {
                self.submesh.complete[v as usize] = false;
            }
        }
    }

    /// A triangle is of this repair's making.
    pub(crate) fn attribute(&mut self, t: u32, to: RepairName) {
        self.note(t);
        let origin = &mut self.submesh.triangles[t as usize].origin;
        self.attributed.push((t, std::mem::replace(origin, Origin::Added(to))));
    }

    /// Adds a triangle and returns its number.
    pub(crate) fn add(&mut self, v: [Vertex; 3], origin: Origin, region: u32) -> u32 {
        self.touch();
        let t = self.submesh.add(v, origin, region);
        lean::push(&mut self.changed, t);
        t
    }

    /// Adds a vertex where none is, and returns its number.
    pub(crate) fn add_vertex(&mut self, position: Position) -> Vertex {
        self.touch();
        self.submesh.add_vertex(position)
    }

    /// Lets all triangles of `go` use `stay` instead.
    pub(crate) fn merge(&mut self, stay: Vertex, go: Vertex) {
        self.touch();
        let first = self.changed.len();
        self.changed.extend(self.submesh.star(go).map(|(t, _)| t));
        if self.journal.is_some() {
            let linked: Vec<u32> = self.submesh.linked(go).collect();
            linked.into_iter().for_each(|t| self.note(t));
        }
        for t in &self.changed[first..] {
            self.submesh.triangles[*t as usize].by = self.by;
        }
        self.submesh.merge(stay, go);
    }

    /// Turns a triangle over.
    pub(crate) fn flip(&mut self, t: u32) {
        self.touch();
        self.note(t);
        self.submesh.triangles[t as usize].turn();
    }

    /// Lets all triangles use `target[v]` instead of `v`. Their star lists are as they were until [`Self::relink`].
    pub(crate) fn move_to(&mut self, target: &[Vertex]) {
        self.touch();
        for t in 0..self.submesh.triangles.len() as u32 {
            let old = self.submesh.triangles[t as usize].v;
            let v = old.map(|v| target[v as usize]);
            if v != old {
                self.note(t);
                let triangle = &mut self.submesh.triangles[t as usize];
                (triangle.v, triangle.since, triangle.by) = (v, Since::Other, self.by);
                self.changed.push(t);
            }
        }
    }

    /// Lets one corner of a triangle be another vertex. Star lists are as they were until [`Self::relink`].
    pub(crate) fn assign(&mut self, t: u32, corner: usize, v: Vertex) {
        self.touch();
        self.note(t);
        let triangle = &mut self.submesh.triangles[t as usize];
        triangle.v[corner] = v;
        (triangle.since, triangle.by) = (Since::Other, self.by);
        self.changed.push(t);
    }

    pub(crate) fn relink(&mut self) {
        self.submesh.relink();
    }

    /// All triangles as they are, to be put back to.
    pub(crate) fn snapshot(&self) -> Snapshot {
        Snapshot::of(&self.submesh.triangles, self.attributed.len())
    }

    /// Puts all triangles back to what they were. O(submesh); passes look only at what was another one meanwhile.
    pub(crate) fn restore(&mut self, before: &Snapshot) {
        self.touch();
        self.journal = None;
        self.changed.extend(before.put_back(&mut self.submesh.triangles, &mut self.attributed));
        self.submesh.relink();
    }

    /// Gives each triangle that continues a region the one it continues after a [`Survey::divide`].
    pub(crate) fn follow_division(&mut self, survey: &Survey<'_>) {
        debug_assert!(self.journal.is_none(), "a division is not taken back");
        self.touch();
        for triangle in &mut self.submesh.triangles {
            if triangle.region != NONE {
                triangle.region = match triangle.origin {
                    Origin::Input(record) | Origin::Part(record) => survey.region_of_irregular_triangle(record),
                    Origin::Added(_) => NONE,
                };
            }
        }
    }

    /// Takes in what [`Survey::promote`] has found for some incomplete vertices, which become complete.
    pub(crate) fn extend(&mut self, survey: &Survey<'_>, new: &[(IrregularTriangle, u32)], completed: &[Vertex]) {
        self.touch();
        let first = self.submesh.triangles.len() as u32;
        self.submesh.extend(survey, new, |_| completed.to_vec());
        self.changed.extend(first..self.submesh.triangles.len() as u32);
    }

    /// As [`Self::extend`]; the vertices at these positions become complete. Returns the first of the new triangles.
    pub(crate) fn extend_at(&mut self, survey: &Survey<'_>, new: &[(IrregularTriangle, u32)], positions: &[[f32; 3]]) -> u32 {
        self.touch();
        let first = self.submesh.triangles.len() as u32;
        self.submesh
            .extend(survey, new, |known| positions.iter().filter_map(|p| known.get(&Position::of(*p)).copied()).collect());
        self.changed.extend(first..self.submesh.triangles.len() as u32);
        first
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::record::corners;
    use crate::testing::{diagnose, plate, records};
    use crate::util::ids::NONE;

    #[test]
    fn a_pass_sees_everything_once_and_then_what_changed() {
        let records = records(&plate(2, |_, _| true));
        let mut d = diagnose(&records);
        let mut work = Work::new(&mut d.submesh);
        assert_eq!(work.changed_for(Pass::Copies), None);
        assert_eq!(work.changed_for(Pass::Copies), Some(vec![]));
        let t = work.add([0, 1, 2], Origin::Added(RepairName::Fill), NONE);
        assert_eq!(work.changed_for(Pass::Copies), Some(vec![t]));
        assert_eq!(work.changed_for(Pass::Collinear), None, "each pass by itself");
        let moved: Vec<u32> = work.star(3).map(|(t, _)| t).collect();
        work.merge(0, 3);
        assert_eq!(work.changed_for(Pass::Copies).map(|c| c.len()), Some(moved.len()));
        let before = work.snapshot();
        let gone = work.add([0, 1, 4], Origin::Added(RepairName::Fill), NONE);
        assert_eq!(work.changed_for(Pass::Copies), Some(vec![gone]));
        work.kill(1);
        work.assign(2, 0, 5);
        work.restore(&before);
        assert_eq!(work.changed_for(Pass::Copies), Some(vec![1, 2]), "what was put back is looked at anew, the rest is not");
        work.mark();
        work.kill(1);
        work.add([0, 1, 4], Origin::Added(RepairName::Fill), NONE);
        work.take_back();
        assert_eq!(work.changed_for(Pass::Copies), Some(vec![1]), "and what was taken back, too");
    }

    #[test]
    fn edges_are_those_of_the_mesh_as_it_is() {
        let records = records(&plate(2, |_, _| true));
        let mut d = diagnose(&records);
        let mut work = Work::new(&mut d.submesh);
        let boundary = |work: &mut Work<'_>| work.edges().1.iter().filter(|e| e.is_boundary()).count();
        assert_eq!(boundary(&mut work), 8);
        work.kill(0);
        // One of its edges was the rim's, the others are the rim's now.
        assert_ne!(boundary(&mut work), 8);
        let disagreeing = |work: &mut Work<'_>| work.edges().1.iter().filter(|e| e.is_inconsistent()).count();
        assert_eq!(disagreeing(&mut work), 0);
        work.flip(3);
        assert_ne!(disagreeing(&mut work), 0);
    }

    #[test]
    fn edges_since_a_mark_are_those_of_what_changed() {
        let records = records(&plate(2, |_, _| true));
        let mut d = diagnose(&records);
        let mut work = Work::new(&mut d.submesh);
        assert_eq!(work.edges_since_mark(), None);
        work.mark();
        assert_eq!(work.edges_since_mark(), Some(vec![]));
        let sorted = |[a, b]: [Vertex; 2]| [a.min(b), a.max(b)];
        let [a, b, c] = work.triangles[0].v;
        let mut want = [[a, b], [b, c], [c, a]].map(sorted).to_vec();
        want.sort_unstable();
        work.kill(0);
        assert_eq!(work.edges_since_mark(), Some(want.clone()), "as they were");
        let other = (0..work.positions.len() as Vertex).find(|v| ![a, b, c].contains(v)).unwrap();
        work.add([a, b, other], Origin::Added(RepairName::Fill), NONE);
        want.extend([[b, other], [other, a]].map(sorted));
        want.sort_unstable();
        assert_eq!(work.edges_since_mark(), Some(want), "and as they are");
        work.take_back();
        assert_eq!(work.edges_since_mark(), None);
    }

    #[test]
    fn a_turned_triangle_is_at_the_right_corner_in_every_star() {
        let records = records(&plate(2, |_, _| true));
        let mut d = diagnose(&records);
        let mut work = Work::new(&mut d.submesh);
        (0..work.triangles.len() as u32).for_each(|t| work.flip(t));
        let [a, b] = [work.triangles[0].v[1], work.triangles[0].v[2]];
        let all = |work: &Work<'_>, v| work.star(v).all(|(t, corner)| work.triangles[t as usize].v[corner] == v);
        assert!((0..work.positions.len() as Vertex).all(|v| all(&work, v)));
        // Whatever is merged into another one, nothing else is.
        let before: Vec<_> = work.triangles.iter().map(|t| t.v.map(|v| if v == b { a } else { v })).collect();
        work.merge(a, b);
        assert_eq!(work.triangles.iter().map(|t| t.v).collect::<Vec<_>>(), before);
        assert!(all(&work, a));
    }

    #[test]
    fn what_was_changed_since_a_mark_is_taken_back_without_a_look_at_the_rest() {
        // The same changes in a plate of so many squares a side; the star lists are made anew, once.
        let steps_for = |side: u8| {
            let records = records(&plate(side, |_, _| true));
            let mut d = diagnose(&records);
            let mut work = Work::new(&mut d.submesh);
            let all = |work: &Work<'_>| work.triangles.iter().map(|t| (t.v, t.alive)).collect::<Vec<_>>();
            let before = all(&work);
            let [a, b, _] = work.triangles[0].v;
            let (steps, _) = steps::of(|| {
                work.mark();
                work.merge(a, b);
                work.add([0, 1, 2], Origin::Added(RepairName::Fill), NONE);
                work.flip(1);
                work.kill(1);
                work.kill(2);
                work.take_back()
            });
            assert_eq!(all(&work), before);
            assert!(work.star(a).all(|(t, corner)| work.triangles[t as usize].v[corner] == a));
            steps - work.triangles.len() as u64
        };
        assert_eq!(steps_for(8), steps_for(32));
    }

    /// A change of any kind leaves that true, and so does taking it back.
    #[test]
    fn a_triangle_of_the_file_is_known_as_it_was_read() {
        let records = records(&plate(3, |_, _| true));
        let mut d = diagnose(&records);
        let mut work = Work::new(&mut d.submesh);
        let holds = |work: &Work<'_>| {
            let of_file =
                (0..work.triangles.len() as u32).filter(|t| matches!(work.triangles[*t as usize].origin, Origin::Input(_)));
            of_file.clone().all(|t| work.as_read(&records, t) == Some(corners(&records[work.record(t) as usize])))
                && of_file.count() > 9
        };
        let snapshot = work.snapshot();
        work.flip(2);
        assert!(holds(&work) && work.points(2) != corners(&records[2]));
        work.mark();
        let high = work.add_vertex(Position::of([1.0, 1.0, 2.0]));
        work.merge(high, work.triangles[0].v[0]);
        work.assign(5, 1, high);
        work.flip(5);
        work.kill(7);
        assert!(holds(&work));
        work.take_back();
        assert!(holds(&work) && work.triangles[5].since == Since::Same && work.triangles[2].since == Since::Turned);
        let all: Vec<Vertex> = (0..work.positions.len() as Vertex).map(|v| if v < 4 { high } else { v }).collect();
        work.move_to(&all);
        work.flip(9);
        assert!(holds(&work) && work.triangles.iter().any(|t| t.since == Since::Other));
        work.restore(&snapshot);
        assert!(holds(&work) && work.triangles.iter().all(|t| t.since == Since::Same));
    }

    #[test]
    fn what_is_kept_is_not_taken_back() {
        let records = records(&plate(2, |_, _| true));
        let mut d = diagnose(&records);
        let mut work = Work::new(&mut d.submesh);
        work.mark();
        work.kill(0);
        work.keep();
        assert_eq!(work.take_back().0, 8);
        work.mark();
        work.kill(1);
        work.take_back();
        assert_eq!(work.living().next(), Some(1));
    }
}
