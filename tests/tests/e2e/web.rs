//! The web interface: who may ask, and how it is asked after the daemon's health.

use suture_tests::Place;
use suture_tests::hot::{doubtful, holes};
use suture_tests::http::Client;
use suture_tests::served::{Served, wait_until};

const TOKEN: &str = "0123456789abcdef0123456789abcdef";

#[test]
fn health_is_told_and_errors_have_one_shape() {
    let place = Place::new();
    let daemon = Served::start(&place, &["hot", "--settle", "30ms", "--listen", "127.0.0.1:0"], "log");
    let client = Client::of(&daemon);
    assert_eq!(client.get("/livez").expect(200).json()["status"], "alive");
    wait_until("it is ready", || client.get("/readyz").status == 200);
    let lost = client.get("/v1/nothing").expect(404);
    assert_eq!(lost.header("content-type"), Some("application/problem+json"));
    assert_eq!((&lost.json()["status"], &lost.json()["title"]), (&404.into(), &"Not Found".into()));
    for header in ["content-security-policy", "x-content-type-options", "cache-control"] {
        assert!(lost.header(header).is_some(), "{header}");
    }
    let wrong = client.send("DELETE", "/livez", &[], b"").expect(405);
    assert!(wrong.json()["detail"].is_string() && wrong.header("allow").is_some());
    // The only folder goes, and comes back.
    std::fs::rename(place.at("hot"), place.at("elsewhere")).unwrap();
    wait_until("it is not ready", || client.get("/readyz").status == 503);
    client.get("/livez").expect(200);
    std::fs::rename(place.at("elsewhere"), place.at("hot")).unwrap();
    wait_until("it is ready again", || client.get("/readyz").status == 200);
}

#[test]
fn without_being_asked_for_it_listens_nowhere() {
    let place = Place::new();
    let daemon = Served::start(&place, &["hot", "--settle", "30ms"], "log");
    assert!(daemon.lines("Serving the web interface.").is_empty());
}

#[test]
fn f28_beyond_this_machine_only_with_a_token() {
    let place = Place::new();
    let refused = place.suture(["watch", "hot", "--listen", "0.0.0.0:0"]).expect(2);
    assert!(refused.stderr().lines().count() == 1 && refused.stderr().contains("`token_file`"), "{}", refused.stderr());
    let with = |token_file: &str| {
        let text = format!(
            "settle = \"30ms\"\n[api]\nlisten = \"0.0.0.0:0\"\ntoken_file = {token_file:?}\nhosts = [\"farm.example\"]\n[[folders]]\npath = \"hot\"\n"
        );
        place.put("suture.toml", text.as_bytes());
    };
    with("nowhere");
    let refused = place.suture(["watch", "--config", "suture.toml"]).expect(2);
    assert!(refused.stderr().contains("nowhere: cannot read the tokens"), "{}", refused.stderr());
    place.put("tokens", format!("# ours\n{TOKEN}\n").as_bytes());
    with("tokens");
    let daemon = Served::start(&place, &["--config", "suture.toml"], "log");
    let mut client = Client::of(&daemon);
    client.address = client.address.replace("0.0.0.0", "127.0.0.1");
    let of = |headers: &[(&str, &str)]| client.send("GET", "/v1/nothing", headers, b"").status;
    let (bearer, wrong) = (format!("Bearer {TOKEN}"), format!("Bearer {}", TOKEN.replace('a', "b")));
    assert_eq!(of(&[]), 401);
    assert_eq!(of(&[("Authorization", &wrong)]), 401);
    assert_eq!(of(&[("Authorization", &bearer)]), 404);
    assert_eq!(of(&[("X-API-Key", TOKEN)]), 404);
    assert_eq!(of(&[("X-API-Key", TOKEN), ("Host", "farm.example")]), 404);
    assert_eq!(of(&[("X-API-Key", TOKEN), ("Host", "evil.example")]), 421);
    assert_eq!(of(&[("X-API-Key", TOKEN), ("Host", "a"), ("Host", "b")]), 400);
    client.get("/livez").expect(200);
}

/// Under the name of the token, whatever the client says; a token without a name leaves it to the client.
#[test]
fn what_is_done_with_a_named_token_is_done_under_its_name() {
    const ADA: &str = "fedcba9876543210fedcba9876543210";
    let place = Place::new();
    place.put("tokens", format!("{TOKEN}\nAda <Lovelace>: {ADA}\n").as_bytes());
    let settings = "settle = \"30ms\"\n[api]\nlisten = \"127.0.0.1:0\"\ntoken_file = \"tokens\"\n[[folders]]\npath = \"hot\"\n";
    place.put("suture.toml", settings.as_bytes());
    let daemon = Served::start(&place, &["--config", "suture.toml"], "log");
    let client = Client::of(&daemon);
    for n in 1..=3 {
        place.put(&format!("hot/in/{n}.stl"), &doubtful());
    }
    let by = |token: &'static str| {
        let client = &client;
        move |method: &str, path: &str, body: &str| client.send(method, path, &[("X-API-Key", token)], body.as_bytes())
    };
    let (ada, other) = (by(ADA), by(TOKEN));
    let state = |id: u64| other("GET", &format!("/v1/jobs/{id}"), "").json()["state"].to_string();
    wait_until("all need review", || (1..=3).all(|id| state(id).contains("needs_review")));
    let said =
        |answer: suture_tests::http::Answer| answer.expect(200).json()["decision"]["by"].as_str().unwrap_or_default().to_owned();
    assert_eq!(said(ada("POST", "/v1/jobs/1/reject", "{\"by\": \"Grace\"}")), "Ada <Lovelace>");
    assert_eq!(said(other("POST", "/v1/jobs/2/reject", "{\"by\": \"Grace\"}")), "Grace");
    ada("POST", "/v1/jobs/1/retry", "").expect(200);
    ada("POST", "/v1/jobs?name=good.stl", "no mesh").expect(202);
    other("POST", "/v1/jobs/2/retry", "").expect(200);
    // A browser that has signed in with it.
    let signed = client.submit("/login", &[], &format!("token={ADA}")).expect(303);
    let cookie = signed.header("set-cookie").unwrap().split(';').next().unwrap().to_owned();
    let page = client.ask("GET", "/jobs/3", &[("Cookie", &cookie), ("Accept", "text/html")], b"").expect(200);
    assert!(page.text().contains("You decide as <strong>Ada &lt;Lovelace&gt;</strong>"), "{}", page.text());
    let word = page.text().split("name=\"word\" value=\"").nth(1).unwrap().split('"').next().unwrap().to_owned();
    client.submit("/jobs/3/reject", &[("Cookie", &cookie)], &format!("word={word}&by=Grace")).expect(303);
    let decided = other("GET", "/v1/jobs/3", "").json();
    assert_eq!((&decided["state"], &decided["decision"]["by"]), (&"rejected".into(), &"Ada <Lovelace>".into()));
    // The log says who: of decisions, of other wishes, and of files that came.
    let of = |words: &str, job: &str| {
        let lines = daemon.lines(words);
        let line = lines.iter().find(|line| job.is_empty() || line["job"] == 1 && line["wish"] == *job);
        line.map(|line| line["span"]["by"].clone()).unwrap_or_default()
    };
    assert_eq!(of("An operator's wish.", "Retry"), "Ada <Lovelace>");
    assert_eq!(of("A file came by the web.", ""), "Ada <Lovelace>");
    let wishes = daemon.lines("An operator's wish.");
    let unnamed: Vec<_> = wishes.iter().filter(|line| line["job"] == 2).collect();
    assert!(unnamed.len() == 2 && unnamed.iter().all(|line| line.get("span").is_none()), "{unnamed:?}");
}

/// A job that is done is not tried again, and the line says how its file is repaired anew.
#[test]
fn a_retry_of_what_is_done_is_refused_and_says_what_to_do() {
    let place = Place::new();
    let daemon = Served::start(&place, &["hot", "--settle", "30ms", "--listen", "127.0.0.1:0"], "log");
    let client = Client::of(&daemon);
    place.put("hot/in/order/part.stl", &holes(1));
    wait_until("it is done", || client.get("/v1/jobs/1").json()["state"] == "done");
    let words = ["is done, and its result is out/order/part.stl", "drop a copy of done/order/part.stl", "into in/order/!force/"];
    let refused = client.send("POST", "/v1/jobs/1/retry", &[], b"").expect(409).json()["detail"].to_string();
    let said = place.suture(["jobs", "retry", "1", "--dir", "hot"]).expect(2).stderr();
    assert!(words.iter().all(|words| refused.contains(words) && said.contains(words)) && said.lines().count() == 1, "{said}");
    // Whoever does what it says has it repaired anew, not copied.
    std::fs::create_dir_all(place.at("hot/in/order/!force")).unwrap();
    std::fs::copy(place.at("hot/done/order/part.stl"), place.at("hot/in/order/!force/part.stl")).unwrap();
    wait_until("it is repaired anew", || client.get("/v1/jobs/2").json()["state"] == "done");
    let anew = client.get("/v1/jobs/2").json();
    let [earlier, now] = ["part", "part~2"].map(|name| place.read(&format!("hot/out/order/{name}.stl")));
    assert!(anew.get("reused").is_none() && now == earlier, "{anew}");
}

#[test]
fn an_address_that_is_taken_keeps_it_from_starting() {
    let place = Place::new();
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let address = taken.local_addr().unwrap().to_string();
    let refused = place.suture(["watch", "hot", "--listen", &address]).expect(2);
    assert!(refused.stderr().contains("cannot listen at") && refused.stderr().lines().count() == 1, "{}", refused.stderr());
}

/// Half of a file, and a folder of an attempt, as a daemon leaves them that dies.
#[test]
fn what_a_dead_daemon_left_half_done_goes_at_the_next_start() {
    let place = Place::new();
    for left in ["upload/left.part", "work/7/in.stl"] {
        place.put(&format!("hot/.suture/{left}"), b"solid");
    }
    place.suture(["watch", "hot", "--once"]).expect(0);
    assert!(!place.at("hot/.suture/upload/left.part").exists() && !place.at("hot/.suture/work/7").exists());
}
