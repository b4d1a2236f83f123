use std::sync::Arc;

use object_store::Attribute;
use object_store::memory::InMemory;

use super::address::BucketAddress;
use super::cache::Cache;
use super::faulty::Faulty;
use super::*;

const ANYWAY: Gate = &|| Ok(());

/// A bucket over a store in memory, in which calls fail by that seed; of 256 so many.
pub(crate) fn bucket(inner: &Arc<InMemory>, seed: u64, rate: u64, left: Option<u32>, part: u64) -> Bucket {
    let bucket = over(Faulty::over(inner, seed, rate, left), "s3://prints/farm", part);
    bucket.caller.is_patient.store(true, std::sync::atomic::Ordering::Relaxed);
    bucket.caller.proved.set(()).unwrap();
    bucket
}

fn over(store: Faulty, address: &str, part: u64) -> Bucket {
    let (store, address) = (Arc::new(store), BucketAddress::parse(address).unwrap().unwrap());
    Bucket::over(Arc::<Faulty>::clone(&store), store, &address, part).unwrap()
}

/// Keys below a path.
pub(crate) fn keys(bucket: &Bucket, below: &str) -> Vec<String> {
    bucket.list(below).unwrap().into_iter().map(|listed| listed.key).collect()
}

fn hash(bytes: &[u8]) -> Hash {
    Hash(*blake3::hash(bytes).as_bytes())
}

/// Calls fail on the way, in one part or in many: the name has the bytes, once, and nothing is replaced.
#[test]
fn a_name_is_written_once_whole_in_parts_and_through_faults() {
    let dir = tempfile::tempdir().unwrap();
    let (mine, theirs) = (dir.path().join("mine"), dir.path().join("theirs"));
    std::fs::write(&mine, b"0123456789").unwrap();
    std::fs::write(&theirs, b"others").unwrap();
    for (seed, part) in (0..40).flat_map(|seed| [(seed, 4), (seed, 64)]) {
        let inner = Arc::new(InMemory::new());
        let faulty = bucket(&inner, seed, 40, None, part);
        // Until it is there: a call that fails for good is made again by whoever waits.
        let put = || (0..50).find_map(|_| faulty.put_new(&mine, "out/a.stl", "7-9", ANYWAY).ok()).unwrap();
        put();
        let sound = bucket(&inner, 0, 0, None, part);
        let there = sound.stat("out/a.stl").unwrap().unwrap();
        assert_eq!(sound.hash("out/a.stl", &there.version).unwrap(), hash(b"0123456789"), "{seed} {part}");
        assert_eq!(there.owner.as_deref(), Some("7-9"));
        assert_eq!(sound.put_new(&theirs, "out/a.stl", "8-1", ANYWAY).unwrap(), Put::There);
        assert_eq!(sound.copy_new(("out/a.stl", &there.version), "out/a.stl", "8-1", ANYWAY).unwrap(), Put::There);
        assert_eq!(sound.stat("out/a.stl").unwrap().unwrap(), there, "nothing is replaced");
        assert_eq!(keys(&sound, "out"), ["a.stl"]);
    }
}

/// The type and the words that a customer's program gave to a file are those of its copy, which has its own owner besides.
#[test]
fn a_copy_keeps_what_was_said_of_the_original() {
    let inner = Arc::new(InMemory::new());
    let words = Attribute::Metadata("order".into());
    for (seed, bytes) in (0..20).flat_map(|seed| [(seed, &b"0123456789"[..]), (seed, b"")]) {
        let said = [(Attribute::ContentType, "model/stl"), (words.clone(), "123"), (OWNER, "somebody's")];
        let options = PutOptions { attributes: Attributes::from_iter(said), ..PutOptions::default() };
        let runtime = tokio::runtime::Builder::new_current_thread().build().unwrap();
        runtime.block_on(inner.put_opts(&"farm/in/a.stl".into(), bytes.to_vec().into(), options)).unwrap();
        let sound = bucket(&inner, 0, 0, None, 4);
        let there = sound.stat("in/a.stl").unwrap().unwrap().version;
        let (to, faulty) = (format!("done/{seed} {}.stl", bytes.len()), bucket(&inner, seed, 40, None, 4));
        (0..50).find_map(|_| faulty.copy_new(("in/a.stl", &there), &to, "7-9", ANYWAY).ok()).unwrap();
        let copy = sound.head(&sound.key(&to).unwrap(), GetOptions::default()).unwrap();
        let of = |attribute: &Attribute| copy.attributes.get(attribute).map(|value| value.to_string());
        assert_eq!(
            [&Attribute::ContentType, &words, &OWNER].map(of),
            ["model/stl", "123", "7-9"].map(|word| Some(word.to_owned()))
        );
    }
}

#[test]
fn a_version_is_read_whole_through_cut_bodies_or_not_at_all() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("a");
    std::fs::write(&file, b"0123456789").unwrap();
    let inner = Arc::new(InMemory::new());
    let sound = bucket(&inner, 0, 0, None, 64);
    sound.put_new(&file, "in/a.stl", "x", ANYWAY).unwrap();
    let version = sound.stat("in/a.stl").unwrap().unwrap().version;
    for seed in 0..40 {
        let faulty = bucket(&inner, seed, 60, None, 3);
        match faulty.hash("in/a.stl", &version) {
            Ok(found) => assert_eq!(found, hash(b"0123456789"), "{seed}"),
            Err(error) => assert!(matches!(error, Trouble::Away(_)), "{seed}: {error}"),
        }
    }
    sound.remove("in/a.stl").unwrap();
    sound.put_new(&file, "in/a.stl", "x", ANYWAY).unwrap();
    assert!(matches!(sound.hash("in/a.stl", &version), Err(Trouble::Changed)), "the same bytes, another version");
    assert!(!sound.remove_if("in/a.stl", &version, ANYWAY).unwrap());
    assert!(sound.stat("in/a.stl").unwrap().is_some(), "another version stays");
    assert!(matches!(sound.copy_new(("in/a.stl", &version), "done/a.stl", "x", ANYWAY), Err(Trouble::Changed)));
    assert_eq!(keys(&sound, "done"), [""; 0], "of what was replaced meanwhile there is no copy");
    let now = sound.stat("in/a.stl").unwrap().unwrap().version;
    assert!(sound.remove_if("in/a.stl", &now, ANYWAY).unwrap() && sound.stat("in/a.stl").unwrap().is_none());
}

#[test]
fn an_outage_is_known_until_a_call_is_answered() {
    let inner = Arc::new(InMemory::new());
    let dead = bucket(&inner, 0, 0, Some(0), 64);
    assert!(dead.trouble().is_none());
    assert!(matches!(dead.stat("in/a"), Err(Trouble::Away(_))));
    let why = dead.trouble().unwrap();
    assert!(why.starts_with("s3://prints/farm: the object store does not serve us"), "{why}");
    let alive = bucket(&inner, 0, 0, None, 64);
    alive.caller.weather.foul("gone");
    alive.stat("in/a").unwrap();
    assert_eq!(alive.trouble(), None);
}

/// The longest unused goes first, and what is in use never.
#[test]
fn the_cache_is_bounded() {
    let dir = tempfile::tempdir().unwrap();
    let inner = Arc::new(InMemory::new());
    let bucket = bucket(&inner, 0, 0, None, 64);
    let cache = Cache::new(dir.path().join("cache"), 10);
    let version = |name: &str| bucket.stat(name).unwrap().unwrap().version;
    let work = |name: &str| dir.path().join(name);
    for name in ["a", "b", "c", "d"] {
        std::fs::write(work("drop"), format!("{name}2345")).unwrap();
        bucket.put_new(&work("drop"), name, "x", ANYWAY).unwrap();
        cache.give(&bucket, name, &version(name), &work(name)).unwrap();
        std::thread::sleep(std::time::Duration::from_millis(10));
        if name != "a" {
            std::fs::remove_file(work(name)).unwrap();
        }
    }
    let here = |name: &str| cache.path(name, &version(name)).exists();
    // Fifteen bytes that are in no use but for `a` do not fit into ten.
    assert_eq!(["a", "b", "c", "d"].map(here), [true, false, true, true]);
    assert_eq!(std::fs::read(work("a")).unwrap(), b"a2345");
    // A drop that is larger than the whole cache may be is not kept, and pushes nothing out.
    std::fs::write(work("drop"), "eleven byte").unwrap();
    bucket.put_new(&work("drop"), "e", "x", ANYWAY).unwrap();
    cache.give(&bucket, "e", &version("e"), &work("e")).unwrap();
    assert_eq!(std::fs::read(work("e")).unwrap(), b"eleven byte");
    assert_eq!(["a", "c", "d", "e"].map(here), [true, true, true, false]);
}

/// A worker that lost its claim while it sent the parts of its result makes no object of them.
#[test]
fn the_gate_is_asked_right_before_the_commit() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("a");
    std::fs::write(&file, b"0123456789").unwrap();
    let bucket = bucket(&Arc::new(InMemory::new()), 0, 0, None, 4);
    let lost = || Err(std::io::Error::other("lost").into());
    for part in ["parts", "one"] {
        let put = match part {
            "one" => bucket.put_bytes_new(&b"x"[..], "out/a", "x", &lost),
            _ => bucket.put_new(&file, "out/a", "x", &lost),
        };
        assert!(put.is_err(), "{part}");
        assert!(bucket.stat("out/a").unwrap().is_none(), "{part}");
    }
}

/// The daemon finds out what a bucket can do before it uses it.
#[test]
fn a_bucket_proves_that_it_keeps_conditions() {
    let store = || Faulty::over(&Arc::new(InMemory::new()), 0, 0, None);
    for address in ["s3://prints/farm", "s3://prints"] {
        let good = over(store(), address, 64);
        assert!(good.trouble().unwrap().contains("has not answered yet"));
        good.prove().unwrap();
        assert_eq!(good.trouble(), None);
        assert_eq!(keys(&good, ".suture"), [""; 0], "nothing of it stays");
        good.put_bytes_new(&b"x"[..], "in/a.stl", "x", ANYWAY).unwrap();
        assert_eq!(keys(&good, "in"), ["a.stl"]);
    }
    let careless = over(store().careless(), "s3://prints/farm", 64);
    let Err(Trouble::Denied(line)) = careless.prove() else { panic!("it replaces what is there") };
    assert!(line.starts_with("s3://prints/farm: ") && line.contains("If-None-Match"), "{line}");
    let forgetful = over(store().forgetful(), "s3://prints/farm", 64);
    let Err(Trouble::Denied(line)) = forgetful.prove() else { panic!("it does not tell whose an object is") };
    assert!(line.contains("keeps metadata"), "{line}");
    assert_eq!(keys(&forgetful, ".suture"), [""; 0]);
    let refusing = over(store().refusing(), "s3://prints/farm", 64);
    assert!(matches!(refusing.prove(), Err(Trouble::Denied(_))));
    let away = over(Faulty::over(&Arc::new(InMemory::new()), 0, 0, Some(0)), "s3://prints/farm", 64);
    assert!(matches!(away.prove(), Err(Trouble::Away(_))), "that is no reason to refuse");
    assert!(away.trouble().is_some());
}

/// Between the look and the removal another object took the name: the condition holds it, as a look does where the server knows none.
#[test]
fn an_object_that_took_the_name_stays() {
    for is_careless in [false, true] {
        let store = Faulty::over(&Arc::new(InMemory::new()), 0, 0, None);
        let bucket = over(if is_careless { store.careless() } else { store }, "s3://prints/farm", 64);
        bucket.put_bytes_new(&b"old"[..], "in/a", "x", ANYWAY).unwrap();
        let old = bucket.stat("in/a").unwrap().unwrap().version;
        bucket.remove("in/a").unwrap();
        bucket.put_bytes_new(&b"new"[..], "in/a", "x", ANYWAY).unwrap();
        assert!(!bucket.remove_if("in/a", &old, ANYWAY).unwrap());
        assert_eq!(bucket.delete("in/a", &old, ANYWAY).unwrap(), is_careless);
        assert_eq!(bucket.stat("in/a").unwrap().is_some(), !is_careless);
    }
}

/// Access that is taken away while the daemon runs is an outage, and of no object a word is believed.
#[test]
fn a_refusal_says_nothing_of_an_object() {
    let bucket = over(Faulty::over(&Arc::new(InMemory::new()), 0, 0, None).refusing(), "s3://prints/farm", 64);
    bucket.caller.is_patient.store(true, std::sync::atomic::Ordering::Relaxed);
    bucket.caller.proved.set(()).unwrap();
    assert!(matches!(bucket.stat("in/a"), Err(Trouble::Denied(_))));
    assert!(matches!(bucket.list("in"), Err(Trouble::Denied(_))));
    assert!(matches!(bucket.put_bytes_new(&b"x"[..], "out/a", "x", ANYWAY), Err(Trouble::Denied(_))));
    assert!(matches!(bucket.remove("out/a"), Err(Trouble::Denied(_))));
    assert!(bucket.trouble().unwrap().contains("403"));
}
