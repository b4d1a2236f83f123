use proptest::prelude::*;

use super::*;
use crate::geometry::position::Position;
use crate::testing::{Corners, cube, diagnose, plate, records, written};

const HERE: Corners = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
const THERE: Corners = [[5.0; 3], [6.0, 5.0, 5.0], [5.0, 6.0, 5.0]];

#[test]
fn turned_twice_is_untouched() {
    // An open plate: all of it is in the submesh.
    let records = records(&plate(2, |_, _| true));
    let mut d = diagnose(&records);
    let none = Reversed::none(&d.survey);
    for flipped in [1, 0] {
        d.submesh.triangles[3].turn();
        let summary = Edit::of(&d.survey, &d.submesh, &none, &[]).summary(records.len());
        assert_eq!((summary.flipped, summary.untouched), (flipped, 8 - flipped));
    }
    assert_eq!(written(&Edit::of(&d.survey, &d.submesh, &none, &[]), &records), records);
}

#[test]
fn a_moved_vertex_moves_the_triangles_around_it() {
    let records = records(&plate(2, |_, _| true));
    let mut d = diagnose(&records);
    let middle = d.submesh.positions.iter().position(|p| *p == [1.0, 1.0, 0.0]).unwrap();
    let above = d.submesh.add_vertex(Position::of([1.0, 1.0, 0.5]));
    d.submesh.merge(above, middle as u32);
    let edit = Edit::of(&d.survey, &d.submesh, &Reversed::none(&d.survey), &[]);
    let summary = edit.summary(records.len());
    // Six of eight triangles meet in the middle of the plate.
    assert_eq!((summary.moved, summary.untouched, summary.max_move), (6, 2, 0.5));
}

#[test]
fn a_reversed_region_flips_its_records() {
    let records = records(&cube());
    let d = diagnose(&records);
    let edit = Edit::of(&d.survey, &d.submesh, &Reversed { regions: vec![true], dropped: vec![false] }, &[]);
    assert_eq!(written(&edit, &records), records.iter().map(record::flip).collect::<Vec<_>>());
    assert_eq!(edit.listed().flipped, [[0, 11]]);
}

#[test]
fn an_edit_of_what_was_set_right_is_told_of_what_it_comes_from() {
    // Of eight records, 1 and 4 were left out, and 2 and 5 turned: what was worked on is 0 2 3 5 6 7.
    let input: Vec<Record> = (0..8).map(|i| record::encode(HERE.map(|p| p.map(|x| x + i as f32)), i)).collect();
    let turned_before = |t: usize| if [2, 5].contains(&t) { record::flip(&input[t]) } else { input[t] };
    let worked_on: Vec<Record> = [0, 2, 3, 5, 6, 7].map(turned_before).to_vec();
    let moved = record::encode(THERE, 6);
    let edit = Edit {
        changes: vec![(0, Change::Delete), (3, Change::Flip), (4, Change::Move(Box::new(moved)))],
        flipped: vec![0b100],
        deletions: 1,
        flips: 2,
        ..Edit::default()
    };
    let direct = written(&edit, &worked_on);
    let over = edit.over(&[0b1_0010], &[0b10_0100], input.len());
    let mut through = written(&over, &input);
    // Record 5 was turned twice, so it leaves as it came.
    assert_eq!(through, [record::flip(&input[2]), record::flip(&input[3]), input[5], moved, input[7]]);
    through[2] = record::flip(&record::flip(&input[5]));
    assert_eq!(through, direct);
    let summary = over.summary(input.len());
    assert_eq!((summary.untouched, summary.deleted, summary.flipped, summary.moved), (2, 3, 2, 1));
}

proptest! {
    /// The walk gives record by record what the edit says of it, and the summary and the list count the same.
    #[test]
    fn walking_does_what_the_edit_says(fates in prop::collection::vec(0u8..6, 0..200), added in 0usize..3) {
        let input = records(&vec![HERE; fates.len()]);
        let [moved, new] = [record::encode(THERE, 0), record::encode(THERE, 7)];
        let none = vec![0; fates.len().div_ceil(64)];
        let mut edit = Edit { flipped: none.clone(), dropped: none, ..Edit::default() };
        (0..added).for_each(|_| edit.add(THERE, 7, FaceOrigin::Repair(RepairName::Fill)));
        let (mut want, mut left) = (Vec::new(), added);
        let mut gap = None;
        for (t, fate) in fates.iter().enumerate() {
            let before = input[t];
            match fate {
                0 => want.push(before),
                1 => edit.changes.push((t as u32, Change::Delete)),
                2 => edit.changes.push((t as u32, Change::Flip)),
                3 => edit.changes.push((t as u32, Change::Move(Box::new(moved)))),
                // Of a region that goes, and of a reversed one.
                5 => bits::put(&mut edit.dropped, t),
                _ => bits::put(&mut edit.flipped, t),
            }
            match fate {
                2 | 4 => want.push(record::flip(&before)),
                3 => want.push(moved),
                1 | 5 if left > 0 => {
                    want.push(new);
                    left -= 1;
                }
                1 | 5 if gap.is_none() => gap = Some(t as u32),
                _ => {}
            }
        }
        want.extend(vec![new; left]);
        edit.deletions = fates.iter().filter(|f| [1, 5].contains(*f)).count() as u64;
        edit.flips = fates.iter().filter(|f| **f == 2 || **f == 4).count() as u64;
        prop_assert_eq!(edit.first_gap(), gap);
        prop_assert_eq!(edit.output_records(input.len()), want.len() as u64);
        prop_assert_eq!(edit.summary(input.len()).untouched, fates.iter().filter(|f| **f == 0).count() as u64);
        let listed = |ranges: &[[u32; 2]]| ranges.iter().map(|[a, b]| u64::from(b - a + 1)).sum::<u64>();
        prop_assert_eq!(listed(&edit.listed().deleted), edit.deletions);
        prop_assert_eq!(listed(&edit.listed().flipped), edit.flips);
        prop_assert_eq!(written(&edit, &input), want);
    }

    /// Triangles of the result that go, whether they came, were turned or are new, are not there, and all else is.
    #[test]
    fn an_edit_of_a_result_is_one_of_the_input(fates in prop::collection::vec(0u8..5, 1..150), added in 0usize..4, go in any::<u64>()) {
        let input: Vec<Record> = (0..fates.len()).map(|k| record::encode(HERE.map(|p| p.map(|x| x + k as f32)), k as u16)).collect();
        let mut edit = Edit { flipped: vec![0; fates.len().div_ceil(64)], ..Edit::default() };
        (0..added).for_each(|k| edit.add(THERE, k as u16, FaceOrigin::Repair(RepairName::Fill)));
        for (t, fate) in fates.iter().enumerate() {
            let moved = || Change::Move(Box::new(record::encode(THERE, 100 + t as u16)));
            match fate {
                1 => edit.changes.push((t as u32, Change::Delete)),
                2 => edit.changes.push((t as u32, Change::Flip)),
                3 => edit.changes.push((t as u32, moved())),
                4 => bits::put(&mut edit.flipped, t),
                _ => {}
            }
        }
        edit.deletions = fates.iter().filter(|f| **f == 1).count() as u64;
        edit.flips = fates.iter().filter(|f| **f == 2 || **f == 4).count() as u64;
        // The second step takes away of the first one's triangles, too.
        let (mut want, mut then) = (Vec::new(), edit);
        for step in 0..2_u16 {
            let between = written(&then, &input);
            let gone: Vec<u32> = (0..between.len() as u32).filter(|k| go.rotate_left(*k * 7 + u32::from(step)) & 3 == 0).collect();
            let new = record::encode(THERE, 7777 + step);
            want = (0..).zip(&between).filter(|(k, _)| !gone.contains(k)).map(|(_, r)| *r).collect::<Vec<Record>>();
            want.extend([new; 2]);
            let gone = bits::of(between.len(), gone.into_iter());
            then = then.then(&input, &gone, vec![new; 2].into(), RepairName::Defeature);
        }
        let mut got = written(&then, &input);
        prop_assert_eq!(then.output_records(input.len()), want.len() as u64);
        prop_assert_eq!(then.listed().flipped.iter().map(|[a, b]| u64::from(b - a + 1)).sum::<u64>(), then.summary(input.len()).flipped);
        want.sort_unstable();
        got.sort_unstable();
        prop_assert_eq!(got, want);
    }
}
