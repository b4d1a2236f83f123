//! Every patch is checked by code of its own: integer arithmetic and brute force, nothing of the module under test.

use crate::geometry::self_crossing::{SelfCrossing, self_crossing};
use crate::geometry::tri_tri::{Contact, Triangle, triangles_cross};
use proptest::prelude::*;

use super::*;
use crate::geometry::tri_tri::{Sure, sure, sure_of_neighbours};
use crate::util::steps;

/// Positions on a grid of integers, so that i128 arithmetic is exact and degenerate situations are frequent.
type Grid = [i32; 3];

fn float(points: &[Grid]) -> Vec<Point> {
    points.iter().map(|p| p.map(|x| x as f32)).collect()
}

fn sub(a: [i128; 3], b: [i128; 3]) -> [i128; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn cross(a: [i128; 3], b: [i128; 3]) -> [i128; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn dot(a: [i128; 3], b: [i128; 3]) -> i128 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// A point as numerators over one denominator.
#[derive(Clone, Copy, PartialEq)]
struct Ratio([i128; 3], i128);

/// The part of a polygon where `f` (a linear function, given as normal and offset) is not negative: Sutherland & Hodgman.
fn clip(polygon: &[Ratio], normal: [i128; 3], origin: [i128; 3]) -> Vec<Ratio> {
    let value = |p: &Ratio| dot(normal, [0, 1, 2].map(|k| p.0[k] - origin[k] * p.1));
    let mut kept = Vec::new();
    for (i, p) in polygon.iter().enumerate() {
        let q = &polygon[(i + 1) % polygon.len()];
        let (a, b) = (value(p), value(q));
        if a >= 0 {
            kept.push(*p);
        }
        if a.signum() * b.signum() < 0 {
            // The point p + t (q − p) with t = a·q₁ / (a·q₁ − b·p₁): values are scaled by the denominators.
            let (s, t) = (a * q.1, b * p.1);
            let mut r = Ratio([0, 1, 2].map(|k| s * q.0[k] * p.1 - t * p.0[k] * q.1), (s - t) * p.1 * q.1);
            let common = r.0.iter().fold(r.1, |g, &x| gcd(g, x)) * r.1.signum();
            r = Ratio(r.0.map(|x| x / common), r.1 / common);
            kept.push(r);
        }
    }
    kept
}

fn gcd(a: i128, b: i128) -> i128 {
    if b == 0 { a.abs() } else { gcd(b, a % b) }
}

/// Contact of two triangles of positive area, by clipping one to the plane and the sides of the other in rational numbers.
fn contact(a: &[Grid; 3], b: &[Grid; 3]) -> Contact {
    let (a, b) = (a.map(|p| p.map(i128::from)), b.map(|p| p.map(i128::from)));
    let shared: Vec<_> = a.iter().filter(|p| b.contains(p)).map(|p| Ratio(*p, 1)).collect();
    if shared.len() == 3 {
        return Contact::Overlap;
    }
    let normal = cross(sub(b[1], b[0]), sub(b[2], b[0]));
    let mut common: Vec<Ratio> = a.iter().map(|p| Ratio(*p, 1)).collect();
    common = clip(&clip(&common, normal, b[0]), normal.map(|x| -x), b[0]);
    for k in 0..3 {
        common = clip(&common, cross(normal, sub(b[(k + 1) % 3], b[k])), b[k]);
    }
    let mut distinct: Vec<Ratio> = Vec::new();
    for p in common {
        if !distinct.contains(&p) {
            distinct.push(p);
        }
    }
    let from_first = |p: &Ratio| [0, 1, 2].map(|k| p.0[k] * distinct[0].1 - distinct[0].0[k] * p.1);
    match distinct.len() {
        0 => Contact::Apart,
        1 => {
            if shared.contains(&distinct[0]) {
                Contact::Apart
            } else {
                Contact::Touch
            }
        }
        _ if distinct.iter().any(|p| cross(from_first(&distinct[1]), from_first(p)) != [0; 3]) => Contact::Overlap,
        _ if shared.len() == 2 && distinct.iter().all(|p| shared.contains(p)) => Contact::Apart,
        _ => {
            let on_edge = |t: &[[i128; 3]; 3]| {
                (0..3).any(|k| {
                    let along = sub(t[(k + 1) % 3], t[k]);
                    distinct.iter().all(|p| cross(along, [0, 1, 2].map(|c| p.0[c] - t[k][c] * p.1)) == [0; 3])
                })
            };
            if on_edge(&a) && on_edge(&b) { Contact::Touch } else { Contact::Cross }
        }
    }
}

fn area_is_zero(t: &[Grid; 3]) -> bool {
    let t = t.map(|p| p.map(i128::from));
    cross(sub(t[1], t[0]), sub(t[2], t[0])) == [0; 3]
}

/// All that a patch promises.
fn check(points: &[Grid], apexes: &[Option<Grid>], forbidden: &dyn Fn(u32, u32) -> bool, patch: &Patch) {
    let n = points.len() as u32;
    assert_eq!(patch.triangles.len() as u32, n - 2, "{patch:?}");
    // Directed edges: each rim edge once and forwards, each chord once each way. With n − 2 triangles on n vertices and one
    // connected piece that is a disc: V − E + F = n − (2n − 3) + (n − 2) = 1.
    let mut edges: Vec<(u32, u32)> = patch.triangles.iter().flat_map(|t| [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])]).collect();
    edges.sort_unstable();
    assert!(edges.windows(2).all(|w| w[0] != w[1]), "an edge is used twice in one direction");
    for i in 0..n {
        assert!(edges.binary_search(&(i, (i + 1) % n)).is_ok(), "rim edge {i} is missing");
    }
    let mut chords = 0;
    for &(a, b) in edges.iter().filter(|(a, b)| (a + 1) % n != *b) {
        assert!(edges.binary_search(&(b, a)).is_ok(), "chord {a}-{b} has one side");
        assert!(!forbidden(a.min(b), a.max(b)), "chord {a}-{b} is forbidden");
        chords += 1;
    }
    assert_eq!(chords, 2 * (n - 3));
    let mut reached = vec![false; patch.triangles.len()];
    let mut stack = vec![0];
    while let Some(i) = stack.pop() {
        if !std::mem::replace(&mut reached[i], true) {
            let shares = |t: &[u32; 3]| patch.triangles[i].iter().filter(|v| t.contains(v)).count() == 2;
            stack.extend(patch.triangles.iter().enumerate().filter(|(_, t)| shares(t)).map(|(j, _)| j));
        }
    }
    assert!(reached.iter().all(|&r| r), "the patch is in pieces");
    let corners: Vec<[Grid; 3]> = patch.triangles.iter().map(|t| t.map(|v| points[v as usize])).collect();
    for (i, a) in corners.iter().enumerate() {
        assert!(!area_is_zero(a), "triangle {:?} has no area", patch.triangles[i]);
        for (j, b) in corners.iter().enumerate().skip(i + 1) {
            let met = contact(a, b);
            assert!(!met.is_crossing(), "{:?} and {:?}: {met:?}", patch.triangles[i], patch.triangles[j]);
        }
        for k in 0..3 {
            let (a, b) = (patch.triangles[i][k], patch.triangles[i][(k + 1) % 3]);
            if (a + 1) % n == b
                && let Some(Some(apex)) = apexes.get(a as usize)
            {
                let beyond = [points[b as usize], points[a as usize], *apex];
                assert!(area_is_zero(&beyond) || contact(&corners[i], &beyond) != Contact::Overlap, "folded onto the mesh");
            }
        }
    }
}

fn fill(points: &[Grid], apexes: &[Option<Grid>], forbidden: &dyn Fn(u32, u32) -> bool) -> Result<Patch, Unfillable> {
    let apex_positions: Vec<_> = apexes.iter().map(|a| a.map(|p| p.map(|x| x as f32))).collect();
    let rim = Rim { points: &float(points), apexes: &apex_positions, obstacles: &[], forbidden };
    let result = triangulate(&rim, &FillSettings::default());
    if let Ok(patch) = &result {
        check(points, apexes, forbidden, patch);
    }
    result
}

fn free(_: u32, _: u32) -> bool {
    false
}

#[test]
fn three_vertices_are_one_triangle_or_a_needle() {
    let patch = fill(&[[0, 0, 0], [4, 0, 0], [0, 4, 0]], &[], &free).unwrap();
    assert_eq!((patch.triangles, patch.method), (vec![[0, 1, 2]], Method::Triangle));
    assert_eq!(fill(&[[0, 0, 0], [4, 4, 4], [1, 1, 1]], &[], &free), Err(Unfillable::Collinear));
    assert_eq!(fill(&[[0, 0, 0], [4, 4, 4], [1, 1, 1], [2, 2, 2]], &[], &free), Err(Unfillable::Collinear));
}

#[test]
fn what_is_no_loop_is_refused() {
    assert_eq!(fill(&[[0, 0, 0], [4, 0, 0]], &[], &free), Err(Unfillable::NotALoop));
    assert_eq!(fill(&[[0, 0, 0], [4, 0, 0], [4, 4, 0], [4, 0, 0]], &[], &free), Err(Unfillable::NotALoop));
    let rim = Rim { points: &[[0.0; 3], [1.0, f32::NAN, 0.0], [0.0, 1.0, 0.0]], apexes: &[], obstacles: &[], forbidden: &free };
    assert_eq!(triangulate(&rim, &FillSettings::default()), Err(Unfillable::NotALoop));
    // −0.0 is 0.0 to every reader of the file.
    let rim = Rim { points: &[[0.0; 3], [1.0, 0.0, 0.0], [-0.0, 0.0, -0.0]], apexes: &[], obstacles: &[], forbidden: &free };
    assert_eq!(triangulate(&rim, &FillSettings::default()), Err(Unfillable::NotALoop));
}

/// An L with vertices in the middle of its sides, as T-junction splits leave them: no triangle may lie along a side.
#[test]
fn runs_along_a_side_give_no_flat_triangle() {
    let l = [[0, 0, 5], [2, 0, 5], [4, 0, 5], [4, 1, 5], [4, 2, 5], [2, 2, 5], [2, 3, 5], [2, 4, 5], [0, 4, 5], [0, 2, 5]];
    assert_eq!(fill(&l, &[], &free).unwrap().method, Method::Planar);
    // The same in a slanted plane, where no projection keeps angles.
    let slanted = l.map(|[x, y, _]| [x + 2 * y, 3 * x - y, x + 7 * y]);
    assert_eq!(fill(&slanted, &[], &free).unwrap().method, Method::Planar);
}

#[test]
fn a_square_takes_the_diagonal_that_is_free() {
    let square = [[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0]];
    for taken in [(0, 2), (1, 3)] {
        let patch = fill(&square, &[], &|a, b| (a, b) == taken).unwrap();
        assert_eq!(patch.method, Method::Planar);
    }
    assert_eq!(fill(&square, &[], &|_, _| true), Err(Unfillable::Blocked));
}

/// The outline of a flat sheet: any patch in its plane would lie on the sheet.
#[test]
fn a_patch_never_lies_flat_on_the_triangle_beside_it() {
    let apexes = [Some([1, 1, 0]); 3];
    assert_eq!(fill(&[[0, 0, 0], [9, 0, 0], [0, 9, 0]], &apexes, &free), Err(Unfillable::Blocked));
    let outside = [Some([1, -5, 0]), Some([9, 9, 0]), Some([-5, 1, 0])];
    assert!(fill(&[[0, 0, 0], [9, 0, 0], [0, 9, 0]], &outside, &free).is_ok());
}

proptest! {
    #[test]
    fn triangle_contacts_are_those_of_rational_clipping(
        p in prop::collection::vec(prop::array::uniform3(0_i32..5), 6),
        flat in 0_u8..4,
        shared in 0_usize..3,
    ) {
        let mut p = p;
        for q in &mut p {
            if flat == 0 { q[2] = 0 } else if flat == 1 { q[2] = q[0] + 2 * q[1] }
        }
        for s in 0..shared { p[5 - s] = p[s] }
        let (a, b) = ([p[0], p[1], p[2]], [p[3], p[4], p[5]]);
        prop_assume!(!area_is_zero(&a) && !area_is_zero(&b));
        let f = |t: [Grid; 3]| t.map(|p| p.map(|x| x as f32));
        let expected = contact(&a, &b);
        for (x, y) in [(a, b), (b, a), ([a[1], a[2], a[0]], [b[2], b[1], b[0]])] {
            prop_assert_eq!(triangles_cross(&f(x), &f(y)), expected);
            let is_right = match rounded(&f(x), &f(y)) {
                Sure::No => true,
                Sure::Apart => !expected.is_crossing(),
                Sure::Cross => expected == Contact::Cross,
            };
            prop_assert!(is_right);
        }
    }
}

/// What rounded arithmetic says of triangles with or without common corners.
fn rounded(a: &[Point; 3], b: &[Point; 3]) -> Sure {
    let Some(first) = a.iter().position(|p| b.contains(p)) else { return sure(a, b) };
    let others: Vec<Point> = b.iter().filter(|p| !a.contains(p)).copied().collect();
    match others[..] {
        [] => Sure::No,
        [p] => sure_of_neighbours(&[a[first], a[(first + 1) % 3], a[(first + 2) % 3]], &[a[first], p, p]),
        [p, q, ..] => sure_of_neighbours(&[a[first], a[(first + 1) % 3], a[(first + 2) % 3]], &[a[first], p, q]),
    }
}

/// Exact arithmetic is for what is in doubt only.
#[test]
fn most_contacts_are_sure_without_exact_arithmetic() {
    let floor = [[0.0, 0.0, 0.0], [8.0, 0.0, 0.0], [0.0, 8.0, 0.0]];
    let upright = |x: f32, z: f32| [[x, 1.0, z - 2.0], [x, 5.0, z - 2.0], [x, 2.0, z + 2.0]];
    assert_eq!(rounded(&floor, &upright(1.0, 0.0)), Sure::Cross);
    assert_eq!(rounded(&floor, &upright(1.0, 3.0)), Sure::Apart);
    assert_eq!(rounded(&floor, &upright(9.0, 0.0)), Sure::Apart);
    // It touches the floor with a corner.
    assert_eq!(rounded(&floor, &upright(1.0, 2.0)), Sure::No);
    // From a corner of the floor through it, beside it, away from it, and from one of its edges.
    let from_corner = |p: Point, q: Point| rounded(&floor, &[[0.0; 3], p, q]);
    assert_eq!(from_corner([1.0, 1.0, -1.0], [1.0, 2.0, 1.0]), Sure::Cross);
    assert_eq!(from_corner([1.0, -1.0, -1.0], [1.0, -2.0, 1.0]), Sure::Apart);
    assert_eq!(from_corner([-1.0, -1.0, -1.0], [-1.0, -2.0, 1.0]), Sure::Apart);
    assert_eq!(from_corner([1.0, 1.0, 1.0], [1.0, 2.0, 1.0]), Sure::Apart);
    assert_eq!(from_corner([8.0, 0.0, 0.0], [1.0, 2.0, 1.0]), Sure::Apart);
    assert_eq!(from_corner([8.0, 0.0, 0.0], [1.0, 2.0, 0.0]), Sure::No);
}

/// A saddle: the corners of a cube's faces in turn. Far from planar.
#[test]
fn a_loop_in_space_is_filled_by_minimum_weight() {
    let saddle = [[0, 0, 0], [4, 0, 4], [4, 4, 0], [0, 4, 4]];
    assert_eq!(fill(&saddle, &[], &free).unwrap().method, Method::MinimumWeight);
}

/// Half a cube is missing: six rim vertices, and the mesh's triangles of the other half around. The other half of the cube
/// bends by 90° at most; any patch that cuts through would bend more somewhere.
#[test]
fn the_least_bend_continues_what_is_around() {
    let rim = [[0, 0, 8], [8, 0, 8], [8, 0, 0], [8, 8, 0], [0, 8, 0], [0, 8, 8]];
    // The rim bounds the faces x = 0, y = 0 and z = 0, which are there; x = 8, y = 8 and z = 8 meet in (8, 8, 8), which is not.
    let apexes = [[0, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, 0]].map(Some);
    let patch = fill(&rim, &apexes, &free).unwrap();
    assert_eq!(patch.triangles.len(), 4);
}

/// Beyond the minimum-weight triangulation's limit: a rim that goes up and down five times.
#[test]
fn a_large_loop_is_filled_by_the_front() {
    let at = |i: i32| {
        let t = f64::from(i) / 400.0 * std::f64::consts::TAU;
        [500.0 * t.cos(), 500.0 * t.sin(), 100.0 * (5.0 * t).sin()].map(|x| x.round() as i32)
    };
    let rim: Vec<Grid> = (0..400).map(at).collect();
    assert_eq!(fill(&rim, &[], &free).unwrap().method, Method::Front);
    // The mesh around goes straight down from the rim.
    let apexes: Vec<Option<Grid>> = rim.iter().map(|p| Some([p[0], p[1], p[2] - 9])).collect();
    assert_eq!(fill(&rim, &apexes, &free).unwrap().method, Method::Front);
}

/// A trefoil knot bounds no disc at all: whatever patch is made crosses itself.
#[test]
fn a_knot_is_left_open() {
    // Six sticks are enough for a trefoil; these come from its usual parametrisation, rounded.
    for n in [12, 40] {
        let at = |i: i32| {
            let t = f64::from(i) / f64::from(n) * std::f64::consts::TAU;
            let radius = 500.0 + 200.0 * (3.0 * t).cos();
            [radius * (2.0 * t).cos(), radius * (2.0 * t).sin(), 200.0 * (3.0 * t).sin()].map(|x| x as i32)
        };
        let knot: Vec<Grid> = (0..n).map(at).collect();
        assert_eq!(fill(&knot, &[], &free), Err(Unfillable::CrossesItself));
    }
}

/// A zero-width slit that opens in the middle of one side only: a, b, c collinear with d beside them.
#[test]
fn a_slit_with_a_vertex_off_its_line_is_filled() {
    fill(&[[0, 0, 0], [3, 0, 0], [6, 0, 0], [9, 0, 0], [4, 1, 0]], &[], &free).unwrap();
    fill(&[[0, 0, 0], [1, 1, 1], [7, 7, 7], [8, 8, 8], [3, 4, 5], [1, 2, 2]], &[], &free).unwrap();
}

/// A spike that comes back on itself: both sides of it can only be joined to the one vertex off its line, and these triangles
/// lie on each other.
#[test]
fn a_spike_that_lies_on_itself_is_left_open() {
    let spike = [[0, 0, 0], [9, 9, 9], [8, 8, 8], [7, 7, 7], [3, 4, 5], [1, 1, 1]];
    assert_eq!(fill(&spike, &[], &free), Err(Unfillable::CrossesItself));
}

/// Directions around the origin, counter-clockwise, no two alike.
fn star(points: Vec<[i32; 2]>) -> Vec<[i32; 2]> {
    let mut points: Vec<_> = points.into_iter().filter(|p| *p != [0, 0]).collect();
    let upper = |p: &[i32; 2]| p[1] > 0 || (p[1] == 0 && p[0] > 0);
    let turn = |a: &[i32; 2], b: &[i32; 2]| a[0] * b[1] - a[1] * b[0];
    points.sort_by(|a, b| upper(b).cmp(&upper(a)).then(0.cmp(&turn(a, b))));
    points.dedup_by(|b, a| upper(a) == upper(b) && turn(a, b) == 0);
    points
}

/// A star-shaped polygon around the origin: every gap between neighbouring directions is below 180°.
fn star_loop(max: usize) -> impl Strategy<Value = Vec<[i32; 2]>> {
    prop::collection::vec(prop::array::uniform2(-30_i32..31), 3..max).prop_map(star).prop_filter("origin outside", |p| {
        p.len() > 2 && (0..p.len()).all(|i| p[i][0] * p[(i + 1) % p.len()][1] - p[i][1] * p[(i + 1) % p.len()][0] > 0)
    })
}

/// Doubles the coordinates and puts the middle into every second edge.
fn with_runs(points: Vec<Grid>) -> Vec<Grid> {
    let n = points.len();
    let middle = |i: usize| [0, 1, 2].map(|k| points[i][k] + points[(i + 1) % n][k]);
    (0..n).flat_map(|i| std::iter::once(points[i].map(|x| 2 * x)).chain((i % 2 == 0).then(|| middle(i)))).collect()
}

fn without_repeats(mut points: Vec<Grid>) -> Vec<Grid> {
    let mut seen = std::collections::BTreeSet::new();
    points.retain(|p| seen.insert(*p));
    points
}

/// All triangulations of the part of a polygon beyond the chord (i, k).
fn all_triangulations(i: u32, k: u32) -> Vec<Vec<[u32; 3]>> {
    if k == i + 1 {
        return vec![Vec::new()];
    }
    let mut all = Vec::new();
    for m in i + 1..k {
        for left in all_triangulations(i, m) {
            all.extend(all_triangulations(m, k).into_iter().map(|right| [&left[..], &right, &[[i, m, k]]].concat()));
        }
    }
    all
}

/// About one chord in `one_in`.
fn some(seed: u32, one_in: u32) -> impl Fn(u32, u32) -> bool {
    move |a, b| {
        (a.wrapping_mul(0x9E37_79B1) ^ b.wrapping_mul(0x85EB_CA6B) ^ seed).wrapping_mul(0xC2B2_AE35) >> 8 & 0xFFFF
            < 0x10000 / one_in
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(192))]

    #[test]
    fn planar_loops_are_filled_in_their_plane(p in star_loop(40), slant in prop::array::uniform2(-2_i32..3), runs in any::<bool>()) {
        let mut p: Vec<Grid> = p.into_iter().map(|[x, y]| [x + slant[1] * y, y, slant[0] * x + slant[1] * y]).collect();
        if runs { p = with_runs(p) }
        let patch = fill(&p, &[], &free).unwrap();
        prop_assert!(matches!(patch.method, Method::Planar | Method::Triangle));
    }

    #[test]
    fn hilly_loops_are_filled(p in star_loop(24), heights in prop::collection::vec(-9_i32..10, 24), runs in any::<bool>()) {
        let mut p: Vec<Grid> = p.into_iter().zip(heights).map(|([x, y], z)| [x, y, z]).collect();
        if runs { p = with_runs(p) }
        fill(&p, &[], &free).unwrap();
    }

    #[test]
    fn whatever_is_filled_is_valid(
        p in prop::collection::vec(prop::array::uniform3(-9_i32..10), 3..14),
        apexes in prop::collection::vec(prop::option::of(prop::array::uniform3(-9_i32..10)), 0..14),
        runs in any::<bool>(),
        flat in any::<bool>(),
        (seed, one_in) in (any::<u32>(), 1_u32..9),
    ) {
        let mut p = without_repeats(p);
        if flat {
            p.iter_mut().for_each(|q| q[2] = 0);
            p = without_repeats(p);
        }
        if runs { p = without_repeats(with_runs(p)) }
        prop_assume!(p.len() > 2);
        let _ = fill(&p, &apexes, &some(seed, one_in));
        let _ = fill(&p, &[], &free);
    }

    /// On a coarse grid, with rim and mesh in the way everywhere: a patch is found whenever there is one.
    #[test]
    fn a_small_loop_is_filled_if_it_can_be(
        p in prop::collection::vec(prop::array::uniform3(0_i32..4), 4..8).prop_map(without_repeats),
        (seed, one_in) in (any::<u32>(), 2_u32..99),
    ) {
        prop_assume!(p.len() > 3);
        let forbidden = some(seed, one_in);
        let valid = |patch: &Vec<[u32; 3]>| {
            let corners: Vec<[Grid; 3]> = patch.iter().map(|t| t.map(|v| p[v as usize])).collect();
            let n = p.len() as u32;
            let allowed = |a: u32, b: u32| b == a + 1 || (a, b) == (0, n - 1) || !forbidden(a, b);
            patch.iter().all(|t| allowed(t[0], t[1]) && allowed(t[1], t[2]) && allowed(t[0], t[2]))
                && corners.iter().all(|c| !area_is_zero(c))
                && (0..corners.len()).all(|i| (0..i).all(|j| !contact(&corners[i], &corners[j]).is_crossing()))
        };
        let possible = all_triangulations(0, p.len() as u32 - 1).iter().any(valid);
        prop_assert_eq!(fill(&p, &[], &forbidden).is_ok(), possible);
    }

    /// The front is the way for large loops; small ones find its mistakes sooner.
    #[test]
    fn what_the_front_fills_is_valid(
        p in prop_oneof![
            star_loop(60).prop_map(|p| p.into_iter().map(|[x, y]| [x, y, (x * y) % 7]).collect()),
            prop::collection::vec(prop::array::uniform3(-9_i32..10), 3..12).prop_map(without_repeats),
        ],
        apexes in prop::collection::vec(prop::option::of(prop::array::uniform3(-9_i32..10)), 0..9),
        runs in any::<bool>(),
        (seed, one_in) in (any::<u32>(), 1_u32..9),
    ) {
        let p = if runs { without_repeats(with_runs(p)) } else { p };
        prop_assume!(p.len() > 2);
        let forbidden = some(seed, one_in);
        let beyond: Vec<_> = apexes.iter().map(|a| a.map(|p| p.map(|x| x as f32))).collect();
        let rim = Rim { points: &float(&p), apexes: &beyond, obstacles: &[], forbidden: &forbidden };
        if let Ok(triangles) = by_front(&rim, 300) {
            check(&p, &apexes, &forbidden, &patch(triangles, Method::Front));
        }
    }

    #[test]
    fn crossings_in_a_set_are_found(
        p in prop::collection::vec((prop::array::uniform3(-20_i32..20), prop::array::uniform3(prop::array::uniform3(0_i32..7))), 1..40),
    ) {
        let soup: Vec<[Grid; 3]> = p
            .iter()
            .map(|(at, t)| t.map(|q| [0, 1, 2].map(|k| at[k] + q[k])))
            .filter(|t| !area_is_zero(t))
            .collect();
        let positions: Vec<Triangle> = soup.iter().map(|t| t.map(|p| p.map(|x| x as f32))).collect();
        let crosses = |i: usize, j: usize| contact(&soup[i], &soup[j]).is_crossing();
        match self_crossing(&positions, u64::MAX) {
            SelfCrossing::None => prop_assert!((0..soup.len()).all(|i| (0..i).all(|j| !crosses(i, j)))),
            SelfCrossing::Pair(i, j) => prop_assert!(crosses(i, j)),
            SelfCrossing::Undecided => prop_assert!(false),
        }
    }
}

#[test]
fn where_no_patch_can_be_valid_no_more_are_tried() {
    let angles = (0..60).map(|i| std::f32::consts::TAU * i as f32 / 60.0);
    let points: Vec<Point> = angles.map(|angle| [angle.cos(), angle.sin(), 0.0]).collect();
    let needle = [[0.01, 0.02, -1.0], [0.02, 0.01, -1.0], [0.015, 0.017, 1.0]];
    let rim = Rim { points: &points, apexes: &[], obstacles: &[needle], forbidden: &|_, _| false };
    let (one, _) = steps::of(|| minweight::triangulate(&rim, Weight::Bend, Choice::Any).is_ok());
    let (other, _) = steps::of(|| minweight::triangulate(&rim, Weight::Bend, Choice::Clear(&mut Clearance::new(&rim))).is_ok());
    let (all, made) = steps::of(|| triangulate(&rim, &FillSettings::default()));
    assert_eq!(made.err(), Some(Unfillable::Blocked));
    assert!(all <= one + other, "{all} steps after {one} and {other}");
}
