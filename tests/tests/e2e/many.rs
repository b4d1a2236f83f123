//! Many files in one command: side by side, yet told of and named in their order, each at its own cost only.

use std::collections::BTreeMap;

use serde_json::Value;
use suture_bench::generate::{Case, write};
use suture_tests::{Place, Ran, stl};

fn lines(ran: &Ran) -> Vec<Value> {
    ran.stdout().lines().map(|line| serde_json::from_str(line).unwrap_or_else(|error| panic!("{error}: {line}"))).collect()
}

/// What must not depend on how many run beside each other.
fn essence(report: &Value) -> Value {
    let mut report = report.clone();
    let object = report.as_object_mut().unwrap();
    for of_the_run in ["cost", "stages", "limits"] {
        object.remove(of_the_run);
    }
    if let Some(repairs) = object.get_mut("repairs").and_then(Value::as_array_mut) {
        repairs.iter_mut().for_each(|repair| repair["seconds"] = Value::Null);
    }
    report
}

/// Forty files of all sorts, some of which are no meshes or not there at all, their names in an order that is neither that of their
/// sizes nor the alphabet's.
fn assorted(place: &Place) -> Vec<String> {
    let cases = [Case::Mixed, Case::Clean, Case::Holes, Case::Soup];
    (0..40)
        .map(|k: usize| {
            let name = format!("{}-{k}.stl", 'a' as usize + k * 7 % 40);
            match k % 10 {
                3 => drop(place.put(&name, b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR")),
                7 => {}
                _ => {
                    let mut bytes = Vec::new();
                    write(cases[k % 4], 512 + 1024 * (k as u64 % 5), k as u64, &mut bytes).unwrap();
                    place.put(&name, &bytes);
                }
            }
            name
        })
        .collect()
}

#[test]
fn files_are_told_of_in_their_order_whatever_is_done_first() {
    let place = Place::new();
    let names = assorted(&place);
    let mut outputs: BTreeMap<&str, Vec<(String, Vec<u8>)>> = BTreeMap::new();
    let mut told: BTreeMap<&str, Vec<Value>> = BTreeMap::new();
    for threads in ["1", "2", "5"] {
        let folder = format!("out-{threads}");
        std::fs::create_dir(place.at(&folder)).unwrap();
        let options = ["repair", "--json", "--threads", threads, "-o", &folder];
        let ran = place.suture(options.into_iter().chain(names.iter().map(String::as_str))).expect(2);
        let reports = lines(&ran);
        let inputs: Vec<_> =
            reports.iter().map(|r| r.pointer("/input/path").unwrap_or(&r["input"]).as_str().unwrap().to_owned()).collect();
        assert_eq!(inputs, names);
        let failures: Vec<_> = reports.iter().filter_map(|r| r["error"].as_str()).collect();
        assert_eq!(failures.len(), 8);
        let complaints: Vec<_> = ran.stderr().lines().map(str::to_owned).collect();
        assert!(complaints.iter().zip(&failures).all(|(line, failure)| line.ends_with(failure)), "{complaints:?}");
        let files = place.names(&folder).into_iter().map(|name| (name.clone(), place.read(&format!("{folder}/{name}"))));
        outputs.insert(threads, files.collect());
        let same = |r: &Value| {
            let mut r = essence(r);
            if let Some(path) = r.pointer_mut("/output/path") {
                *path = path.as_str().unwrap().replace(&folder, "out").into();
            }
            r
        };
        told.insert(threads, reports.iter().map(same).collect());
    }
    assert_eq!(outputs["1"].len(), 32);
    for threads in ["2", "5"] {
        assert!(outputs["1"] == outputs[threads], "other files with {threads} threads");
        assert_eq!(told["1"], told[threads]);
    }
    let inspected = place.suture(["inspect", "--json"].into_iter().chain(names.iter().map(String::as_str))).expect(2);
    assert_eq!(lines(&inspected).len(), names.len());
}

/// Two inputs of one name: results and reports get names of their own, and each report knows its result.
#[test]
fn reports_go_with_their_results() {
    let place = Place::new();
    for (name, seed) in [("a/part.stl", 1), ("b/part.stl", 2)] {
        let mut bytes = Vec::new();
        write(Case::Holes, 600, seed, &mut bytes).unwrap();
        place.put(name, &bytes);
    }
    std::fs::create_dir(place.at("out")).unwrap();
    std::fs::create_dir(place.at("reports")).unwrap();
    let line = ["repair", "a/part.stl", "b/part.stl", "-o", "out", "--report", "reports"];
    place.suture(line).expect(0);
    assert_eq!(place.names("out"), ["part.stl", "part~2.stl"]);
    assert_eq!(place.names("reports"), ["part.stl.report.json", "part~2.stl.report.json"]);
    for (name, input) in [("part.stl", "a/part.stl"), ("part~2.stl", "b/part.stl")] {
        let report: Value = serde_json::from_slice(&place.read(&format!("reports/{name}.report.json"))).unwrap();
        assert_eq!((&report["input"]["path"], &report["output"]["path"]), (&input.into(), &format!("out/{name}").into()));
        assert_eq!(report["output"]["bytes"], place.read(&format!("out/{name}")).len());
        assert!(report["limits"]["defer_sync"].is_null(), "that is no one else's business");
    }
    // Once more: no result and no report is replaced.
    place.suture(line).expect(0);
    assert_eq!(place.names("out"), ["part.stl", "part~2.stl", "part~3.stl", "part~4.stl"]);
    assert_eq!(place.names("reports").len(), 4);
}

/// A soup that does not fit into half the memory is given all of it, and those around it keep their places.
#[test]
fn f10_a_file_that_needs_the_whole_memory_gets_it() {
    let place = Place::new();
    let names = ["1.stl", "2.stl", "3.stl", "4.stl", "5.stl"];
    for name in names {
        let mut bytes = Vec::new();
        let (case, triangles) = if name == "2.stl" { (Case::Soup, 50_000) } else { (Case::Clean, 600) };
        write(case, triangles, 1, &mut bytes).unwrap();
        place.put(name, &bytes);
    }
    std::fs::create_dir(place.at("out")).unwrap();
    // As little as it can do with, and what one of two files gets of that: half of seven eighths.
    let repaired = |memory: &u32, threads: &str| {
        let memory = format!("{memory}MiB");
        place.repair("2.stl", "2-alone.stl", &["--force", "--threads", threads, "--memory", &memory]).code() < 2
    };
    let least = (4..400).step_by(4).find(|memory| repaired(memory, "2")).unwrap();
    assert!(!repaired(&(least * 7 / 16), "1"), "the test would mean nothing");
    let options = ["repair", "--json", "--threads", "2", "--memory", &format!("{least}MiB"), "-o", "out"];
    let ran = place.suture(options.into_iter().chain(names));
    let told: Vec<_> = lines(&ran).iter().map(|r| r["input"]["path"].as_str().map(str::to_owned)).collect();
    assert_eq!(told, names.map(|name| Some(name.to_owned())), "{}", ran.stderr());
    assert_eq!(place.names("out"), names);
    assert_eq!(place.read("out/2.stl"), place.read("2-alone.stl"));
}

/// Places of the same file, given by text and by several names, are all the same to the results' folder.
#[test]
fn one_input_may_be_given_twice() {
    let place = Place::new();
    place.put("cube.stl", &stl::mesh(&stl::cuboid([0.0; 3], [1.0; 3])));
    std::fs::create_dir(place.at("out")).unwrap();
    place.suture(["repair", "cube.stl", "./cube.stl", "-o", "out"]).expect(0);
    assert_eq!(place.read("out/cube.stl"), place.read("cube.stl"));
    assert_eq!(place.read("out/cube~2.stl"), place.read("cube.stl"));
}

/// A second run of one command gives the same names as the first one, by force; without it nothing that is there is replaced.
#[test]
fn by_force_results_in_a_folder_are_replaced() {
    let place = Place::new();
    place.put("a/part.stl", &stl::mesh(&stl::cuboid([0.0; 3], [1.0; 3])));
    place.put("b/part.stl", &stl::mesh(&stl::cuboid([0.0; 3], [2.0; 3])));
    std::fs::create_dir(place.at("out")).unwrap();
    let command = ["repair", "a/part.stl", "b/part.stl", "-o", "out", "--report", "out"];
    place.suture(command).expect(0);
    let names = place.names("out");
    assert_eq!((names.len(), place.read("out/part~2.stl")), (4, place.read("b/part.stl")));
    place.put("a/part.stl", &stl::mesh(&stl::cuboid([0.0; 3], [3.0; 3])));
    place.suture(command.into_iter().chain(["--force"])).expect(0);
    assert_eq!(place.names("out"), names);
    assert_eq!(
        ["part.stl", "part~2.stl"].map(|name| place.read(&format!("out/{name}"))),
        [place.read("a/part.stl"), place.read("b/part.stl")]
    );
    place.suture(command).expect(0);
    assert_eq!(place.names("out").len(), 8);
}

/// Names that Windows, macOS or a share take for the same: each result gets one of its own, in the order of the inputs; so does one whose twin is
/// in the folder already.
#[test]
fn results_do_not_hide_each_other_on_other_systems() {
    let place = Place::new();
    let names = ["part.stl", "Part.stl", "K\u{f6}rper.stl", "KO\u{308}RPER.stl", "part~2.stl", "there.stl"];
    let inputs: Vec<_> = (0u8..).zip(names).map(|(number, name)| (format!("{number}/{name}"), 1.0 + f32::from(number))).collect();
    for (input, size) in &inputs {
        place.put(input, &stl::mesh(&stl::cuboid([0.0; 3], [*size; 3])));
    }
    for (threads, folder) in [("1", "out1"), ("2", "out2")] {
        place.put(&format!("{folder}/There.STL"), b"of someone else");
        let options = ["repair", "--threads", threads, "-o", folder];
        place.suture(options.into_iter().chain(inputs.iter().map(|(input, _)| input.as_str()))).expect(0);
        let results = ["part.stl", "Part~2.stl", "K\u{f6}rper.stl", "KO\u{308}RPER~2.stl", "part~2~2.stl", "there~2.stl"];
        for ((input, _), result) in inputs.iter().zip(results) {
            assert_eq!(place.read(&format!("{folder}/{result}")), place.read(input), "{input}: {:?}", place.names(folder));
        }
        assert_eq!(place.names(folder).len(), names.len() + 1);
        assert_eq!(place.read(&format!("{folder}/There.STL")), b"of someone else");
    }
}
