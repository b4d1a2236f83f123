//! How folders share the work.

use crate::job::{Ending, Priority, Step};
use crate::share::{Share, Shares, Weight};
use crate::store::{Claim, Filter, JobStore, StoreError, Submission};

use super::tools::{ManualClock, Subject, finish, named};

fn drop_into(store: &dyn JobStore, folder: &str, count: u64, priority: i64) -> Result<(), StoreError> {
    let found = (0..count).map(|n| {
        let mut found = named(&format!("{folder}/{priority}/{n}.stl"), 84)?;
        folder.clone_into(&mut found.source.folder);
        Ok(Submission { priority: Priority::try_from(priority).unwrap_or_default(), ..found })
    });
    store.submit(&found.collect::<Result<Vec<_>, StoreError>>()?).map(drop)
}

fn claim(store: &dyn JobStore) -> Result<Option<Claim>, StoreError> {
    store.claim(&Filter::default())
}

/// The folders of so many claims, each brought to its end.
fn order(store: &dyn JobStore, count: usize) -> Result<String, StoreError> {
    let mut order = String::new();
    for _ in 0..count {
        let Some(claim) = claim(store)? else { break };
        order += &claim.job.source.folder;
        finish(store, &claim, Ending::Clean, true)?;
    }
    Ok(order)
}

fn shares(of: &[(&str, i64, u32)]) -> Shares {
    let share = |weight, most| Share {
        weight: Weight::try_from(weight).unwrap_or_default(),
        most_running: std::num::NonZeroU32::new(most),
    };
    of.iter().map(|(name, weight, most)| ((*name).to_owned(), share(*weight, *most))).collect()
}

/// A folder with very many drops keeps none with few waiting; weights tell how often each has its turn; who comes late has saved nothing up; the more
/// urgent goes first all the same.
pub(super) fn folders_take_turns(subject: &mut dyn Subject, _: &ManualClock) -> Result<(), StoreError> {
    let store = subject.store();
    drop_into(store, "a", 50, 5)?;
    assert_eq!(order(store, 4)?, "aaaa", "no one else waits");
    drop_into(store, "b", 3, 5)?;
    assert_eq!(order(store, 8)?, "bababaaa", "b has nothing from before, and goes when it is its turn");
    store.share(&shares(&[("b", 40, 0)]));
    drop_into(store, "b", 20, 5)?;
    let order_of_ten = order(store, 10)?;
    assert_eq!(order_of_ten.matches('b').count(), 8, "four for one: {order_of_ten}");
    drop_into(store, "a", 2, 6)?;
    assert_eq!(order(store, 2)?, "aa", "the more urgent");
    // What that took is no debt for ever: both begin from here.
    store.share(&Shares::new());
    let order_of_four = order(store, 4)?;
    assert_eq!(order_of_four.matches('a').count(), 2, "{order_of_four}");
    Ok(())
}

/// No more of a folder's jobs are in work than may be, and the others go on; what waits there is not asked for.
pub(super) fn a_folder_has_no_more_in_work_than_it_may(subject: &mut dyn Subject, _: &ManualClock) -> Result<(), StoreError> {
    let store = subject.store();
    store.share(&shares(&[("a", 100, 2)]));
    drop_into(store, "a", 5, 9)?;
    let [first, second] = [claim(store)?, claim(store)?];
    assert_eq!((claim(store)?, store.waiting(&Filter::default())?), (None, None), "two are in work");
    drop_into(store, "b", 1, 0)?;
    let other = claim(store)?.map(|claim| claim.job.source.folder);
    assert_eq!(other.as_deref(), Some("b"));
    for claim in [first, second].iter().flatten() {
        store.advance(claim, Step::HandBack)?;
    }
    assert!(store.waiting(&Filter::default())?.is_some());
    assert_eq!(order(store, 9)?, "aaaaa");
    Ok(())
}
