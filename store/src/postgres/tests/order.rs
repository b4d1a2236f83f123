//! Who is next, compared with the model: the statement that claims, and the line in memory, give the same job.

use std::num::NonZeroU32;

use super::*;
use crate::job::{AGEING_MS, Priority};
use crate::memory::MemoryStore;
use crate::postgres::claim::{Found, claims};
use crate::share::{Share, Weight};
use crate::testkit::{ManualClock, dropped};

/// Sizes are around this one, from which on the statements look for files apart.
const LARGE: u64 = 64 << 20;

/// A small generator, so that a failure can be run again.
struct Numbers(u64);

impl Numbers {
    fn below(&mut self, end: u64) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0 % end
    }
}

type Seen = Result<(Kind, Option<Time>, crate::job::Blame, crate::id::Attempt), String>;

fn step(store: &dyn JobStore, claim: &Claim, step: &Step) -> Seen {
    let after = store.advance(claim, step.clone()).map_err(|error| error.to_string())?;
    Ok((after.kind(), after.pause(), after.blame, after.attempts))
}

/// What calls of these numbers are given by one statement.
fn at_once(store: &PostgresStore, want: Filter, calls: std::ops::Range<i64>) -> Vec<Claim> {
    let asks: Vec<Ask> = calls.map(|call| Ask { want, call }).collect();
    let folders = store.folders();
    let found = store.ask(async |connection| claims(connection, &store.life, &asks, &folders).await).unwrap();
    let claim = |found| {
        let Ok(Found::Claimed(seen)) = found else { return None };
        let stored = seen.stored;
        Some(Claim { id: stored.job.id, token: stored.token?, job: stored.job })
    };
    found.into_iter().filter_map(claim).collect()
}

#[test]
fn the_statement_and_the_model_agree_on_who_is_next() {
    let Some(server) = server() else { return };
    for seed in 1..=4 {
        let clock = Arc::new(ManualClock::new(Time(1_000_000)));
        let model = MemoryStore::new(Arc::clone(&clock) as Arc<dyn Clock>);
        let shared = server.schema("daemon");
        let store = PostgresStore::open_at(&shared, Arc::clone(&clock) as Arc<dyn Clock>).unwrap();
        let stores: [&dyn JobStore; 2] = [&model, &store];
        let (mut numbers, mut claimed) = (Numbers(seed), 0);
        for at in 0..150 {
            let mut found = dropped(&format!("{at}.stl"), LARGE - 500 + numbers.below(1000)).unwrap();
            found.priority = Priority::try_from(i64::try_from(numbers.below(10)).unwrap()).unwrap();
            found.source.folder = ["hot", "cold", "mild"][usize::try_from(numbers.below(3)).unwrap()].into();
            for store in stores {
                store.submit(std::slice::from_ref(&found)).unwrap();
            }
            clock.pass(numbers.below(AGEING_MS));
            let closed: BTreeSet<String> = if numbers.below(4) == 0 { ["cold".into()].into() } else { BTreeSet::new() };
            stores.iter().for_each(|store| store.shut(&closed));
            if numbers.below(10) == 0 {
                let mut share = || Share {
                    weight: Weight::try_from(i64::try_from(1 + numbers.below(100)).unwrap()).unwrap(),
                    most_running: NonZeroU32::new(u32::try_from(numbers.below(4)).unwrap()),
                };
                let shares = [("hot".to_owned(), share()), ("cold".to_owned(), share())].into();
                stores.iter().for_each(|store| store.share(&shares));
            }
            let (least, alone) = (LARGE - 500 + numbers.below(700), numbers.below(8) == 0);
            let want = Filter { size: (least, least + numbers.below(1000)), alone };
            let [expected, waiting] = stores.map(|store| store.waiting(&want).unwrap());
            assert_eq!(waiting, expected, "seed {seed}, step {at}");
            if numbers.below(3) == 0 {
                continue;
            }
            // Several that are asked for at once are given as if they were asked for one after the other.
            let count = i64::try_from(1 + numbers.below(3)).unwrap();
            let expected: Vec<_> = (0..count).filter_map(|_| model.claim(&want).unwrap()).collect();
            let given = at_once(&store, want, i64::from(at) * 10..i64::from(at) * 10 + count);
            let ids = |claims: &[Claim]| claims.iter().map(|claim| claim.id).collect::<Vec<_>>();
            assert_eq!(ids(&given), ids(&expected), "seed {seed}, step {at}");
            for (expected, claim) in expected.iter().zip(&given) {
                claimed += 1;
                // Some come back after a pause, some at once, some never. None stays in work: leases run out.
                let what = [Step::Environment { reason: "full".into() }, Step::HandBack, Step::NeedsAll, Step::Cancelled]
                    [usize::try_from(numbers.below(4)).unwrap()]
                .clone();
                let [expected, after] = [step(&model, expected, &what), step(&store, claim, &what)];
                assert_eq!(after, expected, "seed {seed}, step {at}");
            }
        }
        assert!(claimed > 30, "seed {seed}: {claimed}");
    }
}
