//! Are the bodies of a file still inside of what a repair makes of it?
//!
//! Sums of volumes do not tell: bodies that overlap become one, rightly, and what counted twice counts once then; a body that was lost looks the
//! same. What must not happen is that material leaves the model. So points of every body are kept, its **probes**, once all is closed and
//! turned outward and before anything is cut, removed or replaced. In the end each must lie where the winding number of what is
//! written is positive. That is exact of each point; what it says of volume is an estimate: a body's volume times the share of its probes that
//! are outside.
//!
//! A probe lies in material from the start: where its own body winds around it, and all closed pieces together do, so that no cavity holds it.
//!
//! Nor may hollow space fill up without a word: so cavities have probes, too, and one of which every probe lies in material in the end is filled.

use std::collections::BTreeSet;

use glam::DVec3;

use crate::contract::report::{BodyLost, MOST_LISTED, Volumes};
use crate::detect::bodies;
use crate::geometry::sums::Bounds;
use crate::io::record;
use crate::submesh::Submesh;
use crate::submesh::components::{Component, Components, Reversed, Sample};
use crate::topology::survey::Survey;

/// Bodies of less than this share of the volume of all are not looked for.
const LEAST_SHARE: f64 = 1e-6;

/// Bodies that are looked for: the largest.
const MOST_BODIES: usize = 1 << 12;

/// Points of a body's box that are tried: so many of one, and of all bodies together. Those that lie in it are probes.
const IN_BOX: [usize; 2] = [8, 1 << 12];

/// Depths below its first triangle that are tried, likewise, and at least. The first that lies in it is a probe.
const DEPTHS: [usize; 2] = [16, 1 << 13];
const LEAST_DEPTHS: usize = 4;

/// The least depth, against the diagonal of its box.
const LEAST_DEPTH: f64 = 1.0 / 65_536.0;

/// Cavities of less than this share of what all bodies enclose are not looked for; of others so many, the largest.
const LEAST_CAVITY: f64 = 1e-3;
const MOST_CAVITIES: usize = 256;

/// Points of a cavity's box that are tried.
const IN_CAVITY: usize = 32;

/// A body or a cavity, and where its probes are among all.
struct Body {
    bounds: Bounds,
    volume: f64,
    probes: std::ops::Range<usize>,
}

/// The probes of all bodies and cavities, the largest first.
pub(crate) struct Probes {
    bodies: Vec<Body>,
    cavities: Vec<Body>,
    points: Vec<[f64; 3]>,
}

impl Probes {
    /// Of the closed `pieces`: bodies enclose positive volume, cavities negative. Reads the chunks of the file above the points that are tried.
    pub(crate) fn of(survey: &Survey<'_>, submesh: &Submesh, reversed: &Reversed, pieces: &Components) -> Self {
        let mut probes = Self::of_bodies(survey, submesh, reversed, pieces);
        probes.take_cavities(survey, submesh, reversed, pieces);
        probes
    }

    /// Points in cavities, whatever else lies there.
    fn take_cavities(&mut self, survey: &Survey<'_>, submesh: &Submesh, reversed: &Reversed, pieces: &Components) {
        let all: f64 = self.bodies.iter().map(|body| body.volume).sum();
        let closed = (0..).zip(&pieces.list).filter(|(_, piece)| !piece.open);
        let mut list: Vec<(u32, f64)> = closed
            .map(|(number, piece)| (number, -survey.measure.volume(piece.extent)))
            .filter(|(_, volume)| *volume > LEAST_CAVITY * all)
            .collect();
        list.sort_by(|a, b| b.1.total_cmp(&a.1));
        list.truncate(MOST_CAVITIES);
        if list.is_empty() {
            return;
        }
        let bounds = |number: u32| &pieces.list[number as usize].bounds;
        let tried: Vec<[f64; 3]> = list.iter().flat_map(|(number, _)| points_in(bounds(*number), IN_CAVITY)).collect();
        let around = bodies::surfaces_around(survey, submesh, pieces, reversed, &tried);
        let tried: Vec<_> = tried.into_iter().zip(around).collect();
        for ((number, volume), tried) in list.into_iter().zip(tried.chunks(IN_CAVITY)) {
            let first = self.points.len();
            let is_in = |around: &[(u32, i32)]| around.iter().any(|(piece, winding)| *piece == number && *winding < 0);
            self.points.extend(tried.iter().filter(|(_, around)| is_in(around)).map(|(point, _)| *point));
            if self.points.len() > first {
                let bounds = bounds(number).normalised();
                self.cavities.push(Body { bounds, volume, probes: first..self.points.len() });
            }
        }
    }

    fn of_bodies(survey: &Survey<'_>, submesh: &Submesh, reversed: &Reversed, pieces: &Components) -> Self {
        let volume = |piece: &Component| survey.measure.volume(piece.extent);
        let mut list: Vec<(u32, f64)> = (0..)
            .zip(&pieces.list)
            .filter(|(_, piece)| !piece.open && piece.extent.volume > 0)
            .map(|(number, piece)| (number, volume(piece)))
            .collect();
        let all: f64 = list.iter().map(|(_, volume)| volume).sum();
        list.retain(|(_, volume)| *volume > LEAST_SHARE * all);
        list.sort_by(|a, b| b.1.total_cmp(&a.1));
        list.truncate(MOST_BODIES);
        let turned = survey.regions.iter().zip(&reversed.regions).filter(|(_, turned)| **turned);
        let turned: BTreeSet<u32> = turned.map(|(region, _)| region.first).collect();
        let share = |[one, all]: [usize; 2]| one.min(all / list.len().max(1));
        let (in_box, depths) = (share(IN_BOX), share(DEPTHS).max(LEAST_DEPTHS));
        let candidates = |number: u32| {
            let piece = &pieces.list[number as usize];
            points_in(&piece.bounds, in_box).chain(points_below(survey, submesh, &turned, piece, depths)).collect()
        };
        let tried: Vec<Vec<[f64; 3]>> = list.iter().map(|(number, _)| candidates(*number)).collect();
        let mut around = bodies::surfaces_around(survey, submesh, pieces, reversed, &tried.concat()).into_iter();
        let mut probes = Self { bodies: Vec::new(), cavities: Vec::new(), points: Vec::new() };
        for ((number, volume), tried) in list.into_iter().zip(tried) {
            let first = probes.points.len();
            let mut is_deep = false;
            for (k, (point, around)) in tried.into_iter().zip(around.by_ref()).enumerate() {
                let own = around.iter().find(|(piece, _)| *piece == number).map_or(0, |(_, winding)| *winding);
                let is_inside = own > 0 && around.iter().map(|(_, winding)| winding).sum::<i32>() > 0;
                let is_below = k >= in_box;
                if is_inside && !(is_below && is_deep) {
                    probes.points.push(point);
                    is_deep |= is_below;
                }
            }
            if probes.points.len() > first {
                let bounds = pieces.list[number as usize].bounds.normalised();
                probes.bodies.push(Body { bounds, volume, probes: first..probes.points.len() });
            }
        }
        probes
    }

    /// Which of them are outside of what is closed now, and of what was `wrapped`. Reads the chunks of the file above them.
    pub(crate) fn look_for(
        &self,
        survey: &Survey<'_>,
        submesh: &Submesh,
        reversed: &Reversed,
        pieces: &Components,
        wrapped: &[[[f32; 3]; 3]],
    ) -> Volumes {
        let mut windings = bodies::windings(survey, submesh, pieces, reversed, &self.points);
        windings.iter_mut().zip(bodies::windings_of(wrapped, &self.points)).for_each(|(all, more)| *all += more);
        let points = self.bodies.last().map_or(0, |body| body.probes.end) as u64;
        let mut found = Volumes { bodies: self.bodies.len() as u64, points, ..Volumes::default() };
        for body in &self.bodies {
            let outside = windings[body.probes.clone()].iter().filter(|winding| **winding < 1).count();
            found.volume += body.volume;
            found.outside += body.volume * outside as f64 / body.probes.len() as f64;
            if outside == body.probes.len() {
                found.lost += 1;
                if found.listed.len() < MOST_LISTED {
                    let Body { bounds, volume, .. } = body;
                    found.listed.push(BodyLost { bounds: [bounds.lo, bounds.hi], volume: *volume });
                }
            }
        }
        for cavity in self.cavities.iter().filter(|cavity| windings[cavity.probes.clone()].iter().all(|winding| *winding > 0)) {
            let Body { bounds, volume, .. } = cavity;
            found.filled += volume;
            found.filled_listed.push(BodyLost { bounds: [bounds.lo, bounds.hi], volume: *volume });
        }
        found
    }
}

/// Points of a box, spread evenly.
fn points_in(bounds: &Bounds, count: usize) -> impl Iterator<Item = [f64; 3]> {
    // The golden ratio's successor for three dimensions (M. Roberts, "The unreasonable effectiveness of quasirandom sequences", 2018).
    const STEPS: [f64; 3] = [0.819_172_513_396_164_4, 0.671_043_606_703_789_2, 0.549_700_477_901_970_3];
    let sides = [0, 1, 2].map(|k| [bounds.lo[k], bounds.hi[k]].map(f64::from));
    (1..=count).map(move |i| {
        std::array::from_fn(|k| {
            let [lo, hi] = sides[k];
            lo + (hi - lo) * (0.5 + i as f64 * STEPS[k]).fract()
        })
    })
}

/// Points below the first triangle of a body, from the deepest, half of its size, to the least deep. `turned`: the first records of regions
/// that are.
fn points_below(
    survey: &Survey<'_>,
    submesh: &Submesh,
    turned: &BTreeSet<u32>,
    piece: &Component,
    count: usize,
) -> impl Iterator<Item = [f64; 3]> {
    let Sample { record, in_submesh } = piece.sample;
    let corners = in_submesh.map_or_else(|| record::corners(&survey.records[record as usize]), |t| submesh.points(t));
    let from = DVec3::from_array(bodies::inner_point(&corners));
    let [a, b, c] = corners.map(|p| DVec3::from_array(p.map(f64::from)));
    // Triangles of the submesh are turned in place.
    let turn = if in_submesh.is_none() && turned.contains(&record) { -1.0 } else { 1.0 };
    let normal = (b - a).cross(c - a).normalize_or_zero() * turn;
    let mut depth = 0.5 * piece.bounds.diagonal();
    // Halved, and halved again where few are to come as far.
    let step = (1..=16).find(|halvings| 0.5f64.powi(halvings * count as i32) <= LEAST_DEPTH).unwrap_or(16);
    (0..count).map(move |_| {
        let point = from - normal * depth;
        depth *= 0.5f64.powi(step);
        point.to_array()
    })
}

#[cfg(test)]
mod tests {

    use super::*;
    use crate::repairs::shared::pieces;
    use crate::repairs::shared::work::Work;
    use crate::testing::{Corners, cuboid, diagnose, records, reversed, shifted};

    /// What is found of a mesh once `change` was done to its regions, and these triangles were wrapped.
    fn found(mesh: &[Corners], wrapped: &[Corners], change: impl Fn(&mut Reversed)) -> Volumes {
        let records = records(mesh);
        let mut d = diagnose(&records);
        let work = &mut Work::new(&mut d.submesh);
        let mut turned = Reversed::none(&d.survey);
        let pieces = pieces::pieces(&d.survey, work, &turned);
        let probes = Probes::of(&d.survey, work, &turned, &pieces);
        change(&mut turned);
        let pieces = pieces::pieces(&d.survey, work, &turned);
        probes.look_for(&d.survey, work, &turned, &pieces, wrapped)
    }

    fn small() -> Vec<Corners> {
        cuboid([0.0; 3], [1.0; 3])
    }

    /// A small cube, and a larger one beside it.
    fn two() -> Vec<Corners> {
        [small(), cuboid([4.0; 3], [6.0; 3])].concat()
    }

    #[test]
    fn a_body_that_goes_is_missed() {
        let all = found(&two(), &[], |_| ());
        assert_eq!((all.bodies, all.volume, all.outside, all.lost), (2, 9.0, 0.0, 0));
        assert!(all.points > 2, "{all:?}");
        let less = found(&two(), &[], |turned| turned.dropped[0] = true);
        assert_eq!((less.outside, less.lost), (1.0, 1));
        assert_eq!(less.listed, [BodyLost { bounds: [[0.0; 3], [1.0; 3]], volume: 1.0 }]);
        // Or is inside out.
        assert_eq!(found(&two(), &[], |turned| turned.regions[1] = true).outside, 8.0);
        let wrapped = found(&two(), &small(), |turned| turned.dropped[0] = true);
        assert_eq!((wrapped.outside, wrapped.lost), (0.0, 0));
    }

    /// Two cubes that share half of each: one of them gone, half of it is outside.
    #[test]
    fn what_lies_in_another_body_has_not_left() {
        let around = [small(), cuboid([-1.0; 3], [2.0; 3])].concat();
        assert_eq!(found(&around, &[], |turned| turned.dropped[0] = true).outside, 0.0);
        let across = [small(), shifted(&small(), [0.5, 0.0, 0.0])].concat();
        let half = found(&across, &[], |turned| turned.dropped[1] = true);
        assert!(half.lost == 0 && half.outside > 0.25 && half.outside < 0.75, "{half:?}");
    }

    #[test]
    fn a_cavity_is_no_body_and_holds_no_probe() {
        let hollow = [cuboid([0.0; 3], [8.0; 3]), reversed(&cuboid([0.25; 3], [7.75; 3]))].concat();
        let kept = found(&hollow, &[], |_| ());
        assert_eq!((kept.bodies, kept.outside, kept.lost), (1, 0.0, 0));
        assert!(kept.points > 0);
    }

    /// A cavity is filled by a body that takes all of it, and not by one that passes through.
    #[test]
    fn a_cavity_that_becomes_material_is_missed() {
        let hollow = [cuboid([0.0; 3], [8.0; 3]), reversed(&cuboid([1.0; 3], [7.0; 3]))].concat();
        let gone = found(&hollow, &[], |turned| turned.dropped[1] = true);
        assert_eq!((gone.filled, gone.outside), (216.0, 0.0));
        assert_eq!(gone.filled_listed, [BodyLost { bounds: [[1.0; 3], [7.0; 3]], volume: 216.0 }]);
        let through = cuboid([3.0, 3.0, 0.5], [5.0, 5.0, 7.5]);
        assert_eq!(found(&hollow, &through, |_| ()).filled, 0.0);
        assert_eq!(found(&hollow, &cuboid([0.5; 3], [7.5; 3]), |_| ()).filled, 216.0);
    }

    /// The deepest points are too deep in a plate; some are not.
    #[test]
    fn a_thin_plate_has_a_probe() {
        let plate = cuboid([0.0; 3], [64.0, 64.0, 0.0625]);
        let kept = found(&plate, &[], |_| ());
        assert!(kept.bodies == 1 && kept.points > 0, "{kept:?}");
        assert_eq!(found(&plate, &[], |turned| turned.dropped[0] = true).lost, 1);
    }
}
