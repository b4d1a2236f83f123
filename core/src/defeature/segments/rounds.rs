//! Regions of facets that lie on one cylinder, cone, sphere or torus.
//!
//! A region is a surface's when all its vertices lie on it, no facet spans more than 47° of it, and each facet's normal is the
//! surface's within half of that. So an octagonal prism is a cylinder, and a heptagonal one (51.4°) a prism.

use super::super::mesh::Mesh;
use super::super::surface::{Surface, meridian, radial};
use super::super::vector::{Point, add, cross, distance, dot, mean, norm, scale, sub, unit};
use super::facets::Facets;
use super::fit::{refine, worst};
use super::start;
use std::ops::Range;

/// Cosine of the largest angle between neighbouring facets: 46.5°.
pub(super) const COS_SMOOTH: f64 = 0.688;
/// Cosine of the largest angle between a facet's normal and its surface's: 24.5°.
const COS_NORMAL: f64 = 0.91;
/// 1 − cos 23.5°: how far a chord of 47° lies below its arc, in radii.
const SAGITTA: f64 = 0.083;
/// How much of the way from its middle to the region's end the largest facet may take.
const MOST_SHARE: f64 = 0.62;
/// Fits of a region that still grows.
const ROUNDS: usize = 8;
/// Seeds that may fail to be part of a torus before none is tried any more, and as many more as half of the facets of regions
/// that were found: the bound of the work on scans.
const FAILED_TORI: usize = 2_000;
/// Seeds in vain, or for little, before the search ends, and as many more: what scans cost. The largest facets come first.
const FAILED_SEEDS: usize = 4_000;
/// Facets that are looked at in one go.
const LOOK: u32 = 8_192;
/// Facets of a region that is little.
const LITTLE: usize = 12;

/// Of no region.
pub(super) const FREE: u32 = u32::MAX;

/// What a search from a facet may find.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Hope {
    None,
    Torus,
    Any,
}

/// A region that was found.
pub(super) struct Round {
    pub(super) surface: Surface,
    pub(super) facets: Vec<u32>,
    pub(super) is_concave: bool,
    /// Mean angle between the facets' normals and the surface's, by area, radians.
    deviation: f64,
    /// Largest distance of a vertex from the surface.
    pub(super) residual: f64,
}

impl Round {
    /// Whether it explains the facets better: clearly more of them, or as many by a clearly better turn of normals.
    fn is_better(&self, other: &Self) -> bool {
        let (own, its) = (self.facets.len() as f64, other.facets.len() as f64);
        own > 1.25 * its || (1.25 * own >= its && self.deviation < 0.7 * other.deviation - 1e-4)
    }
}

/// What the search knows.
pub(super) struct Rounds<'a> {
    pub(super) mesh: &'a Mesh,
    pub(super) facets: &'a Facets,
    /// The region of each facet.
    pub(super) taken: Vec<u32>,
    /// The axes of the regions.
    pub(super) axes: Vec<Option<(Point, Point)>>,
    stamps: Vec<u32>,
    stamp: u32,
    tolerance: f64,
    failed_tori: usize,
    /// Seeds that were in vain, or for little.
    failed: usize,
    /// Half of the facets of other regions.
    explained: usize,
}

impl<'a> Rounds<'a> {
    pub(super) fn new(mesh: &'a Mesh, facets: &'a Facets) -> Self {
        let count = facets.count();
        let tolerance = 4.0 * mesh.flatness();
        Self {
            mesh,
            facets,
            taken: vec![FREE; count],
            axes: Vec::new(),
            stamps: vec![0; count],
            stamp: 0,
            tolerance,
            failed_tori: 0,
            failed: 0,
            explained: 0,
        }
    }

    /// All regions, from the largest facets on. `look` tells what facets may be part of. O(n) for regions that are found, O(1)
    /// for a seed that fails.
    pub(super) fn find(mut self, look: impl Fn(&Self, Range<u32>) -> Vec<Hope>) -> Vec<Round> {
        let mut found = Vec::new();
        let mut hopes: Vec<Hope> = Vec::new();
        let count = self.facets.count() as u32;
        // Regions of few facets may be chance, and come last.
        for least in [6, 3] {
            for seed in 0..count {
                if self.failed >= FAILED_SEEDS + self.explained {
                    return found;
                }
                if hopes.len() <= seed as usize {
                    hopes.extend(look(&self, seed..count.min(seed + LOOK)));
                }
                let hope = hopes[seed as usize];
                let is_hopeless = hope == Hope::None || (hope == Hope::Torus && !self.tries_tori());
                if is_hopeless || !self.is_free(seed) {
                    continue;
                }
                let Some(round) = self.best(seed) else {
                    self.failed += 1;
                    hopes[seed as usize] = Hope::None;
                    continue;
                };
                let size = round.facets.len();
                let is_exact = round.residual <= 2.0 * self.rounding();
                self.failed += usize::from(!is_exact || size < LITTLE);
                self.explained += if is_exact { size / 2 } else { 0 };
                if size < least {
                    continue;
                }
                round.facets.iter().for_each(|facet| self.taken[*facet as usize] = found.len() as u32);
                self.axes.push(round.surface.axis());
                found.push(round);
            }
        }
        found
    }

    /// Whether a facet belongs to no region yet.
    pub(super) fn is_free(&self, facet: u32) -> bool {
        self.taken[facet as usize] == FREE
    }

    fn tries_tori(&self) -> bool {
        self.failed_tori < FAILED_TORI + self.explained
    }

    /// The largest region around a seed; among equal ones the simplest surface.
    fn best(&mut self, seed: u32) -> Option<Round> {
        let near = self.neighbours(seed);
        if near.is_empty() {
            return None;
        }
        let mut best: Option<Round> = None;
        let offer = |best: &mut Option<Round>, round: Option<Round>| {
            if let Some(round) = round
                && best.as_ref().is_none_or(|best| round.is_better(best))
            {
                *best = Some(round);
            }
        };
        let holds =
            |best: &Option<Round>, facets: &[u32]| best.as_ref().is_some_and(|b| facets.iter().all(|f| b.facets.contains(f)));
        for other in near.iter().take(4) {
            if !holds(&best, &[*other]) {
                offer(&mut best, self.cylinder(seed, *other));
            }
        }
        // Only a cylinder's facets are all turned as it is, or those of a strip of a slender torus, whose vertices lie off it.
        let rounding = 2.0 * self.rounding();
        if best.as_ref().is_some_and(|b| b.facets.len() >= LITTLE && b.deviation < 1e-3 && b.residual <= rounding) {
            return best.map(|round| self.corrected(seed, round));
        }
        for (k, one) in near.iter().enumerate().take(4) {
            for other in near.iter().skip(k + 1).take(3) {
                if !holds(&best, &[*one, *other]) {
                    offer(&mut best, self.cone(seed, *one, *other));
                }
            }
        }
        offer(&mut best, self.sphere(seed, &near));
        if self.tries_tori() {
            let torus = self.torus(seed, 14);
            let is_lost = torus.is_none();
            offer(&mut best, torus);
            // A few facets of a slender torus hardly bend around its axis.
            if is_lost && best.is_some() {
                offer(&mut best, self.torus(seed, 60));
            }
            self.failed_tori += usize::from(is_lost);
            // Triangles of a cylinder that run askew: no two of their normals tell its axis, many do. Their longest sides lead
            // along the same cylinder, shorter ones to the next one, too.
            if best.is_none() {
                let facets = self.around(seed, 12, 2);
                offer(&mut best, if facets.len() >= 6 { self.turned(seed, &facets) } else { None });
            }
        }
        best.map(|round| self.corrected(seed, round))
    }

    /// What a region is rather than the first guess: a narrow piece of a slender torus is nearly a cylinder, and two rims of a
    /// cone lie on spheres and tori, too.
    fn corrected(&mut self, seed: u32, round: Round) -> Round {
        let facets: Vec<u32> = round.facets.iter().take(400).copied().collect();
        let other = match round.surface {
            Surface::Cylinder { .. } => self.coaxial(seed, &facets),
            Surface::Sphere { .. } | Surface::Torus { .. } => self.turned(seed, &facets),
            Surface::Cone { .. } | Surface::Plane { .. } => None,
        };
        other.filter(|other| other.is_better(&round)).unwrap_or(round)
    }

    pub(super) fn ray(&self, facet: u32) -> start::Ray {
        (self.facets.centres[facet as usize], self.facets.normals[facet as usize])
    }

    fn cylinder(&mut self, seed: u32, other: u32) -> Option<Round> {
        let axis = unit(cross(self.ray(seed).1, self.ray(other).1))?;
        let points = self.points(&[seed, other]);
        let start = start::cylinder(axis, &points)?;
        self.grow(start, &[seed, other], 3)
    }

    fn cone(&mut self, seed: u32, one: u32, other: u32) -> Option<Round> {
        let points = self.points(&[one, seed, other]);
        let start = start::cone([self.ray(one), self.ray(seed), self.ray(other)], &points)?;
        self.grow(start, &[one, seed, other], 3)
    }

    /// A cone or cylinder whose axis makes one angle with the normals of facets.
    fn turned(&mut self, seed: u32, facets: &[u32]) -> Option<Round> {
        let rays: Vec<start::Ray> = facets.iter().map(|facet| self.ray(*facet)).collect();
        let points = self.points(facets);
        let size = points.iter().map(|p| distance(*p, points[0])).fold(0.0, f64::max);
        let start = refine(start::turned(&rays, &points)?, &points, size);
        self.grow(start, &[seed], 3)
    }

    fn sphere(&mut self, seed: u32, near: &[u32]) -> Option<Round> {
        let mut seeds = vec![seed];
        seeds.extend(near.iter().take(3));
        let points = self.points(&seeds);
        let start = start::sphere(&points)?;
        self.grow(start, &seeds, 6)
    }

    fn torus(&mut self, seed: u32, count: usize) -> Option<Round> {
        let seeds = self.around(seed, count, usize::MAX);
        if seeds.len() < 6 {
            return None;
        }
        let points = self.points(&seeds);
        let size = points.iter().map(|p| distance(*p, points[0])).fold(0.0, f64::max);
        let rays: Vec<start::Ray> = seeds.iter().map(|facet| self.ray(*facet)).collect();
        let start = start::torus(&rays, &points, size).map(|start| refine(start, &points, size));
        if let Some(round) = start.and_then(|start| self.grow(start, &seeds, 6)) {
            return Some(round);
        }
        self.coaxial(seed, &seeds)
    }

    /// A torus around the axis of a region beside facets: fillets of turned parts have the axis of what they round.
    fn coaxial(&mut self, seed: u32, facets: &[u32]) -> Option<Round> {
        let points = self.points(facets);
        let size = points.iter().map(|p| distance(*p, points[0])).fold(0.0, f64::max);
        for (origin, axis) in self.axes_beside(facets) {
            let start = start::coaxial(origin, axis, &points).map(|start| refine(start, &points, size));
            if let Some(round) = start.and_then(|start| self.grow(start, &[seed], 6)) {
                return Some(round);
            }
        }
        None
    }

    /// Grows and fits in turn until nothing is added. `None` where the seeds do not lie on the surface, or fewer than `least`
    /// facets do.
    fn grow(&mut self, start: Surface, seeds: &[u32], least: usize) -> Option<Round> {
        let limit = self.limit(&start);
        let points = self.points(seeds);
        let mut surface = start;
        if worst(&surface, &points) > limit {
            return None;
        }
        let first = *seeds.first()?;
        let concave = self.is_concave(&surface, first);
        let mut found: Vec<u32> = Vec::new();
        for _ in 0..ROUNDS {
            let next = self.flood(&surface, first, concave, limit);
            if next.len() <= found.len() {
                break;
            }
            found = next;
            surface = self.refined(surface, &found);
        }
        if found.len() < least {
            return None;
        }
        // Neighbours that only nearly lie on it are let go: most vertices are much nearer than the limit.
        for _ in 0..2 {
            let mut gaps: Vec<f64> = self.points(&found).iter().map(|p| surface.distance(*p).abs()).collect();
            gaps.sort_by(f64::total_cmp);
            let usual = gaps.get(gaps.len() / 2).copied().unwrap_or(0.0);
            let tight = (8.0 * usual).max(self.rounding()).min(limit);
            found = self.flood(&surface, first, concave, tight);
            surface = self.refined(surface, &found);
        }
        let points = self.points(&found);
        let residual = worst(&surface, &points);
        let is_sound = found.len() >= least
            && residual <= 2.0 * self.limit(&surface)
            && self.is_real(&surface)
            && self.is_even(&surface, &found, &points);
        let deviation = self.deviation(&surface, &found, concave);
        is_sound.then_some(Round { surface, facets: found, is_concave: concave, deviation, residual })
    }

    /// Whether it is not another, simpler surface in disguise.
    fn is_real(&self, surface: &Surface) -> bool {
        match *surface {
            Surface::Cone { angle, .. } => angle > 0.01 && angle < 1.56,
            Surface::Torus { major, minor, .. } => minor > 0.0 && major < 20.0 * self.mesh.size && major > 0.05 * minor,
            Surface::Cylinder { radius, .. } | Surface::Sphere { radius, .. } => radius > 0.0 && radius < 50.0 * self.mesh.size,
            Surface::Plane { .. } => true,
        }
    }

    /// Whether it is no chance: four points of an even trapezoid lie on a circle, the corners of a face and of the strips
    /// around it on a sphere, and three circles around an axis on a torus. The largest facet may not make up most of the
    /// region, facets of fewer than six span much the same angle, and the circles of tori are four at least.
    fn is_even(&self, surface: &Surface, facets: &[u32], points: &[Point]) -> bool {
        if let Surface::Torus { centre, axis, major, .. } = *surface {
            let mut angles: Vec<f64> =
                points.iter().map(|p| meridian(centre, axis, *p)).map(|[h, r]| h.atan2(r - major)).collect();
            angles.sort_by(f64::total_cmp);
            return angles.windows(2).filter(|w| w[1] - w[0] > 0.02).count() >= 3;
        }
        let away = |p: Point| match (surface.axis(), *surface) {
            (Some((origin, axis)), _) => unit(radial(origin, axis, p)).unwrap_or([0.0; 3]),
            (None, Surface::Sphere { centre, .. }) => unit(sub(p, centre)).unwrap_or([0.0; 3]),
            _ => [0.0; 3],
        };
        let angle = |a: Point, b: Point| norm(sub(a, b)).clamp(0.0, 2.0);
        let half = |facet: &u32| {
            let middle = away(self.facets.centres[*facet as usize]);
            let corners = self.facets.triangles(*facet).iter().flat_map(|t| self.mesh.triangles[*t as usize]);
            (corners.map(|v| angle(away(self.mesh.at(v)), middle)).fold(0.0, f64::max), middle)
        };
        let halves: Vec<(f64, Point)> = facets.iter().map(half).collect();
        let low = halves.iter().map(|h| h.0).fold(f64::INFINITY, f64::min);
        let Some((high, middle)) = halves.iter().copied().max_by(|a, b| a.0.total_cmp(&b.0)) else { return false };
        let reach = points.iter().map(|p| angle(away(*p), middle)).fold(0.0, f64::max);
        high <= MOST_SHARE * reach && (facets.len() >= 6 || high <= 2.2 * low)
    }

    fn deviation(&self, surface: &Surface, facets: &[u32], concave: bool) -> f64 {
        let (mut sum, mut total) = (0.0, 0.0);
        for facet in facets {
            let normal = self.facets.normals[*facet as usize];
            for triangle in self.facets.triangles(*facet) {
                let area = self.mesh.areas[*triangle as usize];
                let cosine = dot(surface.gradient(self.mesh.centroid(*triangle)), normal) * if concave { -1.0 } else { 1.0 };
                sum += area * cosine.clamp(-1.0, 1.0).acos();
                total += area;
            }
        }
        sum / f64::max(total, 1e-300)
    }

    /// What rounding to f32 leaves, twice over.
    fn rounding(&self) -> f64 {
        self.mesh.reach * 4.8e-7
    }

    pub(super) fn limit(&self, surface: &Surface) -> f64 {
        surface.radius().map_or(self.tolerance, |radius| self.tolerance.min(0.02 * radius))
    }

    pub(super) fn is_concave(&self, surface: &Surface, facet: u32) -> bool {
        let (centre, normal) = self.ray(facet);
        dot(surface.gradient(centre), normal) < 0.0
    }

    fn refined(&self, surface: Surface, facets: &[u32]) -> Surface {
        let points = self.points(facets);
        let size = points.iter().map(|p| distance(*p, points[0])).fold(0.0, f64::max);
        if size > 0.0 { refine(surface, &points, size) } else { surface }
    }

    fn flood(&mut self, surface: &Surface, seed: u32, concave: bool, limit: f64) -> Vec<u32> {
        self.stamp += 1;
        let stamp = self.stamp;
        if !self.lies_on(surface, seed, concave, limit) {
            return Vec::new();
        }
        self.stamps[seed as usize] = stamp;
        let mut found = vec![seed];
        let mut next = 0;
        while let Some(&facet) = found.get(next) {
            next += 1;
            for triangle in self.facets.triangles(facet) {
                for half in 3 * triangle..3 * triangle + 3 {
                    let other = self.facets.of[self.mesh.across(half) as usize];
                    if self.taken[other as usize] != FREE || self.stamps[other as usize] == stamp {
                        continue;
                    }
                    if dot(self.ray(facet).1, self.ray(other).1) >= COS_SMOOTH && self.lies_on(surface, other, concave, limit) {
                        self.stamps[other as usize] = stamp;
                        found.push(other);
                    }
                }
            }
        }
        found
    }

    pub(super) fn lies_on(&self, surface: &Surface, facet: u32, concave: bool, limit: f64) -> bool {
        let normal = self.facets.normals[facet as usize];
        let side = if concave { -1.0 } else { 1.0 };
        self.facets.triangles(facet).iter().all(|t| {
            let corners = self.mesh.triangles[*t as usize].map(|v| self.mesh.at(v));
            // The middle of a ring around the axis, the crest of a torus, lies on no surface: each triangle has its own.
            side * dot(surface.gradient(mean(&corners)), normal) >= COS_NORMAL
                && corners.iter().all(|p| surface.distance(*p).abs() <= limit)
                && (0..3).all(|k| {
                    let middle = scale(add(corners[k], corners[(k + 1) % 3]), 0.5);
                    let way = unit(sub(corners[(k + 1) % 3], corners[k])).unwrap_or([0.0; 3]);
                    surface.distance(middle).abs() <= SAGITTA * reach(surface, middle, way) + limit
                })
        })
    }
}

/// The radius in which a chord's span is measured.
fn reach(surface: &Surface, point: Point, way: Point) -> f64 {
    match *surface {
        Surface::Cylinder { radius, .. } | Surface::Sphere { radius, .. } => radius,
        Surface::Torus { centre, axis, major, minor } => {
            let around = unit(cross(axis, radial(centre, axis, point))).map_or(0.0, |t| dot(t, way).powi(2));
            minor + around * major
        }
        Surface::Cone { apex, axis, .. } => norm(radial(apex, axis, point)),
        Surface::Plane { .. } => 0.0,
    }
}
