//! The volume that a broken surface means to enclose.
//!
//! The signed volume of an open surface depends on the origin. Here each loop of edges that lack a triangle is closed by a cone to its own
//! centroid, so that the volume does not depend on the origin, and hardly on how the loop will be closed. It is to be taken of a coherently
//! oriented surface, before anything is closed, cut or removed.

use std::collections::HashMap;

use glam::DVec3;

use crate::detect::holes::unbalanced::unbalanced;
use crate::geometry::boxes::BoxTree;
use crate::geometry::sums::Bounds;
use crate::submesh::components::Components;
use crate::submesh::edges::{Edge, Edges};
use crate::submesh::{Submesh, Vertex};
use crate::topology::survey::Survey;
use crate::util::ids::NONE;
use crate::util::union_find::{find, unite};

/// Meetings of boxes that are looked at; of more components, one in the other, the volume is not known.
const MOST_MEETINGS: usize = 1 << 24;

/// The volume that the components enclose together, in the file's units, cubed; `None` if one of them has two neighbours that disagree, so that
/// nobody knows what is inside of it, or if too many boxes meet.
///
/// A component in the box of another one may be a cavity in it, so the signed volumes of components whose boxes meet are added up. A component
/// apart from all others counts by its size, since it may be inside out. Where it is known of closed ones which are, by component, they count as they
/// are turned: less than nothing, if cavities overlap that are larger together than their body. O(regions + submesh), and what finding the loops costs.
pub(crate) fn coned_volume(
    survey: &Survey<'_>,
    submesh: &Submesh,
    edges: &Edges,
    components: &Components,
    inverted: &[bool],
) -> Option<f64> {
    if edges.iter().any(|edge| edge.is_inconsistent()) {
        return None;
    }
    let mut volumes: Vec<f64> = components.list.iter().map(|c| survey.measure.volume(c.extent)).collect();
    let of_edges = components_at_gaps(edges, components);
    for rim in unbalanced(submesh, edges, std::iter::empty()) {
        if let Some(component) = rim.get(1).and_then(|second| of_edges.get(&(rim[0], *second))) {
            volumes[*component as usize] += cone(survey.measure.middle(), submesh, &rim);
        }
    }
    volumes.iter_mut().zip(inverted).filter(|(_, inverted)| **inverted).for_each(|(volume, _)| *volume = -*volume);
    let boxes: Vec<Bounds> = components.list.iter().map(|c| c.bounds).collect();
    let (tree, mut met, mut meetings) = (BoxTree::new(&boxes), Vec::new(), 0);
    let mut parents: Vec<u32> = (0..boxes.len() as u32).collect();
    for (component, bounds) in boxes.iter().enumerate() {
        tree.meeting(bounds, &mut met);
        meetings += met.len();
        if meetings > MOST_MEETINGS {
            return None;
        }
        for other in &met {
            unite(&mut parents, component as u32, *other);
        }
    }
    let mut together = vec![(0.0, !inverted.is_empty()); volumes.len()];
    for (component, volume) in volumes.into_iter().enumerate() {
        let (sum, is_known) = &mut together[find(&mut parents, component as u32) as usize];
        *sum += volume;
        *is_known &= !components.list[component].open;
    }
    Some(together.into_iter().map(|(sum, is_known)| if is_known { sum } else { f64::abs(sum) }).sum())
}

/// By directed edge that lacks a triangle, a component that it belongs to.
fn components_at_gaps(edges: &Edges, components: &Components) -> HashMap<(Vertex, Vertex), u32> {
    let mut of_edges = HashMap::new();
    for edge in edges.iter().filter(Edge::is_unbalanced) {
        for used in edge.uses {
            let (from, to) = edge.directed(used);
            let component = components.of_triangle[used.triangle() as usize];
            if component != NONE {
                of_edges.entry((to, from)).or_insert(component);
            }
        }
    }
    of_edges
}

/// The signed volume between a place and the cone over a loop from its centroid.
pub(crate) fn cone(place: DVec3, submesh: &Submesh, rim: &[Vertex]) -> f64 {
    let points: Vec<DVec3> =
        rim.iter().map(|v| DVec3::from_array(submesh.positions[*v as usize].map(f64::from)) - place).collect();
    let centroid = points.iter().sum::<DVec3>() / points.len() as f64;
    let next = points.iter().cycle().skip(1);
    points.iter().zip(next).map(|(a, b)| a.cross(*b).dot(centroid) / 6.0).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::position::Position;
    use crate::submesh::components::{Reversed, Through};
    use crate::testing::{Corners, cube, cuboid, diagnose, plate, records, reversed, shifted};

    fn volume(triangles: &[Corners], inverted: &[bool]) -> Option<f64> {
        let records = records(triangles);
        let d = diagnose(&records);
        let edges = Edges::of(&d.submesh);
        let components = Components::of(&d.survey, &d.submesh, &edges, &Reversed::none(&d.survey), Through::ManifoldEdges);
        coned_volume(&d.survey, &d.submesh, &edges, &components, inverted)
    }

    #[track_caller]
    fn encloses(triangles: &[Corners], expected: f64) {
        let volume = volume(triangles, &[]).unwrap();
        assert!((volume - expected).abs() < 1e-6 * expected.max(1.0), "{volume}");
    }

    /// The cone over a flat rim is the missing face, wherever the origin lies.
    #[test]
    fn a_box_that_lacks_a_face_encloses_what_it_did() {
        let open = &cuboid([0.0; 3], [1.0, 2.0, 3.0])[2..];
        encloses(open, 6.0);
        encloses(&shifted(open, [64.0, -32.0, 8.0]), 6.0);
    }

    /// A unit square at height 3, seen from the origin.
    #[test]
    fn a_cone_over_a_square() {
        let records = records(&shifted(&plate(1, |_, _| true), [0.0, 0.0, 3.0]));
        let submesh = diagnose(&records).submesh;
        let corners = [[0.0, 0.0, 3.0], [1.0, 0.0, 3.0], [1.0, 1.0, 3.0], [0.0, 1.0, 3.0]];
        let numbers = submesh.by_position();
        let square = corners.map(|p| numbers[&Position::of(p)]);
        assert!((cone(DVec3::ZERO, &submesh, &square) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn bodies_apart_are_taken_by_their_size() {
        let other = reversed(&shifted(&cube(), [5.0, 0.0, 0.0]));
        encloses(&[cube(), other].concat(), 2.0);
        encloses(&reversed(&cube())[1..], 1.0);
    }

    /// Their boxes meet, so that it might be a cavity.
    #[test]
    fn what_is_known_to_be_inside_out_counts_as_a_body() {
        let mesh = [cube(), reversed(&shifted(&cube(), [1.0, 0.0, 0.0]))].concat();
        assert_eq!([volume(&mesh, &[]), volume(&mesh, &[false, true])], [Some(0.0), Some(2.0)]);
    }

    /// Closed or not, and if it pokes out of the wall.
    #[test]
    fn a_cavity_is_taken_off() {
        let host = cuboid([0.0; 3], [3.0; 3]);
        for x in [1.0, 2.5] {
            let cavity = reversed(&shifted(&cube(), [x, 1.0, 1.0]));
            encloses(&[host.clone(), cavity.clone()].concat(), 26.0);
            encloses(&[&host[..], &cavity[2..]].concat(), 26.0);
            // All of it inside out.
            encloses(&reversed(&[&host[..], &cavity].concat()), 26.0);
        }
    }

    /// A cavity that is drawn twice is taken off twice; what both have in common is given back when they are made one.
    #[test]
    fn cavities_that_overlap_may_be_more_than_the_body() {
        let cavity = |x: f32| reversed(&cuboid([x, 0.5, 0.5], [x + 5.0, 5.5, 5.5]));
        let mesh = [cuboid([0.0; 3], [6.0; 3]), cavity(0.25), cavity(0.5)].concat();
        assert_eq!(volume(&mesh, &[false; 3]), Some(216.0 - 250.0));
    }

    #[test]
    fn where_neighbours_disagree_nobody_knows() {
        let mut odd = cube();
        odd[3].swap(0, 1);
        assert_eq!(volume(&odd, &[]), None);
    }
}
