//! Whoever is to hear of ends of jobs, and of news, hears of each, whatever becomes of the daemon or of the job.

use crate::id::{Seq, Time};
use crate::job::{Ending, Job, Kind};
use crate::news::{News, Notice, Word};
use crate::store::{Control, JobStore, StoreError};

use super::tools::{ManualClock, Subject, claim_any, finish, submit_one};

/// A file comes and is done.
fn ends(store: &dyn JobStore, name: &str, ending: Ending) -> Result<Job, StoreError> {
    submit_one(store, name, 84)?;
    finish(store, &claim_any(store)?, ending, true)
}

/// Ends that the subscriber has not heard of, where there are no news.
fn told(store: &dyn JobStore, name: &str) -> Result<Vec<Job>, StoreError> {
    let notices = store.notices(name, 100)?;
    assert_eq!(store.backlog(name)?, notices.len() as u64);
    let job = |notice| if let Notice::End(job) = notice { *job } else { panic!("{notice:?}") };
    Ok(notices.into_iter().map(job).collect())
}

pub(super) fn ends_are_told_until_they_are_acknowledged(subject: &mut dyn Subject, _: &ManualClock) -> Result<(), StoreError> {
    let store = subject.store();
    let both = ["farm", "shop"].map(String::from);
    ends(store, "before.stl", Ending::Clean)?;
    store.subscribe(&both)?;
    let first = ends(store, "a.stl", Ending::Repaired)?;
    let second = ends(store, "b.stl", Ending::Unreadable)?;
    submit_one(store, "waits.stl", 84)?;
    for name in &both {
        assert_eq!(told(store, name)?, [first.clone(), second.clone()], "{name}");
    }
    assert_eq!(store.notices("farm", 1)?, [Notice::End(first.clone().into())]);
    store.acknowledge("farm", first.seq)?;
    subject.restart();
    let store = subject.store();
    store.subscribe(&both)?;
    assert_eq!(told(store, "farm")?.as_slice(), std::slice::from_ref(&second));
    assert_eq!(told(store, "shop")?, [first.clone(), second.clone()]);
    // What was acknowledged stays so, also when an older word comes late.
    store.acknowledge("farm", second.seq)?;
    store.acknowledge("farm", first.seq)?;
    assert_eq!(told(store, "farm")?, []);
    store.acknowledge("shop", second.seq)?;
    assert_eq!(told(store, "shop")?, []);
    Ok(())
}

/// A retry, and the end of a record, change nothing of what was to be told.
pub(super) fn notices_outlive_what_becomes_of_their_jobs(subject: &mut dyn Subject, _: &ManualClock) -> Result<(), StoreError> {
    let store = subject.store();
    store.subscribe(&["farm".into()])?;
    let failed = ends(store, "a.stl", Ending::NotGood)?;
    store.control(failed.id, Control::Retry)?;
    let done = finish(store, &claim_any(store)?, Ending::Repaired, true)?;
    assert_eq!((done.id, done.kind()), (failed.id, Kind::Done));
    assert_eq!(store.forget(&[done.id])?, 1);
    subject.restart();
    assert_eq!(told(subject.store(), "farm")?, [failed, done]);
    Ok(())
}

/// A folder that goes and comes, and the ends of nights: each is told in its place among the ends of jobs, and once, whatever is said again and by
/// whichever life.
pub(super) fn news_are_told_once(subject: &mut dyn Subject, clock: &ManualClock) -> Result<(), StoreError> {
    let away = |folder: &str| News::FolderAway { folder: folder.into(), reason: "it is\ngone".into() };
    let back = |folder: &str| News::FolderBack { folder: folder.into() };
    let night = |since, until| News::Night { since: Time(since), until: Time(until), jobs: [(Kind::Done, 1)].into() };
    let store = subject.store();
    store.subscribe(&["farm".into()])?;
    assert!(!store.tell(&back("hot"))?, "it was never away");
    assert!(store.tell(&away("hot"))? && store.tell(&away("cold"))? && !store.tell(&away("hot"))?);
    let job = ends(store, "a.stl", Ending::Clean)?;
    subject.restart();
    let store = subject.store();
    assert!(!store.tell(&away("hot"))?, "another life knows it");
    clock.pass(5);
    assert!(store.tell(&back("hot"))? && !store.tell(&back("hot"))? && store.tell(&away("hot"))?);
    assert_eq!(store.last_night()?, None);
    store.begin_night(Time(100))?;
    assert!(!store.tell(&night(90, 100))? && store.tell(&night(100, 200))? && !store.tell(&night(100, 200))?);
    subject.restart();
    let store = subject.store();
    assert!(!store.tell(&night(100, 200))? && !store.tell(&night(100, 199))?);
    assert_eq!(store.last_night()?, Some(Time(200)));
    let notices = store.notices("farm", 100)?;
    let clean = |notice: &Notice| match notice {
        Notice::Word(Word { news: News::FolderAway { folder, reason }, .. }) => format!("{folder} away: {reason}"),
        Notice::Word(Word { news: News::FolderBack { folder }, at, .. }) => format!("{folder} back at {}", at.0),
        Notice::Word(Word { news: News::Night { since, until, .. }, .. }) => format!("night {} to {}", since.0, until.0),
        Notice::End(job) => format!("end of {}", job.id),
    };
    let end = format!("end of {}", job.id);
    let expected = [
        "hot away: it is gone",
        "cold away: it is gone",
        &end,
        "hot back at 1000005",
        "hot away: it is gone",
        "night 100 to 200",
    ];
    assert_eq!(notices.iter().map(clean).collect::<Vec<_>>(), expected);
    assert!(notices.is_sorted_by(|a, b| a.seq() < b.seq()));
    store.acknowledge("farm", notices[4].seq())?;
    assert_eq!(store.notices("farm", 100)?, notices[5..]);
    // Without anyone who listens, what is so is still known.
    store.subscribe(&[])?;
    assert!(store.tell(&back("hot"))?);
    store.subscribe(&["farm".into()])?;
    assert!(!store.tell(&back("hot"))? && store.notices("farm", 100)?.is_empty());
    Ok(())
}

pub(super) fn who_does_not_subscribe_costs_nothing(subject: &mut dyn Subject, _: &ManualClock) -> Result<(), StoreError> {
    let store = subject.store();
    store.subscribe(&["farm".into(), "shop".into()])?;
    let first = ends(store, "a.stl", Ending::Clean)?;
    // Who has gone is not waited for, and begins anew on coming back.
    store.subscribe(&["farm".into()])?;
    store.acknowledge("shop", Seq(u64::MAX))?;
    store.subscribe(&["farm".into(), "shop".into()])?;
    assert_eq!((told(store, "farm")?, told(store, "shop")?), (vec![first], vec![]));
    store.subscribe(&[])?;
    ends(store, "b.stl", Ending::Clean)?;
    store.subscribe(&["farm".into()])?;
    assert_eq!(told(store, "farm")?, []);
    assert!(matches!(store.subscribe(&["n".repeat(99)]), Err(StoreError::TooLong { .. })));
    assert!(matches!(store.subscribe(&vec![String::new(); 33]), Err(StoreError::TooLong { .. })));
    Ok(())
}
