//! A hot folder in a bucket, on a server that speaks S3, behind a proxy that fails.

use std::os::unix::process::ExitStatusExt;
use std::process::Command;

use suture_bench::generate::Case;
use suture_tests::Place;
use suture_tests::binary::with_crash_points;
use suture_tests::hot::{doubtful, holes};
use suture_tests::moto::{Store, on};
use suture_tests::proxy::{Mood, Proxy};
use suture_tests::served::{Served, wait_until};

/// A proxy before the store.
fn proxy(store: &Store, mood: Mood) -> Proxy {
    Proxy::start("127.0.0.1", store.address(), mood, 24)
}

fn watch(place: &Place, port: u16) -> Command {
    let mut command = serve(place, port);
    command.arg("--once");
    command
}

fn serve(place: &Place, port: u16) -> Command {
    let mut command = on(place.command(), port);
    command.args(["watch", "--config", "suture.toml"]);
    command
}

fn configured(bucket: &str) -> Place {
    let place = Place::new();
    place.put(
        "suture.toml",
        format!("state = \"state\"\nrescan = \"1s\"\n[[folders]]\npath = \"s3://{bucket}\"\nname = \"farm\"\n").as_bytes(),
    );
    place
}

/// Each drop has one result, the bytes are those of a folder, and originals are whole, whatever the way to the store loses.
#[test]
fn a_bucket_gets_the_results_that_a_folder_gets() {
    let Some(store) = Store::start() else { return };
    let place = configured("prints/farm");
    store.ask("PUT", "/prints", b"");
    for n in 1..=4 {
        store.ask("PUT", &format!("/prints/farm/in/{n}.stl"), &holes(n));
        place.put(&format!("local/in/{n}.stl"), &holes(n));
    }
    store.ask("PUT", "/prints/farm/in/bad.stl", b"no mesh");
    place.suture(["watch", "local", "--once", "--settle", "10ms"]).expect(0);
    let way = proxy(&store, Mood::Failing);
    for port in [way.address.port(), store.port] {
        let ran = watch(&place, port).output().expect("it runs");
        let said = String::from_utf8_lossy(&ran.stderr).into_owned();
        assert!(!said.contains("a-secret") && !said.contains("a-key"), "{said}");
        assert!(!said.contains("without regard to conditions"), "this server knows them: {said}");
    }
    let mut wanted: Vec<String> =
        ["bad.stl", "bad.stl.report.json", "bad.stl.suture.json"].map(|name| format!("farm/failed/{name}")).into();
    for n in 1..=4 {
        wanted.push(format!("farm/done/{n}.stl"));
        wanted.extend(["", ".report.json", ".suture.json"].map(|end| format!("farm/out/{n}.stl{end}")));
        assert!(store.ask("GET", &format!("/prints/farm/done/{n}.stl"), b"") == holes(n), "the original of {n}");
        assert!(
            store.ask("GET", &format!("/prints/farm/out/{n}.stl"), b"") == place.read(&format!("local/out/{n}.stl")),
            "the result of {n}"
        );
    }
    wanted.sort();
    let mut keys = store.keys();
    // A daemon whose removal of it failed leaves that for a day.
    keys.retain(|key| !key.starts_with("farm/.suture/probe-"));
    assert_eq!(keys, wanted);
}

/// The one line that a daemon says which does not begin.
fn refused(mut command: Command) -> String {
    let ran = command.output().expect("it runs");
    let said = String::from_utf8_lossy(&ran.stderr).into_owned();
    assert_eq!((ran.status.code(), said.lines().count()), (Some(2), 1), "{said}");
    assert!(!said.contains("a-secret") && !said.contains("a-key"), "{said}");
    said
}

#[test]
fn a_bucket_that_is_not_there_or_not_ours_is_one_line() {
    let Some(store) = Store::start() else { return };
    let said = refused(watch(&configured("nowhere/farm"), store.port));
    assert!(said.contains("s3://nowhere/farm: there is no such bucket; see to its name"), "{said}");
    store.ask("PUT", "/prints", b"");
    let place = configured("prints/farm");
    let said = refused(watch(&place, proxy(&store, Mood::Refusing).address.port()));
    assert!(said.contains("s3://prints/farm") && said.contains("AccessDenied"), "{said}");
    let mut command = watch(&place, store.port);
    command.env_remove("AWS_ACCESS_KEY_ID").env("AWS_PROFILE", "farm");
    let said = refused(command);
    assert!(said.contains("profiles are not read"), "{said}");
    let mut command = on(place.command(), store.port);
    command.args(["watch", "s3://prints/farm"]);
    let said = refused(command);
    assert!(said.contains("--config") && !place.at("s3:").exists(), "{said}");
    assert_eq!(store.keys(), [""; 0], "nothing was written");
}

/// While the store refuses, or is not there, jobs wait; each outage is said once, and so is its end.
#[test]
fn an_outage_is_waited_out_and_said_once() {
    let Some(store) = Store::start() else { return };
    store.ask("PUT", "/prints", b"");
    let (place, way) = (configured("prints/farm"), proxy(&store, Mood::Dead));
    let ran = watch(&place, way.address.port()).output().expect("it runs");
    assert!(!ran.status.success(), "nothing was looked at: {}", String::from_utf8_lossy(&ran.stderr));
    way.become_now(Mood::Honest);
    let served = Served::of(&place, serve(&place, way.address.port()), "log");
    let listed = || place.suture(["jobs", "list", "--dir", "state/buckets/farm"]).expect(0).stdout();
    for (n, trouble) in [(1, Mood::Refusing), (2, Mood::Dead)] {
        let is_there = |name: String| move |store: &Store| store.keys().contains(&name);
        let arrived = is_there(format!("farm/done/{n}.stl"));
        way.become_now(trouble);
        wait_until("the outage is said", || served.lines("The folder cannot be served for now.").len() == n);
        store.ask("PUT", &format!("/prints/farm/in/{n}.stl"), &holes(n as u64));
        let list = listed();
        assert!(list.contains("out of reach: s3://prints/farm: "), "{list}");
        // Some looks go by.
        std::thread::sleep(std::time::Duration::from_secs(5));
        assert!(!arrived(&store), "nobody could have put it there");
        way.become_now(Mood::Honest);
        wait_until("the drop is done", || arrived(&store));
        assert_eq!(served.lines("The folder cannot be served for now.").len(), n, "once");
        assert_eq!(served.lines("The folder is back.").len(), n);
        assert!(!listed().contains("out of reach"), "{}", listed());
    }
    assert!(store.keys().iter().all(|key| !key.starts_with("farm/failed/") && !key.starts_with("farm/quarantine/")));
}

/// Where versions are kept, an original goes as the very version that was copied; an earlier drop, which it had replaced, is no drop again. At the root of a
/// bucket all is as below a prefix.
#[test]
fn a_version_is_removed_and_no_other() {
    let Some(store) = Store::start() else { return };
    store.ask("PUT", "/prints", b"");
    store.ask("PUT", "/prints?versioning", b"<VersioningConfiguration><Status>Enabled</Status></VersioningConfiguration>");
    store.ask("PUT", "/prints/in/a.stl", b"an earlier drop of the name");
    // The store tells times in seconds.
    std::thread::sleep(std::time::Duration::from_millis(1100));
    store.ask("PUT", "/prints/in/a.stl", &holes(1));
    let place = configured("prints");
    for _ in 0..2 {
        let ran = watch(&place, store.port).output().expect("it runs");
        assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
    }
    assert_eq!(store.keys(), ["done/a.stl", "out/a.stl", "out/a.stl.report.json", "out/a.stl.suture.json"]);
    assert!(store.ask("GET", "/prints/done/a.stl", b"") == holes(1));
    let versions = String::from_utf8(store.ask("GET", "/prints?versions&prefix=in/", b"")).expect("text");
    assert_eq!((versions.matches("<Version>").count(), versions.matches("<DeleteMarker>").count()), (1, 1), "{versions}");
    let of_its_own = String::from_utf8(store.ask("GET", "/prints?versions&prefix=.suture/", b"")).expect("text");
    assert!(!of_its_own.contains("<Version>") && !of_its_own.contains("<DeleteMarker>"), "{of_its_own}");
}

/// A person approves a result as in a folder: the bytes that were judged are published, and nothing stays of it in `failed/`.
#[test]
fn what_is_approved_is_published_in_the_bucket() {
    let Some(store) = Store::start() else { return };
    store.ask("PUT", "/prints", b"");
    store.ask("PUT", "/prints/farm/in/part.stl", &doubtful());
    let place = configured("prints/farm");
    let _served = Served::of(&place, serve(&place, store.port), "log");
    wait_until("it needs review", || store.keys().contains(&"farm/failed/part.stl".into()));
    let best = store.ask("GET", "/prints/farm/failed/part.best.stl", b"");
    let approve = || place.suture(["jobs", "approve", "1", "--as", "Ada", "--dir", "state/buckets/farm"]);
    wait_until("the job is at its end", || approve().code() == 0);
    let wanted = ["done/part.stl", "out/part.stl", "out/part.stl.report.json", "out/part.stl.suture.json"];
    wait_until("it is published", || store.keys() == wanted.map(|key| format!("farm/{key}")));
    assert!(store.ask("GET", "/prints/farm/out/part.stl", b"") == best);
    assert!(store.ask("GET", "/prints/farm/done/part.stl", b"") == doubtful());
}

/// Killed at each point of its way in turn, and begun again: one result, the original whole, nothing else.
#[test]
fn killed_at_each_point_it_leaves_one_result() {
    let Some(store) = Store::start() else { return };
    store.ask("PUT", "/prints", b"");
    let mut killed = 0;
    for pass in 1.. {
        let place = configured(&format!("prints/{pass}"));
        store.ask("PUT", &format!("/prints/{pass}/in/a.stl"), &holes(1));
        let status = on(place.command_of(with_crash_points()), store.port)
            .args(["watch", "--config", "suture.toml", "--once"])
            .env("SUTURE_CRASH_AT", format!("*:{pass}"))
            .status()
            .expect("it runs");
        let ran = watch(&place, store.port).output().expect("it runs");
        assert!(ran.status.success(), "{pass}: {}", String::from_utf8_lossy(&ran.stderr));
        let names = ["done/a.stl", "out/a.stl", "out/a.stl.report.json", "out/a.stl.suture.json"];
        let keys = store.keys().into_iter().filter(|key| key.starts_with(&format!("{pass}/"))).collect::<Vec<_>>();
        assert_eq!(keys, names.map(|name| format!("{pass}/{name}")), "{pass}");
        assert!(store.ask("GET", &format!("/prints/{pass}/done/a.stl"), b"") == holes(1), "{pass}");
        if status.success() {
            break;
        }
        assert_eq!(status.signal(), Some(9), "{pass}");
        killed += 1;
    }
    assert!(killed >= 10, "only {killed} points");
}

/// A result that is larger than one call goes up in parts, and nobody sees it before it is whole.
#[test]
fn a_large_result_goes_up_in_parts() {
    let Some(store) = Store::start() else { return };
    store.ask("PUT", "/prints", b"");
    let place = configured("prints/farm");
    let (drop, _) = place.generate(Case::Clean, 400_000, 1);
    let drop = std::fs::read(drop).expect("it was written");
    assert!(drop.len() > 16 << 20, "{} bytes are one part", drop.len());
    store.ask("PUT", "/prints/farm/in/large.stl", &drop);
    let ran = watch(&place, store.port).output().expect("it runs");
    assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
    assert!(store.ask("GET", "/prints/farm/done/large.stl", b"") == drop);
    let receipt = store.ask("GET", "/prints/farm/out/large.stl.suture.json", b"");
    let receipt: serde_json::Value = serde_json::from_slice(&receipt).expect("JSON");
    let result = store.ask("GET", "/prints/farm/out/large.stl", b"");
    assert!(result.len() > 16 << 20);
    assert_eq!(receipt["output_blake3"], blake3::hash(&result).to_hex().as_str());
}
