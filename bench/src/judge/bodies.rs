//! Which bodies of a mesh are still in another one, whatever became of their surfaces.
//!
//! A body is a sealed component (every edge is used equally often in each direction) of more than a millionth of the volume of all.
//! Lines through its largest triangles give points that lie deep inside of it, where the winding number of all sealed components is
//! not zero: there is material, and a cavity (a component inside out within another, or within the box of an open one) has no such point. They are taken where nothing
//! else is, as far as there are such places. A body is lost if none of its points has a winding number other than zero in the other
//! mesh: exact where that is sealed, generalised and rounded else.

use super::judgement::Triangle;
use super::shells::{Line, Shells};
use super::topology::volume_about;

/// The bodies of a mesh.
pub struct Bodies {
    /// Points of each.
    points: Vec<Vec<Inner>>,
    may_be_solid: bool,
}

/// A point inside.
#[derive(Clone, Copy, Debug)]
struct Inner {
    line: Line,
    depth: f64,
}

/// How many bodies were kept, lost, or lost in part.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "compare", derive(serde::Serialize, serde::Deserialize))]
pub struct Found {
    /// Bodies that were looked for.
    pub of: u64,
    /// None of whose points is inside any more.
    pub lost: u64,
    /// Of whose points some are inside, and some are not.
    pub part: u64,
}

/// A body is more than this share of all volume.
const SHARE: f64 = 1e-6;
/// A surface encloses something if it is more than this share of the cube of its box's diagonal.
const FLAT: f64 = 1e-7;
/// So many bodies are looked for, the largest first.
const MOST: usize = 1000;
/// Lines that are tried for a body.
const LINES: usize = 24;
/// Points that are looked for.
const POINTS: usize = 5;

impl Bodies {
    /// Of finite triangles. O(n log n) time.
    pub fn of(triangles: &[Triangle]) -> Self {
        let shells = Shells::new(triangles);
        let parts = &shells.components;
        let volume = |c: usize| if parts.sealed[c] { parts.volumes[c].abs() } else { 0.0 };
        let all: f64 = (0..parts.volumes.len()).map(volume).sum();
        let boxes = boxes(&shells);
        // What is inside out and lies in the box of an open component is a cavity of it once that is closed, for all that anybody knows.
        let within = |a: usize, b: usize| (0..3).all(|k| boxes[b].0[k] <= boxes[a].0[k] && boxes[a].1[k] <= boxes[b].1[k]);
        let open: Vec<usize> = (0..parts.volumes.len()).filter(|&c| !parts.sealed[c]).collect();
        let may_be_cavity = |c: usize| parts.volumes[c] < 0.0 && open.iter().any(|&o| within(c, o));
        let mut bodies: Vec<_> = (0..parts.volumes.len()).filter(|&c| volume(c) > SHARE * all && !may_be_cavity(c)).collect();
        bodies.sort_by(|&a, &b| volume(b).total_cmp(&volume(a)).then(a.cmp(&b)));
        bodies.truncate(MOST);
        let largest = shells.largest_triangles(LINES);
        let points = bodies.into_iter().map(|body| inner_points(&shells, body as u32, &largest[body]));
        Self { points: points.filter(|points| !points.is_empty()).collect(), may_be_solid: encloses(&shells) }
    }

    /// Does any component enclose a volume, as it is, or when its rims are closed?
    pub fn may_be_solid(&self) -> bool {
        self.may_be_solid
    }

    /// Looks for all bodies in another mesh. O(log n) a point, O(n) where the mesh is not sealed.
    pub fn find_in(&self, triangles: &[Triangle]) -> Found {
        let shells = Shells::new(triangles);
        let sealed = shells.all_sealed();
        let is_inside = |point: &Inner| {
            let exact = if sealed { shells.winding(point.line, point.depth, |_| true) } else { None };
            let rounded = || {
                let mut at = point.line.at.map(f64::from);
                at[point.line.axis] = point.depth;
                shells.generalised_winding(at).round() != 0.0
            };
            exact.map_or_else(rounded, |winding| winding != 0)
        };
        let mut found = Found { of: self.points.len() as u64, ..Found::default() };
        for points in &self.points {
            match points.iter().filter(|point| is_inside(point)).count() {
                0 => found.lost += 1,
                inside if inside < points.len() => found.part += 1,
                _ => {}
            }
        }
        found
    }
}

/// Points of a component where it and all together have material: first where it is alone, then the deepest.
fn inner_points(shells: &Shells, body: u32, triangles: &[u32]) -> Vec<Inner> {
    let mut found = Vec::new();
    for &triangle in triangles {
        let line = shells.line_through(triangle);
        let Some(mut crossings) = shells.crossings(line) else { continue };
        crossings.sort_by(|a, b| b.depth.total_cmp(&a.depth));
        let (mut own, mut all) = (0, 0);
        let mut best: Option<(bool, f64, f64)> = None;
        for pair in crossings.windows(2) {
            own += if pair[0].component == body { pair[0].leaves } else { 0 };
            all += pair[0].leaves;
            let depth = (pair[0].depth + pair[1].depth) / 2.0;
            let here = (own == all, pair[0].depth - pair[1].depth, depth);
            if own != 0 && all != 0 && best.is_none_or(|best| (here.0, here.1) > (best.0, best.1)) {
                best = Some(here);
            }
        }
        found.extend(best.filter(|best| best.1 > 0.0).map(|(alone, length, depth)| (alone, length, Inner { line, depth })));
    }
    found.sort_by(|a, b| b.0.cmp(&a.0).then(b.1.total_cmp(&a.1)));
    found.into_iter().take(POINTS).map(|(_, _, inner)| inner).collect()
}

/// The box of each component.
fn boxes(shells: &Shells) -> Vec<([f64; 3], [f64; 3])> {
    let parts = &shells.components;
    let mut boxes = vec![([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]); parts.volumes.len()];
    for (triangle, &component) in parts.triangles.iter().zip(&parts.of) {
        let (lo, hi) = &mut boxes[component as usize];
        for (k, x) in triangle.iter().flat_map(|corner| corner.map(f64::from).into_iter().enumerate()) {
            lo[k] = lo[k].min(x);
            hi[k] = hi[k].max(x);
        }
    }
    boxes
}

/// Does any component enclose something? An open one is taken as if all its rims were closed by cones to one point near them, which
/// have no volume about that point.
fn encloses(shells: &Shells) -> bool {
    let parts = &shells.components;
    let count = parts.volumes.len();
    let boxes = boxes(shells);
    let mut rims = vec![([0.0; 3], 0.0); count];
    for (index, triangle) in parts.triangles.iter().enumerate() {
        let component = parts.of[index] as usize;
        for corner in triangle {
            for (k, x) in corner.map(f64::from).into_iter().enumerate() {
                rims[component].0[k] += if parts.leaky[index] { x } else { 0.0 };
            }
            rims[component].1 += f64::from(u8::from(parts.leaky[index]));
        }
    }
    let mut volumes = vec![0.0; count];
    for (index, &triangle) in parts.triangles.iter().enumerate() {
        let component = parts.of[index] as usize;
        let (sum, corners) = rims[component];
        let centre = if corners > 0.0 { sum.map(|x| x / corners) } else { boxes[component].0 };
        volumes[component] += volume_about(centre, triangle);
    }
    (0..count).any(|c| {
        let diagonal = (0..3).map(|k| (boxes[c].1[k] - boxes[c].0[k]).powi(2)).sum::<f64>().sqrt();
        volumes[c].abs() > FLAT * diagonal.powi(3)
    })
}

#[cfg(test)]
mod tests {
    use super::super::shells::tests::{cuboid, inside_out};
    use super::*;

    fn found(of: u64, lost: u64, part: u64) -> Found {
        Found { of, lost, part }
    }

    #[test]
    fn a_body_that_is_gone_is_lost_and_a_cavity_is_none() {
        let (one, two, tiny) = (cuboid([0.0; 3], [4.0; 3]), cuboid([5.0; 3], [6.0; 3]), cuboid([8.0; 3], [8.01; 3]));
        let cavity = inside_out(cuboid([1.0; 3], [2.0; 3]));
        let bodies = Bodies::of(&[one.clone(), two.clone(), cavity.clone(), tiny].concat());
        assert_eq!(bodies.find_in(&[one.clone(), two.clone(), cavity].concat()), found(2, 0, 0));
        assert_eq!(bodies.find_in(&one), found(2, 1, 0));
        assert_eq!(bodies.find_in(&[]), found(2, 2, 0));
        // Inside out it is still there; open, too.
        assert_eq!(bodies.find_in(&[one.clone(), inside_out(two.clone())].concat()), found(2, 0, 0));
        assert_eq!(bodies.find_in(&[&one[..], &two[1..]].concat()), found(2, 0, 0));
    }

    #[test]
    fn of_bodies_in_each_other_each_is_looked_for_where_it_is_alone() {
        // A bar through a slab: of the slab alone, the bar's ends are missing.
        let (slab, bar) = (cuboid([0.0; 3], [9.0, 9.0, 1.0]), cuboid([4.0, 4.0, -3.0], [5.0, 5.0, 4.0]));
        let bodies = Bodies::of(&[slab.clone(), bar].concat());
        assert_eq!(bodies.find_in(&slab), found(2, 1, 0));
        // Cut off above the slab, part of it is missing.
        let short = cuboid([4.0, 4.0, -3.0], [5.0, 5.0, 0.5]);
        assert_eq!(bodies.find_in(&[slab, short].concat()), found(2, 0, 1));
    }

    #[test]
    fn a_body_that_is_inside_out_alone_is_a_body() {
        let cube = inside_out(cuboid([0.0; 3], [1.0; 3]));
        assert_eq!(Bodies::of(&cube).find_in(&inside_out(cube.clone())), found(1, 0, 0));
    }

    #[test]
    fn a_flat_sheet_encloses_nothing_and_a_box_without_a_lid_does() {
        let cube = cuboid([0.0; 3], [1.0; 3]);
        assert!(Bodies::of(&cube).may_be_solid() && Bodies::of(&cube[2..]).may_be_solid());
        assert!(!Bodies::of(&cube[..2]).may_be_solid() && !Bodies::of(&[]).may_be_solid());
        assert_eq!(Bodies::of(&cube[2..]).find_in(&cube), found(0, 0, 0));
    }
}
