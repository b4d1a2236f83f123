//! Events out: webhooks and the command of `[on_done]` hear of every job that has ended, at least once; webhooks, if they want it, of nights and folders, too.
//!
//! The store keeps each of these for every *target* until that has it ([`suture_store::JobStore::notices`]): written with the job's end itself, it survives
//! whatever the job and the daemon meet. Each target has a thread, which takes its notices in order, and tries the oldest until it is delivered or given up
//! ([`pace`]); what happens to one is no other's trouble, and no job's. Between a delivery and the note of it the daemon may die: then the same message goes
//! out once more, under the same id.

use std::collections::BTreeMap;
use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{Builder, Scope, ScopedJoinHandle};
use std::time::Duration;

use suture_store::{JobStore, Notice, Seq, StoreError, crash_point};

use crate::attempt::Context;
use crate::config::events::{Events, Occasion, OnDone, Webhook};
use crate::event::{Happening, Parcel};

mod command;
mod end;
mod http;
mod message;
mod pace;
mod webhook;

use message::Message;
use pace::{Next, Outcome};

/// How often a target looks for something to tell, and whoever waits whether that is over.
const LOOK_EVERY: Duration = Duration::from_millis(100);
/// Rest after an internal error.
const REST: Duration = Duration::from_secs(1);
/// Notices read at a time.
const PAGE: usize = 64;
/// Of more that wait for one target, the oldest are given up: a receiver that is gone for good must not fill the disk.
const MOST: u64 = 10_000;

/// Who is told.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Target {
    Webhook(Webhook),
    Command(OnDone),
}

impl Target {
    fn all(events: &Events) -> Vec<Self> {
        let webhooks = events.webhooks.iter().cloned().map(Self::Webhook);
        webhooks.chain(events.on_done.clone().map(Self::Command)).collect()
    }

    fn name(&self) -> &str {
        match self {
            Self::Webhook(webhook) => &webhook.name,
            Self::Command(_) => OnDone::NAME,
        }
    }

    fn wants(&self, message: &Message<'_>) -> bool {
        match self {
            Self::Webhook(webhook) => webhook.events.contains(&message.event()),
            Self::Command(_) => matches!(message, Message::End(_)),
        }
    }
}

/// Does any target of the configuration want to hear of such an occasion?
pub(crate) fn is_wanted(context: &Context, occasion: Occasion) -> bool {
    context.settings.now().events.webhooks.iter().any(|webhook| webhook.events.contains(&occasion))
}

/// Has the store keep what the targets of the configuration are to hear, from now on. For whoever has just read that configuration.
///
/// # Errors
/// When the store failed.
pub(crate) fn subscribe(context: &Context) -> Result<(), StoreError> {
    let names: Vec<String> = context.settings.now().events.names().map(String::from).collect();
    context.store.subscribe(&names)
}

/// Serves all targets until `ended`, those too that a configuration names that is read meanwhile.
pub(crate) fn serve(context: &Context, ended: &AtomicBool) {
    std::thread::scope(|scope| {
        let mut threads: BTreeMap<String, ScopedJoinHandle<'_, ()>> = BTreeMap::new();
        let mut known = context.settings.now().events.clone();
        while !is_over(context, ended) {
            let events = context.settings.now().events.clone();
            if events != known {
                context.pulse.keep_troubles(&|name| events.names().any(|there| there == name));
                known = events;
            }
            threads.retain(|_, thread| !thread.is_finished());
            for target in Target::all(&known) {
                let name = target.name().to_owned();
                if threads.contains_key(&name) {
                    continue;
                }
                match begin(scope, context, ended, target) {
                    Ok(thread) => drop(threads.insert(name, thread)),
                    Err(source) => context.fail(StoreError::Io { path: "thread".into(), action: "starting one", source }),
                }
            }
            std::thread::sleep(LOOK_EVERY);
        }
    });
}

fn is_over(context: &Context, ended: &AtomicBool) -> bool {
    ended.load(Ordering::Relaxed) || context.has_failed()
}

fn begin<'s>(
    scope: &'s Scope<'s, '_>,
    context: &'s Context,
    ended: &'s AtomicBool,
    target: Target,
) -> io::Result<ScopedJoinHandle<'s, ()>> {
    let tell = move || {
        let stop = || is_over(context, ended) || !Target::all(&context.settings.now().events).contains(&target);
        let teller = Teller { context, target: &target, stop: &stop };
        match catch_unwind(AssertUnwindSafe(|| teller.tell())) {
            Ok(Ok(())) => {}
            Ok(Err(error)) => context.fail(error),
            Err(_) => {
                tracing::error!("A thread that tells of events ended in an internal error, and is begun anew.");
                std::thread::sleep(REST);
            }
        }
    };
    Builder::new().name("teller".into()).spawn_scoped(scope, tell)
}

/// Waits until every target has all that there is for it, or is in trouble: what is left then waits for the next daemon.
pub(crate) fn settle(context: &Context, stop: &dyn Fn() -> bool) -> Result<(), StoreError> {
    let names: Vec<String> = context.settings.now().events.names().map(String::from).collect();
    for name in names {
        while !stop() && context.store.backlog(&name)? > 0 && !context.pulse.has_trouble(&name) {
            std::thread::sleep(LOOK_EVERY);
        }
    }
    Ok(())
}

/// Tells one target.
struct Teller<'a> {
    context: &'a Context,
    target: &'a Target,
    stop: &'a dyn Fn() -> bool,
}

impl Teller<'_> {
    fn tell(&self) -> Result<(), StoreError> {
        while !(self.stop)() {
            if !self.may_begin() {
                std::thread::sleep(LOOK_EVERY);
                continue;
            }
            let notices = self.context.store.notices(self.target.name(), PAGE)?;
            if notices.is_empty() {
                std::thread::sleep(LOOK_EVERY);
            }
            let mut passed_over = None;
            for notice in &notices {
                match self.message(notice).filter(|message| self.target.wants(message)) {
                    None => passed_over = Some(notice.seq()),
                    Some(message) if self.bring(&message, notice.seq())? => passed_over = None,
                    // What it was is read again: much may have been given up meanwhile.
                    Some(_) => break,
                }
            }
            if let Some(seq) = passed_over {
                self.context.store.acknowledge(self.target.name(), seq)?;
            }
        }
        Ok(())
    }

    fn message<'n>(&'n self, notice: &'n Notice) -> Option<Message<'n>> {
        let folders = &self.context.folders;
        Message::of(notice, &|name| folders.iter().find(|folder| folder.name == name).map(|folder| folder.place()))
    }

    /// Tries one message until it is delivered or given up; `false`: it is neither, and something else has to be done first.
    fn bring(&self, message: &Message<'_>, seq: Seq) -> Result<bool, StoreError> {
        let (name, id, mut tries) = (self.target.name(), message.id(), 0);
        while !(self.stop)() && self.may_begin() {
            tries += 1;
            let next = self.attempt(message, &id).after(tries, &id);
            if next == Next::Stop {
                return Ok(false);
            }
            self.told(message, &next, tries);
            if let Next::Wait { why, pause } = next {
                self.context.pulse.trouble(name, why);
                if self.give_up_oldest()? {
                    return Ok(false);
                }
                self.wait(pause);
                continue;
            }
            crash_point("daemon.told");
            self.context.store.acknowledge(name, seq)?;
            self.context.pulse.no_trouble(name);
            crash_point("daemon.acknowledged");
            return Ok(true);
        }
        Ok(false)
    }

    fn attempt(&self, message: &Message<'_>, id: &str) -> Outcome {
        let world = &*self.context.world;
        match (self.target, message) {
            (Target::Webhook(hook), message) => webhook::send(hook, id, &message.body(), world, self.stop),
            (Target::Command(on_done), Message::End(end)) => {
                self.context.pulse.command(true);
                let outcome = command::run(on_done, end, world, self.stop);
                self.context.pulse.command(false);
                outcome
            }
            (Target::Command(_), Message::Word(_)) => Outcome::Delivered { note: "it is run of jobs alone".into() },
        }
    }

    /// A daemon that ends begins no command: the next one does. With `--once`, its end is when they are run.
    fn may_begin(&self) -> bool {
        matches!(self.target, Target::Webhook(_)) || self.context.once || !self.context.pulse.is_ending()
    }

    fn told(&self, message: &Message<'_>, next: &Next, tries: u32) {
        let parcel = self.parcel(message);
        self.context.bus.tell(&match next {
            Next::Done { note } => Happening::Delivered { parcel, note },
            Next::GiveUp { why } => Happening::GivenUp { parcel, why },
            Next::Wait { why, .. } => Happening::NotDelivered { parcel, why, tries },
            Next::Stop => return,
        });
    }

    fn parcel(&self, message: &Message<'_>) -> Parcel<'_> {
        Parcel { target: self.target.name(), event: message.event().word(), job: message.job() }
    }

    /// Lets go what is too much for a target that takes nothing. Returns whether there was any.
    fn give_up_oldest(&self) -> Result<bool, StoreError> {
        let (store, target) = (&*self.context.store, self.target.name());
        let oldest = surplus(store, target, MOST)?;
        let Some(last) = oldest.last() else { return Ok(false) };
        let why = &format!("more than {MOST} messages wait for this target");
        for message in oldest.iter().filter_map(|notice| self.message(notice)) {
            self.context.bus.tell(&Happening::GivenUp { parcel: self.parcel(&message), why });
        }
        store.acknowledge(target, last.seq()).map(|()| true)
    }

    fn wait(&self, pause: Duration) {
        let world = &self.context.world;
        let began = world.steady();
        while !(self.stop)() && world.steady().duration_since(began) < pause {
            std::thread::sleep(LOOK_EVERY.min(pause));
        }
    }
}

/// The oldest notices of a target, if there are more than `most`: those beyond, a page of them at most.
fn surplus(store: &dyn JobStore, target: &str, most: u64) -> Result<Vec<Notice>, StoreError> {
    let beyond = store.backlog(target)?.saturating_sub(most);
    store.notices(target, usize::try_from(beyond).unwrap_or(usize::MAX).min(PAGE))
}

#[cfg(test)]
mod tests {
    use suture_store::testkit::{dropped, result_of};
    use suture_store::{Ending, Filter, MemoryStore, Step};

    use super::*;

    #[test]
    fn of_too_many_the_oldest_are_given_up() {
        let store = MemoryStore::default();
        store.subscribe(&["farm".into()]).unwrap();
        let mut ends = Vec::new();
        for n in 0..7 {
            store.submit(&[dropped(&format!("{n}.stl"), 84).unwrap()]).unwrap();
            let claim = store.claim(&Filter::default()).unwrap().unwrap();
            store.advance(&claim, Step::Intend(result_of(&claim.job, Ending::Clean))).unwrap();
            store.advance(&claim, Step::Placed).unwrap();
            ends.push(Notice::End(store.advance(&claim, Step::Finished).unwrap().into()));
        }
        assert_eq!(surplus(&store, "farm", 7).unwrap(), []);
        assert_eq!(surplus(&store, "farm", 5).unwrap(), ends[..2]);
        store.acknowledge("farm", ends[1].seq()).unwrap();
        assert_eq!(surplus(&store, "farm", 5).unwrap(), []);
        assert_eq!(store.notices("farm", PAGE).unwrap(), ends[2..]);
    }
}
