use super::*;
use crate::stream::source::{Source, Triangle};
use proptest::prelude::*;

proptest! {
    #[test]
    fn runs_come_back_as_pushed(gaps in prop::collection::vec((0u32..1000, 1u32..1000), 0..50)) {
        let (mut list, mut end, mut want) = (RunList::default(), 0, Vec::new());
        for (gap, count) in gaps {
            list.push(end + gap, count);
            want.push((end + gap, count));
            end += gap + count;
        }
        prop_assert_eq!(list.runs().collect::<Vec<_>>(), want);
    }

    /// A chunk sees exactly the finite triangles with a corner at home there, in order, by lists and by spool, whatever the sizes;
    /// its visitors are those of the others whose box meets its cell.
    #[test]
    fn members_are_the_triangles_with_a_corner_at_home(
        points in prop::collection::vec(prop::array::uniform9(prop_oneof![9 => -4f32..4.0, 1 => Just(f32::NAN)]), 1..120),
        chunk in 1u32..40,
        threads in 1usize..4,
    ) {
        let records: Vec<Record> =
            points.iter().map(|p| record::encode([[p[0], p[1], p[2]], [p[3], p[4], p[5]], [p[6], p[7], p[8]]], 0)).collect();
        let plan = Plan::new(&records, &Guide::NONE, chunk);
        let want: Vec<Vec<(u32, [[f32; 3]; 3])>> = (0..plan.chunks() as u32)
            .map(|c| {
                let numbered = (0..).zip(records.iter().map(record::corners));
                let finite = numbered.filter(|(t, _)| record::all_finite(&records[*t as usize]));
                finite.filter(|(_, corners)| corners.iter().any(|p| plan.home(*p) == ChunkId(c))).collect()
            })
            .collect();
        for spill in [Spill::Never, Spill::Auto, Spill::Always] {
            let limits = Limits { threads, spill, ..Limits::default() };
            let input = (&records[..], &Guide::NONE);
            let members = Members::gather(Path::new("test"), input, &plan, Some(0.0), &limits, &crate::contract::progress::Quiet).unwrap();
            let wanted = |c: ChunkId| c.0 % 3 != 1;
            let seen = members.each((&records, &Guide::NONE, &plan), threads, (Reads::Chunks, wanted), || (), |(), chunk, seen, visitors| {
                let list = |source: &Seen<'_>| {
                    let mut all = Vec::new();
                    source.for_each(|number, triangle| all.push((number, triangle.corners())));
                    assert_eq!(all.len(), source.count());
                    all
                };
                assert_eq!((seen.count() + visitors.count()) as u64, members.count(chunk));
                (chunk, list(seen), list(visitors))
            });
            let wanted: Vec<_> = (0..)
                .map(ChunkId)
                .zip(&want)
                .filter(|(c, _)| wanted(*c))
                .map(|(c, of_chunk)| {
                    let mut visitors = Vec::new();
                    for (t, record) in (0..).zip(&records).filter(|(_, r)| record::all_finite(r)) {
                        let mut spread = Bounds::EMPTY;
                        spread.include(&record::corners(record));
                        if plan.home_box(c).meets(&spread) && of_chunk.iter().all(|(member, _)| *member != t) {
                            visitors.push((t, record::corners(record)));
                        }
                    }
                    (c, of_chunk.clone(), visitors)
                })
                .collect();
            prop_assert_eq!(seen, wanted);
        }
    }
}

#[test]
fn neighbours_all_over_the_place_are_scattered_a_row_is_not() {
    let at = |i: usize| record::encode([[i as f32, 0.0, 0.0], [i as f32 + 1.0, 0.0, 0.0], [i as f32, 1.0, 0.0]], 0);
    let rows: Vec<Record> = (0..40_000).map(at).collect();
    // 7919 is prime: a permutation.
    let mixed: Vec<Record> = (0..40_000).map(|i| at(i * 7919 % 40_000)).collect();
    assert!(!is_scattered(&rows, &Guide::NONE));
    assert!(is_scattered(&mixed, &Guide::NONE));
}

#[test]
fn lists_that_take_too_much_are_given_up_for_a_spool() {
    let at = |i: u32| [(i * 7919 % 300) as f32, (i * 7919 % 90_000 / 300) as f32];
    let corners = |[x, y]: [f32; 2]| [[x, y, 0.0], [x + 1.0, y, 0.0], [x, y + 1.0, 0.0]];
    let records: Vec<Record> = (0..90_000).map(|i| record::encode(corners(at(i)), 0)).collect();
    let plan = Plan::new(&records, &Guide::NONE, 1000);
    let limits = Limits { threads: 2, memory_bytes: 5 << 18, ..Limits::default() };
    let gathered = |spill| {
        let (input, limits) = ((&records[..], &Guide::NONE), Limits { spill, ..limits.clone() });
        Members::gather(Path::new("test"), input, &plan, None, &limits, &crate::contract::progress::Quiet).unwrap()
    };
    let (lists, spooled) = (gathered(Spill::Never), gathered(Spill::Auto));
    assert!(matches!(&lists.kept, Kept::Lists { .. }) && lists.heap_bytes(2) * 3 > limits.memory_bytes / 4);
    assert!(matches!(&spooled.kept, Kept::Spool(_)));
    let counts = |m: &Members| (0..plan.chunks() as u32).map(|c| m.count(ChunkId(c))).collect::<Vec<_>>();
    assert_eq!(counts(&lists), counts(&spooled));
}
