//! What `suture jobs list --json` says, held against its description.

use std::collections::{BTreeMap, BTreeSet};

use serde_json::Value;
use suture_bench::generate::{Case, write};
use suture_tests::Place;
use suture_tests::hot::holes;
use suture_tests::served::{Served, jobs, wait_until};

const PAGE: &str = include_str!("../../../docs/JOBS.md");

/// Names of fields in the first column of the table; of those that are always there, or of all.
fn described(always: bool) -> BTreeSet<String> {
    let rows = PAGE.lines().filter_map(|line| line.strip_prefix("| ")).filter(|row| row.starts_with('`'));
    let wanted = rows.filter(|row| !always || row.split('|').nth(1).is_some_and(|column| column.contains("**yes**")));
    let names = wanted.filter_map(|row| row.split('|').next()).flat_map(|column| column.split('`').skip(1).step_by(2));
    names.map(str::to_owned).collect()
}

/// The fields of a line that hold no others, by their paths. Those of a claim and of a publication are called the same in every state.
fn fields(value: &Value, path: &str, found: &mut BTreeSet<String>) {
    match value.as_object().filter(|fields| !fields.is_empty()) {
        Some(fields_of) => {
            for (name, value) in fields_of {
                let path = match name.as_str() {
                    "hold" | "publication" => name.clone(),
                    _ if path.is_empty() => name.clone(),
                    _ => format!("{path}.{name}"),
                };
                fields(value, &path, found);
            }
        }
        None => drop(found.insert(path.to_owned())),
    }
}

/// Jobs of many fates: each field of each is described, and what is said to be there always is.
#[test]
fn every_field_of_a_job_is_described() {
    let place = Place::new();
    let once = |code| place.suture(["watch", "hot", "--once", "--settle", "30ms"]).expect(code);
    let ask = |words: &[&str]| place.suture(["jobs", "--dir", "hot"].iter().chain(words)).expect(0);
    place.put("hot/in/a.stl", &holes(1));
    place.put("hot/in/bad.stl", b"no mesh at all");
    place.put("hot/in/notes.txt", b"a note");
    once(1);
    place.put("hot/in/b.stl", &holes(1));
    once(0);
    let number =
        |name: &str| jobs(&place, "hot").iter().find(|job| job["source"]["path"] == name).expect("a job")["id"].to_string();
    ask(&["retry", &number("bad.stl")]);
    ask(&["priority", &number("bad.stl"), "7"]);
    let (mut seen, mut kinds) = (BTreeSet::new(), BTreeSet::new());
    for line in [jobs(&place, "hot"), {
        once(1);
        jobs(&place, "hot")
    }]
    .concat()
    {
        let mut found = BTreeSet::new();
        fields(&line, "", &mut found);
        let has = |name: &String| found.contains(name) || line.get(name).is_some();
        assert!(described(true).iter().all(has), "{line}");
        kinds.insert(line["kind"].as_str().expect("a word").to_owned());
        seen.append(&mut found);
    }
    let described = described(false);
    assert_eq!(seen.difference(&described).collect::<Vec<_>>(), Vec::<&String>::new(), "not described");
    for name in ["reused", "retried", "priority", "moved_to", "publication.output", "publication.recipe", "state.noticed.reason"]
    {
        assert!(seen.contains(name), "no job has {name}: {seen:?}");
    }
    assert!(kinds.iter().all(|kind| PAGE.contains(&format!("`{kind}`"))), "{kinds:?}");
}

/// How far a job in work is, is said of it, in both forms; of any other nothing.
#[test]
fn the_progress_of_work_is_listed() {
    let place = Place::new();
    let mut large = Vec::new();
    write(Case::Holes, 600_000, 1, &mut large).expect("a mesh is generated into memory");
    place.put("suture.toml", b"settle = \"30ms\"\nreuse = false\n[[folders]]\npath = \"hot\"\n");
    let _daemon = Served::start(&place, &["--config", "suture.toml"], "log");
    let (mut dropped, mut listed, mut shown) = (0, None, String::new());
    let mut reached = BTreeMap::new();
    // Its work may be over before anyone has looked: then there is another.
    wait_until("both are seen", || {
        let all = jobs(&place, "hot");
        if all.iter().filter(|job| job["kind"] == "done").count() == dropped {
            dropped += 1;
            place.put(&format!("hot/in/large{dropped}.stl"), &large);
        }
        let far = all.iter().find(|job| job["kind"] == "running" && job.get("progress").is_some());
        listed = listed.take().or(far.cloned());
        if let Some(far) = far {
            let percent = far["progress"]["percent"].as_u64().expect("a share of the whole");
            let before = reached.insert(far["id"].as_u64(), percent).unwrap_or(0);
            assert!(percent >= before && percent < 100, "from {before} to {far}");
        }
        let line = place.suture(["jobs", "list", "--dir", "hot"]).expect(0).stdout();
        let line = line.lines().find(|line| line.contains(" running ") && line.contains(" %, for "));
        shown = line.map_or(std::mem::take(&mut shown), str::to_owned);
        listed.is_some() && !shown.is_empty()
    });
    let listed = listed.expect("a job in work");
    assert!(listed["progress"]["stage"].as_str().is_some_and(|stage| !stage.is_empty()), "{listed}");
    // For people there are words instead.
    let (stage, doing) = (&listed["progress"]["stage"], listed["progress"]["doing"].as_str().expect("what is being done"));
    assert!(doing.contains(' ') || *stage != doing, "{listed}");
    assert!(["ing ", "repairing", "at work"].iter().any(|words| shown.contains(words)), "{shown}");
    let mut found = BTreeSet::new();
    fields(&listed, "", &mut found);
    assert_eq!(found.difference(&described(false)).collect::<Vec<_>>(), Vec::<&String>::new(), "not described");
    wait_until("all are done", || jobs(&place, "hot").iter().all(|job| job["kind"] == "done"));
    assert!(jobs(&place, "hot").iter().all(|job| job.get("progress").is_none()));
}
