//! The meshes of the demo: a ring of some 5,000 triangles, and what usually is wrong with the files of customers.

/// A position in millimetres.
type Point = [f32; 3];
/// Three corners, counter-clockwise seen from outside.
type Triangle = [Point; 3];

/// Quads around the ring, and around its tube.
const ROWS: usize = 72;
const COLUMNS: usize = 36;
/// Of the ring and of its tube, in millimetres.
const RADIUS: f32 = 35.0;
const TUBE: f32 = 14.0;
/// Rows and columns of the places that are damaged: far enough from each other that no two kinds of damage meet.
const PLACES: [(usize, usize); 6] = [(4, 3), (16, 20), (28, 9), (40, 26), (52, 14), (64, 30)];

/// A mesh of the demo.
pub(super) struct Mesh {
    /// Of its file, without extension.
    pub name: &'static str,
    triangles: Vec<Triangle>,
}

/// The meshes, in the order in which they are dropped.
pub(super) fn all() -> [Mesh; 10] {
    let damaged = |damage: fn(&mut Ring, (usize, usize))| {
        let mut ring = Ring::whole();
        PLACES.iter().for_each(|&place| damage(&mut ring, place));
        ring.triangles()
    };
    let mut mixed = Ring::whole();
    let kinds = [hole, crack, gap, duplicate, degenerate, flipped_patch];
    kinds.iter().zip(PLACES).for_each(|(damage, place)| damage(&mut mixed, place));
    let whole = Ring::whole().triangles();
    let named = |name, triangles| Mesh { name, triangles };
    [
        named("clean", whole.clone()),
        named("holes", damaged(hole)),
        named("cracks", damaged(crack)),
        named("gaps", damaged(gap)),
        named("duplicates", damaged(duplicate)),
        named("degenerate", damaged(degenerate)),
        named("flipped", damaged(flipped_patch)),
        named("inside-out", whole.iter().map(|&[a, b, c]| [a, c, b]).collect()),
        named("shuffled", shuffled(&whole)),
        named("mixed", mixed.triangles()),
    ]
}

impl Mesh {
    /// Its file: a binary STL, normals left to the reader.
    pub(super) fn bytes(&self) -> Vec<u8> {
        let mut bytes = vec![0; 80];
        bytes.extend((self.triangles.len() as u32).to_le_bytes());
        for triangle in &self.triangles {
            bytes.extend([0; 12]);
            bytes.extend(triangle.iter().flatten().flat_map(|x| x.to_le_bytes()));
            bytes.extend([0; 2]);
        }
        bytes
    }
}

/// The ring as a grid of quads that closes in both directions, and what was added to it.
struct Ring {
    /// Two triangles a quad, row by row.
    quads: Vec<[Option<Triangle>; 2]>,
    extra: Vec<Triangle>,
}

/// The vertex in row `i` and column `j`, both taken around.
fn vertex(i: usize, j: usize) -> Point {
    let (row, column) = (i % ROWS, j % COLUMNS);
    let around = std::f32::consts::TAU * row as f32 / ROWS as f32;
    let across = std::f32::consts::TAU * column as f32 / COLUMNS as f32;
    let reach = RADIUS + TUBE * across.cos();
    [reach * around.cos(), reach * around.sin(), TUBE * across.sin()]
}

fn between(a: Point, b: Point, share: f32) -> Point {
    let [x, y, z] = a;
    let [u, v, w] = b;
    [x + share * (u - x), y + share * (v - y), z + share * (w - z)]
}

impl Ring {
    fn whole() -> Self {
        let quads = (0..ROWS).flat_map(|i| {
            (0..COLUMNS).map(move |j| {
                let [a, b, c, d] = [vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1)];
                [Some([a, b, c]), Some([a, c, d])]
            })
        });
        Self { quads: quads.collect(), extra: Vec::new() }
    }

    fn quad(&mut self, i: usize, j: usize) -> &mut [Option<Triangle>; 2] {
        &mut self.quads[i % ROWS * COLUMNS + j % COLUMNS]
    }

    fn triangles(self) -> Vec<Triangle> {
        self.quads.into_iter().flatten().flatten().chain(self.extra).collect()
    }
}

/// Quads left out.
fn hole(ring: &mut Ring, (i, j): (usize, usize)) {
    for (di, dj) in [(0, 1), (0, 2), (1, 0), (1, 1), (1, 2), (1, 3), (2, 1), (2, 2)] {
        *ring.quad(i + di, j + dj) = [None; 2];
    }
}

/// Edges split on one side only: T-junctions.
fn crack(ring: &mut Ring, (i, j): (usize, usize)) {
    for j in j..j + 5 {
        let (a, b, c) = (vertex(i, j), vertex(i + 1, j + 1), vertex(i, j + 1));
        let split = between(a, c, 0.5);
        ring.quad(i, j)[1] = Some([a, b, split]);
        ring.extra.push([split, b, c]);
    }
}

/// One bank of a line of edges moved away from the other by a seventh of an edge.
fn gap(ring: &mut Ring, (i, j): (usize, usize)) {
    for j in j + 1..j + 5 {
        let (from, to) = (vertex(i, j), between(vertex(i, j), vertex(i + 1, j), 0.15));
        for column in [j - 1, j] {
            let corners = ring.quad(i, column).iter_mut().flatten().flatten();
            corners.filter(|corner| **corner == from).for_each(|corner| *corner = to);
        }
    }
}

/// Triangles written twice.
fn duplicate(ring: &mut Ring, (i, j): (usize, usize)) {
    for j in j..j + 3 {
        let again = ring.quad(i, j).iter().flatten().copied().collect::<Vec<_>>();
        ring.extra.extend(again);
    }
}

/// Triangles of no area, in the seam of two others.
fn degenerate(ring: &mut Ring, (i, j): (usize, usize)) {
    let (a, b) = (vertex(i, j), vertex(i, j + 1));
    ring.extra.extend([[a, b, a], [a, a, a], [a, between(a, b, 0.5), b]]);
}

/// Quads turned inside out.
fn flipped_patch(ring: &mut Ring, (i, j): (usize, usize)) {
    for (i, j) in (i..i + 4).flat_map(|i| (j..j + 3).map(move |j| (i, j))) {
        ring.quad(i, j).iter_mut().flatten().for_each(|triangle| triangle.swap(1, 2));
    }
}

/// The same triangles in another order, as far from their neighbours as it goes.
fn shuffled(triangles: &[Triangle]) -> Vec<Triangle> {
    // No factor of the number of triangles: every one of them is met once.
    const STEP: usize = 1931;
    (0..triangles.len()).filter_map(|n| triangles.get(n * STEP % triangles.len()).copied()).collect()
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use suture_core::report::Outcome;
    use suture_core::{Limits, Profile};

    use super::*;

    /// What the demo shows: sound files come through as they are, and every damage is found and mended.
    #[test]
    fn every_damage_is_found_and_mended() {
        let folder = tempfile::tempdir().unwrap();
        for mesh in all() {
            let (input, output) = (folder.path().join(mesh.name), folder.path().join("out.stl"));
            std::fs::write(&input, mesh.bytes()).unwrap();
            let report =
                suture_core::repair(&input, &output, &Profile::default(), &Limits::default(), &suture_core::Quiet).unwrap();
            let sound = ["clean", "shuffled"].contains(&mesh.name);
            assert_eq!(report.outcome, if sound { Outcome::Clean } else { Outcome::Repaired }, "{}", mesh.name);
            std::fs::remove_file(&output).unwrap();
        }
    }

    #[test]
    fn shuffling_loses_nothing() {
        let whole = Ring::whole().triangles();
        let bits = |triangles: &[Triangle]| triangles.iter().map(|t| t.map(|p| p.map(f32::to_bits))).collect::<BTreeSet<_>>();
        let mixed = shuffled(&whole);
        assert_eq!((mixed.len(), bits(&mixed)), (whole.len(), bits(&whole)));
    }
}
