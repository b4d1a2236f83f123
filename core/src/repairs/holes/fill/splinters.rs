//! Sheets that patches have closed back on themselves, beside other bodies.
//!
//! A patch that stands upright on what it closes, or continues it, is the missing face of a body. One under which the surface folds back makes a
//! splinter of a sheet, which may have bounded nothing: a piece of surface that lies about in a gap. Whose only body is of that shape, as a flat
//! pyramid without its base, has nothing else to be. In the space of another body (in its cavity, its bore, or a gap beside it), a bulge
//! need not be a body, though a patch may close it: only walls that stand upright on the patch are a box without its lid.

use glam::DVec3;

use crate::contract::report::RepairName;
use crate::geometry::distance::place;
use crate::repairs::shared::pieces::crossing;
use crate::repairs::shared::unsaid;
use crate::repairs::shared::work::Work;
use crate::repairs::stitch::layer::Facet;
use crate::submesh::components::{Component, Components};
use crate::submesh::edges::Edges;
use crate::submesh::{Origin, Submesh};
use crate::topology::survey::Survey;
use crate::util::ids::NONE;
use crate::util::words::span;

/// A sheet is closed by patches of at least this share of its area then.
const WIDE: f64 = 0.25;
/// Mean cosine between the normal of the patches and those of the surface along their rims: between both there are less than 60°. The patches as a whole:
/// along a ragged rim, single triangles of theirs continue the surface.
const FOLDED: f64 = -0.5;
/// And so far from upright in the space of another body, to either side: 9°.
const LEANS: f64 = 0.15;
/// The largest bodies, so many of them, are looked at for the space of others.
const MOST_HOSTS: usize = 64;
/// A body of less than this share of all volume has others beside it ...
const BESIDE: f64 = 0.5;
/// ... and specks of which nothing is told are together no more than this share of all area.
const SPECK: f64 = 1e-3;

/// What patches are to a body.
#[derive(Clone, Copy, Default)]
struct Closed {
    /// Twice their area, in the survey's units.
    area: i128,
    /// Of them together, as long as twice what can be seen of them from there.
    normal: DVec3,
    /// The length of their rims, and the surface's normals along these, by length.
    length: f64,
    around: DVec3,
}

/// Lines on such bodies. O(regions + submesh).
pub(super) fn doubts(survey: &Survey<'_>, work: &mut Work<'_>) -> Vec<String> {
    if !work.living().any(|t| is_patch(work, t)) {
        return Vec::new();
    }
    let bodies = work.components(survey);
    let (submesh, edges) = work.edges();
    let closed = closed(survey, submesh, edges, &bodies);
    let all_area: i128 = bodies.list.iter().map(|body| body.extent.area).sum();
    let all_volume: i128 = bodies.list.iter().map(|body| body.extent.volume.abs()).sum();
    let share = |part: i128, all: i128| part as f64 / all.max(1) as f64;
    let is_sheet = |body: &Component, closed: &Closed| {
        closed.length > 0.0
            && share(closed.area, body.extent.area) >= WIDE
            && share(body.extent.volume.abs(), all_volume) < BESIDE
    };
    let sheets: Vec<usize> = (0..closed.len()).filter(|c| is_sheet(&bodies.list[*c], &closed[*c])).collect();
    if sheets.is_empty() {
        return Vec::new();
    }
    // A sheet that crosses another body becomes one with it.
    let pairs = survey.crossing_pairs.as_deref().unwrap_or_default();
    let crosses = crossing(survey, submesh, &bodies, pairs.iter().map(|pair| pair.triangles));
    let hosts = largest(&bodies);
    let is_in_another = |c: usize, body: &Component| {
        let bounds = &body.bounds;
        !crosses[c] && hosts.iter().any(|host| host.extent.area > body.extent.area && host.bounds.contains(bounds))
    };
    let line = |c: usize| -> Option<(usize, String)> {
        let (body, closed) = (&bodies.list[c], &closed[c]);
        let (bounds, leans) = (body.bounds.normalised(), closed.around.dot(closed.normal.normalize_or_zero()) / closed.length);
        let how = match leans {
            _ if leans <= FOLDED => "back on itself, by a patch that lies close to it,",
            _ if leans.abs() >= LEANS && is_in_another(c, body) => "in the space of another body",
            _ => return None,
        };
        Some((
            c,
            format!("a sheet was closed {how} and is a body now: it may have bounded nothing; {}", span([bounds.lo, bounds.hi])),
        ))
    };
    let lines: Vec<(usize, String)> = sheets.into_iter().filter_map(line).collect();
    let areas: Vec<f64> = lines.iter().map(|(c, _)| share(bodies.list[*c].extent.area, all_area)).collect();
    let told = lines.into_iter().zip(unsaid::told(&areas, SPECK));
    unsaid::summed_up(told.filter(|(_, told)| *told).map(|((_, line), _)| line).collect())
}

/// The patches of each body, summed up.
fn closed(survey: &Survey<'_>, submesh: &Submesh, edges: &Edges, bodies: &Components) -> Vec<Closed> {
    let mut closed = vec![Closed::default(); bodies.list.len()];
    for t in submesh.living().filter(|t| is_patch(submesh, *t) && bodies.of_triangle[*t as usize] != NONE) {
        let body = &mut closed[bodies.of_triangle[t as usize] as usize];
        let [a, b, c] = submesh.points(t).map(place);
        body.area += survey.measure.triangle(&submesh.points(t)).area;
        body.normal += (b - a).cross(c - a);
    }
    let normal = |t: u32| Facet::of(&submesh.points(t), 0).normal;
    for edge in edges.iter() {
        if let [a, b] = edge.uses
            && is_patch(submesh, a.triangle()) != is_patch(submesh, b.triangle())
            && let Some(body) = closed.get_mut(bodies.of_triangle[a.triangle() as usize] as usize)
        {
            let length = submesh.distance(edge.low, edge.high);
            let of_surface = if is_patch(submesh, a.triangle()) { b } else { a };
            body.length += length;
            body.around += length * normal(of_surface.triangle());
        }
    }
    closed
}

fn is_patch(submesh: &Submesh, t: u32) -> bool {
    submesh.triangles[t as usize].origin == Origin::Added(RepairName::Fill)
}

/// The bodies of the largest area.
fn largest(bodies: &Components) -> Vec<&Component> {
    let mut all: Vec<&Component> = bodies.list.iter().collect();
    all.sort_by_key(|body| std::cmp::Reverse(body.extent.area));
    all.truncate(MOST_HOSTS);
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contract::settings::Profile;
    use crate::repairs::holes::fill::fill;
    use crate::testing::{Corners, after, cuboid, shifted};

    /// A pyramid of this height on a square of 2 by 2, without its base.
    fn pyramid(height: f32) -> Vec<Corners> {
        let base = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 2.0, 0.0], [0.0, 2.0, 0.0]];
        (0..4).map(|k| [base[k], base[(k + 1) % 4], [1.0, 1.0, height]]).collect()
    }

    fn lines(mesh: &[Corners]) -> usize {
        let profile = Profile::default();
        after(mesh, |d, _| {
            fill(d, &profile);
            doubts(&d.survey, &mut Work::new(&mut d.submesh)).len()
        })
        .result
    }

    /// A low block that narrows to its top, which is lost: 28 % of its area.
    #[test]
    fn a_bulge_in_the_space_of_another_body_may_bound_nothing() {
        let narrows = |t: &Corners| t.map(|[x, y, z]| if z > 0.0 { [0.2 + 0.8 * x, 0.2 + 0.8 * y, z] } else { [x, y, z] });
        let block = cuboid([0.0; 3], [2.0, 2.0, 0.3]);
        let is_top = |t: &Corners| t.iter().all(|p| p[2] > 0.0);
        let bulge: Vec<Corners> = block.iter().filter(|t| !is_top(t)).map(narrows).collect();
        let body = |low: f32| cuboid([low; 3], [9.0; 3]);
        assert_eq!(lines(&[bulge.clone(), body(-9.0)].concat()), 1);
        assert_eq!(lines(&[bulge.clone(), body(3.0)].concat()), 0, "beside the other body");
        let wall = cuboid([-9.0, 0.5, -9.0], [9.0, 1.5, 9.0]);
        assert_eq!(lines(&[bulge, wall].concat()), 0, "it crosses the other one");
        let upright: Vec<Corners> = block.into_iter().filter(|t| !is_top(t)).collect();
        assert_eq!(lines(&[upright, body(-9.0)].concat()), 0, "a box without its lid");
    }

    #[test]
    fn a_sheet_closed_back_on_itself_beside_a_body_may_bound_nothing() {
        let body = || shifted(&cuboid([0.0; 3], [4.0; 3]), [9.0, 0.0, 0.0]);
        assert_eq!(lines(&[pyramid(0.5), body()].concat()), 1);
        assert_eq!(lines(&pyramid(0.5)), 0, "the only body");
        assert_eq!(lines(&[pyramid(4.0), body()].concat()), 0, "it is steep");
        assert_eq!(lines(&[shifted(&cuboid([0.0; 3], [2.0, 2.0, 0.25])[2..], [0.0; 3]), body()].concat()), 0, "a plate");
    }
}
