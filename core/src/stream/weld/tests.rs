//! Against an oracle that compares every vertex with every other one.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use glam::DVec3;
use proptest::prelude::*;

use super::reach::{CROWD, FINER};
use super::{CELL, Counts, WIDEST, look, weld};
use crate::contract::progress::Quiet;
use crate::contract::settings::{Limits, Spill};
use crate::geometry::distance::{Tolerance, place};
use crate::io::read_ahead::Guide;
use crate::io::record::{self, Point, Record};
use crate::util::scatter;

type Key = [u32; 3];

#[expect(clippy::disallowed_methods, reason = "an oracle of its own")]
fn key(p: Point) -> Key {
    p.map(|x| (x + 0.0).to_bits())
}

fn limits(chunk_triangles: u32, threads: usize, spill: Spill) -> Limits {
    Limits { chunk_triangles, threads, spill, ..Limits::default() }
}

fn welded(records: &[Record], reach: Tolerance, limits: &Limits) -> (Vec<Record>, Counts) {
    let welded = weld(Path::new("test"), records, reach, limits, &Quiet).unwrap();
    (welded.records.as_chunks().0.to_vec(), welded.counts)
}

/// The triangles at each position, with the corner that is there.
type Stars = BTreeMap<Key, Vec<(usize, usize)>>;

fn at(v: &Key) -> DVec3 {
    place(v.map(f32::from_bits))
}

/// How far each vertex reaches; those that are closed around reach nowhere.
fn reaches(triangles: &[[Point; 3]], stars: &Stars, reach: Tolerance) -> BTreeMap<Key, f64> {
    let of = |(v, star): (&Key, &Vec<(usize, usize)>)| {
        let mut uses: BTreeMap<Key, usize> = BTreeMap::new();
        let mut shortest = f64::INFINITY;
        for (t, k) in star {
            let others = [triangles[*t][(k + 1) % 3], triangles[*t][(k + 2) % 3]].map(key);
            if others.contains(v) || others[0] == others[1] {
                continue;
            }
            for other in others {
                *uses.entry(other).or_default() += 1;
                shortest = shortest.min(at(v).distance(at(&other)));
            }
            shortest = shortest.min(at(&others[0]).distance(at(&others[1])));
        }
        let is_open = uses.values().any(|count| *count == 1);
        (*v, if is_open { reach.weld.min(shortest * reach.edge_share) } else { 0.0 })
    };
    stars.iter().map(of).collect()
}

/// The cell of a place, of so many to a tolerance.
fn cell(v: &Key, a_tolerance: f64, weld: f64) -> [i64; 3] {
    (at(v) * (1.0 / (CELL * weld)) * (a_tolerance * CELL)).to_array().map(|x| x.floor() as i64)
}

/// For each member of a crowd the one that stands for it.
fn crowds(reaches: &BTreeMap<Key, f64>, weld: f64) -> BTreeMap<Key, Key> {
    let mut cells: BTreeMap<[i64; 3], Vec<Key>> = BTreeMap::new();
    for (v, _) in reaches.iter().filter(|(_, reach)| **reach > 0.0) {
        cells.entry(cell(v, FINER / CELL, weld)).or_default().push(*v);
    }
    let crowds = cells.into_values().filter(|all| all.len() > CROWD);
    crowds.flat_map(|all| all.clone().into_iter().map(move |v| (v, all[0]))).collect()
}

/// Which spokes continue each other: pairs of vertices.
fn along_edges(
    triangles: &[[Point; 3]],
    reaches: &BTreeMap<Key, f64>,
    is_alone: impl Fn(&Key) -> bool,
    weld: f64,
) -> Vec<[Key; 2]> {
    // Near end, far end, does it lead there, triangle.
    let mut spokes: Vec<(Key, Key, bool, usize)> = Vec::new();
    for (t, corners) in triangles.iter().enumerate() {
        let c = corners.map(key);
        if c[0] != c[1] && c[1] != c[2] && c[2] != c[0] {
            spokes.extend((0..3).flat_map(|k| [(c[k], c[(k + 1) % 3], true, t), (c[k], c[(k + 2) % 3], false, t)]));
        }
    }
    spokes.retain(|spoke| reaches[&spoke.0] > 0.0 && is_alone(&spoke.0));
    spokes.sort_unstable();
    let nearest = |a: &(Key, Key, bool, usize)| {
        let apart = |b: &(Key, Key, bool, usize)| [at(&a.0).distance_squared(at(&b.0)), at(&a.1).distance_squared(at(&b.1))];
        let cost = |b: &(Key, Key, bool, usize)| if a.2 == b.2 { 2.0 } else { 1.0 } * (apart(b)[0] + apart(b)[1]);
        let could = spokes.iter().filter(|b| b.0 != a.0 && b.3 != a.3 && apart(b).iter().all(|d| *d <= weld * weld));
        could.min_by(|b, c| cost(b).total_cmp(&cost(c)))
    };
    let is_short = |v: &Key| reaches[v] < weld;
    let pairs = spokes.iter().filter(|a| is_short(&a.0)).filter_map(|a| {
        let b = nearest(a)?;
        let back = nearest(b)?;
        ((back.0, back.1, back.2) == (a.0, a.1, a.2)).then_some([a.0, b.0])
    });
    pairs.collect()
}

/// Sets of vertices that hang together.
fn sets(triangles: &[[Point; 3]], reaches: &BTreeMap<Key, f64>, weld: f64) -> Vec<Vec<Key>> {
    let crowds = crowds(reaches, weld);
    let is_alone = |v: &Key| !crowds.contains_key(v);
    let stands = |v: &Key| crowds.get(v) == Some(v);
    let mut pairs = along_edges(triangles, reaches, is_alone, weld);
    pairs.extend(crowds.iter().map(|(v, first)| [*v, *first]));
    let open: Vec<Key> = reaches.iter().filter(|(_, reach)| **reach > 0.0).map(|(v, _)| *v).collect();
    for (i, a) in open.iter().enumerate() {
        for b in &open[..i] {
            let nearest = if stands(a) || stands(b) { weld } else { reaches[a].min(reaches[b]) };
            let may = [a, b].iter().all(|v| is_alone(v) || stands(v));
            if may && at(a).distance_squared(at(b)) <= nearest * nearest {
                pairs.push([*a, *b]);
            }
        }
    }
    let mut set_of: BTreeMap<Key, Key> = pairs.iter().flatten().map(|v| (*v, *v)).collect();
    for [a, b] in &pairs {
        let (a, b) = (set_of[a], set_of[b]);
        set_of.values_mut().filter(|set| **set == a).for_each(|set| *set = b);
    }
    let mut sets: BTreeMap<Key, Vec<Key>> = BTreeMap::new();
    set_of.iter().for_each(|(v, set)| sets.entry(*set).or_default().push(*v));
    sets.into_values().collect()
}

/// Where every vertex goes, by brute force.
fn oracle(records: &[Record], reach: Tolerance) -> Vec<Record> {
    let triangles: Vec<[Point; 3]> = records.iter().map(record::corners).collect();
    let mut stars = Stars::new();
    for (t, corners) in triangles.iter().enumerate() {
        (0..3).for_each(|k| stars.entry(key(corners[k])).or_default().push((t, k)));
    }
    let reaches = reaches(&triangles, &stars, reach);
    let mut target: BTreeMap<Key, Key> = BTreeMap::new();
    let mut wide: BTreeMap<[i64; 3], Vec<Key>> = BTreeMap::new();
    for set in sets(&triangles, &reaches, reach.weld) {
        let (lo, hi) = set.iter().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(lo, hi), v| (lo.min(at(v)), hi.max(at(v))));
        if hi.distance(lo) > WIDEST * reach.weld {
            set.iter().for_each(|v| wide.entry(cell(v, 1.0 / CELL, reach.weld)).or_default().push(*v));
            continue;
        }
        let chosen = set.iter().min_by_key(|v| (std::cmp::Reverse(stars[*v].len()), **v)).unwrap();
        target.extend(set.iter().map(|v| (*v, *chosen)));
    }
    for (cell, set) in wide {
        let middle = (DVec3::from_array(cell.map(|x| x as f64)) + 0.5) / (1.0 / (CELL * reach.weld));
        let away = |v: &Key| at(v).distance_squared(middle);
        let chosen = set.iter().min_by(|a, b| away(a).total_cmp(&away(b)).then(a.cmp(b))).unwrap();
        target.extend(set.iter().map(|v| (*v, *chosen)));
    }
    let mut all = records.to_vec();
    for (v, star) in &stars {
        if let Some(to) = target.get(v).filter(|to| *to != v) {
            star.iter().for_each(|(t, k)| record::put_corner(&mut all[*t], *k, to.map(f32::from_bits)));
        }
    }
    all
}

/// A wavy plate of squares of side 1, each corner of each triangle moved by up to `jitter` along each axis, but for those that `stays` names.
fn plate(side: usize, jitter: f32, stays: impl Fn(u64) -> bool) -> Vec<Record> {
    let mut number = 0;
    let mut shaken = |x: f32| {
        number += 1;
        if stays(number / 3) { x } else { x + jitter * (2.0 * scatter::share(number) as f32 - 1.0) }
    };
    let mut all = Vec::new();
    for (x, y) in (0..side).flat_map(|x| (0..side).map(move |y| (x, y))) {
        let at = |dx: usize, dy: usize| [(x + dx) as f32, (y + dy) as f32, ((x + dx) * (y + dy) % 3) as f32];
        let [a, b, c, d] = [at(0, 0), at(1, 0), at(1, 1), at(0, 1)];
        for corners in [[a, b, c], [a, c, d]] {
            all.push(record::encode(corners.map(|p| p.map(&mut shaken)), 0));
        }
    }
    all
}

/// A sphere of radius 1 by degrees of latitude and longitude, poles off the corners of cells, each corner of each triangle moved by up to `jitter` along
/// each axis: `rows` from pole to pole, or as many of them as `most`.
fn globe(rows: usize, columns: usize, most: usize, jitter: f32) -> Vec<Record> {
    let at = |i: usize, j: usize| {
        let (t, p) =
            (i as f64 / rows as f64 * std::f64::consts::PI, (j % columns) as f64 / columns as f64 * std::f64::consts::TAU);
        let flat = if i.is_multiple_of(rows) { 0.0 } else { t.sin() };
        [0.11 + flat * p.cos(), 0.13 + flat * p.sin(), 0.17 + t.cos()].map(|x| x as f32)
    };
    let mut number = 0;
    let mut shaken = |x: f32| {
        number += 1;
        x + jitter * (2.0 * scatter::share(number) as f32 - 1.0)
    };
    let mut all = Vec::new();
    for (i, j) in (0..rows.min(most)).flat_map(|i| (0..columns).map(move |j| (i, j))) {
        let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
        for (corners, is_left_out) in [([a, b, c], i + 1 == rows), ([a, c, d], i == 0)] {
            if !is_left_out {
                all.push(record::encode(corners.map(|p| p.map(&mut shaken)), 0));
            }
        }
    }
    all
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, ..ProptestConfig::default() })]
    /// Chains, crowds of a few, triangles with two corners in one place, surface that is sound: as by brute force, whatever the chunks are.
    #[test]
    fn as_by_brute_force_for_any_chunks(
        side in 1usize..7,
        jitter in prop_oneof![Just(0.0f32), 1e-3f32..0.3],
        weld_by in 1e-3f64..0.4,
        edge_share in prop_oneof![Just(0.25), Just(1.0)],
        sound in 0u64..4,
        chunk in 1u32..20,
        threads in 1usize..3,
    ) {
        let records = plate(side, jitter, |n| n % 4 < sound);
        let reach = Tolerance { weld: weld_by, edge_share };
        let wanted = oracle(&records, reach);
        for (chunk, spill) in [(chunk, Spill::Never), (chunk, Spill::Always), (1 << 20, Spill::Never)] {
            let (got, counts) = welded(&records, reach, &limits(chunk, threads, spill));
            prop_assert_eq!(&got, &wanted, "chunks of {}", chunk);
            let differ = records.iter().zip(&wanted).filter(|(a, b)| a != b).count() as u64;
            prop_assert_eq!(counts.moved_triangles, differ);
            prop_assert_eq!(counts.triangles, records.len() as u64);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 16, ..ProptestConfig::default() })]
    /// About a pole: crowds, edges shorter than what corners were moved by, and what is wider than four tolerances.
    #[test]
    fn a_pole_as_by_brute_force_for_any_chunks(
        rows in 10usize..60,
        columns in 3usize..80,
        most in 1usize..4,
        jitter in prop_oneof![1e-5f32..1e-3, 1e-3f32..2e-2],
        weld_by in prop_oneof![1e-3f64..1e-2, 1e-2f64..0.3],
        edge_share in prop_oneof![Just(0.25), Just(1.0)],
        chunk in 1u32..40,
        threads in 1usize..3,
    ) {
        let records = globe(rows, columns, most, jitter);
        let reach = Tolerance { weld: weld_by, edge_share };
        let wanted = oracle(&records, reach);
        for (chunk, spill) in [(chunk, Spill::Never), (7, Spill::Always), (64, Spill::Never), (1 << 20, Spill::Never)] {
            let (got, _) = welded(&records, reach, &limits(chunk, threads, spill));
            prop_assert_eq!(&got, &wanted, "chunks of {}", chunk);
        }
    }
}

/// How often each edge is used: there, less back.
fn balance(records: &[Record]) -> Vec<i32> {
    let mut uses: BTreeMap<[Key; 2], i32> = BTreeMap::new();
    for c in records.iter().map(record::corners).map(|c| c.map(key)) {
        for [a, b] in [[c[0], c[1]], [c[1], c[2]], [c[2], c[0]]].into_iter().filter(|[a, b]| a != b) {
            *uses.entry([a.min(b), a.max(b)]).or_default() += if a < b { 1 } else { -1 };
        }
    }
    uses.into_values().collect()
}

/// Corners of one vertex lie up to 0.7 of an edge apart; at the poles more of them than make a crowd.
#[test]
fn a_globe_with_poles_finer_than_its_corners_were_moved_by_stays_closed() {
    let (rows, columns) = (100, 200);
    let jitter = (std::f64::consts::PI / 100.0).sin() as f32 * std::f32::consts::TAU / 200.0 * 0.2;
    let records = globe(rows, columns, rows, jitter);
    let reach = Tolerance { weld: 4.0 * f64::from(jitter), edge_share: 0.25 };
    let (got, _) = welded(&records, reach, &limits(500, 2, Spill::Never));
    let places: BTreeSet<Key> = got.iter().flat_map(record::corners).map(key).collect();
    assert_eq!(places.len(), 2 + (rows - 1) * columns);
    assert!(balance(&got).iter().all(|n| *n == 0));
}

#[test]
fn a_shaken_plate_becomes_whole_and_is_counted() {
    let (records, reach) = (plate(8, 1e-3, |_| false), Tolerance { weld: 0.01, edge_share: 0.25 });
    let (got, counts) = welded(&records, reach, &limits(10, 2, Spill::Never));
    let places: BTreeSet<Key> = got.iter().flat_map(record::corners).map(key).collect();
    assert_eq!(places.len(), 81);
    assert_eq!((counts.vertices, counts.edges, counts.boundary_edges), (384, 384, 384));
    assert_eq!((counts.moved, counts.nonmanifold_edges, counts.unbalanced_edges), (384 - 81, 0, 384));
    assert!(counts.farthest > 1e-3 && counts.farthest < 4e-3, "{}", counts.farthest);
}

/// A file in which nothing is shared, in its order or in another one, and one where all is.
#[test]
fn a_look_tells_what_shares_nothing() {
    let reach = |weld: f64| move |_: &_| Tolerance { weld, edge_share: 0.25 };
    let (shaken, sound) = (plate(300, 1e-4, |_| false), plate(300, 0.0, |_| false));
    let tells = |records: &[Record]| look::widest_if_nothing_is_shared(records, &Guide::NONE, reach(1e-3)).is_some();
    let mixed = |records: &[Record]| {
        let mut order: Vec<usize> = (0..records.len()).collect();
        order.sort_by(|a, b| scatter::share(*a as u64).total_cmp(&scatter::share(*b as u64)));
        order.into_iter().map(|i| records[i]).collect::<Vec<_>>()
    };
    assert!(tells(&shaken) && tells(&mixed(&shaken)));
    assert!(!tells(&sound) && !tells(&mixed(&sound)));
    assert!(look::widest_if_nothing_is_shared(&shaken, &Guide::NONE, reach(0.0)).is_none(), "switched off");
    assert!(!tells(&shaken[..1000]), "a small file");
}

/// Something far off makes the box large, and with it what the profile calls near. The triangles tell what may be welded.
#[test]
fn a_look_asks_no_more_of_triangles_than_they_are_large_enough_for() {
    let shaken = plate(300, 1e-4, |_| false);
    let reach = |weld: f64| move |_: &_| Tolerance { weld, edge_share: 0.25 };
    let widest = look::widest_if_nothing_is_shared(&shaken, &Guide::NONE, reach(1e-3)).unwrap();
    assert_eq!(look::widest_if_nothing_is_shared(&shaken, &Guide::NONE, reach(1e3)), Some(widest));
    let weld = |weld: f64| {
        super::weld(Path::new("test"), &shaken, Tolerance { weld, edge_share: 0.25 }, &limits(1 << 15, 2, Spill::Auto), &Quiet)
            .unwrap()
    };
    let fits = weld(widest.min(1e-2));
    assert!(fits.keeps_all() && fits.counts.moved > 0, "{:?}", fits.counts);
    assert!(!weld(widest * 40.0).keeps_all(), "as wide as some triangles");
}
