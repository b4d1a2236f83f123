//! Files of several meshes, through the whole engine.

use std::path::{Path, PathBuf};

use crate::contract::error::Result;
use crate::contract::progress::Quiet;
use crate::contract::report::{Outcome, Report};
use crate::contract::settings::{KeepAttributes, Limits, OutputFormat, Profile};
use crate::engine::{entry, formats};
use crate::io::read::MeshFile;
use crate::testing::{Corners, cube, shifted};

/// The vertices and volumes of an object, each triangle with vertices of its own.
fn mesh(volumes: &[&[Corners]]) -> String {
    let all: Vec<[f32; 3]> = volumes.iter().flat_map(|volume| volume.iter().flatten()).copied().collect();
    let vertex = |[x, y, z]: &[f32; 3]| format!("<vertex><coordinates><x>{x}</x><y>{y}</y><z>{z}</z></coordinates></vertex>");
    let mut next = 0;
    let mut volume = |triangles: &&[Corners]| {
        let each: String = triangles
            .iter()
            .map(|_| {
                next += 3;
                format!("<triangle><v1>{}</v1><v2>{}</v2><v3>{}</v3></triangle>", next - 3, next - 2, next - 1)
            })
            .collect();
        format!("<volume>{each}</volume>")
    };
    let volumes: String = volumes.iter().map(&mut volume).collect();
    format!("<mesh><vertices>{}</vertices>{volumes}</mesh>", all.iter().map(vertex).collect::<String>())
}

fn object(id: u32, name: &str, volumes: &[&[Corners]]) -> String {
    format!("<object id=\"{id}\"><metadata type=\"name\">{name}</metadata>{}</object>", mesh(volumes))
}

fn write(folder: &Path, objects: &str) -> PathBuf {
    let path = folder.join("in.amf");
    std::fs::write(&path, format!("<?xml version=\"1.0\"?>\n<amf unit=\"inch\">{objects}</amf>\n")).unwrap();
    path
}

fn limits(folder: &Path) -> Limits {
    Limits { spool: Some(folder.into()), threads: 2, ..Limits::default() }
}

fn repaired(folder: &Path, input: &Path, profile: &Profile) -> Result<(Report, PathBuf)> {
    let output = folder.join("out");
    let report = entry::repair(input, &output, profile, &limits(folder), &Quiet)?;
    Ok((report, output))
}

fn read(path: &Path, folder: &Path) -> MeshFile {
    MeshFile::open(path, folder, &limits(folder), &Quiet).unwrap()
}

/// Names and counts of triangles.
fn parts(mesh: &MeshFile) -> Vec<(&str, usize)> {
    mesh.parts().iter().map(|part| (part.name.as_str(), part.triangles.len())).collect()
}

/// Two cubes that have a wall in common, the first one open.
fn touching() -> String {
    let beside = shifted(&cube(), [1.0, 0.0, 0.0]);
    object(1, "a &amp; b", &[&cube()[1..]]) + &object(2, "", &[&beside])
}

#[test]
fn objects_are_repaired_one_by_one_and_stay_apart() {
    let folder = tempfile::tempdir().unwrap();
    let input = write(folder.path(), &touching());
    let (report, output) = repaired(folder.path(), &input, &Profile::default()).unwrap();
    assert_eq!(report.outcome, Outcome::Repaired, "{:?}", report.verdict.reasons);
    let outcomes: Vec<_> = report.objects.iter().map(|object| (object.name.as_str(), object.outcome)).collect();
    assert_eq!(outcomes, [("a & b", Outcome::Repaired), ("", Outcome::Clean)]);
    let written = read(&output, folder.path());
    assert_eq!(parts(&written), [("a & b", 12), ("", 12)]);
    assert_eq!((written.unit(), written.is_flawless()), (Some("inch"), true));
    assert_eq!(report.output.unwrap().triangles, 24);
    let inspected = entry::inspect(&output, &Profile::default(), &limits(folder.path()), &Quiet).unwrap();
    assert_eq!((inspected.outcome, inspected.objects.len(), inspected.before.bodies), (Outcome::Clean, 2, 2));
}

#[test]
fn volumes_of_an_object_stay_apart() {
    let folder = tempfile::tempdir().unwrap();
    let beside = shifted(&cube(), [1.0, 0.0, 0.0]);
    let input = write(folder.path(), &object(7, "lid", &[&cube(), &beside[1..]]));
    let (report, output) = repaired(folder.path(), &input, &Profile::default()).unwrap();
    assert_eq!(report.outcome, Outcome::Repaired, "{:?}", report.verdict.reasons);
    assert_eq!(parts(&read(&output, folder.path())), [("lid volume 1", 12), ("lid volume 2", 12)]);
}

/// Letters of Latin-1 take two bytes in the result, and an object's name stands before that of its volume.
#[test]
fn names_of_any_length_are_written() {
    let folder = tempfile::tempdir().unwrap();
    let beside = shifted(&cube(), [1.0, 0.0, 0.0]);
    for (letter, length) in [("a", 1024), ("\u{e9}", 1024), ("a", 5000)] {
        let name = letter.repeat(length);
        for volumes in [&[&cube()[1..]][..], &[&cube()[1..], &beside]] {
            let text = object(1, &name, volumes)
                .replace("<volume><tri", &format!("<volume><metadata type=\"name\">{name}</metadata><tri"));
            let input = write(folder.path(), &format!("<metadata type=\"name\">{name}</metadata>{text}"));
            if letter != "a" {
                let text = std::fs::read_to_string(&input).unwrap();
                std::fs::write(&input, text.chars().map(|c| c as u8).collect::<Vec<_>>()).unwrap();
            }
            let (report, output) = repaired(folder.path(), &input, &Profile::default()).unwrap();
            assert_eq!(report.outcome, Outcome::Repaired, "{:?}", report.verdict.reasons);
            std::fs::remove_file(output).unwrap();
        }
    }
}

/// Names of the file, of a lone object and of volumes are those of the result; other metadata are told.
#[test]
fn names_stay() {
    let folder = tempfile::tempdir().unwrap();
    let named = |text: String, name: &str| {
        let metadata =
            format!("<volume><metadata type=\"slic3r.extruder\">1</metadata><metadata type=\"name\">{name}</metadata>");
        text.replacen("<volume><tri", &format!("{metadata}<tri"), 1)
    };
    let title = "<metadata type=\"name\">Vase &lt;1&gt;</metadata>";
    let beside = shifted(&cube(), [1.0, 0.0, 0.0]);
    let two = named(named(object(7, "lid", &[&cube(), &beside[1..]]), "ring"), "knob");
    let lone = object(1, "cup", &[&cube()[1..]]);
    let of_volume = named(object(1, "", &[&cube()[1..]]), "disc");
    for (text, names) in [(two, vec!["lid ring", "lid knob"]), (lone, vec!["cup"]), (of_volume, vec!["disc"])] {
        let input = write(folder.path(), &format!("{title}{text}"));
        let (report, output) = repaired(folder.path(), &input, &Profile::default()).unwrap();
        assert_eq!(report.outcome, Outcome::Repaired, "{:?}", report.verdict.reasons);
        let written = read(&output, folder.path());
        assert_eq!(parts(&written).into_iter().map(|(name, _)| name).collect::<Vec<_>>(), names);
        assert_eq!((written.title(), written.is_flawless()), ("Vase <1>", true));
        let metadata = text.matches("slic3r.extruder").count();
        let told = report.input.findings.iter().any(|finding| finding.contains("of metadata besides names"));
        assert_eq!(told, metadata > 0, "{:?}", report.input.findings);
        // A package has them, too.
        std::fs::remove_file(&output).unwrap();
        let (_, output) =
            repaired(folder.path(), &input, &Profile { format: OutputFormat::ThreeMf, ..Profile::default() }).unwrap();
        let objects = entry::inspect(&output, &Profile::default(), &limits(folder.path()), &Quiet).unwrap().objects;
        let shown: Vec<_> =
            if objects.is_empty() { names.clone() } else { objects.iter().map(|own| own.name.as_str()).collect() };
        assert_eq!(shown, names);
        std::fs::remove_file(&output).unwrap();
    }
}

#[test]
fn sound_objects_are_copied_and_damaged_ones_alone_say_why() {
    let folder = tempfile::tempdir().unwrap();
    let input = write(folder.path(), &(object(1, "", &[&cube()]) + &object(2, "", &[&shifted(&cube(), [0.5, 0.0, 0.0])])));
    let (report, output) = repaired(folder.path(), &input, &Profile::default()).unwrap();
    assert_eq!(report.outcome, Outcome::Clean, "two that cross are two bodies of their own");
    assert_eq!(std::fs::read(output).unwrap(), std::fs::read(&input).unwrap());
    let inspect =
        |profile: &Profile| entry::inspect(&write(folder.path(), &touching()), profile, &limits(folder.path()), &Quiet).unwrap();
    let damaged = inspect(&Profile::default());
    assert_eq!(damaged.outcome, Outcome::NotGood);
    assert!(
        damaged.verdict.reasons.iter().all(|reason| reason.starts_with("object 1 (a & b): ")),
        "{:?}",
        damaged.verdict.reasons
    );
}

#[test]
fn other_formats_hold_them_as_they_can() {
    let folder = tempfile::tempdir().unwrap();
    let input = write(folder.path(), &touching());
    for (format, objects) in [(OutputFormat::Stl, 0), (OutputFormat::Ply, 0), (OutputFormat::ThreeMf, 2)] {
        let profile = Profile { format, ..Profile::default() };
        let (report, output) = repaired(folder.path(), &input, &profile).unwrap();
        assert_eq!(report.outcome, Outcome::Repaired, "{format:?}");
        assert_eq!(read(&output, folder.path()).records().len(), 24, "{format:?}");
        let again = entry::inspect(&output, &Profile::default(), &limits(folder.path()), &Quiet).unwrap();
        assert_eq!(again.objects.len(), objects, "{format:?}");
        if objects > 0 {
            assert_eq!(again.objects[0].name, "a & b");
        }
        std::fs::remove_file(output).unwrap();
    }
    let output = folder.path().join("converted.3mf");
    formats::convert(&input, &output, OutputFormat::ThreeMf, &limits(folder.path()), &Quiet).unwrap();
    let inspected = entry::inspect(&output, &Profile::default(), &limits(folder.path()), &Quiet).unwrap();
    assert_eq!(inspected.objects.iter().map(|object| object.triangles).collect::<Vec<_>>(), [11, 12]);
}

#[test]
fn colours_that_are_lost_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let coloured = touching().replacen("<mesh>", "<color><r>1</r><g>0</g><b>0</b></color><mesh>", 1);
    let input = write(folder.path(), &coloured);
    let (report, output) = repaired(folder.path(), &input, &Profile::default()).unwrap();
    assert_eq!(report.attributes.unwrap().lost, 23);
    std::fs::remove_file(output).unwrap();
    let profile = Profile { attributes: KeepAttributes::Refuse, ..Profile::default() };
    let (report, output) = repaired(folder.path(), &input, &profile).unwrap();
    assert!(report.output.is_none() && !output.exists());
}

/// A face of a vertex that is not there makes it uncertain what belongs together: a person is asked.
#[test]
fn objects_that_cannot_be_told_apart_need_review() {
    let folder = tempfile::tempdir().unwrap();
    let astray = touching().replacen("</volume>", "<triangle><v1>0</v1><v2>1</v2><v3>999</v3></triangle></volume>", 1);
    let (report, _) = repaired(folder.path(), &write(folder.path(), &astray), &Profile::default()).unwrap();
    assert_eq!(report.outcome, Outcome::NeedsReview, "{:?}", report.verdict.reasons);
}

#[test]
fn volumes_with_a_role_of_a_slicer_need_review() {
    let folder = tempfile::tempdir().unwrap();
    for (kind, outcome) in [("ModelPart", Outcome::Repaired), ("NegativeVolume", Outcome::NeedsReview)] {
        let role = format!("<volume><metadata type=\"slic3r.volume_type\">{kind}</metadata>");
        let input = write(folder.path(), &touching().replacen("<volume>", &role, 1));
        let (report, output) = repaired(folder.path(), &input, &Profile::default()).unwrap();
        assert_eq!(report.outcome, outcome, "{:?}", report.verdict.reasons);
        std::fs::remove_file(output).unwrap();
    }
    let support = write(folder.path(), &touching().replacen("<volume>", "<volume type=\"support\">", 1));
    assert_eq!(repaired(folder.path(), &support, &Profile::default()).unwrap().0.outcome, Outcome::NeedsReview);
}

#[test]
fn names_stay_whole() {
    let folder = tempfile::tempdir().unwrap();
    let long = "the left half of a toy car that has a rather long name - LEFT";
    let input = write(folder.path(), &touching().replacen("a &amp; b", long, 1));
    let (_, output) = repaired(folder.path(), &input, &Profile::default()).unwrap();
    assert_eq!(parts(&read(&output, folder.path()))[0].0, long);
}
