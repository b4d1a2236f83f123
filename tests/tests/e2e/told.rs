//! Others hear of the ends of jobs: webhooks, and the command of `[on_done]`.

use std::collections::BTreeSet;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use rustix::process::Signal;
use suture_bench::generate::Case;
use suture_tests::Place;
use suture_tests::hot::{holes, mesh};
use suture_tests::http::Client;
use suture_tests::receiver::{Port, Receiver};
use suture_tests::served::{Served, jobs, wait_until};

const SECRET: &str = "0123456789abcdef0123456789abcdef";
const NO_MESH: &[u8] = b"\x89PNG\r\n\x1a\nendsolid";

/// Writes a configuration for the folder `hot`, with these lines at its end.
fn configure(place: &Place, lines: &str) {
    let text = format!("settle = \"30ms\"\n[api]\nlisten = \"127.0.0.1:0\"\n[[folders]]\npath = \"hot\"\n{lines}");
    place.put("suture.toml", text.as_bytes());
}

fn hook(address: &str) -> String {
    format!("[[webhook]]\nname = \"farm\"\nurl = \"http://{address}/suture?x\"\n")
}

fn start<'a>(place: &'a Place, log: &str) -> Served<'a> {
    Served::start(place, &["--config", "suture.toml"], log)
}

fn all_rest(place: &Place, count: usize) {
    let is_at_rest = |job: &serde_json::Value| ["done", "failed", "needs_review"].iter().any(|kind| job["kind"] == *kind);
    wait_until("the jobs end", || {
        let jobs = jobs(place, "hot");
        jobs.len() == count && jobs.iter().all(is_at_rest)
    });
}

#[test]
fn messages_come_signed_and_once_each() {
    let place = Place::new();
    let receiver = Receiver::start();
    place.put("secret", format!("{SECRET}\n").as_bytes());
    configure(&place, &(hook(&receiver.address) + "secret_file = \"secret\"\n"));
    let daemon = start(&place, "log");
    place.put("hot/in/part.stl", &holes(1));
    place.put("hot/in/order/picture.stl", NO_MESH);
    wait_until("both come", || receiver.came().len() == 2);
    let came = receiver.came();
    let of = |event: &str| came.iter().find(|message| message.json()["event"] == event).unwrap_or_else(|| panic!("{event}"));
    let (finished, failed) = (of("finished"), of("failed"));
    for message in &came {
        assert_eq!((message.path.as_str(), message.header("host")), ("/suture?x", receiver.address.as_str()));
        assert_eq!(message.json()["id"], message.header("suture-delivery"));
        let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap().as_secs();
        assert!(message.signed(SECRET).is_some_and(|time| now.abs_diff(time) < 60), "{message:?}");
        assert_eq!(message.signed("another"), None);
        let mut changed = message.clone();
        changed.body.push(b' ');
        assert_eq!(changed.signed(SECRET), None);
    }
    let client = Client::of(&daemon);
    let told = finished.json();
    assert_eq!(told["job"], client.get(&format!("/v1/jobs/{}", told["job"]["id"])).json(), "as the interface has it");
    assert_eq!((&told["certificate"]["printable"], &told["job"]["ending"]), (&true.into(), &"repaired".into()));
    assert_eq!(told["certificate"]["blake3"], told["job"]["result"]["blake3"]);
    for (path, name) in [("output", "out/part.stl"), ("report", "out/part.stl.report.json"), ("original", "done/part.stl")] {
        let full = place.at("hot").canonicalize().unwrap().join(name);
        assert!(full.is_file() && std::path::Path::new(told["paths"][path].as_str().unwrap()).canonicalize().unwrap() == full);
    }
    let told = failed.json();
    assert_eq!((&told["job"]["file"], told.get("certificate")), (&"order/picture.stl".into(), None));
    assert!(told["job"]["reason"].as_str().is_some_and(|reason| !reason.is_empty()));
    let metrics = String::from_utf8(client.get("/metrics").body).unwrap();
    for line in
        ["suture_webhook_pending{target=\"farm\"} 0", "suture_webhook_deliveries_total{target=\"farm\",result=\"delivered\"} 2"]
    {
        assert!(metrics.lines().any(|there| there == line), "{line}");
    }
    // Nothing of it comes again, not with another life either.
    daemon.signal(Signal::TERM);
    assert!(daemon.ended().success());
    let _daemon = start(&place, "again");
    place.put("hot/in/other.stl", &holes(2));
    wait_until("the next comes", || receiver.came().len() == 3);
    assert_eq!(receiver.came()[2].json()["job"]["file"], "other.stl");
}

/// The receiver is away, the daemon is killed over it, a record is forgotten: what happened is told when the receiver is back.
#[test]
fn f30_a_dead_receiver_slows_no_job_and_hears_all_when_it_is_back() {
    let place = Place::new();
    let port = Port::new();
    let address = port.address.to_string();
    configure(&place, &(hook(&address) + "events = [\"finished\"]\n"));
    let daemon = start(&place, "log");
    for n in 0..5 {
        place.put(&format!("hot/in/part{n}.stl"), &holes(n));
    }
    place.put("hot/in/picture.stl", NO_MESH);
    all_rest(&place, 6);
    let client = Client::of(&daemon);
    wait_until("it is said", || client.get("/v1/status").json()["untold"].to_string().contains("`farm` has not heard of "));
    let listed = place.suture(["jobs", "list", "--dir", "hot"]).expect(0).stdout();
    assert!(listed.contains("not told yet: the webhook `farm` has not heard of ") && listed.contains("refused"), "{listed}");
    let metrics = String::from_utf8(client.get("/metrics").body).unwrap();
    assert!(!metrics.contains("suture_webhook_pending{target=\"farm\"} 0"), "{metrics}");
    let done: Vec<_> = jobs(&place, "hot").iter().filter(|job| job["kind"] == "done").map(|job| job["id"].to_string()).collect();
    let Some(first) = done.first().filter(|_| done.len() > 2) else { panic!("{done:?}") };
    client.send("DELETE", &format!("/v1/jobs/{first}"), &[], b"").expect(204);
    daemon.signal(Signal::KILL);
    drop(daemon);
    let receiver = Receiver::at(&address, &[]);
    let daemon = start(&place, "again");
    let files = || receiver.came().iter().map(|message| message.json()["job"]["file"].to_string()).collect::<BTreeSet<_>>();
    wait_until("all come", || files().len() == done.len());
    let ids: BTreeSet<_> = receiver.came().iter().map(|message| message.header("suture-delivery").to_owned()).collect();
    assert_eq!((ids.len(), receiver.came().len()), (done.len(), done.len()), "each once, and nothing that was not asked for");
    let client = Client::of(&daemon);
    wait_until("nothing is left", || client.get("/v1/status").json()["untold"] == serde_json::json!([]));
}

/// It takes the message, and says nothing: jobs go on, and so does the daemon's end.
#[test]
fn f30_a_slow_receiver_holds_no_one_up() {
    let place = Place::new();
    let receiver = Receiver::at("127.0.0.1:0", &["", ""]);
    configure(&place, &hook(&receiver.address));
    let daemon = start(&place, "log");
    place.put("hot/in/first.stl", &holes(1));
    wait_until("it is told", || receiver.came().len() == 1);
    place.put("hot/in/second.stl", &holes(2));
    all_rest(&place, 2);
    let asked = Instant::now();
    daemon.signal(Signal::TERM);
    assert!(daemon.ended().success() && asked.elapsed() < Duration::from_secs(5), "{:?}", asked.elapsed());
    // What was not answered is told once more, to be the same message.
    let _daemon = start(&place, "again");
    wait_until("all are told", || receiver.came().len() >= 3);
    let came = receiver.came();
    assert_eq!(came[0].header("suture-delivery"), came[1].header("suture-delivery"));
    assert_eq!(came[0].body, came[1].body);
}

#[test]
fn f30_redirects_are_not_followed_and_who_is_busy_is_asked_later() {
    let place = Place::new();
    let elsewhere = Receiver::start();
    let redirect = format!("HTTP/1.1 307 Go\r\nLocation: http://{}/\r\n", elsewhere.address);
    let receiver = Receiver::at("127.0.0.1:0", &[&redirect, "HTTP/1.1 503 Busy\r\nRetry-After: 4\r\n"]);
    configure(&place, &hook(&receiver.address));
    let daemon = start(&place, "log");
    place.put("hot/in/part.stl", &holes(1));
    wait_until("it is asked twice", || receiver.came().len() == 2);
    let asked = Instant::now();
    wait_until("it is told", || receiver.came().len() == 3);
    assert!(asked.elapsed() > Duration::from_secs(3), "{:?}", asked.elapsed());
    wait_until("it is noted", || daemon.lines("An event was told.").len() == 1);
    assert!(elsewhere.came().is_empty());
    let ids: BTreeSet<_> = receiver.came().iter().map(|message| message.header("suture-delivery").to_owned()).collect();
    assert_eq!(ids.len(), 1);
}

/// SIGHUP brings another receiver, which hears of what happens from then on.
#[test]
fn another_receiver_needs_no_restart() {
    let place = Place::new();
    let (one, two) = (Receiver::start(), Receiver::start());
    configure(&place, &hook(&one.address));
    let daemon = start(&place, "log");
    place.put("hot/in/first.stl", &holes(1));
    wait_until("it is told", || one.came().len() == 1);
    configure(&place, &hook(&two.address).replace("farm", "shop"));
    daemon.signal(Signal::HUP);
    wait_until("it is read", || !daemon.lines("The configuration was read anew and is in force.").is_empty());
    place.put("hot/in/second.stl", &holes(2));
    wait_until("the other is told", || two.came().len() == 1);
    assert_eq!((one.came().len(), two.came()[0].json()["job"]["file"].as_str()), (1, Some("second.stl")));
}

#[test]
fn a_command_is_run_of_what_is_certified_and_of_all_on_request() {
    let place = Place::new();
    let run = |when: &str, log: &str| {
        let script = format!("echo \\\"$1|$2|$SUTURE_EVENT|$NOTIFY_SOCKET\\\" >> {log}; cp \\\"$2\\\" sliced.gcode; echo sliced");
        let command = format!("[\"/bin/sh\", \"-c\", \"{script}\", \"sh\", \"{{job}}\", \"{{output}}\"]");
        configure(&place, &format!("[on_done]\ncommand = {command}\nwhen = \"{when}\"\n"));
        let mut command = place.command();
        // The socket is the daemon's alone.
        command.args(["watch", "--once", "--config", "suture.toml"]).env("NOTIFY_SOCKET", place.at("nowhere"));
        let ran = command.output().unwrap();
        assert_eq!(ran.status.code(), Some(1), "a file is no mesh");
        String::from_utf8(ran.stderr).unwrap()
    };
    place.put("hot/in/part.stl", &holes(1));
    place.put("hot/in/picture.stl", NO_MESH);
    let said = run("certified", "first");
    let output = place.at("hot/out/part.stl");
    let lines = |log: &str| String::from_utf8(place.read(log)).unwrap().lines().map(str::to_owned).collect::<Vec<_>>();
    let [line] = lines("first").try_into().unwrap();
    assert!(line.ends_with("|finished|"), "{line}");
    let named = std::path::PathBuf::from(line.split('|').nth(1).unwrap());
    assert!(named.is_absolute() && named.canonicalize().unwrap() == output.canonicalize().unwrap(), "{line}");
    assert_eq!(place.read("sliced.gcode"), place.read("hot/out/part.stl"));
    assert!(said.contains("\"note\":\"sliced\"") && said.contains("it is not run: it has no good result"), "{said}");
    place.put("hot/in/again.stl", NO_MESH);
    run("always", "second");
    let [line] = lines("second").try_into().unwrap();
    assert!(line.contains("||failed|"), "{line}");
    assert_eq!(lines("first").len(), 1);
}

/// It has the time of `drain`; then it is ended, and run again by the next daemon. What had no turn yet is not begun.
#[test]
fn f27_a_command_is_waited_for_as_long_as_jobs_are() {
    let place = Place::new();
    let configured = |drain: &str, script: &str| {
        let command = format!("[\"/bin/sh\", \"-c\", \"{script}\"]");
        let text =
            format!("settle = \"30ms\"\ndrain = \"{drain}\"\n[[folders]]\npath = \"hot\"\n[on_done]\ncommand = {command}\n");
        place.put("suture.toml", text.as_bytes());
    };
    let has = |name: &str| std::fs::exists(place.at(name)).unwrap();
    configured("1m", "touch begun; until [ -e go ]; do sleep 0.1; done; echo {file} >> ended");
    let daemon = start(&place, "log");
    place.put("hot/in/part.stl", &holes(1));
    wait_until("it runs", || has("begun"));
    place.put("hot/in/second.stl", &holes(1));
    all_rest(&place, 2);
    daemon.signal(Signal::TERM);
    wait_until("it ends", || !daemon.lines("Stopping: running jobs").is_empty());
    place.put("go", b"");
    assert!(daemon.ended().success());
    assert_eq!(place.read("ended"), b"part.stl\n");
    configured("1ms", "echo {file} >> begun_again; sleep 1000");
    let daemon = start(&place, "again");
    wait_until("the next is run", || has("begun_again"));
    let asked = Instant::now();
    daemon.signal(Signal::TERM);
    assert!(daemon.ended().success() && asked.elapsed() < Duration::from_secs(10), "{:?}", asked.elapsed());
    configured("1m", "echo {file} >> last");
    place.suture(["watch", "--once", "--config", "suture.toml"]).expect(0);
    assert_eq!((place.read("begun_again"), place.read("last")), (b"second.stl\n".to_vec(), b"second.stl\n".to_vec()));
}

/// A result whose rules were not all looked at has no certificate that holds.
#[test]
fn a_command_is_not_run_of_what_was_left_unchecked() {
    let place = Place::new();
    configure(&place, "[on_done]\ncommand = [\"/bin/sh\", \"-c\", \"echo {file} >> ran\"]\n");
    place.put("hot/in/fast/unchecked.stl", &mesh(Case::Clean, 1));
    place.put("hot/in/checked.stl", &holes(2));
    place.suture(["watch", "--once", "--config", "suture.toml"]).expect(0);
    assert_eq!(place.read("ran"), b"checked.stl\n");
}

/// Blocks of that language in the recipes.
fn recipes(language: &str) -> Vec<String> {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/RECIPES.md");
    let text = std::fs::read_to_string(path).unwrap();
    let blocks = text.split("```").skip(1).step_by(2);
    let blocks: Vec<_> = blocks.filter_map(|block| Some(block.strip_prefix(language)?.trim_start().to_owned())).collect();
    assert!(!blocks.is_empty(), "{language}");
    blocks
}

#[test]
fn each_recipe_is_a_configuration() {
    let place = Place::new();
    for block in recipes("toml") {
        let head = if block.starts_with('[') { "" } else { "[on_done]\n" };
        place.put("suture.toml", format!("[[folders]]\npath = \"hot\"\n{head}{block}").as_bytes());
        place.suture(["config", "check", "suture.toml"]).expect(0);
    }
}

/// The receiver of the recipes, as it stands there but for the places of this test. Where there is no Python, there is nothing to be tried.
#[test]
fn the_receiver_of_the_recipes_takes_what_is_signed_and_nothing_else() {
    if std::process::Command::new("python3").arg("--version").output().is_err() {
        eprintln!("no python3 here");
        return;
    }
    let place = Place::new();
    let held = Port::new();
    let port = held.address.port().to_string();
    let [program] = recipes("python").try_into().unwrap();
    assert!(program.contains("9000") && program.contains("/etc/suture/webhook-secret"), "{program}");
    place.put("receiver.py", program.replace("9000", &port).replace("/etc/suture/webhook-secret", "secret").as_bytes());
    place.put("secret", SECRET.as_bytes());
    place.put("other", SECRET.replace('0', "1").as_bytes());
    let mut command = std::process::Command::new("python3");
    command.arg("receiver.py").current_dir(place.at("")).stdout(std::fs::File::create(place.at("said")).unwrap());
    let mut receiver = command.stderr(std::fs::File::create(place.at("asked")).unwrap()).spawn().unwrap();
    wait_until("it listens", || std::net::TcpStream::connect(format!("127.0.0.1:{port}")).is_ok());
    let signed = hook(&format!("127.0.0.1:{port}")) + "secret_file = \"secret\"\n";
    configure(&place, &(signed.clone() + &signed.replace("farm", "forger").replace("\"secret\"", "\"other\"")));
    let daemon = start(&place, "log");
    place.put("hot/in/part.stl", &holes(1));
    let text = |name: &str| String::from_utf8_lossy(&place.read(name)).into_owned();
    wait_until("it is told", || !daemon.lines("An event was told.").is_empty());
    wait_until("the forger is refused", || text("asked").contains("\" 401 "));
    let said = text("said");
    receiver.kill().unwrap();
    receiver.wait().unwrap();
    let out = place.at("hot/out/part.stl").canonicalize().unwrap();
    assert!(
        said.starts_with("finished part.stl /") && said.trim().ends_with("hot/out/part.stl") && said.lines().count() == 1,
        "{said}"
    );
    assert!(out.is_file());
    let told = daemon.lines("An event was told.");
    assert!(told.iter().all(|line| line["target_name"] == "farm"), "{told:?}");
}
