//! Jobs in a database that several daemons share: a server of the test's own, killed, started anew, and reached by TLS.

use std::os::unix::net::UnixDatagram;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::time::Duration;

use rustix::process::Signal;
use suture_store::testkit::server::{Server, server};
use suture_tests::Place;
use suture_tests::hot::holes;
use suture_tests::http::Client;
use suture_tests::served::{Served, jobs, wait_until};

/// A program of the server's, or of the client's package beside it.
fn client(server: &Server, name: &str) -> Command {
    let packaged = server.programs().join(name);
    Command::new(if packaged.exists() { packaged } else { name.into() })
}

/// A database of its own on the server.
pub(super) fn database(server: &Server) -> String {
    let (name, folder) = (format!("farm_{}", server.number()), server.folder().display().to_string());
    let mut make = client(server, "createdb");
    make.args(["--host", &folder, "--username", "owner", &name]).env_remove("PGPASSWORD");
    assert!(make.status().expect("createdb starts").success());
    format!("postgres://owner@localhost/{name}?host={folder}")
}

fn drop_files(place: &Place, folder: &str, numbers: std::ops::RangeInclusive<u64>) {
    for n in numbers {
        place.put(&format!("{folder}/in/{n}.stl"), &holes(n));
    }
}

fn kinds(place: &Place, folder: &str) -> Vec<String> {
    jobs(place, folder).iter().filter_map(|job| job["kind"].as_str().map(str::to_owned)).collect()
}

/// Jobs of the database, as someone sees them who asks no daemon: number, folder, kind, attempts.
pub(super) fn shared_jobs(place: &Place, url: &str) -> Vec<(u64, String, String, u64)> {
    let listed = place.suture(["jobs", "list", "--json", "--store", url]).expect(0).stdout();
    let job = |line: &str| {
        let job: serde_json::Value = serde_json::from_str(line).expect("a line of JSON");
        let text = |value: &serde_json::Value| value.as_str().unwrap_or_default().to_owned();
        (
            job["id"].as_u64().unwrap_or(0),
            text(&job["source"]["folder"]),
            text(&job["kind"]),
            job["attempts"].as_u64().unwrap_or(0),
        )
    };
    listed.lines().map(job).collect()
}

pub(super) fn is_over(kind: &str) -> bool {
    matches!(kind, "done" | "needs_review" | "failed")
}

/// Meshes of a part of a folder, with their bytes; reports and receipts tell of times.
fn meshes(place: &Place, part: &str) -> Vec<(String, Vec<u8>)> {
    let names = place.names(part).into_iter().filter(|name| !name.ends_with(".json"));
    names.map(|name| (name.clone(), place.read(&format!("{part}/{name}")))).collect()
}

/// The daemon of a folder on a database, with the web interface; not yet started.
fn watch(place: &Place, folder: &str, url: &str) -> Command {
    let mut command = place.command();
    command.arg("watch").arg(folder).args(["--settle", "30ms", "--listen", "127.0.0.1:0", "--store", url]);
    command
}

fn served<'a>(place: &'a Place, folder: &str, url: &str, log: &str) -> Served<'a> {
    Served::of(place, watch(place, folder, url), log)
}

/// What is made on a shared store is what is made on a machine's own, byte for byte.
#[test]
fn a_folder_on_a_shared_store_gets_the_same_bytes() {
    let Some(server) = server() else { return };
    let (place, url) = (Place::new(), database(server));
    for folder in ["own", "hot"] {
        drop_files(&place, folder, 1..=20);
    }
    let own = place.suture(["watch", "own", "--once", "--settle", "30ms"]).code();
    let shared = place.suture(["watch", "hot", "--once", "--settle", "30ms", "--store", &url]).code();
    assert_eq!(own, shared);
    for part in ["in", "out", "done", "failed", "quarantine"] {
        assert_eq!(meshes(&place, &format!("hot/{part}")), meshes(&place, &format!("own/{part}")), "{part}");
    }
    let jobs = shared_jobs(&place, &url);
    assert!(jobs.iter().map(|job| job.0).eq(1..=20) && jobs.iter().all(|job| job.3 == 1 && is_over(&job.2)), "{jobs:?}");
    // No daemon runs, and the folder itself has no jobs: it says where they are.
    let refused = place.suture(["jobs", "list", "--dir", "hot"]).expect(2).stderr();
    assert!(refused.contains("the jobs are in postgres://owner@localhost/farm_") && refused.contains("add --store"), "{refused}");
    for command in [["store", "verify"], ["store", "export"], ["jobs", "rebuild"]] {
        let refused = place.suture(command.iter().chain(&["--dir", "hot"])).expect(2).stderr();
        assert!(refused.contains("the jobs are in postgres://"), "{refused}");
    }
    assert!(place.suture(["watch", "hot", "--once"]).expect(75).stderr().contains("its jobs are in postgres://"));
    place.suture(["store", "verify", "--store", &url]).expect(0);
    let status = place.suture(["status", "--store", &url]).expect(0).stdout();
    assert!(status.contains("this is what the shared job store says") && status.contains("20"), "{status}");
}

/// Killed and started again while jobs run: nothing is lost or doubled, and whoever asks meanwhile is told.
#[test]
fn the_database_goes_away_in_the_middle_and_it_is_said() {
    let Some(server) = Server::start() else { return };
    let (place, url) = (Place::new(), database(&server));
    let socket = UnixDatagram::bind(place.at("notify")).expect("a socket");
    socket.set_nonblocking(true).expect("it need not wait");
    let mut command = watch(&place, "hot", &url);
    command.env("NOTIFY_SOCKET", place.at("notify")).env("WATCHDOG_USEC", "900000");
    let daemon = Served::of(&place, command, "log");
    let client = Client::of(&daemon);
    drop_files(&place, "hot", 1..=6);
    wait_until("some are done", || kinds(&place, "hot").iter().filter(|kind| is_over(kind)).count() >= 2);
    server.kill();
    drop_files(&place, "hot", 7..=12);
    wait_until("it says that it is not ready", || {
        let answer = client.get("/readyz");
        answer.status == 503 && String::from_utf8_lossy(&answer.body).contains("the job database has not answered since")
    });
    assert_eq!(client.get("/livez").status, 200);
    // The service manager knows why, and that the daemon goes on all the same.
    let mut bytes = [0; 512];
    let mut words = || {
        std::iter::from_fn(|| socket.recv(&mut bytes).ok().map(|n| String::from_utf8_lossy(&bytes[..n]).into_owned()))
            .collect::<Vec<_>>()
    };
    wait_until("the service manager knows", || {
        words().iter().any(|word| word.starts_with("STATUS=the job database has not answered since "))
    });
    wait_until("it goes on", || words().iter().any(|word| word == "WATCHDOG=1"));
    let refused = place.suture(["jobs", "list", "--dir", "hot"]).expect(75).stderr();
    assert!(refused.contains("the job database does not answer") && refused.contains("postgres://owner@localhost"), "{refused}");
    wait_until("the log says so", || !daemon.lines("The job database does not answer").is_empty());
    server.run();
    wait_until("it is ready again", || client.get("/readyz").status == 200);
    wait_until("all are done", || {
        let kinds = kinds(&place, "hot");
        kinds.len() == 12 && kinds.iter().all(|kind| is_over(kind))
    });
    for words in ["The job database does not answer", "The job database answers again"] {
        assert_eq!(daemon.lines(words).len(), 1, "{words}");
    }
    let jobs = shared_jobs(&place, &url);
    assert!(jobs.iter().map(|job| job.0).eq(1..=12) && jobs.iter().all(|job| job.3 == 1), "{jobs:?}");
    assert!(place.names("hot/in").is_empty(), "{:?}", place.names("hot"));
}

/// Each takes files of its own folder and no other; two of one name are not served.
#[test]
fn two_daemons_share_a_database_and_not_a_folder() {
    let Some(server) = server() else { return };
    let (place, url) = (Place::new(), database(server));
    let daemons = [served(&place, "one", &url, "one.log"), served(&place, "two", &url, "two.log")];
    drop_files(&place, "one", 1..=3);
    drop_files(&place, "two", 1..=4);
    for (folder, count) in [("one", 3), ("two", 4)] {
        wait_until("its files are done", || {
            let kinds = kinds(&place, folder);
            kinds.len() == count && kinds.iter().all(|kind| is_over(kind))
        });
        assert!(jobs(&place, folder).iter().all(|job| job["source"]["folder"] == folder));
    }
    let shared = shared_jobs(&place, &url);
    assert!(shared.len() == 7 && shared.iter().map(|job| job.0).eq(1..=7), "numbers have no gaps: {shared:?}");
    let refused = place.suture(["watch", "elsewhere/one", "--store", &url]).expect(73).stderr();
    assert!(
        refused.contains("the folder `one` is served by another daemon already, ") && refused.contains("one/.suture/state"),
        "{refused}"
    );
    // Its end is noted, so that another one may begin at once.
    let [one, two] = daemons;
    one.signal(Signal::TERM);
    assert!(one.ended().success());
    place.suture(["watch", "elsewhere/one", "--once", "--store", &url]).expect(0);
    drop(two);
}

/// The next life of a daemon that was killed takes up what it held, at once.
#[test]
fn a_killed_daemon_goes_on_where_it_was() {
    let Some(server) = server() else { return };
    let (place, url) = (Place::new(), database(server));
    let daemon = served(&place, "hot", &url, "first.log");
    drop_files(&place, "hot", 1..=10);
    wait_until("some are done", || kinds(&place, "hot").iter().filter(|kind| is_over(kind)).count() >= 2);
    // Not the daemon's end: a kill.
    drop(daemon);
    let _daemon = served(&place, "hot", &url, "second.log");
    wait_until("all are done", || {
        let kinds = kinds(&place, "hot");
        kinds.len() == 10 && kinds.iter().all(|kind| is_over(kind))
    });
    let jobs = shared_jobs(&place, &url);
    assert!(jobs.len() == 10 && jobs.iter().all(|job| job.3 <= 2), "{jobs:?}");
    assert!(place.names("hot/in").is_empty(), "{:?}", place.names("hot"));
}

/// A farm moves in: the daemon goes on with the same numbers, and with what waited. And out again.
#[test]
fn a_store_moves_into_the_database_and_out_of_it() {
    let Some(server) = server() else { return };
    let (place, url) = (Place::new(), database(server));
    drop_files(&place, "hot", 1..=2);
    place.suture(["watch", "hot", "--once", "--settle", "30ms"]);
    let before = place.suture(["jobs", "list", "--dir", "hot"]).expect(0).stdout();
    place.suture(["store", "export", "--complete", "--dir", "hot", "-o", "moved.jsonl"]).expect(0);
    let taken = place.suture(["store", "import", "moved.jsonl", "--dir", "hot", "--store", &url]).expect(0).stdout();
    assert!(taken.contains("2 jobs were taken over; `suture watch --store postgres://owner@localhost/"), "{taken}");
    place.suture(["store", "verify", "--store", &url, "--against", "moved.jsonl"]).expect(0);
    let again = place.suture(["store", "import", "moved.jsonl", "--dir", "hot", "--store", &url]).expect(75).stderr();
    assert!(again.contains("begin with an empty one"), "{again}");
    assert_eq!(place.suture(["jobs", "list", "--store", &url]).expect(0).stdout(), before);
    place.put("hot/in/more.stl", &holes(1));
    place.suture(["watch", "hot", "--once", "--settle", "30ms", "--store", &url]);
    let jobs = shared_jobs(&place, &url);
    assert!(jobs.iter().map(|job| job.0).eq(1..=3) && jobs.iter().all(|job| is_over(&job.2)), "{jobs:?}");
    place.suture(["store", "verify", "--store", &url, "--against", "moved.jsonl"]).expect(1);
    place.suture(["store", "export", "--complete", "--store", &url, "-o", "back.jsonl"]).expect(0);
    std::fs::remove_dir_all(place.at("hot/.suture/state")).expect("the old store goes");
    place.suture(["store", "import", "back.jsonl", "--dir", "hot"]).expect(0);
    assert_eq!(jobs_numbers(&place), [1, 2, 3]);
    place.suture(["watch", "hot", "--once", "--settle", "30ms"]);
    assert_eq!(jobs_numbers(&place), [1, 2, 3], "nothing is done again");
}

fn jobs_numbers(place: &Place) -> Vec<u64> {
    jobs(place, "hot").iter().filter_map(|job| job["id"].as_u64()).collect()
}

/// The owner makes the schema, and a role with few rights is all that a daemon needs.
#[test]
fn a_role_with_few_rights_serves_a_folder() {
    let Some(server) = server() else { return };
    let (place, url) = (Place::new(), database(server));
    let weak = format!("weak_{}", server.number());
    let weak_url = url.replace("owner@", &format!("{weak}@"));
    let refused = place.suture(["watch", "hot", "--once", "--store", &weak_url]).expect(75).stderr();
    assert!(refused.contains(&weak), "{refused}");
    place.suture(["store", "create", "--store", &url]).expect(0);
    let sql = place.suture(["store", "role", &weak]).expect(0).stdout();
    let mut psql = client(server, "psql");
    psql.args([&url, "--quiet", "--set", "ON_ERROR_STOP=1", "--file", "-"]).stdin(Stdio::piped());
    let mut psql = psql.spawn().expect("psql starts");
    std::io::Write::write_all(&mut psql.stdin.take().expect("a pipe"), sql.as_bytes()).expect("it reads");
    assert!(psql.wait().expect("psql ends").success());
    drop_files(&place, "hot", 1..=1);
    place.suture(["watch", "hot", "--once", "--settle", "30ms", "--store", &weak_url]);
    assert!(shared_jobs(&place, &weak_url).iter().all(|job| is_over(&job.2)));
}

/// A password stands in the configuration, and nowhere else.
#[test]
fn a_password_is_shown_nowhere() {
    let place = Place::new();
    place.put("s.toml", b"store = \"postgres://farm:geheim@db/jobs\"\n[[folders]]\npath = \"hot\"\n");
    let shown = place.suture(["config", "print", "s.toml"]).expect(0).stdout();
    assert!(shown.contains("store = \"postgres://farm@db/jobs\"") && !shown.contains("geheim"), "{shown}");
    place.put("wrong.toml", b"store = \"pg://farm:geheim@db/jobs\"\n[[folders]]\npath = \"hot\"\n");
    let refused = place.suture(["config", "check", "wrong.toml"]).expect(2).stderr();
    assert!(refused.contains("is no address of a database") && !refused.contains("geheim"), "{refused}");
}

/// A certificate for `localhost`, by an authority of the test's own: certificate, key, and the authority's certificate.
fn certificate(place: &Place) -> [PathBuf; 3] {
    let files = ["server.crt", "server.key", "ca.crt"].map(|name| place.at(name));
    place.put("ext", b"subjectAltName=DNS:localhost,IP:127.0.0.1\n");
    let curve = "-newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes";
    for words in [
        format!("req -x509 {curve} -keyout ca.key -out ca.crt -days 2 -subj /CN=suture-test"),
        format!("req {curve} -keyout server.key -out server.csr -subj /CN=localhost"),
        "x509 -req -in server.csr -CA ca.crt -CAkey ca.key -CAcreateserial -out server.crt -days 2 -extfile ext".into(),
    ] {
        let made = Command::new("openssl").args(words.split(' ')).current_dir(place.at("")).stderr(Stdio::null()).status();
        assert!(made.expect("openssl starts").success(), "openssl {words}");
    }
    files
}

/// With the root that signed it the server is trusted; without it, it is refused at once, with what is wrong.
#[test]
fn tls_is_checked() {
    let Some(server) = Server::start() else { return };
    let place = Place::new();
    let [certificate, key, root] = certificate(&place);
    let port = std::net::TcpListener::bind("127.0.0.1:0").and_then(|socket| socket.local_addr()).expect("a port").port();
    for (from, name) in [(&certificate, "server.crt"), (&key, "server.key")] {
        std::fs::copy(from, server.folder().join(name)).expect("it can be copied");
        server.give(&server.folder().join(name));
    }
    let folder = server.folder().display();
    server.run_with(&format!(
        "-c listen_addresses=127.0.0.1 -p {port} -c ssl=on -c ssl_cert_file={folder}/server.crt -c ssl_key_file={folder}/server.key"
    ));
    let url = format!("postgres://owner@localhost:{port}/postgres?sslmode=verify-full");
    drop_files(&place, "hot", 1..=1);
    let refused = place.suture(["watch", "hot", "--once", "--store", &url]).expect(75).stderr();
    assert!(refused.contains("certificate") && refused.contains("sslrootcert"), "{refused}");
    let trusted = format!("{url}&sslrootcert={}", root.display());
    place.suture(["watch", "hot", "--once", "--settle", "30ms", "--store", &trusted]);
    assert!(shared_jobs(&place, &trusted).iter().all(|job| is_over(&job.2)) && place.names("hot/in").is_empty());
}

/// A job that another one brings is begun at once, not when it is next looked for.
#[test]
fn a_retry_beside_the_daemon_wakes_it() {
    let Some(server) = server() else { return };
    let (place, url) = (Place::new(), database(server));
    let daemon = served(&place, "hot", &url, "log");
    place.put("hot/in/broken.stl", b"solid nothing");
    wait_until("it has failed", || kinds(&place, "hot") == ["failed"]);
    // Quiet for long enough that every slot waits.
    std::thread::sleep(Duration::from_secs(2));
    let began = std::time::Instant::now();
    place.suture(["jobs", "retry", "1", "--store", &url]).expect(0);
    wait_until("it is tried again", || jobs(&place, "hot").first().is_some_and(|job| job["attempts"] == 2));
    eprintln!("from a retry by another process to its end: {:?}", began.elapsed());
    drop(daemon);
}
