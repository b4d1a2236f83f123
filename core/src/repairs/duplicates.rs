//! Triangles with a repeated vertex, and several triangles on the same three vertices (METHODS A1, A2).
//!
//! Of copies in one direction the first stays. Where both directions occur, it is a question of what they are part of:
//! a triangle doubled back to back in an otherwise sound surface (one of them fits its neighbours: it stays), a wall of no
//! thickness inside a body (the surface closes without it: all go), a surface exported with both sides (one side stays and is
//! turned later), or two triangles on their own (nothing is enclosed: both go).

use crate::chunk;
use crate::defects::{by_vertex_set, same_direction};
use crate::shop::Shop;
use crate::shop::edges::Edges;

/// Removes triangles with a repeated vertex. Their edges cancel out, so nothing opens.
pub(super) fn drop_repeated(shop: &mut Shop) -> u64 {
    let mut count = 0;
    for triangle in &mut shop.triangles {
        if triangle.alive && crate::shop::has_repeated(triangle.v) {
            triangle.alive = false;
            count += 1;
        }
    }
    count
}

/// Triangles on one vertex set in both directions.
struct Pair {
    forward: Vec<u32>,
    backward: Vec<u32>,
    /// Triangles around that need a forward one here, less those that need a backward one.
    votes: i64,
}

/// What a connected set of pairs is part of.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Place {
    /// Alone on its three vertices.
    Alone,
    /// A surface with both sides.
    TwoSided,
    /// A wall inside a body.
    Wall,
    /// Some neighbour needs one side.
    Needed,
}

/// Removes surplus triangles on the same three vertices; returns how many.
pub(super) fn drop_duplicates(shop: &mut Shop) -> u64 {
    let mut doomed = Vec::new();
    let mut pairs: Vec<Pair> = Vec::new();
    for group in by_vertex_set(shop).chunk_by(|a, b| a.0 == b.0).filter(|g| g.len() > 1) {
        let first = shop.triangles[group[0].1 as usize].v;
        let (forward, backward): (Vec<u32>, Vec<u32>) =
            group.iter().map(|g| g.1).partition(|t| same_direction(first, shop.triangles[*t as usize].v));
        if backward.is_empty() {
            doomed.extend(&forward[1..]);
        } else {
            pairs.push(Pair { forward, backward, votes: 0 });
        }
    }
    if !pairs.is_empty() {
        doomed.extend(sort_out(shop, &mut pairs));
    }
    doomed.iter().for_each(|t| shop.kill(*t));
    doomed.len() as u64
}

fn sort_out(shop: &Shop, pairs: &mut [Pair]) -> Vec<u32> {
    let edges = Edges::of(shop);
    let mut pair_of = vec![chunk::NONE; shop.triangles.len()];
    for (i, pair) in pairs.iter().enumerate() {
        pair.forward.iter().chain(&pair.backward).for_each(|t| pair_of[*t as usize] = i as u32);
    }
    let mut parents: Vec<u32> = (0..pairs.len() as u32).collect();
    let mut places = vec![Place::Alone; pairs.len()];
    for i in 0..pairs.len() {
        let v = shop.triangles[pairs[i].forward[0] as usize].v;
        for k in 0..3 {
            let (a, b) = (v[k], v[(k + 1) % 3]);
            let Some(edge) = edges.between(a, b) else { continue };
            let (mut along, mut against) = (0i64, 0i64);
            for used in edge.uses {
                match pair_of[used.triangle as usize] {
                    chunk::NONE if edge.directed(used) == (a, b) => along += 1,
                    chunk::NONE => against += 1,
                    other if other != i as u32 => {
                        places[i] = places[i].max(Place::TwoSided);
                        chunk::unite(&mut parents, i as u32, other);
                    }
                    _ => {}
                }
            }
            pairs[i].votes += against - along;
            if along != against {
                places[i] = Place::Needed;
            } else if along > 0 {
                places[i] = places[i].max(Place::Wall);
            }
        }
    }
    let roots: Vec<usize> = (0..pairs.len() as u32).map(|i| chunk::find(&mut parents, i) as usize).collect();
    for i in 0..pairs.len() {
        places[roots[i]] = places[roots[i]].max(places[i]);
    }
    pairs.iter().enumerate().flat_map(|(i, pair)| surplus_of(pair, places[roots[i]])).collect()
}

/// What has to go of a pair in a set of this place.
fn surplus_of(pair: &Pair, place: Place) -> Vec<u32> {
    let all = || pair.forward.iter().chain(&pair.backward).copied();
    let stays = match place {
        Place::Alone | Place::Wall => None,
        Place::TwoSided => all().min(),
        Place::Needed if pair.votes > 0 => Some(pair.forward[0]),
        Place::Needed if pair.votes < 0 => Some(pair.backward[0]),
        Place::Needed => all().min(),
    };
    all().filter(|t| Some(*t) != stays).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{after, cube, cuboid, reversed};

    #[test]
    fn of_a_reversed_copy_the_one_that_fits_stays() {
        // The wrong one comes first: the order in the file does not decide.
        let doubled = [reversed(&cube()[..1]), cube()].concat();
        let got = after(&doubled, |d, _| drop_duplicates(&mut d.shop));
        assert_eq!((got.result, got.untouched), (1, 12));
        assert!(got.verdict.good, "{:?}", got.verdict);
    }

    #[test]
    fn a_wall_of_no_thickness_inside_a_body_goes() {
        // Two cubes that touch: both have the face between them, in opposite directions.
        let cubes = [cube(), cuboid([1.0, 0.0, 0.0], [2.0, 1.0, 1.0])].concat();
        let got = after(&cubes, |d, _| drop_duplicates(&mut d.shop));
        assert_eq!(got.result, 4);
        assert!(got.verdict.good && (got.defects.volume - 2.0).abs() < 1e-9, "{:?}", got.defects);
    }

    #[test]
    fn of_a_surface_with_both_sides_one_stays() {
        let both = [cube(), reversed(&cube())].concat();
        let got = after(&both, |d, _| drop_duplicates(&mut d.shop));
        assert_eq!(got.result, 12);
        assert!(got.verdict.good, "{:?}", got.verdict);
    }

    #[test]
    fn two_triangles_on_their_own_enclose_nothing() {
        let alone = [&cube()[..1], &reversed(&cube()[..1])].concat();
        let got = after(&alone, |d, _| drop_duplicates(&mut d.shop));
        assert_eq!((got.result, got.defects.triangles), (2, 0));
    }

    #[test]
    fn of_equal_copies_the_first_stays() {
        let twice = [cube(), cube()].concat();
        let got = after(&twice, |d, _| drop_duplicates(&mut d.shop));
        assert_eq!((got.result, got.untouched), (12, 12));
        assert!(got.verdict.good);
    }
}
