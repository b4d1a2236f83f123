//! Patches refined to the density around them, and shaped so that they continue the surface: each with the rings of triangles that it needs
//! from whichever chunks hold them, regions in parallel.
//!
//! A region is a patch, the stars of its rim's vertices, which are in the submesh, and the stars of all vertices next to the rim, most of
//! which are fetched from the file. They are fetched for so many patches at once as fit a bound by count, so that neither memory nor chunks
//! decide anything.

use std::collections::HashMap;

use glam::DVec3;

use crate::algorithms::extend;
use crate::algorithms::fairing::{self, CoarsePatch, Method, ShapeSettings, Shaped, Unshaped, edges, sorted};
use crate::contract::report::RepairName;
use crate::geometry::exact::{Point, at};
use crate::geometry::position::{self, Position};
use crate::repairs::holes::patches::{EXTENDED, Placed};
use crate::repairs::shared::work::Work;
use crate::submesh::{Origin, Submesh, Vertex};
use crate::topology::survey::Survey;
use crate::util::ids::NONE;
use crate::util::parallel;

/// Vertices on the rims of the patches that are worked on at once.
const RIM_VERTICES_AT_ONCE: usize = 1 << 16;

/// A patch has room for vertices of its own if one of its inner edges is so many times as long as the edges at its ends are on average.
const ROOMY: f64 = 1.5;

/// Vertices lie in a plane if they are off it by no more than this share of their coordinates: rounded to single precision, each is off by up to
/// √3/2 times half of it, and so may be the plane.
const FLAT: f64 = 2.0 * f32::EPSILON as f64;

/// Shapes every patch of these numbers that has room. One that cannot be shaped stays as it is.
pub(crate) fn smooth(
    survey: &Survey<'_>,
    work: &mut Work<'_>,
    placed: &mut [Placed],
    numbers: &[usize],
    settings: &ShapeSettings,
    threads: usize,
) {
    let submesh: &Submesh = work;
    let wanted = parallel::map(threads, numbers.len(), |k| is_wanted(submesh, &placed[numbers[k]], settings));
    let roomy: Vec<usize> = numbers.iter().zip(wanted).filter(|(_, wanted)| *wanted).map(|(i, _)| *i).collect();
    let mut rest = roomy.as_slice();
    while !rest.is_empty() {
        let mut vertices = 0;
        let count = rest
            .iter()
            .take_while(|i| {
                let fits = vertices < RIM_VERTICES_AT_ONCE;
                vertices += placed[**i].count as usize + 2;
                fits
            })
            .count();
        let (batch, later) = rest.split_at(count);
        rest = later;
        let submesh: &Submesh = work;
        let beyond = Beyond::of(survey, submesh, batch.iter().map(|i| &placed[*i]));
        let shaped = parallel::map(threads, batch.len(), |i| {
            let region = Gathered::of(submesh, &beyond, &placed[batch[i]]);
            if settings.method != Method::Coons && region.is_cut() {
                return Err(Unshaped::Cut);
            }
            let shaped = fairing::shape(
                &CoarsePatch { positions: &region.positions, patch: &region.patch, around: &region.around },
                settings,
            );
            shaped.map(|shaped| (region.vertices, shaped))
        });
        for (i, shaped) in batch.iter().zip(shaped) {
            match shaped {
                Ok((vertices, shaped)) => put_in(work, &mut placed[*i], vertices, &shaped),
                Err(reason) => tracing::debug!(patch = i, %reason, "Patch not shaped."),
            }
        }
    }
}

/// A rim of fewer vertices lies in a plane by chance.
const FEWEST_CUT: usize = 8;
/// Vertices next to a rim are as far from its plane as each other if these distances differ by less than this share of the largest.
const ALIKE: f64 = 0.5;

/// Is a patch to be shaped, as far as the triangles of the submesh tell?
fn is_wanted(submesh: &Submesh, patch: &Placed, ShapeSettings { method, finer, .. }: &ShapeSettings) -> bool {
    let (finer, may_be_edge) = (*finer, *method == Method::Coons);
    // One triangle has no inner edge, and planes are as they should be.
    (patch.count > 1 || patch.count == 1 && finer > 1.0) && patch.method != EXTENDED && {
        let edges = Edges::of(submesh, patch);
        (finer > 1.0 || edges.have_room(submesh))
            && (may_be_edge || !edges.is_rim_an_edge(submesh, patch))
            && !edges.lie_in_a_plane(submesh, patch)
    }
}

/// The edges of a patch, smaller vertex first, each once.
struct Edges {
    inner: Vec<[Vertex; 2]>,
    rim: Vec<[Vertex; 2]>,
    /// Triangles of the patch at the rim's edges.
    at_rim: Vec<u32>,
}

impl Edges {
    fn of(submesh: &Submesh, patch: &Placed) -> Self {
        let of_triangle = |t: u32| edges(submesh.triangles[t as usize].v).map(|e| (sorted(e), t));
        let mut all: Vec<([Vertex; 2], u32)> = patch.triangles().flat_map(of_triangle).collect();
        all.sort_unstable();
        let mut found = Self { inner: Vec::new(), rim: Vec::new(), at_rim: Vec::new() };
        for same in all.chunk_by(|a, b| a.0 == b.0) {
            match *same {
                [(edge, t)] => {
                    found.rim.push(edge);
                    found.at_rim.push(t);
                }
                _ => found.inner.push(same[0].0),
            }
        }
        found
    }

    /// Is an inner edge long for what is around?
    fn have_room(&self, submesh: &Submesh) -> bool {
        let mut ends: Vec<(Vertex, f64)> = Vec::with_capacity(2 * self.rim.len());
        for &[a, b] in &self.rim {
            let length = submesh.distance(a, b);
            ends.extend([(a, length), (b, length)]);
        }
        // Stable: the lengths at a vertex are summed in the edges' order.
        ends.sort_by_key(|(v, _)| *v);
        let usual = |v: Vertex| {
            let from = ends.partition_point(|(w, _)| *w < v);
            let here = ends[from..].iter().take_while(|(w, _)| *w == v);
            let (sum, count) = here.fold((0.0, 0_u32), |(sum, count), (_, length)| (sum + length, count + 1));
            if count == 0 { f64::INFINITY } else { sum / f64::from(count) }
        };
        self.inner.iter().any(|&[a, b]| submesh.distance(a, b) > ROOMY * 0.5 * (usual(a) + usual(b)))
    }

    /// The triangle beyond each edge of the rim, if there is exactly one.
    fn beyond<'s>(&'s self, submesh: &'s Submesh, patch: &'s Placed) -> impl Iterator<Item = Option<u32>> + 's {
        self.rim.iter().map(|&[a, b]| {
            let mut there = submesh.at_edge(a, b).filter(|t| !patch.holds(*t));
            there.next().filter(|_| there.next().is_none())
        })
    }

    /// Does the surface turn away at the rim? [`fairing::shape`] would say so, too, after the rings around were fetched.
    fn is_rim_an_edge(&self, submesh: &Submesh, patch: &Placed) -> bool {
        let (mut turn, mut length) = (0.0, 0.0);
        for ((&[a, b], &t), beyond) in self.rim.iter().zip(&self.at_rim).zip(self.beyond(submesh, patch)) {
            if let Some(beyond) = beyond {
                let along = submesh.distance(a, b);
                turn += submesh.normal(t).normalize_or_zero().dot(submesh.normal(beyond).normalize_or_zero()) * along;
                length += along;
            }
        }
        fairing::is_edge(turn, length)
    }

    /// Is the patch flat, and the triangles along its rim with it, as far as coordinates of single precision can tell? Then there is nothing to
    /// continue but the plane.
    fn lie_in_a_plane(&self, submesh: &Submesh, patch: &Placed) -> bool {
        let normal: DVec3 = patch.triangles().map(|t| submesh.normal(t)).sum();
        let perimeter: f64 = self.rim.iter().map(|&[a, b]| submesh.distance(a, b)).sum();
        // Of a circle its radius, of a slit its width: how well the rim holds the plane.
        let size = normal.length() / perimeter;
        let centre =
            self.rim.iter().map(|e| submesh.place(e[0]) + submesh.place(e[1])).sum::<DVec3>() / (2 * self.rim.len()) as f64;
        let normal = normal.normalize_or_zero();
        let lies = |v: Vertex| {
            let place = submesh.place(v);
            let away = place - centre;
            let rounding = FLAT * place.abs().max(centre.abs()).max_element();
            away.dot(normal).abs() <= rounding * (1.0 + away.length() / size)
        };
        let of_patch = patch.triangles().chain(self.beyond(submesh, patch).flatten());
        normal != DVec3::ZERO && of_patch.flat_map(|t| submesh.triangles[t as usize].v).all(lies)
    }
}

/// Triangles that are not in the submesh, around vertices that are: where each has its corners, by vertex.
pub(crate) struct Beyond {
    /// By vertex of the submesh, then by triangle.
    of_vertex: Vec<(Vertex, u32)>,
    corners: Vec<[Point; 3]>,
}

impl Beyond {
    /// Around the vertices next to the rims of some patches. Reads the chunks where they are at home.
    pub(crate) fn of<'p>(survey: &Survey<'_>, submesh: &Submesh, patches: impl Iterator<Item = &'p Placed>) -> Self {
        let mut next: Vec<Vertex> = patches
            .flat_map(|patch| patch.triangles().flat_map(|t| submesh.triangles[t as usize].v))
            .flat_map(|v| submesh.star(v).flat_map(|(t, _)| submesh.triangles[t as usize].v))
            .filter(|v| !submesh.complete[*v as usize])
            .collect();
        next.sort_unstable();
        next.dedup();
        let positions: Vec<Point> = next.iter().map(|v| submesh.positions[*v as usize]).collect();
        let numbers: HashMap<Position, Vertex> = next.iter().zip(&positions).map(|(v, p)| (Position::of(*p), *v)).collect();
        let found = survey.beyond_the_submesh(&positions);
        let mut beyond = Self { of_vertex: Vec::new(), corners: Vec::with_capacity(found.len()) };
        for (number, (irregular_triangle, _)) in (0..).zip(survey.ahead(found.iter(), |(s, _)| Some(s.triangle))) {
            let corners = position::corners(&survey.records[irregular_triangle.triangle as usize]);
            let at = corners.iter().filter_map(|p| numbers.get(&Position::of(*p)));
            beyond.of_vertex.extend(at.map(|v| (*v, number)));
            beyond.corners.push(corners);
        }
        beyond.of_vertex.sort_unstable();
        beyond
    }

    fn star(&self, v: Vertex) -> impl Iterator<Item = u32> + '_ {
        let from = self.of_vertex.partition_point(|(w, _)| *w < v);
        self.of_vertex[from..].iter().take_while(move |(w, _)| *w == v).map(|(_, t)| *t)
    }
}

/// A region in a numbering of its own, which begins with the vertices of the patch.
pub(crate) struct Gathered {
    pub(crate) positions: Vec<Point>,
    /// Vertices of the submesh; [`NONE`] for others.
    vertices: Vec<Vertex>,
    pub(crate) patch: Vec<[u32; 3]>,
    pub(crate) around: Vec<[u32; 3]>,
}

impl Gathered {
    /// Was the surface cut along a plane, as a scan is at its bottom? Its rim lies in one, and what is next to it anywhere: where rows of vertices
    /// run along the rim, the plane is theirs.
    pub(crate) fn is_cut(&self) -> bool {
        let rim = self.patch.iter().flatten().max().map_or(0, |last| *last as usize + 1);
        let points = &self.positions[..rim];
        if rim < FEWEST_CUT || !extend::lie_in_a_plane(points) {
            return false;
        }
        let place = |v: u32| at(&self.positions[v as usize]);
        let normal: DVec3 = self.patch.iter().map(|t| (place(t[1]) - place(t[0])).cross(place(t[2]) - place(t[0]))).sum();
        let normal = normal.normalize_or_zero();
        let is_on_rim = |v: &&u32| (**v as usize) < rim;
        let next = self.around.iter().filter(|t| t.iter().any(|v| is_on_rim(&v))).flatten().filter(|v| !is_on_rim(v));
        let heights = next.map(|v| (place(*v) - place(0)).dot(normal).abs());
        let (least, most) = heights.fold((f64::INFINITY, 0.0_f64), |(least, most), h| (least.min(h), most.max(h)));
        most > 0.0 && most - least > ALIKE * most
    }

    pub(crate) fn of(submesh: &Submesh, beyond: &Beyond, patch: &Placed) -> Self {
        let mut region = Self { positions: Vec::new(), vertices: Vec::new(), patch: Vec::new(), around: Vec::new() };
        let mut numbers: HashMap<Position, u32> = HashMap::new();
        let mut number = |region: &mut Self, position: Point, vertex: Vertex| {
            *numbers.entry(Position::of(position)).or_insert_with(|| {
                region.positions.push(position);
                region.vertices.push(vertex);
                region.positions.len() as u32 - 1
            })
        };
        for t in patch.triangles() {
            let v = submesh.triangles[t as usize].v.map(|v| number(&mut region, submesh.positions[v as usize], v));
            region.patch.push(v);
        }
        let rim = region.vertices.clone();
        let mut near: Vec<u32> = rim.iter().flat_map(|v| submesh.star(*v).map(|(t, _)| t)).filter(|t| !patch.holds(*t)).collect();
        near.sort_unstable();
        near.dedup();
        let mut next: Vec<Vertex> = near.iter().flat_map(|t| submesh.triangles[*t as usize].v).collect();
        next.sort_unstable();
        next.dedup();
        near.extend(next.iter().flat_map(|v| submesh.star(*v).map(|(t, _)| t)).filter(|t| !patch.holds(*t)));
        near.sort_unstable();
        near.dedup();
        for t in near {
            let v = submesh.triangles[t as usize].v.map(|v| number(&mut region, submesh.positions[v as usize], v));
            region.around.push(v);
        }
        let mut far: Vec<u32> = next.iter().flat_map(|v| beyond.star(*v)).collect();
        far.sort_unstable();
        far.dedup();
        for t in far {
            let v = beyond.corners[t as usize].map(|p| number(&mut region, p, NONE));
            region.around.push(v);
        }
        region
    }
}

/// Replaces the coarse patch, if no edge of the new one is there already.
fn put_in(work: &mut Work<'_>, patch: &mut Placed, mut vertices: Vec<Vertex>, shaped: &Shaped) {
    let coarse: Vec<[Vertex; 3]> = patch.triangles().map(|t| work.triangles[t as usize].v).collect();
    let mut own: Vec<[Vertex; 2]> = coarse.iter().flat_map(|v| edges(*v)).map(sorted).collect();
    own.sort_unstable();
    let of_submesh = |v: u32| vertices.get(v as usize).copied().unwrap_or(NONE);
    let is_there = |[a, b]: [Vertex; 2]| {
        // Of the coarse patch's, the rim's are the surface's as well, and the others go.
        a != NONE && b != NONE && own.binary_search(&[a, b]).is_err() && work.has_edge(a, b)
    };
    if shaped.triangles.iter().flat_map(|t| edges(t.map(of_submesh))).map(sorted).any(is_there) {
        return;
    }
    patch.triangles().for_each(|t| work.kill(t));
    vertices.extend(shaped.added.iter().map(|p| work.add_vertex(Position::of(*p))));
    patch.first = work.triangles.len() as u32;
    patch.count = shaped.triangles.len() as u32;
    for t in &shaped.triangles {
        work.add(t.map(|v| vertices[v as usize]), Origin::Added(RepairName::Fill), NONE);
    }
    patch.coarse = coarse;
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use crate::contract::settings::Profile;
    use crate::repairs::holes::fill;
    use crate::testing::{Corners, after, plate};

    /// How a hole of 8 by 8 squares in a plate of 16 by 16 is closed that lies askew, far from the origin, and is bent to a cylinder.
    fn closed(curvature: f32) -> BTreeMap<String, u64> {
        let is_there = |x: u8, y: u8| !((4..12).contains(&x) && (4..12).contains(&y));
        let askew = |[x, y, _]: [f32; 3]| {
            let z = curvature * (x - 8.0) * (x - 8.0) / 2.0;
            [0.6 * x - 0.8 * z + 50.3, y / 1.7 - 20.1, 0.8 * x + 0.6 * z + 33.7]
        };
        let sheet: Vec<Corners> = plate(16, is_there).iter().map(|t| t.map(askew)).collect();
        after(&sheet, |d, _| fill::fill(d, &Profile::default())).result.by_method
    }

    #[test]
    fn a_flat_surface_is_closed_by_the_plain_triangulation() {
        assert_eq!(closed(0.0), BTreeMap::from([("planar".into(), 1)]));
    }

    #[test]
    fn a_surface_that_is_bent_by_more_than_rounding_is_continued() {
        // The hole's middle is 0.01 off its rim.
        assert_eq!(closed(0.00125), BTreeMap::from([("planar (shaped like what is around)".into(), 1)]));
    }
}
