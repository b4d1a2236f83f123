//! Pages for people: what they say, and that no name of a file, no page of another site and no one without a token gets anything out of them.

use suture_tests::Place;
use suture_tests::hot::{doubtful, holes};
use suture_tests::http::{Answer, Client};
use suture_tests::served::{Served, wait_until};
use suture_tests::stl::{cuboid, mesh};

const TOKEN: &str = "0123456789abcdef0123456789abcdef";
/// A name that would be markup.
const EVIL: &str = "<img src=x onerror=alert(1)>.stl";

fn begin<'a>(place: &'a Place, more: &[&str]) -> (Served<'a>, Client) {
    let daemon = Served::start(place, &[&["hot", "--settle", "30ms", "--listen", "127.0.0.1:0"], more].concat(), "log");
    let client = Client::of(&daemon);
    (daemon, client)
}

fn wait_for(client: &Client, id: u64, wanted: &str) {
    wait_until(wanted, || client.get(&format!("/v1/jobs/{id}")).json()["state"] == wanted);
}

/// The value of the first field of that name.
fn field(page: &Answer, name: &str) -> String {
    let after = page.text().split(&format!("name=\"{name}\" value=\"")).nth(1).expect("a form");
    after.split('"').next().unwrap().to_owned()
}

/// Pages run nothing but scripts of ours, are for people, and are whole.
fn assert_is_page(page: &Answer) {
    assert_eq!(page.header("content-type"), Some("text/html; charset=utf-8"));
    let policy = page.header("content-security-policy").expect("a policy");
    assert!(policy.starts_with("default-src 'none'") && policy.contains("frame-ancestors 'none'"), "{policy}");
    assert!(policy.contains("form-action 'self'") && !policy.contains("unsafe"), "{policy}");
    // Else the forms' `Origin` would be `null`.
    assert_eq!(page.header("referrer-policy"), Some("same-origin"));
    let text = page.text();
    assert!(text.starts_with("<!DOCTYPE html><html lang=\"en\">") && text.ends_with("</html>"), "{text}");
    assert!(!text.contains(" style=") && !text.contains("<style") && !text.contains(" onclick="), "{text}");
    assert_eq!(
        text.matches("<script").count(),
        text.matches("<script src=\"/assets/").count() + text.matches("<script type=\"module\" src=\"/assets/").count()
    );
    assert_eq!((text.matches("<h1>").count(), text.matches("<main").count()), (1, 1), "{text}");
}

#[test]
fn pages_say_what_became_of_every_file() {
    let place = Place::new();
    let (_daemon, client) = begin(&place, &[]);
    wait_until("it is ready", || client.get("/readyz").status == 200);
    for path in ["/", "/jobs", "/jobs?state=failed"] {
        assert_is_page(&client.browse(path).expect(200));
    }
    assert!(client.browse("/").text().contains("Nothing needs you."));
    assert!(client.browse("/jobs").text().contains("There are none."));
    place.put("hot/in/good.stl", &holes(1));
    wait_for(&client, 1, "done");
    place.put("hot/in/picture.stl", b"\x89PNG\r\n\x1a\nendsolid");
    wait_for(&client, 2, "failed");
    place.put("hot/in/part.step", b"PK");
    wait_for(&client, 3, "noticed");
    let night = client.browse("/").expect(200);
    assert_is_page(&night);
    for words in [
        "2 files need you.",
        "Failed: 1; Not taken: 1.",
        "picture.stl",
        "part.step",
        "<b>1</b><a href=\"/jobs?state=failed\">failed</a>",
        "which is not read",
    ] {
        assert!(night.text().contains(words), "{words}: {}", night.text());
    }
    assert!(!night.text().contains("good.stl"), "it needs no one");
    let good = client.browse("/jobs/1").expect(200);
    assert_is_page(&good);
    for words in
        ["Repaired", "Print the result.", "out/good.stl", "/v1/jobs/1/result", "boundary edges", "free of self-intersection"]
    {
        assert!(good.text().contains(words), "{words}: {}", good.text());
    }
    assert!(!good.text().contains("/retry"), "there is nothing to try again");
    let failed = client.browse("/jobs/2").expect(200);
    assert!(failed.text().contains("action=\"/jobs/2/retry\"") && failed.text().contains("not a mesh that Suture can read"));
    // What is not there is a page, too; programs are told as ever.
    for (path, status) in
        [("/jobs/99", 404), ("/jobs/x", 404), ("/nothing", 404), ("/jobs?state=nice", 400), ("/jobs?folder=cold", 400)]
    {
        assert_is_page(&client.browse(path).expect(status));
        client.get(path).expect(status);
    }
    client.ask("POST", "/jobs/2/destroy", &[("Accept", "text/html")], b"").expect(404);
    place.suture(["jobs", "pause", "--dir", "hot"]).expect(0);
    place.put("hot/in/later.stl", &holes(2));
    wait_for(&client, 4, "queued");
    let night = client.browse("/").expect(200);
    for words in ["Nothing new is taken: ", "One file waits", "in reach"] {
        assert!(night.text().to_lowercase().contains(&words.to_lowercase()), "{words}: {}", night.text());
    }
    assert!(client.browse("/jobs/4").expect(200).text().contains("action=\"/jobs/4/cancel\""));
    // It is another file when its turn comes.
    place.put("hot/in/later.stl", &holes(3));
    place.suture(["jobs", "resume", "--dir", "hot"]).expect(0);
    wait_for(&client, 4, "cancelled");
    let link = "It was dropped anew as <a href=\"/jobs/5\">job 5</a>";
    wait_until("the new job is named", || client.browse("/jobs/4").expect(200).text().contains(link));
}

#[test]
fn long_lists_have_pages() {
    let place = Place::new();
    (0..60).for_each(|i| drop(place.put(&format!("hot/in/{i}.stl"), b"no mesh")));
    let (_daemon, client) = begin(&place, &[]);
    wait_until("all have failed", || client.get("/v1/status").json()["jobs"]["failed"] == 60);
    let first = client.browse("/jobs?state=failed").expect(200);
    assert_eq!(first.text().matches("<tr>").count(), 51, "a head and fifty jobs");
    let older = "/jobs?state=failed&amp;cursor=11";
    assert!(first.text().contains(&format!("<a href=\"{older}\" rel=\"next\">")), "{}", first.text());
    let second = client.browse(&older.replace("&amp;", "&")).expect(200);
    assert_eq!(second.text().matches("<tr>").count(), 11);
    assert!(!second.text().contains("rel=\"next\"") && second.text().contains("<a href=\"/jobs?state=failed\">Latest</a>"));
    let night = client.browse("/").expect(200);
    assert!(night.text().contains("60 files need you.") && night.text().contains(">35 more</a>"), "{}", night.text());
}

/// A mesh of which there is much to say: boxes that cross, one inside out, copies, what is no triangle, a hole, and three triangles at an edge.
fn all_sorts() -> Vec<u8> {
    let mut triangles = [cuboid([0.0; 3], [9.0; 3]), cuboid([5.0; 3], [14.0; 3])].concat();
    let mut inside_out = cuboid([30.0; 3], [40.0; 3]);
    inside_out.iter_mut().for_each(|corners| corners.swap(0, 1));
    triangles.extend(inside_out);
    let first = triangles[0];
    triangles.extend([first, first, [first[0], first[0], first[1]], [[50.0; 3], [51.0; 3], [52.0; 3]]]);
    triangles.push([[f32::NAN; 3], [1.0; 3], [2.0, 1.0, 0.0]]);
    triangles.push([first[0], first[1], [-20.0, -20.0, -30.0]]);
    triangles.extend(&cuboid([60.0; 3], [70.0; 3])[..11]);
    mesh(&triangles)
}

/// Why a file needs someone is whole wherever files are listed, however much there is to say.
#[test]
fn reasons_are_whole_in_lists() {
    let place = Place::new();
    place.put("hot/in/inspect-only/all.stl", &all_sorts());
    let (_daemon, client) = begin(&place, &[]);
    wait_for(&client, 1, "failed");
    let report = client.get("/v1/jobs/1/report").expect(200).json();
    let reasons = report["verdict"]["reasons"].as_array().expect("reasons");
    let whole = reasons.iter().map(|reason| reason.as_str().expect("a text")).collect::<Vec<_>>().join("; ");
    assert!(whole.len() > 300 && !whole.contains(['<', '&', '"']), "{whole}");
    assert_eq!(client.get("/v1/jobs/1").json()["reason"], *whole);
    for path in ["/", "/jobs"] {
        let page = client.browse(path).expect(200);
        assert!(page.text().contains(&whole) && !page.text().contains('…'), "{path}: {}", page.text());
    }
    place.suture(["night", "--dir", "hot", "-o", "night.html"]).expect(0);
    assert!(String::from_utf8(place.read("night.html")).unwrap().contains(&whole));
    assert!(place.suture(["jobs", "list", "--dir", "hot"]).expect(0).stdout().contains(&whole));
}

#[test]
fn f28_names_of_files_are_no_markup() {
    let place = Place::new();
    place.put(&format!("hot/in/{EVIL}"), b"no mesh");
    place.put("hot/in/a\u{202e}lts.stl", &holes(1));
    let (_daemon, client) = begin(&place, &[]);
    wait_until("both have ended", || ["done", "failed"].iter().all(|state| client.get("/v1/status").json()["jobs"][state] == 1));
    for path in ["/", "/jobs", "/jobs/1", "/jobs/2"] {
        let page = client.browse(path).expect(200);
        assert_is_page(&page);
        assert!(!page.text().contains("<img src=x") && !page.text().contains('\u{202e}'), "{path}: {}", page.text());
    }
    assert!(client.browse("/jobs").text().contains("&lt;img src=x onerror=alert(1)&gt;.stl"));
    for way in ["/jobs/../../etc/passwd", "/assets/../Cargo.toml", "/assets/%2e%2e/three/LICENSE", "/assets/", "/jobs/1%2f..%2f2"]
    {
        client.browse(way).expect(404);
    }
}

#[test]
fn f28_forms_are_taken_from_pages_of_ours_only() {
    let place = Place::new();
    place.put("hot/in/a.stl", b"no mesh");
    let (_daemon, client) = begin(&place, &[]);
    wait_for(&client, 1, "failed");
    let word = field(&client.browse("/jobs/1").expect(200), "word");
    let form = format!("word={word}");
    let origin = format!("http://{}", client.address);
    let refused = |headers: &[(&str, &str)], form: &str, status: u16| {
        client.submit("/jobs/1/retry", headers, form).expect(status);
        assert_eq!(client.get("/v1/jobs/1").json()["attempts"], 1, "nothing was tried again");
    };
    refused(&[("Origin", "http://evil.example")], &form, 403);
    refused(&[("Origin", "null")], &form, 403);
    refused(&[("Sec-Fetch-Site", "cross-site")], &form, 403);
    refused(&[("Sec-Fetch-Site", "same-site"), ("Origin", &origin)], &form, 403);
    refused(&[("Host", "evil.example")], &form, 421);
    refused(&[("Origin", &origin)], "", 400);
    refused(&[("Origin", &origin)], "word=", 403);
    refused(&[("Origin", &origin)], &format!("word={}", word.replace('a', "b").replace('0', "1")), 403);
    refused(&[("Origin", &origin), ("Cookie", "suture-session=x")], &form, 403);
    refused(&[("Origin", &origin)], &"x".repeat(70_000), 413);
    let done = client.submit("/jobs/1/retry", &[("Origin", &origin), ("Sec-Fetch-Site", "same-origin")], &form).expect(303);
    assert_eq!(done.header("location"), Some("/jobs/1"));
    wait_until("it is tried again", || client.get("/v1/jobs/1").json()["attempts"] == 2);
    // What does not fit the job is told on a page.
    assert_is_page(&client.submit("/jobs/1/release", &[("Origin", &origin)], &form).expect(409));
}

#[test]
fn f28_without_a_token_there_is_a_page_to_sign_in_and_nothing_else() {
    let place = Place::new();
    place.put("tokens", format!("{TOKEN}\n").as_bytes());
    let settings = "settle = \"30ms\"\n[api]\nlisten = \"127.0.0.1:0\"\ntoken_file = \"tokens\"\n[[folders]]\npath = \"hot\"\n";
    place.put("suture.toml", settings.as_bytes());
    let daemon = Served::start(&place, &["--config", "suture.toml"], "log");
    let client = Client::of(&daemon);
    place.put("hot/in/secret.stl", b"no mesh");
    let bearer = format!("Bearer {TOKEN}");
    let api = |path: &str| client.ask("GET", path, &[("Authorization", &bearer)], b"");
    wait_until("it has failed", || api("/v1/status").json()["jobs"]["failed"] == 1);
    for path in ["/", "/jobs", "/jobs/1", "/nothing"] {
        let led = client.browse(path).expect(303);
        assert!(led.header("location").is_some_and(|to| to.starts_with("/login?next=")) && !led.text().contains("secret"));
        client.get(path).expect(401);
    }
    client.get("/v1/jobs").expect(401);
    client.submit("/jobs/1/retry", &[], "word=x").expect(303);
    let login = client.browse("/login?next=%2Fjobs%2F1").expect(200);
    assert_is_page(&login);
    assert!(!login.text().contains("name=\"word\"") && client.browse("/assets/suture.css").status == 200);
    let wrong = client.submit("/login", &[], "token=0123456789abcdef&next=%2F").expect(403);
    assert!(wrong.header("set-cookie").is_none() && wrong.text().contains("not one of the tokens"));
    client.submit("/login", &[("Origin", "http://evil.example")], &format!("token={TOKEN}")).expect(403);
    let away = client.submit("/login", &[], &format!("token={TOKEN}&next=%2F%2Fevil.example")).expect(303);
    assert_eq!(away.header("location"), Some("/"));
    let signed = client.submit("/login", &[], &format!("token={TOKEN}&next=%2Fjobs%2F1")).expect(303);
    assert_eq!(signed.header("location"), Some("/jobs/1"));
    let cookie = signed.header("set-cookie").expect("a cookie").to_owned();
    assert!(cookie.contains("HttpOnly") && cookie.contains("SameSite=Strict") && !cookie.contains(TOKEN), "{cookie}");
    let cookie = cookie.split(';').next().unwrap().to_owned();
    let with = |method: &str, path: &str, body: &str| {
        client.ask(method, path, &[("Cookie", &cookie), ("Accept", "text/html")], body.as_bytes())
    };
    let page = with("GET", "/jobs/1", "").expect(200);
    assert!(page.text().contains("secret.stl") && page.text().contains("Sign out"));
    with("GET", "/v1/jobs/1", "").expect(200);
    let word = field(&page, "word");
    // The word of one session opens nothing in another.
    let other = client.submit("/login", &[], &format!("token={TOKEN}")).expect(303);
    let other = other.header("set-cookie").unwrap().split(';').next().unwrap().to_owned();
    client.submit("/jobs/1/retry", &[("Cookie", &other)], &format!("word={word}")).expect(403);
    with("POST", "/jobs/1/retry", &format!("word={word}")).expect(303);
    with("POST", "/logout", "word=x").expect(403);
    with("POST", "/logout", &format!("word={word}")).expect(303);
    with("GET", "/jobs/1", "").expect(303);
}

#[test]
fn pictures_are_of_the_bytes_that_were_published() {
    let place = Place::new();
    place.put("hot/in/a.stl", &holes(1));
    let (_daemon, client) = begin(&place, &[]);
    wait_for(&client, 1, "done");
    let picture = client.get("/v1/jobs/1/preview").expect(200);
    assert_eq!((picture.header("content-type"), width(&picture)), (Some("image/png"), 1280), "both, side by side");
    let before = client.get("/v1/jobs/1/preview?side=before").expect(200);
    let after = client.get("/v1/jobs/1/preview?side=after").expect(200);
    assert_eq!((width(&before), width(&after)), (640, 640));
    assert_ne!(before.body, after.body);
    let behind = client.get("/v1/jobs/1/preview?from=behind").expect(200);
    assert!(width(&behind) == 1280 && behind.body != picture.body, "from the opposite side");
    let tag = picture.header("etag").expect("a tag").to_owned();
    assert!(client.send("GET", "/v1/jobs/1/preview?side=both", &[("If-None-Match", &tag)], b"").expect(304).body.is_empty());
    let view = client.get("/v1/jobs/1/view").expect(200);
    let number = |at: usize| u32::from_le_bytes(view.body[4 * at..4 * at + 4].try_into().unwrap()) as usize;
    assert_eq!((&view.body[..4], view.body.len()), (&b"SUT1"[..], 20 + 12 * number(1) + 12 * number(2)));
    let report = client.get("/v1/jobs/1/report").expect(200).json();
    assert_eq!(report["output"]["triangles"], number(3), "of so many triangles, and all of them");
    assert_eq!(number(2), number(3));
    for (path, status) in [("preview?side=up", 400), ("preview?size=9", 400), ("view?side=both", 400), ("view?from=behind", 400)]
    {
        client.get(&format!("/v1/jobs/1/{path}")).expect(status);
    }
    // Another file in its place is not shown; what was drawn before, is.
    std::fs::write(place.at("hot/done/a.stl"), holes(2)).unwrap();
    client.get("/v1/jobs/1/view?side=before").expect(409);
    assert_eq!(client.get("/v1/jobs/1/preview").expect(200).body, picture.body);
    std::fs::remove_file(place.at("hot/done/a.stl")).unwrap();
    client.get("/v1/jobs/1/view?side=before").expect(410);
    // No mesh, no picture; the page says all else.
    place.put("hot/in/b.stl", b"no mesh");
    wait_for(&client, 2, "failed");
    client.get("/v1/jobs/2/preview").expect(404);
    client.get("/v1/jobs/9/preview").expect(404);
    let (with, without) = (client.browse("/jobs/1").expect(200), client.browse("/jobs/2").expect(200));
    assert!(with.text().contains("src=\"/v1/jobs/1/preview?side=both\"") && with.text().contains("data-view=\"1\""));
    assert!(!without.text().contains("/preview") && !without.text().contains("data-view"));
    // Nothing half-made is left.
    assert!(place.names("hot/.suture/pictures").iter().all(|name| name.ends_with(".png") || name.ends_with(".mesh")));
}

/// Of a PNG.
fn width(picture: &Answer) -> u32 {
    assert_eq!(&picture.body[..8], b"\x89PNG\r\n\x1a\n");
    u32::from_be_bytes(picture.body[16..20].try_into().unwrap())
}

#[test]
fn a_person_decides_on_the_page_of_a_job() {
    let place = Place::new();
    for name in ["first", "second"] {
        place.put(&format!("hot/in/{name}.stl"), &doubtful());
    }
    let (_daemon, client) = begin(&place, &[]);
    wait_until("both need review", || client.get("/v1/status").json()["jobs"]["needs_review"] == 2);
    let files = |id: u64| client.get(&format!("/v1/jobs/{id}")).json()["file"].as_str().unwrap_or_default().to_owned();
    let best = place.read(&format!("hot/failed/{}", files(1).replace(".stl", ".best.stl")));
    let page = client.browse("/jobs/1").expect(200);
    assert_is_page(&page);
    assert!(page.text().contains("formaction=\"/jobs/1/approve\"") && page.text().contains("formaction=\"/jobs/1/reject\""));
    // All reasons stand where one looks first, whole and once.
    let reasons = client.get("/v1/jobs/1/report").json()["verdict"]["reasons"].as_array().unwrap().clone();
    assert!(!reasons.is_empty() && page.text().contains("<p>Why:</p><ul><li>"), "{}", page.text());
    for reason in reasons {
        assert_eq!(
            page.text().matches(&format!("<li>{}</li>", reason.as_str().unwrap())).count(),
            1,
            "{reason}: {}",
            page.text()
        );
    }
    let word = field(&page, "word");
    let decide =
        |id: u64, action: &str, rest: &str| client.submit(&format!("/jobs/{id}/{action}"), &[], &format!("word={word}{rest}"));
    // Someone has to stand for it.
    assert_is_page(&decide(1, "approve", "&by=&note=").expect(400));
    assert_eq!(client.get("/v1/jobs/1").json()["state"], "needs_review");
    decide(1, "approve", "&by=Ada+Lovelace&note=the+hole+%3Cb%3Ewas%3C%2Fb%3E+meant").expect(303);
    wait_for(&client, 1, "done");
    assert_eq!(place.read(&format!("hot/out/{}", files(1))), best);
    let page = client.browse("/jobs/1").expect(200);
    for words in ["approved by Ada Lovelace", "the hole &lt;b&gt;was&lt;/b&gt; meant"] {
        assert!(page.text().contains(words), "{words}: {}", page.text());
    }
    assert!(!page.text().contains("/approve"), "there is nothing to decide");
    decide(2, "reject", "&by=Ada").expect(303);
    wait_for(&client, 2, "rejected");
    let page = client.browse("/jobs/2").expect(200);
    assert!(page.text().contains("Ask for a better file.") && page.text().contains("/jobs/2/approve"), "{}", page.text());
    assert!(!page.text().contains("/jobs/2/reject"));
    let night = client.browse("/");
    assert!(night.text().contains("Nothing needs you."), "whoever rejected it knows");
    for words in ["<b>0</b>need review", "<b>1</b><a href=\"/jobs?state=rejected\">rejected</a>"] {
        assert!(night.text().contains(words), "{words}: {}", night.text());
    }
}
