//! Whole files through [`inspect`] and [`repair`].

use std::os::unix::fs::FileExt;

use super::*;
use crate::contract::access::Access;
use crate::contract::progress::Quiet;
use crate::contract::report::{Hint, HintKind, Outcome};
use crate::engine::entry::{inspect, repair};
use crate::io::record::Record;
use crate::testing::{Corners, cube, cuboid, plate, records, shaken_torus, shifted};

fn file(records: &[Record]) -> Vec<u8> {
    [&[0; 80][..], &(records.len() as u32).to_le_bytes(), records.as_flattened()].concat()
}

/// A plate with a hole, of more than 1 MiB.
fn open_plate() -> Vec<Corners> {
    plate(110, |x, y| (x, y) != (50, 50))
}

fn text(triangles: &[Corners]) -> String {
    let vertex = |[x, y, z]: &[f32; 3]| format!("vertex {x} {y} {z}\n");
    let facet =
        |t: &Corners| format!("facet normal 0 0 1\nouter loop\n{}endloop\nendfacet\n", t.iter().map(vertex).collect::<String>());
    format!("solid part\n{}endsolid part\n", triangles.iter().map(facet).collect::<String>())
}

/// Truncates the file as soon as a stage begins.
struct Cutter<'a>(&'a Path, &'a str);

impl Progress for Cutter<'_> {
    fn at(&self, stage: &'static str, _: u64, _: u64) {
        if stage == self.1 {
            std::fs::OpenOptions::new().write(true).open(self.0).unwrap().set_len(100).unwrap();
        }
    }
}

/// Were it mapped, this test would end with SIGBUS.
#[test]
fn a_file_that_is_truncated_meanwhile_is_an_error_for_a_librarys_user() {
    let folder = tempfile::tempdir().unwrap();
    let input = folder.path().join("part.stl");
    // In memory, and in a spool.
    for memory_bytes in [1 << 30, 32 << 20] {
        for stage in ["topology", "repair", "hash"] {
            std::fs::write(&input, file(&records(&open_plate()))).unwrap();
            let limits = Limits { threads: 1, memory_bytes, ..Limits::default() };
            let output = folder.path().join(format!("{stage}-{memory_bytes}.stl"));
            let result = repair(&input, &output, &Profile::default(), &limits, &Cutter(&input, stage));
            assert!(matches!(result, Err(Error::Changed { .. })), "{stage}: {result:?}");
        }
    }
}

#[test]
fn mapped_and_copied_files_give_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let input = folder.path().join("part.stl");
    for bytes in [file(&records(&open_plate())), text(&open_plate()).into_bytes()] {
        std::fs::write(&input, bytes).unwrap();
        // SAFETY: nobody else knows this folder.
        let mapped = unsafe { Access::mapped() };
        let mut outputs = Vec::new();
        for (access, memory_bytes) in [(mapped, 1 << 30), (Access::COPIED, 1 << 30), (Access::COPIED, 32 << 20)] {
            for threads in [1, 2] {
                let limits = Limits { threads, memory_bytes, access, ..Limits::default() };
                let output = folder.path().join(format!("{}.stl", outputs.len()));
                let report = repair(&input, &output, &Profile::default(), &limits, &Quiet).unwrap();
                assert_eq!(report.input.blake3, blake3::hash(&std::fs::read(&input).unwrap()).to_hex().to_string());
                outputs.push(std::fs::read(&output).unwrap());
                std::fs::remove_file(&output).unwrap();
            }
        }
        assert!(outputs.iter().all(|output| *output == outputs[0]));
    }
}

/// The first half of a file of two bodies is closed: only the zeros behind it tell that something is missing.
#[test]
fn a_file_whose_last_records_are_zeros_is_never_good() {
    let folder = tempfile::tempdir().unwrap();
    let input = folder.path().join("part.stl");
    let (profile, limits) = (Profile::default(), Limits::default());
    let whole = records(&[cube(), shifted(&cube(), [5.0; 3])].concat());
    // The copier wrote one body, and the system filled the rest of the file with zeros.
    let binary = file(&[&whole[..12], &[[0; 50]; 12]].concat());
    let words = text(&[cube(), shifted(&cube(), [5.0; 3])].concat());
    let half = words.match_indices("facet normal").nth(12).unwrap().0;
    let text = [&words.as_bytes()[..half], &vec![0; words.len() - half]].concat();
    for (bytes, said) in
        [(binary, "its last 12 of 24 records are zeros"), (text, "bytes are zeros, as in a file that was cut off")]
    {
        std::fs::write(&input, bytes).unwrap();
        let inspected = inspect(&input, &profile, &limits, &Quiet).unwrap();
        assert_eq!(inspected.outcome, Outcome::NotGood);
        let told: Vec<_> = inspected.verdict.reasons.iter().map(|reason| reason.contains(said)).collect();
        assert!(told[0] && told.iter().filter(|told| **told).count() == 1, "first, and once: {:?}", inspected.verdict);
        assert!(inspected.verdict.reasons[0].starts_with("a part is missing: "), "{:?}", inspected.verdict);
        let output = folder.path().join(&said[..9]);
        let repaired = repair(&input, &output, &profile, &limits, &Quiet).unwrap();
        assert_eq!((repaired.outcome, repaired.verdict.good), (Outcome::NeedsReview, true), "the half itself is closed");
        assert!(repaired.verdict.reasons.iter().any(|r| r.starts_with("a part is missing") && r.contains(said)), "{repaired:?}");
    }
}

#[test]
fn a_few_zero_records_are_an_exporters() {
    let folder = tempfile::tempdir().unwrap();
    let (input, output) = (folder.path().join("part.stl"), folder.path().join("out.stl"));
    std::fs::write(&input, file(&[&records(&cube())[..], &[[0; 50]; 7]].concat())).unwrap();
    let repaired = repair(&input, &output, &Profile::default(), &Limits::default(), &Quiet).unwrap();
    assert_eq!((repaired.outcome, repaired.input.findings.len()), (Outcome::Repaired, 0));
}

/// Changes a byte of the file as soon as a stage begins.
struct Meddler<'a> {
    file: &'a Path,
    stage: &'a str,
}

impl Progress for Meddler<'_> {
    fn at(&self, stage: &'static str, _: u64, _: u64) {
        if stage == self.stage {
            let file = std::fs::OpenOptions::new().write(true).open(self.file).unwrap();
            file.write_all_at(&[7], (PREFIX_BYTES + 50 * 12_345 + 49) as u64).unwrap();
        }
    }
}

/// The plate is large enough for two threads to copy it ahead.
#[test]
fn an_input_that_changes_is_said_to_have_changed() {
    let folder = tempfile::tempdir().unwrap();
    let input = folder.path().join("part.stl");
    let bytes = file(&records(&open_plate()));
    for threads in [1, 2] {
        for stage in ["topology", "repair", "hash"] {
            std::fs::write(&input, &bytes).unwrap();
            // The clock of the file system is coarse.
            std::thread::sleep(std::time::Duration::from_millis(20));
            let limits = Limits { threads, ..Limits::default() };
            let output = folder.path().join(format!("{stage}-{threads}.stl"));
            let result = repair(&input, &output, &Profile::default(), &limits, &Meddler { file: &input, stage });
            assert!(matches!(result, Err(Error::Changed { .. })), "{threads} threads, {stage}: {result:?}");
        }
    }
}

/// Triangles that share no vertex: what is kept of their edges is far more than what is kept of the triangles.
#[test]
fn the_edges_of_a_soup_are_counted_before_they_are_compared() {
    let folder = tempfile::tempdir().unwrap();
    let input = folder.path().join("soup.stl");
    let apart = |i: u16| [i % 100, i / 100, i % 7].map(|x| f32::from(x) * 3.0);
    let soup: Vec<Corners> = (0..10_000).flat_map(|i| shifted(&cube()[..1], apart(i))).collect();
    std::fs::write(&input, file(&records(&soup))).unwrap();
    let inspected = |memory_bytes| {
        let limits = Limits { threads: 1, memory_bytes, chunk_triangles: 1024, ..Limits::default() };
        inspect(&input, &Profile::default(), &limits, &Quiet)
    };
    assert_eq!(inspected(64 << 20).unwrap().before.boundary_edges, 30_000);
    // 30,000 edges of 352 bytes are 10 MiB; what is kept of the triangles is 2 MiB.
    let error = inspected(12 << 20).unwrap_err();
    assert!(matches!(error, Error::Starved { .. }), "{error}");
    assert!(
        error.to_string().contains("10 000 triangles lie at defects, with 30 000 edges that only one triangle has"),
        "{error}"
    );
}

/// As one facet after the other is exported by programs that transform each for itself.
#[test]
fn a_file_that_shares_no_position_is_welded_in_the_stream() {
    let folder = tempfile::tempdir().unwrap();
    let input = folder.path().join("part.stl");
    let mut torus = records(&shaken_torus(1e-4));
    let n = torus.len() as u64;
    torus.remove(1000);
    for mesh in [file(&torus), text(&torus.iter().map(crate::io::record::corners).collect::<Vec<_>>()).into_bytes()] {
        std::fs::write(&input, mesh).unwrap();
        let mut outputs = Vec::new();
        for (threads, chunk_triangles) in [(1, 1 << 20), (2, 5000)] {
            let limits = Limits { threads, chunk_triangles, ..Limits::default() };
            let output = folder.path().join(format!("{chunk_triangles}.stl"));
            let report = repair(&input, &output, &Profile::default(), &limits, &Quiet).unwrap();
            assert_eq!(report.outcome, Outcome::Repaired, "{:?}", report.verdict);
            assert_eq!(report.input.blake3, blake3::hash(&std::fs::read(&input).unwrap()).to_hex().to_string());
            let (before, after) = (&report.before, report.after.as_ref().unwrap());
            assert_eq!((before.triangles, before.boundary_edges, before.vertices), (n - 1, 3 * (n - 1), 3 * (n - 1)));
            assert!(before.at_least.iter().any(|name| name == "components"));
            assert_eq!((after.triangles, after.vertices, after.components, after.euler), (n, n / 2, 1, Some(0)));
            let weld = report.repairs.iter().find(|repair| repair.name.as_str() == "tolerance_weld").unwrap();
            // The hole's three corners have one triangle less.
            assert_eq!(weld.count, 3 * (n - 1) - n / 2);
            let edit = &report.edit;
            assert_eq!((edit.deleted, edit.added, edit.untouched + edit.moved), (0, 1, n - 1));
            assert!(edit.max_move > 1e-4 && edit.max_move < 4e-4, "{edit:?}");
            outputs.push(std::fs::read(&output).unwrap());
        }
        assert!(outputs[0] == outputs[1], "the same bytes for all chunks and threads");
        std::fs::remove_file(folder.path().join("5000.stl")).unwrap();
        std::fs::remove_file(folder.path().join("1048576.stl")).unwrap();
    }
}

/// Each body of a file is drawn twice, and a third of its triangles faces the wrong way: nothing of it is regular.
#[test]
fn what_is_drawn_twice_and_faces_here_and_there_is_set_right_in_the_stream() {
    let folder = tempfile::tempdir().unwrap();
    let (input, output) = (folder.path().join("part.stl"), folder.path().join("out.stl"));
    let mut torus = shaken_torus(0.0);
    let n = torus.len() as u64;
    torus.remove(1000);
    let is_wrong = |i: usize| crate::util::scatter::share(i as u64) < 1.0 / 3.0;
    let wrong = (0..torus.len()).filter(|i| is_wrong(*i)).count() as u64;
    torus.iter_mut().enumerate().filter(|(i, _)| is_wrong(*i)).for_each(|(_, corners)| corners.swap(1, 2));
    let twice = records(&[&torus[..], &torus].concat());
    std::fs::write(&input, file(&twice)).unwrap();
    let mut outputs = Vec::new();
    // 270,000 triangles of 288 bytes would be 74 MiB.
    for (threads, chunk_triangles, memory_bytes) in [(1, 1 << 15, 60 << 20), (2, 5000, 1 << 30)] {
        let limits = Limits { threads, chunk_triangles, memory_bytes, list_edit: true, ..Limits::default() };
        let report = repair(&input, &output, &Profile::default(), &limits, &Quiet).unwrap();
        assert_eq!(report.outcome, Outcome::Repaired, "{:?}", report.verdict);
        let (before, after) = (&report.before, report.after.as_ref().unwrap());
        assert_eq!((before.triangles, before.duplicates_same), (2 * (n - 1), n - 1));
        assert!(before.inconsistent_edges > n / 2 && before.at_least.iter().any(|name| name == "nonmanifold_edges"));
        assert_eq!((after.triangles, after.components, after.euler), (n, 1, Some(0)));
        let count = |name: &str| report.repairs.iter().find(|repair| repair.name.as_str() == name).map(|repair| repair.count);
        assert_eq!((count("duplicate"), count("orient")), (Some(n - 1), Some(wrong)));
        let edit = &report.edit;
        assert_eq!((edit.untouched, edit.flipped, edit.deleted, edit.added), (n - 1 - wrong, wrong, n - 1, 1));
        let listed = report.edit_records.as_ref().unwrap();
        assert_eq!(listed.deleted, [[n as u32 - 1, 2 * n as u32 - 3]]);
        let flipped: u64 = listed.flipped.iter().map(|[first, last]| u64::from(last - first) + 1).sum();
        assert_eq!(flipped, wrong);
        outputs.push(std::fs::read(&output).unwrap());
        std::fs::remove_file(&output).unwrap();
    }
    assert!(outputs[0] == outputs[1], "the same bytes for all chunks and threads");
    // What faced the right way stands where it stood.
    let kept = outputs[0][84..].as_chunks::<50>().0.iter().zip(&twice).filter(|(after, before)| after == before).count() as u64;
    assert_eq!(kept, n - 1 - wrong);
}

/// Which way a body in the material of another one faces is told by most of its triangles; where the others are many, it is taken for a cavity, and a
/// person is told. What the stream has turned counts as what the repairs turn.
#[test]
fn what_was_turned_in_the_stream_still_says_little_of_a_body_in_another_one() {
    let folder = tempfile::tempdir().unwrap();
    let (input, output) = (folder.path().join("part.stl"), folder.path().join("out.stl"));
    for (share, outcome) in [(0.3, Outcome::NeedsReview), (0.7, Outcome::Repaired)] {
        let mut torus = shaken_torus(0.0);
        let is_wrong = |i: usize| crate::util::scatter::share(i as u64) < share;
        torus.iter_mut().enumerate().filter(|(i, _)| is_wrong(*i)).for_each(|(_, corners)| corners.swap(1, 2));
        std::fs::write(&input, file(&records(&[cuboid([-50.0; 3], [50.0; 3]), torus].concat()))).unwrap();
        let report = repair(&input, &output, &Profile::default(), &Limits::default(), &Quiet).unwrap();
        assert_eq!(report.outcome, outcome, "{:?}", report.verdict);
        let volume = report.after.unwrap().volume;
        assert!(volume < 0.98 * 1e6, "the torus is a cavity: {volume}");
        std::fs::remove_file(&output).unwrap();
    }
}

/// The file `part.stl` in a folder, repaired into `out.stl` under a profile that comes with the product.
fn under(name: &str, bytes: &[u8]) -> (tempfile::TempDir, Report) {
    let folder = tempfile::tempdir().unwrap();
    let (input, output) = (folder.path().join("part.stl"), folder.path().join("out.stl"));
    std::fs::write(&input, bytes).unwrap();
    let limits = Limits { threads: 2, ..Limits::default() };
    let profile = Profile::built_in(name).unwrap();
    let report = repair(&input, &output, &profile, &limits, &Quiet).unwrap();
    (folder, report)
}

/// A torus in which so many cells of the surface are missing along either way.
fn torn_torus(cells: usize) -> Vec<u8> {
    let torus = shaken_torus(0.0).into_iter().enumerate();
    file(&records(&torus.filter(|(t, _)| t / 2 / 176 >= cells || t / 2 % 176 >= cells).map(|(_, t)| t).collect::<Vec<_>>()))
}

/// What is good is passed on byte for byte; of anything else nothing is written, not even where a large file could be copied ahead.
#[test]
fn a_profile_that_repairs_nothing_passes_on_or_leaves() {
    for bytes in [file(&records(&cube())), torn_torus(0), text(&cube()).into_bytes()] {
        let (folder, report) = under("inspect-only", &bytes);
        assert_eq!(report.outcome, Outcome::Clean, "{:?}", report.verdict);
        assert_eq!(std::fs::read(folder.path().join("out.stl")).unwrap(), bytes);
        let hash = blake3::hash(&bytes).to_hex().to_string();
        let output = report.output.unwrap();
        assert_eq!([&report.input.blake3, &output.blake3, &report.certificate.unwrap().blake3], [&hash; 3]);
        assert_eq!((report.edit.untouched, report.edit.added), (report.input.triangles, 0));
    }
    let nested = [cube(), cuboid([0.25; 3], [0.75; 3])].concat();
    assert_eq!(under("inspect-only", &file(&records(&nested))).1.outcome, Outcome::Clean, "no body is removed");
    let mut shorn = file(&records(&cube()));
    shorn.truncate(84 + 50 * 11);
    for bytes in [file(&records(&cube()[1..])), torn_torus(2), file(&records(&shaken_torus(1e-4)[..20_000])), shorn] {
        let (folder, report) = under("inspect-only", &bytes);
        assert_eq!((report.outcome, report.output.is_none(), report.repairs.len()), (Outcome::NotGood, true, 0));
        assert!(!folder.path().join("out.stl").exists());
        assert_eq!(report.input.blake3, blake3::hash(&bytes).to_hex().to_string());
        let last = report.verdict.reasons.last().unwrap();
        assert!(last.contains("nothing was repaired") && last.contains("inspect-only"), "{last}");
        assert!(report.verdict.reasons.len() > 1 && !report.certificate.unwrap().printable, "it says what is wrong");
    }
}

#[test]
fn the_fast_profile_leaves_the_search_and_the_shaping_out() {
    let (_folder, report) = under("fast", &torn_torus(8));
    assert_eq!((report.outcome, report.verdict.free_of_self_intersection), (Outcome::Repaired, None));
    assert_eq!(report.verdict.unchecked, ["self-intersection"]);
    let after = report.after.unwrap();
    assert_eq!((after.boundary_edges, after.vertices), (0, report.before.vertices), "patches have no vertices of their own");
    assert!(under("default", &torn_torus(8)).1.after.unwrap().vertices > report.before.vertices);
}

#[test]
fn the_strict_profile_mends_what_is_small_and_leaves_the_rest_to_a_person() {
    let (_folder, small) = under("strict", &torn_torus(2));
    assert_eq!(small.outcome, Outcome::Repaired, "{:?}", small.verdict);
    let (_folder, large) = under("strict", &torn_torus(40));
    assert!(!large.outcome.is_good(), "{:?}", large.verdict);
    assert!(under("default", &torn_torus(40)).1.verdict.good, "another profile closes it");
}

/// A plate of half a unit, in two files: as it is, and without one of its triangles.
#[test]
fn walls_are_looked_at_in_the_result() {
    let folder = tempfile::tempdir().unwrap();
    let [input, output] = ["part.stl", "out.stl"].map(|name| folder.path().join(name));
    let plate = cuboid([0.0; 3], [40.0, 30.0, 0.5]);
    let asked = Profile { thin_wall_mm: 0.8, ..Profile::default() };
    let is_of_walls = |hint: &Hint| hint.kind == HintKind::ThinWalls;
    for triangles in [&plate[..], &plate[1..]] {
        std::fs::write(&input, file(&records(triangles))).unwrap();
        let repaired = |profile: &Profile| {
            let report = repair(&input, &output, profile, &Limits::default(), &Quiet).unwrap();
            let bytes = std::fs::read(&output).unwrap();
            std::fs::remove_file(&output).unwrap();
            (report, bytes)
        };
        let (report, bytes) = repaired(&asked);
        let walls = report.thin_walls.unwrap();
        assert!(walls.share > 0.9 && (walls.places[0].thickness - 0.5).abs() < 1e-6, "{walls:?}");
        assert!(report.hints.iter().any(is_of_walls) && report.verdict.good);
        let (unasked, same) = repaired(&Profile::default());
        assert!(bytes == same && unasked.thin_walls.is_none() && !unasked.hints.iter().any(is_of_walls));
        assert_eq!(unasked.outcome, report.outcome, "a hint changes nothing");
    }
    // Looked at as it is, the second one is open.
    let report = inspect(&input, &asked, &Limits::default(), &Quiet).unwrap();
    let told: Vec<&str> = report.hints.iter().filter(|hint| is_of_walls(hint)).map(|hint| hint.text.as_str()).collect();
    assert!(report.thin_walls.is_none() && told.len() == 1 && told[0].contains("not looked for"), "{told:?}");
}

/// Told to end when it begins with walls.
#[test]
fn who_looks_at_walls_can_be_told_to_end() {
    struct Ends(std::sync::atomic::AtomicBool);
    impl Progress for Ends {
        fn at(&self, stage: &'static str, _: u64, _: u64) {
            self.0.fetch_or(stage == "walls", std::sync::atomic::Ordering::Relaxed);
        }
        fn cancelled(&self) -> bool {
            self.0.load(std::sync::atomic::Ordering::Relaxed)
        }
    }
    let folder = tempfile::tempdir().unwrap();
    let input = folder.path().join("part.stl");
    std::fs::write(&input, file(&records(&cube()))).unwrap();
    let asked = Profile { thin_wall_mm: 0.8, ..Profile::default() };
    let error = inspect(&input, &asked, &Limits::default(), &Ends(false.into())).unwrap_err();
    assert!(error.is_cancellation(), "{error}");
}
