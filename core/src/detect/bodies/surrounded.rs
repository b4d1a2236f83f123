//! Which points surface lies around, also where it is not known which way it faces.

use super::{Direction, Over, Upright, cross};
use crate::io::record;
use crate::submesh::Submesh;
use crate::topology::survey::Survey;

/// A ray from a point: what it crosses.
#[derive(Clone, Copy, Default)]
struct Crossed {
    surface: u32,
    /// How much more often surface is left than entered.
    winding: i32,
}

impl Crossed {
    /// Does surface lie around? A body that is passed through is crossed an even number of times, whichever way its triangles face.
    fn is_around(&self) -> bool {
        self.winding != 0 && (self.surface % 2 == 1 || self.winding.unsigned_abs() == self.surface)
    }
}

/// Which points surface lies around: in at least four of the six directions along the axes. Neither holes nor a few turned triangles change much of
/// that. `counts`: a triangle of the submesh does. O(triangles under rays), and reads the chunks of the file that the rays may meet, once.
pub(crate) fn are_surrounded(
    survey: &Survey<'_>,
    submesh: &Submesh,
    points: &[[f64; 3]],
    counts: impl Fn(u32) -> bool,
) -> Vec<bool> {
    if points.is_empty() {
        return Vec::new();
    }
    let all = Direction::ALL.map(|direction| Upright::of(direction, points.iter().copied()));
    // Direction, ray, and how it crosses.
    type Hits = Vec<(usize, usize, i32)>;
    let hit = |way: usize, corners: &[[f32; 3]; 3], hits: &mut Hits| {
        let Upright { direction, rays, grid } = &all[way];
        cross(grid, rays, &direction.upright_corners(corners), |_| true, |ray, w| hits.push((way, ray, w)));
    };
    let per_chunk = survey.visit_regular_near(
        |_| true,
        |reach| {
            let over: Vec<(usize, Over)> = (0..all.len()).filter_map(|way| Some((way, all[way].over(reach)?))).collect();
            (!over.is_empty()).then_some((over, Hits::new()))
        },
        |(over, _), bounds| over.iter().any(|(way, over)| all[*way].may_meet_box(over, bounds)),
        |(over, _), corners| over.iter().any(|(way, over)| all[*way].may_meet(over, corners)),
        |(over, hits), triangle, _| {
            let corners = record::corners(&survey.records[triangle as usize]);
            let under = over.iter().filter(|(way, over)| all[*way].may_meet(over, &corners));
            under.for_each(|(way, _)| hit(*way, &corners, hits));
        },
    );
    let mut hits: Hits = per_chunk.into_iter().flat_map(|(_, hits)| hits).collect();
    let counted = submesh.living().filter(|t| counts(*t));
    counted.for_each(|t| (0..all.len()).for_each(|way| hit(way, &submesh.points(t), &mut hits)));
    let mut crossed = vec![[Crossed::default(); Direction::ALL.len()]; points.len()];
    for (way, ray, w) in hits {
        let Crossed { surface, winding } = crossed[ray][way];
        crossed[ray][way] = Crossed { surface: surface + 1, winding: winding + w };
    }
    crossed.into_iter().map(|of| of.iter().filter(|crossed| crossed.is_around()).count() >= 4).collect()
}
