//! What `repair` and `inspect` do with files as files: codes, names, what passes through, what is never touched.

use std::time::Duration;

use suture_bench::generate::Case;
use suture_bench::judge::judge;
use suture_tests::{Place, Ran, stl};

/// Exit code 2 and one line of complaint, which holds these words.
fn assert_refused(ran: &Ran, words: &[&str]) {
    let line = ran.stderr();
    assert_eq!(ran.code(), 2, "{line}");
    assert!(line.ends_with('\n') && line.lines().count() == 1, "not one line: {line:?}");
    for word in words {
        assert!(line.contains(word), "{line:?} does not say {word:?}");
    }
}

#[test]
fn clean_file_is_copied_byte_for_byte() {
    let place = Place::new();
    let (input, _) = place.generate(Case::Clean, 2_000, 1);
    let report = place.repair("clean.stl", "out.stl", &[]).expect(0).report();
    assert_eq!(place.read("out.stl"), std::fs::read(input).unwrap());
    assert_eq!(report["outcome"], "clean");
    assert_eq!(report["output"]["blake3"], report["input"]["blake3"]);
    assert_eq!(report["edit"]["untouched"], report["input"]["triangles"]);
}

#[test]
fn inspect_writes_nothing_and_tells_good_from_bad() {
    let place = Place::new();
    place.generate(Case::Clean, 600, 1);
    place.generate(Case::Holes, 600, 1);
    let before = place.names("");
    let report = place.inspect("clean.stl", &[]).expect(0).report();
    assert_eq!((&report["task"], &report["outcome"]), (&"inspect".into(), &"clean".into()));
    let report = place.inspect("holes.stl", &[]).expect(1).report();
    assert_eq!((&report["outcome"], &report["verdict"]["closed"]), (&"not_good".into(), &false.into()));
    assert!(report["output"].is_null() && report["after"].is_null());
    assert_eq!(place.names(""), before);
}

#[test]
fn a_search_that_is_not_wanted_is_called_unchecked() {
    let place = Place::new();
    place.generate(Case::Clean, 600, 1);
    place.put("fast.toml", b"check_self_intersections = false\n");
    for options in [&["--no-self-intersections"][..], &["--profile", "fast.toml"]] {
        let inspected = place.inspect("clean.stl", options).expect(0).report();
        let repaired = place.repair("clean.stl", "out.stl", &[options, &["--force"]].concat()).expect(0).report();
        for report in [inspected, repaired] {
            assert_eq!(report["profile"]["check_self_intersections"], false);
            assert_eq!(report["verdict"]["unchecked"], serde_json::json!(["self-intersection"]));
            assert!(report["verdict"]["statement"].as_str().unwrap().ends_with("self-intersection unchecked"));
        }
    }
}

/// The certificate of a result holds as long as its bytes do, and certifies nothing that was not looked at.
#[test]
fn a_certificate_can_be_checked_later() {
    let place = Place::new();
    place.generate(Case::Holes, 600, 1);
    let check = ["inspect", "out.stl", "--certificate", "report.json"];
    place.repair("holes.stl", "out.stl", &["--report", "report.json", "--no-self-intersections"]).expect(0);
    assert!(place.suture(check).expect(1).stdout().contains("not certified: 14 of 15 rules passed"));
    place.repair("holes.stl", "out.stl", &["--report", "report.json", "--force"]).expect(0);
    let said = place.suture(check).expect(0).stdout();
    assert!(said.starts_with("out.stl: the certificate holds: printable, 15 of 15") && said.lines().count() == 1, "{said}");
    let mut bytes = place.read("out.stl");
    bytes[84 + 50 * 7 + 48] ^= 1;
    place.put("out.stl", &bytes);
    assert!(place.suture(check).expect(1).stdout().contains("does not hold: these are not the bytes"));
    place.suture(["inspect", "out.stl", "--certificate", "holes.stl"]).expect(2);
    place.suture(["inspect", "out.stl", "holes.stl", "--certificate", "report.json"]).expect(2);
}

/// The second half is of the original: that is repaired anew, and nothing else gives the same.
#[test]
fn the_original_shows_whether_a_result_is_faithful() {
    let place = Place::new();
    place.generate(Case::Holes, 600, 1);
    place.generate(Case::Flipped, 600, 1);
    place.repair("holes.stl", "out.stl", &["--report", "report.json"]).expect(0);
    let report: serde_json::Value = serde_json::from_slice(&place.read("report.json")).unwrap();
    let half = &report["certificate"]["faithful"];
    assert_eq!(half["original"], report["input"]["blake3"]);
    assert!(half["rules"].as_array().unwrap().iter().any(|rule| rule["rule"] == "skin_lost" && rule["figure"] == 0.0), "{half}");
    let check = |original| place.suture(["inspect", "out.stl", "--certificate", "report.json", "--original", original]);
    let said = check("holes.stl").expect(0).stdout();
    assert!(said.lines().count() == 2 && said.contains("holes.stl: repaired anew, it gives the same bytes: faithful"), "{said}");
    assert!(check("flipped.stl").expect(1).stdout().contains("it does not give what the certificate says"));
    place.suture(["inspect", "out.stl", "--original", "holes.stl"]).expect(2);
    // A figure that somebody has made smaller.
    let told = place.read("report.json");
    let told = String::from_utf8(told).unwrap().replacen("\"limit\":0.0005", "\"limit\":0.0007", 1);
    let told = told.replacen("\"limit\": 0.0005", "\"limit\": 0.0007", 1);
    place.put("report.json", told.as_bytes());
    assert!(check("holes.stl").expect(1).stdout().contains("passed with 0 of 0.0005, not passed with 0 of 0.0007"));
    assert_eq!(place.names(""), ["flipped.stl", "holes.stl", "out.stl", "report.json"], "nothing temporary is left");
}

#[test]
fn without_json_a_table_is_printed() {
    let place = Place::new();
    place.generate(Case::Holes, 600, 1);
    let table = place.suture(["inspect", "holes.stl"]).expect(1).stdout();
    assert!(table.contains("holes.stl") && table.contains("boundary"), "{table}");
    assert!(serde_json::from_str::<serde_json::Value>(&table).is_err());
}

#[test]
fn input_keeps_its_bytes_and_its_times() {
    let place = Place::new();
    let (input, _) = place.generate(Case::Mixed, 6_000, 1);
    let long_ago = std::time::SystemTime::UNIX_EPOCH + Duration::from_secs(1_000_000_000);
    std::fs::File::options().write(true).open(&input).unwrap().set_modified(long_ago).unwrap();
    let before = std::fs::read(&input).unwrap();
    assert!(place.repair("mixed.stl", "out.stl", &[]).code() < 2);
    place.inspect("mixed.stl", &[]).expect(1);
    assert_eq!(std::fs::read(&input).unwrap(), before);
    assert_eq!(std::fs::metadata(&input).unwrap().modified().unwrap(), long_ago);
    assert_eq!(place.names(""), ["mixed.stl", "out.stl"], "nothing temporary is left");
}

#[test]
fn nothing_is_overwritten() {
    let place = Place::new();
    let (input, _) = place.generate(Case::Holes, 600, 1);
    let before = std::fs::read(&input).unwrap();
    place.put("out.stl", b"mine");
    place.put("report.json", b"mine, too");
    assert_refused(&place.repair("holes.stl", "out.stl", &[]), &["out.stl", "exists"]);
    assert_refused(
        &place.suture(["repair", "holes.stl", "-o", "new.stl", "--report", "report.json"]),
        &["report.json", "exists"],
    );
    assert_refused(&place.suture(["repair", "holes.stl", "-o", "holes.stl", "--force"]), &["holes.stl", "never"]);
    std::fs::hard_link(&input, place.at("same.stl")).unwrap();
    assert_refused(&place.suture(["repair", "holes.stl", "-o", "same.stl", "--force"]), &["same.stl", "never"]);
    assert_eq!(place.read("out.stl"), b"mine");
    assert_eq!(place.read("report.json"), b"mine, too");
    assert_eq!(std::fs::read(&input).unwrap(), before);
    assert_eq!(place.names(""), ["holes.stl", "out.stl", "report.json", "same.stl"]);
}

/// A link that leads nowhere is a name that is taken, too; an input may be behind one.
#[test]
fn f24_links_are_names() {
    let place = Place::new();
    place.generate(Case::Holes, 600, 1);
    std::os::unix::fs::symlink("nowhere.stl", place.at("out.stl")).unwrap();
    std::os::unix::fs::symlink("holes.stl", place.at("in.stl")).unwrap();
    assert_refused(&place.repair("holes.stl", "out.stl", &[]), &["out.stl", "exists"]);
    place.repair("in.stl", "repaired.stl", &[]).expect(0);
    assert_refused(&place.suture(["repair", "holes.stl", "-o", "in.stl", "--force"]), &["in.stl", "never"]);
    assert!(!place.at("nowhere.stl").exists());
}

#[cfg(target_os = "linux")]
#[test]
fn f23_names_need_not_be_utf_8() {
    use std::ffi::OsStr;
    use std::os::unix::ffi::OsStrExt;
    let place = Place::new();
    let (input, _) = place.generate(Case::Holes, 600, 1);
    let [odd, out] = [&b"K\xf6rper 1.stl"[..], b"K\xf6rper 2.stl"].map(OsStr::from_bytes);
    std::fs::rename(input, place.at("").join(odd)).unwrap();
    let [repair, o, report] = ["repair", "-o", "--report"].map(OsStr::new);
    place.suture([repair, odd, o, out, report, OsStr::new("report.json")]).expect(0);
    let report: serde_json::Value = serde_json::from_slice(&place.read("report.json")).unwrap();
    assert_eq!(report["input"]["path"], "K\u{fffd}rper 1.stl");
    assert!(judge(&place.at("").join(out)).unwrap().sound());
}

#[test]
fn output_is_replaced_when_that_is_asked_for() {
    let place = Place::new();
    place.generate(Case::Holes, 600, 1);
    place.put("out.stl", b"mine");
    place.repair("holes.stl", "out.stl", &["--force"]).expect(0);
    assert!(judge(&place.at("out.stl")).unwrap().sound());
}

#[test]
fn several_files_go_into_a_folder_under_names_of_their_own() {
    let place = Place::new();
    for (name, seed) in [("a/part.stl", 1), ("b/part.stl", 2)] {
        let mut bytes = Vec::new();
        suture_bench::generate::write(Case::Holes, 600, seed, &mut bytes).unwrap();
        place.put(name, &bytes);
    }
    place.put("c/picture.stl", b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR");
    std::fs::create_dir(place.at("out")).unwrap();
    let inputs = ["repair", "a/part.stl", "c/picture.stl", "b/part.stl", "-o"];
    // The worst of the files decides; the others are done all the same.
    place.suture(inputs.iter().chain(&["out"])).expect(2);
    assert_eq!(place.names("out"), ["part.stl", "part~2.stl"]);
    assert!(judge(&place.at("out/part.stl")).unwrap().sound() && judge(&place.at("out/part~2.stl")).unwrap().sound());
    assert_ne!(place.read("out/part.stl"), place.read("out/part~2.stl"));
    assert_refused(&place.suture(inputs.iter().chain(&["nowhere.stl"])), &["nowhere.stl", "folder"]);
}

#[test]
fn what_is_no_mesh_is_refused_in_one_line() {
    let place = Place::new();
    let cloud = "# scanned\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n";
    let strangers: [(&str, &[u8], &str); 6] = [
        ("picture.stl", b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\x01\0\0\0\x01\0\x08\x06\0\0\0", "PNG"),
        ("empty.stl", b"", "empty"),
        ("cloud.obj", cloud.as_bytes(), "point cloud"),
        ("page.stl", b"<!DOCTYPE html><html><body>Not found</body></html>", "web page"),
        ("zeros.stl", &[0; 4096], "no triangles"),
        ("letter.stl", b"Dear customer,\nplease find attached the part that you asked for, as STL, in millimetres, ready to be printed.\nYours faithfully, the workshop in the back yard\n", "solid"),
    ];
    for (name, bytes, word) in strangers {
        place.put(name, bytes);
        assert_refused(&place.suture(["repair", name, "-o", "out.stl"]), &[name, word]);
        assert_refused(&place.suture(["inspect", name]), &[name, word]);
    }
    assert_refused(&place.suture(["repair", "absent.stl", "-o", "out.stl"]), &["absent.stl"]);
    assert_refused(&place.suture(["repair", ".", "-o", "out.stl"]), &["folder"]);
    assert!(!place.at("out.stl").exists());
    assert_eq!(place.names("").len(), strangers.len(), "nothing temporary is left");
}

#[test]
fn wrong_usage_is_code_2() {
    let place = Place::new();
    place.generate(Case::Holes, 600, 1);
    for arguments in [
        &["repair", "holes.stl"][..],
        &["mend", "holes.stl"],
        &["repair", "holes.stl", "-o", "out.stl", "--memory", "much"],
        &["repair", "holes.stl", "-o", "out.stl", "--threads", "0"],
        &["repair", "holes.stl", "-o", "out.stl", "--profile", "unheard-of"],
        &["repair", "holes.stl", "-o", "no/such/folder/out.stl"],
    ] {
        let ran = place.suture(arguments).expect(2);
        assert!(!ran.stderr().is_empty(), "{arguments:?}");
    }
    assert_eq!(place.names(""), ["holes.stl"]);
}

/// A box without one of its sides' triangles and with one turned, each record with an attribute and a normal of its own.
#[test]
fn attributes_normals_and_header_of_the_untouched_pass_through() {
    let place = Place::new();
    let mut header = [0xa5; 80];
    header[..10].copy_from_slice(b"COLOR=\x01\x02\x03\xff");
    let mut records: Vec<_> = (0u16..)
        .zip(stl::cuboid([0.0; 3], [10.0, 20.0, 30.0]))
        .map(|(k, t)| stl::record([f32::from(k), -0.0, f32::NAN], &t, 0x8000 | k))
        .collect();
    records.remove(5);
    let [normal, a, b, c] = stl::numbers(&records[2]);
    records[2] = stl::record(normal, &[a, c, b], 0x8002);
    place.put("in.stl", &stl::file(&header, &records));
    let report = place.repair("in.stl", "out.stl", &["--list-edit"]).expect(0).report();
    let out = place.read("out.stl");
    assert_eq!(out[..80], header);
    let new = stl::records(&out);
    for (k, old) in records.iter().enumerate().filter(|(k, _)| *k != 2) {
        assert_eq!(&new[k], old, "record {k}");
    }
    // The turned one: its corners change, its colour stays.
    assert_eq!(stl::corners(&new[2]), [a, b, c]);
    assert_eq!(stl::attribute(&new[2]), 0x8002);
    assert_eq!(stl::numbers(&new[2])[0], stl::unit_normal(&[a, b, c]), "its normal is that of its corners");
    assert_eq!(new.len(), 12);
    // The new one has the colour of most of its rim: of the triangle beyond the longest edge, its face's diagonal.
    assert_eq!((stl::attribute(&new[11]), stl::numbers(&new[11])[0]), (0x8004, stl::unit_normal(&stl::corners(&new[11]))));
    assert_eq!(report["edit"]["untouched"], 10);
    assert!(judge(&place.at("out.stl")).unwrap().sound());
}

#[test]
fn output_has_the_mode_of_an_ordinary_file() {
    use std::os::unix::fs::PermissionsExt;
    let place = Place::new();
    place.generate(Case::Holes, 600, 1);
    place.repair("holes.stl", "out.stl", &["--report", "report.json"]).expect(0);
    let ordinary = std::fs::metadata(place.put("ordinary", b"")).unwrap().permissions().mode();
    for name in ["out.stl", "report.json"] {
        assert_eq!(std::fs::metadata(place.at(name)).unwrap().permissions().mode(), ordinary, "{name}");
    }
}

#[test]
fn report_says_all_it_promises() {
    let place = Place::new();
    place.generate(Case::Mixed, 6_000, 1);
    let ran = place.repair("mixed.stl", "out.stl", &["--report", "report.json", "--threads", "2", "--memory", "256MiB"]);
    let report: serde_json::Value = serde_json::from_slice(&place.read("report.json")).unwrap();
    assert_eq!(ran.report(), report, "what is printed is what is written");
    let text = |field: &str| report.pointer(field).and_then(|v| v.as_str()).unwrap_or_else(|| panic!("{field}")).to_owned();
    let number = |field: &str| report.pointer(field).and_then(|v| v.as_f64()).unwrap_or_else(|| panic!("{field}"));
    assert_eq!(number("/schema_version"), 2.0);
    assert_eq!(text("/task"), "repair");
    assert_eq!(text("/input/path"), "mixed.stl");
    assert_eq!(text("/output/path"), "out.stl");
    assert_eq!(text("/input/format"), "binary_stl");
    assert_eq!(text("/profile/name"), "default");
    assert_eq!((number("/limits/threads"), number("/limits/memory_bytes")), (2.0, f64::from(256 << 20)));
    assert_eq!(number("/output/bytes") as usize, place.read("out.stl").len());
    assert_eq!(text("/output/blake3").len(), 64);
    assert!(number("/tolerances/weld") > 0.0 && !text("/tolerances/weld_reason").is_empty());
    assert_eq!(report["verdict"]["unchecked"].as_array().unwrap().len(), 0);
    assert_eq!(report["verdict"]["free_of_self_intersection"], true);
    let repairs: Vec<_> = report["repairs"].as_array().unwrap().iter().map(|r| r["name"].as_str().unwrap()).collect();
    for name in ["degenerate", "duplicate", "fill", "orient"] {
        assert!(repairs.contains(&name), "{repairs:?}");
    }
    assert!(report["repairs"].as_array().unwrap().iter().all(|r| r["count"].as_u64().unwrap() > 0));
    let stages: Vec<_> = report["stages"].as_array().unwrap().iter().map(|s| s["name"].as_str().unwrap()).collect();
    assert!(stages.contains(&"topology") && stages.contains(&"verify"), "{stages:?}");
    for field in ["wall_seconds", "cpu_seconds", "triangles_per_second", "peak_resident_bytes", "peak_anonymous_bytes"] {
        assert!(number(&format!("/cost/{field}")) > 0.0, "{field}");
    }
    assert!(report["edit_records"].is_null(), "listed only on request");
}

#[test]
fn a_report_replaces_neither_input_nor_result() {
    let place = Place::new();
    place.generate(Case::Holes, 2000, 1);
    let input = place.read("holes.stl");
    for options in [["--report", "holes.stl"], ["--report", "out.stl"]] {
        let ran = place.suture(["repair", "holes.stl", "-o", "out.stl", "--force"].into_iter().chain(options)).expect(2);
        assert_eq!(ran.stderr().lines().count(), 1, "{}", ran.stderr());
        assert_eq!(place.read("holes.stl"), input);
        assert!(!place.at("out.stl").exists());
    }
}

/// A hollow box with a cube afloat in its cavity and one in its wall, which is material already.
#[test]
fn a_body_in_the_material_of_another_goes_unless_the_profile_keeps_it() {
    let turned = |triangles: Vec<stl::Triangle>| triangles.into_iter().map(|[a, b, c]| [a, c, b]);
    let hollow = stl::cuboid([0.0; 3], [9.0; 3]).into_iter().chain(turned(stl::cuboid([2.0; 3], [7.0; 3])));
    let afloat = stl::cuboid([4.0; 3], [5.0; 3]);
    let inside = stl::cuboid([0.5; 3], [1.5; 3]);
    let place = Place::new();
    let stays: Vec<stl::Triangle> = hollow.chain(afloat).collect();
    let input = place.put("in.stl", &stl::mesh(&[stays.clone(), inside].concat()));
    for limits in [&["--chunk-triangles", "4"][..], &[]] {
        let report = place.repair("in.stl", "out.stl", &[limits, &["--force"]].concat()).expect(0).report();
        assert_eq!((&report["outcome"], &report["before"]["nested_positive"]), (&"repaired".into(), &1.into()), "{report}");
        assert_eq!((&report["after"]["bodies"], &report["after"]["cavities"]), (&2.into(), &1.into()));
        assert!(report["repairs"][0]["note"].as_str().unwrap().contains("of 1 units³"), "{report}");
        assert_eq!(stl::records(&place.read("out.stl")), stl::records(&stl::mesh(&stays)));
    }
    place.put("keep.toml", b"bodies = \"keep\"\n");
    let profile = place.at("keep.toml");
    let kept = place.repair("in.stl", "kept.stl", &["--profile", profile.to_str().unwrap()]).expect(0).report();
    assert_eq!(kept["outcome"], "clean");
    assert_eq!(place.read("kept.stl"), std::fs::read(input).unwrap());
}

/// A hollow box with a cube afloat in its cavity, and a cube beside it: of the first, only the skin can be seen.
#[test]
fn what_cannot_be_seen_goes_if_the_profile_says_so() {
    let turned = |triangles: Vec<stl::Triangle>| triangles.into_iter().map(|[a, b, c]| [a, c, b]).collect::<Vec<_>>();
    let seen = [stl::cuboid([0.0; 3], [9.0; 3]), stl::cuboid([20.0; 3], [21.0; 3])].concat();
    let unseen = [turned(stl::cuboid([3.0; 3], [6.0; 3])), stl::cuboid([4.0; 3], [5.0; 3])].concat();
    let place = Place::new();
    place.put("in.stl", &stl::mesh(&[unseen, seen.clone()].concat()));
    place.put("visible.toml", b"bodies = \"visible\"\n");
    let profile = place.at("visible.toml");
    for limits in [&["--chunk-triangles", "4"][..], &[]] {
        let options = [limits, &["--profile", profile.to_str().unwrap(), "--force"]].concat();
        let report = place.repair("in.stl", "out.stl", &options).expect(0).report();
        assert_eq!((&report["outcome"], &report["after"]["bodies"]), (&"repaired".into(), &2.into()), "{report}");
        let note = report["repairs"][0]["note"].as_str().unwrap();
        assert!(note.contains("bodies: 1, of 1 units³") && note.contains("thereby: 1, of 27 units³"), "{note}");
        assert_eq!(stl::records(&place.read("out.stl")), stl::records(&stl::mesh(&seen)));
    }
    assert_eq!(place.repair("in.stl", "kept.stl", &[]).expect(0).report()["outcome"], "clean");
}
