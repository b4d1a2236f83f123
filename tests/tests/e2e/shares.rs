//! A hot folder on a share, which daemons of several machines serve: the machines are processes with a state folder each, the share is a folder of all.

use std::process::Command;

use rustix::process::Signal;
use suture_bench::generate::{Case, write};
use suture_store::testkit::server::server;
use suture_tests::Place;
use suture_tests::hot::holes;
use suture_tests::http::Client;
use suture_tests::served::{Served, jobs, wait_until};

use super::farm::{database, is_over, shared_jobs};

/// Configures a host, with these lines about the folder.
fn configure(place: &Place, host: &str, url: &str, of_folder: &str) {
    let head = format!("state = \"{host}\"\nstore = \"{url}\"\nsettle = \"30ms\"\nrescan = \"200ms\"\ncheck_one_in = 0\n");
    let text = format!("{head}[[folders]]\npath = \"share\"\nname = \"prints\"\n{of_folder}\n[api]\nlisten = \"127.0.0.1:0\"\n");
    place.put(&format!("{host}.toml"), text.as_bytes());
}

fn command(place: &Place, host: &str, words: &[&str]) -> Command {
    let mut command = place.command();
    command.args(["watch", "--config", &format!("{host}.toml")]).args(words);
    command
}

fn start<'a>(place: &'a Place, host: &str, words: &[&str]) -> Served<'a> {
    Served::of(place, command(place, host, words), &format!("{host}.log"))
}

fn drop_files(place: &Place, numbers: std::ops::RangeInclusive<u64>) {
    for n in numbers {
        // As a careful program does.
        place.put(&format!("share/in/.{n}.tmp"), &holes(1 + n % 4));
        std::fs::rename(place.at(&format!("share/in/.{n}.tmp")), place.at(&format!("share/in/{n}.stl"))).expect("a rename");
    }
}

fn wait_for(place: &Place, url: &str, count: usize) {
    wait_until("all are done", || {
        let jobs = shared_jobs(place, url);
        jobs.len() == count && jobs.iter().all(|job| is_over(&job.2))
    });
}

/// Each of so many drops has one result, which is that of a machine alone, and its original is whole.
fn assert_done(place: &Place, count: u64) {
    wait_until("no attempt leaves anything", || place.names("share/.suture/work").is_empty());
    let (mut out, mut done) = (Vec::new(), Vec::new());
    for n in 1..=count {
        done.push(format!("{n}.stl"));
        out.extend(["", ".report.json", ".suture.json"].map(|end| format!("{n}.stl{end}")));
        place.put(&format!("{n}.stl"), &holes(1 + n % 4));
        place.repair(&format!("{n}.stl"), &format!("{n}.repaired.stl"), &[]);
        assert!(place.read(&format!("share/out/{n}.stl")) == place.read(&format!("{n}.repaired.stl")), "the result of {n}");
        assert!(place.read(&format!("share/done/{n}.stl")) == holes(1 + n % 4), "the original of {n}");
    }
    for (part, mut wanted) in [("out", out), ("done", done), ("in", Vec::new()), ("failed", Vec::new())] {
        wanted.sort();
        let mut names = place.names(&format!("share/{part}"));
        names.sort();
        assert_eq!(names, wanted, "{part}");
    }
}

/// The hosts that look for drops in the share, as the store has them.
fn keepers(place: &Place, url: &str) -> Vec<String> {
    let said = place.suture(["hosts", "list", "--store", url]).expect(0).stdout();
    let keeps = said.lines().filter(|line| line.contains(": alive, ") && line.contains("; looks for drops in prints;"));
    keeps.filter_map(|line| Some(line.split(": alive").next()?.rsplit('/').next()?.to_owned())).collect()
}

/// The words of a daemon that does not begin.
fn refused(place: &Place, host: &str, words: &[&str], exit: i32) -> String {
    let mut arguments = vec!["watch".to_owned(), "--config".into(), format!("{host}.toml")];
    arguments.extend(words.iter().map(|word| (*word).to_owned()));
    place.suture(&arguments).expect(exit).stderr()
}

#[test]
fn a_share_without_a_database_that_others_see_is_refused_in_a_line() {
    let place = Place::new();
    for (lines, says) in [
        (
            "[[folders]]\npath = \"share\"\nshared = true\n",
            "line 2, `path = \"share\"`: a folder that daemons on several machines serve",
        ),
        (
            "state = \"s\"\n[[folders]]\npath = \"share\"\nshared = true\n",
            "wrong.toml: the folder `share` is served by other daemons, too",
        ),
        ("state = \"share/s\"\n[[folders]]\npath = \"share\"\nshared = true\n", "`state` is of this machine alone"),
        ("state = \"s\"\n[[folders]]\npath = \"s3://farm\"\nshared = true\n", "leave `shared` out"),
    ] {
        place.put("wrong.toml", lines.as_bytes());
        let said = place.suture(["config", "check", "wrong.toml"]).expect(2).stderr();
        assert!(said.contains(says) && said.lines().count() == 1, "{said}");
    }
}

/// One daemon looks for drops, and another one works; when the first ends, or is killed, a third one looks. No daemon serves the folder alone meanwhile.
#[test]
fn daemons_of_several_machines_share_a_folder_whoever_keeps_it() {
    let Some(server) = server() else { return };
    let (place, url) = (Place::new(), database(server));
    for host in ["one", "two", "works"] {
        configure(&place, host, &url, "shared = true");
    }
    let keeps = |served: &Served| !served.lines("This daemon keeps the shared folder").is_empty();
    let looks = ["--role", "intake,control"];
    // As of an upload to a daemon that died.
    place.put("share/.suture/upload/left.part", b"solid");
    let works = start(&place, "works", &["--role", "worker"]);
    let status = || place.suture(["status", "--store", &url]).expect(0).stdout();
    let nobody = "no host looks for drops in the folder `prints`: none with the role intake is alive";
    wait_until("that nobody keeps it is told", || status().contains(nobody));
    let one = start(&place, "one", &looks);
    wait_until("the first keeps it", || keeps(&one) && !status().contains(nobody));
    assert!(!place.at("share/.suture/upload/left.part").exists());
    let two = start(&place, "two", &looks);
    drop_files(&place, 1..=12);
    wait_for(&place, &url, 12);
    assert!(!keeps(&two) && !keeps(&works));
    assert_eq!(jobs(&place, "share").len(), 12, "the daemon that keeps it answers");
    assert_eq!(keepers(&place, &url), ["one"]);
    let client = Client::of(&two);
    let page = String::from_utf8_lossy(&client.browse("/").body).into_owned();
    assert_eq!(page.matches("<td>prints</td>").count(), 1, "{page}");
    let said = client.send("POST", "/v1/jobs?name=x.stl", &[], &holes(1));
    assert!(said.status == 503 && String::from_utf8_lossy(&said.body).contains("another daemon looks for drops"), "{said:?}");

    configure(&place, "alone", &url, "");
    let said = refused(&place, "alone", &[], 73);
    assert!(said.contains("is served by another daemon") && said.lines().count() == 1, "{said}");
    for wish in ["pause", "drain"] {
        let said = place.suture(["jobs", wish, "--dir", "share"]).expect(2).stderr();
        assert!(said.contains("suture hosts drain NAME"), "{said}");
    }
    configure(&place, "called", &url, "shared = true");
    let text = String::from_utf8(place.read("called.toml")).expect("text").replace("\"prints\"", "\"other\"");
    place.put("called.toml", text.as_bytes());
    let said = refused(&place, "called", &[], 2);
    assert!(said.contains("is called `prints` by the daemons that share it"), "{said}");
    one.signal(Signal::TERM);
    assert!(one.ended().success());
    wait_until("the second keeps it", || keeps(&two));
    wait_until("that is told", || keepers(&place, &url) == ["two"]);
    drop_files(&place, 13..=16);
    wait_for(&place, &url, 16);
    // Not its end: a kill. Its lock goes with it.
    drop(two);
    let one = start(&place, "one", &looks);
    wait_until("the first keeps it again", || keeps(&one));
    drop_files(&place, 17..=20);
    wait_for(&place, &url, 20);
    assert_done(&place, 20);
    drop((one, works));
    let said = place.suture(["jobs", "list", "--dir", "share"]).expect(2).stderr();
    assert!(said.contains("the jobs are in postgres://") && said.contains("add --store"), "{said}");
    assert!(place.suture(["watch", "share", "--once"]).expect(75).stderr().contains("its jobs are in postgres://"));
}

/// Its files are worked on elsewhere: an order has one summary, of all of them, by the daemon that keeps the folder.
#[test]
fn an_order_on_a_share_is_summed_up_by_one() {
    let Some(server) = server() else { return };
    let (place, url) = (Place::new(), database(server));
    for host in ["one", "two"] {
        configure(&place, host, &url, "shared = true");
    }
    let (one, two) = (start(&place, "one", &["--role", "intake,control"]), start(&place, "two", &["--role", "worker"]));
    for n in 1..=16 {
        place.put(&format!("share/in/order/{n}.stl"), &holes(1 + n % 4));
    }
    wait_for(&place, &url, 16);
    let summary = "share/out/order/order.report.json";
    let of_all = || {
        let told: serde_json::Value = serde_json::from_slice(&place.read(summary)).expect("a summary");
        told["files"].as_array().is_some_and(|files| files.len() == 16)
    };
    wait_until("it is summed up", || place.at(summary).exists() && of_all());
    let told_by = [&one, &two].map(|served| served.lines("An order is done").len());
    assert!(told_by[0] >= 1 && told_by[1] == 0, "{told_by:?}");
}

/// A second name of a drop goes while it is worked on, as that of a dead attempt does: its inode changes, and its content does not. And a file that was
/// moved away and back, by whose job's end on another host it is a new drop.
#[test]
fn a_drop_whose_second_name_goes_is_worked_on_all_the_same() {
    let Some(server) = server() else { return };
    let (place, url) = (Place::new(), database(server));
    for host in ["one", "two"] {
        configure(&place, host, &url, "shared = true");
    }
    let (_one, _two) = (start(&place, "one", &["--role", "intake,control"]), start(&place, "two", &["--role", "worker"]));
    let mut large = Vec::new();
    write(Case::Holes, 1_000_000, 7, &mut large).expect("a mesh");
    place.put("share/.large.tmp", &large);
    let second = |n: u64| place.at(&format!("share/.second.{n}"));
    for n in 0..200 {
        std::fs::hard_link(place.at("share/.large.tmp"), second(n)).expect("a second name");
    }
    std::fs::rename(place.at("share/.large.tmp"), place.at("share/in/large.stl")).expect("a rename");
    wait_until("it is worked on", || shared_jobs(&place, &url).iter().any(|job| job.2 == "running"));
    for n in 0..200 {
        std::fs::remove_file(second(n)).expect("a second name goes");
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
    wait_for(&place, &url, 1);
    assert!(place.at("share/out/large.stl").exists() && place.read("share/done/large.stl") == large);
}
