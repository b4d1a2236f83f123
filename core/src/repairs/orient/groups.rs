//! Parts of surface that disagree where they meet, brought to agree, unless what is seen of them says that no surface goes on there.
//!
//! Each part has an area that is seen from the front, less what is seen of it from behind. Parts join into groups that agree with themselves, and
//! what is seen of a group is the sum over its parts, each the way round that it has there. Round by round, each group joins the stronger
//! neighbour with which it has most in common, as Borůvka's trees grow; so there are few rounds. What is seen can hold two groups apart, if it says that they
//! agree as they are: if both are plainly seen, each by an area that is large against that of the triangles where they meet. A few triangles that
//! are seen through a hole from the wrong side are held by their neighbours; two bodies that were welded along an edge are not.

use std::cmp::Reverse;

use crate::submesh::components::Sample;
use crate::util::parity::Parity;

/// A group is plainly seen if one side is by at least one part in so many of what was looked at.
const PLAINLY: f64 = 8.0;

/// A group stands against its neighbours if what is seen of it is more than so many times the area of the triangles where they meet.
const STANDS: f64 = 2.0;

/// No mesh needs as many rounds.
const ROUNDS: usize = 64;

/// A part of surface that agrees with itself. Areas in one unit, whichever.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Part {
    pub(crate) area: f64,
    pub(crate) triangles: u64,
    /// Its first triangle.
    pub(crate) sample: Sample,
    /// The area that was looked at.
    pub(crate) looked_at: f64,
    /// The area that is seen from the front, less that which is seen from behind.
    pub(crate) front: f64,
}

/// Two parts that disagree where they meet.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Link {
    pub(crate) parts: [u32; 2],
    /// Of the smaller triangle at each edge there.
    pub(crate) area: f64,
}

/// By part: is it to be turned? Parts of a group come to agree, and are seen from the front; of a group that is not plainly seen, the smaller
/// side is turned, of equal sides that with the later triangle. O((parts + links) log parts).
pub(crate) fn turned(parts: &[Part], links: &[Link]) -> Vec<bool> {
    let mut groups = Groups { parts, parity: Parity::new(parts.len()) };
    for _ in 0..ROUNDS {
        if !groups.join(links) {
            break;
        }
    }
    let seen = groups.seen();
    let smaller = groups.smaller_sides();
    let is_turned = |p: usize| {
        let (root, odd) = groups.parity.find(p as u32);
        match seen[root as usize].front() {
            0.0 => smaller[p],
            front => (front < 0.0) ^ odd,
        }
    };
    (0..parts.len()).map(is_turned).collect()
}

struct Groups<'a> {
    parts: &'a [Part],
    parity: Parity,
}

/// How much of a group is seen from either side, the way round that its root has.
#[derive(Clone, Copy, Default)]
struct Seen {
    area: f64,
    looked_at: f64,
    front: f64,
}

impl Seen {
    /// The area seen from the front, less that from behind, as if all of the group had been looked at; 0 if that is not plain.
    fn front(&self) -> f64 {
        if self.front.abs() * PLAINLY >= self.looked_at && self.looked_at > 0.0 {
            self.front * (self.area / self.looked_at)
        } else {
            0.0
        }
    }
}

/// A group that another one may join.
#[derive(Clone, Copy, PartialEq, PartialOrd)]
struct Offer {
    agrees: bool,
    /// Of the links for this less those against it.
    area: f64,
    group: Reverse<u32>,
    disagree: bool,
}

impl Groups<'_> {
    /// By root.
    fn seen(&mut self) -> Vec<Seen> {
        let mut seen = vec![Seen::default(); self.parts.len()];
        for (p, part) in self.parts.iter().enumerate() {
            let (root, odd) = self.parity.find(p as u32);
            let all = &mut seen[root as usize];
            all.area += part.area;
            all.looked_at += part.looked_at;
            all.front += if odd { -part.front } else { part.front };
        }
        seen
    }

    /// A round: each group joins a stronger one, if it may. Were there any?
    fn join(&mut self, links: &[Link]) -> bool {
        let seen = self.seen();
        // Roots, do they disagree, the area there.
        let mut between: Vec<([u32; 2], bool, f64)> = Vec::new();
        for Link { parts: [a, b], area } in links {
            let ((ra, pa), (rb, pb)) = (self.parity.find(*a), self.parity.find(*b));
            if ra != rb {
                between.push(([ra.min(rb), ra.max(rb)], !(pa ^ pb), *area));
            }
        }
        // A stable sort: sums are taken in the order of the links.
        between.sort_by_key(|(roots, ..)| *roots);
        let strength = |group: u32| (seen[group as usize].front().abs(), seen[group as usize].area, Reverse(group));
        let mut offers: Vec<Option<Offer>> = vec![None; self.parts.len()];
        for same in between.chunk_by(|a, b| a.0 == b.0) {
            let sum = |odd: bool| same.iter().filter(|(_, o, _)| *o == odd).map(|(.., area)| area).sum::<f64>();
            let [agree, disagree] = [sum(false), sum(true)];
            let [a, b] = same[0].0;
            let [weaker, stronger] = if strength(a) < strength(b) { [a, b] } else { [b, a] };
            let (own, others) = (seen[weaker as usize].front(), seen[stronger as usize].front());
            let agrees = (own * others == 0.0) || (own < 0.0) ^ (others < 0.0) == (disagree > agree);
            let area = (disagree - agree).abs();
            let offer = Offer { agrees, area, group: Reverse(stronger), disagree: disagree > agree };
            if (agrees || own.abs() <= STANDS * area) && offers[weaker as usize] < Some(offer) {
                offers[weaker as usize] = Some(offer);
            }
        }
        let mut any = false;
        for (group, offer) in (0..).zip(offers) {
            if let Some(Offer { group: Reverse(stronger), disagree, .. }) = offer {
                any |= self.parity.relate(group, stronger, disagree);
            }
        }
        any
    }

    /// Which parts are on the smaller side of their group, of equal sides on that with the later triangle.
    fn smaller_sides(&mut self) -> Vec<bool> {
        let of: Vec<(u32, bool)> = (0..self.parts.len() as u32).map(|p| self.parity.find(p)).collect();
        let mut sides = vec![[(0, None::<Reverse<Sample>>); 2]; of.len()];
        for (part, (root, odd)) in self.parts.iter().zip(&of) {
            let (triangles, first) = &mut sides[*root as usize][usize::from(*odd)];
            *triangles += part.triangles;
            *first = (*first).max(Some(Reverse(part.sample)));
        }
        let smaller = |(root, odd): &(u32, bool)| {
            let [even_side, odd_side] = sides[*root as usize];
            *odd != (odd_side > even_side)
        };
        of.iter().map(smaller).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Parts of these areas, of which so much is seen from the front.
    fn parts(seen: &[(f64, f64)]) -> Vec<Part> {
        let part = |(number, (area, front)): (usize, &(f64, f64))| Part {
            area: *area,
            triangles: *area as u64,
            sample: Sample { record: number as u32, in_submesh: None },
            looked_at: *area,
            front: *front,
        };
        seen.iter().enumerate().map(part).collect()
    }

    fn link(a: u32, b: u32, area: f64) -> Link {
        Link { parts: [a, b], area }
    }

    #[test]
    fn what_is_not_seen_follows_its_neighbours_and_the_smaller_side_is_turned() {
        let links = [link(0, 1, 1.0), link(1, 2, 1.0)];
        assert_eq!(turned(&parts(&[(9.0, 0.0), (4.0, 0.0), (2.0, 0.0)]), &links), [false, true, false]);
        assert_eq!(turned(&parts(&[(2.0, 0.0), (9.0, 0.0), (2.0, 0.0)]), &links), [true, false, true]);
        // The same with one that is seen from behind.
        assert_eq!(turned(&parts(&[(9.0, 0.0), (4.0, 0.0), (2.0, -2.0)]), &links), [true, false, true]);
    }

    #[test]
    fn a_few_triangles_seen_through_a_hole_are_held_by_their_neighbours() {
        // As neighbours have it, the small part is to be turned; what is seen of it says no.
        for (front, large) in [(1.0, false), (100.0, true)] {
            let parts = parts(&[(1000.0, 900.0), (front, front)]);
            assert_eq!(turned(&parts, &[link(0, 1, 3.0)]), [false, !large]);
        }
    }

    #[test]
    fn bodies_that_meet_in_an_edge_are_both_left_as_they_are_seen() {
        // Each in three parts, which disagree.
        let parts = parts(&[(10.0, 8.0), (10.0, -8.0), (1.0, 0.0), (10.0, 8.0), (10.0, -8.0), (1.0, 0.0)]);
        let links = [link(0, 1, 5.0), link(1, 2, 1.0), link(3, 4, 5.0), link(4, 5, 1.0), link(0, 3, 1.0)];
        assert_eq!(turned(&parts, &links), [false, true, false, false, true, false]);
    }

    #[test]
    fn where_neighbours_contradict_themselves_what_is_seen_decides() {
        // A ring of three cannot disagree all round.
        let ring = [link(0, 1, 5.0), link(1, 2, 5.0), link(0, 2, 5.0)];
        assert_eq!(turned(&parts(&[(8.0, 8.0), (8.0, -8.0), (8.0, 8.0)]), &ring), [false, true, false]);
        assert_eq!(turned(&parts(&[(8.0, -8.0), (8.0, 8.0), (8.0, -8.0)]), &ring), [true, false, true]);
    }
}
