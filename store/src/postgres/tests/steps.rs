//! Steps that are judged by what is known of a row, and written with others: none of it shows.

use super::farm::files;
use super::*;
use crate::id::Time;
use crate::job::Ending;
use crate::postgres::write::{Write, all};
use crate::testkit::{ManualClock, result_of};

/// An operator has written to the row since the claim: what the holder knows of it is out of date, and no step is made by it.
#[test]
fn what_an_operator_wants_meanwhile_is_heard() {
    let Some(server) = server() else { return };
    let shared = server.schema("worker");
    let (worker, control) = (PostgresStore::open(&shared).unwrap(), PostgresStore::open(&other(&shared, "control")).unwrap());
    worker.submit(&files(2)).unwrap();
    let claims = [(), ()].map(|()| worker.claim(&Filter::default()).unwrap().unwrap());
    claims.iter().for_each(|claim| drop(control.control(claim.id, Control::Cancel).unwrap()));
    // A job that is not to be stopped is queued again; one that is, is not.
    assert_eq!(worker.advance(&claims[0], Step::HandBack).unwrap().kind(), Kind::Cancelled);
    // By what is known it may not be finished; nor by what is so.
    let error = worker.advance(&claims[1], Step::Finished).unwrap_err();
    assert!(matches!(error, StoreError::Illegal { source: Illegal::State { .. }, .. }), "{error}");
    assert_eq!(worker.advance(&claims[1], Step::Cancelled).unwrap().kind(), Kind::Cancelled);
}

/// Counted on between two answers, and asked for where the count is wrong: a machine that slept, a database whose clock was set.
#[test]
fn the_time_of_a_step_is_the_databases() {
    let Some(server) = server() else { return };
    let clock = Arc::new(ManualClock::new(Time(1_000_000)));
    let store = PostgresStore::open_at(&server.schema("daemon"), Arc::clone(&clock) as Arc<dyn Clock>).unwrap();
    store.submit(&files(1)).unwrap();
    let claim = store.claim(&Filter::default()).unwrap().unwrap();
    clock.pass(50_000);
    let intended = store.advance(&claim, Step::Intend(result_of(&claim.job, Ending::Clean))).unwrap();
    assert_eq!(intended.changed, Time(1_050_000));
    clock.set(Time(5_000_000));
    assert_eq!(store.advance(&claim, Step::Placed).unwrap().changed, Time(5_000_000));
    clock.set(Time(2_000_000));
    assert_eq!(store.advance(&claim, Step::Finished).unwrap().changed, Time(2_000_000));
}

/// The second of three comes too late: the others are none the worse for it.
#[test]
fn rows_that_are_written_together_are_written_each_for_itself() {
    let Some(server) = server() else { return };
    let shared = server.schema("daemon");
    let store = PostgresStore::open(&shared).unwrap();
    store.submit(&files(3)).unwrap();
    let claims = [(), (), ()].map(|()| store.claim(&Filter::default()).unwrap().unwrap());
    let seen = claims.each_ref().map(|claim| store.claims.seen(claim).unwrap());
    store.advance(&claims[1], Step::Intend(result_of(&claims[1].job, Ending::Clean))).unwrap();
    let writes: Vec<_> = claims
        .iter()
        .zip(&seen)
        .map(|(claim, seen)| {
            let event = Event::Step { token: claim.token, step: Step::HandBack };
            let after = seen.stored.job.after(&event, Time(5)).unwrap();
            Write::new(&seen.stored, &after, By::Holder { token: claim.token, lease: 1000 }, None).unwrap()
        })
        .collect();
    let written = store.ask(async |connection| all(connection, &writes).await).unwrap();
    assert_eq!(written.iter().map(Option::is_some).collect::<Vec<_>>(), [true, false, true]);
    let kinds = claims.each_ref().map(|claim| store.get(claim.id).unwrap().unwrap().kind());
    assert_eq!(kinds, [Kind::Queued, Kind::Publishing, Kind::Queued]);
}

/// Many threads of one daemon, so that steps go together; each call is answered with its own job, as the row is.
#[test]
fn each_caller_hears_of_his_own_job() {
    const EACH: usize = 12;
    let Some(server) = server() else { return };
    let shared = Shared { connections: 16, ..server.schema("daemon") };
    let store = PostgresStore::open(&shared).unwrap();
    store.submit(&files(16 * EACH as u64)).unwrap();
    std::thread::scope(|scope| {
        for _ in 0..16 {
            scope.spawn(|| {
                for _ in 0..EACH {
                    let claim = store.claim(&Filter::default()).unwrap().unwrap();
                    for step in [Step::Intend(result_of(&claim.job, Ending::Clean)), Step::Placed, Step::Finished] {
                        let job = store.advance(&claim, step).unwrap();
                        assert_eq!((job.id, Some(&job)), (claim.id, store.get(claim.id).unwrap().as_ref()));
                    }
                }
            });
        }
    });
    assert_eq!(store.counts().unwrap().into_iter().find(|(kind, _)| *kind == Kind::Done).unwrap().1, 16 * EACH as u64);
}

/// So that a step of a holder writes the row alone, and no index.
#[test]
fn a_step_of_a_holder_leaves_what_indexes_look_at() {
    let Some(server) = server() else { return };
    let shared = server.schema("daemon");
    let store = PostgresStore::open(&shared).unwrap();
    store.submit(&files(2)).unwrap();
    let claims = [(), ()].map(|()| store.claim(&Filter::default()).unwrap().unwrap());
    // All columns that an index of the table has, in its expressions and its condition, too.
    let looked_at = "CREATE TABLE looked_at AS SELECT DISTINCT a.attname::text AS name FROM pg_index i
            JOIN pg_depend d ON d.classid = 'pg_class'::regclass AND d.objid = i.indexrelid AND d.refobjid = i.indrelid
            JOIN pg_attribute a ON a.attrelid = i.indrelid AND a.attnum = d.refobjsubid WHERE i.indrelid = 'jobs'::regclass;
        CREATE VIEW seen_by_indexes AS SELECT id, (SELECT jsonb_object_agg(key, value) FROM jsonb_each(to_jsonb(j)) WHERE key IN (SELECT name FROM looked_at)) AS seen
            FROM jobs j;
        CREATE TABLE before AS SELECT * FROM seen_by_indexes;
        DO $$ BEGIN ASSERT (SELECT array_agg(name) @> '{kind,epoch,folder,since,alone,size}' FROM looked_at); END $$";
    sql(&shared, looked_at).unwrap();
    let publication = |claim: &Claim| Step::Intend(result_of(&claim.job, Ending::Clean));
    // One by itself, and two together.
    store.advance(&claims[0], publication(&claims[0])).unwrap();
    let seen = claims.each_ref().map(|claim| store.claims.seen(claim).unwrap());
    let steps = [Step::Placed, publication(&claims[1])];
    let writes: Vec<_> = (claims.iter().zip(&seen).zip(steps))
        .map(|((claim, seen), step)| {
            let after = seen.stored.job.after(&Event::Step { token: claim.token, step }, Time(5)).unwrap();
            Write::new(&seen.stored, &after, By::Holder { token: claim.token, lease: 1000 }, None).unwrap()
        })
        .collect();
    let written = store.ask(async |connection| all(connection, &writes).await).unwrap();
    assert!(written.iter().all(Option::is_some));
    sql(&shared, "DO $$ BEGIN ASSERT NOT EXISTS (SELECT * FROM before EXCEPT SELECT * FROM seen_by_indexes); END $$").unwrap();
    assert_eq!(claims.each_ref().map(|claim| store.get(claim.id).unwrap().unwrap().kind()), [Kind::Published, Kind::Publishing]);
}
