//! Algebraic starts: surfaces through a few facets and their normals.

use super::super::surface::{Surface, meridian};
use super::super::vector::{Point, along, cross, dot, frame, mean, norm, scale, sub, unit};
use crate::util::linear::{eigen, solve};

/// A facet's middle and normal.
pub(super) type Ray = (Point, Point);

/// The circle of least squares through points of the plane (Kåsa's method): centre and radius.
fn circle(points: &[[f64; 2]]) -> Option<([f64; 2], f64)> {
    let n = points.len() as f64;
    let (mx, my) = points.iter().fold((0.0, 0.0), |(x, y), p| (x + p[0] / n, y + p[1] / n));
    let (mut matrix, mut right) = ([[0.0; 3]; 3], [0.0; 3]);
    for [x, y] in points.iter().map(|p| [p[0] - mx, p[1] - my]) {
        let row = [x, y, 1.0];
        for i in 0..3 {
            (0..3).for_each(|j| matrix[i][j] += row[i] * row[j]);
            right[i] += row[i] * (x * x + y * y);
        }
    }
    let [a, b, c] = solve(matrix, right)?;
    let square = c + (a * a + b * b) / 4.0;
    (square > 0.0).then(|| ([mx + a / 2.0, my + b / 2.0], square.sqrt()))
}

/// The cylinder along `axis` through points.
pub(super) fn cylinder(axis: Point, points: &[Point]) -> Option<Surface> {
    let [e, f] = frame(axis);
    let flat: Vec<[f64; 2]> = points.iter().map(|p| [dot(*p, e), dot(*p, f)]).collect();
    let ([u, v], radius) = circle(&flat)?;
    let height = dot(axis, mean(points));
    let origin = along(along(scale(e, u), f, v), axis, height);
    Some(Surface::Cylinder { origin, axis, radius })
}

/// The cone whose strips of facets have the three planes: all pass through its apex, and their normals make one angle with its
/// axis.
pub(super) fn cone(rays: [Ray; 3], points: &[Point]) -> Option<Surface> {
    let [a, b, c] = rays;
    let apex = solve([a.1, b.1, c.1], [dot(a.0, a.1), dot(b.0, b.1), dot(c.0, c.1)])?;
    let axis = unit(cross(sub(b.1, a.1), sub(c.1, b.1)))?;
    let side = dot(axis, sub(mean(points), apex));
    let axis = if side < 0.0 { scale(axis, -1.0) } else { axis };
    let far = points.iter().max_by(|p, q| norm(sub(**p, apex)).total_cmp(&norm(sub(**q, apex))))?;
    let [h, r] = meridian(apex, axis, *far);
    let angle = r.atan2(h);
    (angle > 0.02 && angle < 1.55).then_some(Surface::Cone { apex, axis, angle })
}

/// The cone or cylinder around the direction that makes one angle with all normals, nearly: that in which they vary least. Its
/// meridian is the line of least squares through the points.
pub(super) fn turned(rays: &[Ray], points: &[Point]) -> Option<Surface> {
    let normals: Vec<Point> = rays.iter().map(|(_, normal)| *normal).collect();
    let middle = mean(&normals);
    let mut scatter = [[0.0; 3]; 3];
    for normal in &normals {
        let d = sub(*normal, middle);
        (0..3).for_each(|i| (0..3).for_each(|j| scatter[i][j] += d[i] * d[j]));
    }
    let [(_, axis), ..] = eigen(scatter);
    let Surface::Cylinder { origin, .. } = cylinder(axis, points)? else { return None };
    let flat: Vec<[f64; 2]> = points.iter().map(|p| meridian(origin, axis, *p)).collect();
    let n = flat.len() as f64;
    let (mh, mr) = flat.iter().fold((0.0, 0.0), |(h, r), p| (h + p[0] / n, r + p[1] / n));
    let (shh, shr) = flat.iter().fold((0.0, 0.0), |(a, b), p| (a + (p[0] - mh).powi(2), b + (p[0] - mh) * (p[1] - mr)));
    let slope = shr / shh.max(1e-300);
    if slope.abs() < 0.02 {
        return Some(Surface::Cylinder { origin, axis, radius: mr });
    }
    let apex = along(origin, axis, mh - mr / slope);
    let axis = if slope > 0.0 { axis } else { scale(axis, -1.0) };
    Some(Surface::Cone { apex, axis, angle: slope.abs().atan() })
}

/// The sphere of least squares of x² through points.
pub(super) fn sphere(points: &[Point]) -> Option<Surface> {
    let middle = mean(points);
    let (mut matrix, mut right) = ([[0.0; 4]; 4], [0.0; 4]);
    for point in points {
        let [x, y, z] = sub(*point, middle);
        let row = [x, y, z, 1.0];
        for i in 0..4 {
            (0..4).for_each(|j| matrix[i][j] += row[i] * row[j]);
            right[i] += row[i] * (x * x + y * y + z * z);
        }
    }
    let [a, b, c, d] = solve(matrix, right)?;
    let centre = [a / 2.0, b / 2.0, c / 2.0];
    let square = d + dot(centre, centre);
    (square > 0.0).then(|| Surface::Sphere { centre: [0, 1, 2].map(|k| centre[k] + middle[k]), radius: square.sqrt() })
}

/// The torus around the axis that all normals meet, found as the linear complex nearest to them (Pottmann, Wallner,
/// Computational Line Geometry, §4.1), with the circle through the points in its meridian plane.
pub(super) fn torus(rays: &[Ray], points: &[Point], size: f64) -> Option<Surface> {
    let middle = mean(points);
    let mut matrix = [[0.0; 6]; 6];
    for (centre, normal) in rays {
        let moment = scale(cross(sub(*centre, middle), *normal), 1.0 / size);
        let row = [normal[0], normal[1], normal[2], moment[0], moment[1], moment[2]];
        for i in 0..6 {
            (0..6).for_each(|j| matrix[i][j] += row[i] * row[j]);
        }
    }
    let [(_, least), ..] = eigen(matrix);
    // A line (d, m) is met by the normals where m · n + d · (p × n) = 0.
    let d = [least[3], least[4], least[5]];
    let m = [least[0], least[1], least[2]];
    let square = dot(d, d);
    if square < 1e-6 {
        return None;
    }
    let axis = unit(d)?;
    let foot = [0, 1, 2].map(|k| middle[k] + size * cross(d, m)[k] / square);
    let flat: Vec<[f64; 2]> = points.iter().map(|p| meridian(foot, axis, *p)).collect();
    let ([h, major], minor) = circle(&flat)?;
    let is_sound = major > 0.0 && minor > 0.0 && major < 100.0 * size && minor < 100.0 * size;
    is_sound.then(|| Surface::Torus { centre: along(foot, axis, h), axis, major, minor })
}

/// The torus around a known axis: the circle of least squares in the meridian plane.
pub(super) fn coaxial(origin: Point, axis: Point, points: &[Point]) -> Option<Surface> {
    let flat: Vec<[f64; 2]> = points.iter().map(|p| meridian(origin, axis, *p)).collect();
    let ([h, major], minor) = circle(&flat)?;
    (major > 0.0).then(|| Surface::Torus { centre: along(origin, axis, h), axis, major, minor })
}
