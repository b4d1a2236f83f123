//! Patches between the sides of a rim.

use super::*;

/// A box whose lid is missing, with its corners at two heights by turns: between four straight sides lies a hyperbolic paraboloid, and a bilinear blend of them is
/// just that (Farin, Hansford 1999), although the surface around turns away.
#[test]
fn a_patch_between_straight_sides_is_a_hyperbolic_paraboloid() {
    const SIDE: u32 = 10;
    let height = |x: f64, y: f64| 2.0 * (x * (1.0 - y) + (1.0 - x) * y);
    let around_square = |k: u32| {
        let (side, share) = (k / SIDE % 4, f64::from(k % SIDE) / f64::from(SIDE));
        [[share, 0.0], [1.0, share], [1.0 - share, 1.0], [0.0, 1.0 - share]][side as usize]
    };
    let mut positions: Vec<Point> = Vec::new();
    for row in 0..3 {
        for k in 0..4 * SIDE {
            let [x, y] = around_square(k);
            positions.push([10.0 * x, 10.0 * y, height(x, y) - f64::from(row)].map(|x| x as f32));
        }
    }
    let mut around = Vec::new();
    for row in 0..2 {
        for k in 0..4 * SIDE {
            let [a, b] = [k, (k + 1) % (4 * SIDE)].map(|k| row * 4 * SIDE + k);
            let [c, d] = [a, b].map(|v| v + 4 * SIDE);
            around.extend([[a, c, d], [a, d, b]]);
        }
    }
    // Rungs from the two sides at one corner to the two at the opposite one.
    let rim = 4 * SIDE;
    let rungs = (0..rim / 2).flat_map(|k| [[k, k + 1, rim - k - 1], [k, rim - k - 1, (rim - k) % rim]]);
    let patch: Vec<[u32; 3]> = rungs.filter(|[a, b, c]| a != b && b != c && c != a).collect();
    let region = CoarsePatch { positions: &positions, patch: &patch, around: &around };
    let settings = ShapeSettings { method: Method::Coons, ..ShapeSettings::default() };
    let shaped = shape(&region, &settings).unwrap();
    assert!(shaped.added.len() > 40, "{}", shaped.added.len());
    for [x, y, z] in &shaped.added {
        let expected = height(f64::from(*x) / 10.0, f64::from(*y) / 10.0);
        assert!((f64::from(*z) - expected).abs() < 1e-5, "{x} {y} {z}");
    }
}
