//! A farm on a network of its own: a database, an object store, an intake and workers, each on a machine of its own.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::Permissions;
use std::os::unix::fs::PermissionsExt;
use std::process::Command;
use std::time::{Duration, Instant};

use serde_json::Value;
use suture_store::testkit::server::Server;
use suture_tests::Place;
use suture_tests::hot::holes;
use suture_tests::moto::{Store, at};
use suture_tests::proxy::{Mood, Proxy};
use suture_tests::served::{Served, wait_until};
use suture_tests::wire::{Host, Net};

use crate::world::Mount;

/// All of the farm but its daemons.
pub(crate) struct Farm {
    pub place: Place,
    pub server: Server,
    /// The disk of the database.
    _disk: Mount,
    pub database: Host,
    pub files: Files,
    net: Net,
    url: String,
}

/// Where the files are that are dropped, and their results.
pub(crate) enum Files {
    /// An object store on a machine of its own, and the way to it, if that fails.
    Bucket { bucket: Store, way: Option<Proxy>, _host: Host },
    /// A folder that all machines have.
    Share,
}

/// Where files are to be.
#[derive(Clone, Copy)]
pub(crate) enum Kind {
    Bucket,
    /// The way to it behaves so.
    BucketBehind(Mood),
    Share,
}

/// A machine with a daemon on it.
pub(crate) struct Member<'a> {
    farm: &'a Farm,
    pub host: Host,
    name: String,
    roles: &'static str,
    daemon: Option<Served<'a>>,
    lives: u32,
}

impl Farm {
    /// `None`, and a line: this machine lacks something. This thread is on the farm's network from now on.
    pub(crate) fn new(kind: Kind) -> Option<Self> {
        let net = Net::new()?;
        let place = Place::new();
        let disk = Mount::tmpfs(&place.at("disk"), "size=256m,mode=0755", 0);
        // The server has a user of its own.
        std::fs::set_permissions(place.at(""), Permissions::from_mode(0o755)).expect("the folder can be opened to others");
        let database = net.host();
        let server = Server::start_in(&place.at("disk"), &["--wal-segsize=1"])?;
        let rules = server.folder().join("data/pg_hba.conf");
        let told = std::fs::read_to_string(&rules).expect("rules of access") + "host all owner 10.77.0.0/24 trust\n";
        std::fs::write(rules, told).expect("they can be written");
        database.inside(|| {
            server.run_with(&format!("-c listen_addresses={} -c max_wal_size=16MB -c min_wal_size=2MB", database.address))
        });
        let files = Files::new(kind, &net)?;
        let url = format!("postgres://owner@{}/postgres", database.address);
        net.host().enter();
        if let Files::Bucket { bucket, .. } = &files {
            bucket.ask("PUT", "/prints", b"");
        }
        Some(Self { place, server, _disk: disk, database, files, net, url })
    }

    /// A machine with a daemon of these roles, which begins.
    pub(crate) fn member(&self, name: &str, roles: &'static str) -> Member<'_> {
        let head = format!("state = \"{name}\"\nstore = \"{}\"\nrescan = \"5s\"\nworkers = 2\nthreads = 1\n", self.url);
        let of_folder = match &self.files {
            Files::Bucket { .. } => "path = \"s3://prints/farm\"",
            Files::Share => "path = \"share\"\nshared = true",
        };
        self.place.put(&format!("{name}.toml"), format!("{head}[[folders]]\n{of_folder}\nname = \"farm\"\n").as_bytes());
        let mut member = Member { farm: self, host: self.net.host(), name: name.into(), roles, daemon: None, lives: 0 };
        member.start();
        member
    }

    fn command(&self, name: &str, roles: &str) -> Command {
        let command = self.place.command();
        let mut command = match &self.files {
            Files::Bucket { bucket, way, .. } => at(command, &way.as_ref().map_or(bucket.address(), |way| way.address)),
            Files::Share => command,
        };
        command.args(["watch", "--config", &format!("{name}.toml"), "--role", roles]);
        command
    }

    /// Drops files into the farm's folder, and into a folder of one machine.
    pub(crate) fn drop_files(&self, numbers: std::ops::Range<u64>) {
        for n in numbers {
            let bytes = holes(n);
            match &self.files {
                Files::Bucket { bucket, .. } => drop(bucket.ask("PUT", &format!("/prints/farm/in/{n}.stl"), &bytes)),
                Files::Share => drop(self.place.put(&format!("share/in/{n}.stl"), &bytes)),
            }
            self.place.put(&format!("own/in/{n}.stl"), &bytes);
        }
    }

    /// What the store says, asked by no daemon.
    pub(crate) fn jobs(&self) -> Vec<Value> {
        let url = format!("postgres://owner@localhost/postgres?host={}", self.server.folder().display());
        let listed = self.place.suture(["jobs", "list", "--json", "--store", &url]).expect(0).stdout();
        listed.lines().map(|line| serde_json::from_str(line).expect("a line of JSON")).collect()
    }

    /// Waits until so many jobs have their ends; fails when nothing ends for five minutes.
    pub(crate) fn wait_for(&self, count: u64, members: &mut [Member]) {
        let (mut most, mut since) = (0, Instant::now());
        loop {
            members.iter_mut().for_each(Member::tend);
            let (ended, open): (Vec<_>, Vec<_>) = self.jobs().into_iter().partition(is_over);
            if ended.len() as u64 >= count {
                return;
            }
            if ended.len() > most {
                (most, since) = (ended.len(), Instant::now());
            }
            let some = open.iter().take(3).collect::<Vec<_>>();
            assert!(since.elapsed() < Duration::from_secs(300), "{most} of {count} ended, and no more do: {some:#?}");
            std::thread::sleep(Duration::from_secs(1));
        }
    }

    /// Each drop has one result, in the place and of the bytes that one machine makes; it is of the claim that the store names, and of no other.
    pub(crate) fn assert_as_of_one_machine(&self, count: u64) {
        self.place.suture(["watch", "own", "--once", "--settle", "30ms"]);
        let all = self.jobs();
        let path = |job: &Value| job["source"]["path"].as_str().unwrap_or_default().to_owned();
        let jobs: BTreeMap<String, &Value> = all.iter().map(|job| (path(job), job)).collect();
        let is_doubled = |job: &&Value| jobs[&path(job)]["id"] != job["id"];
        assert!(all.len() as u64 == count, "{} jobs; there are two of these: {:#?}", all.len(), all.iter().find(is_doubled));
        let wanted: BTreeSet<String> = self.place.names("own").into_iter().collect();
        let there = self.names();
        let (more, less): (Vec<_>, Vec<_>) = (there.difference(&wanted).collect(), wanted.difference(&there).collect());
        assert!(more.is_empty() && less.is_empty(), "too many: {more:?}; missing: {less:?}");
        for name in wanted {
            let drop = name.split_once('/').map_or("", |(_, name)| name);
            let drop = drop.split_once(".stl").map_or(drop, |(stem, _)| stem).trim_end_matches(".best");
            let bytes = self.content(&name, jobs[&format!("{drop}.stl")]);
            if name.ends_with(".json") {
                assert!(serde_json::from_slice::<Value>(&bytes).is_ok(), "{name} is not whole");
            } else {
                assert!(bytes == self.place.read(&format!("own/{name}")), "{name} has other bytes");
            }
        }
    }

    /// The files of the farm's folder, but for those of its daemons.
    fn names(&self) -> BTreeSet<String> {
        match &self.files {
            Files::Bucket { bucket, .. } => {
                // Notes of attempts that came to nothing stay for a day, as does what a daemon tried the bucket with.
                let of_its_own = |key: &str| key.starts_with(".suture/probe-") || key.starts_with(".suture/attempts/");
                let keys = bucket.keys().into_iter().filter_map(|key| key.strip_prefix("farm/").map(str::to_owned));
                keys.filter(|key| !of_its_own(key)).collect()
            }
            Files::Share => {
                let work = || self.place.names("share/.suture/work");
                wait_until("nothing is left of attempts", || work().is_empty());
                self.place.names("share").into_iter().collect()
            }
        }
    }

    /// A file of the farm's folder, which the claim has put there that the store names.
    fn content(&self, name: &str, job: &Value) -> Vec<u8> {
        match &self.files {
            Files::Bucket { bucket, .. } => {
                let (head, bytes) = bucket.answer("GET", &format!("/prints/farm/{name}"), b"");
                let drop_key = job["source"]["ino"].as_u64().unwrap_or(0);
                let owner = format!("{}-{}-{drop_key:x}", job["id"], job["work"]);
                let told = head.lines().find_map(|line| line.strip_prefix("x-amz-meta-suture: ")).unwrap_or_default();
                assert_eq!(told, owner, "{name} is of another claim: {head}");
                bytes
            }
            Files::Share => {
                let bytes = self.place.read(&format!("share/{name}"));
                if name.ends_with(".suture.json") {
                    let receipt: Value = serde_json::from_slice(&bytes).expect("a receipt");
                    assert_eq!([&receipt["job"], &receipt["work"]], [&job["id"], &job["work"]], "{name} is of another claim");
                }
                bytes
            }
        }
    }
}

impl Files {
    fn new(kind: Kind, net: &Net) -> Option<Self> {
        let mood = match kind {
            Kind::Share => return Some(Self::Share),
            Kind::Bucket => None,
            Kind::BucketBehind(mood) => Some(mood),
        };
        let host = net.host();
        let address = host.address.to_string();
        let bucket = host.inside(|| Store::start_at(&address))?;
        let way = mood.map(|mood| host.inside(|| Proxy::start(&address, bucket.address(), mood, 25)));
        Some(Self::Bucket { bucket, way, _host: host })
    }

    /// The way to the object store, if that fails.
    pub(crate) fn way(&self) -> Option<&Proxy> {
        match self {
            Self::Bucket { way, .. } => way.as_ref(),
            Self::Share => None,
        }
    }
}

pub(crate) fn is_over(job: &Value) -> bool {
    matches!(job["kind"].as_str(), Some("done" | "needs_review" | "failed" | "quarantined"))
}

impl Member<'_> {
    /// Its daemon begins, in a life of its own.
    pub(crate) fn start(&mut self) {
        self.lives += 1;
        let (farm, log) = (self.farm, self.log(self.lives));
        let command = farm.command(&self.name, self.roles);
        self.daemon = Some(self.host.inside(|| Served::begin(&farm.place, command, &log)));
    }

    /// Its daemon is killed.
    pub(crate) fn kill(&mut self) {
        self.daemon = None;
    }

    /// A daemon that ended to be started again is; any other end fails.
    pub(crate) fn tend(&mut self) {
        if let Some(status) = self.daemon.as_mut().and_then(Served::end) {
            assert_eq!(status.code(), Some(75), "{}: {status}\n{}", self.name, self.said());
            self.start();
        }
    }

    /// Its daemon gets a signal.
    pub(crate) fn signal(&self, signal: rustix::process::Signal) {
        if let Some(daemon) = &self.daemon {
            daemon.signal(signal);
        }
    }

    fn log(&self, life: u32) -> String {
        format!("{}.{life}.log", self.name)
    }

    /// All that its daemons have said.
    pub(crate) fn said(&self) -> String {
        let logs = (1..=self.lives).map(|life| std::fs::read(self.farm.place.at(&self.log(life))).unwrap_or_default());
        logs.map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).collect()
    }
}
