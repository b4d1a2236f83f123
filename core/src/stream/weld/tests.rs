//! Against an oracle that compares every vertex with every other one.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use glam::DVec3;
use proptest::prelude::*;

use super::{Counts, WIDEST, look, weld};
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
        }
        let is_open = uses.values().any(|count| *count == 1);
        (*v, if is_open { reach.weld.min(shortest * reach.edge_share) } else { 0.0 })
    };
    stars.iter().map(of).collect()
}

/// Where every vertex goes, by brute force.
fn oracle(records: &[Record], reach: Tolerance) -> Vec<Record> {
    let triangles: Vec<[Point; 3]> = records.iter().map(record::corners).collect();
    let mut stars = Stars::new();
    for (t, corners) in triangles.iter().enumerate() {
        (0..3).for_each(|k| stars.entry(key(corners[k])).or_default().push((t, k)));
    }
    let reaches = reaches(&triangles, &stars, reach);
    let vertices: Vec<Key> = stars.keys().copied().collect();
    let are_near = |a: &Key, b: &Key| {
        let nearest = reaches[a].min(reaches[b]);
        nearest > 0.0 && at(a).distance_squared(at(b)) <= nearest * nearest
    };
    let (mut target, mut done): (BTreeMap<Key, Key>, BTreeSet<Key>) = Default::default();
    for v in &vertices {
        if !done.insert(*v) {
            continue;
        }
        let mut group = vec![*v];
        let mut next = 0;
        while next < group.len() {
            let near: Vec<Key> = vertices.iter().filter(|w| !done.contains(*w) && are_near(&group[next], w)).copied().collect();
            done.extend(&near);
            group.extend(near);
            next += 1;
        }
        let (lo, hi) = group.iter().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(lo, hi), v| (lo.min(at(v)), hi.max(at(v))));
        let has_two = triangles.iter().any(|t| {
            let own: BTreeSet<Key> = t.iter().map(|p| key(*p)).filter(|v| group.contains(v)).collect();
            own.len() > 1
        });
        if hi.distance(lo) <= WIDEST * reach.weld && !has_two {
            let chosen = group.iter().min_by_key(|v| (std::cmp::Reverse(stars[*v].len()), **v)).unwrap();
            target.extend(group.iter().map(|v| (*v, *chosen)));
        }
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
    let tells = |records: &[Record]| look::shares_nothing(records, &Guide::NONE, reach(1e-3));
    let mixed = |records: &[Record]| {
        let mut order: Vec<usize> = (0..records.len()).collect();
        order.sort_by(|a, b| scatter::share(*a as u64).total_cmp(&scatter::share(*b as u64)));
        order.into_iter().map(|i| records[i]).collect::<Vec<_>>()
    };
    assert!(tells(&shaken) && tells(&mixed(&shaken)));
    assert!(!tells(&sound) && !tells(&mixed(&sound)));
    assert!(!look::shares_nothing(&shaken, &Guide::NONE, reach(0.0)), "switched off");
    assert!(!tells(&shaken[..1000]), "a small file");
}
