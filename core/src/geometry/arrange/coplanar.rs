//! The overlap of two triangles in one plane: each edge of one, as far as it lies in the other.
//!
//! The signs of corners by edges tell the corners of the overlap, so that no other point is made.

use crate::geometry::arrange::plane::on_lines;
use crate::geometry::arrange::soup::{Contact, Contacts, Edge, End, Soup};
use crate::geometry::exact;
use crate::util::ids::NONE;

/// Two triangles that turn to the left, seen along an axis.
struct Both<'a> {
    soup: &'a Soup<'a>,
    axis: usize,
    pair: [usize; 2],
    /// By triangle: does it turn to the right, so that its last corners are taken the other way round?
    turned: [bool; 2],
    triangles: [[[f32; 3]; 3]; 2],
    /// How corner i of the other triangle turns from edge k of this one: `signs[this][k][i]`.
    signs: [[[i8; 3]; 3]; 2],
    /// By an edge of the first and one of the second: where they cross, among the points, or [`NONE`] as long as nobody asked.
    crossings: [[u32; 3]; 3],
}

/// Adds the border of what both cover; `common` corners are those of both.
pub(crate) fn overlap(soup: &Soup<'_>, pair: [usize; 2], common: usize, into: &mut Contacts) {
    let Some(mut both) = Both::of(soup, pair, common) else { return };
    let first = into.all.len();
    for (which, k) in (0..6).map(|i| (i / 3, i % 3)) {
        let Some(side) = both.side(which, k, into) else { continue };
        if !into.all[first..].iter().any(|other| is_same(soup, &side, other)) {
            into.all.push(side);
        }
    }
    // Along an edge of both they only touch.
    if into.all.len() == first + 1 && common == 2 {
        into.all.truncate(first);
    }
}

/// Where edges of both lie on each other, a side is found twice. It ends at corners then.
fn is_same(soup: &Soup<'_>, one: &Contact, other: &Contact) -> bool {
    match (one.ends, other.ends) {
        ([End::Corner(a), End::Corner(b)], [End::Corner(c), End::Corner(d)]) => {
            let [a, b, c, d] = [a, b, c, d].map(|corner| soup.corner(corner));
            a == c && b == d || a == d && b == c
        }
        _ => false,
    }
}

impl<'a> Both<'a> {
    /// `None` if they are apart, or touch each other in a point or along an edge of both.
    fn of(soup: &'a Soup<'a>, pair: [usize; 2], common: usize) -> Option<Self> {
        let axis = soup.plane(pair[0]).axis;
        let mut triangles = pair.map(|t| soup.triangles[t]);
        let turned = triangles.each_ref().map(|[a, b, c]| exact::orientation_along(a, b, c, axis) < 0);
        triangles.iter_mut().zip(turned).filter(|(_, turned)| *turned).for_each(|(t, _)| t.swap(1, 2));
        let mut signs = [[[0; 3]; 3]; 2];
        for (this, other) in [(0, 1), (1, 0)] {
            let (t, u) = (&triangles[this], &triangles[other]);
            for k in 0..3 {
                let [from, to] = [&t[k], &t[(k + 1) % 3]];
                let turn = |p: &[f32; 3]| if p == to { 0 } else { exact::orientation_along(from, to, p, axis) };
                let of_edge = [turn(&u[0]), turn(&u[1]), turn(&u[2])];
                let on_line = of_edge.iter().filter(|turn| **turn == 0).count();
                if of_edge.iter().all(|turn| *turn <= 0) && (on_line < 2 || common == 2) {
                    return None;
                }
                signs[this][k] = of_edge;
            }
        }
        Some(Self { soup, axis, pair, turned, triangles, signs, crossings: [[NONE; 3]; 3] })
    }

    /// Where corner i of the one is in the soup.
    fn corner(&self, which: usize, i: usize) -> Edge {
        let k = if self.turned[which] { (3 - i) % 3 } else { i };
        Edge { triangle: self.pair[which] as u32, k: k as u8 }
    }

    /// Where the edge from corner k on of the one is in the soup, whichever way round.
    fn edge(&self, which: usize, k: usize) -> Edge {
        self.corner(which, if self.turned[which] { (k + 1) % 3 } else { k })
    }

    /// Does corner i of the one lie in the other, or on its border?
    fn holds(&self, which: usize, i: usize) -> bool {
        self.signs[1 - which].iter().all(|of_edge| of_edge[i] >= 0)
    }

    /// Where edge k of the one crosses edge j of the other.
    fn crossing(&mut self, which: usize, k: usize, j: usize, into: &mut Contacts) -> Option<End> {
        let (a, b) = if which == 0 { (k, j) } else { (j, k) };
        if self.crossings[a][b] == NONE {
            let [first, second] = [self.edge(0, a), self.edge(1, b)].map(|edge| self.soup.edge(edge));
            let point = on_lines(&first, &second, self.axis)?;
            self.crossings[a][b] = into.points.len() as u32;
            into.points.push(point);
        }
        Some(End::Point(self.crossings[a][b]))
    }

    /// The part of edge k of the one that lies in the other, if it has a length.
    fn side(&mut self, which: usize, k: usize, into: &mut Contacts) -> Option<Contact> {
        let (next, other, of_edge) = ((k + 1) % 3, 1 - which, self.signs[which][k]);
        let mut corners: [Option<(usize, usize)>; 2] = [None; 2];
        let mut offer = |corner: (usize, usize)| {
            let place = |corner: (usize, usize)| self.triangles[corner.0][corner.1];
            match corners {
                [None, _] => corners[0] = Some(corner),
                [Some(first), None] if place(first) != place(corner) => corners[1] = Some(corner),
                _ => {}
            }
        };
        [k, next].into_iter().filter(|i| self.holds(which, *i)).for_each(|i| offer((which, i)));
        // The other triangle is convex: its corners on the edge are ends of what both cover, unless the edge ends before.
        (0..3).filter(|i| of_edge[*i] == 0 && self.holds(other, *i)).for_each(|i| offer((other, i)));
        let mut ends = corners.map(|corner| corner.map(|(which, i)| End::Corner(self.corner(which, i))));
        for j in 0..3 {
            let across = self.signs[other][j];
            if ends[1].is_none() && of_edge[j] * of_edge[(j + 1) % 3] < 0 && across[k] * across[next] < 0 {
                let crossing = self.crossing(which, k, j, into);
                ends[usize::from(ends[0].is_some())] = crossing;
            }
        }
        let edge = Some(self.edge(which, k));
        Some(Contact { other: self.pair[1] as u32, ends: [ends[0]?, ends[1]?], edge })
    }
}
