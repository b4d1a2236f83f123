//! A farm of daemons that each do a part of the work, on one database and one bucket: the hosts are processes with a state folder each.

use std::collections::BTreeMap;
use std::process::Command;

use serde_json::Value;
use suture_store::testkit::server::server;
use suture_tests::Place;
use suture_tests::hot::holes;
use suture_tests::http::Client;
use suture_tests::moto::{Store, on};
use suture_tests::receiver::Receiver;
use suture_tests::served::{Served, wait_until};

use super::farm::{database, is_over, shared_jobs};

/// A farm that nobody works in yet.
struct Farm {
    place: Place,
    bucket: Store,
    url: String,
}

impl Farm {
    /// `None`, and a line: this machine lacks a server.
    fn new() -> Option<Self> {
        let (server, bucket) = (server()?, Store::start()?);
        bucket.ask("PUT", "/prints", b"");
        Some(Self { place: Place::new(), bucket, url: database(server) })
    }

    /// Writes the configuration of a host, with these lines at its end.
    fn configure(&self, host: &str, lines: &str) {
        let head = format!("state = \"{host}\"\nstore = \"{}\"\nrescan = \"1s\"\n", self.url);
        let folder = "[[folders]]\npath = \"s3://prints/farm\"\nname = \"farm\"\n[api]\nlisten = \"127.0.0.1:0\"\n";
        self.place.put(&format!("{host}.toml"), format!("{head}{folder}{lines}").as_bytes());
    }

    fn command(&self, host: &str, roles: &str) -> Command {
        let mut command = on(self.place.command(), self.bucket.port);
        command.args(["watch", "--config", &format!("{host}.toml"), "--role", roles]);
        command
    }

    /// Starts the daemon of a host that is configured.
    fn start(&self, host: &str, roles: &str) -> Served<'_> {
        let served = Served::of(&self.place, self.command(host, roles), &format!("{host}.log"));
        let begun = served.lines("Beginning.");
        assert_eq!(begun.first().map(|line| line["roles"].clone()), Some(roles.into()));
        served
    }

    fn drop_files(&self, numbers: std::ops::RangeInclusive<u64>) {
        for n in numbers {
            self.bucket.ask("PUT", &format!("/prints/farm/in/{n}.stl"), &drop_of(n));
        }
    }

    fn hosts(&self, words: &[&str]) -> Vec<Value> {
        let told = self.place.suture(["hosts", "--json", "--store", &self.url].iter().chain(words)).expect(0).stdout();
        told.lines().map(|line| serde_json::from_str(line).expect("a line of JSON")).collect()
    }

    fn wait_for(&self, ended: usize) {
        wait_until("all are done", || {
            let jobs = shared_jobs(&self.place, &self.url);
            jobs.len() >= ended && jobs.iter().all(|job| is_over(&job.2) || job.2 == "cancelled")
        });
    }

    /// Each of so many drops has one result, which is that of a folder, and its original is whole.
    fn assert_done(&self, count: u64) {
        let mut wanted = Vec::new();
        for n in 1..=count {
            wanted.push(format!("farm/done/{n}.stl"));
            wanted.extend(["", ".report.json", ".suture.json"].map(|end| format!("farm/out/{n}.stl{end}")));
            self.place.put(&format!("{n}.stl"), &drop_of(n));
            self.place.repair(&format!("{n}.stl"), &format!("{n}.repaired.stl"), &[]);
            let result = self.bucket.ask("GET", &format!("/prints/farm/out/{n}.stl"), b"");
            assert!(result == self.place.read(&format!("{n}.repaired.stl")), "the result of {n}");
            assert!(self.bucket.ask("GET", &format!("/prints/farm/done/{n}.stl"), b"") == drop_of(n), "the original of {n}");
        }
        wanted.sort();
        // A daemon that was killed while it tried the bucket leaves that for a day.
        let mut keys = self.bucket.keys();
        keys.retain(|key| !key.starts_with("farm/.suture/probe-"));
        assert_eq!(keys, wanted);
    }
}

/// One of the drops, all of which can be made good.
fn drop_of(n: u64) -> Vec<u8> {
    holes(1 + n % 4)
}

fn hook(receiver: &Receiver) -> String {
    format!("[[webhook]]\nname = \"shop\"\nurl = \"http://{}/\"\n", receiver.address)
}

/// How often each job was told of, by its number.
fn told(receiver: &Receiver) -> BTreeMap<u64, usize> {
    let mut told = BTreeMap::new();
    for message in receiver.came() {
        *told.entry(message.json()["job"]["id"].as_u64().expect("a number")).or_default() += 1;
    }
    told
}

/// A part of the work needs others for the rest, and a folder that these reach.
#[test]
fn a_part_of_the_work_that_no_one_could_complete_is_refused_in_a_line() {
    let place = Place::new();
    let refused = |arguments: &[&str]| {
        let ran = place.suture(arguments).expect(2).stderr();
        assert_eq!(ran.lines().count(), 1, "{ran}");
        ran
    };
    let said = refused(&["watch", "hot", "--role", "worker"]);
    assert!(said.contains("`hot` lies on this machine") && said.contains("worker alone") && said.contains("s3://"), "{said}");
    place.put("far.toml", b"state = \"state\"\nroles = [\"intake\", \"control\"]\n[[folders]]\npath = \"s3://prints/farm\"\n");
    let said = refused(&["config", "check", "far.toml"]);
    assert!(said.contains("far.toml: line 2, `roles = [\"intake\", \"control\"]`: ") && said.contains("--store"), "{said}");
    let said = refused(&["watch", "--config", "far.toml", "--once", "--store", "postgres://nowhere.invalid/x"]);
    assert!(said.contains("--once waits for the end of all work"), "{said}");
    place.put("wrong.toml", b"roles = [\"boss\"]\n[[folders]]\npath = \"hot\"\n");
    let said = refused(&["config", "check", "wrong.toml"]);
    assert!(said.contains("line 1, `roles = [\"boss\"]`: `boss` is no role; name some of intake, worker, control"), "{said}");
    assert!(!place.at("hot").exists());
}

/// Intake, worker and control are processes of their own; each is killed once in the middle. Every drop has one result, and is told of under one name.
#[test]
fn three_daemons_with_one_role_each_are_a_farm_whoever_is_killed() {
    let Some(farm) = Farm::new() else { return };
    let receiver = Receiver::start();
    for host in ["intake", "worker", "control"] {
        farm.configure(host, &hook(&receiver));
    }
    let start = |role| farm.start(role, role);
    let (control, intake) = (start("control"), start("intake"));
    farm.drop_files(1..=4);
    wait_until("they are jobs", || shared_jobs(&farm.place, &farm.url).len() == 4);
    assert!(shared_jobs(&farm.place, &farm.url).iter().all(|job| job.2 == "queued"), "no one works yet");
    assert!(intake.lines("Serving the web interface.").is_empty());
    let status = farm.place.suture(["status", "--store", &farm.url]).expect(0).stdout();
    assert!(status.contains("no host works on the folder `farm`"), "{status}");
    let worker = start("worker");
    wait_until("one is done", || farm.bucket.keys().contains(&"farm/out/1.stl".into()));
    // Not their ends: kills.
    drop(intake);
    farm.drop_files(5..=8);
    let _intake = start("intake");
    wait_until("a later one is done", || farm.bucket.keys().contains(&"farm/out/5.stl".into()));
    drop(worker);
    let _worker = start("worker");
    wait_until("some are told of", || receiver.came().len() >= 3);
    drop(control);
    farm.drop_files(9..=12);
    let _control = start("control");
    farm.wait_for(12);
    wait_until("all are told of", || told(&receiver).len() == 12);
    farm.assert_done(12);
    let jobs = shared_jobs(&farm.place, &farm.url);
    assert!(jobs.len() == 12 && jobs.iter().all(|job| job.2 == "done"), "{jobs:?}");
    // Between a delivery and the note of it a kill tells of one job again, under the same name.
    let twice = told(&receiver).values().filter(|count| **count > 1).count();
    assert!(twice <= 1, "{:?}", told(&receiver));
}

/// Of two that show the farm one tells of each end; when it goes, the other one does.
#[test]
fn two_daemons_with_the_role_control_tell_of_each_end_once() {
    let Some(farm) = Farm::new() else { return };
    let receiver = Receiver::start();
    for host in ["first", "second", "works"] {
        farm.configure(host, &hook(&receiver));
    }
    let (first, _second, _works) =
        (farm.start("first", "control"), farm.start("second", "control"), farm.start("works", "intake,worker"));
    farm.drop_files(1..=3);
    wait_until("all are told of", || told(&receiver).len() == 3);
    first.signal(rustix::process::Signal::TERM);
    assert!(first.ended().success());
    farm.drop_files(4..=6);
    wait_until("all are told of", || told(&receiver).len() == 6);
    // Whoever told it again would do so at once.
    std::thread::sleep(std::time::Duration::from_secs(2));
    assert!(told(&receiver).values().all(|count| *count == 1), "{:?}", told(&receiver));
}

fn page(client: &Client) -> String {
    String::from_utf8(client.browse("/").body).expect("a page")
}

/// A host that is drained finishes what it has, also over a restart; page, interface, metrics and command line show each host, and what waits for one.
#[test]
fn a_host_is_drained_and_resumed_and_all_hosts_are_shown() {
    let Some(farm) = Farm::new() else { return };
    for host in ["shows", "works"] {
        farm.configure(host, "");
    }
    let shows = farm.start("shows", "intake,control");
    let works = farm.start("works", "worker");
    let client = Client::of(&shows);
    farm.drop_files(1..=2);
    farm.wait_for(2);
    let hosts = farm.hosts(&["list"]);
    let daemon = hosts.iter().find(|host| host["roles"] == serde_json::json!(["worker"])).expect("a worker")["daemon"].clone();
    let daemon = daemon.as_str().expect("a name");
    assert!(
        hosts.len() == 2 && hosts.iter().all(|host| host["is_alive"] == true && host["version"] == env!("CARGO_PKG_VERSION")),
        "{hosts:?}"
    );
    let drained = farm.hosts(&["drain", daemon]);
    assert_eq!(drained.iter().filter(|host| host["is_draining"] == true).count(), 1);
    wait_until("it says so", || !works.lines("This host is drained").is_empty());
    drop(works);
    let works = farm.start("works", "worker");
    wait_until("and after a restart", || !works.lines("This host is drained").is_empty());
    farm.drop_files(3..=3);
    wait_until("it waits", || shared_jobs(&farm.place, &farm.url).iter().any(|job| job.2 == "queued"));
    let stranded = "no host works on the folder `farm`";
    wait_until("the page shows it", || page(&client).contains(stranded) && page(&client).contains("drained"));
    assert!(page(&client).contains("<h2>Hosts</h2>") && page(&client).contains(daemon));
    let metrics = String::from_utf8(client.get("/metrics").body).expect("text");
    for line in ["suture_hosts{state=\"alive\"} 1", "suture_hosts{state=\"drained\"} 1", "suture_farm_workers 0"] {
        assert!(metrics.lines().any(|there| there == line), "{line}: {metrics}");
    }
    let status = farm.place.suture(["status", "--store", &farm.url]).expect(0).stdout();
    assert!(status.contains(stranded) && status.contains(&format!("host      {daemon}: drained, worker, 0 in work")), "{status}");
    assert_eq!(client.send("POST", "/v1/hosts/nobody/resume", &[], b"").status, 404);
    let refused = farm.place.suture(["hosts", "drain", "nobody", "--store", &farm.url]).expect(2).stderr();
    assert!(refused.contains("called nobody"), "{refused}");
    let resumed = client.send("POST", &format!("/v1/hosts/{}/resume", daemon.replace('/', "%2F")), &[], b"").expect(200).json();
    assert!(
        resumed["hosts"].as_array().is_some_and(|hosts| hosts.len() == 2 && hosts.iter().all(|host| host["state"] == "alive"))
    );
    farm.wait_for(3);
    farm.assert_done(3);
}

/// One host makes the first result of each drop, the other one the second; one of them is published, and it is that of a folder.
#[test]
fn each_drop_is_computed_on_two_hosts_and_published_once() {
    let Some(farm) = Farm::new() else { return };
    farm.configure("shows", "");
    let shows = farm.start("shows", "intake,control");
    let works = ["one", "two"].map(|host| {
        farm.configure(host, "");
        let text = String::from_utf8(farm.place.read(&format!("{host}.toml"))).expect("text");
        farm.place.put(&format!("{host}.toml"), format!("check_one_in = 1\n{text}").as_bytes());
        farm.start(host, "worker")
    });
    farm.drop_files(1..=4);
    farm.wait_for(4);
    farm.assert_done(4);
    let jobs = shared_jobs(&farm.place, &farm.url);
    assert!(jobs.iter().all(|job| job.2 == "done" && job.3 >= 2), "{jobs:?}");
    let compared = works.iter().zip(["two", "one"]).flat_map(|(host, other)| {
        let other = format!(":{}", farm.place.at(other).display());
        let is_by = move |first: &Value| first.as_str().is_some_and(|first| first.ends_with(&other));
        host.lines("Computed twice: both results are the same.")
            .into_iter()
            .map(move |line| (line["job"].as_u64(), is_by(&line["first"])))
    });
    let mut compared: Vec<_> = compared.collect();
    compared.sort_unstable();
    assert!(compared.iter().map(|(job, _)| *job).eq((1..=4).map(Some)), "each once: {compared:?}");
    let by_another = compared.iter().filter(|(_, by_another)| *by_another).count();
    assert_eq!(by_another, 4);
    drop(shows);
}

/// A file that no host may take waits, and it is said which; a host that takes it does.
#[test]
fn a_file_that_is_too_large_for_all_waits_for_one_that_takes_it() {
    let Some(farm) = Farm::new() else { return };
    farm.configure("shows", "");
    farm.configure("small", "");
    let text = String::from_utf8(farm.place.read("small.toml")).expect("text");
    farm.place.put("small.toml", format!("largest = 100\n{text}").as_bytes());
    let (shows, _small) = (farm.start("shows", "intake,control"), farm.start("small", "worker"));
    farm.drop_files(1..=1);
    let client = Client::of(&shows);
    let waits = || {
        client.get("/v1/status").json()["stranded"].as_array().is_some_and(|stranded| {
            stranded
                .iter()
                .any(|what| what.as_str().is_some_and(|what| what.starts_with("job 1 waits for a host that takes files of")))
        })
    };
    wait_until("it is said", waits);
    farm.configure("large", "");
    let _large = farm.start("large", "worker");
    farm.wait_for(1);
    assert!(!waits());
    farm.assert_done(1);
}
