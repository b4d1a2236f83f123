//! Kinds of broken files that other programs are known to stumble over, by where they were told of.

use super::hostile::{CORNERS, MESH, TYPES, object, package, relationships, triangles};
use super::*;
use crate::io::read::archive_build::{Member, member, zip};

const BUILD: &str = "<item objectid='1'/>";

/// Reads a package of one object, and gives its triangles and what was said.
fn read(mesh: &str) -> (usize, Vec<String>) {
    let file = open(&package(&object(1, mesh), BUILD, &[])).unwrap();
    (file.records().len(), texts(&file).into_iter().map(str::to_owned).collect())
}

/// PrusaSlicer 13209 (Fusion 360): an object without triangles stands in the build beside a sound one.
#[test]
fn an_object_without_triangles_beside_a_sound_one() {
    let empty = "<mesh><vertices/><triangles/></mesh>";
    let file = open(&package(&(object(1, empty) + &object(2, MESH)), "<item objectid='1'/><item objectid='2'/>", &[])).unwrap();
    assert_eq!(triangles(&file), [CORNERS]);
}

/// lib3mf 305: triangles whose indices are all 0. stlTexturizer 102: a triangle without v2, which a list of numbers takes for vertex 0.
#[test]
fn triangles_of_one_vertex_and_of_two() {
    let (count, said) = read(&MESH.replace("</triangles>", "<triangle v1='0' v2='0' v3='0'/></triangles>"));
    assert!(count == 2 && said[0].contains("same vertex twice"), "{said:?}");
    let (count, said) = read(&MESH.replace("</triangles>", "<triangle v1='0' v3='2'/></triangles>"));
    assert!(count == 1 && said[0].contains("1 face refers to vertices that are not there"), "{said:?}");
}

/// lib3mf 411 (OrcaSlicer): a relationship leads to a part that is not there, which the model does not need.
#[test]
fn a_relationship_to_a_part_that_is_not_there() {
    let kind = "http://schemas.openxmlformats.org/package/2006/relationships/metadata/thumbnail";
    let rels = relationships(&["/3D/3dmodel.model"]).replace(
        "</Relationships>",
        &format!("<Relationship Id='t' Type='{kind}' Target='/Metadata/none.png'/></Relationships>"),
    );
    let text = hostile::MODEL.replace("<object>", &object(1, MESH));
    let bytes = zip(&[member("[Content_Types].xml", TYPES), member("_rels/.rels", rels), member("3D/3dmodel.model", text)]);
    assert_eq!(triangles(&open(&bytes).unwrap()), [CORNERS]);
}

/// lib3mf 7 and 81: headers of entries that do not agree. PrusaSlicer 10688: a package that is cut off.
#[test]
fn archives_that_disagree_with_themselves() {
    let sizes = Member { local_more: 1, ..member("Metadata/a.txt", "text") };
    assert!(reason(&package(&object(1, MESH), BUILD, &[sizes])).contains("another size"));
    let whole = package(&object(1, MESH), BUILD, &[]);
    for length in [30, whole.len() / 2, whole.len() - 30] {
        assert!(reason(&whole[..length]).contains("the end of the ZIP archive is missing"), "{length}");
    }
    // Sizes that stand behind the data are none of these: writers that cannot go back put them there.
    let late = Member { described: true, ..member("Metadata/a.txt", "text") };
    assert!(open(&package(&object(1, MESH), BUILD, &[late])).is_ok());
}

/// The corpus: archives in archives, entries over each other, names in two spellings, a link, an attribute twice, two models, and relationships
/// that are noise.
#[test]
fn traps_of_the_corpus() {
    let nested = zip(&[member("0.zip", zip(&[member("0.zip", "x")]))]);
    assert!(reason(&nested).contains("unpack it and take the meshes"));
    let spelt = member("3d/3DMODEL.model", "x");
    assert!(reason(&package(&object(1, MESH), BUILD, &[spelt])).contains("case of letters alone"));
    let link = Member { attributes: 0o120_777 << 16, ..member("3D/other.model", "/3D/3dmodel.model") };
    assert!(reason(&package(&object(1, MESH), BUILD, &[link])).contains("symbolic link"));
    assert!(reason(&package(&object(1, MESH).replace("id='1'", "id='1' id='1'"), BUILD, &[])).contains("damaged attribute"));
    let models = hostile::MODEL.replace("<object>", &object(1, MESH)).repeat(2);
    assert!(reason(&hostile::package_of(models.as_bytes(), &[])).contains("more than one model"));
    let noise = zip(&[member("[Content_Types].xml", TYPES), member("_rels/.rels", "<a/>"), member("3D/3dmodel.model", "x")]);
    assert!(reason(&noise).contains("holds no relationships"));
}

/// PrusaSlicer 5478 and OpenSCAD 5993: faces of more than four corners. Cura 8327: indices that count back. PrusaSlicer 12157: colours behind vertices.
#[test]
fn objs_that_slicers_refuse() {
    let vertices = "v 0 0 0 .5 .5 .5\nv 2 0 0 .5 .5 .5\nv 3 1 0 .5 .5 .5\nv 1 2 0 .5 .5 .5\nv -1 1 0 .5 .5 .5\n";
    let forward = open(format!("{vertices}f 1 2 3 4 5\n").as_bytes()).unwrap();
    let back = open(format!("{vertices}f -5 -4 -3 -2 -1\n").as_bytes()).unwrap();
    assert_eq!((triangles(&forward).len(), triangles(&forward)), (3, triangles(&back)));
    assert!(forward.is_flawless(), "{:?}", texts(&forward));
}

/// PrusaSlicer 13394: bytes of a sound in the records of an STL, so that coordinates are huge, tiny and no numbers.
#[test]
fn records_that_are_noise() {
    let mut state = 7u32;
    let mut noise = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 24) as u8
    };
    let records: Vec<Record> = (0..200).map(|_| std::array::from_fn(|_| noise())).collect();
    let file = open(&binary_file(b"noise", 200, &records, b"")).unwrap();
    assert_eq!(file.records(), records);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("noise.stl");
    std::fs::write(&path, file.bytes()).unwrap();
    let report = crate::inspect(&path, &crate::Profile::default(), &Limits::default(), &crate::Quiet).unwrap();
    assert!(!report.verdict.good && report.before.nonfinite > 0);
}
