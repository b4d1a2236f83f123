//! Triangles that touch along edges: pieces of a surface, small ones dropped, small gaps filled.

/// Three neighbours of each triangle by its edges; `u32::MAX` on a border, or where more than two triangles share the edge. O(triangles)
/// for bounded valences; 40 bytes a triangle on the way.
pub(crate) fn neighbours(points: usize, faces: &[[u32; 3]]) -> Vec<[u32; 3]> {
    let sides = |[a, b, c]: [u32; 3]| [(a, b), (b, c), (c, a)].map(|(from, to)| (from.min(to), from.max(to)));
    // Sides are sorted by their lesser vertex by counting, then within its list.
    let mut starts = vec![0u32; points + 1];
    for (low, _) in faces.iter().flat_map(|face| sides(*face)) {
        starts[low as usize + 1] += 1;
    }
    for vertex in 0..points {
        starts[vertex + 1] += starts[vertex];
    }
    let mut lists = vec![(0u32, 0u32); faces.len() * 3];
    for (face, number) in faces.iter().zip(0u32..) {
        for ((low, high), slot) in sides(*face).into_iter().zip(0..) {
            lists[starts[low as usize] as usize] = (high, number * 3 + slot);
            starts[low as usize] += 1;
        }
    }
    let mut neighbours = vec![[u32::MAX; 3]; faces.len()];
    let mut first = 0;
    for end in starts.into_iter().take(points) {
        let list = &mut lists[first..end as usize];
        first = end as usize;
        list.sort_unstable();
        for pair in list.chunk_by(|a, b| a.0 == b.0) {
            let &[(_, one), (_, other)] = pair else { continue };
            for (here, there) in [(one, other), (other, one)] {
                neighbours[here as usize / 3][here as usize % 3] = there / 3;
            }
        }
    }
    neighbours
}

/// Connected pieces of the triangles of the same kind: for each triangle the number of its piece, and the size of each piece. Pieces are
/// numbered by their first triangle. O(triangles).
pub(crate) fn pieces(neighbours: &[[u32; 3]], is_in: &[bool]) -> (Vec<u32>, Vec<u32>) {
    let mut numbers = vec![u32::MAX; is_in.len()];
    let mut sizes: Vec<u32> = Vec::new();
    let mut stack = Vec::new();
    for first in 0..is_in.len() {
        if numbers[first] != u32::MAX {
            continue;
        }
        let number = sizes.len() as u32;
        let mut size = 0;
        numbers[first] = number;
        stack.push(first);
        while let Some(face) = stack.pop() {
            size += 1;
            for next in neighbours[face].into_iter().filter(|next| *next != u32::MAX).map(|next| next as usize) {
                if numbers[next] == u32::MAX && is_in[next] == is_in[first] {
                    numbers[next] = number;
                    stack.push(next);
                }
            }
        }
        sizes.push(size);
    }
    (numbers, sizes)
}

/// Drops pieces of residue of fewer triangles than `least`, then fills gaps of as few that have no border, of triangles that
/// `may_fill`. O(triangles).
pub(crate) fn clean(neighbours: &[[u32; 3]], is_in: &mut [bool], least: usize, may_fill: impl Fn(usize) -> bool) {
    for wanted in [false, true] {
        let (numbers, sizes) = pieces(neighbours, is_in);
        let mut is_kept: Vec<bool> = sizes.iter().map(|size| *size as usize >= least).collect();
        if wanted {
            for (face, number) in numbers.iter().enumerate() {
                if neighbours[face].contains(&u32::MAX) || !(is_in[face] || may_fill(face)) {
                    is_kept[*number as usize] = true;
                }
            }
        }
        for (face, number) in numbers.iter().enumerate() {
            if !is_kept[*number as usize] && is_in[face] != wanted {
                is_in[face] = wanted;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A strip of triangles, each of which shares an edge with the one before it.
    fn strip(count: u32) -> Vec<[u32; 3]> {
        (0..count).map(|n| if n % 2 == 0 { [n, n + 1, n + 2] } else { [n + 1, n, n + 2] }).collect()
    }

    #[test]
    fn neighbours_share_edges() {
        let neighbours = neighbours(7, &strip(5));
        for (face, slots) in neighbours.iter().enumerate() {
            let mut known: Vec<u32> = slots.iter().copied().filter(|slot| *slot != u32::MAX).collect();
            known.sort_unstable();
            let expected: Vec<u32> =
                [face as i64 - 1, face as i64 + 1].into_iter().filter(|n| (0..5).contains(n)).map(|n| n as u32).collect();
            assert_eq!(known, expected);
        }
    }

    /// A lonely triangle goes, a gap of two stays because a strip's triangles all lie on the border.
    #[test]
    fn small_pieces_go() {
        let neighbours = neighbours(14, &strip(12));
        let mut is_in = [true, false, false, true, true, true, true, false, false, true, true, true];
        clean(&neighbours, &mut is_in, 3, |_| true);
        assert_eq!(is_in, [false, false, false, true, true, true, true, false, false, true, true, true]);
    }

    /// A gap within a tetrahedron's faces is filled: it has no border.
    #[test]
    fn gaps_are_filled() {
        let neighbours = neighbours(4, &[[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]);
        let mut is_in = [true, true, false, true];
        clean(&neighbours, &mut is_in, 2, |_| false);
        assert_eq!(is_in, [true, true, false, true]);
        clean(&neighbours, &mut is_in, 2, |_| true);
        assert_eq!(is_in, [true; 4]);
    }
}
