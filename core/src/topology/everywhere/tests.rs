//! Against an oracle that compares every triangle with every other one.

use std::path::Path;

use proptest::prelude::*;

use super::{CONTRADICTING, look};
use crate::contract::progress::Quiet;
use crate::contract::settings::{Limits, Spill};
use crate::io::record::{self, Point, Record};
use crate::testing::{Corners, cube, plate, records, reversed, shifted};

/// What is found: the records that go, those that turn, and the edges that disagree.
type Found = (Vec<usize>, Vec<usize>, u64);

fn found(records: &[Record], chunk_triangles: u32, threads: usize, spill: Spill) -> Found {
    let limits = Limits { chunk_triangles, threads, spill, ..Limits::default() };
    let Some(found) = look(Path::new("test"), records, &limits, &Quiet).unwrap() else { return Found::default() };
    let numbers = |bits: &[u64]| (0..records.len()).filter(|t| bits[t / 64] >> (t % 64) & 1 == 1).collect::<Vec<_>>();
    let (gone, turned) = (numbers(&found.gone), numbers(&found.turned));
    assert_eq!([found.copies, found.turns], [gone.len() as u64, turned.len() as u64]);
    (gone, turned, found.contradictions)
}

/// Does the triangle lead along this edge, or against it?
fn leads([a, b, c]: &Corners, p: Point, q: Point) -> Option<bool> {
    let along = |x: &Point, y: &Point| *x == p && *y == q;
    if along(a, b) || along(b, c) || along(c, a) {
        return Some(true);
    }
    (along(b, a) || along(c, b) || along(a, c)).then_some(false)
}

fn edges([a, b, c]: &Corners) -> [[Point; 2]; 3] {
    [[*a, *b], [*b, *c], [*c, *a]]
}

fn vertex_set(corners: &Corners) -> Corners {
    let mut set = *corners;
    set.sort_by(|a, b| a.partial_cmp(b).unwrap());
    set
}

/// The triangles at an edge by their vertices, first ones first.
fn faces(triangles: &[Corners], [p, q]: [Point; 2]) -> Vec<Vec<(usize, bool)>> {
    let mut faces: Vec<Vec<(usize, bool)>> = Vec::new();
    for (t, corners) in triangles.iter().enumerate() {
        let Some(along) = leads(corners, p, q) else { continue };
        match faces.iter_mut().find(|face| vertex_set(&triangles[face[0].0]) == vertex_set(corners)) {
            Some(face) => face.push((t, along)),
            None => faces.push(vec![(t, along)]),
        }
    }
    faces
}

/// Colours the triangles of a piece from its smallest one on; what was found of it.
struct Piece {
    /// With its side.
    members: Vec<(usize, bool)>,
    copies: Vec<usize>,
    uneven: bool,
    one_sided: bool,
}

fn piece(triangles: &[Corners], start: usize) -> Piece {
    let mut piece = Piece { members: vec![(start, false)], copies: Vec::new(), uneven: false, one_sided: false };
    let mut next = 0;
    while let Some((t, side)) = piece.members.get(next).copied() {
        next += 1;
        for edge in edges(&triangles[t]) {
            let faces = faces(triangles, edge);
            let often = faces[0].len();
            let is_even = faces.iter().all(|face| face.len() == often && face.iter().all(|one| one.1 == face[0].1));
            piece.uneven |= !is_even || faces.len() > 2 && often > 1;
            let Some(own) = faces.iter().find(|face| face[0].0 == t) else { continue };
            piece.copies.extend(own[1..].iter().map(|one| one.0));
            let [a, b] = &faces[..] else { continue };
            if !is_even {
                continue;
            }
            let other = if a[0].0 == t { b } else { a };
            let its_side = side != (a[0].1 == b[0].1);
            match piece.members.iter().find(|(member, _)| *member == other[0].0) {
                Some((_, known)) => piece.one_sided |= *known != its_side,
                None => piece.members.push((other[0].0, its_side)),
            }
        }
    }
    piece.copies.sort_unstable();
    piece.copies.dedup();
    piece
}

fn oracle(records: &[Record]) -> Found {
    let all: Vec<Corners> = records.iter().map(record::corners).collect();
    let is_whole = |t: &Corners| t[0] != t[1] && t[1] != t[2] && t[2] != t[0];
    let numbers: Vec<usize> = (0..all.len()).filter(|t| is_whole(&all[*t])).collect();
    let triangles: Vec<Corners> = numbers.iter().map(|t| all[*t]).collect();
    let mut contradictions = 0;
    for (t, corners) in triangles.iter().enumerate() {
        for edge in edges(corners) {
            let faces = faces(&triangles, edge);
            let is_even = faces.iter().all(|f| f.len() == faces[0].len() && f.iter().all(|one| one.1 == f[0].1));
            let disagree = faces.len() == 2 && is_even && faces[0][0].1 == faces[1][0].1;
            contradictions += u64::from(disagree && faces[0][0].0 == t);
        }
    }
    let turns = contradictions as f64 >= CONTRADICTING * records.len() as f64;
    let mut known = vec![false; triangles.len()];
    let (mut gone, mut turned) = (Vec::new(), Vec::new());
    for t in 0..triangles.len() {
        let is_copy = (0..t).any(|other| vertex_set(&triangles[other]) == vertex_set(&triangles[t]));
        if known[t] || is_copy {
            continue;
        }
        let piece = piece(&triangles, t);
        piece.members.iter().for_each(|(member, _)| known[*member] = true);
        if !piece.copies.is_empty() && piece.uneven {
            continue;
        }
        gone.extend(piece.copies);
        let (even, odd): (Vec<_>, Vec<_>) = piece.members.iter().partition(|(_, side)| !side);
        // The even side has the smallest triangle.
        let loser = if odd.len() > even.len() { even } else { odd };
        if turns && !piece.one_sided {
            turned.extend(loser.into_iter().map(|(member, _)| member));
        }
    }
    let sorted = |mut list: Vec<usize>| {
        list.sort_unstable();
        list.into_iter().map(|t| numbers[t]).collect::<Vec<_>>()
    };
    if gone.len() + turned.len() == 0 { Found::default() } else { (sorted(gone), sorted(turned), contradictions) }
}

#[test]
fn a_body_drawn_three_times_stays_once() {
    let body = cube();
    let all = [&body[..], &shifted(&body, [9.0; 3]), &body, &body].concat();
    assert_eq!(found(&records(&all), 4, 1, Spill::Auto), ((24..48).collect(), Vec::new(), 0));
}

#[test]
fn a_body_of_which_a_part_is_drawn_twice_is_left() {
    let body = cube();
    let all = [&body[..], &body[..5]].concat();
    assert_eq!(found(&records(&all), 4, 1, Spill::Auto), Found::default());
}

#[test]
fn a_body_drawn_in_both_directions_is_left() {
    let body = cube();
    let all = [&body[..], &reversed(&body)].concat();
    assert_eq!(found(&records(&all), 4, 1, Spill::Auto), Found::default());
}

#[test]
fn the_fewer_triangles_turn_though_they_come_first() {
    let mut body = cube();
    let fewer = [0, 1, 4, 7, 9];
    for t in fewer {
        body[t].swap(1, 2);
    }
    let (gone, turned, contradictions) = found(&records(&body), 4, 1, Spill::Auto);
    assert_eq!((gone, turned), (Vec::new(), fewer.to_vec()));
    assert!(contradictions >= 3);
}

#[test]
fn a_one_sided_strip_is_left() {
    // Five triangles around, the last of which meets the first the other way round.
    let p: Vec<Point> = (0..5).map(|i| [i as f32, (i * i) as f32, (i % 2) as f32]).collect();
    let strip: Vec<Corners> = (0..5).map(|i| [p[i], p[(i + 1) % 5], p[(i + 2) % 5]]).collect();
    assert_eq!(found(&records(&strip), 4, 1, Spill::Auto), Found::default());
}

/// Triangles of a few cubes and a plate, some of them turned, more than once, or not there; shuffled.
fn meshes() -> impl Strategy<Value = Vec<Corners>> {
    let mut all = cube();
    all.extend(shifted(&cube(), [1.0, 0.0, 0.0]));
    all.extend(shifted(&cube(), [0.0, 5.0, 0.0]));
    all.extend(shifted(&plate(3, |_, _| true), [4.0, 4.0, 0.0]));
    let count = all.len();
    let kinds = prop_oneof![12 => Just(1usize), 2 => Just(0), 2 => Just(2)];
    let how = (prop::collection::vec((kinds, any::<bool>(), 0..8u8), count), 0..4u8, 0..3usize);
    let drawn = how.prop_map(move |(each, turning, extra)| {
        let mut drawn = Vec::new();
        for ((times, turned, which), corners) in each.into_iter().zip(&all) {
            let is_turned = turned && turning > 0 && which < 3 * turning;
            let mut corners = *corners;
            if is_turned {
                corners.swap(1, 2);
            }
            // Where `extra` is 2 all is drawn twice, so that there are pieces that are.
            let times = if extra == 2 { 2 } else { times };
            drawn.extend((0..times).map(|k| {
                corners.rotate_left(k);
                corners
            }));
        }
        drawn.push([[0.0; 3], [1.0, 0.0, 0.0], [0.0; 3]]);
        drawn
    });
    drawn.prop_shuffle()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 128, ..ProptestConfig::default() })]

    /// The same as the oracle says, for chunks of any size, any threads, lists and spools.
    #[test]
    fn is_what_comparing_all_with_all_says(triangles in meshes()) {
        let records = records(&triangles);
        let expected = oracle(&records);
        for (chunk, threads, spill) in [(1, 1, Spill::Auto), (2, 2, Spill::Always), (7, 1, Spill::Auto), (64, 2, Spill::Always), (1000, 1, Spill::Auto)] {
            prop_assert_eq!(&found(&records, chunk, threads, spill), &expected, "chunks of {}", chunk);
        }
    }
}
