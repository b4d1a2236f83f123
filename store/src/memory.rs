//! The store's model: the same queue over tables in memory. For tests, and for runs that need not outlive the process.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Bound;
use std::sync::{Arc, RwLock};

use crate::id::{Clock, Epoch, JobId, Recipe, Seq, SystemClock, Time};
use crate::job::{Job, Kind, Past, Source, Step, Testimony};
use crate::news::{News, Notice};
use crate::queue::Queue;
use crate::share::Shares;
use crate::store::{
    Claim, Control, Filter, JobStore, Lease, Look, Page, Query, Recovered, StoreError, Submission, Submitted, Waiting,
};
use crate::tables::{Put, Table, Tables, Visit};
use crate::transfer::{Holdings, Transfer};

/// A [`JobStore`] that forgets everything when it is dropped.
pub struct MemoryStore {
    queue: Queue<Memory>,
    clock: Arc<dyn Clock>,
}

impl Default for MemoryStore {
    fn default() -> Self {
        Self::new(Arc::new(SystemClock))
    }
}

impl MemoryStore {
    /// An empty store in its first epoch.
    pub fn new(clock: Arc<dyn Clock>) -> Self {
        Self::over(Memory::default(), clock)
    }

    /// What another daemon finds after this one died: the same jobs, in the next epoch.
    pub fn restarted(self) -> Self {
        Self::over(self.queue.into_tables(), self.clock)
    }

    #[cfg(test)]
    pub(crate) fn tables(&self) -> &dyn Tables {
        self.queue.tables()
    }

    fn over(tables: Memory, clock: Arc<dyn Clock>) -> Self {
        // Opening fails only over damaged records or failing I/O; memory has neither.
        match Queue::open(tables, Arc::clone(&clock)) {
            Ok(queue) => Self { queue, clock },
            Err(error) => unreachable!("tables in memory cannot be damaged: {error}"),
        }
    }
}

type Entries = BTreeMap<(Table, Vec<u8>), Vec<u8>>;

#[derive(Default)]
pub(crate) struct Memory(RwLock<Entries>);

impl Tables for Memory {
    fn get(&self, table: Table, key: &[u8]) -> Result<Option<Vec<u8>>, StoreError> {
        let entries = self.0.read().unwrap_or_else(std::sync::PoisonError::into_inner);
        Ok(entries.get(&(table, key.to_vec())).cloned())
    }

    fn scan(&self, table: Table, from: &[u8], to: &[u8], each: Visit<'_>) -> Result<(), StoreError> {
        let entries = self.0.read().unwrap_or_else(std::sync::PoisonError::into_inner);
        for ((here, key), value) in entries.range((Bound::Included((table, from.to_vec())), Bound::Unbounded)) {
            if *here != table || (!to.is_empty() && key.as_slice() >= to) || !each(key, value)? {
                break;
            }
        }
        Ok(())
    }

    fn scan_back(&self, table: Table, from: &[u8], to: &[u8], each: Visit<'_>) -> Result<(), StoreError> {
        let entries = self.0.read().unwrap_or_else(std::sync::PoisonError::into_inner);
        let range = (Bound::Included((table, from.to_vec())), Bound::Excluded((table, to.to_vec())));
        for ((_, key), value) in entries.range(range).rev() {
            if !each(key, value)? {
                break;
            }
        }
        Ok(())
    }

    fn write(&self, puts: Vec<Put>, _: Seq) -> Result<(), StoreError> {
        let mut entries = self.0.write().unwrap_or_else(std::sync::PoisonError::into_inner);
        for Put { table, key, value } in puts {
            match value {
                Some(value) => entries.insert((table, key), value),
                None => entries.remove(&(table, key)),
            };
        }
        Ok(())
    }

    fn settle(&self, _: (Epoch, Seq)) -> Result<(), StoreError> {
        Ok(())
    }

    fn sound(&self) -> Result<(), StoreError> {
        Ok(())
    }
}

impl Transfer for MemoryStore {
    fn holdings(&self) -> Result<Holdings, StoreError> {
        self.queue.holdings()
    }

    fn take_over(&self, holdings: &Holdings) -> Result<(), StoreError> {
        self.queue.take_over(holdings)
    }
}

impl JobStore for MemoryStore {
    fn submit(&self, found: &[Submission]) -> Result<Vec<Submitted>, StoreError> {
        self.queue.submit(found)
    }

    fn claim(&self, want: &Filter) -> Result<Option<Claim>, StoreError> {
        self.queue.claim(want)
    }

    fn has_parked(&self) -> Result<bool, StoreError> {
        self.queue.has_parked()
    }

    fn waiting(&self, want: &Filter) -> Result<Option<Waiting>, StoreError> {
        self.queue.waiting(want)
    }

    fn shut(&self, folders: &BTreeSet<String>) {
        self.queue.shut(folders);
    }

    fn share(&self, shares: &Shares) {
        self.queue.share(shares);
    }

    fn heartbeat(&self, claim: &Claim) -> Result<Lease, StoreError> {
        self.queue.heartbeat(claim)
    }

    fn advance(&self, claim: &Claim, step: Step) -> Result<Job, StoreError> {
        self.queue.advance(claim, step)
    }

    fn control(&self, id: JobId, wish: Control) -> Result<Job, StoreError> {
        self.queue.control(id, wish)
    }

    fn recover(&self, testimony: &dyn Fn(&Job) -> Testimony) -> Result<Vec<Recovered>, StoreError> {
        self.queue.recover(testimony)
    }

    fn get(&self, id: JobId) -> Result<Option<Job>, StoreError> {
        self.queue.get(id)
    }

    fn list(&self, query: &Query) -> Result<Vec<Job>, StoreError> {
        self.queue.list(query)
    }

    fn page(&self, look: &Look) -> Result<Page, StoreError> {
        self.queue.page(look)
    }

    fn find(&self, source: &Source) -> Result<Option<JobId>, StoreError> {
        self.queue.find(source)
    }

    fn results(&self, size: u64, recipe: Option<Recipe>) -> Result<Vec<Job>, StoreError> {
        self.queue.results(size, recipe)
    }

    fn check(&self) -> Result<(), StoreError> {
        Ok(())
    }

    fn forget(&self, ids: &[JobId]) -> Result<u64, StoreError> {
        self.queue.forget(ids)
    }

    fn is_unfilled(&self) -> Result<bool, StoreError> {
        self.queue.is_unfilled()
    }

    fn restore(&self, past: &[Past]) -> Result<Vec<JobId>, StoreError> {
        self.queue.restore(past)
    }

    fn set_filled(&self) -> Result<(), StoreError> {
        self.queue.set_filled()
    }

    fn subscribe(&self, names: &[String]) -> Result<(), StoreError> {
        self.queue.subscribe(names)
    }

    fn notices(&self, name: &str, most: usize) -> Result<Vec<Notice>, StoreError> {
        self.queue.notices(name, most)
    }

    fn acknowledge(&self, name: &str, seq: Seq) -> Result<(), StoreError> {
        self.queue.acknowledge(name, seq)
    }

    fn backlog(&self, name: &str) -> Result<u64, StoreError> {
        self.queue.backlog(name)
    }

    fn tell(&self, news: &News) -> Result<bool, StoreError> {
        self.queue.tell(news)
    }

    fn last_night(&self) -> Result<Option<Time>, StoreError> {
        self.queue.last_night()
    }

    fn begin_night(&self, at: Time) -> Result<(), StoreError> {
        self.queue.begin_night(at)
    }

    fn counts(&self) -> Result<Vec<(Kind, u64)>, StoreError> {
        self.queue.counts()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testkit::{Subject, conformance};

    struct Model(Option<MemoryStore>);

    impl Subject for Model {
        fn store(&self) -> &dyn JobStore {
            self.0.as_ref().unwrap()
        }

        fn restart(&mut self) {
            self.0 = self.0.take().map(MemoryStore::restarted);
        }
    }

    #[test]
    fn conforms() {
        conformance(&|clock| Box::new(Model(Some(MemoryStore::new(clock)))));
    }
}
