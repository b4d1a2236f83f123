//! The web interface: who may ask, and how it is asked after the daemon's health.

use suture_tests::Place;
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

#[test]
fn an_address_that_is_taken_keeps_it_from_starting() {
    let place = Place::new();
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let address = taken.local_addr().unwrap().to_string();
    let refused = place.suture(["watch", "hot", "--listen", &address]).expect(2);
    assert!(refused.stderr().contains("cannot listen at") && refused.stderr().lines().count() == 1, "{}", refused.stderr());
}
