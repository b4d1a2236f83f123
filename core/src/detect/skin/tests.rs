//! Boxes that lose or get surface.

use super::*;
use crate::repairs::shared::pieces::pieces;
use crate::repairs::shared::work::Work;
use crate::submesh::Origin;
use crate::testing::{Corners, cube, cuboid, diagnose, records, shifted};

/// What `repair` does to the skin of these triangles, with a reach of 0.01. All stars are fetched first.
fn skin_after(triangles: &[Corners], repair: impl FnOnce(&mut Work<'_>)) -> Skin {
    let records = records(triangles);
    let mut d = diagnose(&records);
    let work = &mut Work::new(&mut d.submesh);
    let corners: Vec<[f32; 3]> = triangles.concat();
    let new = d.survey.promote(&corners);
    work.extend_at(&d.survey, &new, &corners);
    work.is_changed_by(RepairName::Sheets);
    repair(work);
    let reversed = Reversed::none(&d.survey);
    let pieces = pieces(&d.survey, work, &reversed);
    measure(&d.survey, work, (&reversed, &Vec::new()), &pieces, &[], 0.01)
}

/// Removes what is a triangle of `these`.
fn remove(work: &mut Work<'_>, these: &[Corners]) {
    let gone: Vec<u32> = work.living().filter(|t| these.contains(&work.points(*t))).collect();
    assert_eq!(gone.len(), these.len());
    gone.iter().for_each(|t| work.kill(*t));
}

fn is_about(value: f64, expected: f64) -> bool {
    (value - expected).abs() < 0.02 * expected
}

#[test]
fn a_body_that_goes_is_lost_skin() {
    let other = shifted(&cube(), [3.0, 0.0, 0.0]);
    let skin = skin_after(&[cube(), other.clone()].concat(), |work| remove(work, &other));
    assert!(is_about(skin.lost.area, 6.0) && is_about(skin.lost.share, 0.5), "{skin:?}");
    assert!(is_about(skin.lost.farthest, 3.0) && skin.invented == SkinChange::default(), "{skin:?}");
    assert_eq!(skin.lost.causes.iter().map(|cause| cause.repair).collect::<Vec<_>>(), [RepairName::Sheets]);
    assert!(skin.lost.places.iter().all(|place| place.bounds[0][0] >= 3.0), "{skin:?}");
}

#[test]
fn what_nobody_can_see_is_not_lost() {
    let (host, inner) = (cuboid([-4.0; 3], [5.0; 3]), cube());
    let skin = skin_after(&[host, inner.clone()].concat(), |work| remove(work, &inner));
    assert_eq!(skin.lost, SkinChange::default());
}

/// The mouth of the pit is seen straight from above only.
#[test]
fn the_floor_of_a_deep_pit_can_be_seen() {
    let floor = |t: &&Corners| t.iter().all(|p| p[2] == 0.0);
    let top = |t: &&Corners| t.iter().all(|p| p[2] == 1.0);
    let pit: Vec<Corners> = cube().into_iter().filter(|t| !top(&t)).collect();
    let gone: Vec<Corners> = pit.iter().filter(floor).copied().collect();
    let skin = skin_after(&pit, |work| remove(work, &gone));
    assert!(is_about(skin.lost.area, 0.97), "all but the rim along the walls: {skin:?}");
}

/// A patch of one triangle over the open top: flat. The same with its middle let down: not flat, and large against its body.
#[test]
fn a_patch_of_another_shape_is_invented() {
    let top = |t: &&Corners| t.iter().all(|p| p[2] == 1.0);
    let open: Vec<Corners> = cube().into_iter().filter(|t| !top(&t)).collect();
    let rim = [[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [1.0, 1.0, 1.0], [0.0, 1.0, 1.0]];
    let closed_over = |height: f32| {
        skin_after(&open, |work| {
            let known = work.by_position();
            let rim = rim.map(|p| known[&crate::geometry::position::Position::of(p)]);
            let middle = work.add_vertex(crate::geometry::position::Position::of([0.5, 0.5, height]));
            for k in 0..4 {
                work.add([rim[k], rim[(k + 1) % 4], middle], Origin::Added(RepairName::Fill), crate::util::ids::NONE);
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
    let skin = skin_after(&cube(), |work| {
        let t = work.living().next().unwrap_or(0);
        let [a, b, c] = work.triangles[t as usize].v;
        let points = work.points(t);
        let middle = std::array::from_fn(|k| (points[0][k] + points[1][k]) / 2.0);
        let new = work.add_vertex(crate::geometry::position::Position::of(middle));
        work.kill(t);
        [[a, new, c], [new, b, c]].map(|v| work.add(v, Origin::Added(RepairName::TJunction), crate::util::ids::NONE));
    });
    assert_eq!((skin.lost, skin.invented), (SkinChange::default(), SkinChange::default()));
}
