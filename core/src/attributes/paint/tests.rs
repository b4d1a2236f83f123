use super::clip::{self, Weights};
use super::samples::{mix, paint, place};
use super::split::{Share, Way};
use super::tree::Paint;
use super::turn::ORDERS;
use proptest::prelude::*;
use std::collections::BTreeMap;

const CORNERS: [Weights; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
const WAYS: [Way; 3] = [Way::One, Way::Two, Way::Three];

/// State 1 in the child with the first number, and so on.
fn numbered(way: Way, first: u8) -> Paint {
    Paint::split(way, first, (1..).take(way.points().len()).map(Paint::uniform).collect())
}

#[test]
fn states_are_written_in_as_many_digits_as_they_need() {
    // The state's digits stand before the mark C: 3 + 13, 3 + 14, 3 + 15 + 0, 3 + 15 + 15 + 1.
    let known = [(0, "0"), (1, "4"), (2, "8"), (3, "0C"), (16, "DC"), (17, "EC"), (18, "0FC"), (34, "1FFC")];
    for (state, text) in known {
        assert_eq!(Paint::uniform(state).to_text(), text);
        assert_eq!(Paint::parse(text), Some(Paint::uniform(state)));
    }
}

#[test]
fn the_root_is_the_last_digit_and_the_first_child_the_first_one() {
    // A node of one cut, corner 0; then the second child (8: state 2), then the first one (4: state 1).
    let one = Paint::parse("481").expect("a tree");
    assert_eq!(one, numbered(Way::One, 0));
    // The side opposite to corner 0 is cut, and the first child has corner 1.
    assert_eq!(one.state_at([0.2, 0.7, 0.1]), 1);
    assert_eq!(one.state_at([0.2, 0.1, 0.7]), 2);
    // Corner 2 is special (10 in bits), and two sides are cut: 1010 in bits is A. The child at corner 2 has state 1; the other two
    // share the rest, and the last one has all of the side from corner 0 to corner 1.
    let two = Paint::parse("480CA").expect("a tree");
    assert_eq!(two, numbered(Way::Two, 2));
    assert_eq!(two.state_at([0.1, 0.1, 0.8]), 1);
    assert_eq!(two.state_at([0.6, 0.1, 0.3]), 2);
    assert_eq!(two.state_at([0.45, 0.45, 0.1]), 3);
    let three = Paint::parse("480C1C3").expect("a tree");
    assert_eq!(three, numbered(Way::Three, 0));
    for (place, state) in [([0.8, 0.1, 0.1], 1), ([0.1, 0.8, 0.1], 2), ([0.1, 0.1, 0.8], 3), ([0.3, 0.3, 0.4], 4)] {
        assert_eq!(three.state_at(place), state);
    }
    assert_eq!(two.state_areas(), [(1, 0.25), (2, 0.25), (3, 0.5)]);
}

#[test]
fn what_is_no_tree_is_refused() {
    // Nothing, an end within a tree, an end within a state, a corner with the number 3, a letter that slicers take for 0.
    for text in ["", "1", "81", "C", "FC", "48D", "3a", "4x", "4 ", "4\u{660}"] {
        assert_eq!(Paint::parse(text), None, "{text:?}");
    }
    // Slicers do not read on after the tree.
    assert_eq!(Paint::parse("zz4"), Some(Paint::uniform(1)));
}

#[test]
fn areas_may_be_halved_52_times() {
    let chain = |splits: usize| "0".repeat(splits + 1) + &"1".repeat(splits);
    let deepest = Paint::parse(&chain(52)).expect("the smallest area");
    assert_eq!(deepest.to_text(), chain(52));
    assert_eq!(deepest.state_areas(), [(0, 1.0)]);
    assert_eq!(Paint::parse(&chain(53)), None);
    assert_eq!(Paint::parse(&"1".repeat(1_000_000)), None);
}

#[test]
fn children_cover_the_triangle_and_are_found_by_their_middles() {
    for way in WAYS {
        for first in 0..3 {
            let mut covered = 0.0;
            let paint = numbered(way, first);
            for (number, (at, halvings)) in way.corners(first, CORNERS).zip(way.halvings()).enumerate() {
                assert_eq!(clip::doubled(at[0], at[1], at[2]), 0.5_f64.powi(*halvings as i32), "its direction is the triangle's");
                covered += clip::area(&at);
                // Near each corner of the child, and in its middle.
                for weights in [[0.98, 0.01, 0.01], [0.01, 0.98, 0.01], [0.01, 0.01, 0.98], [0.33, 0.33, 0.34]] {
                    assert_eq!(paint.state_at(mix(at, weights)), number as u32 + 1, "{way:?} {first}");
                }
            }
            assert_eq!(covered, 1.0);
        }
    }
}

/// Whether no node of one cut has a second child that is cut through the same middle: such a node can be written otherwise.
fn without_synonyms(paint: &Paint) -> bool {
    let Paint::Split(split) = paint else { return true };
    let synonym = match (split.way, split.children.get(1)) {
        // The middle is the child's first corner. It is opposite to the cut, or one of the two cuts ends at it.
        (Way::One, Some(Paint::Split(second))) => matches!((second.way, second.first), (Way::One, 0) | (Way::Two, 2)),
        _ => false,
    };
    !synonym && split.children.iter().all(without_synonyms)
}

fn nodes(paint: &Paint, at: [Weights; 3]) -> Vec<(&Paint, [Weights; 3])> {
    let mut all = vec![(paint, at)];
    if let Paint::Split(split) = paint {
        all.extend(split.parts(at, Share::WHOLE).flat_map(|(child, at, _)| nodes(child, at)));
    }
    all
}

/// Pieces of a triangle: cut at places in the middle of pieces.
fn pieces(places: &[(usize, Weights)]) -> Vec<[Weights; 3]> {
    let mut pieces = vec![CORNERS];
    for (which, weights) in places {
        let [a, b, c] = pieces.swap_remove(which % pieces.len());
        let middle = mix([a, b, c], *weights);
        pieces.extend([[a, b, middle], [middle, b, c], [a, middle, c]]);
    }
    pieces
}

fn shares(of: impl IntoIterator<Item = (u32, f64)>) -> BTreeMap<u32, f64> {
    let mut all = BTreeMap::new();
    of.into_iter().for_each(|(state, share)| *all.entry(state).or_insert(0.0) += share);
    all
}

fn near(a: &BTreeMap<u32, f64>, b: &BTreeMap<u32, f64>, by: f64) -> bool {
    a.keys().chain(b.keys()).all(|state| (a.get(state).unwrap_or(&0.0) - b.get(state).unwrap_or(&0.0)).abs() <= by)
}

proptest! {
    #[test]
    fn text_comes_back(paint in paint()) {
        prop_assert_eq!(Paint::parse(&paint.to_text()), Some(paint));
    }

    #[test]
    fn no_text_is_too_much(text in ".*") {
        let _ = Paint::parse(&text);
    }

    #[test]
    fn what_is_read_is_written(text in "[0-9A-F]{0,80}") {
        if let Some(paint) = Paint::parse(&text) {
            prop_assert!(text.ends_with(&paint.to_text()));
            let all: f64 = paint.state_areas().iter().map(|(_, share)| share).sum();
            prop_assert_eq!(all, 1.0);
        }
    }

    #[test]
    fn areas_are_those_of_the_leaves(paint in paint()) {
        let leaves = nodes(&paint, CORNERS).into_iter().filter_map(|(node, at)| match node {
            Paint::Uniform(state) => Some((*state, clip::area(&at))),
            Paint::Split(_) => None,
        });
        prop_assert_eq!(shares(leaves), shares(paint.state_areas()));
    }

    #[test]
    fn turned_paint_has_the_same_states(paint in paint(), place in place()) {
        for order in ORDERS {
            let turned = paint.turned(order);
            prop_assert_eq!(turned.state_at(order.map(|old| place[old])), paint.state_at(place), "{:?}", order);
            prop_assert_eq!(turned.state_areas(), paint.state_areas());
        }
    }

    #[test]
    fn turned_back_it_is_the_same_tree(paint in paint().prop_filter("two ways to write it", without_synonyms)) {
        prop_assert_eq!(&paint.mirrored().mirrored(), &paint);
        prop_assert_eq!(&paint.rotated(1).rotated(1).rotated(1), &paint);
        prop_assert_eq!(&paint.rotated(2).rotated(1), &paint);
        prop_assert_eq!(&paint.rotated(1).mirrored(), &paint.mirrored().rotated(2));
    }

    #[test]
    fn a_special_corner_of_three_cuts_turns_as_well(first in 0_u8..3, place in place()) {
        let paint = numbered(Way::Three, first);
        for order in ORDERS {
            prop_assert_eq!(paint.turned(order).state_at(order.map(|old| place[old])), paint.state_at(place));
        }
    }

    #[test]
    fn a_node_is_a_piece(paint in paint(), which: prop::sample::Index, order in prop::sample::select(ORDERS.to_vec())) {
        let all = nodes(&paint, CORNERS);
        let (node, at) = all[which.index(all.len())];
        let piece = paint.piece(order.map(|old| at[old]));
        prop_assert!(piece.exact);
        prop_assert_eq!(piece.misplaced, 0.0);
        prop_assert_eq!(piece.paint, node.turned(order));
    }

    #[test]
    fn nearly_a_node_is_that_node(paint in paint()) {
        let shifted = CORNERS.map(|corner| mix(CORNERS, corner).map(|w| w * (1.0 - 3e-9) + 1e-9));
        let piece = paint.piece(shifted);
        prop_assert!(piece.misplaced < 1e-4);
        prop_assert_eq!(piece.paint, paint);
    }

    #[test]
    fn pieces_have_the_areas_of_the_whole(
        paint in paint(),
        places in prop::collection::vec((any::<usize>(), place()), 0..5),
    ) {
        let mut all = Vec::new();
        for corners in pieces(&places) {
            let piece = paint.piece(corners);
            let share = clip::area(&corners);
            all.extend(piece.paint.state_areas().into_iter().map(|(state, part)| (state, part * share)));
        }
        let (all, whole) = (shares(all), shares(paint.state_areas()));
        prop_assert!(near(&all, &whole, 1e-4), "{:?} {:?}", all, whole);
    }

    #[test]
    fn a_piece_has_the_paint_of_its_place(paint in paint(), corners in [place(), place(), place()], seed in place()) {
        let piece = paint.piece(corners);
        let share = clip::area(&corners);
        // Places in a regular pattern, begun at a random one.
        let (mut other, count) = (0, 4000);
        for n in 0..count {
            let (u, v) = ((seed[0] + f64::from(n) * 0.754_877_666_246_692_8) % 1.0, (seed[1] + f64::from(n) * 0.569_840_290_998_053_3) % 1.0);
            let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
            let weights = [1.0 - u - v, u, v];
            other += i32::from(piece.paint.state_at(weights) != paint.state_at(mix(corners, weights)));
        }
        let found = share * f64::from(other) / f64::from(count);
        prop_assert!(found <= 1.3 * piece.misplaced + 0.004 * share, "{} {}", found, piece.misplaced);
        prop_assert!(!piece.exact || piece.misplaced <= 1e-9);
    }

    #[test]
    fn no_corners_are_too_much(paint in paint(), corners: [[f64; 3]; 3]) {
        let _ = (paint.piece(corners), paint.state_at(corners[0]));
    }
}

#[test]
fn cells_of_several_nodes_are_a_piece() {
    // 16 cells, quarters of quarters, with states of their own.
    let quarters = |from: u32| Paint::split(Way::Three, 0, (from..from + 4).map(Paint::uniform).collect());
    let paint = Paint::split(Way::Three, 0, [0, 4, 8, 12].map(quarters).to_vec());
    // Four of them are a triangle across the middles of the sides.
    let corners = [[0.75, 0.25, 0.0], [0.25, 0.75, 0.0], [0.25, 0.25, 0.5]];
    let piece = paint.piece(corners);
    assert!(piece.exact);
    assert_eq!(piece.misplaced, 0.0);
    assert_eq!(nodes(&piece.paint, CORNERS).len(), 5, "four leaves below one split");
    for middle in [[0.7, 0.15, 0.15], [0.15, 0.7, 0.15], [0.15, 0.15, 0.7], [0.33, 0.33, 0.34]] {
        assert_eq!(piece.paint.state_at(middle), paint.state_at(mix(corners, middle)));
    }
}

#[test]
fn a_cut_that_the_tree_has_not_is_followed_by_quarters() {
    // State 1 in the half towards corner 1.
    let half = numbered(Way::One, 0);
    let slanted = half.piece([[0.5, 0.3, 0.2], [0.2, 0.5, 0.3], [0.3, 0.2, 0.5]]);
    assert!(!slanted.exact && slanted.misplaced > 0.0 && slanted.misplaced <= 1e-4 + 1.0 / 512.0);
    assert!(slanted.paint.to_text().len() < 5000, "{}", slanted.paint.to_text().len());
    // A piece of one state is a leaf, whatever is around it.
    let within = half.piece([[0.1, 0.8, 0.1], [0.2, 0.7, 0.1], [0.1, 0.7, 0.2]]);
    assert_eq!((within.paint, within.exact), (Paint::uniform(1), true));
}

#[test]
fn a_piece_without_area_has_the_state_of_its_middle() {
    let half = numbered(Way::One, 0);
    for corners in [[[0.2, 0.7, 0.1]; 3], [[0.2, 0.8, 0.0], [0.2, 0.7, 0.1], [0.2, 0.6, 0.2]]] {
        let piece = half.piece(corners);
        assert_eq!((piece.paint, piece.exact), (Paint::uniform(1), false));
    }
}
