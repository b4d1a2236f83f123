//! A constraint becomes an edge of a triangulation: what it runs through is taken out, and both sides are triangulated anew (Anglada, "An
//! improved incremental algorithm for constructing restricted Delaunay triangulations", Computers & Graphics 21, 1997).

use crate::geometry::arrange::delaunay::{Delaunay, Tri};
use crate::util::ids::NONE;

/// Triangles that a constraint runs through, in order, and the points on either side of it.
struct Corridor {
    triangles: Vec<usize>,
    left: Vec<usize>,
    right: Vec<usize>,
}

pub(crate) fn constrain(cdt: &mut Delaunay<'_>, a: usize, b: usize) -> Option<()> {
    if mark(cdt, a, b) {
        return Some(());
    }
    let corridor = corridor(cdt, a, b)?;
    let mut new = Vec::new();
    fill(cdt, a, b, &corridor.left, &mut new)?;
    let right: Vec<usize> = corridor.right.iter().rev().copied().collect();
    fill(cdt, b, a, &right, &mut new)?;
    replace(cdt, &corridor.triangles, &new)?;
    mark(cdt, a, b).then_some(())
}

/// Marks an edge that is there, on both sides.
fn mark(cdt: &mut Delaunay<'_>, a: usize, b: usize) -> bool {
    let found = cdt.around(a, |t| {
        let v = cdt.triangles[t].v;
        (0..3).find(|k| [(a, b), (b, a)].contains(&(v[*k], v[(k + 1) % 3]))).map(|k| (t, k))
    });
    let Some((t, side)) = found else { return false };
    cdt.triangles[t].constrained[side] = true;
    let other = cdt.triangles[t].adjacent[side];
    if other != NONE {
        let other = &mut cdt.triangles[other as usize];
        let back = other.side_towards(t);
        other.constrained[back] = true;
    }
    true
}

fn corridor(cdt: &Delaunay<'_>, a: usize, b: usize) -> Option<Corridor> {
    let (mut t, mut side) = cdt.around(a, |t| {
        let v = cdt.triangles[t].v;
        let opposite = (v.iter().position(|v| *v == a)? + 1) % 3;
        let (u, w) = (v[opposite], v[(opposite + 1) % 3]);
        (u != b && w != b && cdt.flat.cross((a, b), (u, w))).then_some((t, opposite))
    })?;
    let v = cdt.triangles[t].v;
    let mut corridor = Corridor { triangles: vec![t], left: vec![v[(side + 1) % 3]], right: vec![v[side]] };
    while corridor.triangles.len() <= cdt.triangles.len() {
        let next = cdt.triangles[t].adjacent[side];
        let tri = cdt.triangles.get(next as usize)?;
        let back = tri.side_towards(t);
        corridor.triangles.push(next as usize);
        let w = tri.v[(back + 2) % 3];
        if w == b {
            return Some(corridor);
        }
        match cdt.flat.turn(a, b, w) {
            1 => corridor.left.push(w),
            -1 => corridor.right.push(w),
            _ => return None,
        }
        let through = |k: &usize| cdt.flat.cross((a, b), (tri.v[*k], tri.v[(k + 1) % 3]));
        side = [(back + 1) % 3, (back + 2) % 3].into_iter().find(through)?;
        t = next as usize;
    }
    None
}

/// Triangulates what lies to the left of an edge, up to a chain of points from its start to its end. (A list of what is to do, since chains may
/// be long; triangles come in the order of a recursion.)
fn fill(cdt: &Delaunay<'_>, a: usize, b: usize, chain: &[usize], out: &mut Vec<[usize; 3]>) -> Option<()> {
    enum Todo<'a> {
        Chain(usize, usize, &'a [usize]),
        Emit([usize; 3]),
    }
    let mut todo = vec![Todo::Chain(a, b, chain)];
    while let Some(next) = todo.pop() {
        match next {
            Todo::Emit(t) => out.push(t),
            Todo::Chain(_, _, []) => {}
            Todo::Chain(a, b, chain) => {
                let at = apex(cdt, a, b, chain);
                let c = chain[at];
                if cdt.flat.turn(a, b, c) <= 0 {
                    return None;
                }
                todo.push(Todo::Emit([a, b, c]));
                todo.push(Todo::Chain(c, b, &chain[at + 1..]));
                todo.push(Todo::Chain(a, c, &chain[..at]));
            }
        }
    }
    Some(())
}

/// The point of a chain whose circle with the edge has no other in it.
fn apex(cdt: &Delaunay<'_>, a: usize, b: usize, chain: &[usize]) -> usize {
    let mut best = 0;
    for (i, v) in chain.iter().enumerate().skip(1) {
        let better = match cdt.flat.turn(a, b, chain[best]) {
            0 => true,
            1 => cdt.flat.in_circle([a, b, chain[best]], *v) > 0,
            _ => cdt.flat.in_circle([a, chain[best], b], *v) > 0,
        };
        if better {
            best = i;
        }
    }
    best
}

/// Puts new triangles in the place of old ones.
fn replace(cdt: &mut Delaunay<'_>, old: &[usize], new: &[[usize; 3]]) -> Option<()> {
    let key = |u: usize, v: usize| (u.min(v), u.max(v));
    let mut sorted = old.to_vec();
    sorted.sort_unstable();
    let mut border: Vec<((usize, usize), u32, bool)> = Vec::new();
    let mut kept: Vec<(usize, usize)> = Vec::new();
    for t in old {
        let tri = cdt.triangles[*t];
        for k in 0..3 {
            let (edge, other) = (key(tri.v[k], tri.v[(k + 1) % 3]), tri.adjacent[k]);
            if other == NONE || sorted.binary_search(&(other as usize)).is_err() {
                border.push((edge, other, tri.constrained[k]));
            } else if tri.constrained[k] {
                kept.push(edge);
            }
        }
    }
    border.sort_unstable();
    let base = cdt.triangles.len();
    let mut inner: Vec<((usize, usize), usize, usize)> = Vec::new();
    for v in new {
        let t = cdt.triangles.len();
        let mut tri = Tri::new(*v, [NONE; 3], [false; 3]);
        for k in 0..3 {
            let edge = key(v[k], v[(k + 1) % 3]);
            let Ok(at) = border.binary_search_by_key(&edge, |b| b.0) else {
                inner.push((edge, t, k));
                continue;
            };
            (tri.adjacent[k], tri.constrained[k]) = (border[at].1, border[at].2);
            if let Some(other) = cdt.triangles.get_mut(border[at].1 as usize) {
                let back = (0..3).find(|k| key(other.v[*k], other.v[(k + 1) % 3]) == edge)?;
                other.adjacent[back] = t as u32;
            }
        }
        cdt.triangles.push(tri);
    }
    inner.sort_unstable();
    // Twice, but for where the chain touches itself.
    for pair in inner.chunk_by(|a, b| a.0 == b.0).flat_map(|same| same.chunks(2)) {
        let [(_, t, k), (_, u, l)] = pair else { return None };
        cdt.triangles[*t].adjacent[*k] = *u as u32;
        cdt.triangles[*u].adjacent[*l] = *t as u32;
    }
    (base..cdt.triangles.len()).for_each(|t| cdt.record(t));
    old.iter().for_each(|t| cdt.triangles[*t].alive = false);
    kept.into_iter().all(|(u, v)| mark(cdt, u, v)).then_some(())
}
