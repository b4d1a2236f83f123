//! The morning after: whoever did not watch can say of each file, from the pages alone, what to do with it.

use suture_bench::generate::Case;
use suture_tests::hot::{holes, mesh};
use suture_tests::http::Client;
use suture_tests::served::{Served, wait_until};
use suture_tests::{Place, stl};

/// A clean mesh so small that it may be drawn in inches.
fn tiny() -> Vec<u8> {
    let small = |t: stl::Triangle| t.map(|p| p.map(|x| x / 64.0));
    stl::mesh(&stl::records(&mesh(Case::Clean, 1)).iter().map(|record| small(stl::corners(record))).collect::<Vec<_>>())
}

fn served<'a>(place: &'a Place, lines: &str) -> (Served<'a>, Client) {
    let settings = format!("settle = \"30ms\"\n{lines}\n[api]\nlisten = \"127.0.0.1:0\"\n");
    place.put("suture.toml", settings.as_bytes());
    let daemon = Served::start(place, &["--config", "suture.toml"], "log");
    let client = Client::of(&daemon);
    (daemon, client)
}

/// What a person should know of a good result is said where they look first, not in its report alone.
#[test]
fn a_good_result_with_a_note_is_told_of() {
    let place = Place::new();
    let (_daemon, client) = served(&place, "[[folders]]\npath = \"hot\"");
    place.put("hot/in/good.stl", &holes(1));
    place.put("hot/in/tiny.stl", &tiny());
    wait_until("both are done", || client.get("/v1/status").json()["jobs"]["done"] == 2);
    let night = client.browse("/").expect(200);
    for words in ["Nothing needs you.", "Good, with a note", "tiny.stl", "was it drawn in inches?", "Read the note."] {
        assert!(night.text().contains(words), "{words}: {}", night.text());
    }
    assert!(night.text().contains("<th scope=\"col\">Note</th>") && !night.text().contains("<th scope=\"col\">Why</th>"));
    assert!(!night.text().contains("good.stl"));
    let all = client.browse("/jobs").expect(200);
    assert!(all.text().contains("was it drawn in inches?"), "{}", all.text());
    let listed = client.get("/v1/jobs").json();
    let tiny = listed["jobs"].as_array().unwrap().iter().find(|job| job["file"] == "tiny.stl").unwrap().clone();
    assert!(tiny["reason"].as_str().is_some_and(|reason| reason.contains("inches")), "{tiny}");
    let page = client.browse(&format!("/jobs/{}", tiny["id"])).expect(200);
    assert!(page.text().contains("Note: it is ") && page.text().contains("Read the note."), "{}", page.text());
    let lines = place.suture(["jobs", "list", "--dir", "hot"]).expect(0).stdout();
    assert!(lines.contains("out/tiny.stl; note: it is ") && !lines.contains("good.stl; note"), "{lines}");
    place.suture(["night", "--dir", "hot", "-o", "night.html"]).expect(0);
    let page = String::from_utf8(place.read("night.html")).unwrap();
    assert!(page.contains("Good, with a note") && page.contains("was it drawn in inches?"), "{page}");
}

/// Of files of one name in two folders it is said which is which, and where their folders are.
#[test]
fn of_several_folders_each_file_says_which_it_is_of() {
    let place = Place::new();
    let (_daemon, client) = served(&place, "[[folders]]\npath = \"cold\"\n[[folders]]\npath = \"hot\"");
    place.put("cold/in/part.stl", b"no mesh");
    place.put("hot/in/part.stl", &holes(1));
    wait_until("both have ended", || ["done", "failed"].iter().all(|state| client.get("/v1/status").json()["jobs"][state] == 1));
    let night = client.browse("/").expect(200);
    let cold = place.at("cold").display().to_string();
    for words in ["<th scope=\"col\">Folder</th>", "<td>cold</td>", &cold] {
        assert!(night.text().contains(words), "{words}: {}", night.text());
    }
    place.suture(["night", "--dir", "hot", "-o", "night.html"]).expect(0);
    let page = String::from_utf8(place.read("night.html")).unwrap();
    assert!(page.contains("<td>cold</td>") && page.contains("<td>hot</td>"), "{page}");
    place.suture(["night", "--dir", "cold", "-o", "night.csv"]).expect(0);
    let table = String::from_utf8(place.read("night.csv")).unwrap();
    // From whichever folder it is asked for.
    assert!(table.lines().any(|line| line.contains(",hot,part.stl,done,") && line.contains(",out/part.stl,")), "{table}");
}

/// What waits for a person to mend a mistake says so on the first page.
#[test]
fn what_waits_says_why() {
    let place = Place::new();
    let (_daemon, client) = served(&place, "[[folders]]\npath = \"hot\"");
    place.put("hot/in/order/.suture.toml", b"max_hole_edgse = 5\n");
    place.put("hot/in/order/part.stl", &holes(1));
    wait_until("it waits", || client.get("/v1/jobs/1").json()["state"] == "waiting");
    let night = client.browse("/").expect(200);
    for words in ["Tried again later", "order/part.stl", "max_hole_edgse"] {
        assert!(night.text().contains(words), "{words}: {}", night.text());
    }
    place.suture(["night", "--dir", "hot", "-o", "night.html"]).expect(0);
    let page = String::from_utf8(place.read("night.html")).unwrap();
    assert!(page.contains("1 not over yet"), "{page}");
}

/// A button that would be refused is not shown, and nobody is sent to it.
#[test]
fn a_file_that_is_gone_cannot_be_tried_again() {
    let place = Place::new();
    let (_daemon, client) = served(&place, "[[folders]]\npath = \"hot\"");
    let note = place.put("hot/in/part.step", b"PK");
    wait_until("it is noticed", || client.get("/v1/jobs").json()["jobs"][0]["state"] == "noticed");
    std::fs::remove_file(note).unwrap();
    wait_until("it is forgotten", || client.get("/v1/jobs/1").json()["state"] == "cancelled");
    let page = client.browse("/jobs/1").expect(200);
    assert!(page.text().contains("Drop the file again") && !page.text().contains("/retry"), "{}", page.text());
    client.send("POST", "/v1/jobs/1/retry", &[], b"").expect(409);
}

/// A file that is renamed into place counts as whole at once; what is none all the same does not lie there for ever, unsaid.
#[test]
fn a_picture_that_is_renamed_into_place_fails_with_a_reason() {
    let place = Place::new();
    let (_daemon, client) = served(&place, "[[folders]]\npath = \"hot\"");
    wait_until("it is ready", || client.get("/readyz").status == 200);
    let dropped = place.put("hot/in/part.stl.part", b"\x89PNG\r\n\x1a\n");
    std::fs::rename(dropped, place.at("hot/in/part.stl")).unwrap();
    wait_until("it has failed", || client.get("/v1/status").json()["jobs"]["failed"] == 1);
    assert!(client.browse("/").expect(200).text().contains("part.stl"));
}
