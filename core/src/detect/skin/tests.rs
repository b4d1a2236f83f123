//! Boxes that lose or get surface.

use super::*;
use crate::geometry::position::Position;
use crate::submesh::Origin;
use crate::submesh::components::Through;
use crate::submesh::edges::Edges;
use crate::testing::{Corners, cube, cuboid, diagnose, records, shifted};
use crate::util::ids::NONE;

/// What `repair` does to the skin of these triangles, with a reach of 0.01. All stars are fetched first.
fn skin_after(triangles: &[Corners], repair: impl FnOnce(&mut Submesh)) -> Skin {
    let records = records(triangles);
    let mut d = diagnose(&records);
    let new = d.survey.promote(&triangles.concat());
    d.submesh.extend(&d.survey, &new, |known| known.values().copied().collect());
    repair(&mut d.submesh);
    let reversed = Reversed::none(&d.survey);
    let pieces = Components::of(&d.survey, &d.submesh, &Edges::of(&d.submesh), &reversed, Through::EveryEdge);
    measure(&d.survey, &d.submesh, (&reversed, &Vec::new()), &pieces, &Known::default(), 0.01)
}

/// Removes what is a triangle of `these`.
fn remove(submesh: &mut Submesh, these: &[Corners]) {
    let gone: Vec<u32> = submesh.living().filter(|t| these.contains(&submesh.points(*t))).collect();
    assert_eq!(gone.len(), these.len());
    for t in gone {
        submesh.triangles[t as usize].by = Some(RepairName::Sheets);
        submesh.kill(t);
    }
}

fn is_about(value: f64, expected: f64) -> bool {
    (value - expected).abs() < 0.02 * expected
}

#[test]
fn a_body_that_goes_is_lost_skin() {
    let other = shifted(&cube(), [3.0, 0.0, 0.0]);
    let skin = skin_after(&[cube(), other.clone()].concat(), |submesh| remove(submesh, &other));
    assert!(is_about(skin.lost.area, 6.0) && is_about(skin.lost.share, 0.5), "{skin:?}");
    assert!(is_about(skin.lost.farthest, 3.0) && skin.invented == SkinChange::default(), "{skin:?}");
    assert_eq!(skin.lost.causes.iter().map(|cause| cause.repair).collect::<Vec<_>>(), [RepairName::Sheets]);
    assert!(skin.lost.places.iter().all(|place| place.bounds[0][0] >= 3.0), "{skin:?}");
}

#[test]
fn what_nobody_can_see_is_not_lost() {
    let (host, inner) = (cuboid([-4.0; 3], [5.0; 3]), cube());
    let skin = skin_after(&[host, inner.clone()].concat(), |submesh| remove(submesh, &inner));
    assert_eq!(skin.lost, SkinChange::default());
}

/// The mouth of the pit is seen straight from above only.
#[test]
fn the_floor_of_a_deep_pit_can_be_seen() {
    let floor = |t: &&Corners| t.iter().all(|p| p[2] == 0.0);
    let top = |t: &&Corners| t.iter().all(|p| p[2] == 1.0);
    let pit: Vec<Corners> = cube().into_iter().filter(|t| !top(&t)).collect();
    let gone: Vec<Corners> = pit.iter().filter(floor).copied().collect();
    let skin = skin_after(&pit, |submesh| remove(submesh, &gone));
    assert!(is_about(skin.lost.area, 0.97), "all but the rim along the walls: {skin:?}");
}

/// A patch of one triangle over the open top: flat. The same with its middle let down: not flat, and large against its body.
#[test]
fn a_patch_of_another_shape_is_invented() {
    let top = |t: &&Corners| t.iter().all(|p| p[2] == 1.0);
    let open: Vec<Corners> = cube().into_iter().filter(|t| !top(&t)).collect();
    let rim = [[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [1.0, 1.0, 1.0], [0.0, 1.0, 1.0]];
    let closed_over = |height: f32| {
        skin_after(&open, |submesh| {
            let number = |p: &[f32; 3]| submesh.positions.iter().position(|q| q == p).unwrap() as u32;
            let rim = rim.each_ref().map(number);
            let middle = submesh.add_vertex(Position::of([0.5, 0.5, height]));
            for k in 0..4 {
                submesh.add([rim[k], rim[(k + 1) % 4], middle], Origin::Added(RepairName::Fill), NONE);
            }
        })
    };
    assert_eq!(closed_over(1.0).invented, SkinChange::default());
    let skin = closed_over(2.0);
    assert!(skin.invented.area > 2.0 && skin.invented.farthest > 0.8, "{skin:?}");
    assert_eq!(skin.lost, SkinChange::default());
}

#[test]
fn what_stays_where_it_was_is_neither() {
    // Divided: other triangles, the same surface.
    let skin = skin_after(&cube(), |submesh| {
        let t = submesh.living().next().unwrap_or(0);
        let [a, b, c] = submesh.triangles[t as usize].v;
        let points = submesh.points(t);
        let middle = std::array::from_fn(|k| (points[0][k] + points[1][k]) / 2.0);
        let new = submesh.add_vertex(Position::of(middle));
        submesh.kill(t);
        for v in [[a, new, c], [new, b, c]] {
            submesh.add(v, Origin::Added(RepairName::TJunction), NONE);
        }
    });
    assert_eq!((skin.lost, skin.invented), (SkinChange::default(), SkinChange::default()));
}
