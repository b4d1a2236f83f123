//! Several files of one command line: small ones side by side, a thread and a worker process each; large ones alone, by all threads.
//! Results come into place, and are told of, in the order of the inputs, whatever is done first.
//!
//! Among small files the time goes by in waiting for the disk, so workers leave that to a few threads here, which wait for
//! several files at once. What lies unsynced or unplaced meanwhile is bounded ([`UNSYNCED`], [`AHEAD`]).

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread::Builder;
use std::time::Duration;

use crossbeam::channel::{Receiver, Sender, bounded, unbounded};
use suture_core::Limits;

use crate::bar::{Bar, Scope};
use crate::config::LARGE;
use crate::exit::Exit;
use crate::fsx;
use crate::item::{Failure, Finished, Order, tell};
use crate::say::complain;
use crate::signals::Stop;
use crate::supervise::Worker;
use crate::units::show_count;

/// Threads that wait for the disk. What waits together is committed together, so that more of them wait no longer.
const SYNCERS: usize = 16;
/// Bytes of results that workers may leave unsynced; an eighth of the memory, if that is less.
const UNSYNCED: u64 = 64 << 20;
/// Inputs begun before the first that is not told of. Each holds two open files at most until its turn comes.
const AHEAD: usize = 256;

/// What came of one input.
type Outcome = Result<Finished, Failure>;

/// What a thread says of one input.
enum Came {
    Out(Box<Outcome>),
    /// It needs more than its share of the memory.
    Hungry,
}

/// One input of the command.
struct Entry<'a> {
    input: &'a Path,
    size: u64,
    /// The name of its result.
    target: Option<PathBuf>,
}

/// All inputs of a command, on their way.
pub(crate) struct Batch<'a> {
    order: &'a Order<'a>,
    stop: &'a Stop,
    entries: Vec<Entry<'a>>,
    /// For large files, one after the other.
    worker: Option<Worker>,
    teller: Teller<'a>,
}

impl<'a> Batch<'a> {
    pub(crate) fn new(order: &'a Order<'a>, stop: &'a Stop) -> Self {
        let entry = |input: &'a PathBuf| Entry {
            input,
            size: std::fs::metadata(input).map_or(0, |m| m.len()),
            target: order.naming.as_ref().map(|naming| naming.target(input)),
        };
        let entries: Vec<Entry> = order.inputs.iter().map(entry).collect();
        let teller = Teller::new(order, &entries);
        Self { order, stop, entries, worker: None, teller }
    }

    /// Works on every input and tells of each; the worst of them decides.
    pub(crate) fn run(mut self) -> Exit {
        let mut next = 0;
        while next < self.entries.len() && !self.stop.asked() {
            let small = self.entries.iter().skip(next).take_while(|entry| entry.size < LARGE).count();
            if small < 2 {
                self.alone(next);
                next += 1;
            } else {
                next = self.side_by_side(&(next..next + small));
            }
        }
        self.teller.end()
    }

    /// One file, by all threads and with the whole memory.
    fn alone(&mut self, index: usize) {
        let Some(entry) = self.entries.get(index) else { return };
        let bar = &mut self.teller.bar;
        bar.alone(entry.input, entry.size);
        let outcome = self.order.item(entry.input, entry.target.as_deref(), self.order.limits.clone()).and_then(|item| {
            let report = item.work(&mut self.worker, false, self.stop, &mut |course| bar.at(course))?;
            Ok(Finished { report, item })
        });
        bar.done(entry.size);
        self.teller.waiting.insert(index, outcome);
        self.teller.tell_what_is_next();
    }

    /// Small files, side by side. Ends early when one needs more than its share of the memory, which it then gets. Returns the first
    /// input that was not begun.
    fn side_by_side(&mut self, range: &Range<usize>) -> usize {
        // Its memory belongs to others now.
        self.worker = None;
        let line = Line::new(self.order, self.stop, &self.entries, range, self.teller.told);
        let (done, outcomes) = unbounded();
        let (to_sync, unsynced) = bounded(SYNCERS);
        let teller = &mut self.teller;
        let hungry = std::thread::scope(|scope| {
            let syncers = (0..SYNCERS.min(range.len())).map_while(|_| {
                let (done, unsynced) = (done.clone(), unsynced.clone());
                Builder::new().spawn_scoped(scope, move || sync(&done, &unsynced)).ok()
            });
            let slots = (0..line.slots).map_while(|_| {
                let (line, done, to_sync) = (&line, done.clone(), to_sync.clone());
                Builder::new().spawn_scoped(scope, move || line.slot(&done, &to_sync)).ok()
            });
            let started = syncers.count() > 0 && slots.count() > 0;
            drop((done, to_sync, unsynced));
            started.then(|| teller.listen(&outcomes, &line))
        });
        let Some(hungry) = hungry else {
            // No threads to be had: by this one.
            self.alone(range.start);
            return range.start + 1;
        };
        let next = line.begun.into_inner().unwrap_or_else(PoisonError::into_inner);
        for index in hungry {
            self.alone(index);
        }
        next
    }
}

/// Small files in a row, and the terms on which each is worked on.
struct Line<'a> {
    order: &'a Order<'a>,
    stop: &'a Stop,
    entries: &'a [Entry<'a>],
    end: usize,
    /// The first input that no slot has begun.
    begun: Mutex<usize>,
    /// The first input that was not told of.
    told: AtomicUsize,
    /// A file waits for the whole memory: nothing more is begun.
    hungry: AtomicBool,
    slots: usize,
    limits: Limits,
    /// Inputs up to this size leave their results unsynced.
    deferred: u64,
}

impl<'a> Line<'a> {
    fn new(order: &'a Order<'a>, stop: &'a Stop, entries: &'a [Entry<'a>], range: &Range<usize>, told: usize) -> Self {
        let whole = &order.limits;
        let slots = whole.threads.clamp(1, range.len().max(1));
        let unsynced = UNSYNCED.min(whole.memory_bytes / 8);
        let memory = (whole.memory_bytes - unsynced) / slots as u64;
        let limits = whole.clone().with_threads(whole.threads / slots).with_memory(memory);
        Self {
            order,
            stop,
            entries,
            end: range.end,
            begun: Mutex::new(range.start),
            told: AtomicUsize::new(told),
            hungry: AtomicBool::new(false),
            slots,
            limits,
            // In work, waiting for a thread that syncs, and with one.
            deferred: unsynced / (slots + 2 * SYNCERS) as u64,
        }
    }

    /// The next input to begin; waits while too many results wait for their turn.
    fn next(&self) -> Option<(usize, &'a Entry<'a>)> {
        loop {
            if self.stop.asked() || self.hungry.load(Ordering::Relaxed) {
                return None;
            }
            let mut begun = self.begun.lock().unwrap_or_else(PoisonError::into_inner);
            let index = *begun;
            if index >= self.end {
                return None;
            }
            if index < self.told.load(Ordering::Relaxed) + AHEAD {
                *begun += 1;
                return self.entries.get(index).map(|entry| (index, entry));
            }
            drop(begun);
            std::thread::sleep(Duration::from_millis(2));
        }
    }

    /// A thread that works on one file after the other, with a worker of its own.
    fn slot(&self, done: &Sender<(usize, Came)>, to_sync: &Sender<(usize, Finished)>) {
        let mut worker = None;
        while let Some((index, entry)) = self.next() {
            // Whoever takes what is sent is there as long as anything is.
            let _ = match self.work(entry, &mut worker) {
                Ok(finished) if finished.item.request.limits.defer_sync => to_sync.send((index, finished)).map_err(drop),
                Err(failure) if failure.is_starved() && self.limits.memory_bytes < self.order.limits.memory_bytes => {
                    self.hungry.store(true, Ordering::Relaxed);
                    done.send((index, Came::Hungry)).map_err(drop)
                }
                outcome => done.send((index, Came::Out(Box::new(outcome)))).map_err(drop),
            };
        }
    }

    fn work(&self, entry: &Entry, worker: &mut Option<Worker>) -> Outcome {
        // A list of what was edited may be much larger than the mesh.
        let mut limits = self.limits.clone();
        limits.defer_sync = entry.target.is_some() && entry.size <= self.deferred && !limits.list_edit;
        let item = self.order.item(entry.input, entry.target.as_deref(), limits)?;
        let report = item.work(worker, true, self.stop, &mut |_| {})?;
        Ok(Finished { report, item })
    }
}

/// A thread that waits for the disk.
fn sync(done: &Sender<(usize, Came)>, unsynced: &Receiver<(usize, Finished)>) {
    for (index, finished) in unsynced {
        let outcome = finished.item.sync().map(|()| finished);
        if done.send((index, Came::Out(Box::new(outcome)))).is_err() {
            return;
        }
    }
}

/// Brings results into place and tells of them, in input order.
struct Teller<'a> {
    order: &'a Order<'a>,
    sizes: Vec<u64>,
    bar: Bar,
    /// What came before its turn.
    waiting: BTreeMap<usize, Outcome>,
    /// So many inputs, the first ones, have been told of.
    told: usize,
    /// So many of them have a result.
    done: usize,
    stopped: bool,
    worst: Exit,
}

impl<'a> Teller<'a> {
    fn new(order: &'a Order<'a>, entries: &[Entry]) -> Self {
        let sizes: Vec<u64> = entries.iter().map(|entry| entry.size).collect();
        let bar = Bar::new(Scope { files: sizes.len(), bytes: sizes.iter().sum() });
        Self { order, sizes, bar, waiting: BTreeMap::new(), told: 0, done: 0, stopped: false, worst: Exit::Good }
    }

    /// Takes what comes until no one is left to send; returns those that need more memory, ascending.
    fn listen(&mut self, outcomes: &Receiver<(usize, Came)>, line: &Line) -> Vec<usize> {
        let mut hungry = Vec::new();
        while let Ok(first) = outcomes.recv() {
            for (index, came) in std::iter::once(first).chain(outcomes.try_iter()) {
                match came {
                    Came::Out(outcome) => {
                        self.bar.done(self.sizes.get(index).copied().unwrap_or(0));
                        self.waiting.insert(index, *outcome);
                    }
                    Came::Hungry => hungry.push(index),
                }
            }
            self.tell_what_is_next();
            line.told.store(self.told, Ordering::Relaxed);
        }
        hungry.sort_unstable();
        hungry
    }

    /// Places what is next in order, and what follows it without a gap; syncs the folders once for all of it, and tells of it.
    fn tell_what_is_next(&mut self) {
        let mut folders = Vec::new();
        let mut placed = Vec::new();
        // After what was stopped nothing comes into place: what there is, is all that comes before.
        while !self.stopped
            && let Some(outcome) = self.waiting.remove(&(self.told + placed.len()))
        {
            self.stopped = outcome.as_ref().is_err_and(|failure| failure.stopped);
            placed.push(outcome.and_then(|finished| match &self.order.naming {
                Some(naming) => finished.place(naming, &mut folders),
                None => Ok(finished.report),
            }));
        }
        let synced = folders.iter().find_map(|folder| fsx::sync_dir(folder).err().map(|error| (folder, error)));
        for mut result in placed {
            if let (Ok(_), Some((folder, error))) = (&result, &synced) {
                result = Err(Failure::io(folder, "cannot be synced", error));
            }
            let input = self.order.inputs.get(self.told).map(PathBuf::as_path).unwrap_or(Path::new(""));
            self.told += 1;
            if self.order.inputs.len() > 1 && result.as_ref().is_err_and(|failure| failure.stopped) {
                // One line for all that were not done is still to come.
                continue;
            }
            self.done += usize::from(result.is_ok());
            let (text, complaint, exit) = tell(input, &result, self.order);
            self.worst = self.worst.max(self.bar.say(&text, complaint.as_deref(), exit));
        }
    }

    /// What is left to say at the end, and the exit code.
    fn end(self) -> Exit {
        self.bar.clear();
        let all = self.order.inputs.len();
        if !self.stopped && self.told == all {
            return self.worst;
        }
        if all > 1 {
            complain(&format_args!(
                "interrupted; {} of {} files are done, nothing was written of the others",
                show_count(self.done as u64),
                show_count(all as u64)
            ));
        }
        Exit::Interrupted
    }
}
