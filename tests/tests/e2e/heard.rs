//! A daemon tells of its work: events as they happen, metrics, and the document of its interface.

use std::io::{BufRead, BufReader, Write};

use rustix::process::{Signal, kill_process};
use suture_bench::generate::Case;
use suture_tests::Place;
use suture_tests::hot::holes;
use suture_tests::http::Client;
use suture_tests::openapi::document;
use suture_tests::served::{Served, wait_until, worker_of};

const LISTENING: [&str; 5] = ["hot", "--settle", "30ms", "--listen", "127.0.0.1:0"];

/// Reads events until one's lines hold `words`; all that came.
fn listen(client: &Client, last: Option<&str>, words: &str) -> Vec<String> {
    let mut stream = client.connect();
    let last = last.map(|id| format!("Last-Event-ID: {id}\r\n")).unwrap_or_default();
    let head = format!("GET /v1/events HTTP/1.1\r\nHost: {}\r\n{last}\r\n", client.address);
    stream.write_all(head.as_bytes()).unwrap();
    let (mut events, mut event) = (Vec::new(), String::new());
    for line in BufReader::new(stream).lines().map(|line| line.expect("the stream goes on")) {
        if line.is_empty() {
            events.push(std::mem::take(&mut event));
            if events.last().is_some_and(|event| event.contains(words)) {
                return events;
            }
        } else {
            event += &format!("{line}\n");
        }
    }
    panic!("it ended before {words}: {events:?}");
}

fn id(event: &str) -> &str {
    event.lines().find_map(|line| line.strip_prefix("id: ")).expect("an id")
}

#[test]
fn events_are_told_as_they_happen_and_again_to_who_comes_back() {
    let place = Place::new();
    let daemon = Served::start(&place, &LISTENING, "log");
    let client = Client::of(&daemon);
    let heard = std::thread::scope(|scope| {
        let listening = scope.spawn(|| listen(&client, None, "\"state\":\"done\""));
        std::thread::sleep(std::time::Duration::from_millis(300));
        place.put("hot/in/part.stl", &holes(1));
        listening.join().expect("it listens")
    });
    for state in ["queued", "running", "publishing", "published", "done"] {
        assert!(heard.iter().any(|event| event.contains(&format!("\"state\":\"{state}\""))), "{state}: {heard:?}");
    }
    let first = heard.iter().find(|event| event.contains("\"state\":\"queued\"")).expect("it came");
    assert!(first.contains("event: job") && first.contains("\"file\":\"part.stl\""), "{first}");
    let again = listen(&client, Some(id(first)), "\"state\":\"done\"");
    assert!(
        again.iter().all(|event| !event.contains("queued")) && again.iter().any(|event| event.contains("running")),
        "{again:?}"
    );
    let lost = listen(&client, Some("17-4"), "event: lost");
    assert!(lost.len() <= 4, "{lost:?}");
}

#[test]
fn metrics_and_the_log_agree() {
    let place = Place::new();
    let daemon = Served::start(&place, &LISTENING, "log");
    let client = Client::of(&daemon);
    (1..=3).for_each(|i| drop(place.put(&format!("hot/in/{i}.stl"), &holes(i))));
    place.put("hot/in/same.stl", &holes(1));
    place.put("hot/in/picture.stl", b"\x89PNG\r\n\x1a\nendsolid");
    wait_until("all are done", || daemon.lines("Done.").len() == 4 && daemon.lines("Ended without").len() == 1);
    let text = String::from_utf8(client.get("/metrics").expect(200).body).unwrap();
    let value = |wanted: &str| {
        let line = text.lines().find_map(|line| line.strip_prefix(wanted)?.strip_prefix(' '));
        line.unwrap_or_else(|| panic!("{wanted}: {text}")).parse::<f64>().unwrap()
    };
    let finished = |result: &str| {
        let labels = format!("{{folder=\"hot\",profile=\"default\",result=\"{result}\"}}");
        text.lines()
            .find_map(|line| line.strip_prefix("suture_jobs_finished_total")?.strip_prefix(&labels))
            .map_or(0.0, |n| n.trim().parse().unwrap())
    };
    let reused = daemon.lines("Done.").iter().filter(|line| line["reused"].is_number()).count() as f64;
    assert_eq!((finished("repaired") + finished("reused"), finished("reused"), finished("failed")), (4.0, reused, 1.0));
    assert_eq!(value("suture_job_failures_total{reason=\"parse\"}"), 1.0);
    assert_eq!((value("suture_jobs{state=\"done\"}"), value("suture_folder_up{folder=\"hot\"}")), (4.0, 1.0));
    assert_eq!(value("suture_job_attempts_total"), value("suture_job_duration_seconds_count{stage=\"queue\"}"));
    assert!(
        value("suture_defects_found_total{kind=\"boundary_loop\"}") >= 3.0
            && value("suture_defects_left_total{kind=\"boundary_loop\"}") == 0.0
    );
    for name in [
        "process_resident_memory_bytes",
        "process_cpu_seconds_total",
        "suture_store_size_bytes",
        "suture_disk_free_bytes{role=\"state\"}",
        "suture_disk_free_bytes{role=\"results\",folder=\"hot\"}",
    ] {
        assert!(value(name) > 0.0, "{name}");
    }
    assert!(!text.contains(".stl"), "no file's name");
}

/// The store comes back from half a snapshot, from its loss, from a kill in the midst of work, and by hand; a start after a good end counts nothing.
#[test]
fn f04_recoveries_of_the_store_are_counted() {
    let place = Place::new();
    let recoveries = |daemon: &Served| {
        let text = String::from_utf8(Client::of(daemon).get("/metrics").expect(200).body).unwrap();
        let value = |kind: &str| -> u64 {
            let name = format!("suture_store_recoveries_total{{kind=\"{kind}\"}} ");
            text.lines().find_map(|line| line.strip_prefix(&name)?.parse().ok()).unwrap_or_else(|| panic!("{kind}: {text}"))
        };
        ["torn_snapshot", "damage", "receipts", "unfinished", "rebuilt"].map(value)
    };
    let serve = || Served::start(&place, &LISTENING, "log");
    let daemon = serve();
    place.put("hot/in/part.stl", &holes(1));
    wait_until("it is done", || !daemon.lines("Done.").is_empty());
    assert_eq!(recoveries(&daemon), [0; 5]);
    daemon.signal(Signal::TERM);
    assert!(daemon.ended().success());
    assert_eq!(recoveries(&serve()), [0; 5], "a good end");
    place.put("hot/.suture/state/db/snap.0000000000000001.generating", b"half");
    assert_eq!(recoveries(&serve()), [1, 0, 0, 0, 0]);
    std::fs::remove_dir_all(place.at("hot/.suture/state")).unwrap();
    let daemon = serve();
    assert_eq!(recoveries(&daemon), [0, 0, 1, 0, 0]);
    // Killed while a worker has it, which is stopped over it.
    std::fs::rename(place.generate(Case::Mixed, 300_000, 1).0, place.at("hot/in/large.stl")).unwrap();
    let at_work = || worker_of(daemon.pid(), "/.suture/work/");
    wait_until("it is in work", || at_work().is_some_and(|worker| kill_process(worker, Signal::STOP).is_ok()));
    let worker = at_work().expect("it was stopped before it had an answer");
    drop(daemon);
    kill_process(worker, Signal::CONT).unwrap();
    assert_eq!(recoveries(&serve()), [0, 0, 0, 1, 0]);
    // A person begins it anew: the next daemon counts that, and none after it.
    std::fs::remove_dir_all(place.at("hot/.suture/state/db")).unwrap();
    place.suture(["jobs", "rebuild", "--dir", "hot"]).expect(0);
    assert_eq!(recoveries(&serve())[4], 1);
    assert_eq!(recoveries(&serve())[4], 0);
}

#[test]
fn the_document_names_every_route_and_its_methods() {
    let place = Place::new();
    let daemon = Served::start(&place, &LISTENING, "log");
    let client = Client::of(&daemon);
    assert_eq!(client.get("/v1/openapi.json").expect(200).json(), *document());
    for (path, methods) in document()["paths"].as_object().expect("paths") {
        let refused = client.send("TRACE", &path.replace("{id}", "1"), &[], b"").expect(405);
        let mut there: Vec<_> =
            refused.header("allow").expect("methods").split(',').map(|m| m.trim().to_ascii_lowercase()).collect();
        there.retain(|method| method != "head");
        there.sort();
        let mut written: Vec<_> = methods.as_object().unwrap().keys().filter(|key| *key != "parameters").cloned().collect();
        written.sort();
        assert_eq!(there, written, "{path}");
    }
}
