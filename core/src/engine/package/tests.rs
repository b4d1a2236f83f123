use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use crate::contract::report::{Outcome, Report};
use crate::contract::settings::{KeepAttributes, Limits, OutputFormat, Profile};
use crate::geometry::position;
use crate::io::read::archive_build::{Member, member, zip};
use crate::io::read::{Archive, PackageFile};
use crate::output::model::Elements;
use crate::testing::shaken_torus;
use crate::{Quiet, repair};

const CORE: &str = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02";
const PRUSA: &str = "http://schemas.slic3r.org/3mf/2017/06";

/// The triangles of a box, by its eight corners.
const BOX: [[usize; 3]; 12] = [
    [0, 2, 1],
    [0, 3, 2],
    [4, 5, 6],
    [4, 6, 7],
    [0, 1, 5],
    [0, 5, 4],
    [1, 2, 6],
    [1, 6, 5],
    [2, 3, 7],
    [2, 7, 6],
    [3, 0, 4],
    [3, 4, 7],
];

fn corner(k: usize) -> [u32; 3] {
    let [x, y] = [[0, 0], [10, 0], [10, 10], [0, 10]][k % 4];
    [x, y, if k < 4 { 0 } else { 10 }]
}

fn vertices() -> String {
    (0..8).map(corner).map(|[x, y, z]| format!("<vertex x=\"{x}.0\" y=\"{y}.0\" z=\"{z}.0\"/>")).collect()
}

/// Triangles with the attributes that `painted` gives for each.
fn triangles(of: &[[usize; 3]], painted: impl Fn(usize) -> String) -> String {
    of.iter().enumerate().map(|(k, [a, b, c])| format!("<triangle v1=\"{a}\" v2=\"{b}\" v3=\"{c}\"{}/>\n", painted(k))).collect()
}

fn object(id: u32, vertices: &str, triangles: &str) -> String {
    format!(
        "<object id=\"{id}\" name=\"part {id}\" type=\"model\"><mesh><vertices>{vertices}</vertices><triangles>{triangles}</triangles></mesh></object>"
    )
}

/// A package of these objects, with parts that a reader does not know.
fn package(objects: &[String], others: &[Member]) -> Vec<u8> {
    package_in("millimeter", objects, others)
}

fn package_in(unit: &str, objects: &[String], others: &[Member]) -> Vec<u8> {
    package_building(&(1..=objects.len()).collect::<Vec<_>>(), unit, objects, others)
}

/// A package that builds the objects of these numbers.
fn package_building(built: &[usize], unit: &str, objects: &[String], others: &[Member]) -> Vec<u8> {
    let items: String = built.iter().map(|id| format!("<item objectid=\"{id}\"/>")).collect();
    let model = format!(
        "<?xml version=\"1.0\"?>\n<model unit=\"{unit}\" xmlns=\"{CORE}\" xmlns:slic3rpe=\"{PRUSA}\"><metadata name=\"Title\">A vase</metadata><resources>{}</resources><build>{items}</build></model>",
        objects.concat()
    );
    let relationships = "<Relationships xmlns='http://schemas.openxmlformats.org/package/2006/relationships'>\
        <Relationship Id='r' Type='http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel' Target='/3D/3dmodel.model'/></Relationships>";
    let types = "<Types xmlns='http://schemas.openxmlformats.org/package/2006/content-types'/>";
    let mut all =
        vec![member("[Content_Types].xml", types), member("_rels/.rels", relationships), member("3D/3dmodel.model", model)];
    all.extend(others.iter().cloned());
    zip(&all)
}

/// What a repair made of a package: its report, and the text of an entry.
struct Repaired {
    folder: tempfile::TempDir,
    report: Report,
}

impl Repaired {
    fn of(package: &[u8], profile: &Profile) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let (input, output) = (folder.path().join("in.3mf"), folder.path().join("out.3mf"));
        std::fs::write(&input, package).unwrap();
        let limits = Limits { threads: 2, ..Limits::default() };
        let report = repair(&input, &output, profile, &limits, &Quiet).unwrap();
        Self { folder, report }
    }

    fn bytes(&self) -> Vec<u8> {
        std::fs::read(self.folder.path().join("out.3mf")).unwrap()
    }

    fn text(&self) -> String {
        let limits = Limits { spool: Some(self.folder.path().into()), ..Limits::default() };
        let package = PackageFile::open(&self.folder.path().join("out.3mf"), &limits, &Quiet).unwrap().unwrap();
        String::from_utf8(package.text(0).to_vec()).unwrap()
    }
}

/// Bytes of an entry as they are held.
fn raw(package: &[u8], name: &str) -> Vec<u8> {
    let archive = Archive::open(package).map_err(|rejection| rejection.at(Path::new("a"))).unwrap();
    package[archive.find(name).unwrap().whole.clone()].to_vec()
}

fn mmu(code: &str) -> String {
    format!(" slic3rpe:mmu_segmentation=\"{code}\"")
}

#[test]
fn a_hole_is_filled_in_the_colour_of_its_rim_and_all_else_stays() {
    let open = object(1, &vertices(), &triangles(&BOX[..11], |_| mmu("8")));
    let whole = object(2, &vertices(), &triangles(&BOX, |k| mmu(["4", "8"][k % 2])));
    let others = [member("Metadata/thumbnail.png", b"\x89PNG"), member("Metadata/strange.bin", [7; 5000])];
    let input = package(&[open.clone(), whole.clone()], &others);
    let repaired = Repaired::of(&input, &Profile::default());
    let (report, text) = (&repaired.report, repaired.text());
    assert_eq!((report.outcome, report.objects.len()), (Outcome::Repaired, 2), "{:?}", report.verdict);
    assert_eq!(report.objects.iter().map(|object| object.outcome).collect::<Vec<_>>(), [Outcome::Repaired, Outcome::Clean]);
    assert!(text.contains(&whole), "{text}");
    let (before, after) = open.split_at(open.find("\n</triangles>").unwrap());
    let rest = text.split_once(before).unwrap().1;
    let (new, behind) = rest.split_at(rest.find("\n</triangles>").unwrap());
    assert!(behind.starts_with(after), "{behind}");
    assert!(new.starts_with("\n<triangle v1=") && new.ends_with(" slic3rpe:mmu_segmentation=\"8\"/>"), "{new}");
    let attributes = report.attributes.unwrap();
    assert_eq!((attributes.kept, attributes.inherited, attributes.lost), (23, 1, 0));
    for name in ["[Content_Types].xml", "_rels/.rels", "Metadata/thumbnail.png", "Metadata/strange.bin"] {
        assert_eq!(raw(&input, name), raw(&repaired.bytes(), name), "{name}");
    }
}

/// A torus with two triangles without area, which go, and two holes, whose triangles come in the places of those; then most of all go.
#[test]
fn a_repaired_object_is_made_simpler() {
    let whole = shaken_torus(0.0);
    let vertices: Vec<[u32; 3]> = whole.iter().flatten().map(|corner| position::bits(*corner)).collect();
    let numbers: BTreeMap<[u32; 3], usize> = vertices.iter().collect::<BTreeSet<_>>().into_iter().copied().zip(0..).collect();
    let text = |corner: &[u32; 3]| {
        let [x, y, z] = corner.map(f32::from_bits);
        format!("<vertex x=\"{x}\" y=\"{y}\" z=\"{z}\"/>")
    };
    let mut faces: Vec<[usize; 3]> = vertices.chunks(3).map(|corners| [0, 1, 2].map(|k: usize| numbers[&corners[k]])).collect();
    faces.remove(whole.len() / 2);
    faces.remove(10);
    faces.splice(3..3, [[7, 7, 7], [9, 9, 9]]);
    let input = package(&[object(1, &numbers.keys().map(text).collect::<String>(), &triangles(&faces, |_| String::new()))], &[]);
    let repaired = Repaired::of(&input, &Profile { simplify_triangles: 20_000, ..Profile::default() });
    assert_eq!((repaired.report.outcome, repaired.text().matches("<triangle ").count()), (Outcome::Repaired, 20_000));
}

#[test]
fn a_good_package_is_copied() {
    let input = package(&[object(1, &vertices(), &triangles(&BOX, |_| String::new()))], &[]);
    let repaired = Repaired::of(&input, &Profile::default());
    assert_eq!((repaired.report.outcome, repaired.bytes()), (Outcome::Clean, input));
}

/// Its second and third corner change places, and their colours with them.
#[test]
fn a_triangle_that_was_turned_keeps_its_colours() {
    let mut turned = BOX;
    turned[5].swap(1, 2);
    let coloured = |k: usize| if k == 5 { " pid=\"9\" p1=\"0\" p2=\"1\" p3=\"2\"".into() } else { String::new() };
    let input = package(&[object(1, &vertices(), &triangles(&turned, coloured))], &[]);
    let repaired = Repaired::of(&input, &Profile::default());
    let expected = triangles(&BOX, |k| if k == 5 { " pid=\"9\" p1=\"0\" p2=\"2\" p3=\"1\"".into() } else { String::new() });
    assert!(repaired.text().contains(&expected), "{}", repaired.text());
}

/// Consumers of 3MF tell vertices apart by number: what is closed by position is open to them.
#[test]
fn vertices_at_one_position_become_one() {
    let positions: String =
        BOX.iter().flatten().map(|k| corner(*k)).map(|[x, y, z]| format!("<vertex x=\"{x}\" y=\"{y}\" z=\"{z}\"/>")).collect();
    let own: Vec<[usize; 3]> = (0..12).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect();
    let input = package(&[object(1, &positions, &triangles(&own, |_| mmu("4")))], &[]);
    let repaired = Repaired::of(&input, &Profile::default());
    assert_eq!(repaired.report.outcome, Outcome::Repaired);
    let first = |k: usize| BOX.iter().flatten().position(|other| *other == k).unwrap();
    let expected = BOX.map(|triangle| triangle.map(first));
    assert!(repaired.text().contains(&triangles(&expected, |_| mmu("4"))), "{}", repaired.text());
}

#[test]
fn volumes_of_a_project_are_meshes_of_their_own() {
    // Two boxes that share a side, each with vertices of its own, the first without its last triangle.
    let second: String = (0..8).map(corner).map(|[x, y, z]| format!("<vertex x=\"{}\" y=\"{y}\" z=\"{z}\"/>", x + 10)).collect();
    let mut both = BOX[..11].to_vec();
    both.extend(BOX.map(|triangle| triangle.map(|k| k + 8)));
    let config = "<config><object id=\"1\"><volume firstid=\"0\" lastid=\"10\"/><volume firstid=\"11\" lastid=\"22\">\
        <metadata type=\"volume\" key=\"volume_type\" value=\"ParameterModifier\"/></volume></object></config>";
    let others = [member("Metadata/Slic3r_PE_model.config", config)];
    let input = package(&[object(1, &[vertices(), second].concat(), &triangles(&both, |_| String::new()))], &others);
    let repaired = Repaired::of(&input, &Profile::default());
    assert_eq!(repaired.report.outcome, Outcome::Repaired, "{:?}", repaired.report.verdict);
    let limits = Limits { spool: Some(repaired.folder.path().into()), ..Limits::default() };
    let package = PackageFile::open(&repaired.folder.path().join("out.3mf"), &limits, &Quiet).unwrap().unwrap();
    let ranges: Vec<_> = package.volumes().all().iter().map(|volume| volume.triangles.clone()).collect();
    assert_eq!(ranges, [0..12, 12..24]);
}

#[test]
fn a_profile_may_refuse_to_lose_attributes() {
    // A degenerate triangle with paint goes, and nothing is left of it.
    let mut more = BOX.to_vec();
    more.push([0, 0, 1]);
    let input = package(&[object(1, &vertices(), &triangles(&more, |_| mmu("4")))], &[]);
    let outcome = |attributes| {
        let repaired = Repaired::of(&input, &Profile { attributes, ..Profile::default() });
        (repaired.report.outcome, repaired.report.output.is_some())
    };
    assert_eq!(outcome(KeepAttributes::Best), (Outcome::Repaired, true));
    assert_eq!(outcome(KeepAttributes::Keep), (Outcome::NeedsReview, true));
    assert_eq!(outcome(KeepAttributes::Refuse), (Outcome::NotGood, false));
    // No other format has a place for paint.
    let input = package(&[object(1, &vertices(), &triangles(&BOX, |_| mmu("4")))], &[]);
    let profile = Profile { attributes: KeepAttributes::Keep, format: OutputFormat::Ply, ..Profile::default() };
    let report = Repaired::of(&input, &profile).report;
    assert_eq!((report.outcome, report.attributes.map(|attributes| attributes.lost)), (Outcome::NeedsReview, Some(12)));
}

fn with_sets(id: u32, of: &[[usize; 3]], references: &str) -> String {
    let sets = format!(
        "<t:trianglesets xmlns:t=\"http://schemas.microsoft.com/3dmanufacturing/trianglesets/2021/07\">\n<t:triangleset name=\"a\" \
        identifier=\"a\">{references}</t:triangleset>\n</t:trianglesets>"
    );
    object(id, &vertices(), &triangles(of, |_| String::new())).replace("</mesh>", &format!("{sets}</mesh>"))
}

/// Of a triangle that is there three times one stays, and one makes room for that which closes the hole, so that all behind it have other numbers. The new
/// triangle's rim is in the set for the most part. One triangle is turned.
#[test]
fn sets_of_triangles_have_the_new_numbers() {
    let mut broken = BOX[..11].to_vec();
    broken.splice(2..2, [BOX[1]; 2]);
    broken[9].swap(0, 1);
    // In the set are triangle 1, [1, 6, 5], [2, 3, 7] and [3, 0, 4]. [3, 4, 7] is missing; its rim is of [2, 3, 7], [3, 0, 4] and [4, 6, 7].
    let references = "<t:ref index=\"1\"/><t:ref index=\"9\"/>\n<t:ref index=\"10\"/><t:ref index=\"12\"/>";
    let whole = with_sets(2, &BOX, "<t:ref index=\"3\"/>");
    let repaired = Repaired::of(&package(&[with_sets(1, &broken, references), whole.clone()], &[]), &Profile::default());
    let text = repaired.text();
    assert_eq!(repaired.report.outcome, Outcome::Repaired);
    let expected: String = [1, 2, 8, 9, 11].map(|k| format!("<t:ref index=\"{k}\"/>")).concat() + "</t:triangleset>";
    assert!(text.contains(&expected), "{text}");
    assert!(text.contains(&whole), "{text}");
    assert!(repaired.report.input.findings.is_empty(), "{:?}", repaired.report.input.findings);
}

#[test]
fn sets_of_triangles_that_are_not_understood_are_left_out_where_numbers_change() {
    let sets = "<t:triangleset name=\"b\" identifier=\"b\"><t:ref index=\"3\"/></t:triangleset>";
    let repaired = |attributes| {
        Repaired::of(&package(&[with_sets(1, &BOX[..11], sets)], &[]), &Profile { attributes, ..Profile::default() })
    };
    let best = repaired(KeepAttributes::Best);
    assert_eq!((best.report.outcome, best.text().contains("trianglesets")), (Outcome::Repaired, false), "{}", best.text());
    let findings = &best.report.input.findings;
    assert!(findings.iter().any(|finding| finding.contains("sets of triangles of 1 object are left out")), "{findings:?}");
    assert_eq!(repaired(KeepAttributes::Keep).report.outcome, Outcome::NeedsReview);
    assert_eq!(repaired(KeepAttributes::Refuse).report.outcome, Outcome::NotGood);
}

/// PrusaSlicer takes all vertices between the first and the last of a volume for the volume's own.
#[test]
fn new_vertices_of_a_volume_stand_before_those_of_the_next() {
    let shifted = |by: u32| -> String {
        (0..8).map(corner).map(|[x, y, z]| format!("<vertex x=\"{}\" y=\"{}\" z=\"{}\"/>\n", x + by, y + by, z + by)).collect()
    };
    let all: Vec<[usize; 3]> = [0, 8, 16].iter().flat_map(|from| BOX.map(|triangle| triangle.map(|k| k + from))).collect();
    let config = "<config><object id=\"1\"><volume firstid=\"0\" lastid=\"23\"/><volume firstid=\"24\" lastid=\"35\">\
        <metadata type=\"volume\" key=\"volume_type\" value=\"ParameterModifier\"/></volume></object></config>";
    let vertices = [shifted(0), shifted(5), shifted(100)].concat();
    let coloured = |k: usize| if k < 24 { mmu("4") } else { String::new() };
    let input =
        package(&[object(1, &vertices, &triangles(&all, coloured))], &[member("Metadata/Slic3r_PE_model.config", config)]);
    let repaired = Repaired::of(&input, &Profile::default());
    assert_eq!(repaired.report.outcome, Outcome::Repaired, "{:?}", repaired.report.verdict);
    let limits = Limits { spool: Some(repaired.folder.path().into()), ..Limits::default() };
    let package = PackageFile::open(&repaired.folder.path().join("out.3mf"), &limits, &Quiet).unwrap().unwrap();
    let place = package.meshes()[0];
    let (text, _, within) = package.mesh_at(place);
    let corners: Vec<_> = Elements::within(text, within).map(|element| (element.vertices, element.attributes.len())).collect();
    let first = package.volumes().all()[0].triangles.end as usize;
    let own = corners[..first].iter().flat_map(|(vertices, _)| vertices).max().unwrap();
    let next = corners[first..].iter().flat_map(|(vertices, _)| vertices).min().unwrap();
    assert!(*own > 15 && own < next, "{own} {next}");
    assert_eq!(corners.len() - first, 12);
    assert!(corners[..first].iter().all(|(_, attributes)| *attributes == 1), "each part of a coloured triangle is coloured");
}

/// Two closed boxes far from each other, each a volume of one object; the second one only says where something is cut away.
fn with_a_negative_volume(names: &[&str]) -> Vec<u8> {
    let second: String = (0..8).map(corner).map(|[x, y, z]| format!("<vertex x=\"{}\" y=\"{y}\" z=\"{z}\"/>", x + 50)).collect();
    let mut both = BOX[..11].to_vec();
    both.extend(BOX.map(|triangle| triangle.map(|k| k + 8)));
    let config = "<config><object id=\"1\"><volume firstid=\"0\" lastid=\"10\"/><volume firstid=\"11\" lastid=\"22\">\
        <metadata type=\"volume\" key=\"volume_type\" value=\"NegativeVolume\"/></volume></object></config>";
    let others: Vec<Member> = names.iter().map(|name| member(name, config)).collect();
    package(&[object(1, &[vertices(), second].concat(), &triangles(&both, |_| String::new()))], &others)
}

#[test]
fn other_formats_hold_parts_of_the_model_alone() {
    let input = with_a_negative_volume(&["Metadata/Slic3r_PE_model.config"]);
    for format in [OutputFormat::Stl, OutputFormat::Ply, OutputFormat::Amf] {
        let repaired = Repaired::of(&input, &Profile { format, ..Profile::default() });
        let report = &repaired.report;
        // What the slicer would cut away is solid there.
        assert_eq!((report.outcome, report.verdict.good), (Outcome::NeedsReview, true), "{:?}", report.verdict);
        assert!(report.verdict.reasons[0].starts_with("negative volumes of a slicer's project"), "{:?}", report.verdict);
        assert_eq!(report.output.as_ref().map(|output| output.triangles), Some(12));
        assert_eq!(report.certificate.as_ref().map(|own| (own.printable, own.triangles)), Some((true, 12)));
    }
}

/// The verdict is of the bytes that are written: two objects that are good each may be no solid where they are built.
#[test]
fn all_objects_as_one_mesh_are_judged_as_they_are_built() {
    let input = package(&[1, 2].map(|id| object(id, &vertices(), &triangles(&BOX, |_| String::new()))), &[]);
    assert_eq!(Repaired::of(&input, &Profile::default()).report.outcome, Outcome::Clean);
    let repaired = Repaired::of(&input, &Profile { format: OutputFormat::Stl, ..Profile::default() });
    let report = &repaired.report;
    assert_eq!((report.outcome, report.verdict.good), (Outcome::NotGood, false));
    assert!(report.verdict.reasons[0].starts_with("all objects as one mesh: "), "{:?}", report.verdict.reasons);
    assert!(report.certificate.as_ref().is_some_and(|own| !own.printable));
}

#[test]
fn volumes_are_renumbered_wherever_they_stand() {
    let names = ["Metadata/Slic3r_PE_model.config", "Metadata/SuperSlicer_model.config", "Metadata/Slic3r_model.config"];
    for names in [&names[..], &names[1..2]] {
        let repaired = Repaired::of(&with_a_negative_volume(names), &Profile::default());
        assert_eq!(repaired.report.outcome, Outcome::Repaired, "{:?}", repaired.report.verdict);
        let limits = Limits { spool: Some(repaired.folder.path().into()), ..Limits::default() };
        let package = PackageFile::open(&repaired.folder.path().join("out.3mf"), &limits, &Quiet).unwrap().unwrap();
        assert_eq!(package.volumes().configs.len(), names.len());
        for config in &package.volumes().configs {
            let ranges: Vec<_> = config.volumes.iter().map(|volume| volume.triangles.clone()).collect();
            assert_eq!(ranges, [0..12, 12..24]);
        }
    }
}

/// Slic3r 1.3 writes its volumes into the mesh.
#[test]
fn volumes_in_a_mesh_are_meshes_of_their_own() {
    let second: String = (0..8).map(corner).map(|[x, y, z]| format!("<vertex x=\"{}\" y=\"{y}\" z=\"{z}\"/>", x + 5)).collect();
    let mut both = BOX[..11].to_vec();
    both.extend(BOX.map(|triangle| triangle.map(|k| k + 8)));
    let volumes = |last: usize, modifier: u8| {
        format!(
            "<slic3r:volumes><slic3r:volume ts=\"0\" te=\"{last}\" modifier=\"0\" ><slic3r:metadata type=\"a\" config=\"1\"/></slic3r:volume>\
            <slic3r:volume ts=\"{}\" te=\"{}\" modifier=\"{modifier}\" /></slic3r:volumes></mesh>",
            last + 1,
            last + 12
        )
    };
    for modifier in [0, 1] {
        let text = object(1, &[vertices(), second.clone()].concat(), &triangles(&both, |_| String::new()));
        let input = package(&[text.replace("</mesh>", &volumes(10, modifier))], &[]);
        let repaired = Repaired::of(&input, &Profile::default());
        assert_eq!(repaired.report.outcome, Outcome::Repaired, "{:?}", repaired.report.verdict);
        assert!(repaired.text().contains(&volumes(11, modifier)), "{}", repaired.text());
        assert_eq!(repaired.report.objects.len(), 2 - usize::from(modifier));
        let other = Repaired::of(&input, &Profile { format: OutputFormat::Stl, ..Profile::default() });
        // The two boxes cross.
        let expected = if modifier == 0 { (Outcome::NotGood, Some(24)) } else { (Outcome::Repaired, Some(12)) };
        assert_eq!((other.report.outcome, other.report.output.map(|output| output.triangles)), expected);
    }
}

/// Bambu Studio and OrcaSlicer say beside the model which components are cut away.
#[test]
fn objects_that_a_project_cuts_away_are_no_parts() {
    let far: String = (0..8).map(corner).map(|[x, y, z]| format!("<vertex x=\"{}\" y=\"{y}\" z=\"{z}\"/>", x + 50)).collect();
    let holes = triangles(&BOX[..11], |_| String::new());
    let of = |id: u32| {
        format!("<object id=\"{id}\"><components><component objectid=\"1\"/><component objectid=\"2\"/></components></object>")
    };
    let objects = [object(1, &vertices(), &holes), object(2, &far, &holes), of(3), of(4)];
    let role = |id: u32, role: &str| {
        format!(
            "<object id=\"{id}\"><part id=\"1\" subtype=\"normal_part\"/><part id=\"2\" subtype=\"{role}\"><mesh_stat/></part></object>"
        )
    };
    let config = format!("<config>{}{}</config>", role(3, "negative_part"), role(4, "normal_part"));
    let others = [member("Metadata/model_settings.config", config)];
    let package = |built: &[usize]| package_building(built, "millimeter", &objects, &others);

    let own = Repaired::of(&package(&[3]), &Profile::default());
    assert_eq!((own.report.outcome, own.report.objects.len()), (Outcome::Repaired, 1), "{:?}", own.report.verdict);
    assert!(own.text().contains(&objects[1]), "what is cut away stays as it is");
    let stl = Profile { format: OutputFormat::Stl, ..Profile::default() };
    let other = Repaired::of(&package(&[3]), &stl).report;
    assert_eq!((other.outcome, other.output.map(|output| output.triangles)), (Outcome::NeedsReview, Some(12)));
    // The same mesh is material in another object.
    let both = Repaired::of(&package(&[4]), &Profile::default());
    assert_eq!((both.report.outcome, both.report.objects.len()), (Outcome::Repaired, 2), "{:?}", both.report.verdict);
    let other = Repaired::of(&package(&[4]), &stl).report;
    assert_eq!((other.outcome, other.output.map(|output| output.triangles)), (Outcome::Repaired, Some(24)));
}

#[test]
fn a_conversion_tells_of_objects_that_are_left_out_and_keeps_the_title() {
    let folder = tempfile::tempdir().unwrap();
    let [input, amf, copy] = ["in.3mf", "out.amf", "copy.3mf"].map(|name| folder.path().join(name));
    let whole = |id| object(id, &vertices(), &triangles(&BOX, |_| String::new()));
    let support = whole(2).replace("type=\"model\"", "type=\"support\"");
    std::fs::write(&input, package(&[whole(1), support], &[])).unwrap();
    let limits = Limits { threads: 2, ..Limits::default() };
    let made = |output: &Path, format| crate::convert(&input, output, format, &limits, &Quiet).unwrap();
    let converted = made(&amf, OutputFormat::Amf);
    let expected = ["1 object of the build that is support, surface or no mesh of triangles, left out"];
    assert_eq!((converted.input.findings.as_slice(), converted.output.triangles), (&expected.map(String::from)[..], 12));
    assert!(std::fs::read_to_string(&amf).unwrap().contains("A vase"));
    // A copy has all of it.
    assert_eq!(made(&copy, OutputFormat::ThreeMf).input.findings, [""; 0]);
}

#[test]
fn an_object_of_blanks_alone_stays() {
    let input = package(&[object(1, &vertices(), &triangles(&BOX[..11], |_| String::new())), object(2, "\n", "\n")], &[]);
    let repaired = Repaired::of(&input, &Profile::default());
    assert_eq!((repaired.report.outcome, repaired.report.objects.len()), (Outcome::Repaired, 1), "{:?}", repaired.report.verdict);
    assert!(repaired.text().contains(&object(2, "\n", "\n")));
}

#[test]
fn amf_has_no_centimetre() {
    let folder = tempfile::tempdir().unwrap();
    let (input, output) = (folder.path().join("in.3mf"), folder.path().join("out.amf"));
    let objects = [object(1, &vertices(), &triangles(&BOX[..11], |_| String::new()))];
    for (unit, is_made) in [("inch", true), ("centimeter", false)] {
        std::fs::write(&input, package_in(unit, &objects, &[])).unwrap();
        let profile = Profile { format: OutputFormat::Amf, ..Profile::default() };
        let made = repair(&input, &output, &profile, &Limits { threads: 2, ..Limits::default() }, &Quiet);
        assert_eq!(made.is_ok(), is_made, "{unit}");
        assert!(made.err().is_none_or(|error| error.to_string().contains("in.3mf")), "it is named as it was given");
        assert_eq!(output.exists(), is_made);
        let _ = std::fs::remove_file(&output);
    }
}

/// A ball as an object: rings of triangles between two poles.
fn ball(id: u32, radius: f64) -> String {
    let (rings, around) = (12, 24);
    let at = |ring: usize, k: usize| {
        let (tilt, turn) = (std::f64::consts::PI * ring as f64 / rings as f64, std::f64::consts::TAU * k as f64 / around as f64);
        let [x, y, z] = [tilt.sin() * turn.cos(), tilt.sin() * turn.sin(), tilt.cos()].map(|x| radius * x);
        format!("<vertex x=\"{x}\" y=\"{y}\" z=\"{z}\"/>")
    };
    let number = |ring: usize, k: usize| match ring {
        0 => 0,
        ring if ring == rings => 1 + (rings - 1) * around,
        ring => 1 + (ring - 1) * around + k % around,
    };
    let inner: String = (1..rings).flat_map(|ring| (0..around).map(move |k| (ring, k))).map(|(ring, k)| at(ring, k)).collect();
    let quads = (0..rings).flat_map(|ring| (0..around).map(move |k| (ring, k)));
    let corners = |(ring, k)| [number(ring, k), number(ring + 1, k), number(ring + 1, k + 1), number(ring, k + 1)];
    let halves = quads.map(corners).flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]);
    let faces: Vec<[usize; 3]> = halves.filter(|[a, b, c]| a != b && b != c && c != a).collect();
    object(id, &[at(0, 0), inner, at(rings, 0)].concat(), &triangles(&faces, |_| String::new()))
}

/// The report of both objects has the sums of their counts, and the largest of their distances.
#[test]
fn what_was_done_to_the_surfaces_is_told_of_all_objects() {
    let profile = Profile { simplify_ratio: 0.25, smooth_waves_below_mm: 1.0, ..Profile::default() };
    let told = |objects: &[String]| {
        let Report { simplified, smoothed, .. } = Repaired::of(&package(objects, &[]), &profile).report;
        (simplified.unwrap(), smoothed.unwrap())
    };
    let [small, large, both] =
        [vec![ball(1, 1.0)], vec![ball(1, 30.0)], vec![ball(1, 1.0), ball(2, 30.0)]].map(|objects| told(&objects));
    assert_eq!(both.0.before, 2 * 528);
    assert_eq!(both.0.after, small.0.after + large.0.after);
    assert!(large.0.to_result > 10.0 * small.0.to_result && small.0.to_result > 0.0, "{small:?} {large:?}");
    assert_eq!([both.0.to_result, both.0.from_result], [large.0.to_result, large.0.from_result]);
    assert_eq!(both.0.volume_change, small.0.volume_change + large.0.volume_change);
    assert!(small.1 != large.1, "{small:?} {large:?}");
    assert_eq!([both.1.moved, both.1.held], [small.1.moved + large.1.moved, small.1.held + large.1.held]);
    assert_eq!(both.1.displacement, small.1.displacement.max(large.1.displacement));
    assert_eq!(both.1.why_not.is_some(), small.1.why_not.is_some() || large.1.why_not.is_some());
}
