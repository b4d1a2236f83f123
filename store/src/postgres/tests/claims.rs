//! Claims that are asked for at the same time, and what a claim costs.

use std::num::NonZeroU32;

use sqlx::Row;

use super::farm::files;
use super::*;
use crate::postgres::claim::{Found, claims};
use crate::postgres::turns::Folders;
use crate::share::Share;
use crate::testkit::dropped;

/// What calls of these wants are answered when one statement answers them: the jobs they got, and what was said to those that got none.
fn at_once(store: &PostgresStore, wants: &[Filter], folders: &Folders) -> Vec<Result<JobId, &'static str>> {
    let asks: Vec<Ask> = wants.iter().zip(1..).map(|(want, call)| Ask { want: *want, call }).collect();
    let found = store.ask(async |connection| claims(connection, &store.life, &asks, folders).await).unwrap();
    let told = |found: Result<Found, Failure>| match found.unwrap() {
        Found::Claimed(seen) => Ok(seen.stored.job.id),
        Found::Nothing => Err("nothing"),
        Found::Contended => Err("contended"),
        Found::Over => Err("over"),
    };
    found.into_iter().map(told).collect()
}

/// Each hears of its own want: two of the small files, the large one, and nothing of those that are larger yet.
#[test]
fn calls_that_want_different_jobs_are_answered_together() {
    let Some(server) = server() else { return };
    let store = PostgresStore::open(&server.schema("daemon")).unwrap();
    let sizes = [10, 70 << 20, 20, 30];
    let found: Vec<_> = sizes.iter().enumerate().map(|(at, size)| dropped(&format!("{at}.stl"), *size).unwrap()).collect();
    store.submit(&found).unwrap();
    let want = |least, most| Filter { size: (least, most), alone: false };
    let wants = [want(0, 25), want(1 << 40, u64::MAX), want(64 << 20, u64::MAX), want(0, 25), want(0, 25)];
    assert_eq!(
        at_once(&store, &wants, &store.folders()),
        [Ok(JobId(1)), Err("nothing"), Ok(JobId(2)), Ok(JobId(3)), Err("nothing")]
    );
}

/// The limit of a folder holds within one statement as it does from one to the next, and so do its turns: of two folders with equal weights each is next
/// in turn.
#[test]
fn turns_and_limits_hold_among_claims_of_one_statement() {
    let Some(server) = server() else { return };
    let store = PostgresStore::open(&server.schema("daemon")).unwrap();
    let mut found = files(8);
    found.iter_mut().enumerate().for_each(|(at, one)| one.source.folder = if at < 5 { "a" } else { "b" }.into());
    store.submit(&found).unwrap();
    let share = Share { most_running: NonZeroU32::new(2), ..Share::default() };
    store.share(&[("b".to_owned(), share)].into());
    let given: Vec<_> =
        at_once(&store, &[Filter::default(); 8], &store.folders()).into_iter().map(|one| one.map(|id| id.0)).collect();
    assert_eq!(given, [Ok(1), Ok(6), Ok(2), Ok(7), Ok(3), Ok(4), Ok(5), Err("nothing")]);
}

/// Whoever is about to take the first leaves the second; where there is none, that is said, so that one asks again.
#[test]
fn a_row_that_another_is_about_to_take_is_left_to_him() {
    let Some(server) = server() else { return };
    let shared = server.schema("daemon");
    let store = PostgresStore::open(&shared).unwrap();
    store.submit(&files(2)).unwrap();
    let other = PostgresStore::open(&other(&shared, "other")).unwrap();
    let told = other
        .ask(async |connection| {
            let mut transaction = connection.begin().await?;
            sqlx::query("SELECT 1 FROM jobs WHERE id = 1 FOR UPDATE").execute(&mut *transaction).await?;
            let told = at_once(&store, &[Filter::default(); 2], &store.folders());
            transaction.rollback().await?;
            Ok(told)
        })
        .unwrap();
    assert_eq!(told, [Ok(JobId(2)), Err("contended")]);
    assert_eq!(store.claim(&Filter::default()).unwrap().unwrap().id, JobId(1), "it was not taken");
}

/// However many are at rest, and whatever the planner takes for a fact: here, that nearly all wait.
#[test]
fn a_claim_looks_at_few_rows() {
    const ROUNDS: usize = 51;
    let Some(server) = server() else { return };
    let shared = server.schema("daemon");
    let store = PostgresStore::open(&shared).unwrap();
    let made = "INSERT INTO jobs (id, seq, record, kind, kind_claimed, folder, size, priority, since, alone, cancel)
            SELECT id, id, '', 'queued', 'running', 'hot', id, 5, suture_now(), false, false FROM generate_series(1, 21000) id;
        ANALYZE jobs; UPDATE jobs SET kind = 'done' WHERE id <= 20000";
    sql(&shared, made).unwrap();
    let claim = "EXPLAIN (ANALYZE, BUFFERS, FORMAT JSON) SELECT * FROM suture_claims($1, 0, '{1}', 60000, 0, 1000000, false, '{}', '{hot}', '{}', '{}', '{}', 1)";
    let blocks = store.ask(async |connection| {
        let mut all = Vec::new();
        for _ in 0..ROUNDS {
            let row = sqlx::query(claim).bind(row::int(store.life.epoch.0)).fetch_one(&mut *connection).await?;
            let plan: serde_json::Value = serde_json::from_str(row.try_get_unchecked::<&str, _>(0)?).unwrap();
            all.push(plan[0]["Plan"]["Shared Hit Blocks"].as_i64().unwrap());
        }
        Ok(all)
    });
    let mut blocks = blocks.unwrap();
    sql(&shared, &format!("DO $$ BEGIN ASSERT (SELECT count(*) FROM jobs WHERE kind = 'running') = {ROUNDS}; END $$")).unwrap();
    // Those at rest take more than 500 blocks; a few claims clear away what these have left in the indexes.
    blocks.sort_unstable();
    assert!(blocks[ROUNDS / 2] < 300, "{blocks:?}");
}
