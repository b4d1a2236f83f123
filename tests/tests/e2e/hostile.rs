//! Meshes as copying, transfer and editors damage them, through the daemon: each ends in its place, and no worker dies of any.

use suture_bench::generate::{Case, write};
use suture_tests::forms::{self, Form};
use suture_tests::served::jobs;
use suture_tests::{Place, stl};

/// Files there are: twice each format other than STL, and as many STL.
const FILES: usize = 4 * Form::ALL.len();

/// A small generator of numbers (xorshift).
struct Dice(u64);

impl Dice {
    fn below(&mut self, bound: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % bound.max(1) as u64) as usize
    }
}

/// A name, and a mesh after some flips, cuts, losses, doublings and insertions: in a format of its own, or an STL, binary or as text.
fn mutated(number: usize, dice: &mut Dice) -> (String, Vec<u8>) {
    let mut bytes = Vec::new();
    let case = [Case::Clean, Case::Holes, Case::Mixed, Case::Soup][dice.below(4)];
    write(case, 512, number as u64, &mut bytes).unwrap();
    let triangles: Vec<_> = stl::records(&bytes).iter().map(stl::corners).collect();
    let form = Form::ALL.get(number / 2).copied();
    match form {
        Some(form) => bytes = forms::write(form, &triangles),
        None if dice.below(3) == 0 => bytes = stl::text("part", &triangles).into_bytes(),
        None => {}
    }
    for _ in 0..=dice.below(4) {
        // Half of them near the beginning, where the counts stand.
        let reach = if dice.below(2) == 0 { bytes.len().min(100) } else { bytes.len() };
        let at = dice.below(reach);
        let end = (at + dice.below(200)).min(bytes.len());
        match dice.below(5) {
            0 => bytes.iter_mut().skip(at).take(4).for_each(|byte| *byte ^= dice.below(256) as u8),
            1 => bytes.truncate(at.max(90)),
            2 => drop(bytes.drain(at..end)),
            3 => {
                let copy = bytes[at..end].to_vec();
                bytes.splice(at..at, copy).for_each(drop);
            }
            _ => bytes.splice(at..at, vec![dice.below(256) as u8; end - at]).for_each(drop),
        }
    }
    (format!("{number}.{}", form.map_or("stl", Form::ending)), bytes)
}

/// `SUTURE_SEED` says which files.
#[test]
fn f13_mutated_meshes_end_in_their_places_and_no_worker_dies() {
    let seed = std::env::var("SUTURE_SEED").ok().and_then(|seed| seed.parse().ok()).unwrap_or(20_261_126);
    println!("SUTURE_SEED={seed}");
    let mut dice = Dice(seed | 1);
    let place = Place::new();
    let settings = "settle = \"30ms\"\nmemory = \"512MiB\"\ntime_limit = { base = \"60s\", per_gib = \"1s\" }";
    place.put("suture.toml", format!("{settings}\n[[folders]]\npath = \"hot\"\n").as_bytes());
    let dropped: Vec<(String, Vec<u8>)> = (0..FILES).map(|number| mutated(number, &mut dice)).collect();
    for (name, bytes) in &dropped {
        place.put(&format!("hot/in/{name}"), bytes);
    }
    let ran = place.suture(["watch", "--once", "--config", "suture.toml"]);
    assert!(ran.code() < 2, "{}", ran.stderr());
    assert!(!ran.stderr().contains("A worker process died"), "{}", ran.stderr());
    assert!(place.names("hot/quarantine").is_empty() && place.names("hot/in").is_empty());
    for (name, bytes) in &dropped {
        let places = ["done", "failed"].map(|part| format!("hot/{part}/{name}"));
        let there: Vec<_> = places.iter().filter(|path| place.at(path).exists()).collect();
        assert!(there.len() == 1 && place.read(there[0]) == *bytes, "{name}: {there:?}");
    }
    let all = jobs(&place, "hot");
    let ends = ["done", "failed", "needs_review"];
    assert!(all.len() == dropped.len() && all.iter().all(|job| ends.iter().any(|kind| job["kind"] == *kind)), "{all:#?}");
    assert!(all.iter().all(|job| job["attempts"] == 1 && job["blame"]["charges"] == 0), "{all:#?}");
    let out = place.names("hot/out").iter().filter(|name| !name.ends_with(".json")).count();
    assert_eq!(out, all.iter().filter(|job| job["kind"] == "done").count());
}
