//! The schema: who may make it, who may use it, and whose it is.

use super::*;
use crate::job::Ending;
use crate::testkit::{dropped, result_of};

#[test]
fn eight_that_begin_at_once_make_one_schema() {
    let Some(server) = server() else { return };
    let shared = server.schema("0");
    let opened: Vec<_> = std::thread::scope(|scope| {
        let open = |at: u32| {
            scope.spawn({
                let shared = other(&shared, &at.to_string());
                move || PostgresStore::open(&shared)
            })
        };
        let threads: Vec<_> = (0..8).map(open).collect();
        threads.into_iter().map(|thread| thread.join().unwrap()).collect()
    });
    for store in opened {
        store.unwrap().check().unwrap();
    }
    sql(&shared, "DO $$ BEGIN ASSERT (SELECT count(*) FROM migrations) = 4 AND (SELECT count(*) FROM lives) = 8; END $$")
        .unwrap();
}

#[test]
fn a_newer_schema_is_refused_and_so_is_one_of_another_make() {
    let Some(server) = server() else { return };
    let shared = server.schema("daemon");
    drop(PostgresStore::open(&shared).unwrap());
    sql(&shared, "INSERT INTO migrations (version, digest) VALUES (5, ''), (6, '')").unwrap();
    let error = PostgresStore::open(&shared).err().unwrap();
    assert!(matches!(error, StoreError::Newer { found: 6, known: 4 }), "{error:?}");
    assert_eq!(error.to_string(), "the job database has version 6; this program knows versions up to 4");
    sql(&shared, "DELETE FROM migrations WHERE version > 4; UPDATE migrations SET digest = 'x'").unwrap();
    let error = PostgresStore::open(&shared).err().unwrap();
    assert!(matches!(error, StoreError::Unusable { .. }) && error.to_string().contains("its version 1"), "{error}");
}

#[test]
fn only_plain_names_are_schemas() {
    let refused = |name: &str| {
        let shared = Shared { schema: name.into(), ..Shared::new("postgres://nowhere.invalid/x", "daemon") };
        matches!(PostgresStore::open(&shared), Err(StoreError::Unusable { .. }))
    };
    assert!(["", "Suture", "a b", "a;drop schema b", "1a", "a\"", &"a".repeat(49)].into_iter().all(refused));
}

/// A database that may lose what it acknowledged is none for jobs.
#[test]
fn a_database_that_acknowledges_too_soon_is_refused() {
    let Some(server) = server() else { return };
    let shared = server.schema("daemon");
    sql(&shared, "CREATE ROLE hasty LOGIN SUPERUSER; ALTER ROLE hasty SET synchronous_commit = off").unwrap();
    let hasty = Shared { url: shared.url.replace("owner@", "hasty@"), ..shared };
    let error = PostgresStore::open(&hasty).err().unwrap();
    assert!(error.to_string().contains("synchronous_commit = off"), "{error}");
}

/// Under the least privileges all of the store works, and nothing but rows can be touched.
#[test]
fn the_role_can_use_the_store_and_drop_nothing() {
    let Some(server) = server() else { return };
    let shared = server.schema("worker");
    drop(PostgresStore::open(&shared).unwrap());
    sql(&shared, &format!("CREATE ROLE \"the \"\"worker\" LOGIN; {}", role(&shared.schema, "the \"worker"))).unwrap();
    let shared = Shared { url: shared.url.replace("owner@", "the%20%22worker@"), ..shared };
    for _ in 0..2 {
        let store = PostgresStore::open(&shared).unwrap();
        store.subscribe(&["farm".into()]).unwrap();
        store.tell(&News::FolderAway { folder: "hot".into(), reason: "gone".into() }).unwrap();
        store.tell(&News::FolderBack { folder: "hot".into() }).unwrap();
        store.begin_night(Time(5)).unwrap();
        store.set_filled().unwrap();
        store.recover(&|_| Testimony::None).unwrap();
        store.submit(&[dropped("a.stl", 84).unwrap(), dropped("b.stl", 84).unwrap()]).unwrap();
        let claim = store.claim(&Filter::default()).unwrap().unwrap();
        assert_eq!(store.heartbeat(&claim).unwrap(), Lease::Held);
        let publication = result_of(&claim.job, Ending::Clean);
        for step in [Step::Intend(publication.clone()), Step::Placed, Step::Finished] {
            store.advance(&claim, step).unwrap();
        }
        let past = Past {
            id: JobId(0),
            source: claim.job.source.clone(),
            moved_to: None,
            publication,
            attempts: claim.job.attempts,
            work: Some(claim.token),
            ended: Time(5),
            reached: crate::job::Reached::Ended,
        };
        let back = store.restore(&[past]).unwrap();
        assert_eq!(store.forget(&back).unwrap(), 1);
        let heard = store.notices("farm", 100).unwrap().last().unwrap().seq();
        store.acknowledge("farm", heard).unwrap();
        store.claim(&Filter::default()).unwrap();
        assert!(store.drain("worker", true).unwrap() && store.is_draining().unwrap() && store.drain("worker", false).unwrap());
        assert_eq!(store.hosts().unwrap().len(), 1);
    }
    for forbidden in [
        "DROP TABLE jobs",
        "TRUNCATE jobs",
        "ALTER TABLE jobs DISABLE TRIGGER ALL",
        "CREATE TABLE mine (id integer)",
        "DELETE FROM head",
        "DELETE FROM migrations",
        "CREATE OR REPLACE FUNCTION suture_now() RETURNS bigint LANGUAGE sql AS 'SELECT 0::bigint'",
        "DROP SEQUENCE transitions",
    ] {
        let error = sql(&shared, forbidden).unwrap_err();
        let code = error.as_database_error().and_then(|error| error.code().map(|code| code.into_owned()));
        assert_eq!(code.as_deref(), Some("42501"), "{forbidden}: {error}");
    }
}

/// What version 1 of the store is made of, its role and a daemon that runs: the update adds to it, and takes nothing away.
#[test]
fn a_store_of_version_1_is_brought_up_to_date_beside_a_daemon_of_its_own() {
    let Some(server) = server() else { return };
    let shared = server.schema("worker");
    let first = include_str!("../sql/schema_1.sql");
    let digest: String = migrate::digest(first).iter().map(|byte| format!("{byte:02x}")).collect();
    let made = format!(
        "CREATE SCHEMA {0}; CREATE TABLE migrations (version integer PRIMARY KEY, digest bytea NOT NULL, at timestamptz NOT NULL DEFAULT now());
        {first}; INSERT INTO migrations (version, digest) VALUES (1, '\\x{digest}'); CREATE ROLE worker_of_1 LOGIN;
        GRANT USAGE ON SCHEMA {0} TO worker_of_1; GRANT SELECT, INSERT, UPDATE, DELETE ON lives TO worker_of_1;
        INSERT INTO lives (daemon, folders, began, seen) VALUES ('old:/state', '{{a}}', suture_now(), suture_now())",
        shared.schema
    );
    sql(&shared, &made).unwrap();
    let store = PostgresStore::open(&shared).unwrap();
    let old = store.hosts().unwrap().into_iter().find(|host| host.daemon == "old:/state").unwrap();
    assert_eq!((old.station.host.as_str(), old.station.roles.are_all(), old.is_alive), ("old", true, true));
    assert!(old.keeps("a"), "it looks for drops, and tells nothing of that");
    // It serves its folder alone, as it did.
    let beside = Shared { folders: Some(vec!["a".into()]), joint: ["a".to_owned()].into(), ..other(&shared, "new") };
    assert!(matches!(PostgresStore::open(&beside), Err(StoreError::Served { .. })));
    // Its statements go on, and so do its rights.
    sql(&shared, "UPDATE lives SET seen = suture_now() WHERE daemon = 'old:/state'").unwrap();
    sql(&shared, "SET ROLE worker_of_1; SELECT count(*) FROM drains").unwrap();
}
