//! From store to store, and a look at every row.

use super::farm::{files, finish};
use super::*;
use crate::memory::MemoryStore;
use crate::sled_store::SledStore;
use crate::store::Query;
use crate::transfer::{SharedStore, Transfer, TransferError, differences, export, import, read};

/// One that has ended and is to be told of, one that runs, one whose result is on its way, one that waits; and marks of all kinds.
fn fill(store: &dyn JobStore) {
    store.subscribe(&["farm".into(), "shop".into()]).unwrap();
    store.tell(&News::FolderAway { folder: "cold".into(), reason: "gone".into() }).unwrap();
    store.begin_night(Time(77)).unwrap();
    store.set_filled().unwrap();
    store.submit(&files(5)).unwrap();
    let claims: Vec<_> = (0..3).map(|_| store.claim(&Filter::default()).unwrap().unwrap()).collect();
    finish(store, &claims[0]).unwrap();
    store.advance(&claims[1], Step::Intend(crate::testkit::result_of(&claims[1].job, crate::job::Ending::Repaired))).unwrap();
    store.control(claims[2].id, Control::Cancel).unwrap();
    let waits = store.claim(&Filter::default()).unwrap().unwrap();
    store.advance(&waits, Step::Environment { reason: "full".into() }).unwrap();
    let first = store.notices("farm", 1).unwrap();
    store.acknowledge("farm", first[0].seq()).unwrap();
}

#[test]
fn a_farm_moves_in_and_out_again() {
    let Some(server) = server() else { return };
    let begun = MemoryStore::default();
    fill(&begun);
    let mut text = Vec::new();
    assert_eq!(export(&begun, &mut text).unwrap(), 5);
    let holdings = read(&mut text.as_slice()).unwrap();
    let shared = server.schema("daemon");
    let store = PostgresStore::open(&shared).unwrap();
    assert_eq!(import(&store, &mut text.as_slice()).unwrap(), 5);
    assert_eq!(differences(&store, &holdings).unwrap(), Vec::<String>::new());
    assert_eq!(store.verify().unwrap(), Vec::<String>::new());
    let full = import(&store, &mut text.as_slice());
    assert!(matches!(full, Err(TransferError::Store(StoreError::Unusable { .. }))), "{full:?}");
    // And out again, into the embedded one.
    let mut again = Vec::new();
    export(&store, &mut again).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let embedded = SledStore::open(folder.path()).unwrap();
    import(&embedded, &mut again.as_slice()).unwrap();
    assert_eq!(differences(&embedded, &holdings).unwrap(), Vec::<String>::new());
    drop(embedded);
    assert_eq!(SledStore::verify(folder.path()).unwrap().wrong, Vec::<String>::new());
    let embedded = SledStore::open(folder.path()).unwrap();
    // All three go on alike: what was held is recovered, what was told stays told, and numbers are not given twice.
    let [here, there] = [&store as &dyn JobStore, &embedded].map(|store| {
        let recovered = store.recover(&|_| Testimony::Outlived).unwrap();
        let recovered: Vec<_> = recovered.iter().map(|one| (one.job.id, one.void, one.job.kind(), one.claim.is_some())).collect();
        assert_eq!(recovered.len(), 2);
        let claim = store.claim(&Filter::default()).unwrap().unwrap();
        assert!(holdings.jobs.iter().all(|job| claim.token.0 > job.seq.0 && claim.token > job.work_token()));
        let told: Vec<_> = ["farm", "shop"].map(|name| store.notices(name, 9).unwrap()).into();
        let again = store.submit(&files(6)).unwrap();
        let kinds: Vec<_> = store.list(&Query::default()).unwrap().iter().map(|job| (job.id, job.kind())).collect();
        assert!(!store.tell(&News::FolderAway { folder: "cold".into(), reason: String::new() }).unwrap());
        (recovered, claim.id, told, again, kinds, store.last_night().unwrap(), store.is_unfilled().unwrap())
    });
    assert_eq!(here, there);
    assert_eq!((here.2[0].len(), here.2[1].len(), here.5, here.6), (1, 2, Some(Time(77)), false));
}

#[test]
fn an_export_that_was_cut_or_changed_is_refused() {
    let store = MemoryStore::default();
    fill(&store);
    let mut text = Vec::new();
    export(&store, &mut text).unwrap();
    let whole = read(&mut text.as_slice()).unwrap();
    assert_eq!(whole, store.holdings().unwrap());
    for end in 0..text.len() - 1 {
        // Without its last line break it is whole still.
        assert!(read(&mut &text[..end]).is_err(), "cut at {end}");
    }
    for at in (0..text.len()).step_by(7) {
        let mut changed = text.clone();
        changed[at] ^= 1;
        assert!(read(&mut changed.as_slice()).map_or(true, |read| read == whole), "byte {at}");
    }
    let text = String::from_utf8(text).unwrap().replacen("\"version\":1", "\"version\":2", 1);
    assert!(matches!(read(&mut text.as_bytes()), Err(TransferError::Version { found: 2 })));
}

#[test]
fn a_look_at_every_row_finds_what_is_wrong() {
    let Some(server) = server() else { return };
    let shared = server.schema("daemon");
    let store = PostgresStore::open(&shared).unwrap();
    fill(&store);
    assert_eq!(store.verify().unwrap(), Vec::<String>::new());
    for (damage, line) in [
        ("UPDATE jobs SET record = overlay(record PLACING '\\x00' FROM 30) WHERE id = 1", "job 1: its checksum is wrong"),
        ("UPDATE jobs SET kind = 'done' WHERE id = 5", "job 5: the columns kind say otherwise than its record"),
        (
            "UPDATE jobs SET size = 9, priority = 1 WHERE id = 2",
            "job 2: the columns size, priority say otherwise than its record",
        ),
        ("UPDATE jobs SET token = 9999 WHERE id = 3", "job 3: the columns token say otherwise than its record"),
        ("UPDATE head SET last_job = 4", "job 5: it is ahead of the head, which says what came last"),
        ("UPDATE outbox SET record = ''", "outbox: it is too short"),
    ] {
        sql(&shared, &format!("CREATE TABLE kept AS TABLE jobs; CREATE TABLE kept_outbox AS TABLE outbox; {damage}")).unwrap();
        assert_eq!(store.verify().unwrap().first().map(String::as_str), Some(line));
        let back = "TRUNCATE jobs, outbox; INSERT INTO jobs TABLE kept; INSERT INTO outbox TABLE kept_outbox; DROP TABLE kept, kept_outbox;
            UPDATE head SET last_job = 5";
        sql(&shared, back).unwrap();
    }
}
