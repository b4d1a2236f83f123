//! The triangles of components, in the order of the file, as they are turned now.

use crate::algorithms::wrap::tree::Corners;
use crate::geometry::position;
use crate::submesh::Submesh;
use crate::submesh::components::{Components, Reversed};
use crate::topology::survey::Survey;
use crate::util::ids::NONE;

/// Where a triangle is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Part {
    /// In this region of regular surface.
    Region(u32),
    /// As this triangle of the submesh.
    Triangle(u32),
}

impl Part {
    /// Which of these components it is of.
    pub(crate) fn component(self, components: &Components) -> u32 {
        match self {
            Self::Region(region) => components.of_region[region as usize],
            Self::Triangle(t) => components.of_triangle[t as usize],
        }
    }
}

/// The triangles of each of the `wanted` components, which ascend.
pub(crate) fn gather(
    survey: &Survey<'_>,
    submesh: &Submesh,
    components: &Components,
    reversed: &Reversed,
    wanted: &[usize],
) -> Vec<Vec<Corners>> {
    let mut gathered = vec![Vec::new(); wanted.len()];
    let is_wanted = |component: u32| wanted.binary_search(&(component as usize)).is_ok();
    visit(survey, submesh, (components, reversed), is_wanted, |component, _, corners| {
        if let Ok(place) = wanted.binary_search(&(component as usize)) {
            gathered[place].push(corners);
        }
    });
    gathered
}

/// Shows every triangle of the components that are wanted, each with its component. O(submesh + triangles shown × log), and reads the chunks
/// that hold them.
pub(crate) fn visit(
    survey: &Survey<'_>,
    submesh: &Submesh,
    (components, reversed): (&Components, &Reversed),
    is_wanted: impl Fn(u32) -> bool + Sync,
    mut show: impl FnMut(u32, Part, Corners),
) {
    let counts = |component: u32| component != NONE && is_wanted(component);
    let found = survey.visit_regular(
        |region| counts(components.of_region[region as usize]),
        Vec::new,
        |list: &mut Vec<(u32, u32, u32)>, record, region| list.push((record, region, NONE)),
    );
    let mut all: Vec<(u32, u32, u32)> = found.into_iter().flatten().collect();
    let in_submesh = submesh.living().filter(|t| counts(components.of_triangle[*t as usize]));
    all.extend(in_submesh.map(|t| (submesh.record(t), NONE, t)));
    all.sort_unstable();
    for (record, region, t) in survey.ahead(all.into_iter(), |(record, _, t)| (*t == NONE).then_some(*record)) {
        let (part, corners) = if t == NONE {
            let [a, b, c] = position::corners(&survey.records[record as usize]);
            (Part::Region(region), if reversed.regions[region as usize] { [a, c, b] } else { [a, b, c] })
        } else {
            (Part::Triangle(t), submesh.points(t))
        };
        show(part.component(components), part, corners);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::submesh::components::Through;
    use crate::submesh::edges::Edges;
    use crate::testing::{cube, diagnose, plate, records, shifted};

    /// A plate of 5 by 5 squares, a cube, and another such plate. Of a plate the triangles at its rim are in the submesh, those inside are a region.
    #[test]
    fn triangles_stand_in_the_order_of_the_file_as_they_are_turned() {
        let one = plate(5, |_, _| true);
        let other = shifted(&one, [9.0, 0.0, 0.0]);
        let mesh = records(&[&one[..], &shifted(&cube(), [6.0, 0.0, 0.0]), &other].concat());
        let d = diagnose(&mesh);
        let mut turned = Reversed::none(&d.survey);
        turned.regions.fill(true);
        let components = Components::of(&d.survey, &d.submesh, &Edges::of(&d.submesh), &turned, Through::EveryEdge);
        let plates: Vec<usize> = (0..components.list.len()).filter(|c| components.list[*c].triangles == 50).collect();
        let is_inside = |p: &[f32; 3]| (1.0..=4.0).contains(&(p[0] % 9.0)) && (1.0..=4.0).contains(&p[1]);
        let as_turned = |plate: &[Corners]| -> Vec<Corners> {
            plate.iter().map(|t| if t.iter().all(is_inside) { [t[0], t[2], t[1]] } else { *t }).collect()
        };
        let gathered = gather(&d.survey, &d.submesh, &components, &turned, &plates);
        assert_eq!(gathered, [as_turned(&one), as_turned(&other)]);
    }
}
