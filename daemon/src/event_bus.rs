//! Where everything that happens is told: to the log, the metrics, and to those who listen. Listeners never hold anyone up: of what they are told, so much is
//! kept, and one that is slower misses the oldest, and learns that.

use std::collections::{BTreeMap, VecDeque};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use serde::Serialize;
use serde_json::{Value, json};
use suture_store::{Clock, JobId, SystemClock};
use tokio::sync::broadcast::{Receiver, Sender, channel};

use crate::course::Course;
use crate::event::{self, Happening};
use crate::event_metrics::{Metrics, Timing};

/// So many are kept for listeners that come back.
const KEPT: usize = 2048;
/// A listener may be so far behind.
const BEHIND: usize = 512;
/// How often one job's progress is told.
const PROGRESS_EVERY: Duration = Duration::from_millis(500);

/// Something that listeners are told.
#[derive(Clone, Debug)]
pub(crate) struct Message {
    /// Counted in this life of the daemon.
    pub number: u64,
    pub kind: &'static str,
    pub data: String,
}

/// How far a job in work is, as it is shown.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Progress {
    /// As the engine calls it.
    pub stage: String,
    /// For people.
    pub doing: &'static str,
    /// Of the whole.
    pub percent: u8,
}

impl Progress {
    fn of(course: &Course) -> Self {
        Self { stage: course.stage().to_owned(), doing: course.doing(), percent: course.percent() }
    }
}

/// A job in work.
struct Far {
    course: Course,
    told: Instant,
}

struct Line {
    last: u64,
    kept: VecDeque<Arc<Message>>,
}

/// Where everything is told.
pub(crate) struct Bus {
    pub metrics: Metrics,
    /// Tells this life from others.
    pub life: u64,
    /// `None`: no one can listen.
    listeners: Option<Sender<Arc<Message>>>,
    line: Mutex<Line>,
    progress: Mutex<BTreeMap<JobId, Far>>,
    /// Results on their way into their places.
    publishing: Mutex<BTreeMap<JobId, Instant>>,
}

/// A listener's side.
pub(crate) struct Listening {
    /// All that it has missed since it listened last.
    pub missed: Vec<Arc<Message>>,
    /// Something between is not known any more.
    pub lost: bool,
    pub more: Receiver<Arc<Message>>,
}

impl Bus {
    /// Of a new life. `heard`: someone may listen.
    pub(crate) fn new(heard: bool) -> Self {
        let listeners = heard.then(|| channel(BEHIND).0);
        let line = Mutex::new(Line { last: 0, kept: VecDeque::new() });
        let life = SystemClock.now().0;
        let metrics = Metrics::default();
        event::begin(&metrics);
        Self { metrics, life, listeners, line, progress: Mutex::default(), publishing: Mutex::default() }
    }

    /// It happened.
    pub(crate) fn tell(&self, happening: &Happening<'_>) {
        happening.log();
        happening.count(&self.metrics);
        if let (Some(listeners), Some((kind, data))) = (&self.listeners, happening.told()) {
            self.send(listeners, kind, &data);
        }
    }

    fn line(&self) -> MutexGuard<'_, Line> {
        self.line.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn send(&self, listeners: &Sender<Arc<Message>>, kind: &'static str, data: &Value) {
        let data = data.to_string();
        let mut line = self.line();
        line.last += 1;
        let message = Arc::new(Message { number: line.last, kind, data });
        line.kept.push_back(Arc::clone(&message));
        if line.kept.len() > KEPT {
            line.kept.pop_front();
        }
        // Under the lock, so that all come in order; no one listens now, perhaps.
        let _ = listeners.send(message);
    }

    /// Listens from now on; `after`: the life and number of the last message that was heard. `None` where no one can listen.
    pub(crate) fn listen(&self, after: Option<(u64, u64)>) -> Option<Listening> {
        let listeners = self.listeners.as_ref()?;
        let line = self.line();
        let more = listeners.subscribe();
        let Some((life, number)) = after else { return Some(Listening { missed: Vec::new(), lost: false, more }) };
        let first = line.kept.front().map_or(line.last + 1, |message| message.number);
        let lost = life != self.life || number > line.last || number + 1 < first;
        let missed =
            if lost { Vec::new() } else { line.kept.iter().filter(|message| message.number > number).cloned().collect() };
        Some(Listening { missed, lost, more })
    }

    /// So far is a job in work.
    pub(crate) fn progress(&self, id: JobId, course: &Course) {
        let mut all = self.progress.lock().unwrap_or_else(PoisonError::into_inner);
        let last = all.get(&id).map(|far| far.told);
        let is_due = last.is_none_or(|told| told.elapsed() >= PROGRESS_EVERY);
        let told = last.filter(|_| !is_due).unwrap_or_else(Instant::now);
        all.insert(id, Far { course: course.clone(), told });
        drop(all);
        if let (true, Some(listeners)) = (is_due, &self.listeners) {
            let Progress { stage, doing, percent } = Progress::of(course);
            self.send(listeners, "progress", &json!({"job": id, "stage": stage, "doing": doing, "percent": percent}));
        }
    }

    /// How far a job is, if that is known.
    pub(crate) fn progress_of(&self, id: JobId) -> Option<Progress> {
        self.progress.lock().unwrap_or_else(PoisonError::into_inner).get(&id).map(|far| Progress::of(&far.course))
    }

    /// About how many seconds are left of a job that has been in work for so many.
    pub(crate) fn left(&self, id: JobId, seconds: u64) -> Option<u64> {
        let left = self.progress.lock().unwrap_or_else(PoisonError::into_inner).get(&id)?.course.left(seconds as f64)?;
        Some(left as u64)
    }

    /// A job is not in work any more.
    pub(crate) fn rest(&self, id: JobId) {
        self.progress.lock().unwrap_or_else(PoisonError::into_inner).remove(&id);
    }

    /// A result begins its way into its place, or is there.
    pub(crate) fn publishing(&self, id: JobId, begins: bool) {
        let mut all = self.publishing.lock().unwrap_or_else(PoisonError::into_inner);
        if begins {
            all.entry(id).or_insert_with(Instant::now);
        } else if let Some(began) = all.remove(&id) {
            self.metrics.observe(Timing::JobDuration, &[("stage", "publish")], began.elapsed().as_secs_f64());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbers(listening: &Listening) -> Vec<u64> {
        listening.missed.iter().map(|message| message.number).collect()
    }

    #[test]
    fn who_comes_back_is_told_what_was_missed_or_that_it_is_lost() {
        let bus = Bus::new(true);
        let tell = |id| bus.tell(&Happening::Forgotten { id: JobId(id) });
        (1..=3).for_each(tell);
        let new = bus.listen(None).unwrap();
        assert_eq!((numbers(&new), new.lost), (vec![], false));
        let back = bus.listen(Some((bus.life, 1))).unwrap();
        assert_eq!((numbers(&back), back.lost), (vec![2, 3], false));
        assert!(bus.listen(Some((bus.life + 1, 1))).unwrap().lost, "another life");
        assert!(bus.listen(Some((bus.life, 4))).unwrap().lost, "it was never told");
        (0..KEPT as u64).for_each(tell);
        assert!(bus.listen(Some((bus.life, 1))).unwrap().lost, "too long ago");
        assert_eq!(bus.listen(Some((bus.life, 3))).unwrap().missed.len(), KEPT);
        assert!(Bus::new(false).listen(None).is_none());
    }

    /// One who takes nothing keeps no one waiting, and misses the oldest.
    #[test]
    fn f28_a_slow_listener_holds_no_one_up() {
        let bus = Bus::new(true);
        let mut slow = bus.listen(None).unwrap().more;
        (0..3 * BEHIND as u64).for_each(|id| bus.tell(&Happening::Forgotten { id: JobId(id) }));
        assert!(
            matches!(slow.try_recv(), Err(tokio::sync::broadcast::error::TryRecvError::Lagged(missed)) if missed >= BEHIND as u64)
        );
        assert!(slow.try_recv().is_ok());
    }

    #[test]
    fn progress_is_known_until_the_job_rests() {
        let bus = Bus::new(true);
        let mut course = Course::new(false, false);
        for (stage, done, doing) in [
            ("read", 0, "reading the file"),
            ("plan", 1, "sorting"),
            ("topology", 2, "looking for defects"),
            ("topology", 40, "looking for defects"),
        ] {
            course.at(stage, done, 100, done as f64);
            bus.progress(JobId(1), &course);
            let told = bus.progress_of(JobId(1)).unwrap();
            assert!(told.stage == stage && told.doing.starts_with(doing) && told.percent == course.percent(), "{told:?}");
        }
        assert!(bus.left(JobId(1), 50).is_some_and(|left| left > 20));
        assert_eq!(bus.line().last, 1, "told once in a while");
        bus.rest(JobId(1));
        assert_eq!(bus.progress_of(JobId(1)), None);
    }
}
