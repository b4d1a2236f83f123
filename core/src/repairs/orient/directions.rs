//! Coherent orientation over shared edges, then outward by enclosed volume, cavities inward.

use crate::contract::report::RepairName;
use crate::detect::bodies;
use crate::geometry::boxes::BoxTree;
use crate::geometry::sums::Bounds;
use crate::repairs::shared::context::{Changes, Done, Repair};
use crate::repairs::shared::work::Work;
use crate::submesh::Submesh;
use crate::submesh::components::{Components, Reversed};
use crate::topology::survey::Survey;
use crate::util::ids::NONE;

/// Neighbours that disagree.
pub(crate) const COHERENT: Repair = Repair {
    name: RepairName::Orient,
    changes: Changes::Directions,
    run: |cx| {
        let turned = make_coherent(cx.survey, &mut cx.work, &mut cx.reversed, &cx.handed.settled);
        if turned.contradictions > 0 {
            tracing::info!(edges = turned.contradictions, "No orientation satisfies all edges: a surface is one-sided.");
        }
        Ok(Done::count(turned.triangles, "triangles turned to agree with their neighbours"))
    },
};

/// What is inside out.
pub(crate) const OUTWARD: Repair = Repair {
    name: RepairName::Outward,
    changes: Changes::Outward,
    run: |cx| {
        let mut turned = 0;
        if !cx.is_outward() {
            let pieces = cx.pieces();
            turned = make_outward(cx.survey, &mut cx.work, &mut cx.reversed, &pieces).0;
            cx.found_outward();
        }
        Ok(Done::count(turned, "components that were inside out"))
    },
};

/// Union-find with the parity of each node against its root.
pub(crate) struct Parity {
    parents: Vec<u32>,
    odd: Vec<bool>,
}

impl Parity {
    pub(crate) fn new(nodes: usize) -> Self {
        Self { parents: (0..nodes as u32).collect(), odd: vec![false; nodes] }
    }

    /// Root and parity against it. The path is made flat.
    pub(crate) fn find(&mut self, node: u32) -> (u32, bool) {
        let (mut root, mut odd) = (node, false);
        while self.parents[root as usize] != root {
            odd ^= self.odd[root as usize];
            root = self.parents[root as usize];
        }
        let (mut at, mut rest) = (node, odd);
        while self.parents[at as usize] != root && at != root {
            let (up, own) = (self.parents[at as usize], self.odd[at as usize]);
            self.parents[at as usize] = root;
            self.odd[at as usize] = rest;
            rest ^= own;
            at = up;
        }
        (root, odd)
    }

    /// Says that two nodes agree, or not; `false` if that contradicts what was said before.
    pub(crate) fn relate(&mut self, a: u32, b: u32, disagree: bool) -> bool {
        let ((ra, pa), (rb, pb)) = (self.find(a), self.find(b));
        let odd = pa ^ pb ^ disagree;
        if ra == rb {
            return !odd;
        }
        self.parents[ra.max(rb) as usize] = ra.min(rb);
        self.odd[ra.max(rb) as usize] = odd;
        true
    }
}

/// What was turned.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Turned {
    pub(crate) triangles: u64,
    /// Edges that no orientation satisfies (a Möbius strip has one).
    pub(crate) contradictions: u64,
}

/// Makes two-triangle edges agree: in each connected surface the smaller part is turned, of equal parts the one with the later
/// triangle. What is `settled`, by triangle of the submesh, stays as it is. O(regions + submesh).
pub(crate) fn make_coherent(survey: &Survey<'_>, work: &mut Work<'_>, reversed: &mut Reversed, settled: &[bool]) -> Turned {
    let (submesh, edges) = work.edges();
    let regions = survey.regions.len() as u32;
    let mut parity = Parity::new(survey.regions.len() + submesh.triangles.len());
    for t in submesh.living() {
        let region = submesh.triangles[t as usize].region;
        if region != NONE {
            parity.relate(region, regions + t, false);
        }
    }
    let mut turned = Turned::default();
    for edge in edges.iter() {
        if let [a, b] = edge.uses
            && settled.get(a.triangle as usize) != Some(&true)
            && !parity.relate(regions + a.triangle, regions + b.triangle, edge.is_inconsistent())
        {
            turned.contradictions += 1;
        }
    }
    // Triangles on each side of each root, and the smallest record there.
    let nodes: Vec<(u32, u64, u32)> = (0..regions)
        .map(|p| (p, survey.regions[p as usize].triangles, survey.regions[p as usize].first))
        .chain(submesh.living().map(|t| (regions + t, 1, submesh.record(t))))
        .collect();
    let mut sides = vec![[(0u64, NONE); 2]; parity.parents.len()];
    for (node, triangles, record) in &nodes {
        let (root, odd) = parity.find(*node);
        let side = &mut sides[root as usize][usize::from(odd)];
        side.0 += triangles;
        side.1 = side.1.min(*record);
    }
    for (node, triangles, _) in nodes {
        let (root, odd) = parity.find(node);
        let [even_side, odd_side] = sides[root as usize];
        let odd_wins = odd_side.0 > even_side.0 || (odd_side.0 == even_side.0 && odd_side.1 < even_side.1);
        if odd != odd_wins {
            turned.triangles += triangles;
            flip_node(survey, work, reversed, node);
        }
    }
    turned
}

/// Turns a node of the parity structure: a region or a triangle of the submesh.
pub(crate) fn flip_node(survey: &Survey<'_>, work: &mut Work<'_>, reversed: &mut Reversed, node: u32) {
    match node.checked_sub(survey.regions.len() as u32) {
        None => reversed.regions[node as usize] ^= true,
        Some(t) => work.flip(t),
    }
}

/// Turns closed ones of all `pieces` inside out where they enclose negative volume and are no cavity; returns (pieces, triangles).
pub(crate) fn make_outward(
    survey: &Survey<'_>,
    work: &mut Work<'_>,
    reversed: &mut Reversed,
    components: &Components,
) -> (u64, u64) {
    let submesh: &Submesh = work;
    if components.list.iter().all(|c| c.open || c.extent.volume >= 0) {
        return (0, 0);
    }
    let inverted = inverted(survey, submesh, components, reversed);
    let (mut count, mut triangles) = (0, 0);
    for (component, _) in components.list.iter().zip(&inverted).filter(|(_, i)| **i) {
        count += 1;
        triangles += component.triangles;
    }
    for (p, component) in components.of_region.iter().enumerate() {
        reversed.regions[p] ^= inverted.get(*component as usize) == Some(&true);
    }
    for (t, component) in components.of_triangle.iter().enumerate() {
        if *component != NONE && inverted[*component as usize] {
            work.flip(t as u32);
        }
    }
    (count, triangles)
}

/// Which components are inside out: from the outside in, one of negative volume that no body winds around. One that was coherent
/// with an inverted component around it (of opposite sign: its cavity) is turned along. One that passes through the wall of another one of the
/// same sign is no cavity of that, wherever the point lies that tells what is around it: in a file that is inside out both are bodies.
fn inverted(survey: &Survey<'_>, submesh: &Submesh, components: &Components, reversed: &Reversed) -> Vec<bool> {
    let list = &components.list;
    let around = bodies::surroundings(survey, submesh, components, reversed, |c| !c.open);
    let sign = |c: u32| list[c as usize].extent.volume.signum();
    // What lies in fewer components is decided first.
    let mut order: Vec<u32> = (0..list.len() as u32).filter(|c| !list[*c as usize].open).collect();
    order.sort_by_key(|c| around[*c as usize].around.len());
    // Whose wall a piece inside an open one is, nobody knows.
    let open: Vec<Bounds> = list.iter().filter(|c| c.open).map(|c| c.bounds).collect();
    let tree = BoxTree::new(&open);
    let mut met = Vec::new();
    let pairs = survey.crossing_pairs.as_deref().unwrap_or_default().iter().map(|pair| pair.triangles);
    let crossing = crate::repairs::shared::pieces::crossing_pieces(survey, submesh, components, pairs);
    let passes_through = |c: u32, o: u32| sign(c) == sign(o) && crossing.binary_search(&[c.min(o), c.max(o)]).is_ok();
    let mut inverted = vec![false; list.len()];
    for c in order {
        tree.meeting(&list[c as usize].bounds, &mut met);
        if met.iter().any(|o| open[*o as usize].contains(&list[c as usize].bounds)) {
            continue;
        }
        let outer = || around[c as usize].around.iter().filter(|(o, _)| !passes_through(c, *o));
        // The component directly around: itself inside most others.
        let direct = outer().map(|o| o.0).max_by_key(|o| (around[*o as usize].around.len(), std::cmp::Reverse(*o)));
        let along = direct.is_some_and(|o| inverted[o as usize] && sign(o) == -sign(c));
        let winding: i32 = outer().map(|(o, w)| if inverted[*o as usize] { -w } else { *w }).sum();
        let volume = if along { -sign(c) } else { sign(c) };
        inverted[c as usize] = along ^ (volume < 0 && winding < 1);
    }
    inverted
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::repairs::shared::pieces;
    use crate::testing::{After, Corners, after, cube, cuboid, plate, reversed};

    fn outward(triangles: &[Corners]) -> After<(u64, u64)> {
        after(triangles, |d, turned| {
            let work = &mut Work::new(&mut d.submesh);
            let pieces = pieces::pieces(&d.survey, work, turned);
            make_outward(&d.survey, work, turned, &pieces)
        })
    }

    #[test]
    fn a_flipped_face_is_turned_back() {
        let mut mesh = cube();
        mesh[5] = reversed(&mesh[5..6])[0];
        let got = after(&mesh, |d, turned| make_coherent(&d.survey, &mut Work::new(&mut d.submesh), turned, &[]));
        assert_eq!((got.result.triangles, got.result.contradictions, got.untouched), (1, 0, 11));
        assert!(got.verdict.good, "{:?}", got.verdict);
    }

    #[test]
    fn of_everything_inside_out_what_passes_through_a_wall_is_a_body_wherever_it_begins() {
        // The first triangle of the bar, which tells what is around it, is inside of the box, or outside.
        for end in [0, 8] {
            let mut bar = reversed(&cuboid([1.0; 3], [2.0, 2.0, 3.5]));
            bar.rotate_left(end);
            let got = outward(&[reversed(&cuboid([0.0; 3], [3.0; 3])), bar].concat());
            assert_eq!(got.result, (2, 24));
        }
    }

    #[test]
    fn of_everything_inside_out_the_cavity_comes_to_point_inward() {
        // The cavity's surface by itself is the right way round, so that only its surroundings tell.
        let got = outward(&[reversed(&cuboid([0.0; 3], [3.0; 3])), cuboid([1.0; 3], [2.0; 3])].concat());
        assert_eq!(got.result, (2, 24));
        assert_eq!((got.defects.bodies, got.defects.cavities), (1, 1));
        assert!(got.verdict.good && (got.defects.volume - 26.0).abs() < 1e-9, "{:?}", got.verdict);
    }

    #[test]
    fn an_outer_shell_alone_inside_out_is_turned_alone() {
        let got = outward(&[reversed(&cuboid([0.0; 3], [3.0; 3])), reversed(&cuboid([1.0; 3], [2.0; 3]))].concat());
        assert_eq!((got.result, got.untouched), ((1, 12), 12));
        assert!(got.verdict.good && (got.defects.volume - 26.0).abs() < 1e-9, "{:?}", got.verdict);
    }

    #[test]
    fn a_cavity_in_a_body_that_is_open_is_not_turned() {
        let mut body = cuboid([0.0; 3], [3.0; 3]);
        body.pop();
        let got = outward(&[body, reversed(&cuboid([1.0; 3], [2.0; 3]))].concat());
        assert_eq!((got.result, got.untouched), ((0, 0), 23));
        let got = outward(&[plate(3, |_, _| true), reversed(&cuboid([1.0; 3], [2.0; 3]))].concat());
        assert_eq!(got.result, (1, 12), "it is not in the sheet's box");
    }

    #[test]
    fn sheets_between_balanced_seams_are_left_as_they_are() {
        // Two cubes that share a wall: each sheet ends at the wall's rim and is open by itself, so its own volume says nothing.
        for at in [0.0, -100.0] {
            let right = cuboid([at + 1.0, 0.0, 0.0], [at + 2.0, 1.0, 1.0]);
            let got = outward(&[cuboid([at, 0.0, 0.0], [at + 1.0, 1.0, 1.0]), right].concat());
            assert_eq!((got.result, got.untouched), ((0, 0), 24));
        }
    }
}
