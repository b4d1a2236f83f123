//! Components of a mesh as surfaces around something: where a line along an axis passes through them, and how often they wind around
//! a point.

use super::boxes::Tree;
use super::exact::turn;
use super::judgement::Triangle;
use super::stl::Soup;
use super::topology::{Components, examine, volume_about};

/// Components, with a tree over their triangles.
pub(super) struct Shells {
    pub(super) components: Components,
    tree: Tree,
}

/// Where a line along an axis passes through a triangle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Crossing {
    pub(super) component: u32,
    /// Coordinate along the axis.
    pub(super) depth: f64,
    /// 1: the triangle faces along the axis, so that whoever goes that way leaves; −1: the other way.
    pub(super) leaves: i32,
}

/// A line along an axis, through a point that lies in a triangle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Line {
    pub(super) axis: usize,
    pub(super) at: [f32; 3],
}

/// Weights of a triangle's corners that no symmetry of a model hits an edge with.
const WEIGHTS: [f64; 3] = [0.267_949_192, 0.341_081_377, 0.390_969_431];

impl Line {
    /// Through a triangle, along the axis that it faces most.
    pub(super) fn through(triangle: Triangle) -> Self {
        let normal = normal(triangle).map(f64::abs);
        let axis = (0..3).max_by(|&a, &b| normal[a].total_cmp(&normal[b])).unwrap_or(0);
        let at = std::array::from_fn(|k| (0..3).map(|c| WEIGHTS[c] * f64::from(triangle[c][k])).sum::<f64>() as f32);
        Self { axis, at }
    }
}

impl Shells {
    pub(super) fn new(triangles: &[Triangle]) -> Self {
        Self::from(examine(Soup::of(triangles)).1)
    }

    /// Where a line passes through sealed components, in no order. `None` where it meets an edge or a corner of them, so that nothing
    /// is certain.
    pub(super) fn crossings(&self, line: Line) -> Option<Vec<Crossing>> {
        let (u, v) = ((line.axis + 1) % 3, (line.axis + 2) % 3);
        let onto = |p: [f32; 3]| [p[u], p[v]];
        let (mut found, mut certain) = (Vec::new(), true);
        self.tree.on_line(line.axis, line.at, &mut |index| {
            let component = self.components.of[index as usize];
            if !self.components.sealed[component as usize] {
                return;
            }
            let triangle = self.components.triangles[index as usize];
            let signs: [i8; 3] = std::array::from_fn(|k| turn([triangle[k], triangle[(k + 1) % 3], line.at].map(onto)));
            let (left, right) = (signs.contains(&1), signs.contains(&-1));
            if left && right {
                return;
            }
            certain &= !signs.contains(&0);
            let (depth, leaves) = (depth(triangle, line), if left { 1 } else { -1 });
            found.push(Crossing { component, depth, leaves });
        });
        certain.then_some(found)
    }

    /// How often the sealed components that are `wanted` wind around the point of the line at `depth`.
    pub(super) fn winding(&self, line: Line, depth: f64, wanted: impl Fn(u32) -> bool) -> Option<i32> {
        let beyond = self.crossings(line)?.into_iter().filter(|crossing| crossing.depth > depth && wanted(crossing.component));
        Some(beyond.map(|crossing| crossing.leaves).sum())
    }

    /// The generalised winding number of all triangles (the solid angle that they are seen under, signed, over that of a sphere),
    /// which also means something where a surface is open. O(n).
    pub(super) fn generalised_winding(&self, point: [f64; 3]) -> f64 {
        let angle = |triangle: &Triangle| {
            let [a, b, c] = triangle.map(|p| std::array::from_fn::<_, 3, _>(|k| f64::from(p[k]) - point[k]));
            let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
            let [la, lb, lc] = [a, b, c].map(|p| dot(p, p).sqrt());
            let volume = volume_about(point, *triangle) * 6.0;
            2.0 * volume.atan2(la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb)
        };
        self.components.triangles.iter().map(angle).sum::<f64>() / (4.0 * std::f64::consts::PI)
    }

    /// All surface is sealed.
    pub(super) fn all_sealed(&self) -> bool {
        self.components.sealed.iter().all(|&sealed| sealed)
    }

    /// By component, the numbers of its largest triangles by area, at most `most` of them, the largest first.
    pub(super) fn largest_triangles(&self, most: usize) -> Vec<Vec<u32>> {
        let mut lists = vec![Vec::new(); self.components.volumes.len()];
        for (index, &component) in self.components.of.iter().enumerate() {
            lists[component as usize].push(index as u32);
        }
        let area = |index: &u32| normal(self.components.triangles[*index as usize]).iter().map(|x| x * x).sum::<f64>();
        for list in &mut lists {
            list.sort_by(|a, b| area(b).total_cmp(&area(a)).then(a.cmp(b)));
            list.truncate(most);
        }
        lists
    }

    pub(super) fn line_through(&self, triangle: u32) -> Line {
        Line::through(self.components.triangles[triangle as usize])
    }

    /// Where a line passes through a triangle that it was put through.
    pub(super) fn depth_in(&self, triangle: u32, line: Line) -> f64 {
        depth(self.components.triangles[triangle as usize], line)
    }
}

impl From<Components> for Shells {
    fn from(components: Components) -> Self {
        let tree = Tree::new(&components.triangles);
        Self { components, tree }
    }
}

/// Coordinate along its axis where a line passes through a triangle's plane, which must not be parallel to it.
fn depth(triangle: Triangle, line: Line) -> f64 {
    let (u, v) = ((line.axis + 1) % 3, (line.axis + 2) % 3);
    let from = |p: [f32; 3]| [u, v].map(|k| f64::from(p[k]) - f64::from(line.at[k]));
    let [a, b, c] = triangle.map(from);
    let area = |a: [f64; 2], b: [f64; 2]| a[0] * b[1] - a[1] * b[0];
    let weights = [area(b, c), area(c, a), area(a, b)];
    let depths = triangle.map(|p| f64::from(p[line.axis]));
    (0..3).map(|k| weights[k] * depths[k]).sum::<f64>() / weights.iter().sum::<f64>()
}

/// Twice the area, along the normal.
fn normal([a, b, c]: Triangle) -> [f64; 3] {
    let [u, v] = [b, c].map(|p| std::array::from_fn::<_, 3, _>(|k| f64::from(p[k]) - f64::from(a[k])));
    [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
}

/// Boxes for tests of this and its neighbours.
#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A box from corner to corner, outwards.
    pub(in crate::judge) fn cuboid(lo: [f32; 3], hi: [f32; 3]) -> Vec<Triangle> {
        let corner = |n: usize| std::array::from_fn(|k| if n >> k & 1 == 1 { hi[k] } else { lo[k] });
        let sides = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        sides.iter().flat_map(|s| [[s[0], s[1], s[2]], [s[0], s[2], s[3]]]).map(|t| t.map(corner)).collect()
    }

    pub(in crate::judge) fn inside_out(triangles: Vec<Triangle>) -> Vec<Triangle> {
        triangles.into_iter().map(|[a, b, c]| [a, c, b]).collect()
    }

    #[test]
    fn both_winding_numbers_count_boxes_in_boxes() {
        let boxes = [cuboid([0.0; 3], [9.0; 3]), cuboid([1.0; 3], [6.0; 3]), inside_out(cuboid([2.0; 3], [4.0; 3]))].concat();
        let shells = Shells::new(&boxes);
        assert_eq!(shells.components.volumes.iter().map(|v| v.round()).collect::<Vec<_>>(), [729.0, 125.0, -8.0]);
        for (x, expected) in [(-1.0f32, 0), (0.5, 1), (1.5, 2), (3.0, 1), (5.0, 2), (8.0, 1), (10.0, 0)] {
            let at = [x, x + 0.1, x + 0.15];
            for axis in 0..3 {
                assert_eq!(shells.winding(Line { axis, at }, at[axis].into(), |_| true), Some(expected), "{x}");
            }
            assert!((shells.generalised_winding(at.map(f64::from)) - f64::from(expected)).abs() < 1e-9);
        }
        // Along an edge, nothing is certain.
        assert_eq!(shells.winding(Line { axis: 2, at: [0.0, 3.0, 0.0] }, 0.0, |_| true), None);
    }

    #[test]
    fn a_line_through_a_triangle_passes_through_it() {
        let shells = Shells::new(&cuboid([0.0; 3], [1.0, 2.0, 3.0]));
        for list in shells.largest_triangles(12) {
            assert_eq!(list.len(), 12);
            for triangle in list {
                let line = shells.line_through(triangle);
                let crossings = shells.crossings(line).unwrap();
                assert_eq!((crossings.len(), crossings.iter().map(|c| c.leaves).sum::<i32>()), (2, 0));
                assert!(crossings.iter().any(|c| c.depth == shells.depth_in(triangle, line)));
            }
        }
    }
}
