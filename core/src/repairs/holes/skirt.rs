//! Shapes stacked on one another whose lower end is open: the rim is let down along its own surface until all of it is inside of what it
//! stands on, so that the two can be cut along each other.
//!
//! After Yang et al. 2021 (Computer Science and Application 11(4), section 3, step 5) and the patent of the same group: stacked shapes are trimmed, are being
//! trimmed, and are trimmed along the circumferential normal, all at once. Neither source says more. For closed shapes, and for
//! open ones that end inside of another, all three are what the exact arrangement does (`resolve`): what either has inside of the other
//! goes, and both end on the curve where they meet. What that does not reach is a rim that was drawn *on* the other surface: between its
//! vertices it runs above the facets here and below them there, or hovers over all of them, and what closes it leaves slits and crumbs. Hence the
//! third trim: a strip along the rim, in the direction that the surface has there across its edge, in which it would have gone on.
//!
//! A rim is let down if it points one way on the whole, and if from each of its edges, in two places, a segment from a reach behind it to
//! one and a half in front meets another component exactly once, the same one everywhere, within a reach. So one that stands off farther somewhere stays as it
//! is, and so does one on a wall that is thinner than that. The strip ends half a reach below the deepest of these points.
//! All rims of a file are asked together: one search of the file for what they meet.
//!
//! Only on request ([`Profile::stack_gap_relative`]): rims that merely run along other surface are let down as well. Over a hollow in what it
//! stands on, the patch that closes the strip may leave a pocket, a small cavity.

use crate::contract::report::RepairName;
use crate::geometry::distance::place;
use crate::repairs::shared::context::{Changes, Done, Repair};
use glam::DVec3;

use crate::contract::settings::{Bodies, Profile};
use crate::detect::holes::loops::{self, Loop};
use crate::geometry::position::Position;
use crate::geometry::sums::step_at;
use crate::geometry::tri_tri::Triangle as Corners;
use crate::repairs::shared::overlay::{Held, Overlay, Standing, Which};
use crate::repairs::shared::pieces::components_of_records;
use crate::repairs::shared::work::Work;
use crate::submesh::components::{Components, Reversed, Through};
use crate::submesh::{Origin, Submesh, Vertex};
use crate::topology::survey::Survey;
use crate::util::ids::NONE;

/// Open shapes that stand on other surface.
pub(crate) const REPAIR: Repair = Repair {
    name: RepairName::Skirt,
    changes: Changes::Surface,
    run: |cx| {
        let seated = let_down(cx.survey, &mut cx.work, &cx.reversed, cx.profile);
        cx.handed.has_skirts |= seated > 0;
        Ok(Done::count(seated, "rims of open shapes that stand on other surface, let down into it"))
    },
};

/// A rim points one way if the directions across its edges add up to this share of their number at least: that of a flat sheet or of a hole
/// in a wall points all ways, that of a shape with steep walls one.
const ONE_WAY: f64 = 0.5;

/// Where an edge is asked, of no symmetry, so that segments do not run through the edges of what they meet.
const PLACES: [f64; 2] = [0.289_7, 0.717_3];

/// Behind the rim and in front of it, in reaches.
const BEHIND: f64 = 1.0;
const IN_FRONT: f64 = 1.5;

/// At a corner of a rim the strip is longer, so that its sides keep their direction; by this factor at most.
const MOST_AT_CORNERS: f64 = 2.0;

/// Steps of single precision, at the largest coordinate, that a reach must have for directions to mean anything.
const STEPS: f64 = 64.0;

/// A rim, and which way it goes on.
struct Candidate {
    vertices: Vec<Vertex>,
    triangles: Vec<u32>,
    component: u32,
    /// For each edge, the direction across it in its triangle's plane, away from the triangle.
    across: Vec<DVec3>,
    /// For each vertex, the same, longer at corners.
    onward: Vec<DVec3>,
}

/// Lets rims down into what they stand on; how many. O(rims), and a look at the chunks around them.
pub(crate) fn let_down(survey: &Survey<'_>, work: &mut Work<'_>, reversed: &Reversed, profile: &Profile) -> u64 {
    let reach = profile.stack_gap_relative * survey.bounds.diagonal();
    let is_wanted = profile.fill_holes && profile.resolve_crossings && profile.bodies != Bodies::Keep;
    let is_told_apart = reach > STEPS * step_at(survey.bounds.largest_coordinate());
    if !is_wanted || !is_told_apart || survey.crossing_pairs.is_none() {
        return 0;
    }
    let (submesh, edges) = work.edges();
    let mut candidates: Vec<Candidate> = loops::find(submesh, edges)
        .into_iter()
        .filter(|rim| !rim.branches && rim.vertices.len() as u64 <= u64::from(profile.max_hole_edges))
        .filter_map(|rim| Candidate::of(submesh, rim))
        .collect();
    if candidates.is_empty() {
        return 0;
    }
    let components = Components::of(survey, submesh, edges, reversed, Through::EveryEdge);
    for candidate in &mut candidates {
        candidate.component = components.of_triangle[candidate.triangles[0] as usize];
    }
    let Some(met) = met(survey, submesh, reversed, &components, &candidates, reach) else { return 0 };
    let depths: Vec<Option<f64>> = candidates.iter().zip(met).map(|(rim, met)| rim.depth(submesh, &met, reach)).collect();
    let mut count = 0;
    for (rim, depth) in candidates.iter().zip(depths).filter_map(|(rim, depth)| Some((rim, depth?))) {
        rim.extend(work, depth);
        count += 1;
    }
    count
}

/// What the surface in front of a rim meets.
#[derive(Default)]
struct Met {
    /// By edge, the triangle's corners, and its component.
    triangles: Vec<(u32, Corners, u32)>,
}

/// For each rim the triangles of other components near each of its edges; `None` if that is too much to tell.
fn met(
    survey: &Survey<'_>,
    submesh: &Submesh,
    reversed: &Reversed,
    components: &Components,
    candidates: &[Candidate],
    reach: f64,
) -> Option<Vec<Met>> {
    let overlay = Overlay::of(survey, submesh, reversed)?;
    // Two triangles an edge, which stand in for the strip.
    let mut of_probe: Vec<(u32, u32)> = Vec::new();
    let mut probes: Vec<Corners> = Vec::new();
    for (c, rim) in (0..).zip(candidates) {
        for (e, [a, b, c_, d]) in (0..).zip(rim.probes(submesh, reach)) {
            probes.extend([[a, b, c_], [a, c_, d]]);
            of_probe.extend([(c, e); 2]);
        }
    }
    let probes: Vec<(u32, Corners)> = (0..).zip(probes).collect();
    let pairs = overlay.met_by_others(survey, submesh, (probes.len() as u32, &probes), |_| true, |_| false)?;
    let mut hits: Vec<((u32, u32), Standing)> = pairs
        .into_iter()
        .filter_map(|pair| match pair {
            [Held::Other(probe), Held::Surface(other)] | [Held::Surface(other), Held::Other(probe)] => {
                Some((of_probe[probe as usize], other))
            }
            _ => None,
        })
        .collect();
    hits.sort_unstable();
    hits.dedup();
    let records = hits.iter().filter_map(|(_, other)| overlay.record_of(*other));
    let of_record = components_of_records(survey, submesh, components, records);
    let mut met: Vec<Met> = candidates.iter().map(|_| Met::default()).collect();
    for ((rim, edge), other) in hits {
        let component = match overlay.which(other) {
            Which::Submesh(t) => components.of_triangle[t as usize],
            Which::Record(record) => of_record.get(&record).copied().unwrap_or(NONE),
        };
        if component != candidates[rim as usize].component {
            met[rim as usize].triangles.push((edge, overlay.corners(survey, submesh, other), component));
        }
    }
    Some(met)
}

impl Candidate {
    /// `None`: the rim does not point one way.
    fn of(submesh: &Submesh, rim: Loop) -> Option<Self> {
        let apexes = rim.apexes(submesh);
        let Loop { vertices, triangles, .. } = rim;
        let n = vertices.len();
        let mut across = Vec::with_capacity(n);
        let (mut sum, mut length) = (DVec3::ZERO, 0.0);
        for i in 0..n {
            let (from, along) = (submesh.place(vertices[i]), submesh.vector(vertices[i], vertices[(i + 1) % n]));
            let inward = place(apexes[i]?) - from;
            let outward = along * (inward.dot(along) / along.length_squared()) - inward;
            let direction = outward.try_normalize()?;
            sum += direction * along.length();
            length += along.length();
            across.push(direction);
        }
        if sum.length() < ONE_WAY * length {
            return None;
        }
        let onward = (0..n).map(|i| {
            let (a, b) = (across[(i + n - 1) % n], across[i]);
            let middle = (a + b).try_normalize()?;
            Some(middle / middle.dot(b).max(1.0 / MOST_AT_CORNERS))
        });
        let onward = onward.collect::<Option<Vec<DVec3>>>()?;
        Some(Self { vertices, triangles, component: NONE, across, onward })
    }

    /// A quadrangle for each edge, from behind it to in front of it.
    fn probes(&self, submesh: &Submesh, reach: f64) -> impl Iterator<Item = [[f32; 3]; 4]> {
        let n = self.vertices.len();
        (0..n).map(move |i| {
            let [a, b] = [i, (i + 1) % n].map(|k| submesh.place(self.vertices[k]));
            let by = self.across[i] * reach;
            [a - by * BEHIND, b - by * BEHIND, b + by * IN_FRONT, a + by * IN_FRONT].map(|p| Position::nearest(p).coordinates())
        })
    }

    /// How deep a strip must go to end inside of what the rim stands on; `None` if it stands on nothing.
    fn depth(&self, submesh: &Submesh, met: &Met, reach: f64) -> Option<f64> {
        let n = self.vertices.len();
        let mut rest = &met.triangles[..];
        let (mut below, mut deepest) = (None, 0.0f64);
        for i in 0..n {
            let (own, others) = rest.split_at(rest.partition_point(|(edge, _, _)| *edge == i as u32));
            rest = others;
            let [a, b] = [i, (i + 1) % n].map(|k| submesh.place(self.vertices[k]));
            for share in PLACES {
                let from = a + (b - a) * share;
                let mut hits = own.iter().filter_map(|(_, corners, component)| {
                    let at = hit(from, self.across[i], corners)? / reach;
                    (-BEHIND..=IN_FRONT).contains(&at).then_some((at, *component))
                });
                let (at, component) = hits.next().filter(|_| hits.next().is_none())?;
                if at > 1.0 || *below.get_or_insert(component) != component {
                    return None;
                }
                deepest = deepest.max(at);
            }
        }
        Some((deepest + IN_FRONT - 1.0) * reach)
    }

    /// Adds a strip of this width along the rim, which turns with its surface.
    fn extend(&self, work: &mut Work<'_>, depth: f64) {
        let n = self.vertices.len();
        let ends: Vec<Vertex> = (0..n)
            .map(|i| {
                let end = work.place(self.vertices[i]) + self.onward[i] * depth;
                work.add_vertex(Position::nearest(end))
            })
            .collect();
        for i in 0..n {
            let next = (i + 1) % n;
            // In the direction of a patch.
            let [a, b] = [self.vertices[i], self.vertices[next]];
            work.add([a, b, ends[next]], Origin::Added(RepairName::Skirt), NONE);
            work.add([a, ends[next], ends[i]], Origin::Added(RepairName::Skirt), NONE);
        }
    }
}

/// How far from a point, in a direction of length 1, a triangle's plane is met inside of it (Möller & Trumbore, JGT 2(1), 1997). Rounded: what it says of a
/// ray through an edge may be wrong, and the rim then stays as it is.
fn hit(from: DVec3, direction: DVec3, corners: &Corners) -> Option<f64> {
    let [a, b, c] = corners.map(place);
    let (u, v) = (b - a, c - a);
    let p = direction.cross(v);
    let determinant = u.dot(p);
    if determinant == 0.0 {
        return None;
    }
    let t = from - a;
    let x = t.dot(p) / determinant;
    let q = t.cross(u);
    let y = direction.dot(q) / determinant;
    (x >= 0.0 && y >= 0.0 && x + y <= 1.0).then(|| v.dot(q) / determinant)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::contract::progress::Quiet;
    use crate::contract::settings::Limits;
    use crate::geometry::arrange::Exact;
    use crate::repairs::boolean::resolve;
    use crate::repairs::holes::fill;
    use crate::repairs::orient::directions;
    use crate::repairs::shared::pieces;
    use crate::testing::{After, Corners, after, cuboid, plate, reversed, shifted};

    /// How many rims were let down, once what they are part of was closed, turned and cut as in a repair.
    fn seated_by(mesh: &[Corners], profile: &Profile) -> After<u64> {
        after(mesh, |d, turned| {
            let work = &mut Work::new(&mut d.submesh);
            directions::make_coherent(&d.survey, work, turned, &[]);
            let seated = let_down(&d.survey, work, turned, profile);
            fill::fill_loops(&d.survey, work, turned, &d.tolerance, (profile, None), 1);
            let pieces = pieces::pieces(&d.survey, work, turned);
            directions::make_outward(&d.survey, work, turned, &pieces);
            let limits = Limits { threads: 1, ..Limits::default() };
            let means = resolve::Means { path: Path::new("test"), limits: &limits, progress: &Quiet };
            resolve::resolve(&Exact, &mut d.survey, work, turned, profile, true, &means).unwrap();
            seated
        })
    }

    /// A profile that asks for it.
    fn asking() -> Profile {
        Profile { stack_gap_relative: 1e-3, ..Profile::default() }
    }

    fn seated(mesh: &[Corners]) -> After<u64> {
        seated_by(mesh, &asking())
    }

    /// What shapes stand on; a reach is a little more than 0.01.
    fn sole() -> Vec<Corners> {
        cuboid([0.0; 3], [8.0, 8.0, 2.0])
    }

    /// A box without its bottom.
    fn shape(lo: [f32; 3], hi: [f32; 3]) -> Vec<Corners> {
        cuboid(lo, hi).split_off(2)
    }

    #[test]
    fn a_shape_that_hovers_comes_to_stand() {
        for z in [2.005, 2.0, 1.995] {
            let got = seated(&[sole(), shape([2.0, 2.0, z], [4.0, 4.0, 4.0])].concat());
            assert_eq!((got.result, got.defects.bodies), (1, 1), "from {z}");
            assert!(got.verdict.good && (got.defects.volume - 136.0).abs() < 1e-4, "{:?}, {}", got.verdict, got.defects.volume);
        }
    }

    #[test]
    fn all_shapes_of_a_file_are_let_down_whichever_way_round_they_are() {
        let others = [
            shape([5.0, 5.0, 2.005], [7.0, 7.0, 3.0]),
            reversed(&shape([1.0, 5.0, 2.001], [3.0, 7.0, 3.0])),
            // Onto a side.
            shape([0.0; 3], [1.0, 1.0, 2.0]).iter().map(|t| t.map(|[x, y, z]| [z + 8.005, x + 2.0, y + 0.5])).collect(),
        ]
        .concat();
        let got = seated(&[shape([2.0, 2.0, 1.9], [4.0, 4.0, 4.0]), others, sole()].concat());
        // One ends inside of the sole already.
        assert_eq!((got.result, got.defects.bodies), (3, 1));
        let volume = 128.0 + 8.0 + 4.0 + 4.0 + 2.005;
        assert!(got.verdict.good && (got.defects.volume - volume).abs() < 1e-3, "{:?}, {}", got.verdict, got.defects.volume);
    }

    #[test]
    fn a_rim_drawn_on_a_ridge_is_sunk_in_it() {
        // Between the rim's corners, which lie on the surface, the ridge stands out above it.
        let ridge = |p: [f32; 3]| if p[2] == 2.0 && p[1] == 4.0 { [p[0], p[1], 2.01] } else { p };
        let halves = [cuboid([0.0; 3], [8.0, 4.0, 2.0]), cuboid([0.0, 4.0, 0.0], [8.0, 8.0, 2.0])];
        // Without the walls in between.
        let halves = halves.concat().into_iter().filter(|t| t.iter().any(|p| p[1] != 4.0));
        let roof: Vec<Corners> = halves.map(|t| t.map(ridge)).collect();
        let got = seated(&[roof, shape([2.0, 2.0, 2.005], [4.0, 6.0, 4.0])].concat());
        assert_eq!((got.result, got.defects.bodies), (1, 1));
        let volume = 128.0 + 8.0 * 8.0 * 0.005 + 8.0 * (2.0 - 0.0075);
        assert!(got.verdict.good && (got.defects.volume - volume).abs() < 1e-3, "{:?}, {}", got.verdict, got.defects.volume);
    }

    #[test]
    fn what_stands_off_somewhere_or_on_something_thin_stays() {
        let none = |mesh: &[Corners]| assert_eq!(seated(mesh).result, 0);
        none(&[sole(), shape([2.0, 2.0, 2.1], [4.0, 4.0, 4.0])].concat());
        let slanted = shape([2.0, 2.0, 2.005], [4.0, 4.0, 4.0]);
        let slanted: Vec<Corners> =
            slanted.iter().map(|t| t.map(|p| if p == [4.0, 4.0, 2.005] { [4.0, 4.0, 2.3] } else { p })).collect();
        none(&[sole(), slanted].concat());
        none(&[sole(), shape([7.0, 2.0, 2.005], [9.0, 4.0, 4.0])].concat());
        none(&[cuboid([0.0, 0.0, 1.995], [8.0, 8.0, 2.0]), shape([2.0, 2.0, 2.002], [4.0, 4.0, 4.0])].concat());
    }

    #[test]
    fn rims_of_sheets_and_holes_in_walls_are_not_let_down() {
        assert_eq!(seated(&[sole(), shifted(&plate(3, |_, _| true), [2.0, 2.0, 2.005])].concat()).result, 0);
        let mut open = sole();
        open.drain(2..4);
        assert_eq!(seated(&open).result, 0);
        let standing = [sole(), shape([2.0, 2.0, 2.005], [4.0, 4.0, 4.0])].concat();
        assert_eq!(seated_by(&standing, &Profile::default()).result, 0);
        assert_eq!(seated_by(&standing, &Profile { bodies: Bodies::Keep, ..asking() }).result, 0);
    }
}
