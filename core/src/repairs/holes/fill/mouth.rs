//! How much may be missing behind a mouth that was closed flat.
//!
//! Straight walls end at a mouth because they do so: a box without its top. A surface that is bent on its way to the mouth goes on bending, and
//! what it would enclose then is taken for a part of a ball: with the bend of the surface, from the slope that it has at the rim.

use std::collections::HashMap;

use glam::DVec3;

use crate::geometry::exact::at;
use crate::repairs::holes::fair::Gathered;

/// Cosine of the angle at which a wall ends and another face begins.
const EDGE: f64 = 0.7;
/// The bend is averaged over each of so many parts of the rim: bumps cancel, and sides that bend different ways do not.
const PARTS: usize = 8;
/// A surface bends towards closing if its radius is below so many of the mouth's.
const CLOSING: f64 = 2.0;
/// Of a half of a ball, its volume as a share of that of the cylinder around it: less than 2/3, for flatter parts.
const BALL: f64 = 0.6;

/// About the volume behind a mouth of this area; 0 if the surface runs straight to it. O(surroundings).
pub(super) fn beyond(region: &Gathered, area: f64) -> f64 {
    let place = |v: u32| at(&region.positions[v as usize]);
    let normal_of = |t: &[u32; 3]| (place(t[1]) - place(t[0])).cross(place(t[2]) - place(t[0]));
    let rim = region.patch.iter().flatten().max().map_or(0, |last| last + 1);
    let axis = region.patch.iter().map(normal_of).sum::<DVec3>().normalize_or_zero();
    let centre = (0..rim).map(place).sum::<DVec3>() / f64::from(rim.max(1));
    let (bend, slope) = (bend(region, rim, axis, centre), slope(region, rim, axis));
    let radius = (area / std::f64::consts::PI).sqrt();
    if bend * radius * CLOSING < 1.0 {
        return 0.0;
    }
    BALL * area * (1.0 - slope) / bend
}

/// The sine of the angle by which the surface along the rim leans to the mouth: 1 continues the patch, 0 stands upright on it, −1 lies back.
fn slope(region: &Gathered, rim: u32, axis: DVec3) -> f64 {
    let place = |v: u32| at(&region.positions[v as usize]);
    let (mut sum, mut length) = (0.0, 0.0);
    for t in &region.around {
        for k in 0..3 {
            let [a, b, c] = [t[k], t[(k + 1) % 3], t[(k + 2) % 3]];
            if a < rim && b < rim && c >= rim {
                let normal = (place(b) - place(a)).cross(place(c) - place(a)).normalize_or_zero();
                let along = place(a).distance(place(b));
                sum += normal.dot(axis) * along;
                length += along;
            }
        }
    }
    if length > 0.0 { sum / length } else { 1.0 }
}

/// How much the surface bends on its way from the rim, as the inverse of a radius: from the triangles at the rim to those behind them.
fn bend(region: &Gathered, rim: u32, axis: DVec3, centre: DVec3) -> f64 {
    let place = |v: u32| at(&region.positions[v as usize]);
    let normal_of = |t: &[u32; 3]| (place(t[1]) - place(t[0])).cross(place(t[2]) - place(t[0]));
    let is_behind = |t: &&[u32; 3]| t.iter().all(|v| *v >= rim);
    let mut behind: HashMap<[u32; 2], usize> = HashMap::new();
    for (i, t) in region.around.iter().enumerate().filter(|(_, t)| is_behind(t)) {
        (0..3).for_each(|k| {
            behind.insert([t[(k + 1) % 3], t[k]], i);
        });
    }
    let u = axis.any_orthonormal_vector();
    let w = axis.cross(u);
    let mut parts = [(0.0, 0.0); PARTS];
    for t in region.around.iter().filter(|t| t.iter().filter(|v| **v < rim).count() == 1) {
        let k = (0..3).find(|k| t[*k] < rim).unwrap_or(0);
        let edge = [t[(k + 1) % 3], t[(k + 2) % 3]];
        let Some(other) = behind.get(&edge).map(|i| &region.around[*i]) else { continue };
        let (here, there) = (normal_of(t), normal_of(other));
        let length = place(edge[0]).distance(place(edge[1]));
        let (m, n) = (here.normalize_or_zero(), there.normalize_or_zero());
        let apex = other.iter().find(|v| !edge.contains(v)).map_or(DVec3::ZERO, |v| place(*v) - place(edge[0]));
        let turn = if m.dot(n) < EDGE { 0.0 } else { (m - n).length() * -apex.dot(m).signum() };
        let out = (place(edge[0]) + place(edge[1])) * 0.5 - centre;
        let part = &mut parts[part(out.dot(u), out.dot(w))];
        part.0 += turn * length;
        // Half of the heights over the edge, times its length.
        part.1 += 0.5 * (here.length() + there.length());
    }
    let (turn, way) = parts.iter().fold((0.0, 0.0), |(turn, way), part| (turn + part.0.abs(), way + part.1));
    if way > 0.0 { turn / way } else { 0.0 }
}

/// The eighth of a turn that a direction is in.
fn part(x: f64, y: f64) -> usize {
    usize::from(x < 0.0) * 4 + usize::from(y < 0.0) * 2 + usize::from(x.abs() < y.abs())
}
