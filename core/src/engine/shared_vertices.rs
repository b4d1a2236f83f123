//! Vertices and faces of triangles: corners at one position become one vertex, numbered by first appearance, whoever finds them.
//!
//! Triangles are welded in parts, side by side; then the vertices of each part that stand in no part before it get the next numbers. That is the order of
//! first appearance, for any number of parts.

use rayon::prelude::*;

use crate::geometry::exact::Point;
use crate::topology::vertex_table::{BATCH, Weld};
use crate::util::ids::NONE;

/// Fewer triangles make no part of their own.
const LEAST: usize = 1 << 15;

/// Parts, at most: a vertex of the last one is looked for in all others.
const MOST_PARTS: usize = 8;

/// Positions that a thread looks for at once.
const BLOCK: usize = 1 << 12;

/// Vertices by position, and the vertices of each triangle. Corners with a coordinate that is not finite are vertices of their own, after all others.
pub(super) struct Welded {
    pub(super) vertices: Vec<Point>,
    pub(super) faces: Vec<[u32; 3]>,
}

/// Triangles that were welded for themselves; their faces have the numbers of this part.
struct Part {
    weld: Weld,
    /// The corners that are not finite: the face in this part, and the corner.
    apart: Vec<(usize, usize, Point)>,
}

/// Welds on this thread alone; more vertices than numbers are an error, which says how many. O(n).
pub(super) fn alone<T: Sync>(all: &[T], corners: impl Fn(&T) -> [Point; 3] + Sync) -> Result<Welded, usize> {
    let mut faces = vec![[0; 3]; all.len()];
    let part = Part::new(all, &mut faces, &corners);
    joined(vec![part], all.len().max(1), faces)
}

/// The same on the threads of the pool that this one belongs to.
pub(super) fn together<T: Sync>(all: &[T], corners: impl Fn(&T) -> [Point; 3] + Sync) -> Result<Welded, usize> {
    let size = all.len().div_ceil(rayon::current_num_threads().min(MOST_PARTS)).max(LEAST);
    in_parts_of(size, all, corners)
}

fn in_parts_of<T: Sync>(size: usize, all: &[T], corners: impl Fn(&T) -> [Point; 3] + Sync) -> Result<Welded, usize> {
    let mut faces = vec![[0; 3]; all.len()];
    let parts =
        all.par_chunks(size).zip(faces.par_chunks_mut(size)).map(|(all, faces)| Part::new(all, faces, &corners)).collect();
    joined(parts, size, faces)
}

impl Part {
    fn new<T>(all: &[T], faces: &mut [[u32; 3]], corners: &impl Fn(&T) -> [Point; 3]) -> Self {
        const GROUP: usize = BATCH / 3;
        let mut part = Self { weld: Weld::default(), apart: Vec::new() };
        part.weld.reset(all.len() / 2);
        let is_finite = |p: &Point| p.iter().all(|x| x.is_finite());
        let mut group = [[[0.0; 3]; 3]; GROUP];
        for (g, (some, faces)) in all.chunks(GROUP).zip(faces.chunks_mut(GROUP)).enumerate() {
            group.iter_mut().zip(some).for_each(|(triangle, one)| *triangle = corners(one));
            let triangles = &group[..some.len()];
            if triangles.as_flattened().iter().all(is_finite) {
                part.weld.vertices(triangles.as_flattened(), faces.as_flattened_mut());
                continue;
            }
            for (f, (triangle, face)) in triangles.iter().zip(faces).enumerate() {
                for (k, (p, vertex)) in triangle.iter().zip(face).enumerate() {
                    if is_finite(p) {
                        *vertex = part.weld.vertex(*p);
                    } else {
                        part.apart.push((g * GROUP + f, k, *p));
                    }
                }
            }
        }
        part
    }
}

/// One mesh of parts of so many triangles each.
fn joined(parts: Vec<Part>, size: usize, mut faces: Vec<[u32; 3]>) -> Result<Welded, usize> {
    let numbers = numbers(&parts)?;
    for (faces, numbers) in faces.chunks_mut(size).zip(&numbers).skip(1) {
        let renumber = |some: &mut [u32]| some.iter_mut().for_each(|v| *v = numbers[*v as usize]);
        faces.as_flattened_mut().par_chunks_mut(BLOCK).for_each(renumber);
    }
    let (mut vertices, mut apart) = (Vec::new(), Vec::new());
    for (i, (part, numbers)) in parts.into_iter().zip(numbers).enumerate() {
        apart.extend(part.apart.into_iter().map(|(face, k, p)| (i * size + face, k, p)));
        if i == 0 {
            vertices = part.weld.into_positions();
            continue;
        }
        let known = vertices.len();
        vertices
            .extend(part.weld.positions().iter().zip(numbers).filter(|(_, number)| *number as usize >= known).map(|(p, _)| *p));
    }
    let count = vertices.len() + apart.len();
    u32::try_from(count).map_err(|_| count)?;
    for (face, k, p) in apart {
        faces[face][k] = vertices.len() as u32;
        vertices.push(p);
    }
    Ok(Welded { vertices, faces })
}

/// The numbers of the vertices of each part, by its own numbers; none for the first part, whose numbers stay.
fn numbers(parts: &[Part]) -> Result<Vec<Vec<u32>>, usize> {
    let mut numbers: Vec<Vec<u32>> = vec![Vec::new()];
    let mut count = parts.first().map_or(0, |part| part.weld.positions().len());
    for (i, part) in parts.iter().enumerate().skip(1) {
        let blocks = part.weld.positions().par_chunks(BATCH).with_min_len(BLOCK / BATCH);
        let mut own: Vec<u32> = blocks.flat_map_iter(|points| known(&parts[..i], &numbers, points)).collect();
        for number in own.iter_mut().filter(|number| **number == NONE) {
            *number = u32::try_from(count).map_err(|_| count)?;
            count += 1;
        }
        numbers.push(own);
    }
    Ok(numbers)
}

/// The numbers of positions, at most [`BATCH`], that stand in one of these parts; [`NONE`] for others.
fn known(parts: &[Part], numbers: &[Vec<u32>], points: &[Point]) -> impl Iterator<Item = u32> {
    let (mut known, mut found) = ([NONE; BATCH], [NONE; BATCH]);
    for (part, numbers) in parts.iter().zip(numbers) {
        part.weld.find_all(points, &mut found);
        for (known, v) in known.iter_mut().zip(found).filter(|(known, v)| **known == NONE && *v != NONE) {
            *known = numbers.get(v as usize).copied().unwrap_or(v);
        }
    }
    known.into_iter().take(points.len())
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// A part of seven triangles sees few of the positions before it; NaN is equal to nothing.
        #[test]
        fn parts_make_the_same_mesh_as_one(corners in prop::collection::vec(prop::array::uniform9(-1i8..3), 0..90), odd in 0usize..90) {
            let mut all: Vec<[Point; 3]> = corners
                .iter()
                .map(|c| [[c[0], c[1], c[2]], [c[3], c[4], c[5]], [c[6], c[7], c[8]]].map(|p| p.map(f32::from)))
                .collect();
            all.iter_mut().skip(odd).take(1).for_each(|triangle| triangle[1][2] = f32::NAN);
            let one = alone(&all, |t| *t).unwrap();
            let parts = in_parts_of(7, &all, |t| *t).unwrap();
            prop_assert_eq!(&one.faces, &parts.faces);
            let bits = |welded: &Welded| welded.vertices.iter().flatten().map(|x| x.to_bits()).collect::<Vec<_>>();
            prop_assert_eq!(bits(&one), bits(&parts));
            // By first appearance, but for the one that is not finite.
            let mut next = 0;
            for v in one.faces.as_flattened().iter().filter(|v| one.vertices[**v as usize][2].is_finite()) {
                prop_assert!(*v <= next, "a number is the next one, or was there before");
                next = next.max(v + 1);
            }
            for (face, triangle) in one.faces.iter().zip(&all) {
                for (v, p) in face.iter().zip(triangle) {
                    prop_assert!(one.vertices[*v as usize] == *p || p[2].is_nan());
                }
            }
        }
    }
}
