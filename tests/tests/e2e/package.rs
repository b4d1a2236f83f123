//! The Debian package, as `packaging/build-deb` makes it, and what lies beside it. Where there is no `dpkg-deb`, there is nothing to be looked at.

use std::path::{Path, PathBuf};
use std::process::Command;

use suture_tests::Place;
use suture_tests::binary::suture;
use suture_tests::http::Client;
use suture_tests::served::Served;

fn packaging() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../packaging")
}

/// What a program says on standard output, if it is there and succeeds.
fn said(program: &str, arguments: &[&str]) -> Option<String> {
    let output = Command::new(program).args(arguments).output().ok()?;
    assert!(output.status.success(), "{program} {arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    Some(String::from_utf8_lossy(&output.stdout).into_owned())
}

/// Values of a setting in a unit.
fn values<'a>(unit: &'a str, setting: &str) -> Vec<&'a str> {
    unit.lines().filter_map(|line| line.strip_prefix(setting)?.strip_prefix('=')).collect()
}

#[test]
fn a_package_has_all_that_a_service_needs() {
    if Command::new("dpkg-deb").arg("--version").output().is_err() {
        eprintln!("no dpkg-deb here");
        return;
    }
    let place = Place::new();
    let made = Command::new(packaging().join("build-deb")).arg(place.at("made")).env("SUTURE_BINARY", suture()).output().unwrap();
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    let package = String::from_utf8(made.stdout).unwrap().trim().to_owned();
    let tree = place.at("tree");
    said("dpkg-deb", &["-x", &package, tree.to_str().unwrap()]).unwrap();
    let names = place.names("tree");
    let pages: Vec<_> = names.iter().filter(|name| name.starts_with("usr/share/man/man1/suture")).collect();
    assert!(pages.len() > 20, "{names:?}");
    for name in [
        "usr/bin/suture",
        "usr/lib/systemd/system/suture.service",
        "usr/lib/sysusers.d/suture.conf",
        "usr/lib/tmpfiles.d/suture.conf",
        "usr/share/man/man1/suture.1.gz",
        "usr/share/man/man1/suture-jobs-retry.1.gz",
        "usr/share/bash-completion/completions/suture",
        "usr/share/zsh/vendor-completions/_suture",
        "usr/share/fish/vendor_completions.d/suture.fish",
        "usr/share/doc/suture/copyright",
        "usr/share/doc/suture/README.md",
        "etc/suture/suture.toml",
    ] {
        assert!(names.iter().any(|there| there == name), "{name}: {names:?}");
    }
    // The program that was packed takes the configuration that was packed.
    let packed = place
        .command_of(&tree.join("usr/bin/suture"))
        .args(["config", "check"])
        .arg(tree.join("etc/suture/suture.toml"))
        .output();
    let packed = packed.unwrap();
    assert!(packed.status.success(), "{}", String::from_utf8_lossy(&packed.stderr));
    // Nothing of it belongs to whoever built it, and what people change is kept.
    let list = said("dpkg-deb", &["-c", &package]).unwrap();
    assert!(list.lines().all(|line| line.contains(" root/root ")), "{list}");
    said("dpkg-deb", &["-e", &package, place.at("control").to_str().unwrap()]).unwrap();
    assert_eq!(place.read("control/conffiles"), b"/etc/suture/suture.toml\n");
    for script in ["postinst", "prerm", "postrm"] {
        said("sh", &["-n", place.at("control").join(script).to_str().unwrap()]).unwrap();
    }
}

#[test]
fn the_unit_lets_the_daemon_write_where_its_configuration_says_and_nowhere_else() {
    let unit = std::fs::read_to_string(packaging().join("suture.service")).unwrap();
    let config: String = std::fs::read_to_string(packaging().join("suture.toml")).unwrap();
    let paths: Vec<&str> =
        config.lines().filter_map(|line| line.strip_prefix("path = ").or_else(|| line.strip_prefix("state = "))).collect();
    let writable = values(&unit, "ReadWritePaths");
    assert_eq!((values(&unit, "StateDirectory"), values(&unit, "ProtectSystem")), (vec!["suture"], vec!["strict"]));
    assert_eq!(paths, ["\"/var/lib/suture/jobs\"", "\"/srv/suture\""]);
    assert_eq!(writable, ["/srv/suture"], "its state is in the StateDirectory");
    let folders = std::fs::read_to_string(packaging().join("suture.tmpfiles")).unwrap();
    assert!(folders.lines().any(|line| line.starts_with("d /srv/suture ")), "{folders}");
    let user = std::fs::read_to_string(packaging().join("suture.sysusers")).unwrap();
    assert!(user.starts_with(&format!("u {} ", values(&unit, "User").join(" "))), "{user}");
    for (setting, value) in [("Type", "notify"), ("NoNewPrivileges", "yes"), ("CapabilityBoundingSet", ""), ("KillMode", "mixed")]
    {
        assert_eq!(values(&unit, setting), [value], "{setting}");
    }
    // A bare system has a shell and systemd, but no procps, so no `/bin/kill`.
    for program in ["ExecStart", "ExecStartPre", "ExecReload"].iter().flat_map(|setting| values(&unit, setting)) {
        assert!(["/usr/bin/suture ", "/bin/sh "].iter().any(|there| program.starts_with(there)), "{program}");
    }
    assert!(!values(&unit, "WatchdogSec").is_empty() && !values(&unit, "MemoryMax").is_empty());
}

/// What each container is told is taken by the program, as far as it can be tried without one. (That it can be built and run was tried by hand: see
/// the README.)
#[test]
fn the_configuration_of_containers_is_taken() {
    let place = Place::new();
    let file = packaging().join("container.toml");
    place.suture(["config", "check", file.to_str().unwrap()]).expect(0);
    let container = std::fs::read_to_string(packaging().join("Containerfile")).unwrap();
    let last = container.rsplit("\nFROM ").next().unwrap();
    let user = last.lines().find_map(|line| line.strip_prefix("USER ")).unwrap();
    assert!(!user.starts_with('0') && !user.starts_with("root"), "{user}");
    let words_of = |line: &str| -> Vec<String> {
        let words = line.split_once('[').unwrap().1.trim_end_matches(']');
        serde_json::from_str(&format!("[{words}]")).unwrap()
    };
    let program = words_of(last.lines().find(|line| line.starts_with("ENTRYPOINT [")).unwrap());
    for line in last.lines().filter(|line| line.starts_with("CMD [") || line.starts_with("HEALTHCHECK")) {
        let mut words = words_of(line);
        words.retain(|word| *word != program[0]);
        let helped = place.suture(words.iter().map(String::as_str).chain(["--help"]));
        assert_eq!(helped.code(), 0, "{words:?}: {}", helped.stderr());
    }
    // The image is empty but for what is put there: nothing runs in it that needs a shell, a library, or a folder that is not there.
    let (build, [program]) = (container.strip_suffix(last).unwrap(), &program[..]) else { panic!("{program:?}") };
    assert!(last.starts_with("scratch\n") && !last.contains("\nRUN "), "{last}");
    for there in
        [&format!(" /image{program} "), "+crt-static", "/usr/share/zoneinfo /image/usr/share/", " --mode=1777 /image/tmp "]
    {
        assert!(build.contains(there), "{there}");
    }
    // What builds it is what the sources are written for, and its context has what is copied.
    let toolchain = std::fs::read_to_string(packaging().join("../rust-toolchain.toml")).unwrap();
    let channel = toolchain.lines().find_map(|line| line.strip_prefix("channel = \"")?.strip_suffix('"')).unwrap();
    assert!(build.contains(&format!("/rust:{channel}-slim-")), "{channel}");
    let left_out = std::fs::read_to_string(packaging().join("../.dockerignore")).unwrap();
    for name in build.split_whitespace().filter(|word| word.starts_with("LICENSE") || word.ends_with(".md")) {
        assert!(packaging().join("..").join(name).exists() && !left_out.contains(name), "{name}");
    }
    let compose = std::fs::read_to_string(packaging().join("compose.yaml")).unwrap();
    for words in ["read_only: true", "- /tmp", "TZ: ", "cap_drop: [ALL]", "no-new-privileges:true", "127.0.0.1:7878:7878"] {
        assert!(compose.contains(words), "{words}");
    }
}

/// The values between quotes in a list of one line: `command: ["watch", "--role", "worker"]`.
fn list_of(line: &str) -> Vec<String> {
    serde_json::from_str(&line[line.find('[').unwrap()..]).unwrap_or_else(|error| panic!("{line}: {error}"))
}

/// All that the parts of a farm in containers are told is taken by the program, as far as it can be tried without one: each role is there, and what one names the
/// other has. What autoscaling asks for is told by a daemon.
#[test]
fn the_configuration_of_a_farm_is_taken() {
    let place = Place::new();
    let read = |name: &str| std::fs::read_to_string(packaging().join(name)).unwrap();
    let (compose, config, keda) = (read("farm/compose.yaml"), read("farm/farm.toml"), read("farm/keda.yaml"));
    place.suture(["config", "check", packaging().join("farm/farm.toml").to_str().unwrap()]).expect(0);
    let value = |key: &str| {
        let line = config.lines().find_map(|line| line.strip_prefix(key)?.strip_prefix(" = \"")).unwrap();
        line.split('"').next().unwrap()
    };
    let mut roles = Vec::new();
    for line in compose
        .lines()
        .map(str::trim)
        .filter(|line| line.starts_with("command: [\"watch\"") || line.starts_with("command: [\"store\""))
    {
        let words = list_of(line);
        let after = |flag: &str| words.iter().position(|word| word == flag).map(|at| words[at + 1].as_str());
        let helped = place.suture(words.iter().map(String::as_str).chain(["--help"]));
        assert_eq!(helped.code(), 0, "{words:?}: {}", helped.stderr());
        match words[0].as_str() {
            "store" => assert_eq!(after("--store"), Some(value("store"))),
            _ => assert!(compose.contains(&format!("- ./farm.toml:{}:ro", after("--config").unwrap()))),
        }
        roles.extend(after("--role").map(str::to_owned));
    }
    assert_eq!(roles, ["intake", "worker", "control"]);
    assert!(compose.contains(&format!("- ./tokens:{}:ro", value("token_file"))));
    // The health check asks the daemon where it has its scratch, on a volume of its own.
    let health = list_of(compose.lines().find(|line| line.contains("\"--ready\"")).unwrap());
    assert_eq!(health.last().unwrap(), &format!("{}/buckets/{}", value("state"), value("name")));
    assert!(compose.contains("    - /prints #") && value("state").starts_with("/prints/"));
    // The object store is the one that the tests run on.
    let version = compose.lines().find_map(|line| line.trim().strip_prefix("image: docker.io/motoserver/moto:")).unwrap();
    let installed = std::fs::read_to_string(packaging().join("../.ci/run")).unwrap();
    assert!(installed.contains(&format!("moto[server]=={version}'")), "{version}");
    let daemon = Served::start(&place, &["hot", "--listen", "127.0.0.1:0"], "log");
    let metrics = String::from_utf8(Client::of(&daemon).get("/metrics").expect(200).body).unwrap();
    let asked: Vec<&str> = keda.split("max(").skip(1).map(|rest| rest.split(')').next().unwrap()).collect();
    assert_eq!(asked.len(), 3, "{asked:?}");
    for metric in asked {
        assert!(metrics.lines().any(|line| line.starts_with(&format!("{metric} "))), "{metric}: {metrics}");
    }
}
