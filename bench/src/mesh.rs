//! Triangles as three points, and STL files of them.

use std::collections::{HashMap, HashSet};
use std::fs;
use std::path::Path;

pub(crate) use suture_bench::space::{Vector, cross, dot, length, minus, unit, wide};

pub(crate) type Point = [f32; 3];
pub(crate) type Triangle = [Point; 3];

/// The finite triangles of an STL, binary (it has as many whole records as its count says, less than another one behind them is left
/// out) or ASCII.
pub(crate) fn read(path: &Path) -> Result<Vec<Triangle>, String> {
    let bytes = fs::read(path).map_err(|e| format!("{}: {e}", path.display()))?;
    let count = bytes.get(80..).and_then(|rest| rest.first_chunk()).map(|c| u32::from_le_bytes(*c) as usize);
    let body = bytes.get(84..).unwrap_or_default();
    let mut triangles = if count.is_some_and(|count| body.len() == count * 50 || count > 0 && body.len() / 50 == count) {
        let number = |record: &[u8], at: usize| f32::from_le_bytes([record[at], record[at + 1], record[at + 2], record[at + 3]]);
        let corners = |record: &[u8]| std::array::from_fn(|c| std::array::from_fn(|k| number(record, 12 + 12 * c + 4 * k)));
        body.chunks_exact(50).map(corners).collect()
    } else {
        ascii(&bytes).ok_or_else(|| format!("{}: no STL, or its length is not what its count says", path.display()))?
    };
    triangles.retain(|t: &Triangle| t.as_flattened().iter().all(|x| x.is_finite()));
    Ok(triangles)
}

/// Every three vertices of an ASCII STL.
fn ascii(bytes: &[u8]) -> Option<Vec<Triangle>> {
    let text = String::from_utf8_lossy(bytes);
    let mut words = text.split_ascii_whitespace();
    words.next().filter(|first| first.eq_ignore_ascii_case("solid"))?;
    let mut corners = Vec::new();
    while let Some(word) = words.next() {
        if word.eq_ignore_ascii_case("vertex") {
            let mut number = || words.next()?.parse().ok();
            corners.push([number()?, number()?, number()?]);
        }
    }
    let (triangles, rest) = corners.as_chunks();
    (rest.is_empty() && !triangles.is_empty()).then(|| triangles.to_vec())
}

/// Writes a binary STL, its normals left to be computed by whoever reads it.
pub(crate) fn write(path: &Path, triangles: &[Triangle]) -> Result<(), String> {
    let mut out = vec![0; 80];
    out.extend((triangles.len() as u32).to_le_bytes());
    for t in triangles {
        out.extend([0; 12]);
        out.extend(t.as_flattened().iter().flat_map(|x| x.to_le_bytes()));
        out.extend([0; 2]);
    }
    fs::write(path, out).map_err(|e| format!("{}: {e}", path.display()))
}

/// Points of exactly equal coordinates as one number, −0.0 being 0.0.
#[derive(Default)]
pub(crate) struct Welded {
    numbers: HashMap<[u32; 3], u32>,
    pub(crate) points: Vec<Point>,
}

impl Welded {
    pub(crate) fn number(&mut self, p: Point) -> u32 {
        let next = self.points.len() as u32;
        let number = *self.numbers.entry(p.map(|x| (x + 0.0).to_bits())).or_insert(next);
        if number == next {
            self.points.push(p);
        }
        number
    }

    /// Three numbers for each triangle, the smallest first.
    pub(crate) fn faces(&mut self, triangles: &[Triangle]) -> Vec<[u32; 3]> {
        let mut faces: Vec<_> = triangles.iter().map(|t| t.map(|p| self.number(p))).collect();
        for face in &mut faces {
            let first = (0..3).min_by_key(|&k| face[k]).unwrap_or(0);
            face.rotate_left(first);
        }
        faces
    }
}

/// Which of `before` stand in `after`, of exactly equal corners in the same direction. O(n).
pub(crate) fn kept(before: &[Triangle], after: &[Triangle]) -> usize {
    let mut welded = Welded::default();
    let faces = welded.faces(before);
    let there: HashSet<_> = welded.faces(after).into_iter().collect();
    faces.iter().filter(|face| there.contains(*face)).count()
}

/// Those of `triangles` that do not stand in `other` with exactly equal corners, in whatever direction. O(n).
pub(crate) fn not_in(triangles: &[Triangle], other: &[Triangle]) -> Vec<Triangle> {
    let key = |triangle: &Triangle| {
        let mut corners = triangle.map(|p| p.map(|x| (x + 0.0).to_bits()));
        corners.sort_unstable();
        corners
    };
    let there: HashSet<_> = other.iter().map(key).collect();
    triangles.iter().copied().filter(|triangle| !there.contains(&key(triangle))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_kinds_of_stl_read_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.stl");
        let triangle: Triangle = [[0.0, 1.5, -2.0], [1e-7, 0.1, 3.0], [4.0, 5.0, 6.0]];
        write(&path, &[triangle, [[f32::NAN; 3]; 3]]).unwrap();
        assert_eq!(read(&path).unwrap(), [triangle]);
        let bytes = fs::read(&path).unwrap();
        fs::write(&path, [&bytes[..], &[7]].concat()).unwrap();
        assert_eq!(read(&path).unwrap(), [triangle]);
        fs::write(&path, &bytes[..bytes.len() - 1]).unwrap();
        assert!(read(&path).is_err());
        let text =
            "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 1.5 -2\nVERTEX 1e-7 0.1 3\nvertex 4 5 6\nendloop\nendfacet\n";
        fs::write(&path, text).unwrap();
        assert_eq!(read(&path).unwrap(), [triangle]);
        fs::write(&path, &text[..text.len() - 26]).unwrap();
        assert!(read(&path).is_err());
    }

    #[test]
    fn a_turned_triangle_is_kept_and_a_flipped_one_is_not() {
        let [a, b, c, d]: [Point; 4] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let (before, after) = ([[a, b, c], [a, c, d], [b, c, d]], [[c, a, b], [a, d, c], [c, d, b]]);
        assert_eq!(kept(&before, &after), 2);
        assert_eq!(not_in(&before, &after), Vec::<Triangle>::new());
        assert_eq!(not_in(&before, &after[1..]), [before[0]]);
    }
}
