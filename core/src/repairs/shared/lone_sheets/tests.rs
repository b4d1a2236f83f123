//! Surfaces that bound material, and surfaces that do not.

use super::*;
use crate::repairs::shared::work::Work;
use crate::testing::{Corners, after, cuboid, reversed, shifted};

/// A grid of quadrangles, 12 by 12, over the unit square.
fn grid(at: impl Fn(f64, f64) -> [f64; 3]) -> Vec<Corners> {
    const N: u32 = 12;
    let place = |i: u32, k: u32| at(f64::from(i) / f64::from(N), f64::from(k) / f64::from(N)).map(|x| x as f32);
    let quadrangles = (0..N).flat_map(|i| (0..N).map(move |k| (i, k)));
    quadrangles
        .flat_map(|(i, k)| {
            let [a, b, c, d] = [place(i, k), place(i + 1, k), place(i + 1, k + 1), place(i, k + 1)];
            [[a, b, c], [a, c, d]]
        })
        .collect()
}

/// How many rims are those of lone sheets, and how many triangles are of one-sided ones.
fn found(mesh: &[Corners]) -> (usize, usize) {
    found_of(mesh, Which::Sheets)
}

fn found_of(mesh: &[Corners], which: Which) -> (usize, usize) {
    let found = after(mesh, |d, turned| {
        let mut work = Work::new(&mut d.submesh);
        crate::repairs::orient::directions::make_coherent(&d.survey, &mut work, turned, &[]);
        let (submesh, edges) = work.edges();
        let loops = crate::detect::holes::loops::find(submesh, edges);
        let shapes = Shapes::of(submesh, &loops, 1);
        let sheets = recognise(&d.survey, submesh, edges, &loops, &shapes, turned, which);
        (sheets.rims.len(), sheets.one_sided.iter().filter(|is| **is).count())
    });
    found.result
}

fn wave(x: f64) -> f64 {
    (std::f64::consts::TAU * x).sin()
}

#[test]
fn terrain_is_a_sheet_however_high_it_is() {
    for height in [0.0, 0.02, 0.2, 0.6] {
        let terrain = grid(|x, y| [x, y, height * wave(1.5 * x + 0.1) * wave(y + 0.2)]);
        assert_eq!(found(&terrain), (1, 0), "{height}");
    }
}

/// Half as high as a ball of diameter 1, in the middle of the unit square.
fn hill() -> Vec<Corners> {
    grid(|x, y| [x, y, 0.5 * (0.25 - (x - 0.5).powi(2) - (y - 0.5).powi(2)).max(0.0)])
}

#[test]
fn a_hill_encloses_enough_to_be_closed() {
    assert_eq!(found(&hill()), (0, 0));
}

/// Closed, the hill would be a body: one in the block's material is missed by nobody, if it is wholly in it and the same way round.
#[test]
fn what_would_be_a_body_in_the_material_of_another_is_unneeded() {
    let block = cuboid([-1.0; 3], [2.0; 3]);
    let unneeded = |hill: &[Corners], around: &[Corners]| found_of(&[around, hill].concat(), Which::Unneeded).0;
    assert_eq!(unneeded(&hill(), &block), 1);
    assert_eq!(found(&[block.clone(), hill()].concat()), (0, 0), "it is no sheet");
    assert_eq!(unneeded(&shifted(&hill(), [1.6, 0.0, 0.0]), &block), 0, "a part of it is outside");
    assert_eq!(unneeded(&shifted(&hill(), [5.0, 0.0, 0.0]), &block), 0, "all of it is");
    assert_eq!(unneeded(&reversed(&hill()), &block), 0, "a void in the block");
    let hollow = [block, reversed(&cuboid([-0.5; 3], [1.5; 3]))].concat();
    assert_eq!(unneeded(&hill(), &hollow), 0, "in a cavity there is no material");
}

#[test]
fn a_layer_that_is_folded_over_is_a_sheet() {
    let fold = grid(|s, y| [s + 0.3 * wave(2.0 * s), y, 0.2 * wave(s + 0.3)]);
    assert_eq!(found(&fold), (1, 0));
}

#[test]
fn a_band_is_a_sheet_if_it_has_one_side_and_a_tube_if_it_has_two() {
    let band = |twists: f64| {
        grid(move |x, y| {
            let (turn, across) = (std::f64::consts::TAU * (x % 1.0), y - 0.5);
            // The end is the beginning, turned over or not.
            let across = if x == 1.0 && twists == 1.0 { -across } else { across };
            let lean = turn * twists / 2.0 + if twists == 0.0 { std::f64::consts::FRAC_PI_2 } else { 0.0 };
            let r = 1.5 + across * lean.cos();
            [r * turn.cos(), r * turn.sin(), across * lean.sin()]
        })
    };
    let (_, one_sided) = found(&band(1.0));
    // Only the triangles along the rim, and where it disagrees, are in the submesh.
    assert!(one_sided > 0);
    assert_eq!(found(&band(0.0)), (0, 0));
}

#[test]
fn vessels_are_bodies() {
    for height in [0.5, 2.0, 8.0] {
        let mut vessel = cuboid([0.0; 3], [2.0, 2.0, height]);
        vessel.drain(2..4);
        assert_eq!(found(&vessel), (0, 0), "{height}");
        assert_eq!(found(&reversed(&vessel)), (0, 0), "{height}, inside out");
    }
}
