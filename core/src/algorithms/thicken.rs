//! A sheet made a wall: its surface twice, each vertex moved along its normal to either side, and a strip along the rim.
//!
//! At each vertex the triangles around agree on a front among themselves, which is all that it takes: a triangle finds its two skins on the sides that
//! its corners say, whatever the others think, so that one-sided sheets are made walls, too (the surface of a thickened Möbius strip has one
//! piece). The result is closed, coherent and faces outward. Where the sheet bends more tightly than the wall is thick it crosses itself, and is to be
//! cut along that.

use std::collections::BTreeMap;

use glam::DVec3;

use crate::algorithms::wrap::tree::Corners;
use crate::geometry::distance::place;
use crate::geometry::position::Position;

/// At a sharp bend vertices move farther, so that the skins keep their distance; by this factor at most.
const MOST_AT_BENDS: f64 = 2.0;

/// A corner of a triangle, and the edge's ends beside it.
struct Corner {
    triangle: usize,
    corner: usize,
    next: u32,
    previous: u32,
}

/// A wall of this thickness along a sheet. `None` if it is no sheet: a vertex or an edge of it has surfaces that hang together nowhere else, or
/// a vertex has no normal. O(n log n).
pub(crate) fn thicken(sheet: &[Corners], thickness: f64) -> Option<Vec<Corners>> {
    let (points, faces) = indexed(sheet);
    let mut around: Vec<Vec<Corner>> = points.iter().map(|_| Vec::new()).collect();
    for (triangle, face) in faces.iter().enumerate() {
        for corner in 0..3 {
            let (next, previous) = (face[(corner + 1) % 3], face[(corner + 2) % 3]);
            around[face[corner] as usize].push(Corner { triangle, corner, next, previous });
        }
    }
    let normals: Vec<DVec3> = faces.iter().map(|face| normal(face.map(|v| points[v as usize]))).collect();
    // By corner: its triangle faces as the vertex does.
    let mut agrees = vec![[true; 3]; faces.len()];
    let mut skins: Vec<[[f32; 3]; 2]> = Vec::with_capacity(points.len());
    for (point, corners) in points.iter().zip(&around) {
        let signs = fan(corners)?;
        let mut sum = DVec3::ZERO;
        for (corner, sign) in corners.iter().zip(&signs) {
            agrees[corner.triangle][corner.corner] = *sign;
            sum += turned(normals[corner.triangle], *sign);
        }
        let along = sum.try_normalize()?;
        let least = corners
            .iter()
            .zip(&signs)
            .map(|(corner, sign)| turned(normals[corner.triangle], *sign).normalize_or_zero().dot(along));
        let by = along * (thickness / 2.0 / least.fold(1.0, f64::min).max(1.0 / MOST_AT_BENDS));
        skins.push([*point + by, *point - by].map(|p| Position::nearest(p).coordinates()));
    }
    let skin = |t: usize, corner: usize, front: bool| skins[faces[t][corner] as usize][usize::from(front != agrees[t][corner])];
    let mut wall: Vec<Corners> = Vec::with_capacity(2 * faces.len());
    for t in 0..faces.len() {
        wall.push([0, 1, 2].map(|corner| skin(t, corner, true)));
        wall.push([0, 2, 1].map(|corner| skin(t, corner, false)));
    }
    for (t, corner) in rim(&faces) {
        let other = (corner + 1) % 3;
        let [a, b] = [corner, other].map(|corner| [true, false].map(|front| skin(t, corner, front)));
        wall.extend([[b[0], a[0], a[1]], [b[0], a[1], b[1]]]);
    }
    Some(wall)
}

/// Vertices by position, in their order, and the triangles by their vertices.
fn indexed(sheet: &[Corners]) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let mut numbers: BTreeMap<Position, u32> = sheet.iter().flatten().map(|p| (Position::of(*p), 0)).collect();
    numbers.values_mut().zip(0..).for_each(|(number, next)| *number = next);
    let points = numbers.keys().map(|position| place(position.coordinates())).collect();
    let faces = sheet.iter().map(|t| t.map(|p| numbers.get(&Position::of(p)).copied().unwrap_or(0)));
    (points, faces.filter(|[a, b, c]| a != b && b != c && c != a).collect())
}

fn normal([a, b, c]: [DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a)
}

fn turned(normal: DVec3, agrees: bool) -> DVec3 {
    if agrees { normal } else { -normal }
}

/// Which triangles around a vertex face as the first one does. `None`: they are more than one fan.
fn fan(corners: &[Corner]) -> Option<Vec<bool>> {
    // Each corner by the two edges that it hangs on.
    let mut sides: Vec<(u32, usize, bool)> = Vec::with_capacity(2 * corners.len());
    for (i, corner) in corners.iter().enumerate() {
        sides.extend([(corner.next, i, true), (corner.previous, i, false)]);
    }
    sides.sort_unstable();
    let mut neighbours: Vec<Vec<(usize, bool)>> = corners.iter().map(|_| Vec::new()).collect();
    for edge in sides.chunk_by(|a, b| a.0 == b.0) {
        match edge {
            [_] => {}
            [a, b] => {
                neighbours[a.1].push((b.1, a.2 != b.2));
                neighbours[b.1].push((a.1, a.2 != b.2));
            }
            _ => return None,
        }
    }
    let mut signs: Vec<Option<bool>> = vec![None; corners.len()];
    let mut next = vec![0];
    *signs.first_mut()? = Some(true);
    while let Some(at) = next.pop() {
        let own = signs[at] == Some(true);
        for (other, agree) in &neighbours[at] {
            if signs[*other].is_none() {
                signs[*other] = Some(own == *agree);
                next.push(*other);
            }
        }
    }
    signs.into_iter().collect()
}

/// The edges of one triangle: the triangle, and the corner where the edge begins.
fn rim(faces: &[[u32; 3]]) -> Vec<(usize, usize)> {
    let mut edges: Vec<([u32; 2], usize, usize)> = Vec::with_capacity(3 * faces.len());
    for (t, face) in faces.iter().enumerate() {
        edges.extend((0..3).map(|corner| {
            let (a, b) = (face[corner], face[(corner + 1) % 3]);
            ([a.min(b), a.max(b)], t, corner)
        }));
    }
    edges.sort_unstable();
    edges.chunk_by(|a, b| a.0 == b.0).filter(|same| same.len() == 1).map(|same| (same[0].1, same[0].2)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{diagnose, plate, records};

    /// A strip of quadrangles around the axis, with so many half twists.
    fn band(twists: u32) -> Vec<Corners> {
        const N: u32 = 24;
        let at = |i: u32, side: f64| -> [f32; 3] {
            let turn = std::f64::consts::TAU * f64::from(i) / f64::from(N);
            let (lean, across) = (turn * f64::from(twists) / 2.0, side);
            let r = 10.0 + across * lean.cos();
            [r * turn.cos(), r * turn.sin(), across * lean.sin()].map(|x| x as f32)
        };
        let ends = |i: u32| {
            let flips = i == N && twists % 2 == 1;
            let side = if flips { -1.0 } else { 1.0 };
            let i = i % N;
            [at(i, side), at(i, -side)]
        };
        (0..N)
            .flat_map(|i| {
                let ([a, b], [c, d]) = (ends(i), ends(i + 1));
                [[a, b, d], [a, d, c]]
            })
            .collect()
    }

    #[test]
    fn a_plate_becomes_a_slab_of_its_thickness() {
        let wall = thicken(&plate(4, |_, _| true), 0.5).unwrap();
        let d = diagnose(&records(&wall)).defects;
        assert!((d.volume - 8.0).abs() < 1e-5 && d.boundary_edges + d.inconsistent_edges == 0, "{d:?}");
        assert_eq!((d.bodies, wall.len()), (1, 2 * 32 + 2 * 16));
    }

    #[test]
    fn one_sided_or_not_a_band_becomes_one_body_that_faces_outward() {
        for twists in [0, 1, 2, 3] {
            let d = diagnose(&records(&thicken(&band(twists), 0.25).unwrap())).defects;
            let open = d.boundary_edges + d.inconsistent_edges + d.nonmanifold_edges + d.nonmanifold_vertices;
            // Its width times its length times its thickness, about.
            assert!(open == 0 && (d.volume - 31.4).abs() < 3.0 && d.bodies == 1, "{twists}: {d:?}");
        }
    }

    #[test]
    fn triangles_that_disagree_become_the_same_wall() {
        let mut sheet = plate(3, |_, _| true);
        let wall = thicken(&sheet, 0.5).unwrap().len();
        sheet[4].swap(0, 1);
        sheet[7].swap(0, 1);
        let turned = thicken(&sheet, 0.5).unwrap();
        let d = diagnose(&records(&turned)).defects;
        assert!(turned.len() == wall && d.inconsistent_edges == 0 && (d.volume - 4.5).abs() < 1e-5, "{d:?}");
    }

    #[test]
    fn surfaces_that_hang_together_in_an_edge_or_a_vertex_are_no_sheet() {
        let fin = [[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]], [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]]];
        assert_eq!(thicken(&[plate(1, |_, _| true), fin.to_vec()].concat(), 0.1), None);
        let pinched = [[[0.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [-1.0, -1.0, 0.0]]];
        assert_eq!(thicken(&[plate(1, |_, _| true), pinched.to_vec()].concat(), 0.1), None);
    }
}
