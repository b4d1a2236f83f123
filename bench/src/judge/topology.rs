//! Vertices, edges, fans and components by sorting.

use super::exact::collinear;
use super::judgement::Judgement;
use super::stl::{Corner, Soup, number};
use crate::counts::Counts;

/// One use of an edge by a triangle: the edge's two vertices, the smaller in the upper half; then the corner where the triangle
/// begins it, and whether that corner is the smaller vertex, in the lowest bit.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Use {
    edge: (u32, u32),
    corner: u32,
    forward: bool,
}

/// The corner after `corner` in its triangle.
fn next(corner: u32) -> u32 {
    corner - corner % 3 + (corner % 3 + 1) % 3
}

/// Disjoint sets with path halving; the smallest member names the set.
struct Sets(Vec<u32>);

impl Sets {
    fn new(count: usize) -> Self {
        Self((0..count as u32).collect())
    }

    fn of(&mut self, mut member: u32) -> u32 {
        while self.0[member as usize] != member {
            let above = self.0[self.0[member as usize] as usize];
            self.0[member as usize] = above;
            member = above;
        }
        member
    }

    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.of(a), self.of(b));
        let (low, high) = (a.min(b), a.max(b));
        self.0[high as usize] = low;
    }
}

/// A mesh whose corners know their vertex.
struct Mesh {
    /// Positions, by vertex.
    positions: Vec<[f32; 3]>,
    /// Three vertices for each triangle; no triangle has a vertex twice.
    faces: Vec<[u32; 3]>,
}

/// Triangles by the components that they belong to. Triangles with a repeated vertex are left out.
pub(super) struct Components {
    pub(super) triangles: Vec<[[f32; 3]; 3]>,
    /// By triangle, the number of its component; numbers follow each other in the order of their first triangles.
    pub(super) of: Vec<u32>,
    /// By triangle: one of its edges is not used equally often in each direction.
    pub(super) leaky: Vec<bool>,
    /// By component: none of its triangles is leaky.
    pub(super) sealed: Vec<bool>,
    /// By component, the signed volume about the centre of the whole box.
    pub(super) volumes: Vec<f64>,
}

pub(super) fn judge(soup: Soup) -> Judgement {
    examine(soup).0
}

/// The judgement, and what it was made from.
pub(super) fn examine(soup: Soup) -> (Judgement, Components) {
    let nonfinite = soup.nonfinite;
    let triangles = soup.corners.len() as u64 / 3;
    let mesh = weld(soup);
    let mut counts = Counts { triangles, degenerate_index: triangles - mesh.faces.len() as u64, ..Counts::default() };
    counts.degenerate_area = mesh.faces.iter().filter(|face| collinear(mesh.corners(face))).count() as u64;
    counts.duplicates = duplicates(&mesh.faces);
    let uses = edge_uses(&mesh.faces);
    let (mut components, leaky) = edges(&mesh, &uses, &mut counts);
    counts.nonmanifold_vertices = fans(&mesh, &uses);
    let components = volumes(&mesh, &mut components, leaky);
    let volume = components.volumes.iter().sum();
    let of_sign = |is: fn(f64) -> bool| {
        components.sealed.iter().zip(&components.volumes).filter(|&(&sealed, &volume)| sealed && is(volume)).count() as u64
    };
    let (positive_bodies, negative_bodies) = (of_sign(|volume| volume > 0.0), of_sign(|volume| volume < 0.0));
    let vertices = mesh.positions.len() as u64;
    (Judgement { counts, nonfinite, vertices, volume, positive_bodies, negative_bodies }, components)
}

impl Mesh {
    fn corners(&self, face: &[u32; 3]) -> [[f32; 3]; 3] {
        face.map(|vertex| self.positions[vertex as usize])
    }
}

/// Gives equal positions one number, in the order of positions, and drops triangles with a repeated vertex.
fn weld(soup: Soup) -> Mesh {
    let mut corners = soup.corners;
    corners.sort_unstable();
    let mut faces = vec![[0; 3]; corners.len() / 3];
    let mut positions = Vec::new();
    for run in corners.chunk_by(|a, b| a.position == b.position) {
        for &Corner { number, .. } in run {
            faces[number as usize / 3][number as usize % 3] = positions.len() as u32;
        }
        positions.extend(run.first().map(|corner| corner.position.map(number)));
    }
    faces.retain(|[a, b, c]| a != b && b != c && c != a);
    Mesh { positions, faces }
}

/// Triangles beyond the first with the same three vertices.
fn duplicates(faces: &[[u32; 3]]) -> u64 {
    let mut sets = faces.to_vec();
    sets.iter_mut().for_each(|face| face.sort_unstable());
    sets.sort_unstable();
    sets.windows(2).filter(|pair| pair[0] == pair[1]).count() as u64
}

/// All uses of edges, sorted, so that the uses of an edge stand together.
fn edge_uses(faces: &[[u32; 3]]) -> Vec<Use> {
    let mut uses = Vec::with_capacity(3 * faces.len());
    for (face, index) in faces.iter().zip(0u32..) {
        for corner in 0..3 {
            let (from, to) = (face[corner], face[(corner + 1) % 3]);
            uses.push(Use { edge: (from.min(to), from.max(to)), corner: 3 * index + corner as u32, forward: from < to });
        }
    }
    uses.sort_unstable();
    uses
}

/// Counts edges, loops and components; returns the components and, by triangle, whether it has an edge that is not balanced.
fn edges(mesh: &Mesh, uses: &[Use], counts: &mut Counts) -> (Sets, Vec<bool>) {
    let mut components = Sets::new(mesh.faces.len());
    let mut leaky = vec![false; mesh.faces.len()];
    let mut rims = Sets::new(mesh.positions.len());
    let mut on_rim = vec![false; mesh.positions.len()];
    for run in uses.chunk_by(|a, b| a.edge == b.edge) {
        let forward = run.iter().filter(|r| r.forward).count();
        if 2 * forward != run.len() {
            counts.unbalanced_edges += 1;
            run.iter().for_each(|r| leaky[r.corner as usize / 3] = true);
        }
        match run.len() {
            1 => {
                counts.boundary_edges += 1;
                let (a, b) = run[0].edge;
                rims.join(a, b);
                on_rim[a as usize] = true;
                on_rim[b as usize] = true;
            }
            2 => counts.inconsistent_edges += u64::from(forward != 1),
            _ => counts.nonmanifold_edges += 1,
        }
        for pair in run.windows(2) {
            components.join(pair[0].corner / 3, pair[1].corner / 3);
        }
    }
    let roots = |sets: &mut Sets, wanted: &dyn Fn(usize) -> bool| {
        (0..sets.0.len()).filter(|&i| sets.0[i] == i as u32 && wanted(i)).count() as u64
    };
    counts.boundary_loops = roots(&mut rims, &|vertex| on_rim[vertex]);
    counts.components = roots(&mut components, &|_| true);
    (components, leaky)
}

/// Counts vertices on an edge of more than two triangles, or whose corners are not all joined through edges of two.
fn fans(mesh: &Mesh, uses: &[Use]) -> u64 {
    let corners = 3 * mesh.faces.len();
    let vertex = |corner: u32| mesh.faces[corner as usize / 3][corner as usize % 3] as usize;
    let mut sets = Sets::new(corners);
    let mut nonmanifold = vec![false; mesh.positions.len()];
    for run in uses.chunk_by(|a, b| a.edge == b.edge) {
        match run {
            [_] => {}
            [first, second] => {
                // Where both run the same way (an inconsistent edge) their beginnings meet, else beginning and end.
                let (begin, end) = (second.corner, next(second.corner));
                let (at_begin, at_end) = if first.forward == second.forward { (begin, end) } else { (end, begin) };
                sets.join(first.corner, at_begin);
                sets.join(next(first.corner), at_end);
            }
            [first, ..] => {
                nonmanifold[first.edge.0 as usize] = true;
                nonmanifold[first.edge.1 as usize] = true;
            }
            [] => {}
        }
    }
    let mut seen = vec![false; mesh.positions.len()];
    for corner in 0..corners as u32 {
        if sets.0[corner as usize] == corner {
            let vertex = vertex(corner);
            nonmanifold[vertex] |= seen[vertex];
            seen[vertex] = true;
        }
    }
    nonmanifold.into_iter().filter(|&bad| bad).count() as u64
}

/// Gives every component a number, and finds its volume and whether it is sealed.
fn volumes(mesh: &Mesh, sets: &mut Sets, leaky: Vec<bool>) -> Components {
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for position in &mesh.positions {
        for axis in 0..3 {
            low[axis] = low[axis].min(f64::from(position[axis]));
            high[axis] = high[axis].max(f64::from(position[axis]));
        }
    }
    let centre: [f64; 3] = std::array::from_fn(|axis| (low[axis] + high[axis]) / 2.0);
    let triangles: Vec<_> = mesh.faces.iter().map(|face| mesh.corners(face)).collect();
    let mut found = Components { triangles, of: Vec::with_capacity(leaky.len()), leaky, sealed: Vec::new(), volumes: Vec::new() };
    for (index, triangle) in found.triangles.iter().enumerate() {
        // The smallest triangle names the set, so that it is met first.
        let root = sets.of(index as u32) as usize;
        let component = if root == index { found.volumes.len() as u32 } else { found.of[root] };
        if root == index {
            found.volumes.push(0.0);
            found.sealed.push(true);
        }
        found.of.push(component);
        found.volumes[component as usize] += volume_about(centre, *triangle);
        found.sealed[component as usize] &= !found.leaky[index];
    }
    found
}

/// Signed volume of the tetrahedron over a triangle.
pub(super) fn volume_about(centre: [f64; 3], triangle: [[f32; 3]; 3]) -> f64 {
    let [a, b, c] = triangle.map(|p| std::array::from_fn::<_, 3, _>(|axis| f64::from(p[axis]) - centre[axis]));
    (a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0])) / 6.0
}

#[cfg(test)]
mod tests {
    use super::*;

    type Face = [usize; 3];

    /// Judges triangles over numbered positions.
    fn judged(positions: &[[f32; 3]], faces: &[Face]) -> Judgement {
        let mut soup = Soup::default();
        faces.iter().for_each(|face| soup.push(face.map(|vertex| positions[vertex])));
        judge(soup)
    }

    const CUBE: [[f32; 3]; 8] = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [1.0, 1.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, 1.0],
        [1.0, 0.0, 1.0],
        [1.0, 1.0, 1.0],
        [0.0, 1.0, 1.0],
    ];
    /// The unit cube, outwards; faces 0 and 1 are its bottom.
    const CUBE_FACES: [Face; 12] = [
        [0, 2, 1],
        [0, 3, 2],
        [4, 5, 6],
        [4, 6, 7],
        [0, 1, 5],
        [0, 5, 4],
        [1, 2, 6],
        [1, 6, 5],
        [2, 3, 7],
        [2, 7, 6],
        [3, 0, 4],
        [3, 4, 7],
    ];

    #[test]
    fn a_cube_is_sound() {
        let found = judged(&CUBE, &CUBE_FACES);
        assert_eq!(found.counts, Counts { triangles: 12, components: 1, ..Counts::default() });
        assert!(found.sound() && (found.volume - 1.0).abs() < 1e-12);
        assert_eq!((found.vertices, found.positive_bodies, found.negative_bodies), (8, 1, 0));
    }

    #[test]
    fn nothing_is_not_sound() {
        let found = judged(&[], &[]);
        assert_eq!(found.counts, Counts::default());
        assert!(!found.sound());
    }

    #[test]
    fn a_cube_without_its_bottom_has_one_loop_of_four_edges() {
        let found = judged(&CUBE, &CUBE_FACES[2..]);
        let expected = Counts {
            triangles: 10,
            boundary_edges: 4,
            unbalanced_edges: 4,
            boundary_loops: 1,
            components: 1,
            ..Counts::default()
        };
        assert_eq!(found.counts, expected);
        assert!(!found.sound() && found.positive_bodies == 0);
    }

    #[test]
    fn a_flipped_triangle_disagrees_along_its_three_edges() {
        let mut faces = CUBE_FACES;
        faces[4].swap(0, 1);
        let found = judged(&CUBE, &faces);
        let expected = Counts { triangles: 12, inconsistent_edges: 3, unbalanced_edges: 3, components: 1, ..Counts::default() };
        assert_eq!(found.counts, expected);
        assert!(found.counts.closed() && found.counts.manifold() && !found.counts.oriented());
    }

    #[test]
    fn inside_out_is_consistent_but_negative() {
        let found = judged(&CUBE, &CUBE_FACES.map(|[a, b, c]| [a, c, b]));
        assert!(found.sound());
        assert_eq!((found.volume.round(), found.positive_bodies, found.negative_bodies), (-1.0, 0, 1));
    }

    #[test]
    fn a_second_copy_makes_its_edges_nonmanifold() {
        let mut faces = CUBE_FACES.to_vec();
        faces.push([2, 1, 0]);
        let expected = Counts {
            triangles: 13,
            duplicates: 1,
            nonmanifold_edges: 3,
            nonmanifold_vertices: 3,
            unbalanced_edges: 3,
            components: 1,
            ..Counts::default()
        };
        assert_eq!(judged(&CUBE, &faces).counts, expected);
    }

    #[test]
    fn two_tetrahedra_that_share_a_vertex_make_it_nonmanifold() {
        let positions: Vec<[f32; 3]> = vec![
            [0.0; 3],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.0, 0.0, 1.0],
            [-1.0, 0.0, 0.0],
            [0.0, -1.0, 0.0],
            [0.0, 0.0, -1.0],
        ];
        let tetrahedron = |[a, b, c, d]: [usize; 4]| [[a, c, b], [a, b, d], [b, c, d], [a, d, c]];
        let faces = [tetrahedron([0, 1, 2, 3]), tetrahedron([0, 5, 4, 6])].concat();
        let expected = Counts { triangles: 8, nonmanifold_vertices: 1, components: 2, ..Counts::default() };
        assert_eq!(judged(&positions, &faces).counts, expected);
    }

    #[test]
    fn minus_zero_is_zero() {
        let mut positions = CUBE.to_vec();
        positions.push([-0.0, -0.0, -0.0]);
        let mut faces = CUBE_FACES;
        faces[0] = [8, 2, 1];
        assert!(judged(&positions, &faces).sound());
    }

    #[test]
    fn triangles_with_a_coordinate_that_is_no_number_are_only_counted() {
        let mut positions = CUBE.to_vec();
        positions.extend([[f32::NAN, 0.0, 0.0], [0.0, f32::INFINITY, 0.0]]);
        let found = judged(&positions, &[&CUBE_FACES[..], &[[0, 1, 8], [9, 2, 3]]].concat());
        assert!(found.sound());
        assert_eq!((found.nonfinite, found.counts.triangles), (2, 12));
    }

    #[test]
    fn degenerates_of_both_kinds_are_told_apart() {
        let positions = [[0.0, 0.0, 0.0], [1.0, 1.0, 1.0], [2.0, 2.0, 2.0]];
        let found = judged(&positions, &[[0, 1, 2], [0, 0, 1], [2, 2, 2]]);
        let expected = Counts {
            triangles: 3,
            degenerate_index: 2,
            degenerate_area: 1,
            boundary_edges: 3,
            boundary_loops: 1,
            unbalanced_edges: 3,
            components: 1,
            ..Counts::default()
        };
        assert_eq!(found.counts, expected);
    }

    #[test]
    fn loops_that_touch_in_a_vertex_are_one() {
        // Two triangles that share vertex 0 only.
        let positions = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [-1.0, -1.0, 0.0]];
        let found = judged(&positions, &[[0, 1, 2], [0, 3, 4]]);
        assert_eq!((found.counts.boundary_edges, found.counts.boundary_loops, found.counts.components), (6, 1, 2));
        assert_eq!(found.counts.nonmanifold_vertices, 1);
    }
}
