//! Models that are sound, and models that are traps.

use std::path::Path;

use proptest::prelude::*;

use super::super::spool::Context;
use super::build::{DECLARED, TETRAHEDRON, model, package};
use super::model::{Content, Model, Place, Purpose, Unit};
use super::transform::Transform;
use crate::contract::error::{Error, Result};
use crate::contract::progress::Quiet;
use crate::contract::settings::Limits;
use crate::io::record::{Point, corners};

/// What `look` sees of a package.
fn seen<R>(bytes: &[u8], look: impl FnOnce(&Model, &Context<'_>) -> Result<R>) -> Result<R> {
    let (limits, folder) = (Limits::default(), std::env::temp_dir());
    let context = Context { path: Path::new("a.3mf"), spool: &folder, limits: &limits, progress: &Quiet, passed: None };
    look(&Model::open(bytes, &context)?, &context)
}

fn reason<R>(result: Result<R>) -> String {
    match result {
        Err(Error::Unreadable { reason, .. }) => reason,
        Err(other) => panic!("{other}"),
        Ok(_) => panic!("it is read"),
    }
}

/// Why a model is refused.
fn refusal(objects: &str, build: &str) -> String {
    reason(seen(&package(model(objects, build), &[]), |_, _| Ok(())))
}

const FIRST: Place = Place { part: 0, object: 0 };

type Seen = (Vec<[Point; 3]>, Vec<String>, [u64; 2]);

/// Triangles, findings and counts of the first object.
fn mesh(start: &str) -> Result<Seen> {
    seen(&package(start, &[]), |model, context| {
        let read = model.records(FIRST, context)?;
        let triangles = read.parsed.records.all().iter().map(corners).collect();
        let findings = read.parsed.findings.into_iter().map(|finding| finding.text).collect();
        Ok((triangles, findings, [read.triangles, read.with_any]))
    })
}

fn object(inner: &str) -> String {
    model(&format!("<object id='1'>{inner}</object>"), "<item objectid='1'/>")
}

#[test]
fn an_outline_has_all_that_a_model_says() {
    let start = format!(
        "<model unit='inch' {DECLARED}><metadata name='Title'>a &lt;b&gt;</metadata><resources><basematerials id='9'/>\
         <object id='2' type='support' name='x&amp;y' pid='9' pindex='1' p:UUID='u'>{TETRAHEDRON}</object>\
         <object id='3'><components><component objectid='2' transform='1 0 0 0 1 0 0 0 1 5 0 0'/><component objectid='7' p:path='/3D/o/b.model'/>\
         </components></object></resources><build><item objectid='3' transform='2 0 0 0 2 0 0 0 2 0 1 0' printable='0'/></build></model>"
    );
    let other = model(&format!("<object id='7'>{TETRAHEDRON}</object>"), "<item objectid='99'/>");
    let bytes = package(&start, &[("3D/o/B.model", &other)]);
    let outline = seen(&bytes, |model, context| {
        assert_eq!((model.unit(), model.parts.len(), model.entries.len()), (Unit::Inch, 2, 4));
        assert_eq!(model.parts[0].metadata, [("Title".into(), "a <b>".into())]);
        let object = model.object(FIRST).unwrap();
        assert_eq!((object.id, object.purpose, object.name.as_str()), (2, Purpose::Support, "x&y"));
        assert_eq!(object.uuid, "u");
        let Content::Mesh(mesh) = &object.content else { panic!("a mesh") };
        let text = |range: &std::ops::Range<usize>| &start[range.clone()];
        assert_eq!(text(&mesh.whole), TETRAHEDRON);
        assert!(text(&object.whole).starts_with("<object id='2'") && text(&object.whole).ends_with("</mesh></object>"));
        assert!(text(&mesh.vertices.whole).starts_with("<vertices>") && text(&mesh.vertices.whole).ends_with("</vertices>"));
        assert!(text(&mesh.triangles.inner).starts_with("<triangle v1") && text(&mesh.triangles.inner).ends_with("/>"));
        assert_eq!(model.records(FIRST, context)?.parsed.records.all().len(), 4);
        assert!(!model.items()[0].printable);
        let mut places = Vec::new();
        model.instances(&model.items()[0], |place, transform, _| places.push((place, *transform)));
        Ok(places)
    });
    let moved = |text| Transform::parse(text).unwrap();
    let expected = [(FIRST, moved("2 0 0 0 2 0 0 0 2 10 1 0")), (Place { part: 1, object: 0 }, moved("2 0 0 0 2 0 0 0 2 0 1 0"))];
    assert_eq!(outline.unwrap(), expected);
}

#[test]
fn every_form_of_a_mesh_is_the_same_mesh() {
    let plain = mesh(&object(TETRAHEDRON)).unwrap();
    assert_eq!((plain.0.len(), plain.1.len()), (4, 0));
    assert_eq!(plain.0[0], [[0.0; 3], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]]);
    let forms = [
        TETRAHEDRON.replace('"', "'"),
        TETRAHEDRON.replace("<vertex ", "<!-- </vertices> <vertex/> --><vertex "),
        TETRAHEDRON.replace("<triangle ", "<?x </triangles>?><triangle "),
        TETRAHEDRON.replace("/>", "></vertex>").replace("\"></vertex><triangle", "\"></triangle><triangle"),
        TETRAHEDRON.replace("x=\"1\"", "x = \"&#49;\""),
        TETRAHEDRON.replace("v1=\"1\"", "v1=\" 1 \""),
        TETRAHEDRON.replace("<vertex ", "stray <other/><vertex a:b='&gt;' xmlns:a='u' "),
        TETRAHEDRON.replace("<vertex ", "<vertex xmlns='else' x=\"7\"/><vertex "),
        TETRAHEDRON
            .replace("<mesh", "<c:mesh xmlns:c='http://schemas.microsoft.com/3dmanufacturing/core/2015/02'")
            .replace("</", "</c:")
            .replace("<vert", "<c:vert")
            .replace("<tri", "<c:tri"),
        TETRAHEDRON.replace('\n', "\r\n"),
    ];
    for form in forms {
        // The ends of elements were replaced all alike above.
        let form = if form.contains("></vertex>") { ends_of_their_own(&form) } else { form };
        let read = mesh(&object(&form)).unwrap_or_else(|error| panic!("{error}: {form}"));
        assert_eq!((&read.0, &read.1), (&plain.0, &plain.1), "{form}");
    }
}

/// Ends each triangle with its own end tag.
fn ends_of_their_own(form: &str) -> String {
    let (vertices, triangles) = form.split_once("<triangles>").unwrap();
    format!("{vertices}<triangles>{}", triangles.replace("</vertex>", "</triangle>"))
}

#[test]
fn attributes_of_triangles_are_counted() {
    let with = TETRAHEDRON
        .replace("v3=\"1\"", "v3=\"1\" pid=\"1\" p1=\"0\"")
        .replace("v2=\"1\"", "v2=\"1\" paint_color=\"4\"")
        .replace("v3=\"2\"", "v3=\"2\" a:b=\"0\"");
    for form in [with.clone(), with.replace('"', "'")] {
        assert_eq!(mesh(&object(&form)).unwrap().2, [4, 3], "{form}");
    }
}

#[test]
fn damage_of_a_mesh_is_told() {
    let astray = mesh(&object(&TETRAHEDRON.replace("v1=\"1\"", "v1=\"4\""))).unwrap();
    assert_eq!(astray.0.len(), 3);
    assert!(astray.1[0].contains("not there") && astray.1[0].ends_with("face 4"), "{:?}", astray.1);
    let missing = mesh(&object(&TETRAHEDRON.replace("v1=\"1\" ", ""))).unwrap();
    assert_eq!(missing.1, astray.1);
    let twice = mesh(&object(&TETRAHEDRON.replace("v1=\"1\"", "v1=\"2\""))).unwrap();
    assert_eq!((twice.0.len(), twice.1.len()), (4, 1));
    assert!(twice.1[0].contains("same vertex twice"));
    let no_number = mesh(&object(&TETRAHEDRON.replace("x=\"1\"", "x=\"one\""))).unwrap();
    assert!(no_number.0[0][2][0].is_nan() && no_number.1[0].contains("1 vertex with a coordinate"));
    assert!(reason(mesh(&object(&TETRAHEDRON.replace("x=\"0\"", "x=\"\"")))).contains("3 of 4 vertices"));
    assert!(reason(mesh(&object(&TETRAHEDRON.replace("v1=\"0\"", "v1=\"-1\"")))).contains("3 of 4 faces"));
    // Not well-formed: a tag within a tag, an attribute twice, text that is none.
    for (from, to) in
        [("v1=\"1\"", "v1=\"1\" v1=\"1\""), ("v1=\"1\"", "v1=1"), ("<triangle v1=\"1\"", "<triangle <triangle v1=\"1\"")]
    {
        assert!(reason(mesh(&object(&TETRAHEDRON.replace(from, to)))).contains("no sound XML"), "{to}");
    }
}

#[test]
fn what_is_no_mesh_of_triangles_is_listed_and_refused_when_it_is_asked_for() {
    let lattice = TETRAHEDRON.replace(
        "</mesh>",
        "<b:beamlattice xmlns:b='http://schemas.microsoft.com/3dmanufacturing/beamlattice/2017/02'><b:beams/></b:beamlattice></mesh>",
    );
    assert!(reason(mesh(&object(&lattice))).contains("beam lattice"));
    assert!(reason(mesh(&object("<l:levelset xmlns:l='u'/>"))).contains("level set"));
    assert!(reason(mesh(&object(""))).contains("holds nothing"));
}

#[test]
fn extensions_that_are_required_and_not_understood_are_refused() {
    let required = |declared: &str, prefixes: &str| {
        let start = object(TETRAHEDRON).replacen("<model ", &format!("<model {declared} requiredextensions='{prefixes}' "), 1);
        seen(&package(start, &[]), |_, _| Ok(()))
    };
    assert!(required("", "p").is_ok());
    assert!(required("xmlns:x='http://elsewhere/extension'", "").is_ok());
    assert!(reason(required("xmlns:x='http://elsewhere/extension'", "p x")).contains("http://elsewhere/extension"));
    assert!(reason(required("", "x")).contains("not understood"));
    let boolean = "xmlns:x='http://schemas.3mf.io/3dmanufacturing/booleanoperations/2023/07'";
    assert!(reason(required(boolean, "x")).contains("Booleans"));
}

#[test]
fn f14_builds_that_are_traps_are_refused() {
    let object = |id: u32, of: &[u32]| {
        let inner: String = of.iter().map(|of| format!("<component objectid='{of}'/>")).collect();
        format!("<object id='{id}'><components>{inner}</components></object>")
    };
    let build = "<item objectid='1'/>";
    assert!(refusal(&object(1, &[1]), build).contains("component of itself"));
    assert!(refusal(&(object(1, &[2]) + &object(2, &[3]) + &object(3, &[1])), build).contains("component of itself"));
    assert!(refusal(&object(1, &[5]), build).contains("object 5 is to be built, and is not"));
    assert!(refusal("", build).contains("object 1 is to be built"));
    let chain = |length: u32| (1..length).map(|id| object(id, &[id + 1])).collect::<String>() + &object(length, &[]);
    assert!(refusal(&chain(33), build).contains("more than 32"));
    assert!(seen(&package(model(&chain(32), build), &[]), |_, _| Ok(())).is_ok());
    // Known from another item, and then deeper than allowed.
    let shared = "<item objectid='20'/><item objectid='1'/>";
    assert!(refusal(&chain(33), shared).contains("more than 32"));
    // Each holds the next one ten times: 10^7 of the last.
    let many: String = (1..8).map(|id| object(id, &[id + 1; 10])).collect::<String>() + &object(8, &[]);
    assert!(refusal(&many, build).contains("1 000 000 objects"));
    let flat = format!("<object id='1'>{TETRAHEDRON}</object>");
    assert!(refusal(&flat, "<item objectid='1' transform='1 0 0 0 1 0 0 0 0 0 0 0'/>").contains("flattens"));
    assert!(refusal(&flat, "<item objectid='1' transform='1 0 0'/>").contains("twelve numbers"));
    assert!(refusal(&(flat.clone() + &flat), build).contains("another object"));
    assert!(refusal(&flat, "<item objectid='1' p:path='/3D/x.model'/>").contains("x.model"));
    assert!(refusal(&flat, "<item objectid='1' p:path='/../x.model'/>").contains("leads nowhere"));
}

#[test]
fn mirror_images_are_told() {
    let start =
        model(&format!("<object id='1'>{TETRAHEDRON}</object>"), "<item objectid='1' transform='-1 0 0 0 1 0 0 0 1 0 0 0'/>");
    let findings = seen(&package(start, &[]), |model, _| Ok(model.findings.clone())).unwrap();
    assert!(findings[0].text.contains("1 object of the build as mirror images") && findings[0].harmless);
}

#[test]
fn a_model_of_the_draft_is_read() {
    let start = object(TETRAHEDRON).replace("core/2015/02", "2013/01");
    assert_eq!(mesh(&start).unwrap(), mesh(&object(TETRAHEDRON)).unwrap());
    assert!(seen(&package(start, &[]), |model, _| Ok(model.findings[0].text.contains("draft"))).unwrap());
}

#[test]
fn parts_that_are_no_models_are_refused() {
    let start = |text: &str| reason(seen(&package(text, &[]), |_, _| Ok(())));
    assert!(start("").contains("no 3MF model"));
    assert!(start("<model/>").contains("no 3MF model"), "without its namespace");
    assert!(start(&format!("<!DOCTYPE x><model {DECLARED}/>")).contains("document type"));
    assert!(start(&format!("<model {DECLARED}/><model {DECLARED}/>")).contains("more than one model"));
    assert!(start(&format!("<model {DECLARED}><build/><build/></model>")).contains("more than one build"));
    assert!(start(&format!("<model {DECLARED} unit='league'/>")).contains("league"));
}

/// Vertices of a grid and triangles over them, as text of more than one window.
fn large(quote: char) -> (String, usize) {
    let side = 160usize;
    let vertices: String = (0..side * side)
        .map(|i| format!("<vertex x=\"{}.125\" y=\"{}.0625000000\" z=\"-0.5e-3\"/>\n", i % side, i / side))
        .collect();
    let triangles: String = (0..side * side - side - 1)
        .map(|i| format!("  <triangle v1=\"{i}\" v2=\"{}\" v3=\"{}\" paint_color=\"8\"/>\n", i + 1, i + side))
        .collect();
    let text = format!("<mesh><vertices>{vertices}</vertices><triangles>{triangles}</triangles></mesh>");
    (text.replace('"', &quote.to_string()), side * side - side - 1)
}

#[test]
fn long_meshes_are_the_same_by_either_way() {
    let (fast, count) = large('"');
    assert!(fast.len() > 2 << 20, "more than one window of both");
    let fast = mesh(&object(&fast)).unwrap();
    let careful = mesh(&object(&large('\'').0)).unwrap();
    let commented =
        mesh(&object(&large('"').0.replacen("<vertex", "<!-- --><vertex", 1).replacen("<triangle ", "<!-- --><triangle ", 1)));
    assert_eq!(fast.0.len(), count);
    assert!(fast == careful && fast == commented.unwrap());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(128))]

    /// A model with some bytes changed is read or refused; by the scanner and without it, it is the same.
    #[test]
    fn f13_a_changed_model_is_read_or_refused(changes in prop::collection::vec((any::<prop::sample::Index>(), "[ -~\n]"), 1..4)) {
        let mut start = object(TETRAHEDRON);
        let from = start.find("<vertices>").unwrap() + 10;
        let to = start.find("</triangles>").unwrap();
        for (place, with) in changes {
            let place = from + place.index(to - from);
            start.replace_range(place..=place, &with);
        }
        let told = |result: Result<Seen>| result.map(|seen| format!("{seen:?}")).map_err(|_| ());
        let fast = told(mesh(&start));
        // A comment before the first vertex and the first triangle makes both regions be read with care.
        let careful = start.replacen("<vertices>", "<vertices><!-- -->", 1).replacen("<triangles>", "<triangles><!-- -->", 1);
        prop_assert_eq!(fast, told(mesh(&careful)), "{}", start);
    }

    /// The same anywhere in a model of two parts, with all that an outline looks at.
    #[test]
    fn f13_a_changed_outline_is_read_or_refused(changes in prop::collection::vec((any::<prop::sample::Index>(), "[ -~\n]"), 1..4)) {
        let mut start = model(
            &format!("<object id='1'>{TETRAHEDRON}</object><object id='2'><components><component objectid='1' \
                transform='1 0 0 0 1 0 0 0 1 0 0 5'/><component objectid='1' p:path='/3D/o.model'/></components></object>"),
            "<item objectid='2'/><item objectid='1' printable='0'/>",
        );
        for (place, with) in changes {
            let place = place.index(start.len());
            start.replace_range(place..=place, &with);
        }
        let other = object(TETRAHEDRON);
        let instances = seen(&package(start, &[("3D/o.model", &other)]), |model, context| {
            let mut count = 0;
            for item in model.items() {
                model.instances(item, |place, _, _| count += u32::from(model.records(place, context).is_ok()));
            }
            Ok(count)
        });
        prop_assert!(instances.unwrap_or_default() <= 3);
    }

    #[test]
    fn f13_any_text_in_a_model_is_read_or_refused(text in "[<>/a-z0-9:=\"' ]{0,200}") {
        let _ = mesh(&text);
        let _ = mesh(&object(&text));
        let _ = mesh(&object(&format!("<mesh><vertices>{text}</vertices></mesh>")));
    }
}
