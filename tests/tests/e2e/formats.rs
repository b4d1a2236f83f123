//! Formats other than STL, on the built binary: repaired, copied, converted, dropped into a hot folder, refused; and 3MF packages object by object.
//! Results are read by readers of the tests' own.

use serde_json::Value;
use suture_bench::judge::judge_triangles;
use suture_tests::Place;
use suture_tests::forms::{self, Form};
use suture_tests::stl::{self, Triangle};
use suture_tests::zip::{self, ENCRYPTED};

/// A box, closed. Its numbers have no short binary form.
fn solid_box() -> Vec<Triangle> {
    stl::cuboid([0.1, 0.5, -1.25], [10.3, 20.7, 30.75])
}

/// The same without its last triangle.
fn open_box() -> Vec<Triangle> {
    let mut triangles = solid_box();
    triangles.pop();
    triangles
}

/// The triangle from its smallest corner on.
fn turned(triangle: Triangle) -> [[u32; 3]; 3] {
    let mut corners = triangle.map(|corner| corner.map(f32::to_bits));
    let first = (0..3).min_by_key(|k| corners[*k]).unwrap();
    corners.rotate_left(first);
    corners
}

/// The open box's triangles as they came, and one more, which makes it the closed box.
fn assert_is_mended(result: &[Triangle], form: impl std::fmt::Debug) {
    let open = open_box();
    assert_eq!(result[..open.len()], open, "{form:?}: in their order");
    let mut sets = [result.to_vec(), solid_box()].map(|all| all.into_iter().map(turned).collect::<Vec<_>>());
    sets.iter_mut().for_each(|all| all.sort_unstable());
    assert_eq!(sets[0], sets[1], "{form:?}");
    let judged = judge_triangles(result);
    assert!(judged.sound() && judged.positive_bodies == 1, "{form:?}: {judged:?}");
}

fn json(place: &Place, name: &str) -> Value {
    serde_json::from_slice(&place.read(name)).unwrap()
}

#[test]
fn a_repaired_file_keeps_its_format() {
    for form in Form::ALL {
        let place = Place::new();
        let ending = form.ending();
        let [input, output] = ["in", "out"].map(|name| format!("{name}.{ending}"));
        let bytes = forms::write(form, &open_box());
        place.put(&input, &bytes);
        let report = place.repair(&input, &output, &[]).expect(0).report();
        assert_eq!((&report["outcome"], &report["verdict"]["good"]), (&"repaired".into(), &true.into()), "{form:?}");
        assert_eq!([&report["input"]["format"], &report["output"]["format"]], [ending; 2], "{form:?}");
        assert_eq!((&report["input"]["triangles"], &report["output"]["triangles"]), (&11.into(), &12.into()), "{form:?}");
        assert_eq!(report["output"]["bytes"], place.read(&output).len(), "{form:?}");
        assert_is_mended(&forms::read(ending, &place.read(&output)), form);
        assert_eq!(place.read(&input), bytes, "{form:?}: the input stays");
        place.inspect(&output, &[]).expect(0);
    }
}

#[test]
fn a_repaired_text_goes_on_behind_its_last_line() {
    let place = Place::new();
    let text = forms::write(Form::Obj, &open_box());
    place.put("in.obj", &text);
    let report = place.repair("in.obj", "out.obj", &[]).expect(0).report();
    let counts = ["kept", "inherited", "lost"].map(|kind| report["attributes"][kind].clone());
    assert_eq!(counts, [11, 1, 0].map(Value::from), "{report}");
    let output = place.read("out.obj");
    let new = output.strip_prefix(text.as_slice()).map(String::from_utf8_lossy).unwrap();
    assert!(new.starts_with("f ") && new.lines().count() == 1, "{new}");
    // Another format has no place for what the text says.
    place.put("keep.toml", b"attributes = \"keep\"");
    let report = place.repair("in.obj", "out.stl", &["--profile", "keep.toml"]).expect(1).report();
    assert_eq!((&report["outcome"], &report["attributes"]["lost"]), (&"needs_review".into(), &11.into()), "{report}");
}

#[test]
fn a_clean_file_is_copied_byte_for_byte() {
    for form in Form::ALL {
        let place = Place::new();
        let [input, output] = ["in", "out"].map(|name| format!("{name}.{}", form.ending()));
        let bytes = forms::write(form, &solid_box());
        place.put(&input, &bytes);
        let report = place.repair(&input, &output, &[]).expect(0).report();
        assert_eq!(report["outcome"], "clean", "{form:?}");
        assert_eq!(place.read(&output), bytes, "{form:?}");
    }
}

#[test]
fn endings_lie_and_bytes_tell() {
    let place = Place::new();
    place.put("part.stl", &forms::write(Form::Obj, &open_box()));
    let report = place.inspect("part.stl", &[]).expect(1).report();
    assert_eq!(report["input"]["format"], "obj");
}

#[test]
fn the_format_of_a_result_can_be_chosen() {
    let place = Place::new();
    place.put("part.obj", &forms::write(Form::Obj, &open_box()));
    place.put("amf.toml", b"format = \"amf\"");
    std::fs::create_dir(place.at("fixed")).unwrap();
    // By the output's ending.
    place.repair("part.obj", "part.off", &[]).expect(0);
    assert_is_mended(&forms::read("off", &place.read("part.off")), "an ending");
    // By an option, and by a profile, which also give the ending in a folder.
    place.repair("part.obj", "fixed", &["--format", "ply"]).expect(0);
    place.repair("part.obj", "fixed", &["--format", "3mf"]).expect(0);
    place.repair("part.obj", "fixed", &["--profile", "amf.toml"]).expect(0);
    place.repair("part.obj", "fixed", &[]).expect(0);
    assert_eq!(place.names("fixed"), ["part.3mf", "part.amf", "part.obj", "part.ply"]);
    for ending in ["3mf", "amf", "obj", "ply"] {
        assert_is_mended(&forms::read(ending, &place.read(&format!("fixed/part.{ending}"))), ending);
    }
    // A clean file of another format is written anew.
    place.put("clean.ply", &forms::write(Form::PlyText, &solid_box()));
    let report = place.repair("clean.ply", "clean.stl", &[]).expect(0).report();
    assert_eq!(report["output"]["format"], "binary_stl");
    let written: Vec<_> = stl::records(&place.read("clean.stl")).iter().map(stl::corners).collect();
    assert_eq!(written, solid_box());
    let ran = place.suture(["repair", "part.obj", "-o", "x.obj", "--format", "step"]).expect(2);
    assert!(ran.stderr().contains("stl, 3mf, ply, off, obj, amf"), "{}", ran.stderr());
    // Which of the two would be meant?
    let ran = place.suture(["repair", "part.obj", "-o", "x.stl", "--format", "obj"]).expect(2);
    assert!(ran.stderr().contains("x.stl") && ran.stderr().contains("change one of them"), "{}", ran.stderr());
    assert!(!place.at("x.stl").exists());
}

/// The words of colours in an STL, and the colours of a PLY, find no place in other formats: that is told.
#[test]
fn a_conversion_tells_what_it_loses() {
    let place = Place::new();
    let mut coloured = stl::mesh(&solid_box());
    (0..5).for_each(|k| coloured[84 + 50 * k + 48] = 7);
    place.put("coloured.stl", &coloured);
    place.put("plain.stl", &stl::mesh(&solid_box()));
    let said = |from: &str, to: &str| place.suture(["convert", from, to]).expect(0).stdout();
    let lost = "  lost: colours, paint or other attributes of";
    assert!(said("coloured.stl", "a.obj").contains(&format!("{lost} 5 triangles\n")));
    for (from, to) in [("coloured.stl", "b.stl"), ("plain.stl", "c.obj")] {
        assert!(!said(from, to).contains("lost"), "{from}");
    }
    let report = place.repair("coloured.stl", "d.ply", &[]).expect(0).report();
    assert_eq!(report["attributes"]["lost"], 5, "{}", report["attributes"]);
    let report = place.repair("coloured.stl", "e.stl", &[]).expect(0).report();
    assert!(report["attributes"].is_null(), "{}", report["attributes"]);
}

#[test]
fn conversion_there_and_back_gives_the_same_corners() {
    let place = Place::new();
    // Two boxes that cross, one of them open: nothing of that is repaired.
    let triangles = [open_box(), stl::cuboid([5.0, 5.0, 5.0], [50.0, 6.0, 1e-3])].concat();
    place.put("part.stl", &stl::mesh(&triangles));
    for [from, to] in [["stl", "ply"], ["ply", "off"], ["off", "obj"], ["obj", "amf"], ["amf", "3mf"], ["3mf", "stl"]] {
        let [input, output] = [format!("part.{from}"), format!("{}.{to}", if to == "stl" { "back" } else { "part" })];
        let ran = place.suture(["convert", &input, &output]).expect(0);
        assert!(ran.stdout().contains("23 triangles"), "{}", ran.stdout());
        if to != "stl" {
            assert_eq!(forms::read(to, &place.read(&output)), triangles, "{to}");
        }
    }
    let back: Vec<_> = stl::records(&place.read("back.stl")).iter().map(stl::corners).collect();
    assert_eq!(back, triangles);
    place.suture(["convert", "part.obj", "copy.obj"]).expect(0);
    assert_eq!(place.read("copy.obj"), place.read("part.obj"));
    // Nothing is replaced unasked, and nothing becomes a format that is only known by name.
    let before = place.read("part.ply");
    place.suture(["convert", "back.stl", "part.ply"]).expect(2);
    assert_eq!(place.read("part.ply"), before);
    let ran = place.suture(["convert", "back.stl", "part.step"]).expect(2);
    assert!(ran.stderr().contains("stl, 3mf, ply, off, obj, amf"), "{}", ran.stderr());
    assert!(!place.at("part.step").exists());
}

#[test]
fn a_mesh_becomes_a_package_and_what_3mf_does_not_allow_does_not() {
    let place = Place::new();
    // Feet are called otherwise in a 3MF.
    let amf = String::from_utf8(forms::write(Form::Amf, &open_box())).unwrap();
    place.put("part.amf", amf.replace("unit=\"millimeter\"", "unit=\"feet\"").as_bytes());
    let report = place.repair("part.amf", "part.3mf", &[]).expect(0).report();
    assert_eq!([&report["output"]["format"], &report["output"]["unit"]], ["3mf", "foot"], "{report}");
    assert_is_mended(&forms::read("3mf", &place.read("part.3mf")), "a package");
    let names: Vec<_> = zip::read(&place.read("part.3mf")).into_iter().map(|entry| entry.name).collect();
    assert_eq!(names, ["[Content_Types].xml", "_rels/.rels", "3D/3dmodel.model"]);
    // A package that is good stays, by whatever name of its format.
    place.repair("part.3mf", "again.3mf", &["--format", "3mf"]).expect(0);
    assert_eq!(place.read("again.3mf"), place.read("part.3mf"));

    let mut pinched = solid_box();
    pinched.push([pinched[0][0], pinched[0][1], pinched[0][0]]);
    place.put("pinched.stl", &stl::mesh(&pinched));
    let ran = place.suture(["convert", "pinched.stl", "pinched.3mf"]).expect(2);
    assert!(ran.stderr().contains("1 triangle with two corners at one place"), "{}", ran.stderr());
    assert!(!place.at("pinched.3mf").exists());
    place.repair("pinched.stl", "pinched.3mf", &[]).expect(0);
    assert_eq!(forms::read("3mf", &place.read("pinched.3mf")), solid_box());
}

#[test]
fn a_package_is_converted_as_it_is_built() {
    let place = Place::new();
    let mesh = forms::mesh_of_model(&forms::indexed(&stl::cuboid([0.0; 3], [1.0, 2.0, 4.0])), |_| String::new());
    let objects =
        format!("<object id=\"1\">{mesh}</object><object id=\"2\"><components><component objectid=\"1\"/></components></object>");
    // Moved by 10 along x; then x and y exchanged and x turned around: a rotation about z.
    let build = "<item objectid=\"1\" transform=\"1 0 0 0 1 0 0 0 1 10 0 0\"/><item objectid=\"2\" transform=\"0 1 0 -1 0 0 0 0 1 0 0 0\"/>";
    place.put("part.3mf", &forms::package(&forms::model(&objects, build), &[]));
    place.suture(["convert", "part.3mf", "part.stl"]).expect(0);
    let all: Vec<_> = stl::records(&place.read("part.stl")).iter().map(stl::corners).collect();
    let moved = stl::cuboid([10.0, 0.0, 0.0], [11.0, 2.0, 4.0]);
    let rotated = stl::cuboid([0.0; 3], [1.0, 2.0, 4.0]).into_iter().map(|t| t.map(|[x, y, z]| [0.0 - y, x, z])).collect();
    let placed: Vec<Triangle> = [moved, rotated].concat();
    assert_eq!(all, placed);
}

#[test]
fn a_hot_folder_takes_each_format() {
    let place = Place::new();
    place.put(
        "suture.toml",
        b"settle = \"50ms\"\n[[folders]]\npath = \"hot\"\n[profiles.plain]\nformat = \"stl\"\n[profiles.packed]\nformat = \"3mf\"\n",
    );
    for form in [Form::PlyBinary, Form::Off, Form::Obj, Form::Amf, Form::ThreeMf] {
        place.put(&format!("hot/in/{form:?}.{}", form.ending()), &forms::write(form, &open_box()));
    }
    place.put("hot/in/plain/part.obj", &forms::write(Form::Obj, &open_box()));
    place.put("hot/in/plain/CLEAN.PLY", &forms::write(Form::PlyText, &solid_box()));
    place.put("hot/in/packed/part.obj", &forms::write(Form::Obj, &open_box()));
    // A sheet is no solid: its best attempt is of its format.
    place.put("hot/in/sheet.off", &forms::write(Form::Off, &solid_box()[..2]));
    place.put("hot/in/part.step", b"ISO-10303-21;");
    place.suture(["watch", "--config", "suture.toml", "--once"]).expect(1);
    let meshes = |folder: &str| -> Vec<String> {
        place.names(folder).into_iter().filter(|name| !name.ends_with(".json") && !name.starts_with('.')).collect()
    };
    let mended = ["Amf.amf", "Obj.obj", "Off.off", "PlyBinary.ply", "ThreeMf.3mf"];
    assert_eq!(meshes("hot/out"), [&mended[..], &["packed/part.3mf", "plain/CLEAN.stl", "plain/part.stl"]].concat());
    assert_eq!(meshes("hot/done"), [&mended[..], &["packed/part.obj", "plain/CLEAN.PLY", "plain/part.obj"]].concat());
    assert_is_mended(&forms::read("3mf", &place.read("hot/out/packed/part.3mf")), "packed");
    for name in mended {
        let ending = name.rsplit_once('.').unwrap().1;
        assert_is_mended(&forms::read(ending, &place.read(&format!("hot/out/{name}"))), name);
        let report = json(&place, &format!("hot/out/{name}.report.json"));
        assert_eq!([&report["input"]["format"], &report["output"]["format"]], [ending; 2], "{name}");
    }
    for (name, source) in [("plain/part.stl", "plain/part.obj"), ("plain/CLEAN.stl", "plain/CLEAN.PLY")] {
        let triangles: Vec<_> = stl::records(&place.read(&format!("hot/out/{name}"))).iter().map(stl::corners).collect();
        assert!(judge_triangles(&triangles).sound(), "{name}");
        let receipt = json(&place, &format!("hot/out/{name}.suture.json"));
        assert_eq!((&receipt["source"], &receipt["output"]), (&source.into(), &name.into()), "{receipt}");
    }
    assert_eq!(meshes("hot/failed"), ["sheet.best.off", "sheet.off"]);
    assert_eq!(meshes("hot/in"), ["part.step"]);
}

/// A tag in a mesh of a 3MF, and what stands behind the tag of its triangles.
const PAINT: &str = " slic3rpe:mmu_segmentation=\"8\"";
const SUPPORTS: &str = " slic3rpe:custom_supports=\"4\" pid=\"9\" p1=\"0\"";

/// A package of a closed box, which is painted in a corner, and an open one, whose last side and its neighbours are painted.
struct TwoObjects {
    first: String,
    second_tags: Vec<String>,
    build: String,
    others: [(&'static str, &'static [u8]); 2],
}

impl TwoObjects {
    fn new() -> Self {
        let closed = forms::indexed(&stl::cuboid([5.0, 5.0, 5.0], [6.0, 7.0, 8.0]));
        // Odd blanks, which no writer would make again.
        let mesh = forms::mesh_of_model(&closed, |k| if k == 0 { PAINT.into() } else { String::new() });
        let first =
            format!("<object  id='1'   name=\"The &quot;sound&quot; one\" type=\"model\" >{mesh}<!-- a note --></object>");
        let (_, faces) = forms::indexed(&open_box());
        let more = |k| Self::more_of_second(k);
        let second_tags =
            faces.iter().enumerate().map(|(k, [a, b, c])| format!("<triangle v1=\"{a}\" v2=\"{b}\" v3=\"{c}\"{}/>", more(k)));
        Self {
            first,
            second_tags: second_tags.collect(),
            build: "<item objectid=\"2\" transform=\"1 0 0 0 1 0 0 0 1 3.50 0 0\"/><item  objectid=\"1\"/>".into(),
            others: [("Metadata/thumbnail.png", b"\x89PNG\r\n\x1a\nno picture"), ("Metadata/Unknown.bin", b"\0\x01who knows")],
        }
    }

    /// All sides but the first are painted, one of them otherwise.
    fn more_of_second(triangle: usize) -> String {
        match triangle {
            0..=1 => String::new(),
            4..=5 => SUPPORTS.into(),
            _ => PAINT.into(),
        }
    }

    fn package(&self) -> Vec<u8> {
        let second = forms::mesh_of_model(&forms::indexed(&open_box()), Self::more_of_second);
        let materials = "<basematerials id=\"9\"><base name=\"PLA\" displaycolor=\"#FF0000\"/></basematerials>";
        let objects = format!("{materials}{}\n<object id=\"2\" name=\"broken\">{second}</object>", self.first);
        forms::package(&forms::model(&objects, &self.build), &self.others)
    }
}

#[test]
fn objects_of_a_package_are_repaired_one_by_one_and_all_else_stays() {
    let place = Place::new();
    let two = TwoObjects::new();
    place.put("in.3mf", &two.package());
    let report = place.repair("in.3mf", "out.3mf", &[]).expect(0).report();
    let [before, after] = ["in.3mf", "out.3mf"].map(|name| zip::read(&place.read(name)));
    let names = |entries: &[zip::Entry]| entries.iter().map(|entry| entry.name.clone()).collect::<Vec<_>>();
    assert_eq!(names(&after), names(&before));
    for (old, new) in before.iter().zip(&after).filter(|(old, _)| old.name != "3D/3dmodel.model") {
        assert_eq!(new.raw, old.raw, "{}: header and data", old.name);
    }
    let [old, new] = [&before, &after].map(|entries| String::from_utf8(entries[2].content.clone()).unwrap());
    assert!(new.contains(&two.first), "the sound object's text is the same: {new}");
    // Before and behind the mesh of the broken object, all is as it was, and so is each of its triangles.
    let start = old.find("<object id=\"2\"").unwrap();
    assert_eq!(new[..start], old[..start]);
    let build = old.find("</triangles>\n</mesh></object>\n</resources>").unwrap();
    assert!(new.ends_with(&old[build..]), "{new}");
    let object = &new[start..];
    let mut at = 0;
    for tag in &two.second_tags {
        at += object[at..].find(tag.as_str()).unwrap_or_else(|| panic!("{tag} in its order: {object}")) + tag.len();
    }
    assert_is_mended(&forms::read_object(object), "the broken object");
    // Two of the three sides around the new triangle, and most of its rim, are painted alike.
    let added: Vec<_> = object[at..].split("<triangle ").skip(1).collect();
    assert!(added.len() == 1 && added[0].contains(PAINT), "{added:?}");

    assert_eq!(report["outcome"], "repaired");
    let objects = report["objects"].as_array().unwrap();
    let told: Vec<_> = objects.iter().map(|object| (&object["id"], &object["name"], &object["outcome"])).collect();
    let expected = [(1, "The \"sound\" one", "clean"), (2, "broken", "repaired")]
        .map(|(id, name, end)| (id.into(), name.into(), end.into()));
    assert_eq!(told, expected.each_ref().map(|(id, name, end): &(Value, Value, Value)| (id, name, end)));
    // One triangle of the first object has paint, and nine of the second.
    assert_eq!(report["attributes"], serde_json::json!({"kept": 10, "divided": 0, "approximated": 0, "inherited": 1, "lost": 0}));
    assert_eq!((&report["before"]["triangles"], &report["after"]["triangles"]), (&23.into(), &24.into()));
}

#[test]
fn objects_that_cross_stay_two() {
    let place = Place::new();
    let object = |id: u32, triangles: &[Triangle]| {
        format!("<object id=\"{id}\">{}</object>", forms::mesh_of_model(&forms::indexed(triangles), |_| String::new()))
    };
    let other = stl::cuboid([1.0, 1.0, 1.0], [50.0, 2.0, 2.0]);
    let objects = object(1, &open_box()) + &object(2, &other);
    place.put("in.3mf", &forms::package(&forms::model(&objects, "<item objectid=\"1\"/><item objectid=\"2\"/>"), &[]));
    place.repair("in.3mf", "out.3mf", &[]).expect(0);
    let all = forms::read("3mf", &place.read("out.3mf"));
    let (first, second) = all.split_at(12);
    assert_is_mended(first, "the first");
    assert_eq!(second, other);
}

#[test]
fn what_is_done_where_paint_is_lost_is_the_profiles_matter() {
    let place = Place::new();
    // A box with its first triangle once more: one of the two goes, with its paint.
    let mut triangles = solid_box();
    triangles.push(triangles[0]);
    let mesh = forms::mesh_of_model(&forms::indexed(&triangles), |_| PAINT.into());
    place.put(
        "in.3mf",
        &forms::package(&forms::model(&format!("<object id=\"1\">{mesh}</object>"), "<item objectid=\"1\"/>"), &[]),
    );
    place.put("keep.toml", b"attributes = \"keep\"");
    place.put("refuse.toml", b"attributes = \"refuse\"");
    let report = place.repair("in.3mf", "best.3mf", &[]).expect(0).report();
    assert_eq!((&report["attributes"]["kept"], &report["attributes"]["lost"]), (&12.into(), &1.into()), "{report}");
    assert_eq!(forms::read("3mf", &place.read("best.3mf")), solid_box());
    let report = place.repair("in.3mf", "keep.3mf", &["--profile", "keep.toml"]).expect(1).report();
    assert_eq!(report["outcome"], "needs_review");
    assert_eq!(place.read("keep.3mf"), place.read("best.3mf"));
    let report = place.repair("in.3mf", "refuse.3mf", &["--profile", "refuse.toml"]).expect(1).report();
    assert_eq!((&report["outcome"], &report["output"]), (&"not_good".into(), &Value::Null));
    assert!(!place.at("refuse.3mf").exists());
}

#[test]
fn a_changed_package_that_was_signed_needs_review() {
    let signed = |triangles: &[Triangle]| {
        let form = zip::read(&forms::write(Form::ThreeMf, triangles));
        let origin = "<Relationship Target=\"/_sig/origin.psdor\" Id=\"s\" \
            Type=\"http://schemas.openxmlformats.org/package/2006/relationships/digital-signature/origin\"/></Relationships>";
        let relationships = String::from_utf8(form[1].content.clone()).unwrap().replace("</Relationships>", origin);
        let entries = [
            ("[Content_Types].xml", form[0].content.as_slice()),
            ("_rels/.rels", relationships.as_bytes()),
            ("3D/3dmodel.model", form[2].content.as_slice()),
            ("_sig/origin.psdor", b""),
        ];
        zip::write(&entries, 0)
    };
    let place = Place::new();
    place.put("clean.3mf", &signed(&solid_box()));
    place.repair("clean.3mf", "clean.out.3mf", &[]).expect(0);
    assert_eq!(place.read("clean.out.3mf"), place.read("clean.3mf"));
    place.put("open.3mf", &signed(&open_box()));
    let report = place.repair("open.3mf", "open.out.3mf", &[]).expect(1).report();
    assert_eq!(report["outcome"], "needs_review");
    assert!(report["verdict"]["reasons"][0].as_str().unwrap().contains("signed"), "{report}");
}

#[test]
fn objects_that_need_be_no_solid_stay_as_they_are() {
    let place = Place::new();
    let open = forms::mesh_of_model(&forms::indexed(&open_box()), |_| String::new());
    let support = format!("<object id=\"1\" type=\"support\">{open}</object>");
    let objects = format!("{support}<object id=\"2\">{open}</object>");
    place.put("in.3mf", &forms::package(&forms::model(&objects, "<item objectid=\"1\"/><item objectid=\"2\"/>"), &[]));
    let report = place.repair("in.3mf", "out.3mf", &[]).expect(0).report();
    let model = zip::read(&place.read("out.3mf")).swap_remove(2).content;
    assert!(String::from_utf8(model).unwrap().contains(&support));
    assert!(report["input"]["findings"].to_string().contains("stays as it is"), "{report}");
    assert_eq!(report["objects"].as_array().unwrap().len(), 1);
}

/// Refused in one line, which names the reason, and nothing is written.
fn refused(name: &str, bytes: &[u8], words: &str) {
    let place = Place::new();
    place.put(name, bytes);
    let output = format!("out.{}", name.rsplit_once('.').unwrap().1);
    let ran = place.suture(["repair", name, "-o", &output]).expect(2);
    assert!(ran.stderr().contains(words), "{name}: {} does not say {words:?}", ran.stderr());
    assert_eq!(ran.stderr().lines().count(), 1, "{}", ran.stderr());
    assert_eq!(place.names(""), [name]);
}

#[test]
fn point_clouds_are_refused_by_name() {
    let header = "element vertex 2\nproperty float x\nproperty float y\nproperty float z\nend_header\n1 2 3\n4 5 6\n";
    refused("scan.ply", format!("ply\nformat ascii 1.0\n{header}").as_bytes(), "a point cloud of 2 points");
    refused("scan.off", b"OFF\n2 0 0\n1 2 3\n4 5 6\n", "a point cloud of 2 points");
    refused("scan.obj", b"v 1 2 3\nv 4 5 6\n", "a point cloud of 2 points");
}

#[test]
fn archives_that_are_no_package_or_a_trap_are_refused_by_name() {
    let mesh = stl::mesh(&open_box());
    refused(
        "parts.3mf",
        &zip::write(&[("part.stl", mesh.as_slice()), ("notes.txt", b"hi")], 0),
        "neither a 3MF package nor a packed AMF",
    );
    let model = forms::model("", "");
    let outside = forms::package(&model, &[("../../evil.stl", &mesh)]);
    refused("outside.3mf", &outside, "\"../../evil.stl\" leads out of its folder");
    refused("locked.3mf", &zip::write(&forms::parts(&model, &[]), ENCRYPTED), "is encrypted");
    let twice = forms::package(&model, &[("3D/3DMODEL.model", model.as_bytes())]);
    refused("twice.3mf", &twice, "is there twice");
    let mut cut = forms::write(Form::ThreeMf, &open_box());
    cut.truncate(cut.len() - 30);
    refused("cut.3mf", &cut, "cut off");
}

#[test]
fn packages_that_are_not_understood_are_refused_by_name() {
    let with = |form: &str| forms::package(&forms::model(form, ""), &[]);
    let model = String::from_utf8(zip::read(&forms::write(Form::ThreeMf, &open_box())).swap_remove(2).content).unwrap();
    let implicit = "<model requiredextensions=\"i\" xmlns:i=\"http://schemas.3mf.io/3dmanufacturing/implicit/2023/12\"";
    refused("implicit.3mf", &forms::package(&model.replace("<model", implicit), &[]), "implicit");
    let unknown = "<model requiredextensions=\"u\" xmlns:u=\"http://example.org/unheard/of\"";
    refused("unknown.3mf", &forms::package(&model.replace("<model", unknown), &[]), "http://example.org/unheard/of");
    refused("secret.3mf", &forms::package("%3McF and nothing that can be read", &[]), "is encrypted (3MF Secure Content)");
    refused("empty.3mf", &with(""), "without a mesh of triangles");
    let typed = model.replace("?>", "?><!DOCTYPE model [<!ENTITY a \"b\">]>");
    refused("typed.3mf", &forms::package(&typed, &[]), "document type");
}
