//! Jobs over HTTP: lists, files, wishes; and uploads, each of which is one job whatever happens.

use suture_tests::Place;
use suture_tests::binary::with_crash_points;
use suture_tests::hot::holes;
use suture_tests::http::{Answer, Client};
use suture_tests::served::{Served, wait_until};

fn begin<'a>(place: &'a Place, more: &[&str], log: &str) -> (Served<'a>, Client) {
    let daemon = Served::start(place, &[&["hot", "--settle", "30ms", "--listen", "127.0.0.1:0"], more].concat(), log);
    let client = Client::of(&daemon);
    (daemon, client)
}

fn state(client: &Client, id: u64) -> String {
    // It may not be there yet.
    client.get(&format!("/v1/jobs/{id}")).json()["state"].as_str().unwrap_or_default().to_owned()
}

fn wait_for(client: &Client, id: u64, wanted: &str) {
    wait_until(wanted, || state(client, id) == wanted);
}

fn ids(answer: &Answer) -> Vec<u64> {
    answer.json()["jobs"].as_array().expect("a list").iter().filter_map(|job| job["id"].as_u64()).collect()
}

#[test]
fn jobs_are_listed_and_their_files_are_sent() {
    let place = Place::new();
    (1..=3).for_each(|i| drop(place.put(&format!("hot/in/{i}.stl"), &holes(i))));
    place.put("hot/in/picture.stl", b"\x89PNG\r\n\x1a\nendsolid");
    let (_daemon, client) = begin(&place, &[], "log");
    wait_until("all are done", || ids(&client.get("/v1/jobs?state=done,failed")).len() == 4);
    let first = client.get("/v1/jobs?limit=3").expect(200);
    assert_eq!(ids(&first), [4, 3, 2]);
    let next = first.json()["next"].as_str().expect("more").to_owned();
    let second = client.get(&format!("/v1/jobs?limit=3&cursor={next}")).expect(200);
    assert_eq!((ids(&second), second.json().get("next")), (vec![1], None));
    assert_eq!(ids(&client.get("/v1/jobs?state=queued").expect(200)), [0; 0]);
    client.get("/v1/jobs?state=nice").expect(400);
    client.get("/v1/jobs?folder=cold").expect(400);
    let failed = ids(&client.get("/v1/jobs?state=failed&folder=hot").expect(200))[0];
    client.get(&format!("/v1/jobs/{failed}/result")).expect(404);
    let report = client.get(&format!("/v1/jobs/{failed}/report")).expect(200);
    assert_eq!(report.json()["outcome"], "unreadable");
    let done = ids(&client.get("/v1/jobs?state=done&limit=1"))[0];
    let job = client.get(&format!("/v1/jobs/{done}")).expect(200).json();
    let (name, result) = (job["result"]["name"].as_str().unwrap().to_owned(), format!("/v1/jobs/{done}/result"));
    let sent = client.get(&result).expect(200);
    assert_eq!(sent.body, place.read(&format!("hot/out/{name}")));
    let tag = sent.header("etag").expect("a tag").to_owned();
    assert_eq!(Some(tag.trim_matches('"')), job["result"]["blake3"].as_str());
    assert!(client.send("GET", &result, &[("If-None-Match", &tag)], b"").expect(304).body.is_empty());
    assert!(client.send("HEAD", &result, &[], b"").expect(200).body.is_empty());
    // Another file in its place is not sent.
    std::fs::write(place.at(&format!("hot/out/{name}")), "mine").unwrap();
    client.get(&result).expect(409);
    std::fs::remove_file(place.at(&format!("hot/out/{name}"))).unwrap();
    client.get(&result).expect(410);
    let status = client.get("/v1/status").expect(200).json();
    assert_eq!((&status["jobs"]["done"], &status["jobs"]["failed"], &status["ready"]), (&3.into(), &1.into(), &true.into()));
}

#[test]
fn what_is_wished_of_jobs_is_done() {
    let place = Place::new();
    place.put("hot/in/a.stl", &holes(1));
    let (_daemon, client) = begin(&place, &[], "log");
    wait_for(&client, 1, "done");
    let wish = |id: u64, wish: &str, body: &str| client.send("POST", &format!("/v1/jobs/{id}/{wish}"), &[], body.as_bytes());
    wish(1, "retry", "").expect(409);
    wish(1, "release", "").expect(409);
    wish(9, "retry", "").expect(404);
    place.suture(["jobs", "pause", "--dir", "hot"]).expect(0);
    place.put("hot/in/b.stl", &holes(2));
    wait_until("the second is seen", || ids(&client.get("/v1/jobs")).len() == 2);
    assert_eq!(wish(2, "priority", "{\"priority\": 8}").expect(200).json()["priority"], 8);
    wish(2, "priority", "{\"priority\": 12}").expect(400);
    wish(2, "priority", "{").expect(400);
    let delete = |id: u64| client.send("DELETE", &format!("/v1/jobs/{id}"), &[], b"");
    delete(2).expect(409);
    assert_eq!(wish(2, "cancel", "").expect(200).json()["state"], "cancelled");
    // Its file lies there still: without the record it would be taken again.
    delete(2).expect(409);
    assert_eq!(wish(2, "retry", "").expect(200).json()["state"], "queued");
    wish(2, "cancel", "").expect(200);
    std::fs::remove_file(place.at("hot/in/b.stl")).unwrap();
    delete(2).expect(204);
    client.get("/v1/jobs/2").expect(404);
    delete(1).expect(204);
    assert!(place.at("hot/done/a.stl").exists() && place.at("hot/out/a.stl").exists(), "files stay");
}

fn upload(client: &Client, query: &str, headers: &[(&str, &str)], body: &[u8]) -> Answer {
    client.send("POST", &format!("/v1/jobs?{query}"), headers, body)
}

#[test]
fn an_upload_becomes_a_job_at_once() {
    let place = Place::new();
    let (daemon, client) = begin(&place, &[], "log");
    let came = upload(&client, "name=order-1/part.stl&priority=7", &[], &holes(1)).expect(202);
    assert_eq!((came.header("location"), &came.json()["id"]), (Some("/v1/jobs/1"), &1.into()));
    assert_eq!((&came.json()["file"], &came.json()["priority"]), (&"order-1/part.stl".into(), &7.into()));
    wait_for(&client, 1, "done");
    assert!(place.at("hot/out/order-1/part.stl").exists());
    let form = [
        &b"--XX\r\nContent-Disposition: form-data; name=\"note\"\r\n\r\nhello\r\n--XX\r\n"[..],
        b"Content-Disposition: form-data; name=\"file\"; filename=\"C:\\\\parts\\\\my part.stl\"\r\n\r\n",
        &holes(2),
        b"\r\n--XX--\r\n",
    ];
    let of_form = [("Content-Type", "multipart/form-data; boundary=XX")];
    let came = client.send("POST", "/v1/jobs", &of_form, &form.concat()).expect(202);
    assert_eq!(came.json()["file"], "my part.stl");
    wait_for(&client, 2, "done");
    assert_eq!(place.read("hot/done/my part.stl"), holes(2), "byte for byte");
    // Chunks, of a length that no one said before.
    let chunk = [format!("{:x}\r\n", holes(3).len()).as_bytes(), &holes(3), b"\r\n0\r\n\r\n"].concat();
    upload(&client, "name=c.stl", &[("Transfer-Encoding", "chunked")], &chunk).expect(202);
    wait_for(&client, 3, "done");
    // A file that lies there already, by its path; twice the same job.
    place.suture(["jobs", "pause", "--dir", "hot"]).expect(0);
    let path = place.put("hot/in/there.stl", &holes(4));
    let json = [("Content-Type", "application/json")];
    for body in [format!("{{\"path\": {path:?}}}"), "{\"path\": \"there.stl\"}".to_owned()] {
        assert_eq!(client.send("POST", "/v1/jobs", &json, body.as_bytes()).expect(202).json()["id"], 4);
    }
    place.put("hot/in/half.stl", &holes(4)[..500]);
    for (path, status) in [("half.stl", 409), ("nothing.stl", 404), ("../done/c.stl", 400), ("/etc/passwd", 400), ("", 400)] {
        client.send("POST", "/v1/jobs", &json, format!("{{\"path\": {path:?}}}").as_bytes()).expect(status);
    }
    assert_eq!(place.names("hot/.suture/upload"), [""; 0], "nothing is left");
    drop(daemon);
}

#[test]
fn uploads_that_cannot_be_taken_leave_nothing() {
    let place = Place::new();
    let text = "settle = \"30ms\"\n[api]\nlisten = \"127.0.0.1:0\"\nmax_upload = \"4KiB\"\n[[folders]]\npath = \"hot\"\n";
    place.put("suture.toml", text.as_bytes());
    let daemon = Served::start(&place, &["--config", "suture.toml"], "log");
    let client = Client::of(&daemon);
    let mesh = vec![0; 5000];
    for (query, status) in [("name=a.stl", 413), ("name=../a.stl", 400), ("name=a.step", 400), ("", 400), ("name=a.stl&x=1", 400)]
    {
        upload(&client, query, &[], &mesh).expect(status);
    }
    upload(&client, "name=a.stl", &[], b"").expect(400);
    upload(&client, "name=a.stl", &[("Transfer-Encoding", "chunked")], &[b"1388\r\n", &mesh[..], b"\r\n0\r\n\r\n"].concat())
        .expect(413);
    // Cut off.
    assert_ne!(upload(&client, "name=a.stl", &[("Content-Length", "4000")], &mesh[..100]).status, 202);
    wait_until("nothing is left", || place.names("hot/.suture/upload").is_empty());
    assert_eq!((ids(&client.get("/v1/jobs")), place.names("hot/in")), (vec![], vec![]));
}

#[test]
fn a_key_leads_to_one_job_whatever_is_killed_when() {
    let key = [("Idempotency-Key", "order 17, part 3")];
    for point in ["upload_durable", "upload_noted", "upload_placed", "submitted"] {
        let place = Place::new();
        let command = |crash: Option<&str>| {
            let mut command = place.command_of(with_crash_points());
            command.args(["watch", "hot", "--settle", "30ms", "--listen", "127.0.0.1:0"]);
            command.envs(crash.map(|point| ("SUTURE_CRASH_AT", format!("daemon.{point}:1"))));
            command
        };
        let daemon = Served::of(&place, command(Some(point)), "first");
        let client = Client::of(&daemon);
        let lost = upload(&client, "name=part.stl", &key, &holes(1));
        // The scan submits what it finds, which is not always faster.
        assert!(lost.status == 0 || point == "submitted", "{point}: it was to die");
        drop(daemon);
        let daemon = Served::of(&place, command(None), "second");
        let client = Client::of(&daemon);
        let again = upload(&client, "name=part.stl", &key, &holes(1)).expect(202);
        let id = again.json()["id"].as_u64().expect("an id");
        wait_for(&client, id, "done");
        let once_more = upload(&client, "name=part.stl", &key, &holes(1)).expect(202);
        assert_eq!(once_more.json()["id"].as_u64(), Some(id), "{point}");
        assert_eq!(ids(&client.get("/v1/jobs")), [id], "{point}");
        assert_eq!(place.names("hot/out").iter().filter(|name| name.ends_with(".stl")).count(), 1, "{point}");
        assert_eq!(std::fs::read_dir(place.at("hot/.suture/upload")).unwrap().count(), 1, "{point}: the notes alone");
        drop(daemon);
    }
}
