//! A hot folder whose server is gone: no call there is ever answered.

use std::process::Command;

use crate::stage::{Daemon, Stage, holes, row};
use crate::world::{Mount, is_root};

/// Two hot folders, with the job store beside them.
fn watch(stage: &Stage) -> Command {
    let mut text = format!("settle = \"100ms\"\nrescan = \"1s\"\nstate = {:?}\n", stage.at("state/jobs"));
    for name in ["hot", "other"] {
        text += &format!("[[folders]]\npath = {:?}\n", stage.at(name));
    }
    stage.watch_by(&text, &[])
}

fn is_done(stage: &Stage, folder: &str, name: &str) -> bool {
    let original = stage.at(folder).join("done").join(name);
    original.exists() && stage.at(folder).join("out").join(name).exists()
}

/// Drops a file there and waits until it is done.
fn is_served(stage: &Stage, folder: &str, name: &str) {
    std::fs::write(stage.at(folder).join("in").join(name), holes(600, 1)).unwrap();
    stage.wait(&format!("{folder}/{name}"), 60, || is_done(stage, folder, name));
}

fn told(stage: &Stage, what: &str) -> usize {
    stage.log().lines().filter(|line| line.contains(what)).count()
}

/// It falls silent while it is served, and is silent when the daemon begins: the other folder is served, and itself, once it answers.
#[test]
fn f25_a_folder_that_does_not_answer_keeps_no_other_from_being_served() {
    if !is_root("a silent folder") {
        return;
    }
    let stage = Stage::new();
    let start = |silent: usize| -> Daemon<'_> {
        let daemon = stage.start(watch(&stage));
        stage.wait("the daemon to serve", 60, || told(&stage, "Serving a hot folder.") >= 2 - silent);
        daemon
    };
    let mut daemon = start(0);
    is_served(&stage, "hot", "a.stl");
    let silence = Mount::silent(&stage.at("hot"));
    is_served(&stage, "other", "b.stl");
    stage.wait("the silence to be told of", 60, || told(&stage, "does not answer") > 0);
    is_served(&stage, "other", "c.stl");
    // Whoever asks by the silent folder is told so, soon; by the other one all is known.
    let ask = |folder: &str| stage.run(["status", "--dir", stage.at(folder).to_str().unwrap()]);
    let (asked, silent) = (std::time::Instant::now(), ask("hot"));
    let said = String::from_utf8_lossy(&silent.stderr).into_owned();
    assert!(silent.status.code() == Some(75) && said.contains("does not answer") && said.lines().count() == 1, "{said}");
    assert!(asked.elapsed() < std::time::Duration::from_secs(20), "{:?}", asked.elapsed());
    assert!(String::from_utf8_lossy(&ask("other").stdout).contains("out of reach: "));
    drop(silence);
    is_served(&stage, "hot", "d.stl");
    daemon.stop();
    // It ends every process of the stage.
    drop(daemon);

    let silence = Mount::silent(&stage.at("hot"));
    std::fs::remove_file(stage.at("log")).unwrap();
    let mut daemon = start(1);
    is_served(&stage, "other", "e.stl");
    drop(silence);
    is_served(&stage, "hot", "f.stl");
    daemon.stop();
    row(
        "silent folder",
        "a mount whose server answers nothing, while it is served and at the start",
        "the other folder is served, it is back by itself",
    );
}
