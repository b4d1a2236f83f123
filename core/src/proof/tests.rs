use crate::geometry::exact::Point;
use proptest::prelude::*;

use super::*;
use crate::geometry::distance::{place, square_distance};

/// As many vertices as there are: any of them may be on a rim.
fn any_of(count: usize) -> Vec<u32> {
    (0..count as u32).collect()
}

/// A grid of n × n squares with a height at each vertex.
fn grid(n: u32, height: impl Fn(u32) -> f32) -> (Vec<Point>, Vec<[u32; 3]>) {
    let m = n + 1;
    let points = (0..m * m).map(|i| [(i % m) as f32, (i / m) as f32, height(i)]).collect();
    let squares = (0..m * m).filter(|i| i % m < n && i / m < n);
    (points, squares.flat_map(|a| [[a, a + 1, a + m + 1], [a, a + m + 1, a + m]]).collect())
}

/// The largest distance of sampled places of one mesh from another.
fn sampled(points: &[Point], faces: &[[u32; 3]], to: (&[Point], &[[u32; 3]])) -> f64 {
    const STEPS: u32 = 6;
    let corners = |points: &[Point], f: &[u32; 3]| f.map(|v| place(points[v as usize]));
    let others: Vec<_> = to.1.iter().map(|f| corners(to.0, f)).collect();
    let shares = || (0..=STEPS).flat_map(|i| (0..=STEPS - i).map(move |j| (f64::from(i) / 6.0, f64::from(j) / 6.0)));
    let places = faces.iter().flat_map(|f| {
        let [a, b, c] = corners(points, f);
        shares().map(move |(u, v)| a + (b - a) * u + (c - a) * v)
    });
    places.map(|p| others.iter().map(|t| square_distance(p, *t)).fold(f64::INFINITY, f64::min)).fold(0.0, f64::max).sqrt()
}

#[test]
fn a_mesh_is_at_no_distance_from_itself() {
    let (points, faces) = grid(4, |i| (i % 3) as f32);
    let became: Vec<u32> = (0..points.len() as u32).collect();
    let pairing = Pairing {
        points: &points,
        faces: &faces,
        new_points: &points,
        new_faces: &faces,
        became: &became,
        open: &any_of(points.len()),
    };
    let verdict = prove(&pairing, f64::INFINITY, 0.0);
    assert_eq!((verdict.proved, verdict.far, verdict.under), (Proved::default(), Vec::new(), Vec::new()));
}

/// A square pyramid of height 1, and its base: the tip is at distance 1, and so is the middle of the base, or nearer to the sides.
#[test]
fn a_tent_is_as_far_from_the_ground_as_it_is_high() {
    let points = [[-9.0, -9.0, 0.0], [9.0, -9.0, 0.0], [9.0, 9.0, 0.0], [-9.0, 9.0, 0.0], [0.0, 0.0, 1.0]];
    let faces = [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]];
    let ground = [[0, 1, 2], [0, 2, 3]];
    let became = [0, 1, 2, 3, 0];
    let pairing = Pairing {
        points: &points,
        faces: &faces,
        new_points: &points[..4],
        new_faces: &ground,
        became: &became,
        open: &any_of(points.len()),
    };
    let Verdict { proved, .. } = prove(&pairing, f64::INFINITY, 0.0);
    assert!((proved.forward - 1.0).abs() < 1e-6, "{proved:?}");
    // 9∕√82 from the middle to a side.
    assert!(proved.backward >= 9.0 / 82.0_f64.sqrt() && proved.backward <= 1.0 + 1e-6, "{proved:?}");
}

/// Half of the second mesh is missing in the first: only the way back is long.
#[test]
fn what_is_not_covered_is_found() {
    let (points, faces) = grid(4, |_| 0.0);
    let became: Vec<u32> = (0..points.len() as u32).collect();
    let some: Vec<[u32; 3]> = faces.iter().copied().filter(|f| f.iter().all(|v| v % 5 < 3)).collect();
    let pairing = Pairing {
        points: &points,
        faces: &some,
        new_points: &points,
        new_faces: &faces,
        became: &became,
        open: &any_of(points.len()),
    };
    let Verdict { proved, .. } = prove(&pairing, f64::INFINITY, 0.0);
    assert_eq!(proved.forward, 0.0);
    assert!((2.0..2.01).contains(&proved.backward), "{proved:?}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(100))]
    /// No sampled place is farther than the bound, whatever the vertices are said to have become.
    #[test]
    fn no_place_is_farther_than_the_bound(
        heights in prop::collection::vec(0u8..8, 25),
        others in prop::collection::vec(0u8..8, 9),
        became in prop::collection::vec(0u32..9, 25),
        missing in prop::option::of(0usize..8),
        random in any::<bool>(),
    ) {
        let (points, faces) = grid(4, |i| f32::from(heights[i as usize]) / 4.0);
        let (coarse, mut new_faces) = grid(2, |i| f32::from(others[i as usize]) / 4.0);
        let new_points: Vec<Point> = coarse.iter().map(|p| [2.0 * p[0], 2.0 * p[1], p[2]]).collect();
        if let Some(missing) = missing {
            new_faces.remove(missing);
        }
        let near = |i: u32| (i % 5).div_ceil(2) + (i / 5).div_ceil(2) * 3;
        let became: Vec<u32> = (0..25).map(|i| if random { became[i as usize] } else { near(i) }).collect();
        let pairing = Pairing { points: &points, faces: &faces, new_points: &new_points, new_faces: &new_faces, became: &became, open: &any_of(points.len()) };
        let Verdict { proved, far, .. } = prove(&pairing, f64::INFINITY, 0.0);
        let there = sampled(&points, &faces, (&new_points, &new_faces));
        let back = sampled(&new_points, &new_faces, (&points, &faces));
        prop_assert!(there <= proved.forward && back <= proved.backward, "{} {} {:?}", there, back, proved);
        prop_assert!(far.is_empty());
        let Verdict { far, .. } = prove(&pairing, 0.5 * there, 0.5 * there);
        prop_assert!(there == 0.0 || !far.is_empty());
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]
    /// One vertex of the second mesh goes elsewhere: what is proved of the faces around it, with what was proved before, holds for all.
    #[test]
    fn what_is_proved_anew_holds_with_what_was_proved_before(
        heights in prop::collection::vec(0u8..8, 49),
        others in prop::collection::vec(0u8..8, 16),
        (moved, height) in (0u32..16, 0u8..8),
        most in 0.01..2.0,
        tight in any::<bool>(),
    ) {
        let (points, faces) = grid(6, |i| f32::from(heights[i as usize]) / 4.0);
        let (coarse, new_faces) = grid(3, |i| f32::from(others[i as usize]) / 4.0);
        let before: Vec<Point> = coarse.iter().map(|p| [2.0 * p[0], 2.0 * p[1], p[2]]).collect();
        let mut after = before.clone();
        after[moved as usize][2] = f32::from(height) / 4.0;
        let became: Vec<u32> = (0..49_u32).map(|i| (i % 7).div_ceil(2) + (i / 7).div_ceil(2) * 4).collect();
        let open = any_of(points.len());
        let pairing = |new_points| Pairing { points: &points, faces: &faces, new_points, new_faces: &new_faces, became: &became, open: &open };
        let enough = if tight { 0.0 } else { most };
        let verdict = prove(&pairing(&before), most, enough);
        let is_under = |f: usize| verdict.under.contains(&(f as u32));
        let is_fresh: Vec<bool> = new_faces.iter().enumerate().map(|(f, face)| face.contains(&moved) || is_under(f)).collect();
        let gone = new_faces.iter().zip(&is_fresh).filter(|(_, is)| **is).map(|(face, _)| face.map(|v| before[v as usize])).collect();
        let again = prove_again(&pairing(&after), &Changes { gone, is_fresh, verdict: &verdict }, (most, enough));
        let there = sampled(&points, &faces, (&after, &new_faces));
        let back = sampled(&after, &new_faces, (&points, &faces));
        prop_assert!(there <= again.proved.forward && back <= again.proved.backward, "{} {} {:?}", there, back, again);
        prop_assert!(there <= most || !again.far.is_empty());
        prop_assert!(back <= most || !again.under.is_empty());
        // Without what is far, the bounds are those of the rest.
        prop_assert!(again.within.iter().all(|d| *d <= most));
    }
}

/// A strip whose middle vertices on both rims go: the rim is mapped onto the rim, and nothing is searched.
#[test]
fn a_rim_goes_onto_the_rim() {
    let (points, faces) = grid(4, |_| 0.0);
    // All but the corners become one of them: two triangles are left.
    let corner = |i: u32| u32::from(i % 5 > 2) + 2 * u32::from(i / 5 > 2);
    let became: Vec<u32> = (0..25).map(corner).collect();
    let new_points = [0, 4, 20, 24].map(|v: usize| points[v]);
    let new_faces = [[0, 1, 3], [0, 3, 2]];
    let open = any_of(points.len());
    let pairing =
        Pairing { points: &points, faces: &faces, new_points: &new_points, new_faces: &new_faces, became: &became, open: &open };
    let Verdict { proved, .. } = prove(&pairing, f64::INFINITY, 0.0);
    assert!(proved.forward < 1e-9 && proved.backward < 1e-9 && proved.searched == 0, "{proved:?}");
}

/// A square of two triangles on a finer one, whose vertices lie within them and on the edge between: spokes join them, and nothing is searched.
#[test]
fn a_triangle_covers_vertices_of_a_finer_surface() {
    let (new_points, new_faces) = grid(4, |_| 0.0);
    let became = [0, 4, 20, 24];
    let points = became.map(|v: u32| new_points[v as usize]);
    for faces in [[[0, 1, 3], [0, 3, 2]], [[0, 1, 2], [1, 3, 2]]] {
        let open = any_of(points.len());
        let pairing = Pairing {
            points: &points,
            faces: &faces,
            new_points: &new_points,
            new_faces: &new_faces,
            became: &became,
            open: &open,
        };
        let Verdict { proved, .. } = prove(&pairing, f64::INFINITY, 0.0);
        assert!(proved.forward < 1e-9 && proved.backward < 1e-9 && proved.searched == 0, "{proved:?}");
    }
}

/// A square that has got a fin: no vertex of the square lies on it, but two have become its corners, so that both triangles are named.
#[test]
fn what_is_far_is_named_though_nothing_lies_on_it() {
    let (points, faces) = grid(1, |_| 0.0);
    let new_points = [&points[..], &[[0.5, 0.0, 5.0]]].concat();
    let new_faces = [&faces[..], &[[0, 1, 4]]].concat();
    let (became, open) = ([0, 1, 2, 3], any_of(points.len()));
    let pairing =
        Pairing { points: &points, faces: &faces, new_points: &new_points, new_faces: &new_faces, became: &became, open: &open };
    let Verdict { proved, far, under, .. } = prove(&pairing, 1.0, 1.0);
    assert!(proved.backward >= 5.0, "{proved:?}");
    assert!(far.len() == 2 && (0..).zip(&far).all(|(f, one)| one.0 == f && one.1 > 4.999), "{far:?}");
    assert_eq!(under, [2]);
}
