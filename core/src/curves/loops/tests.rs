use std::collections::HashMap;

use proptest::prelude::*;

use super::edge::ends;
use super::*;
use crate::curves::curve::{Arc, Shape, Source};
use crate::curves::network::Unit;
use crate::curves::vector::Point;

fn network(shapes: Vec<Shape>) -> Network {
    let curve = |(number, shape): (usize, Shape)| {
        let source = Source { id: Id::Place(number as u64), line: 0 };
        Curve { shape, source, name: None, role: Role::Free, is_blanked: false, vertices: None }
    };
    let curves = shapes.into_iter().enumerate().map(curve).collect();
    let unit = Unit { name: "mm".into(), millimetres: 1.0 };
    Network { unit, resolution: None, digits: 0, curves, faces: Vec::new(), findings: Vec::new() }
}

fn lines(ends: &[[Point; 2]]) -> Network {
    network(ends.iter().map(|ends| Shape::Line(*ends)).collect())
}

fn sizes(loops: &Loops) -> Vec<usize> {
    let mut sizes: Vec<usize> = loops.loops.iter().map(|one| one.uses.len()).collect();
    sizes.sort_unstable();
    sizes
}

/// Each curve of a loop ends where the next one begins, and no loop has a curve twice.
fn check(network: &Network, loops: &Loops) {
    let shape = |one: &Use| match one.curve.checked_sub(network.curves.len()) {
        None => &network.curves[one.curve].shape,
        Some(added) => &loops.added[added].shape,
    };
    for one in &loops.loops {
        for (this, next) in one.uses.iter().zip(one.uses.iter().cycle().skip(1)) {
            let gap = distance(ends(shape(this), this.is_reversed)[1], ends(shape(next), next.is_reversed)[0]);
            assert!(gap <= 2.0 * loops.tolerance, "{gap} between {this:?} and {next:?}");
        }
        let mut numbers: Vec<usize> = one.uses.iter().map(|one| one.curve).collect();
        numbers.sort_unstable();
        numbers.dedup();
        assert_eq!(numbers.len(), one.uses.len());
    }
}

/// No curve is in more than two loops, and two follow it in opposite directions.
fn check_sides(loops: &Loops) {
    let mut seen: HashMap<usize, Vec<bool>> = HashMap::new();
    for one in loops.loops.iter().flat_map(|one| &one.uses) {
        seen.entry(one.curve).or_default().push(one.is_reversed);
    }
    for (curve, sides) in seen {
        assert!(matches!(sides[..], [_] | [true, false] | [false, true]), "curve {curve}: {sides:?}");
    }
}

/// A grid of `n` by `m` cells, on whatever `place` makes of it.
fn grid(n: usize, m: usize, place: impl Fn(f64, f64) -> Point) -> Network {
    let mut ends = Vec::new();
    for i in 0..=n {
        for j in 0..=m {
            let (x, y) = (i as f64, j as f64);
            if i < n {
                ends.push([place(x, y), place(x + 1.0, y)]);
            }
            if j < m {
                ends.push([place(x, y), place(x, y + 1.0)]);
            }
        }
    }
    lines(&ends)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    #[test]
    fn polygons_are_found_however_they_lie(
        counts in prop::collection::vec(3_usize..12, 1..6),
        seed in prop::collection::vec((any::<u32>(), any::<bool>()), 80),
    ) {
        let mut edges = Vec::new();
        for (number, count) in counts.iter().enumerate() {
            let corner = |at: usize| {
                let angle = std::f64::consts::TAU * (at % count) as f64 / *count as f64;
                [angle.cos() + 5.0 * number as f64, angle.sin(), 0.3 * (at % count) as f64]
            };
            edges.extend((0..*count).map(|at| [corner(at), corner(at + 1)]));
        }
        let mut keyed: Vec<(u32, [Point; 2])> = edges.iter().zip(&seed).map(|([a, b], (key, turn))| (*key, if *turn { [*b, *a] } else { [*a, *b] })).collect();
        keyed.sort_by_key(|(key, _)| *key);
        let network = lines(&keyed.into_iter().map(|(_, ends)| ends).collect::<Vec<_>>());
        let loops = find(&network, &Options::default());
        check(&network, &loops);
        let mut expected = counts;
        expected.sort_unstable();
        prop_assert_eq!(sizes(&loops), expected);
        prop_assert!(loops.loose.is_empty() && loops.loops.iter().all(|one| !one.is_cell));
    }

    #[test]
    fn every_cell_of_a_grid_is_found_once(n in 1_usize..7, m in 1_usize..7, bend in -0.2..0.2_f64, jolt in 0.0..0.3_f64) {
        let network = grid(n, m, |x, y| [x + jolt * (7.0 * y).sin(), y + jolt * (5.0 * x).cos(), bend * (x * x - x * y)]);
        let loops = find(&network, &Options::default());
        check(&network, &loops);
        check_sides(&loops);
        prop_assert_eq!(sizes(&loops), vec![4; n * m]);
        prop_assert!(loops.unresolved.is_empty());
    }
}

/// Six faces of a box, whatever its sides: the last one closes it.
#[test]
fn a_box_has_six_faces() {
    for size in [[1.0, 1.0, 1.0], [10.0, 10.0, 0.1], [1.0, 2.0, 9.0]] {
        let corner = |n: usize| [(n & 1) as f64 * size[0], (n >> 1 & 1) as f64 * size[1], (n >> 2) as f64 * size[2]];
        let edges = (0..8)
            .flat_map(|n| [1, 2, 4].into_iter().filter(move |bit| n & bit == 0).map(move |bit| [corner(n), corner(n | bit)]));
        let network = lines(&edges.collect::<Vec<_>>());
        let loops = find(&network, &Options::default());
        check(&network, &loops);
        check_sides(&loops);
        assert_eq!(sizes(&loops), [4; 6], "{size:?}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    /// Edges of a tetrahedron, of a pyramid over a polygon and of two of them, whose corners are anywhere: their faces are found, however sharp corners are.
    #[test]
    fn pyramids_have_their_faces(sides in 3_usize..8, is_double: bool, top in (-1.0..1.0_f64, -1.0..1.0_f64, 0.3..4.0_f64)) {
        // The base of a flat pyramid goes around all its other faces, and that of two slender ones is shorter than these: whether it is a face, nobody knows.
        let height = if is_double { 0.2 + 0.15 * top.2 } else { top.2 + 0.3 };
        let top = (0.2 * top.0, 0.2 * top.1, height);
        let corner = |k: usize| {
            let (sin, cos) = (std::f64::consts::TAU * (k % sides) as f64 / sides as f64).sin_cos();
            [cos, sin, 0.0]
        };
        let (x, y, z) = top;
        let mut edges: Vec<[Point; 2]> = (0..sides).flat_map(|k| [[corner(k), corner(k + 1)], [corner(k), [x, y, z]]]).collect();
        if is_double {
            edges.extend((0..sides).map(|k| [corner(k), [y, x, -z]]));
        }
        let network = lines(&edges);
        let loops = find(&network, &Options::default());
        check(&network, &loops);
        check_sides(&loops);
        let mut expected = vec![3; if is_double { 2 * sides } else { sides }];
        expected.extend((!is_double).then_some(sides));
        prop_assert_eq!(sizes(&loops), expected);
    }
}

/// A tube of long narrow fields, open at both ends: rings around it are no faces, but those at its ends may be.
#[test]
fn rings_around_a_tube_are_no_faces() {
    let place = |x: f64, y: f64| {
        let angle = std::f64::consts::TAU * (y % 6.0) / 6.0;
        [10.0 * x, angle.cos(), angle.sin()]
    };
    let mut ends = Vec::new();
    for x in 0..=4 {
        for y in 0..6 {
            let (x, y) = (f64::from(x), f64::from(y));
            ends.push([place(x, y), place(x, y + 1.0)]);
            if x < 4.0 {
                ends.push([place(x, y), place(x + 1.0, y)]);
            }
        }
    }
    let network = lines(&ends);
    let loops = find(&network, &Options::default());
    check(&network, &loops);
    check_sides(&loops);
    assert_eq!(sizes(&loops), [vec![4; 24], vec![6, 6]].concat());
}

/// A field of nine cells whose middle one is missing its cross: a hole of 12 sides around it is a face, too.
#[test]
fn a_face_of_many_sides_among_small_ones_is_found() {
    let mut network = grid(5, 5, |x, y| [x, y, 0.0]);
    let is_inside = |[x, y, _]: Point| x > 1.1 && x < 3.9 && y > 1.1 && y < 3.9;
    network.curves.retain(|curve| !is_inside(curve.shape.point(0.5)));
    let loops = find(&network, &Options::default());
    check(&network, &loops);
    check_sides(&loops);
    assert_eq!(sizes(&loops), [vec![4; 16], vec![12]].concat());
}

/// Two circles joined by a line (the seam of a cylinder) are two loops; the line is in none.
#[test]
fn a_seam_is_in_no_loop() {
    let circle = |z: f64| Shape::Arc(Arc::new([0.0, 0.0, z], [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], [0.0, 0.0]).unwrap());
    let network = network(vec![circle(0.0), Shape::Line([[1.0, 0.0, 0.0], [1.0, 0.0, 5.0]]), circle(5.0)]);
    let loops = find(&network, &Options::default());
    assert_eq!((sizes(&loops), loops.loose), (vec![1, 1], vec![1]));
}

/// A triangle with a tail, and a path that leads nowhere.
#[test]
fn what_is_in_no_loop_is_listed() {
    let [a, b, c, d] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [5.0, 5.0, 0.0]];
    let mut network = lines(&[[a, b], [b, c], [c, d], [c, a], [[7.0; 3], [8.0; 3]], [a, a]]);
    network.curves[4].role = Role::Generator;
    let loops = find(&network, &Options::default());
    check(&network, &loops);
    assert_eq!((sizes(&loops), loops.loose, loops.left_out), (vec![3], vec![2], vec![4, 5]));
}

/// Three sides of a square and three of a distant one, each closed by a straight line on request; a lone line is not closed onto itself.
#[test]
fn gaps_are_closed_on_request() {
    let path = |x: f64| {
        [[[x, 0.0, 0.0], [x + 1.0, 0.0, 0.0]], [[x + 1.0, 0.0, 0.0], [x + 1.0, 1.0, 0.0]], [[x + 1.0, 1.0, 0.0], [x, 1.0, 0.0]]]
    };
    let network = lines(&[path(0.0).as_slice(), &path(9.0), &[[[50.0; 3], [51.0; 3]]]].concat());
    assert_eq!(sizes(&find(&network, &Options::default())), Vec::<usize>::new());
    let loops = find(&network, &Options { closes_gaps: true, ..Options::default() });
    check(&network, &loops);
    assert_eq!((sizes(&loops), loops.added.len(), &loops.loose[..]), (vec![4, 4], 2, &[6][..]));
    let short = find(&network, &Options { closes_gaps: true, longest_gap: 0.5, ..Options::default() });
    assert_eq!(short.added.len(), 0);
}

/// Vertices of the file count, whatever the places; ends without any count by place.
#[test]
fn vertices_are_trusted_unless_told_otherwise() {
    let [a, b, c] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let mut network = lines(&[[a, b], [b, c], [c, a]]);
    network.curves[0].vertices = Some([0, 1]);
    network.curves[1].vertices = Some([1, 2]);
    network.curves[2].vertices = Some([2, 3]);
    assert_eq!(sizes(&find(&network, &Options::default())), Vec::<usize>::new());
    assert_eq!(sizes(&find(&network, &Options { trusts_vertices: false, ..Options::default() })), [3]);
    network.curves[2].vertices = None;
    assert_eq!(sizes(&find(&network, &Options::default())), [3]);
}

/// Ends that rounding put apart meet; an eighth of the length of a short curve is too far.
#[test]
fn the_tolerance_is_that_of_the_data() {
    let [a, b, c] = [[0.0; 3], [100.0, 0.0, 0.0], [0.0, 100.0, 0.0]];
    let mut network = lines(&[[a, b], [[100.0004, 0.0, 0.0], c], [c, a]]);
    assert_eq!(sizes(&find(&network, &Options::default())), Vec::<usize>::new());
    network.digits = 6;
    assert_eq!(sizes(&find(&network, &Options::default())), [3]);
    let tiny = lines(&[[a, [1e-3, 0.0, 0.0]], [[1e-3, 0.0, 0.0], [0.0, 1e-3, 0.0]], [[0.0, 1e-3, 0.0], a], [b, c]]);
    let loops = find(&tiny, &Options { tolerance: Some(1.0), ..Options::default() });
    assert_eq!((sizes(&loops), loops.loose), (vec![3], vec![3]));
}

/// Three curves between two points: two faces, the outline of both is none.
#[test]
fn an_outline_is_no_face() {
    let arc = |height: f64| Shape::polyline(vec![[-1.0, 0.0, 0.0], [0.0, height, 0.0], [1.0, 0.0, 0.0]]).unwrap();
    let network = network(vec![arc(1.0), arc(0.1), arc(-1.0)]);
    let loops = find(&network, &Options::default());
    check_sides(&loops);
    let pairs: Vec<Vec<usize>> = loops.loops.iter().map(|one| one.uses.iter().map(|one| one.curve).collect()).collect();
    assert_eq!(pairs, [vec![0, 1], vec![1, 2]]);
}

/// Two squares side by side, each with all four of its sides: the side that both have counts once.
#[test]
fn doubles_count_once() {
    let square = |x: f64| {
        let corners = [[x, 0.0, 0.0], [x + 1.0, 0.0, 0.0], [x + 1.0, 1.0, 0.0], [x, 1.0, 0.0]];
        (0..4).map(move |at| [corners[at], corners[(at + 1) % 4]])
    };
    let network = lines(&square(0.0).chain(square(1.0)).collect::<Vec<_>>());
    let loops = find(&network, &Options::default());
    check(&network, &loops);
    check_sides(&loops);
    assert_eq!((sizes(&loops), loops.doubles), (vec![4, 4], vec![(7, 1)]));
    let each = find(&network, &Options { joins_doubles: false, ..Options::default() });
    assert!(sizes(&each).contains(&2));
}
