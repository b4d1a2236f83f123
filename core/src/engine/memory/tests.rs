//! A mesh in memory becomes what its file becomes.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use proptest::prelude::*;
use proptest::test_runner::TestCaseError;

use super::*;
use crate::contract::progress::Quiet;
use crate::contract::report::{Outcome, RepairName};
use crate::contract::settings::Hollow;
use crate::io::record;
use crate::testing::{Corners, cube, cuboid, plate, records, shifted, soup};

fn limits() -> Limits {
    Limits { threads: 1, list_edit: true, ..Limits::default() }
}

fn repaired(triangles: &[Corners]) -> RepairedMesh {
    repaired_by(triangles, &Profile::default())
}

fn repaired_by(triangles: &[Corners], profile: &Profile) -> RepairedMesh {
    crate::repair_mesh(&Mesh::from_triangles(triangles).unwrap(), profile, &limits(), &Quiet).unwrap()
}

/// The records that the engine writes for a file of these triangles, and its report.
fn repaired_file(triangles: &[Corners]) -> (Vec<Record>, Report) {
    let folder = tempfile::tempdir().unwrap();
    let (input, output) = (folder.path().join("in.stl"), folder.path().join("out.stl"));
    let records = records(triangles);
    std::fs::write(&input, [&[0; 80][..], &(records.len() as u32).to_le_bytes(), records.as_flattened()].concat()).unwrap();
    let report = crate::repair(&input, &output, &Profile::default(), &limits(), &Quiet).unwrap();
    let bytes = std::fs::read(&output).unwrap_or_default();
    (bytes.get(PREFIX_BYTES..).unwrap_or_default().as_chunks::<50>().0.to_vec(), report)
}

/// The face of an origin must be what the origin says of the input's.
fn check_origin(input: &[Corners], face: Corners, origin: FaceOrigin) -> std::result::Result<(), TestCaseError> {
    let before = origin.input_face().map(|face| input[face as usize]);
    match (origin, before) {
        (FaceOrigin::Input(_), Some(before)) => prop_assert_eq!(face, before),
        (FaceOrigin::Flipped(_), Some([a, b, c])) => prop_assert_eq!(face, [a, c, b]),
        (FaceOrigin::Moved(_), Some(before)) => prop_assert!(face != before),
        (FaceOrigin::Part(_), Some(_)) | (FaceOrigin::Repair(_), None) => {}
        other => prop_assert!(false, "{:?}", other),
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]

    /// The same faces in the same order, the same counts, verdict and edit; and every face is what its origin says.
    #[test]
    fn a_mesh_becomes_what_its_file_becomes(triangles in soup().prop_filter("no mesh", |t| !t.is_empty())) {
        let RepairedMesh { mesh, origins, report } = repaired(&triangles);
        let (written, of_file) = repaired_file(&triangles);
        let faces: Vec<Corners> = mesh.view().triangles().collect();
        if report.outcome == Outcome::Clean || report.after.is_some() {
            prop_assert_eq!(&faces, &written.iter().map(record::corners).collect::<Vec<_>>());
        } else {
            prop_assert!(faces.iter().all(|t| t.as_flattened().iter().all(|x| x.is_finite())) || report.edit.deleted == 0);
        }
        prop_assert_eq!(report.outcome, of_file.outcome);
        prop_assert_eq!(&report.before, &of_file.before);
        prop_assert_eq!(&report.after, &of_file.after);
        prop_assert_eq!(&report.verdict, &of_file.verdict);
        prop_assert_eq!(&report.edit, &of_file.edit);
        let (listed, of_file) = (report.edit_records.unwrap(), of_file.edit_records.unwrap());
        prop_assert_eq!(&listed.added_from, &of_file.added_from);
        prop_assert_eq!(listed.added.len(), listed.added_from.len());
        prop_assert_eq!(origins.len(), faces.len());
        if let Some(output) = report.output.filter(|_| !faces.is_empty()) {
            let again = crate::inspect_mesh(&mesh, &Profile::default(), &limits(), &Quiet).unwrap();
            prop_assert_eq!(again.input.blake3, output.blake3, "the certificate is of the mesh that is returned");
        }
        for (face, origin) in faces.into_iter().zip(&origins) {
            check_origin(&triangles, face, *origin)?;
        }
        let count = |wanted: fn(&FaceOrigin) -> bool| origins.iter().filter(|o| wanted(o)).count() as u64;
        prop_assert_eq!(count(|o| matches!(o, FaceOrigin::Input(_))), report.edit.untouched);
        prop_assert_eq!(count(|o| matches!(o, FaceOrigin::Flipped(_))), report.edit.flipped);
        prop_assert_eq!(count(|o| matches!(o, FaceOrigin::Moved(_))), report.edit.moved);
        prop_assert_eq!(count(|o| matches!(o, FaceOrigin::Part(_) | FaceOrigin::Repair(_))), report.edit.added);
    }
}

proptest! {
    /// However the vertices are numbered, shared, repeated or unused: the same positions in the faces become the same mesh, whose vertices
    /// are distinct positions in the order of their first appearance.
    #[test]
    fn the_result_does_not_depend_on_how_vertices_are_numbered(
        triangles in soup().prop_filter("no mesh", |t| !t.is_empty()),
        copies in prop::collection::vec(0u8..4, 1..60),
        unused in 0usize..4,
        backwards: bool,
    ) {
        let plain = repaired(&triangles);
        prop_assume!(plain.report.outcome != Outcome::Clean && plain.report.after.is_some());
        let welded = Mesh::from_triangles(&triangles).unwrap();
        let count = welded.vertices().len() as u32;
        // Unused vertices first, then each vertex, then copies of vertices: corners of a face may use the copy.
        let mut vertices = welded.vertices()[..unused.min(count as usize)].to_vec();
        let before = vertices.len() as u32;
        vertices.extend(welded.vertices());
        vertices.extend(welded.vertices());
        let mut uses = copies.iter().cycle();
        let mut faces: Vec<[u32; 3]> = welded.faces().iter().map(|f| f.map(|v| before + v + if *uses.next().unwrap() == 0 { count } else { 0 })).collect();
        if backwards {
            vertices.reverse();
            faces.iter_mut().flatten().for_each(|v| *v = vertices.len() as u32 - 1 - *v);
        }
        let odd = crate::repair_mesh(&Mesh::new(vertices, faces).unwrap(), &Profile::default(), &limits(), &Quiet).unwrap();
        prop_assert_eq!(&odd.mesh, &plain.mesh);
        prop_assert_eq!(&odd.origins, &plain.origins);
        let again = Mesh::from_triangles(&odd.mesh.view().triangles().collect::<Vec<_>>()).unwrap();
        prop_assert_eq!(odd.mesh, again);
    }
}

/// Vertices that no face uses, and two at one position, are the caller's.
#[test]
fn a_mesh_that_needs_no_repair_is_returned_as_it_came() {
    let (vertices, faces) = Mesh::from_triangles(&cube()).unwrap().into_parts();
    let odd = Mesh::new([&[[9.0; 3], [9.0; 3]], &vertices[..]].concat(), faces.iter().map(|f| f.map(|v| v + 2)).collect());
    let odd = odd.unwrap();
    let repaired = crate::repair_mesh(&odd, &Profile::default(), &limits(), &Quiet).unwrap();
    assert_eq!((repaired.report.outcome, &repaired.mesh), (Outcome::Clean, &odd));
    assert_eq!(repaired.origins, (0..12).map(FaceOrigin::Input).collect::<Vec<_>>());
    assert_eq!(repaired.report.input.format, Format::Memory);
}

/// Two cubes that cross are cut along each other, a third lacks its top, a fourth is inside out.
#[test]
fn origins_name_the_repair() {
    let crossing = [cube(), shifted(&cube(), [0.5; 3])].concat();
    let mut open = cuboid([5.0; 3], [6.0; 3]);
    open.drain(2..4);
    let inside_out = crate::testing::reversed(&shifted(&cube(), [0.0, 0.0, 9.0]));
    let all = [crossing, open, inside_out].concat();
    let RepairedMesh { origins, report, .. } = repaired(&all);
    assert_eq!(report.outcome, Outcome::Repaired, "{:?}", report.verdict);
    assert_eq!(origins.iter().filter(|o| **o == FaceOrigin::Repair(RepairName::Fill)).count(), 2);
    assert_eq!(origins.iter().filter(|o| matches!(o, FaceOrigin::Flipped(34..46))).count(), 12);
    assert!(origins.iter().any(|o| matches!(o, FaceOrigin::Part(0..24))));
}

/// Valid is not yet right: each of these could be closed, manifold and full of material where a cavity was meant.
#[test]
fn a_cavity_is_not_filled_without_a_look() {
    let host = cuboid([0.0; 3], [4.0; 3]);
    let cavity = |at: [f32; 3]| cuboid(at, at.map(|x| x + 3.0));
    let pokes_out = [host.clone(), crate::testing::reversed(&cavity([1.5, 0.5, 0.5]))].concat();
    let faces_outward = [host.clone(), cavity([0.5; 3])].concat();
    assert_eq!(repaired(&faces_outward).report.outcome, Outcome::NeedsReview);
    let notch = repaired(&pokes_out).report;
    let volume = notch.after.map(|after| after.volume);
    assert_eq!((notch.outcome, volume), (Outcome::Repaired, Some(64.0 - 22.5)), "{:?}", notch.verdict);
    // The same by the profile.
    let profile = Profile { hollow: Hollow::Keep, ..Profile::default() };
    let kept = repaired_by(&faces_outward, &profile).report;
    let volume = kept.after.map(|after| after.volume);
    assert_eq!((kept.outcome, volume), (Outcome::Repaired, Some(37.0)), "{:?}", kept.verdict);
    let right = repaired(&[&host[2..], &crate::testing::reversed(&cavity([0.5; 3]))[..11]].concat()).report;
    assert_eq!((right.outcome, right.volume_meant.map(f64::round)), (Outcome::Repaired, Some(37.0)), "{:?}", right.verdict);
}

#[test]
fn a_mesh_without_faces_is_an_error() {
    let error = crate::inspect_mesh(&Mesh::default(), &Profile::default(), &limits(), &Quiet).unwrap_err();
    assert_eq!(error.to_string(), "mesh in memory: cannot be read as a mesh: it has no faces");
}

#[test]
fn what_a_repair_leaves_nothing_of_is_an_empty_mesh() {
    let RepairedMesh { mesh, origins, report } = repaired(&[[[0.0; 3]; 3]]);
    assert_eq!((mesh.faces().len(), origins.len(), report.outcome), (0, 0, Outcome::NotGood));
}

/// Asks for the end as soon as a stage begins.
struct Ending(&'static str, AtomicBool);

impl Progress for Ending {
    fn at(&self, stage: &'static str, _: u64, _: u64) {
        if stage == self.0 {
            self.1.store(true, Ordering::Relaxed);
        }
    }

    fn cancelled(&self) -> bool {
        self.1.load(Ordering::Relaxed)
    }
}

#[test]
fn work_that_is_cancelled_ends_with_an_error_that_says_so() {
    let mesh = Mesh::from_triangles(&plate(60, |x, y| (x, y) != (7, 7))).unwrap();
    for stage in ["plan", "repair"] {
        let ending = Ending(stage, AtomicBool::new(false));
        let error = crate::repair_mesh(&mesh, &Profile::default(), &limits(), &ending).unwrap_err();
        assert!(error.is_cancellation(), "{stage}: {error}");
    }
}

/// Counts how often it is asked, and says once that the work is to end.
struct Asked(AtomicUsize, usize);

impl Progress for Asked {
    fn at(&self, _: &'static str, _: u64, _: u64) {}

    fn cancelled(&self) -> bool {
        self.0.fetch_add(1, Ordering::Relaxed) == self.1
    }
}

/// One repair may be nearly all of the work: a wrap of some boxes took nine seconds in which nobody was asked.
#[test]
fn long_repairs_are_cancelled_in_their_middle() {
    let boxes: Vec<Corners> = (0..6u8).flat_map(|i| shifted(&cube(), [f32::from(i) * 0.3; 3])[1..].to_vec()).collect();
    let mesh = Mesh::from_triangles(&boxes).unwrap();
    let wrap = |asked: &Asked| crate::operations::wrap(&mesh, &crate::operations::Wrap::default(), &limits(), asked);
    let all = Asked(AtomicUsize::new(0), usize::MAX);
    wrap(&all).unwrap();
    let all = all.0.into_inner();
    assert!(all > 50, "asked {all} times");
    for at in [all / 4, all / 2, all - all / 4] {
        let asked = Asked(AtomicUsize::new(0), at);
        let error = wrap(&asked).unwrap_err();
        assert!(error.is_cancellation(), "{error}");
        let more = asked.0.into_inner() - at;
        // Blocks that are due already ask as well, and do nothing then.
        assert!(more < all / 2, "asked {more} times after the end, of {all}");
    }
}

/// A sheet of side 4 in a block, through its wall, and beside it. Of the first one nothing is missed.
#[test]
fn a_sheet_that_goes_is_in_material_only_if_all_of_it_is() {
    let block = cuboid([0.0; 3], [8.0; 3]);
    for (along, is_in, outcome) in
        [(2.0, true, Outcome::Repaired), (5.5, false, Outcome::NeedsReview), (20.0, false, Outcome::NeedsReview)]
    {
        let sheet = shifted(&plate(4, |_, _| true), [along, 2.0, 4.5]);
        let report = repaired(&[block.clone(), sheet].concat()).report;
        let in_material: Vec<bool> = report.sheets_dropped.iter().map(|sheet| sheet.in_material).collect();
        assert_eq!((in_material, report.outcome), (vec![is_in], outcome), "{along}");
    }
}
