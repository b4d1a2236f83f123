//! The kinds of local defect, each inside one cell, with its exact effect on the counts.

use super::cell::{Cell, Mask, cross, dot, middle, minus, plus, scaled};
use super::noise::Random;
use super::surface::{CELL, Triangle};

/// A kind of local defect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// A patch, or a single triangle, left out.
    Hole,
    /// A hole with one to three loose patches inside.
    Island,
    /// Holes in a diagonal row, each touching the next in a vertex.
    HoleChain,
    /// Edges split on one side only: T-junctions.
    Crack,
    /// A slit: one bank of a line of edges moved away from the other by a seventh of an edge.
    Gap,
    /// A slit whose banks are also shifted and jittered along it.
    MisalignedGap,
    /// A patch turned inside out.
    FlippedPatch,
    /// A triangle written twice.
    Duplicate,
    /// A triangle written twice, the second time in the opposite direction.
    OppositeDuplicate,
    /// A patch written twice.
    DuplicatePatch,
    /// A triangle with two or three equal corners.
    RepeatedVertex,
    /// A T-junction closed by a triangle of no area.
    Cap,
    /// A loose triangle of no area.
    Sliver,
    /// A surplus triangle standing on an edge.
    Fin,
    /// A tiny closed body floating above the surface.
    NoiseShell,
    /// A small closed body that touches the surface in one vertex.
    TouchingBody,
}

impl Kind {
    /// The name under which a [`super::case::Truth`] counts it.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Hole => "holes",
            Self::Island => "holes with islands",
            Self::HoleChain => "chains of holes",
            Self::Crack => "cracks",
            Self::Gap => "gaps",
            Self::MisalignedGap => "misaligned gaps",
            Self::FlippedPatch => "flipped patches",
            Self::Duplicate => "duplicate triangles",
            Self::OppositeDuplicate => "opposite duplicates",
            Self::DuplicatePatch => "duplicate patches",
            Self::RepeatedVertex => "repeated vertices",
            Self::Cap => "caps",
            Self::Sliver => "slivers",
            Self::Fin => "fins",
            Self::NoiseShell => "noise shells",
            Self::TouchingBody => "touching bodies",
        }
    }

    /// Damages a sound cell.
    pub(super) fn inflict(self, cell: &mut Cell, random: &mut Random) {
        match self {
            Self::Hole => hole(cell, random),
            Self::Island => island(cell, random),
            Self::HoleChain => hole_chain(cell, random),
            Self::Crack => crack(cell, random),
            Self::Gap => slit(cell, random, 0.0),
            Self::MisalignedGap => slit(cell, random, 0.2),
            Self::FlippedPatch => flipped_patch(cell, random),
            Self::Duplicate => duplicate(cell, random, false),
            Self::OppositeDuplicate => duplicate(cell, random, true),
            Self::DuplicatePatch => duplicate_patch(cell, random),
            Self::RepeatedVertex => repeated_vertex(cell, random),
            Self::Cap => cap(cell, random),
            Self::Sliver => sliver(cell, random),
            Self::Fin => fin(cell, random),
            Self::NoiseShell => noise_shell(cell, random),
            Self::TouchingBody => touching_body(cell, random),
        }
    }
}

/// An ellipse of whole quads around the middle: one loop that never touches itself.
fn blob(random: &mut Random) -> Mask {
    let (a, b) = (1.0 + 4.5 * random.unit(), 1.0 + 4.5 * random.unit());
    let inside = |i: usize, j: usize| {
        let (y, x) = ((i as f64 - 7.5) / a, (j as f64 - 7.5) / b);
        y * y + x * x <= 1.0
    };
    std::array::from_fn(|i| std::array::from_fn(|j| inside(i, j)))
}

fn hole(cell: &mut Cell, random: &mut Random) {
    if random.within(0, 3) == 0 {
        cell.triangles[random.within(2, 13)][random.within(2, 13)][random.within(0, 1)] = None;
        cell.open_edges(3);
    } else {
        cell.cut(&blob(random));
    }
    cell.counts.boundary_loops += 1;
}

fn island(cell: &mut Cell, random: &mut Random) {
    let mut mask: Mask = std::array::from_fn(|i| std::array::from_fn(|j| (2..14).contains(&i) && (2..14).contains(&j)));
    // First row, first column and size of each patch that stays.
    let patches: &[(usize, usize, usize)] = match random.within(1, 4) {
        1 => &[(6, 7, 2)],
        2 => &[(4, 4, 2), (9, 8, 3)],
        3 => &[(4, 4, 2), (9, 4, 2), (5, 10, 2)],
        _ => &[(4, 4, 8)],
    };
    for &(i, j, size) in patches {
        for line in &mut mask[i..i + size] {
            line[j..j + size].fill(false);
        }
    }
    cell.cut(&mask);
    cell.counts.boundary_loops += 1 + patches.len() as u64;
    cell.counts.components += patches.len() as u64;
}

fn hole_chain(cell: &mut Cell, random: &mut Random) {
    let holes = random.within(2, 5);
    cell.cut(&std::array::from_fn(|i| {
        std::array::from_fn(|j| (2..2 + 2 * holes).contains(&i) && (2..2 + 2 * holes).contains(&j) && i / 2 == j / 2)
    }));
    cell.counts.boundary_loops += 1;
    cell.counts.nonmanifold_vertices += holes as u64 - 1;
}

/// A line of `count` edges of row line `i` from column `first` on.
fn line(random: &mut Random) -> (usize, usize, usize) {
    (random.within(3, 12), random.within(2, 5), random.within(3, 9))
}

fn crack(cell: &mut Cell, random: &mut Random) {
    let (i, first, count) = line(random);
    // Half of the cracks open by a hair, as coordinates written with few digits make them.
    let hair = f32::from(u8::from(random.within(0, 1) == 1)) / 65_536.0;
    for j in first..first + count {
        let (a, b, c) = (cell.vertices[i][j], cell.vertices[i + 1][j + 1], cell.vertices[i][j + 1]);
        let mut split = middle(a, c);
        split[2] += hair;
        cell.triangles[i][j][1] = Some([a, b, split]);
        cell.extra.push([split, b, c]);
    }
    let count = count as u64;
    cell.open_edges(3 * count);
    cell.counts.boundary_loops += 1;
    cell.counts.nonmanifold_vertices += count - 1;
}

fn slit(cell: &mut Cell, random: &mut Random, shift: f64) {
    let (i, first, count) = line(random);
    for j in first + 1..first + count {
        let vertex = cell.vertices[i][j];
        let (away, along) = (minus(cell.vertices[i + 1][j], vertex), minus(cell.vertices[i][j + 1], vertex));
        let side = if shift > 0.0 { shift * (0.5 + random.unit()) } else { 0.0 };
        let moved = plus(plus(vertex, scaled(away, 0.15)), scaled(along, side));
        for quad in [(i, j, 0), (i, j, 1), (i, j - 1, 1)] {
            for corner in cell.triangles[quad.0][quad.1][quad.2].iter_mut().flatten().filter(|corner| **corner == vertex) {
                *corner = moved;
            }
        }
    }
    cell.open_edges(2 * count as u64);
    cell.counts.boundary_loops += 1;
}

fn flipped_patch(cell: &mut Cell, random: &mut Random) {
    let mask = blob(random);
    for (quads, line) in cell.triangles.iter_mut().zip(&mask) {
        for (quad, _) in quads.iter_mut().zip(line).filter(|(_, flip)| **flip) {
            quad.iter_mut().flatten().for_each(|triangle| triangle.swap(1, 2));
        }
    }
    let rim = super::cell::perimeter(&mask);
    cell.counts.inconsistent_edges += rim;
    cell.counts.unbalanced_edges += rim;
}

/// A sound triangle of the inner part.
fn some_triangle(cell: &Cell, random: &mut Random) -> Triangle {
    let (i, j, half) = (random.within(2, 13), random.within(2, 13), random.within(0, 1));
    super::surface::Ring::CORNERS[half].map(|(di, dj)| cell.vertices[i + di][j + dj])
}

fn duplicate(cell: &mut Cell, random: &mut Random, opposite: bool) {
    let mut again = some_triangle(cell, random);
    // A copy may begin at another corner.
    again.rotate_left(random.within(0, 2));
    if opposite {
        again.swap(0, 1);
    }
    cell.extra.push(again);
    cell.counts.duplicates += 1;
    cell.counts.nonmanifold_edges += 3;
    cell.counts.unbalanced_edges += 3;
    cell.counts.nonmanifold_vertices += 3;
}

fn duplicate_patch(cell: &mut Cell, random: &mut Random) {
    let size = random.within(1, 6);
    let (i, j) = (random.within(2, 14 - size), random.within(2, 14 - size));
    for quads in &cell.triangles[i..i + size] {
        cell.extra.extend(quads[j..j + size].iter().flatten().flatten());
    }
    let size = size as u64;
    cell.counts.duplicates += 2 * size * size;
    cell.counts.nonmanifold_edges += 3 * size * size + 2 * size;
    cell.counts.nonmanifold_vertices += (size + 1) * (size + 1);
    // Inside the patch every edge has two triangles each way; on its rim two one way and one the other.
    cell.counts.unbalanced_edges += 4 * size;
}

fn repeated_vertex(cell: &mut Cell, random: &mut Random) {
    let [a, b, _] = some_triangle(cell, random);
    cell.extra.push(if random.within(0, 1) == 0 { [a, b, a] } else { [a, a, a] });
    cell.counts.degenerate_index += 1;
}

fn cap(cell: &mut Cell, random: &mut Random) {
    let (i, j) = (random.within(3, 12), random.within(2, 13));
    let (a, b, c) = (cell.vertices[i][j], cell.vertices[i + 1][j + 1], cell.vertices[i][j + 1]);
    let split = middle(a, c);
    cell.triangles[i][j][1] = Some([a, b, split]);
    cell.extra.extend([[split, b, c], [a, split, c]]);
    cell.counts.degenerate_area += 1;
}

fn sliver(cell: &mut Cell, random: &mut Random) {
    let (i, j) = (random.within(3, 12), random.within(3, 12));
    let near = plus(cell.vertices[i][j], scaled(cell.upright(i, j), 0.5));
    let far = plus(near, minus(cell.vertices[i][j + 1], cell.vertices[i][j]));
    cell.extra.push([near, middle(near, far), far]);
    cell.open_edges(3);
    cell.counts.degenerate_area += 1;
    cell.counts.boundary_loops += 1;
    cell.counts.components += 1;
}

fn fin(cell: &mut Cell, random: &mut Random) {
    let (i, j) = (random.within(3, 12), random.within(3, 12));
    let (a, b) = (cell.vertices[i][j], cell.vertices[i][j + 1]);
    cell.extra.push([a, b, plus(middle(a, b), cell.upright(i, j))]);
    cell.open_edges(2);
    cell.counts.boundary_loops += 1;
    cell.counts.nonmanifold_edges += 1;
    cell.counts.unbalanced_edges += 1;
    cell.counts.nonmanifold_vertices += 2;
}

/// A tetrahedron with one corner at `tip`, opening along `up`, of about that length.
fn tetrahedron(tip: super::surface::Point, up: [f64; 3]) -> [Triangle; 4] {
    let side = cross(up, [0.3, 0.5, 0.8]);
    let side = scaled(side, 0.4 * (dot(up, up) / dot(side, side)).sqrt());
    let other = cross(up, side);
    let other = scaled(other, (dot(side, side) / dot(other, other)).sqrt());
    let base = [side, std::array::from_fn(|k| other[k] - 0.5 * side[k]), std::array::from_fn(|k| -other[k] - 0.5 * side[k])];
    let [a, b, c] = base.map(|offset| plus(tip, std::array::from_fn(|k| up[k] + offset[k])));
    [[tip, b, a], [tip, c, b], [tip, a, c], [a, b, c]]
}

fn noise_shell(cell: &mut Cell, random: &mut Random) {
    let (i, j) = (random.within(3, 12), random.within(3, 12));
    let up = cell.upright(i, j);
    let shell = tetrahedron(plus(cell.vertices[i][j], scaled(up, 3.0)), scaled(up, 0.2 + 0.5 * random.unit()));
    cell.extra.extend(shell);
    cell.counts.components += 1;
}

fn touching_body(cell: &mut Cell, random: &mut Random) {
    let (i, j) = (random.within(3, 12), random.within(3, 12));
    cell.extra.extend(tetrahedron(cell.vertices[i][j], scaled(cell.upright(i, j), 2.0)));
    cell.counts.components += 1;
    cell.counts.nonmanifold_vertices += 1;
}

/// Cells are as large as the widest defect plus two vertices on either side.
const _: () = assert!(CELL == 16);
