//! Missing rings: the two loops that bound one are closed by a strip between them.
//!
//! Closed each for itself, a tube that has lost a ring would become two bodies, and the mouth of a vessel without its rim be shut.

use crate::algorithms::triangulate::{Rim, Unfillable, strip};
use crate::detect::holes::loops::Loop;
use crate::geometry::exact::Point;
use crate::repairs::holes::patches::concatenated;
use crate::repairs::shared::work::Work;
use crate::submesh::{Submesh, Vertex};
use crate::util::parallel;

/// Bridges pairs of loops: `place` is to put the triangles in. Those between which no valid strip was found stay open. Strips are found in
/// parallel and put in in order; one that meets an edge of an earlier one is found anew.
pub(crate) fn bridge(
    work: &mut Work<'_>,
    pairs: &[[&Loop; 2]],
    threads: usize,
    mut place: impl FnMut(&mut Work<'_>, usize, &[[Vertex; 3]]),
) {
    let submesh: &Submesh = work;
    let strips = parallel::map(threads, pairs.len(), |i| between(submesh, &pairs[i]));
    for (i, (pair, strip)) in pairs.iter().zip(strips).enumerate() {
        let strip = match strip {
            Ok(strip) if meets_new_edge(work, pair, &strip) => between(work, pair),
            other => other,
        };
        match strip {
            Ok(strip) => {
                let vertices = concatenated(pair);
                let triangles: Vec<[Vertex; 3]> = strip.iter().map(|t| t.map(|i| vertices[i as usize])).collect();
                place(work, i, &triangles);
            }
            Err(reason) => {
                tracing::info!(%reason, "No strip between two loops around a missing ring; each is closed for itself.")
            }
        }
    }
}

/// The strip, over the vertices of the first loop and then those of the second.
fn between(submesh: &Submesh, pair: &[&Loop; 2]) -> Result<Vec<[u32; 3]>, Unfillable> {
    let [a, b] = pair.map(|rim| (rim.points(submesh), rim.apexes(submesh)));
    // A strip has no chords within a rim.
    let none = |_: u32, _: u32| false;
    let vertices = concatenated(pair);
    let joined = |i: u32, j: u32| submesh.has_edge(vertices[i as usize], vertices[j as usize]);
    strip::bridge([&rim(&a, &none), &rim(&b, &none)], &joined)
}

fn rim<'a>((points, apexes): &'a (Vec<Point>, Vec<Option<Point>>), forbidden: &'a dyn Fn(u32, u32) -> bool) -> Rim<'a> {
    Rim { points, apexes, obstacles: &[], forbidden }
}

/// An edge between the two loops is one of the mesh by now.
fn meets_new_edge(submesh: &Submesh, pair: &[&Loop; 2], strip: &[[u32; 3]]) -> bool {
    let vertices = concatenated(pair);
    let second = pair[0].vertices.len() as u32;
    strip.iter().any(|t| {
        (0..3).any(|k| {
            let (i, j) = (t[k], t[(k + 1) % 3]);
            (i < second) != (j < second) && submesh.has_edge(vertices[i as usize], vertices[j as usize])
        })
    })
}

#[cfg(test)]
mod tests {
    use crate::contract::settings::Profile;
    use crate::repairs::holes::fill::{Closed, fill};
    use crate::testing::{After, Corners, after, plate};
    use proptest::prelude::*;

    /// The surface that a polyline of (radius, height) sweeps around z, `count` facets around; seen from outside if it ascends.
    fn turned(profile: &[[f32; 2]], count: u16) -> Vec<Corners> {
        let at = |i: u16, [r, z]: [f32; 2]| {
            let (sin, cos) = (std::f32::consts::TAU * f32::from(i % count) / f32::from(count)).sin_cos();
            [r * cos, r * sin, z]
        };
        let quad =
            |i: u16, p: [f32; 2], q: [f32; 2]| [[at(i, p), at(i + 1, p), at(i + 1, q)], [at(i, p), at(i + 1, q), at(i, q)]];
        let all = profile.windows(2).flat_map(|w| (0..count).flat_map(move |i| quad(i, w[0], w[1])));
        all.filter(|[a, b, c]| a != b && b != c && c != a).collect()
    }

    fn closed(triangles: &[Corners]) -> After<Closed> {
        after(triangles, |d, _| fill(d, &Profile::default()))
    }

    /// Loops closed in this way, shaped or not.
    fn closed_by(got: &After<Closed>, method: &str) -> u64 {
        got.result.by_method.iter().filter(|(name, _)| name.starts_with(method)).map(|(_, loops)| loops).sum()
    }

    /// All loops were bridged in pairs, and one good body of about this volume is what comes of it.
    fn assert_bridged(got: &After<Closed>, loops: u64, volume: f64) {
        assert_eq!(closed_by(got, "annular"), loops, "{:?}", got.result);
        assert_eq!((got.result.loops, got.defects.components), (loops, 1));
        assert!(got.verdict.good, "{:?}", got.verdict);
        assert!((got.defects.volume / volume - 1.0).abs() < 0.01, "{} instead of {volume}", got.defects.volume);
    }

    /// Area of a regular polygon as a share of its circumcircle's square.
    fn polygon(count: u16) -> f64 {
        let n = f64::from(count);
        0.5 * n * (std::f64::consts::TAU / n).sin()
    }

    fn can(bottom: f32, top: f32, radius: f32) -> [[f32; 2]; 3] {
        [[0.0, bottom], [radius, bottom], [radius, top]]
    }

    fn lid(bottom: f32, top: f32, radius: f32) -> [[f32; 2]; 3] {
        [[radius, bottom], [radius, top], [0.0, top]]
    }

    #[test]
    fn a_sheet_in_the_plane_of_a_rim_that_was_bridged_is_not_joined_to_it() {
        let sheet: Vec<Corners> = plate(2, |_, _| true).iter().map(|t| t.map(|[x, y, _]| [x - 1.0, y - 1.0, 5.0])).collect();
        let open = [turned(&can(0.0, 5.0, 4.0), 24), turned(&lid(6.0, 11.0, 4.0), 24), sheet].concat();
        let got = closed(&open);
        assert_eq!((closed_by(&got, "annular"), got.defects.nonmanifold_edges, got.defects.boundary_edges), (2, 0, 8));
    }

    #[test]
    fn a_tube_that_lost_a_ring_is_one_again() {
        for gap in [0.4, 1.0, 4.0, 8.0] {
            let open = [turned(&can(0.0, 5.0, 4.0), 24), turned(&lid(5.0 + gap, 10.0 + gap, 4.0), 24)].concat();
            assert_bridged(&closed(&open), 2, 16.0 * polygon(24) * f64::from(10.0 + gap));
        }
    }

    #[test]
    fn rims_of_different_density_are_bridged() {
        let open = [turned(&can(0.0, 5.0, 4.0), 48), turned(&lid(6.0, 10.0, 4.0), 400)].concat();
        assert_bridged(&closed(&open), 2, 16.0 * (5.5 * polygon(48) + 4.5 * polygon(400)));
    }

    /// Both skins of a vessel that leans and whose mouth is wavy, like a shoe's, without the rim between them.
    fn vessel(thickness: f32, lower: f32) -> Vec<Corners> {
        let outer = turned(&[[0.0, 0.0], [5.0, 0.0], [5.0, 3.0], [5.0, 6.0]], 40);
        let r = 5.0 - thickness;
        let inner = turned(&[[r, 6.0 - lower], [r, 3.0], [r, 0.5], [0.0, 0.5]], 40);
        let lean = |[x, y, z]: [f32; 3]| [2.0 * x + 0.2 * z, y, z + 0.02 * z * (x * x - y * y) / 10.0];
        [outer, inner].concat().iter().map(|t| t.map(lean)).collect()
    }

    #[test]
    fn two_skins_are_joined_at_the_rim_and_the_mouth_stays_open() {
        for (thickness, lower) in [(0.5, 0.0), (0.5, 0.3), (0.5, -0.3), (0.1, 0.25), (0.1, -0.25), (1.5, 0.0)] {
            let got = closed(&vessel(thickness, lower));
            assert_eq!(closed_by(&got, "annular"), 2, "{thickness} {lower}: {:?}", got.result);
            assert!(got.verdict.good && got.defects.components == 1, "{thickness} {lower}: {:?}", got.verdict);
            // A capped one would hold some 900.
            assert!(got.defects.volume < 700.0, "{thickness} {lower}: {}", got.defects.volume);
        }
    }

    #[test]
    fn a_thick_pipe_gets_its_ends() {
        for (bore, segments) in [(1.0, 40), (0.3, 8), (1.8, 100)] {
            let open = [turned(&[[4.0, 0.0], [4.0, 10.0]], 48), turned(&[[bore, 10.0], [bore, 0.0]], segments)].concat();
            let volume = 10.0 * (16.0 * polygon(48) - f64::from(bore * bore) * polygon(segments));
            assert_bridged(&closed(&open), 4, volume);
        }
    }

    #[test]
    fn the_ends_of_a_block_with_several_bores_are_closed_around_them() {
        let at = |t: Vec<Corners>, x: f32| t.into_iter().map(move |t| t.map(|[a, b, c]| [a + x, b, c]));
        let mut open = turned(&[[4.0, 0.0], [4.0, 10.0]], 48);
        for (r, x) in [(0.8, 2.0), (1.2, -2.0)] {
            open.extend(at(turned(&[[r, 10.0], [r, 0.0]], 24), x));
        }
        let volume = 10.0 * (16.0 * polygon(48) - (0.8 * 0.8 + 1.2 * 1.2) * polygon(24));
        assert_bridged(&closed(&open), 6, volume);
    }

    #[test]
    fn a_vessel_whose_inner_mouth_lies_deep_stays_one() {
        let outside = turned(&[[0.0, 0.0], [5.0, 0.0], [5.0, 9.0]], 40);
        let inside = turned(&[[4.5, 5.5], [4.5, 1.0], [0.0, 1.0]], 36);
        // The frustum between the mouths is open to the top.
        let frustum = 3.5 * (25.0 + 5.0 * 4.5 + 4.5 * 4.5) / 3.0;
        let volume = (25.0 * 9.0 - 4.5 * 4.5 * 4.5 - frustum) * polygon(38);
        assert_bridged(&closed(&[outside, inside].concat()), 2, volume);
    }

    #[test]
    fn a_way_through_a_plate_gets_its_sides() {
        let volume = |height: f64| height * (100.0 * polygon(48) - 9.0 * polygon(24));
        for height in [0.01, 1.0, 2.5] {
            let h = height as f32;
            let rim = turned(&[[10.0, 0.0], [10.0, h]], 48);
            let plate = |z: f32| -> Vec<Corners> {
                let at = |i: u16, r: f32, n: u16| {
                    let (sin, cos) = (std::f32::consts::TAU * f32::from(i % n) / f32::from(n)).sin_cos();
                    [r * cos, r * sin, z]
                };
                let fine = (0..48).map(|i| [at(i, 10.0, 48), at(i + 1, 10.0, 48), at(i.div_ceil(2), 3.0, 24)]);
                let coarse = (0..24).map(|i| [at(i + 1, 3.0, 24), at(i, 3.0, 24), at(2 * i + 1, 10.0, 48)]);
                fine.chain(coarse).collect()
            };
            let open = [rim, plate(h), crate::testing::reversed(&plate(0.0))].concat();
            assert_bridged(&closed(&open), 2, volume(height));
        }
    }

    #[test]
    fn a_bump_that_lost_a_ring_is_one_again() {
        let base = turned(&[[0.0, 0.0], [10.0, 0.0], [10.0, 3.0], [6.0, 3.0]], 36);
        let top = turned(&[[4.5, 4.0], [2.0, 5.2], [0.0, 5.5]], 36);
        // Frusta from ring to ring.
        let frustum = |r: f64, s: f64, h: f64| h * (r * r + r * s + s * s) / 3.0;
        let volume = 300.0 + frustum(6.0, 4.5, 1.0) + frustum(4.5, 2.0, 1.2) + frustum(2.0, 0.0, 0.3);
        assert_bridged(&closed(&[base, top].concat()), 2, volume * polygon(36));
    }

    #[test]
    fn a_shaft_broken_through_is_joined() {
        let lower = turned(&can(0.0, 12.0, 4.0), 20);
        // The break leans, and the other end is thinner, turned aside and sampled otherwise.
        let lower: Vec<Corners> =
            lower.iter().map(|t| t.map(|[x, y, z]| [x, y, if z > 6.0 { z + 0.3 * x } else { z }])).collect();
        let upper = turned(&lid(15.0, 25.0, 3.3), 33);
        let upper: Vec<Corners> = upper.iter().map(|t| t.map(|[x, y, z]| [x + 0.1 * z - 1.0, y + 0.4, z])).collect();
        let got = closed(&[lower, upper].concat());
        assert_eq!((closed_by(&got, "annular"), got.defects.components), (2, 1), "{:?}", got.result);
        assert!(got.verdict.good, "{:?}", got.verdict);
    }

    #[test]
    fn what_joins_two_bodies_is_a_doubt_and_what_mends_one_is_not() {
        // Two vessels mouth to mouth, each of which a lid would close.
        let got = closed(&[turned(&can(0.0, 5.0, 4.0), 24), turned(&lid(6.0, 11.0, 4.0), 24)].concat());
        assert_eq!((closed_by(&got, "annular"), got.result.doubts.len()), (2, 1));
        // The end of a pipe.
        let got = closed(&[turned(&[[4.0, 0.0], [4.0, 10.0]], 48), turned(&[[3.0, 10.0], [3.0, 0.0]], 48)].concat());
        assert_eq!((closed_by(&got, "annular"), got.result.doubts.len()), (4, 0));
    }

    #[test]
    fn skins_that_face_each_other_across_a_clearance_stay_two_bodies() {
        // A ball in a shell, both without the cap above 0.9 of their height.
        let arc = |r: f32, to: u8| {
            (0..=to).map(move |i| (std::f32::consts::PI * f32::from(i) / 24.0).sin_cos()).map(move |(s, c)| [r * s, -r * c])
        };
        let ball = turned(&arc(8.0, 20).collect::<Vec<_>>(), 24);
        let mut shell: Vec<[f32; 2]> = arc(8.25, 20).collect();
        shell.reverse();
        let inside = turned(&shell, 24);
        let outside = turned(&arc(12.0, 23).chain([[0.0, 12.0]]).collect::<Vec<_>>(), 24);
        let got = closed(&[ball, inside, outside].concat());
        assert_eq!((closed_by(&got, "annular"), got.result.loops, got.defects.components), (0, 2, 3), "{:?}", got.result);
        assert!(got.verdict.good, "{:?}", got.verdict);
    }

    #[test]
    fn a_sleeve_without_its_bore_gets_it_back_around_the_shaft() {
        let shaft = turned(&[[0.0, -1.0], [3.0, -1.0], [3.0, 11.0], [0.0, 11.0]], 32);
        let sleeve = turned(&[[3.125, 0.0], [5.0, 0.0], [5.0, 10.0], [3.125, 10.0]], 32);
        let of_sleeve = (25.0 - 3.125 * 3.125) * 10.0;
        let got = closed(&[shaft.clone(), sleeve.clone()].concat());
        assert_bridged_around(&got, polygon(32) * (9.0 * 12.0 + of_sleeve));
        // Without the shaft, two lids have less area.
        assert_eq!(closed_by(&closed(&sleeve), "annular"), 0);
        // A pin that ends inside: one of the lids would do, and goes.
        let pin = turned(&[[0.0, -1.0], [3.0, -1.0], [3.0, 5.0], [0.0, 5.0]], 32);
        assert_bridged_around(&closed(&[pin, sleeve].concat()), polygon(32) * (9.0 * 6.0 + of_sleeve));
    }

    /// A bore was put back, so that the sleeve and what runs through it are two good bodies of this volume.
    fn assert_bridged_around(got: &After<Closed>, volume: f64) {
        assert_eq!((closed_by(got, "annular"), got.result.loops, got.defects.components), (2, 2, 2), "{:?}", got.result);
        assert!(got.verdict.good && got.result.doubts.is_empty(), "{:?}", got.verdict);
        // Nobody need look at what was drilled, however large it is.
        let judged = &got.result.judged;
        assert!(judged.doubts.is_empty() && judged.explained.len() == 64, "{judged:?}");
        assert!((got.defects.volume / volume - 1.0).abs() < 1e-3, "{} instead of {volume}", got.defects.volume);
    }

    #[test]
    fn holes_side_by_side_and_islands_are_no_rings() {
        let open = plate(24, |x, y| {
            let in_hole = |x0: u8, y0: u8, side: u8| (x0..x0 + side).contains(&x) && (y0..y0 + side).contains(&y);
            !(in_hole(2, 2, 4) || in_hole(7, 2, 4)) && (!in_hole(4, 10, 9) || in_hole(7, 13, 3))
        });
        let rim_stays = Profile { max_hole_edges: 40, ..Profile::default() };
        let got = after(&open, |d, _| fill(d, &rim_stays));
        assert_eq!(closed_by(&got, "annular"), 0);
        assert_eq!(closed_by(&got, "islands"), 2);
        assert_eq!((got.result.loops, got.defects.components, got.defects.boundary_loops), (4, 1, 1));
        assert!((got.defects.area - 576.0).abs() < 1e-6);
    }

    #[test]
    fn what_the_profile_does_not_admit_is_not_bridged() {
        let open = [turned(&can(0.0, 5.0, 4.0), 24), turned(&lid(6.0, 10.0, 4.0), 30)].concat();
        for profile in [Profile { max_hole_edges: 29, ..Profile::default() }, Profile { fill_holes: false, ..Profile::default() }]
        {
            let got = after(&open, |d, _| fill(d, &profile));
            assert_eq!(closed_by(&got, "annular"), 0);
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]

        /// A ring missing anywhere from a tube of any taper.
        #[test]
        fn a_ring_missing_from_a_tube_is_always_bridged(
            (below, above) in (6_u16..60, 6_u16..60),
            gap in 0.1_f32..2.0,
            taper in 0.75_f32..1.3,
        ) {
            let open = [turned(&can(0.0, 2.0, 1.0), below), turned(&lid(2.0 + gap, 5.0, taper), above)].concat();
            let got = closed(&open);
            prop_assert_eq!(closed_by(&got, "annular"), 2);
            prop_assert!(got.verdict.good && got.defects.components == 1);
        }
    }
}
