//! Candidates: patches that may be features.

use super::super::feature::Kind;
use super::super::loops::loops;
use super::super::mesh::Mesh;
use super::super::reason::Reason;
use super::super::segments::{Segment, Segments};
use super::super::surface::{Surface, meridian};
use super::super::vector::{Point, along, cross, distance, dot, mean, norm, scale, six_volumes, sub, unit};
use super::measure::{Rim, rim};
use super::strip::Strip;

/// The largest volume of a patch, in its widest rim's area times its extent.
const MOST_FILL: f64 = 1.3;
/// The largest diameter of a hole's bevelled or rounded edge, in its bore's; heads of screws are wider.
pub(super) const EDGE: f64 = 1.51;

/// Cosine of 6°: what turns less is smooth.
pub(super) const COS_SMOOTH: f64 = 0.9945;

/// A patch that may be a feature.
pub(crate) struct Candidate {
    /// Its kind, place, sizes and triangles.
    pub(crate) entry: Entry,
    pub(crate) confidence: f64,
    pub(crate) loops: Vec<Vec<u32>>,
    /// Strips between two faces, for fillets and chamfers; none for what lies on carriers by itself.
    pub(crate) strips: Vec<Strip>,
    /// Features that go with it and are told by themselves: fillets of other radii, bores that cross.
    pub(crate) kin: Vec<Entry>,
    /// Why it is not removed, if that is known before a removal is planned.
    pub(crate) barred: Option<Reason>,
}

/// Kind, place, sizes and triangles of a feature, as it is told.
#[derive(Clone, Debug)]
pub(crate) struct Entry {
    pub(crate) kind: Kind,
    pub(crate) centre: Point,
    pub(crate) axis: Point,
    pub(crate) size: f64,
    pub(crate) length: f64,
    pub(crate) depth: f64,
    pub(crate) triangles: Vec<u32>,
}

impl Candidate {
    /// A candidate without strips.
    pub(super) fn new(entry: Entry, confidence: f64, loops: Vec<Vec<u32>>) -> Self {
        Self { entry, confidence, loops, strips: Vec::new(), kin: Vec::new(), barred: None }
    }
}

/// Sorts a patch whose rims lie on carriers into its kind; `None` of what is none: all around, or a bar between two faces.
pub(super) fn classify(mesh: &Mesh, segments: &Segments, triangles: Vec<u32>) -> Option<Candidate> {
    let inside = |t: u32| triangles.binary_search(&t).is_ok();
    let loops = loops(mesh, &triangles, inside);
    let polygons: Vec<Vec<Point>> = loops.iter().map(|rim| rim.iter().map(|h| mesh.at(mesh.from(*h))).collect()).collect();
    let origin = mean(polygons.first()?);
    let rims: Vec<Rim> = polygons.iter().map(|p| rim(p)).collect();
    let volume = volume(mesh, &triangles, &polygons, origin);
    // What is much wider within than its rims, a room behind a window, is no feature of the face. Bores that cross have four rims.
    let widest = rims.iter().map(|r| r.area).fold(0.0, f64::max).max(rims.iter().map(|r| r.area).sum::<f64>() / 2.0);
    if volume.abs() > 6.0 * MOST_FILL * widest * extent(mesh, &triangles) {
        return None;
    }
    let (first, rest) = rims.split_first()?;
    let carrier = segments.get(mesh.across(*loops.first()?.first()?)).1;
    let side = if carrier.is_concave { -1.0 } else { 1.0 };
    // Heights over the carrier: a boss is above it everywhere, a hole below.
    let heights = triangles.iter().flat_map(|t| mesh.triangles[*t as usize]).map(|v| side * carrier.surface.distance(mesh.at(v)));
    let (low, high) = heights.fold((0.0_f64, 0.0_f64), |(l, h), x| (l.min(x), h.max(x)));
    // What stays this near to its face is the face.
    if rest.is_empty() && high - low <= 8.0 * mesh.flatness() {
        return None;
    }
    let slack = 8.0 * mesh.flatness() + 0.02 * (high - low);
    let axis = carrier.outward(first.centre);
    let numbers = segment_numbers(segments, &triangles);
    // What is of free form has a clear edge: roughness of a face has none.
    if !segments.are_drawn(mesh, &numbers, &loops) && !has_edge(mesh, segments, &loops) {
        return None;
    }
    let confidence = confidence(mesh, segments, &numbers);
    let make = |kind, size, depth, triangles, loops| {
        let centre = mean(&rims.iter().map(|r| r.centre).collect::<Vec<_>>());
        let length = rims.iter().map(|r| r.length).fold(0.0, f64::max);
        Some(Candidate::new(Entry { kind, centre, axis, size, length, depth, triangles }, confidence, loops))
    };
    if volume > 0.0 {
        let is_boss = rest.is_empty() && -low <= slack.max(0.05 * high) && high > slack;
        return if is_boss { make(Kind::Boss, high, high, triangles, loops) } else { None };
    }
    if rest.is_empty() && high > slack.max(-0.05 * low) {
        return None;
    }
    let round: Option<f64> = rims.iter().map(|r| r.diameter).try_fold(0.0_f64, |most, d| d.map(|d| most.max(d)));
    // Rims on curved faces are no plane circles; the wall says what they are.
    let wall = wall(mesh, segments, &numbers, axis);
    let round = round.map(|d| d.max(wall.diameter)).or_else(|| wall.is_all_round.then_some(wall.diameter));
    let round = round.map(|d| wall.without_edge(d));
    let kind = kind(segments, &numbers, &wall, rest.is_empty(), round.is_some(), first);
    let width = rims.iter().map(|r| r.width.min(r.hydraulic)).fold(0.0, f64::max);
    let found = make(kind, round.unwrap_or(width), -low, triangles, loops)?;
    let crossed = if kind == Kind::ThroughHole && rims.len() > 3 { bores(mesh, segments, &numbers) } else { Vec::new() };
    Some(if crossed.len() > 1 { apart(found, crossed) } else { found })
}

/// Bores that cross, in place of the hole that all of them are.
fn apart(hole: Candidate, mut bores: Vec<Entry>) -> Candidate {
    let Entry { kind, triangles, .. } = hole.entry;
    Candidate { entry: Entry { kind, triangles, ..bores.remove(0) }, kin: bores, ..hole }
}

/// The kind of a depression.
fn kind(segments: &Segments, numbers: &[u32], wall: &Wall, is_blind: bool, is_round: bool, rim: &Rim) -> Kind {
    let has = |test: &dyn Fn(&Surface) -> bool| numbers.iter().any(|s| test(&segments.list[*s as usize].surface));
    match (is_round, is_blind) {
        (true, _) if wall.cylinders > 1 => Kind::CounterboredHole,
        (true, _) if wall.cylinders == 1 && wall.widens && wall.without_edge(wall.diameter) == wall.diameter => {
            Kind::CountersunkHole
        }
        (true, true) if wall.cylinders == 0 && has(&|s| matches!(s, Surface::Sphere { .. })) => Kind::Dimple,
        (true, true) => Kind::BlindHole,
        (true, false) => Kind::ThroughHole,
        (false, _) if rim.length > 1.8 * rim.width && rim.hydraulic > 1.2 * rim.width => Kind::Slot,
        (false, _) => Kind::Pocket,
    }
}

/// The concave cylinders of a patch by their axes: bores that cross are told of one by one.
fn bores(mesh: &Mesh, segments: &Segments, numbers: &[u32]) -> Vec<Entry> {
    let mut groups: Vec<Vec<u32>> = Vec::new();
    for number in numbers {
        let segment = &segments.list[*number as usize];
        let Surface::Cylinder { origin, axis, radius } = segment.surface else { continue };
        let is_same = |group: &Vec<u32>| match group.first().map(|first| segments.list[*first as usize].surface) {
            Some(Surface::Cylinder { origin: p, axis: a, .. }) => {
                norm(cross(axis, a)) < 0.02 && norm(cross(sub(p, origin), axis)) < 0.02 * radius
            }
            _ => false,
        };
        match groups.iter_mut().find(|group| is_same(group)) {
            Some(group) => group.push(*number),
            None if segment.is_concave => groups.push(vec![*number]),
            None => {}
        }
    }
    let told = |group: Vec<u32>| {
        let first = group.first().map(|s| &segments.list[*s as usize])?;
        let mut triangles: Vec<u32> = group.iter().flat_map(|s| segments.list[*s as usize].triangles.iter().copied()).collect();
        triangles.sort_unstable();
        Some(bore(mesh, first, &triangles))
    };
    groups.into_iter().filter_map(told).collect()
}

/// Place and sizes of a cylinder's piece.
pub(super) fn bore(mesh: &Mesh, segment: &Segment, triangles: &[u32]) -> Entry {
    let (origin, axis) = segment.surface.axis().unwrap_or(([0.0; 3], [0.0, 0.0, 1.0]));
    let size = 2.0 * segment.surface.radius().unwrap_or(0.0);
    let heights = triangles.iter().flat_map(|t| mesh.triangles[*t as usize]).map(|v| meridian(origin, axis, mesh.at(v))[0]);
    let (low, high) = heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
    let centre = along(origin, axis, (low + high) / 2.0);
    Entry { kind: Kind::ThroughHole, centre, axis, size, length: size, depth: high - low, triangles: triangles.to_vec() }
}

/// Six times the volume between a patch and flat lids over its rims; negative where the part lacks it.
fn volume(mesh: &Mesh, triangles: &[u32], polygons: &[Vec<Point>], origin: Point) -> f64 {
    let corners = |t: &u32| mesh.triangles[*t as usize].map(|v| sub(mesh.at(v), origin));
    let own: f64 = triangles.iter().map(|t| six_volumes(corners(t))).sum();
    let lid = |polygon: &Vec<Point>| -> f64 {
        let middle = sub(mean(polygon), origin);
        let side = |k: usize| [sub(polygon[(k + 1) % polygon.len()], origin), sub(polygon[k], origin), middle];
        (0..polygon.len()).map(|k| six_volumes(side(k))).sum()
    };
    own + polygons.iter().map(lid).sum::<f64>()
}

fn segment_numbers(segments: &Segments, triangles: &[u32]) -> Vec<u32> {
    let mut numbers: Vec<u32> = triangles.iter().map(|t| segments.of[*t as usize]).collect();
    numbers.sort_unstable();
    numbers.dedup();
    numbers
}

/// How well the vertices lie on the surfaces of the patch, 1 on them, 0 at the tolerance of rounding, times the share of its area
/// whose surfaces are proven.
pub(super) fn confidence(mesh: &Mesh, segments: &Segments, numbers: &[u32]) -> f64 {
    let worst = numbers.iter().map(|s| segments.list[*s as usize].residual).fold(0.0, f64::max);
    segments.proven_share(numbers) * (1.0 - worst / (16.0 * mesh.flatness()).max(1e-300)).clamp(0.0, 1.0)
}

/// Whether nine tenths of the rims' length, at least, turn by more than 6°.
fn has_edge(mesh: &Mesh, segments: &Segments, loops: &[Vec<u32>]) -> bool {
    let (mut sharp, mut all) = (0.0, 0.0);
    for half in loops.iter().flatten() {
        let length = distance(mesh.at(mesh.from(*half)), mesh.at(mesh.to(*half)));
        let outward = segments.get(mesh.across(*half)).1.outward(mesh.at(mesh.from(*half)));
        all += length;
        sharp += if dot(outward, mesh.normals[(half / 3) as usize]) < COS_SMOOTH { length } else { 0.0 };
    }
    sharp > 0.9 * all
}

struct Wall {
    /// The largest diameter of coaxial round walls.
    diameter: f64,
    /// That of cylinders.
    bore: f64,
    /// How many cylinders of different diameters there are.
    cylinders: usize,
    /// Whether a cone opens to more than the cylinder.
    widens: bool,
    is_all_round: bool,
}

impl Wall {
    /// The diameter of a hole whose rims have some: edges that are bevelled or rounded by no more than half of the bore's radius
    /// do not count.
    fn without_edge(&self, diameter: f64) -> f64 {
        if self.bore > 0.0 && diameter <= EDGE * self.bore { self.bore } else { diameter }
    }
}

/// The walls around the axis of the largest cylinder or cone of a patch that is concave.
fn wall(mesh: &Mesh, segments: &Segments, numbers: &[u32], axis: Point) -> Wall {
    let mut wall = Wall { diameter: 0.0, bore: 0.0, cylinders: 0, widens: false, is_all_round: false };
    let concave = numbers.iter().map(|s| &segments.list[*s as usize]).filter(|s| s.is_concave && s.surface.axis().is_some());
    let mut round: Vec<_> = concave.collect();
    round.sort_by(|a, b| b.area.total_cmp(&a.area));
    let Some((origin, along)) = round.first().and_then(|s| s.surface.axis()) else { return wall };
    let parallel = |d: Point| norm(cross(d, along)) < 0.02;
    let mut radii: Vec<f64> = Vec::new();
    let mut rest = 0.0;
    let total: f64 = numbers.iter().map(|s| segments.list[*s as usize].area).sum();
    for segment in &round {
        let Some((p, d)) = segment.surface.axis() else { continue };
        let far =
            segment.triangles.iter().take(4_000).flat_map(|t| mesh.triangles[*t as usize]).map(|v| meridian(p, d, mesh.at(v))[1]);
        let far = far.fold(0.0, f64::max);
        if !parallel(d) || norm(cross(sub(p, origin), along)) > 0.02 * far {
            continue;
        }
        rest += segment.area;
        wall.diameter = wall.diameter.max(2.0 * far);
        match segment.surface {
            Surface::Cylinder { radius, .. } if !radii.iter().any(|r| (r - radius).abs() < 0.02 * radius) => radii.push(radius),
            _ => {}
        }
    }
    wall.cylinders = radii.len();
    wall.bore = 2.0 * radii.iter().copied().fold(0.0, f64::max);
    wall.widens = radii.iter().all(|r| wall.diameter > 2.04 * r);
    // Turned all around: facets of the largest wall face all sides.
    let largest = round.first().map_or(&[][..], |s| &s.triangles);
    let sum = largest.iter().take(4_000).fold([0.0; 3], |sum, t| {
        let n = scale(mesh.normals[*t as usize], mesh.areas[*t as usize]);
        [0, 1, 2].map(|k| sum[k] + n[k])
    });
    let area: f64 = largest.iter().take(4_000).map(|t| mesh.areas[*t as usize]).sum();
    let across = sub(sum, scale(along, dot(sum, along)));
    let flats = numbers.iter().map(|s| &segments.list[*s as usize]).filter(|s| s.surface.is_plane());
    let ends: f64 = flats.filter(|s| dot(s.outward(origin), along).abs() > 0.98).map(|s| s.area).sum();
    wall.is_all_round = norm(across) < 0.25 * area && rest + ends > 0.7 * total && dot(axis, along).abs() > 0.3;
    wall
}

/// The extent of a patch: the diagonal of the box around it.
pub(crate) fn extent(mesh: &Mesh, triangles: &[u32]) -> f64 {
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for vertex in triangles.iter().flat_map(|t| mesh.triangles[*t as usize]) {
        let point = mesh.at(vertex);
        for k in 0..3 {
            low[k] = low[k].min(point[k]);
            high[k] = high[k].max(point[k]);
        }
    }
    distance(low, high)
}

/// The direction of a vector, or upwards.
pub(super) fn direction(vector: Point) -> Point {
    unit(vector).unwrap_or([0.0, 0.0, 1.0])
}
