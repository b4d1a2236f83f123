//! Files that were made to do harm: each is read or refused in words, without the memory, the room or the time that it asks for.

use super::*;
use crate::io::read::archive_build::{Member, member, zip};
use crate::io::record::{Point, corners};

pub(super) const TYPES: &str = "<Types xmlns='http://schemas.openxmlformats.org/package/2006/content-types'/>";
pub(super) const MESH: &str = "<mesh><vertices><vertex x='0' y='0' z='0'/><vertex x='1' y='0' z='0'/><vertex x='0' y='1' z='0'/></vertices>\
    <triangles><triangle v1='0' v2='1' v3='2'/></triangles></mesh>";
pub(super) const CORNERS: [Point; 3] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

/// Relationships of a package to parts.
pub(super) fn relationships(targets: &[&str]) -> String {
    let one = |target: &&str| {
        let kind = "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel";
        format!("<Relationship Id='r' Type='{kind}' Target='{target}'/>")
    };
    let inner: String = targets.iter().map(one).collect();
    format!("<Relationships xmlns='http://schemas.openxmlformats.org/package/2006/relationships'>{inner}</Relationships>")
}

/// A model; `<object>` stands for its objects, and its item for its build.
pub(super) const MODEL: &str = "<model xmlns='http://schemas.microsoft.com/3dmanufacturing/core/2015/02' \
    xmlns:p='http://schemas.microsoft.com/3dmanufacturing/production/2015/06'><resources><object></resources><build><item objectid='1'/></build></model>";

/// A package whose model has this text, with other parts.
pub(super) fn package_of(text: &[u8], others: &[Member]) -> Vec<u8> {
    let rels = relationships(&["/3D/3dmodel.model"]);
    let own = [member("[Content_Types].xml", TYPES), member("_rels/.rels", rels), member("3D/3dmodel.model", text)];
    zip(&[&own, others].concat())
}

/// A package of a model with these objects and this build, and of other parts.
pub(super) fn package(objects: &str, build: &str, others: &[Member]) -> Vec<u8> {
    let text = MODEL.replace("<item objectid='1'/>", build).replace("<object>", objects);
    package_of(text.as_bytes(), others)
}

pub(super) fn object(id: u32, content: &str) -> String {
    format!("<object id='{id}'>{content}</object>")
}

/// An object that holds another one so many times.
fn holder(id: u32, of: u32, times: usize) -> String {
    object(id, &format!("<components>{}</components>", format!("<component objectid='{of}'/>").repeat(times)))
}

pub(super) fn amf(content: &str) -> String {
    format!("<amf>{content}</amf>")
}

pub(super) fn amf_object(triangles: usize) -> String {
    let vertex = |[x, y, z]: Point| format!("<vertex><coordinates><x>{x}</x><y>{y}</y><z>{z}</z></coordinates></vertex>");
    let vertices: String = CORNERS.into_iter().map(vertex).collect();
    let triangles = "<triangle><v1>0</v1><v2>1</v2><v3>2</v3></triangle>".repeat(triangles);
    format!("<object id='o'><mesh><vertices>{vertices}</vertices><volume>{triangles}</volume></mesh></object>")
}

fn constellation(id: &str, of: &str, times: usize) -> String {
    format!("<constellation id='{id}'>{}</constellation>", format!("<instance objectid='{of}'/>").repeat(times))
}

pub(super) fn triangles(file: &MeshFile) -> Vec<[Point; 3]> {
    file.records().iter().map(corners).collect()
}

#[test]
fn f14_counts_of_billions_are_not_believed() {
    const MOST: &str = "4294967295";
    let ply = |format: &str, vertices: &str, faces: &str| {
        format!(
            "ply\nformat {format} 1.0\nelement vertex {vertices}\nproperty float x\nproperty float y\nproperty float z\nelement face {faces}\n\
             property list uint uint vertex_indices\nend_header\n"
        )
    };
    let body: Vec<u8> = CORNERS.as_flattened().iter().flat_map(|x| x.to_le_bytes()).collect();
    let face = |length: u32| [length, 0, 1, 2].map(u32::to_le_bytes).concat();
    let little = ply("binary_little_endian", "3", MOST).into_bytes();
    let big = |words: [u32; 3]| words.map(u32::to_be_bytes).concat();
    let off_body: Vec<u8> = CORNERS.as_flattened().iter().flat_map(|x| x.to_be_bytes()).collect();
    let off_face = [3u32, 0, 1, 2, 0].map(u32::to_be_bytes).concat();
    // Announced faces that are not there.
    for bytes in [
        [ply("ascii", "3", MOST).as_bytes(), b"0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"].concat(),
        [little.clone(), body.clone(), face(3)].concat(),
        format!("OFF\n3 {MOST} 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n").into_bytes(),
        [b"OFF BINARY\n".to_vec(), big([3, 0x7fff_ffff, 0]), off_body, off_face].concat(),
    ] {
        let file = open(&bytes).unwrap();
        assert_eq!(triangles(&file), [CORNERS]);
        assert!(file.findings().iter().any(|finding| finding.loss != Loss::None), "{:?}", texts(&file));
    }
    // Announced vertices, corners of a face, and indices that are not there.
    for bytes in [
        [ply("ascii", MOST, "1").as_bytes(), b"0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"].concat(),
        [ply("binary_little_endian", MOST, "1").into_bytes(), body.clone(), face(3)].concat(),
        [little, body, face(u32::MAX)].concat(),
        [ply("ascii", "3", "1").as_bytes(), b"0 0 0\n1 0 0\n0 1 0\n4294967295 0 1 2\n"].concat(),
        format!("OFF\n{MOST} 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n").into_bytes(),
        format!("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n{MOST} 0 1 2\n").into_bytes(),
        format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 {MOST}\nf 1 2 -{MOST}\nf 1 2 99999999999999999999\n").into_bytes(),
        amf(&amf_object(1).replace("<v3>2<", &format!("<v3>{MOST}<"))).into_bytes(),
        package(&object(1, &MESH.replace("v3='2'", &format!("v3='{MOST}'"))), "<item objectid='1'/>", &[]),
    ] {
        let found = open(&bytes);
        assert!(matches!(found, Err(Error::Unreadable { .. })), "{found:?} of {}", String::from_utf8_lossy(&bytes));
    }
}

/// A slicer's volume of all triangles that there can be, or of one more.
#[test]
fn f14_volumes_of_billions_are_not_believed() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("project.3mf");
    for (last, said) in [("4294967294", "volumes that are not its triangles"), ("4294967295", "a volume of no triangles")] {
        let volume = format!("<config><object id='1'><volume firstid='0' lastid='{last}'/></object></config>");
        let project = package(&object(1, MESH), "<item objectid='1'/>", &[member("Metadata/Slic3r_PE_model.config", volume)]);
        std::fs::write(&path, project).unwrap();
        let error = crate::inspect(&path, &crate::Profile::default(), &Limits::default(), &crate::Quiet).unwrap_err();
        assert!(error.to_string().contains(said), "{error}");
    }
}

#[test]
fn f14_copies_of_copies_are_refused_before_they_are_made() {
    // 10^5 times 200 triangles, in a few hundred bytes.
    let many = MESH.replace("<triangle v1='0' v2='1' v3='2'/>", &"<triangle v1='0' v2='1' v3='2'/>".repeat(200));
    let levels: String = (2..=6).map(|id| holder(id, id - 1, 10)).collect();
    let bytes = package(&(object(1, &many) + &levels), "<item objectid='6'/>", &[]);
    assert!(bytes.len() < 2000);
    let instances: String = (2..=6).map(|id| constellation(&id.to_string(), &(id - 1).to_string(), 10)).collect();
    let text = amf(&(amf_object(200).replace("id='o'", "id='1'") + &instances));
    for bytes in [bytes, text.into_bytes()] {
        match open(&bytes) {
            Err(error @ Error::Refused { .. }) => assert!(error.to_string().contains("copies of its objects"), "{error}"),
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn objects_that_are_placed_in_turns_are_read_once_each() {
    // Two objects in turns, one of them with an oddity, which is told once.
    let odd = MESH.replace("</triangles>", "<triangle v1='0' v2='1' v3='9'/><triangle v1='0' v2='2' v3='1'/></triangles>");
    let build = "<item objectid='1'/><item objectid='2'/>".repeat(3) + "<item objectid='1' transform='1 0 0 0 1 0 0 0 1 5 0 0'/>";
    let file = open(&package(&(object(1, MESH) + &object(2, &odd)), &build, &[])).unwrap();
    let moved = CORNERS.map(|[x, y, z]| [x + 5.0, y, z]);
    let [a, b, c] = CORNERS;
    assert_eq!(triangles(&file), [[[a, b, c], [a, b, c], [a, c, b]].repeat(3), vec![moved]].concat());
    assert_eq!(texts(&file).len(), 1, "{:?}", texts(&file));
}

#[test]
fn oddities_of_very_many_objects_are_counted() {
    // The one of number k has k triangles that lead astray, so that no two findings are the same.
    let odd = |k: u32| {
        let [sound, astray] = ["2", "9"].map(|v3| format!("<triangle v1='0' v2='1' v3='{v3}'/>").repeat(k as usize));
        object(k, &MESH.replace("<triangle v1='0' v2='1' v3='2'/>", &(sound + &astray)))
    };
    let objects: String = (1..=20).map(odd).collect();
    let build: String = (1..=20).map(|id| format!("<item objectid='{id}'/>")).collect();
    let file = open(&package(&objects, &build, &[])).unwrap();
    let said = texts(&file);
    assert_eq!(said.len(), 17, "{said:?}");
    assert_eq!(said[16], "4 more oddities of other objects, of which triangles are lost");
    assert!(file.findings().iter().all(|finding| finding.loss == Loss::IfOpen));
}

#[test]
fn f14_archives_as_a_whole_are_no_bombs() {
    // Deflate may have shrunk each of them by so much.
    let zeros = member("a.model", vec![0u8; 40 << 20]);
    let whole = reason(&zip(&[zeros.clone(), Member { name: b"b.model".to_vec(), ..zeros }]));
    assert!(whole.contains("the archive claims to unpack to") && whole.contains("times its size"), "{whole}");
    // An archive in an archive in an archive is not looked into.
    let nested = (0..5).fold(b"x".to_vec(), |inner, _| zip(&[member("0.zip", inner)]));
    assert!(reason(&nested).contains("neither a 3MF package nor a packed AMF: it holds \"0.zip\""));
    // A mesh beside a text is one; of two meshes, nobody knows which is meant.
    let [mesh, readme] = [member("part.amf", amf(&amf_object(1))), member("README.txt", "hello")];
    let file = open(&zip(&[readme.clone(), mesh.clone()])).unwrap();
    assert_eq!((file.format(), texts(&file)), (Format::Amf, vec!["1 other file in the archive, of which only a copy has any"]));
    let other = Member { name: b"other.amf".to_vec(), ..mesh.clone() };
    assert!(reason(&zip(&[mesh, other])).contains("neither a 3MF package nor a packed AMF"));
}

#[test]
fn f14_characters_that_xml_does_not_have_are_refused() {
    let named = |name: &str| {
        package(&object(1, MESH).replacen("<object", &format!("<object name='{name}'"), 1), "<item objectid='1'/>", &[])
    };
    for name in ["&#27;[2J", "a&#x1;", "&#xFFFE;"] {
        let said = reason(&named(name));
        assert!(said.contains("holds a control character, which XML does not allow"), "{name}: {said}");
    }
    for name in ["a&#9;b", "&#xe9;", "&#x1F600;"] {
        assert_eq!(triangles(&open(&named(name)).unwrap()), [CORNERS], "{name}");
    }
}

#[test]
fn f14_no_name_in_a_file_leads_anywhere() {
    let model = "<model xmlns='http://schemas.microsoft.com/3dmanufacturing/core/2015/02'/>";
    let start = |target: &str| {
        reason(&zip(&[
            member("[Content_Types].xml", TYPES),
            member("_rels/.rels", relationships(&[target])),
            member("3D/a.model", model),
        ]))
    };
    for target in ["/../../etc/passwd", "../../../etc/passwd", "file:///etc/passwd", "/%2e%2e/%2e%2e/etc/passwd", "//etc/passwd"]
    {
        let said = start(target);
        assert!(said.contains("not in it") || said.contains("outside") || said.contains("no 3MF package"), "{target}: {said}");
    }
    for path in ["/../../etc/passwd", "../../etc/passwd", "/etc/passwd", "/3D/../../../etc/passwd"] {
        let build = format!("<item objectid='1' p:path='{path}'/>");
        let said = reason(&package(&object(1, MESH), &build, &[]));
        assert!(said.contains("passwd") || said.contains("leads nowhere"), "{path}: {said}");
    }
    for name in ["../a.amf", "/etc/a.amf", "a/../../b.amf", "C:\\a.amf", "a\0.amf"] {
        let said = reason(&zip(&[member(name, amf(&amf_object(1)))]));
        assert!(said.starts_with("the archive's entry"), "{name}: {said}");
    }
    // What an OBJ names is not opened: a pipe that nobody writes to would wait for ever.
    let file =
        open(b"mtllib /dev/zero\nmtllib ../../etc/passwd\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl /proc/self/mem\nf 1 2 3\n").unwrap();
    assert_eq!(triangles(&file), [CORNERS]);
}

#[test]
fn f14_outlines_take_no_more_than_their_archive_allows() {
    let empty: String = (1..120_000).map(|id| format!("<object id='{id}'/>")).collect();
    assert!(reason(&package(&empty, "", &[])).contains("too many objects"));
    assert!(reason(&package(&object(1, MESH), &"<item objectid='1'/>".repeat(150_000), &[])).contains("too many objects"));
    assert!(reason(&package(&(object(1, MESH) + &holder(2, 1, 200_000)), "", &[])).contains("too many objects"));
    // Namespaces that each mesh declares anew, so that it keeps a list of its own.
    let declared: String = (0..60).map(|k| format!(" xmlns:n{k}='{}'", "u".repeat(900))).collect();
    let objects: String = (1..1000).map(|id| object(id, &MESH.replace("<mesh>", &format!("<mesh{declared}>")))).collect();
    assert!(reason(&package(&objects, "", &[])).contains("too many objects"));
    // Things of an AMF.
    let many = amf(&(amf_object(1) + &"<object/><constellation/>".repeat(140_000)));
    assert!(reason(many.as_bytes()).contains("262 144 objects, constellations, instances and meshes"));
}
