//! Settings that cannot be meant are refused before anything is touched.

use std::process::Output;

use crate::stage::{Stage, row};

fn watch(stage: &Stage, text: &str) -> Output {
    let file = stage.at("refused.toml");
    std::fs::write(&file, text).unwrap();
    stage.run(["watch".as_ref(), "--once".as_ref(), "--config".as_ref(), file.as_os_str()])
}

#[test]
fn overlapping_folders_and_too_little_memory() {
    let stage = Stage::new();
    std::os::unix::fs::symlink("hot", stage.at("link")).unwrap();
    let two = |a: &str, b: &str| format!("[[folders]]\npath = \"{a}\"\n[[folders]]\npath = \"{b}\"\nname = \"other\"\n");
    let tried = [
        ("same folder", two("hot", "./hot")),
        ("same folder by a link", two("hot", "link")),
        ("one inside of another", two("hot", "hot/in/inner")),
        ("one inside of another, the other way round", two("hot/in/../out", "hot")),
        ("memory 1KiB", "memory = \"1KiB\"\n[[folders]]\npath = \"hot\"\n".to_owned()),
    ];
    for (what, text) in tried {
        let ran = watch(&stage, &text);
        let said = String::from_utf8_lossy(&ran.stderr).trim().to_owned();
        assert_eq!(ran.status.code(), Some(2), "{what}: {said}");
        assert_eq!(said.lines().count(), 1, "{what}: {said}");
        let made: Vec<_> =
            ["hot/out", "hot/.suture", "hot/in/inner"].into_iter().filter(|path| stage.at(path).exists()).collect();
        assert!(made.is_empty(), "{what}: {made:?}");
        row("refused", what, &format!("code 2: {}", said.replace(stage.at("").to_str().unwrap(), "")));
    }
}
