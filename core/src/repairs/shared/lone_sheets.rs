//! Lone sheets: open surface that bounds no material, such as terrain, a folded layer, a Möbius strip.
//!
//! A sheet was meant to be one, or lacks everything but one side: whatever closes it turns it into a body that nobody drew. What is open and
//! has a mouth that is wide against its surface is a sheet if one of these holds. (A vessel without its bottom is none: it encloses much, and all
//! of its surface has material behind it.)
//!
//! * **Thin:** the patch would lie back along the surface, and enclose next to nothing for the surface's size.
//! * **In material:** likewise, but what the patch encloses would be a body in the material of a closed one. Only where sheets are dropped.
//! * **Torn:** a cone over each rim closes the surface, but a good part of it then has material on its front, where the air should be: the surface
//!   passes through its own patch, which would cut it into splinters.
//! * **One-sided:** no orientation satisfies its edges, and, cut open where they disagree, it is torn, or what would close it is larger than it is.
//!   (A body of which a few triangles are glued on the wrong way has no such mouth.)

use glam::DVec3;

use crate::algorithms::wrap::tree::{Corners, Tree};
use crate::detect::bodies;
use crate::detect::holes::{Shapes, loops::Loop};
use crate::geometry::distance::place;
use crate::geometry::position::Position;
use crate::repairs::shared::gather::gather;
use crate::submesh::Submesh;
use crate::submesh::components::{Components, Reversed, Through};
use crate::submesh::edges::Edges;
use crate::topology::survey::Survey;
use crate::util::ids::NONE;
use crate::util::{parallel, union_find};

/// A patch lies back along the surface if it continues it by less than this ([`Shapes::continues`]).
const LIES_BACK: f64 = -0.5;
/// A mouth is wide from this share of the surface on: the patch of a sheet is about as large as the sheet.
const WIDE: f64 = 0.25;
/// A sheet encloses less than this share of its size: the root of the area of one side, cubed. A plate that rises by a fiftieth of its width
/// on average.
pub(crate) const THIN: f64 = 0.02;
/// Torn is what has its front inside on this share of its area at least, and on no more than the rest of it.
const TORN: f64 = 1.0 / 32.0;
/// Of what is torn, rims are left open whose patch is at least this share of the surface. Others are holes in the sheet.
const OF_A_SHEET: f64 = 0.05;
/// A torn sheet has at least this share of the whole area, a one-sided one that: smaller parts, which lack faces, are rather closed than lost.
const SUBSTANTIAL: f64 = 0.05;
const SUBSTANTIAL_ONE_SIDED: f64 = 0.01;
/// Components that are looked at triangle by triangle, at most, the largest first, and triangles of all of them: some 100 bytes each.
const MOST_LOOKED_AT: usize = 256;
const MOST_TRIANGLES: u64 = 1 << 21;
/// Triangles of a component that are asked what is behind them, at most.
const SAMPLES: usize = 1 << 11;

/// Kinds of sheets that are looked for.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Which {
    Sheets,
    /// What would be a body in the material of others as well: it is missed by nobody.
    Unneeded,
    /// Reliefs as well: what rises from its rim, so that a flat patch would enclose something.
    Reliefs,
}

/// The lone sheets of a submesh.
#[derive(Debug, Default)]
pub(crate) struct LoneSheets {
    /// First vertices of their rims, ascending.
    pub(crate) rims: Vec<u32>,
    /// By triangle of the submesh: it is part of a sheet that has one side only, whose rim may be no loop. Empty: there is none.
    pub(crate) one_sided: Vec<bool>,
    /// By triangle of the submesh: the component that it is part of.
    pub(crate) of_triangle: Vec<u32>,
}

/// Sizes of a component and of the cones that close it, and kinds of its edges.
#[derive(Clone, Copy, Default)]
struct Mouth {
    /// Of the surface, and of the cones over its rims.
    area: f64,
    cones: f64,
    /// The volume that the surface encloses with them.
    volume: f64,
    is_one_sided: bool,
    /// Several surfaces meet in an edge of it, or edges are in no loop: it is no sheet, or nothing is known of what would close it.
    is_unclear: bool,
}

impl Mouth {
    fn is_wide(&self) -> bool {
        self.cones >= WIDE * self.area
    }

    fn is_thin(&self) -> bool {
        self.volume.abs() < THIN * ((self.area + self.cones) / 2.0).powi(3).sqrt()
    }
}

/// Finds the lone sheets among what is open. O(regions + submesh) if there are `loops` or edges that disagree, and a look at the chunks of components
/// that have a wide mouth.
pub(crate) fn recognise(
    survey: &Survey<'_>,
    submesh: &Submesh,
    edges: &Edges,
    loops: &[Loop],
    shapes: &Shapes,
    reversed: &Reversed,
    which: Which,
) -> LoneSheets {
    let one_sided = one_sided(survey, submesh, edges);
    if loops.is_empty() && one_sided.is_empty() {
        return LoneSheets::default();
    }
    let components = Components::of(survey, submesh, edges, reversed, Through::EveryEdge);
    let all = Mouths::of(survey, submesh, edges, &components, (loops, shapes), &one_sided);
    let torn = all.torn(survey, submesh, &components, reversed);
    let unneeded = if which == Which::Unneeded { all.in_material(survey, submesh, &components, reversed) } else { Vec::new() };
    let mut rims: Vec<u32> = Vec::new();
    for (i, rim) in loops.iter().enumerate() {
        let component = components.of_triangle[rim.triangles[0] as usize];
        let Some(mouth) = all.mouths.get(component as usize) else { continue };
        let lies_back = all.continues[i] < LIES_BACK && all.cone_of[i] >= WIDE * mouth.area;
        let is_of_sheet = all.cone_of[i] >= OF_A_SHEET * mouth.area;
        let is_torn = torn[component as usize];
        let is_unneeded = unneeded.binary_search(&component).is_ok();
        let bounds_nothing = which == Which::Reliefs || mouth.is_thin() || is_unneeded;
        if lies_back && bounds_nothing || is_torn && (is_of_sheet || mouth.is_one_sided) {
            rims.push(rim.vertices[0]);
        }
    }
    rims.sort_unstable();
    let is_lone = |component: u32| component != NONE && torn[component as usize] && all.mouths[component as usize].is_one_sided;
    let mut of_one_sided: Vec<bool> = components.of_triangle.iter().map(|component| is_lone(*component)).collect();
    if !of_one_sided.contains(&true) {
        of_one_sided.clear();
    }
    LoneSheets { rims, one_sided: of_one_sided, of_triangle: components.of_triangle }
}

/// All components, and what closes them.
struct Mouths {
    mouths: Vec<Mouth>,
    /// By loop.
    cone_of: Vec<f64>,
    continues: Vec<f64>,
    /// Triangles of the cones, with their components.
    cones: Vec<(u32, Corners)>,
}

impl Mouths {
    fn of(
        survey: &Survey<'_>,
        submesh: &Submesh,
        edges: &Edges,
        components: &Components,
        (loops, shapes): (&[Loop], &Shapes),
        one_sided: &[bool],
    ) -> Self {
        let of = |c: &crate::submesh::components::Component| Mouth {
            area: survey.measure.area(c.extent),
            volume: survey.measure.volume(c.extent),
            ..Mouth::default()
        };
        let mouths = components.list.iter().map(of).collect();
        let mut all = Self { mouths, cone_of: Vec::new(), continues: shapes.continues().collect(), cones: Vec::new() };
        for t in submesh.living().filter(|t| one_sided.get(*t as usize) == Some(&true)) {
            if let Some(mouth) = all.mouths.get_mut(components.of_triangle[t as usize] as usize) {
                mouth.is_one_sided = true;
            }
        }
        let middle = survey.measure.middle();
        let mut open_edges = vec![0usize; components.list.len()];
        for rim in loops {
            let component = components.of_triangle[rim.triangles[0] as usize];
            let n = rim.vertices.len();
            let ways: Vec<[u32; 2]> = (0..n).map(|i| [rim.vertices[i], rim.vertices[(i + 1) % n]]).collect();
            let (volume, area, cone) = cone(submesh, &ways, middle);
            all.cone_of.push(area);
            let Some(mouth) = all.mouths.get_mut(component as usize).filter(|mouth| !mouth.is_one_sided) else { continue };
            open_edges[component as usize] += n;
            mouth.cones += area;
            mouth.volume += volume;
            all.cones.extend(cone.into_iter().map(|corners| (component, corners)));
        }
        all.close_the_rest(submesh, edges, components, (open_edges, middle));
        all
    }

    /// Where edges lack a side and are in no loop, nothing is known, unless the component is one-sided: then all of them are closed by one cone, those
    /// that disagree as if the surface were cut open there.
    fn close_the_rest(
        &mut self,
        submesh: &Submesh,
        edges: &Edges,
        components: &Components,
        (mut in_loops, middle): (Vec<usize>, DVec3),
    ) {
        let mut rest: Vec<(u32, [u32; 2])> = Vec::new();
        for edge in edges.iter().filter(|edge| edge.is_unbalanced() || edge.is_nonmanifold()) {
            let component = components.of_triangle[edge.uses[0].triangle() as usize];
            let Some(mouth) = self.mouths.get_mut(component as usize) else { continue };
            mouth.is_unclear |= edge.is_nonmanifold();
            if !edge.is_unbalanced() {
                continue;
            }
            if !mouth.is_one_sided {
                match in_loops[component as usize].checked_sub(1) {
                    Some(left) => in_loops[component as usize] = left,
                    None => mouth.is_unclear = true,
                }
                continue;
            }
            for used in edge.uses {
                let (from, to) = edge.directed(used);
                rest.push((component, [to, from]));
            }
        }
        rest.sort_by_key(|(component, _)| *component);
        for group in rest.chunk_by(|a, b| a.0 == b.0) {
            let component = group[0].0;
            let ways: Vec<[u32; 2]> = group.iter().map(|(_, way)| *way).collect();
            let (volume, area, cone) = cone(submesh, &ways, middle);
            let mouth = &mut self.mouths[component as usize];
            mouth.cones += area;
            mouth.volume += volume;
            self.cones.extend(cone.into_iter().map(|corners| (component, corners)));
        }
    }

    /// The components with a wide mouth that would be bodies in the material of closed ones, ascending: all that winds around their triangles in the
    /// submesh does so as they would themselves.
    fn in_material(&self, survey: &Survey<'_>, submesh: &Submesh, components: &Components, reversed: &Reversed) -> Vec<u32> {
        let is_asked = |c: &u32| {
            let Some(mouth) = self.mouths.get(*c as usize) else { return false };
            mouth.is_wide() && !mouth.is_unclear && !mouth.is_one_sided && !mouth.is_thin() && components.list[*c as usize].open
        };
        let mut asked: Vec<(u32, u32)> =
            submesh.living().map(|t| (components.of_triangle[t as usize], t)).filter(|(c, _)| is_asked(c)).collect();
        asked.sort_unstable();
        let points: Vec<[f64; 3]> = asked.iter().map(|(_, t)| bodies::inner_point(&submesh.points(*t))).collect();
        let windings = bodies::windings(survey, submesh, components, reversed, &points);
        let all: Vec<(u32, i32)> = asked.iter().map(|(c, _)| *c).zip(windings).collect();
        let is_in = |of: &[(u32, i32)]| {
            let sign = self.mouths[of[0].0 as usize].volume.signum();
            of.iter().all(|(_, winding)| f64::from(*winding) * sign >= 1.0)
        };
        all.chunk_by(|a, b| a.0 == b.0).filter(|of| is_in(of)).map(|of| of[0].0).collect()
    }

    /// Which components pass through what would close them, or are one-sided and have hardly more than a rim.
    fn torn(&self, survey: &Survey<'_>, submesh: &Submesh, components: &Components, reversed: &Reversed) -> Vec<bool> {
        let whole: f64 = self.mouths.iter().map(|mouth| mouth.area).sum();
        let may_be = |mouth: &Mouth| {
            let least = if mouth.is_one_sided { SUBSTANTIAL_ONE_SIDED } else { SUBSTANTIAL };
            mouth.area >= least * whole && mouth.is_wide() && !mouth.is_unclear
        };
        let mut torn: Vec<bool> =
            self.mouths.iter().map(|mouth| may_be(mouth) && mouth.is_one_sided && mouth.cones >= mouth.area).collect();
        let is_asked = |c: &usize| may_be(&self.mouths[*c]) && !torn[*c];
        let mut asked: Vec<usize> = (0..self.mouths.len()).filter(is_asked).collect();
        asked.sort_by_key(|c| std::cmp::Reverse(components.list[*c].extent.area));
        asked.truncate(MOST_LOOKED_AT);
        let mut room = MOST_TRIANGLES;
        asked.retain(|c| {
            let triangles = components.list[*c].triangles;
            let fits = triangles <= room;
            room -= if fits { triangles } else { 0 };
            fits
        });
        asked.sort_unstable();
        let mut cones: Vec<Vec<Corners>> = vec![Vec::new(); asked.len()];
        for (component, corners) in &self.cones {
            if let Ok(place) = asked.binary_search(&(*component as usize)) {
                cones[place].push(*corners);
            }
        }
        let surfaces = gather(survey, submesh, components, reversed, &asked);
        for ((c, surface), cones) in asked.into_iter().zip(surfaces).zip(cones) {
            torn[c] = is_torn(surface, &cones, survey.threads());
        }
        torn
    }
}

/// The volume under a cone over some edges, as seen from a point, its area, and its triangles.
fn cone(submesh: &Submesh, ways: &[[u32; 2]], from: DVec3) -> (f64, f64, Vec<Corners>) {
    let sum: DVec3 = ways.iter().map(|[a, _]| submesh.place(*a)).sum();
    let tip = Position::nearest(sum / ways.len() as f64);
    let centre = place(tip.coordinates());
    let (mut volume, mut area) = (0.0, 0.0);
    let mut triangles = Vec::with_capacity(ways.len());
    for way in ways {
        let [a, b] = way.map(|v| submesh.place(v));
        let normal = (a - centre).cross(b - centre);
        volume += (centre - from).dot(normal) / 6.0;
        area += normal.length() / 2.0;
        triangles.push([tip.coordinates(), submesh.positions[way[0] as usize], submesh.positions[way[1] as usize]]);
    }
    (volume, area, triangles)
}

/// Does a surface, with what closes it, have its front inside on a good part of it?
fn is_torn(mut surface: Vec<Corners>, cones: &[Corners], threads: usize) -> bool {
    let count = surface.len();
    surface.extend_from_slice(cones);
    let tree = Tree::winding(&surface);
    let step = count.div_ceil(SAMPLES).max(1);
    // The area of a triangle, and on which side of it there is material: of one that lies on what closes it, on neither.
    let samples = parallel::map(threads, count.div_ceil(step), |i| {
        let [a, b, c] = surface[i * step].map(place);
        let (middle, normal) = ((a + b + c) / 3.0, (b - a).cross(c - a));
        let off = normal.normalize_or_zero() * (OFF * normal.length().sqrt());
        let is_behind = tree.winding_number(middle - off) > 0.5;
        (normal.length(), is_behind, !is_behind && tree.winding_number(middle + off) < -0.5)
    });
    let share =
        |of: fn(&(f64, bool, bool)) -> bool| samples.iter().filter(|sample| of(sample)).map(|sample| sample.0).sum::<f64>();
    share(|sample| sample.1).min(share(|sample| sample.2)) > TORN * share(|_| true)
}

/// How far from a triangle it is asked, in roots of twice its area.
const OFF: f64 = 1e-2;

/// By triangle of the submesh: no orientation satisfies the edges of the surface that it is part of. Empty if that is so nowhere. O(regions + submesh) if any
/// edges disagree.
fn one_sided(survey: &Survey<'_>, submesh: &Submesh, edges: &Edges) -> Vec<bool> {
    if !edges.iter().any(|edge| edge.is_inconsistent()) {
        return Vec::new();
    }
    // Each region and triangle stands for itself as it is, and turned.
    let regions = survey.regions.len() as u32;
    let count = regions + submesh.triangles.len() as u32;
    let mut parents: Vec<u32> = (0..2 * count).collect();
    let mut relate = |a: u32, b: u32, disagree: bool| {
        let turned = if disagree { count } else { 0 };
        union_find::unite(&mut parents, a, b + turned);
        union_find::unite(&mut parents, a + count, b + count - turned);
    };
    for t in submesh.living() {
        let region = submesh.triangles[t as usize].region;
        if region != NONE {
            relate(region, regions + t, false);
        }
    }
    for edge in edges.iter() {
        if let [a, b] = edge.uses {
            relate(regions + a.triangle(), regions + b.triangle(), edge.is_inconsistent());
        }
    }
    let mut is_one_sided = |t: u32| {
        let node = regions + t;
        submesh.lives(t) && union_find::find(&mut parents, node) == union_find::find(&mut parents, node + count)
    };
    let found: Vec<bool> = (0..submesh.triangles.len() as u32).map(&mut is_one_sided).collect();
    if found.contains(&true) { found } else { Vec::new() }
}

#[cfg(test)]
mod tests;
