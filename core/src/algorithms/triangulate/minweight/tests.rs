use proptest::prelude::*;

use super::*;
use crate::geometry::exact::Point;

fn clear(rim: &Rim<'_>, banned: Vec<[u32; 3]>) -> Result<Vec<[u32; 3]>, Unfillable> {
    Table::without(rim, Weight::Bend, Choice::Clear(&mut Clearance::new(rim)), banned).best()
}

proptest! {
    /// What is banned one by one leaves what it leaves from the beginning, where a chord is an edge of the mesh and where a triangle
    /// stands in the way, too.
    #[test]
    fn banning_is_as_good_as_beginning_again(
        points in prop::collection::vec(prop::array::uniform3(-3.0f32..3.0), 5..14),
        apexes in prop::collection::vec(prop::option::of(prop::array::uniform3(-3.0f32..3.0)), 14),
        edge in (0u32..5, 0u32..14),
        bans in prop::collection::vec(any::<prop::sample::Index>(), 1..8),
    ) {
        let forbidden = |a: u32, b: u32| (a, b) == edge;
        let rim = Rim { points: &points, apexes: &apexes[..points.len()], obstacles: &[], forbidden: &forbidden };
        let mut clearance = Clearance::new(&rim);
        let mut table = Table::new(&rim, Weight::Bend, Choice::Clear(&mut clearance));
        for ban in bans {
            let Ok(best) = table.best() else { break };
            table.ban(best[ban.index(best.len())]);
            // Why there is none is told by all that was asked, also for what is banned by now.
            prop_assert_eq!(table.best().ok(), clear(&rim, table.banned.clone()).ok());
        }
    }
}

#[test]
fn a_ban_looks_at_no_parts_but_those_around_it() {
    let n = 120;
    let at = |i: usize| std::f32::consts::TAU * i as f32 / n as f32;
    let points: Vec<Point> = (0..n).map(|i| [at(i).cos(), at(i).sin(), 0.3 * (3.0 * at(i)).sin()]).collect();
    let rim = Rim { points: &points, apexes: &[], obstacles: &[], forbidden: &|_, _| false };
    let mut clearance = Clearance::new(&rim);
    let (whole, mut table) = steps::of(|| Table::new(&rim, Weight::Bend, Choice::Clear(&mut clearance)));
    // Beyond a chord there is nothing but the parts around it, and around the last triangle none at all.
    let last = |t: &[u32; 3]| t[0] == 0 && t[2] as usize == n - 1;
    let best = table.best().unwrap();
    let (again, ()) = steps::of(|| table.ban(*best.iter().find(|t| last(t)).unwrap()));
    // All are weighed, and what is left once more where the lightest is banned.
    assert!(again <= 3 * n as u64, "{again} after {whole}");
    let best = table.best().unwrap();
    let (again, ()) = steps::of(|| table.ban(best[best.len() / 2]));
    assert!(again < whole, "{again} after {whole}");
}
