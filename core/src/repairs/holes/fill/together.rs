//! Loops that are closed together: the rims of missing rings, and holes with islands.

use super::closing::Closing;
use super::doubts;
use crate::detect::holes::{
    Shapes,
    loops::{self, Loop},
    owners::Owners,
};
use crate::repairs::holes::annular;
use crate::repairs::holes::islands;
use crate::repairs::holes::patches::{ISLANDS, Placed};
use crate::repairs::shared::work::Work;
use crate::submesh::{Submesh, Vertex};
use crate::topology::survey::Survey;

/// Loops while groups of them are closed.
struct Grouped<'r> {
    rims: &'r [Loop],
    /// By loop: it is closed, or joined to another one.
    taken: Vec<bool>,
    /// The loops that are closed.
    done: Vec<Loop>,
    /// Their patches.
    placed: Vec<Placed>,
    /// Groups of loops that are closed, or joined.
    groups: Vec<Vec<&'r Loop>>,
}

impl<'r> Grouped<'r> {
    fn group(&self, numbers: &[usize]) -> Vec<&'r Loop> {
        numbers.iter().map(|i| &self.rims[*i]).collect()
    }

    fn is_free(&self, numbers: &[usize]) -> bool {
        numbers.iter().all(|i| !self.taken[*i])
    }

    fn take(&mut self, numbers: &[usize]) {
        numbers.iter().for_each(|i| self.taken[*i] = true);
        self.groups.push(self.group(numbers));
    }

    /// Puts in the patch of a group.
    fn place(&mut self, work: &mut Work<'_>, numbers: &[usize], triangles: &[[Vertex; 3]], method: &'static str) {
        let group = self.group(numbers);
        let rims = (self.done.len() as u32..).take(group.len()).collect();
        self.done.extend(group.into_iter().cloned());
        self.placed.push(Placed::put_in(work, rims, triangles, method));
        self.take(numbers);
    }
}

impl Closing<'_> {
    /// Closes the rims of missing rings, and holes with islands, each by one patch. Takes in the loops: those from the number that it returns
    /// on are still to be closed.
    pub(crate) fn close_together(
        &mut self,
        survey: &Survey<'_>,
        work: &mut Work<'_>,
        rims: Vec<Loop>,
        (shapes, owners): (Shapes, Owners),
        threads: usize,
    ) -> usize {
        let partners = shapes.partners(&owners);
        drop(shapes);
        let taken = vec![false; rims.len()];
        let mut all = Grouped { rims: &rims, taken, done: Vec::new(), placed: Vec::new(), groups: Vec::new() };
        // Before anything is put in: components change by that.
        let islands = islands::groups(survey, work, &rims, &partners.islands, |rim| self.admission.is_sheet(rim));
        self.close_touching(work, &mut all);
        self.close_rings(work, partners.rings, &owners, &mut all, threads);
        for group in &islands {
            self.close_group(work, ISLANDS, group, &mut all);
        }
        for group in &partners.bored {
            self.close_group(work, "annular", group, &mut all);
        }
        if !all.taken.contains(&true) {
            self.rims = rims;
            return 0;
        }
        let Grouped { mut done, placed, groups, .. } = all;
        groups.iter().for_each(|group| self.admission.joined(group));
        let first = done.len();
        let (submesh, edges) = work.edges();
        done.extend(loops::find(submesh, edges));
        (self.rims, self.placed) = (done, placed);
        first
    }

    /// May all loops of a group be closed?
    fn admits(&self, submesh: &Submesh, group: &[&Loop]) -> bool {
        self.admission.check(submesh, group[0]).is_ok()
            && group[1..].iter().all(|rim| self.admission.check_joined(submesh, rim).is_ok())
    }

    /// Holes whose islands touch the rim.
    fn close_touching(&self, work: &mut Work<'_>, all: &mut Grouped<'_>) {
        for (numbers, way) in islands::touching(work, all.rims) {
            if self.admits(work, &all.group(&numbers))
                && let Some(patch) = islands::patch_touching(work, &way)
            {
                all.place(work, &numbers, &patch, ISLANDS);
            }
        }
    }

    /// Pairs of rims between which a ring is missing.
    fn close_rings(
        &mut self,
        work: &mut Work<'_>,
        rings: Vec<[usize; 2]>,
        owners: &Owners,
        all: &mut Grouped<'_>,
        threads: usize,
    ) {
        let admits = |rim: &Loop| self.admission.check_joined(work, rim).is_ok();
        let is_ring = |pair: &[usize; 2]| all.is_free(pair) && pair.iter().all(|i| admits(&all.rims[*i]));
        let numbers: Vec<[usize; 2]> = rings.into_iter().filter(is_ring).collect();
        let pairs: Vec<[&Loop; 2]> = numbers.iter().map(|pair| pair.map(|i| &all.rims[i])).collect();
        annular::bridge(work, &pairs, threads, |work, i, triangles| {
            let [a, b] = numbers[i];
            if owners.are_large_bodies(a, b) {
                self.doubts.push(doubts::bridged(work, [&all.rims[a], &all.rims[b]]));
            }
            all.place(work, &numbers[i], triangles, "annular");
        });
    }

    /// A hole and its islands: by one patch, or the rims are joined, and closed as one loop later.
    fn close_group(&mut self, work: &mut Work<'_>, method: &'static str, numbers: &[usize], all: &mut Grouped<'_>) {
        let group = all.group(numbers);
        if !all.is_free(numbers) || !self.admits(work, &group) {
            return;
        }
        match islands::patch(work, &group) {
            Some(triangles) => all.place(work, numbers, &triangles, method),
            None => {
                all.take(numbers);
                self.joints.extend(islands::join_all(work, &group));
            }
        }
    }
}
