//! A store of version 2 that is brought up to date while a daemon of that version works on it.

use sqlx::Row;

use super::farm::files;
use super::*;
use crate::job::{Ending, PARK_MS};
use crate::postgres::row::{Stored, int};
use crate::postgres::write::{Write, one};
use crate::store::Query;
use crate::testkit::{ManualClock, result_of};

/// All columns of a job in version 2.
const COLUMNS: &str = "id, seq, record, kind, kind_claimed, folder, size, priority, since, not_before, alone, cancel, file_key, fresh_key, recipe, epoch, token,
    lease_until, claim_token, claim_boot, claim_at, claim_call, turn";

/// A schema of version 2 with a life of that time, and the jobs that a schema of now has, as they stood there then.
fn as_it_was(then: &Shared, now: &Shared) {
    let migrations = [include_str!("../sql/schema_1.sql"), include_str!("../sql/schema_2.sql")];
    let made = |(version, migration): (i32, &str)| {
        let digest: String = migrate::digest(migration).iter().map(|byte| format!("{byte:02x}")).collect();
        format!("{migration}; INSERT INTO migrations (version, digest) VALUES ({version}, '\\x{digest}');")
    };
    let made: String = (1..).zip(migrations).map(made).collect();
    let kept = COLUMNS.replace(" kind,", " coalesce(stage, kind),");
    let statements = format!(
        "CREATE SCHEMA {0}; CREATE TABLE migrations (version integer PRIMARY KEY, digest bytea NOT NULL, at timestamptz NOT NULL DEFAULT now());
        {made} INSERT INTO lives (daemon, folders, began, seen) VALUES ('old', '{{}}', suture_now(), suture_now());
        SELECT setval('transitions', 1000); UPDATE head SET last_job = 4;
        INSERT INTO jobs ({COLUMNS}) SELECT {kept} FROM {1}.jobs",
        then.schema, now.schema
    );
    sql(then, &statements).unwrap();
}

/// The claim of a daemon of version 2, whose life is the first.
fn claim_as_then(store: &PostgresStore, call: i64) -> JobId {
    let (none, all): (Vec<String>, Option<Vec<String>>) = (Vec::new(), None);
    let claimed = store.ask(async |connection| {
        let row = sqlx::query(include_str!("version_2/claim.sql"))
            .bind(1_i64)
            .bind(7_i64)
            .bind(call)
            .bind(store.life.lease)
            .bind(0_i64)
            .bind(i64::MAX)
            .bind(false)
            .bind(&none)
            .bind(&all)
            .bind(&none)
            .bind(Vec::<i64>::new())
            .bind(Vec::<Option<i64>>::new())
            .bind(1_i64);
        Ok(row.fetch_one(connection).await?.try_get::<i64, _>("id")?)
    });
    JobId(row::number(claimed.unwrap()))
}

/// The step of such a daemon, by the function that it calls.
fn step_as_then(store: &PostgresStore, id: JobId) {
    let written = store.ask(async |connection| {
        let read = "SELECT id, seq, record, epoch, token, claim_token, claim_boot, claim_at FROM jobs WHERE id = $1";
        let stored = Stored::read(&sqlx::query(read).bind(int(id.0)).fetch_one(&mut *connection).await?)?;
        let event = Event::Step { token: stored.token.unwrap(), step: Step::Intend(result_of(&stored.job, Ending::Clean)) };
        let after = stored.job.after(&event, Time(9)).unwrap();
        one(connection, &Write::new(&stored, &after, By::Heir { lease: store.life.lease }, None)?).await
    });
    assert!(written.unwrap().is_some());
}

#[test]
fn it_is_brought_up_to_date_beside_a_daemon_of_its_own() {
    let Some(server) = server() else { return };
    let [now, then] = [server.schema("now"), server.schema("new")];
    // Of four jobs one is running, one is on its way to its place, one is parked.
    let clock = Arc::new(ManualClock::new(Time(1_000_000)));
    let open = |shared: &Shared| PostgresStore::open_at(shared, Arc::clone(&clock) as Arc<dyn Clock>).unwrap();
    let store = open(&now);
    store.submit(&files(4)).unwrap();
    let claims = [(), (), ()].map(|()| store.claim(&Filter::default()).unwrap().unwrap());
    for claim in &claims[1..] {
        store.advance(claim, Step::Intend(result_of(&claim.job, Ending::Clean))).unwrap();
    }
    store.advance(&claims[2], Step::Park { reason: "denied".into(), committed: false }).unwrap();
    as_it_was(&then, &now);
    let store = open(&then);
    let kinds = || (1..=4).map(|id| store.get(JobId(id)).unwrap().unwrap().kind()).collect::<Vec<_>>();
    assert_eq!(kinds(), [Kind::Running, Kind::Publishing, Kind::Parked, Kind::Queued]);
    let wrong = || SharedStore::verify(&store).unwrap();
    assert_eq!(wrong(), Vec::<String>::new());
    clock.pass(PARK_MS);
    assert_eq!([1, 2].map(|call| claim_as_then(&store, call)), [JobId(3), JobId(4)], "first what was parked");
    assert_eq!(kinds(), [Kind::Running, Kind::Publishing, Kind::Publishing, Kind::Running]);
    step_as_then(&store, JobId(4));
    assert_eq!(wrong(), Vec::<String>::new());
    // However a row says it, it is found under its kind and counted there.
    let listed = |kind| {
        store.list(&Query { kinds: vec![kind], ..Query::default() }).unwrap().iter().map(|job| job.id.0).collect::<Vec<_>>()
    };
    assert_eq!((listed(Kind::Running), listed(Kind::Publishing)), (vec![1], vec![2, 3, 4]));
    let shown = |kind| {
        store
            .page(&Look { kinds: vec![kind], limit: 9, ..Look::default() })
            .unwrap()
            .jobs
            .iter()
            .map(|job| job.id.0)
            .collect::<Vec<_>>()
    };
    assert_eq!((shown(Kind::Running), shown(Kind::Publishing)), (vec![1], vec![4, 3, 2]));
    let count = |kind| store.counts().unwrap().into_iter().find(|one| one.0 == kind).unwrap().1;
    assert_eq!((count(Kind::Running), count(Kind::Publishing), count(Kind::Parked)), (1, 3, 0));
}
