//! Hostile clients of the web interface: each is refused, and the daemon goes on as if nothing had been.

use std::io::Write;
use std::net::TcpStream;
use std::time::Duration;

use suture_tests::Place;
use suture_tests::hot::holes;
use suture_tests::http::{Client, read_answer};
use suture_tests::served::{Served, wait_until};

/// Resident memory of a process in bytes.
fn resident(pid: u32) -> u64 {
    let statm = std::fs::read_to_string(format!("/proc/{pid}/statm")).expect("it lives");
    let pages: u64 = statm.split(' ').nth(1).and_then(|pages| pages.parse().ok()).expect("a number");
    pages * 4096
}

/// One of eight ways to be rude, each a little different each time, and what comes of it.
fn rude(client: &Client, n: usize) -> (u16, &'static [u16]) {
    let evil = format!("evil-{n}.example");
    let origin = format!("http://{evil}");
    let json = ("Content-Type", "application/json");
    let answer = match n % 8 {
        0 => (client.send("GET", "/v1/jobs", &[("Host", &evil)], b""), &[421][..]),
        1 => (client.send("POST", "/v1/jobs/1/cancel", &[("Origin", &origin)], b""), &[403][..]),
        2 => (client.send("POST", "/v1/jobs?name=a.stl", &[("Sec-Fetch-Site", "cross-site")], b"solid"), &[403][..]),
        3 => {
            let ways = [
                "/v1/jobs/../../etc/passwd",
                "/v1/jobs/%2e%2e%2fetc",
                "/v1/jobs/1%00/result",
                "/..%2f..%2fetc/passwd",
                "//etc/passwd",
            ];
            (client.send("GET", ways[n / 8 % ways.len()], &[], b""), &[404][..])
        }
        4 => {
            let ways = ["../../x.stl", "/etc/x.stl", "a/../../x.stl", ".suture/x.stl", "x%00.stl"];
            (client.send("POST", &format!("/v1/jobs?name={}", ways[n / 8 % ways.len()]), &[], b"solid"), &[400][..])
        }
        5 => (client.send("POST", "/v1/jobs?name=a.stl", &[("Content-Length", "99999999999999")], b"solid"), &[413][..]),
        6 => (client.send("POST", "/v1/jobs", &[json], &vec![b'['; 100_000]), &[400, 413][..]),
        _ => (client.send("GET", "/v1/jobs", &[("X-Long", &"x".repeat(100_000))], b""), &[0, 431][..]),
    };
    (answer.0.status, answer.1)
}

#[test]
fn f28_two_hundred_rude_requests_change_nothing() {
    let place = Place::new();
    let daemon = Served::start(&place, &["hot", "--settle", "30ms", "--listen", "127.0.0.1:0"], "log");
    let client = Client::of(&daemon);
    place.put("hot/in/first.stl", &holes(1));
    wait_until("the first one", || place.at("hot/out/first.stl").exists());
    let before = resident(daemon.pid());
    // Some that say little or nothing, all the while.
    let mut slow: Vec<TcpStream> = (0..50).map(|_| client.connect()).collect();
    for (n, stream) in slow.iter_mut().enumerate() {
        let said = ["", "GET /v1/jobs HT", "GET / HTTP/1.1\r\nHost: localhost\r\nX: "][n % 3];
        stream.write_all(said.as_bytes()).unwrap();
    }
    for n in 0..200 {
        let (status, expected) = rude(&client, n);
        assert!(expected.contains(&status), "{n}: {status}");
    }
    place.put("hot/in/second.stl", &holes(2));
    wait_until("the second one", || place.at("hot/out/second.stl").exists());
    client.get("/readyz").expect(200);
    assert_eq!(client.get("/v1/jobs").expect(200).json()["jobs"].as_array().map(Vec::len), Some(2));
    assert!(resident(daemon.pid()) < before + (64 << 20), "{before} before, {} after", resident(daemon.pid()));
    assert!(place.names("hot/in").is_empty() && place.names("hot/.suture/upload").is_empty());
    assert!(daemon.lines("internal error").is_empty());
    // Whoever says nothing is sent away.
    for mut stream in slow {
        stream.set_read_timeout(Some(Duration::from_secs(30))).unwrap();
        assert!([0, 408].contains(&read_answer(&mut stream).status));
    }
}

#[test]
fn f28_very_many_who_listen_hold_no_one_up() {
    let place = Place::new();
    let daemon = Served::start(&place, &["hot", "--settle", "30ms", "--listen", "127.0.0.1:0"], "log");
    let client = Client::of(&daemon);
    wait_until("it is ready", || client.get("/readyz").status == 200);
    let before = resident(daemon.pid());
    // None of them reads.
    let head = format!("GET /v1/events HTTP/1.1\r\nHost: {}\r\n\r\n", client.address);
    let mut listening: Vec<TcpStream> = Vec::new();
    for _ in 0..150 {
        let mut stream = client.connect();
        stream.write_all(head.as_bytes()).unwrap();
        listening.push(stream);
    }
    (0..20).for_each(|i| drop(place.put(&format!("hot/in/{i}.stl"), &holes(i % 3 + 1))));
    wait_until("all are done", || place.names("hot/out").iter().filter(|name| name.ends_with(".stl")).count() == 20);
    assert!(client.send("GET", "/v1/status", &[], b"").expect(200).json()["ready"].as_bool().expect("a word"));
    assert_eq!(client.send("GET", "/v1/events", &[], b"").status, 503, "so many listen, and no more");
    assert!(resident(daemon.pid()) < before + (64 << 20));
    drop(listening);
    wait_until("they are gone", || {
        let mut stream = client.connect();
        stream.write_all(head.as_bytes()).unwrap();
        let mut first = [0; 12];
        std::io::Read::read_exact(&mut stream, &mut first).unwrap();
        &first == b"HTTP/1.1 200"
    });
}

/// An upload that drips keeps no one from theirs, and comes to nothing.
#[test]
fn f28_an_upload_that_stops_is_given_up() {
    let place = Place::new();
    let daemon = Served::start(&place, &["hot", "--settle", "30ms", "--listen", "127.0.0.1:0"], "log");
    let client = Client::of(&daemon);
    let mut stream = client.connect();
    let head = format!("POST /v1/jobs?name=a.stl HTTP/1.1\r\nHost: {}\r\nContent-Length: 5000\r\n\r\nsolid", client.address);
    stream.write_all(head.as_bytes()).unwrap();
    wait_until("it comes", || !place.names("hot/.suture/upload").is_empty());
    client.send("POST", "/v1/jobs?name=b.stl", &[], &holes(1)).expect(202);
    assert_eq!(read_answer(&mut stream).status, 408);
    wait_until("nothing is left", || place.names("hot/.suture/upload").is_empty());
}
