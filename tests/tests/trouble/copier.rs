//! Programs that copy slowly: the final size first, half of the bytes, a long pause, the rest.

use std::fs::File;
use std::io::{Seek, SeekFrom, Write};
use std::time::Duration;

use crate::stage::{Stage, holes, row};

const SETTLE: Duration = Duration::from_millis(100);

fn slow_stage() -> Stage {
    let mut stage = Stage::new();
    stage.lines = stage.lines.replace("30ms", "100ms");
    stage
}

/// The file stays open all the time: it is not taken before it is whole.
#[test]
fn f21_pause_with_the_file_open() {
    let stage = slow_stage();
    let whole = holes(4000, 1);
    stage.expect("part.stl", &whole);
    let mut daemon = stage.serve();
    let mut file = File::create(stage.hot("in/part.stl")).unwrap();
    file.set_len(whole.len() as u64).unwrap();
    let half = whole.len() / 2;
    file.write_all(&whole[..half]).unwrap();
    std::thread::sleep(SETTLE * 15);
    assert!(stage.job("part.stl").is_none(), "it was taken half written");
    file.write_all(&whole[half..]).unwrap();
    drop(file);
    let took = stage.wait_done(30, &mut daemon);
    stage.assert_done();
    assert_eq!(stage.jobs().len(), 1);
    daemon.stop();
    row(
        "copier",
        "final size, half, open for 15 × settle, rest",
        &format!("one job, one result, of the whole, {:.1} s after", took.as_secs_f64()),
    );
}

/// The copier closes the file during the pause, and opens it by its name for the rest; if it is gone, it copies it anew.
#[test]
fn f21_pause_with_the_file_closed() {
    for cut in ["in a row of records", "at a record's end", "with half a header"] {
        let stage = slow_stage();
        let whole = holes(4000, 1);
        let half = match cut {
            "in a row of records" => whole.len() / 2 + 17,
            "at a record's end" => 84 + 50 * 2000,
            _ => 82,
        };
        let mut daemon = stage.serve();
        let path = stage.hot("in/part.stl");
        let mut file = File::create(&path).unwrap();
        file.set_len(whole.len() as u64).unwrap();
        file.write_all(&whole[..half]).unwrap();
        drop(file);
        std::thread::sleep(SETTLE * 10);
        match File::options().write(true).open(&path) {
            Ok(mut file) => {
                file.seek(SeekFrom::Start(half as u64)).unwrap();
                file.write_all(&whole[half..]).unwrap();
            }
            Err(_) => std::fs::write(&path, &whole).unwrap(),
        }
        stage.expect("part.stl", &whole);
        let took = stage.wait("the whole to be done", 40, || {
            daemon.tend();
            std::fs::read(stage.hot("out/part.stl")).is_ok_and(|there| there == crate::stage::result_of(&whole))
                && stage
                    .jobs()
                    .iter()
                    .all(|job| ["done", "failed", "needs_review", "cancelled"].iter().any(|kind| job["kind"] == *kind))
        });
        let out: Vec<_> = stage.files("out").into_keys().filter(|name| !name.ends_with(".json")).collect();
        assert_eq!(out, ["part.stl"], "the half was published as good");
        assert_eq!(stage.places("part.stl").len(), 1, "the whole is in one place");
        let half_went: Vec<_> = stage.files("failed").into_keys().filter(|name| name.ends_with(".stl")).collect();
        daemon.stop();
        row(
            "copier",
            &format!("final size, cut {cut}, closed for 10 × settle, rest"),
            &format!("out/: the whole only, {:.1} s after; failed/: {half_went:?}", took.as_secs_f64()),
        );
    }
}
