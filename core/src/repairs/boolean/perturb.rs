//! Bodies that share surface but for rounding are spread apart before they are cut.
//!
//! Where the faces of two bodies lie in one plane that f32 cannot hold, as after an assembly was turned, they pass through each other in as many
//! lines as they have triangles there, and rounding makes more of them with every cut. So bodies that cross each other are grown by different
//! amounts, a few steps of f32 each: faces that lay on each other are then apart everywhere, and cut each other's sides where they end. (Simulation of
//! simplicity, Edelsbrunner & Mücke, TOG 9(1), 1990, breaks ties by infinitely small amounts, which single precision could not write.)
//!
//! Only what crosses is grown, and what is around it follows. All triangles of a body at a vertex go with it, so that directed edges stay
//! balanced; a vertex of several bodies becomes one for each.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};

use glam::{DMat3, DVec3};

use crate::contract::settings::Profile;
use crate::geometry::position::Position;
use crate::repairs::boolean::clusters::Clusters;
use crate::repairs::boolean::state::{Met, State, Tried};
use crate::submesh::Vertex;
use crate::submesh::components::{Components, Through};
use crate::util::ids::NONE;

/// By how many steps of new vertices bodies are spread at first, and the next time.
const STEPS: [f64; 2] = [8.0, 64.0];

/// What one attempt after another tries with bodies that do not come to an end.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Level {
    /// They are left where they are, and given up as soon as the first cut leaves no fewer pairs that cross.
    #[default]
    Impatient,
    Perturbed,
    PerturbedMore,
    /// They are left where they are, and not given up before it is hopeless.
    Patient,
}

impl Level {
    pub(crate) fn next(self) -> Option<Self> {
        match self {
            Self::Impatient => Some(Self::Perturbed),
            Self::Perturbed => Some(Self::PerturbedMore),
            Self::PerturbedMore => Some(Self::Patient),
            Self::Patient => None,
        }
    }

    fn steps(self) -> Option<f64> {
        match self {
            Self::Impatient | Self::Patient => None,
            Self::Perturbed => Some(STEPS[0]),
            Self::PerturbedMore => Some(STEPS[1]),
        }
    }
}

impl State<'_, '_, '_> {
    /// Spreads the sheets of these pairs whose pieces are to be. Returns what crosses then, and how far anything was moved; `None` if nothing
    /// was. O(pairs + submesh).
    pub(crate) fn perturb(&mut self, crossing: &[[u32; 2]], levels: &[Level], profile: &Profile) -> Tried<Option<(Met, f64)>> {
        let steps =
            |clusters: &Clusters, t: u32| levels.get(clusters.of_triangle[t as usize] as usize).and_then(|level| level.steps());
        let perturbed: BTreeSet<u32> =
            crossing.iter().flatten().copied().filter(|t| steps(&self.clusters, *t).is_some()).collect();
        if perturbed.is_empty() {
            return Ok(None);
        }
        self.complete(perturbed.iter().flat_map(|t| self.work.points(*t)).collect());
        let (submesh, edges) = self.work.edges();
        let sheets = Components::of(self.survey, submesh, edges, self.reversed, Through::ManifoldEdges).of_triangle;
        let ranks = ranks(crossing, &sheets);
        // By vertex and piece: where it goes.
        let mut places: BTreeMap<(Vertex, u32), Position> = BTreeMap::new();
        for t in perturbed {
            let (piece, sheet) = (self.clusters.of_triangle[t as usize], sheets[t as usize]);
            let by = f64::from(ranks.get(&sheet).copied().unwrap_or(0)) * steps(&self.clusters, t).unwrap_or(0.0) * self.step;
            for v in self.work.triangles[t as usize].v {
                let fan = || self.work.star(v).map(|(t, _)| t).filter(|t| self.clusters.of_triangle[*t as usize] == piece);
                // Where a piece goes on as another sheet, it has to stay together.
                if by > 0.0 && !places.contains_key(&(v, piece)) && fan().all(|t| sheets[t as usize] == sheet) {
                    let place = self.work.place(v) + outward(fan().map(|t| self.work.normal(t))) * by;
                    places.insert((v, piece), Position::nearest(place));
                }
            }
        }
        let mut known = self.work.by_position();
        let mut moved: BTreeMap<(Vertex, u32), Vertex> = BTreeMap::new();
        let mut farthest = 0f64;
        for ((v, piece), place) in places {
            let new = *known.entry(place).or_insert_with(|| self.work.add_vertex(place));
            if new != v {
                let by = self.work.distance(v, new);
                farthest = farthest.max(by);
                self.track.perturb(piece, by);
                moved.insert((v, piece), new);
            }
        }
        let around: BTreeSet<u32> = moved.keys().flat_map(|(v, _)| self.work.star(*v)).map(|(t, _)| t).collect();
        let first_new = self.work.triangles.len() as u32;
        for t in around {
            let piece = self.clusters.of_triangle[t as usize];
            let old = self.work.triangles[t as usize];
            let new = old.v.map(|v| moved.get(&(v, piece)).copied().unwrap_or(v));
            if new != old.v {
                self.work.kill(t);
                self.work.add(new, old.origin.of_part(), NONE);
                self.clusters.of_triangle.push(piece);
            }
        }
        self.clean(&(first_new..self.work.triangles.len() as u32).collect::<Vec<_>>());
        let met = self.met(crossing.to_vec(), profile, |t| t >= first_new)?;
        self.unite(&met.crossing);
        tracing::debug!(pairs = met.crossing.len(), farthest, "Perturbed.");
        Ok(Some((met, farthest)))
    }
}

/// Small numbers for the sheets of triangles that cross, so that no two sheets that cross each other have the same: the one with the most triangles
/// that do has 0 (greedy colouring).
fn ranks(crossing: &[[u32; 2]], sheets: &[u32]) -> BTreeMap<u32, u32> {
    let mut triangles: BTreeMap<u32, BTreeSet<u32>> = BTreeMap::new();
    let mut across: BTreeMap<u32, BTreeSet<u32>> = BTreeMap::new();
    for pair in crossing {
        let [a, b] = pair.map(|t| sheets[t as usize]);
        for (t, own, other) in [(pair[0], a, b), (pair[1], b, a)] {
            triangles.entry(own).or_default().insert(t);
            across.entry(own).or_default().extend((own != other).then_some(other));
        }
    }
    let mut order: Vec<u32> = triangles.keys().copied().collect();
    order.sort_by_key(|sheet| Reverse(triangles[sheet].len()));
    let mut ranks: BTreeMap<u32, u32> = BTreeMap::new();
    for sheet in order {
        let taken: BTreeSet<u32> = across[&sheet].iter().filter_map(|other| ranks.get(other).copied()).collect();
        ranks.insert(sheet, (0..).find(|rank| !taken.contains(rank)).unwrap_or(0));
    }
    ranks
}

/// The way by which a vertex comes out of all planes around it, of these normals as long as areas, by one, as nearly as there is such a way (least
/// squares by area), and no farther than three.
fn outward(normals: impl Iterator<Item = DVec3>) -> DVec3 {
    let (mut squares, mut sum, mut area) = (DMat3::ZERO, DVec3::ZERO, 0.0);
    for normal in normals {
        let length = normal.length();
        if length > 0.0 {
            let n = normal / length;
            squares += DMat3::from_cols(normal * n.x, normal * n.y, normal * n.z);
            sum += normal;
            area += length;
        }
    }
    if area == 0.0 {
        return DVec3::ZERO;
    }
    // Where the planes are nearly one, or two, nothing is said along them.
    let way = (squares + DMat3::from_diagonal(DVec3::splat(area * 1e-3))).inverse() * sum;
    way.clamp_length_max(3.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_vertex_comes_out_of_every_plane_around_it() {
        let corner = outward([DVec3::X, DVec3::Y * 2.0, DVec3::Y, DVec3::Z].into_iter());
        assert!(corner.distance(DVec3::ONE) < 0.01, "{corner}");
        let edge = outward([DVec3::X * 5.0, DVec3::Y].into_iter());
        assert!(edge.distance(DVec3::new(1.0, 1.0, 0.0)) < 0.01, "{edge}");
        assert!(outward([DVec3::Z, DVec3::Z * 4.0].into_iter()).distance(DVec3::Z) < 0.01);
        // The tip of a needle would go far.
        let tip = outward([DVec3::new(1.0, 0.0, 0.05), DVec3::new(-1.0, 0.0, 0.05)].into_iter());
        assert!(tip.length() <= 3.0 && tip.z > 0.0, "{tip}");
        assert_eq!(outward(std::iter::empty()), DVec3::ZERO);
    }

    #[test]
    fn sheets_that_cross_have_different_ranks_and_the_largest_part_stays() {
        // Triangles 0 to 2 are of sheet 7, which crosses 8 and 9; these cross each other, and 9 also itself.
        let sheets = [7, 7, 7, 8, 9, 9];
        let ranks = ranks(&[[0, 3], [1, 3], [2, 4], [3, 4], [4, 5]], &sheets);
        assert_eq!(ranks.into_iter().collect::<Vec<_>>(), [(7, 0), (8, 2), (9, 1)]);
    }
}
