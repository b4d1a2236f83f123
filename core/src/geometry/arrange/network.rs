//! Where triangles cut each other, and every triangle's pieces.
//!
//! Segments first, by pairs; then where those of one triangle cross. A point that one triangle finds on an edge or a segment cuts all
//! triangles that have this edge or segment, so that pieces meet along whole edges. Then each triangle is triangulated by itself.

use crate::geometry::arrange::cuts::{Cuts, Segment, Side, sorted};
use crate::geometry::arrange::flat::{Flat, Lines, others};
use crate::geometry::arrange::plane::{on_line, on_lines, on_planes};
use crate::geometry::arrange::point::Point;
use crate::geometry::arrange::quotient::scaled;
use crate::geometry::arrange::soup::Soup;
use crate::geometry::arrange::table::Table;
use crate::geometry::arrange::triangulate::triangulate;
use crate::geometry::exact;
use crate::util::ids::NONE;
use crate::util::parallel;

/// Triangles cut along all that they meet; pieces with points as they were found.
pub(crate) struct Network<'a> {
    pub(crate) soup: Soup<'a>,
    points: Vec<Point>,
    /// Those that pieces need, in the order in which they do.
    order: Vec<u32>,
    /// The triangle, and the points, the way round that it runs. By triangle.
    pub(crate) pieces: Vec<(u32, [u32; 3])>,
}

/// Points of an edge or a segment, by its ends: sorted, for searches.
type Splits = Vec<([u32; 2], u32)>;

/// Points that one triangle finds, and its edges and segments that they split.
#[derive(Default)]
struct Found {
    points: Vec<u32>,
    edges: Splits,
    segments: Splits,
}

struct Builder<'a> {
    soup: Soup<'a>,
    threads: usize,
    table: Table,
    corners: Vec<[u32; 3]>,
    has_area: Vec<bool>,
    /// By triangle.
    segments: Vec<Vec<Segment>>,
    sides: Vec<Vec<Side>>,
}

impl Network<'_> {
    /// `None` if coordinates have too many bits, or if a triangulation fails.
    pub(crate) fn build(triangles: &[[[f32; 3]; 3]], threads: usize) -> Option<Network<'_>> {
        let soup = Soup::new(triangles)?;
        let mut table = Table::default();
        let numbers = |t| soup.corners(t).map(|p| table.intern(Point::corner(&p)));
        let corners: Vec<[u32; 3]> = (0..triangles.len()).map(numbers).collect();
        let has_area: Vec<bool> = triangles.iter().map(|[a, b, c]| !exact::collinear(a, b, c)).collect();
        let cuts = Cuts::of(&soup, threads, &has_area, &corners, &mut table);
        let mut builder = Builder { soup, threads, table, corners, has_area, segments: cuts.segments, sides: cuts.sides };
        let found = builder.find();
        let edges = merged(found.iter().map(|f| &f.edges));
        let splits = merged(found.iter().map(|f| &f.segments));
        let cut = |t| builder.cut(t, &found[t], &edges, &splits);
        let cut: Vec<Option<Cut>> = parallel::map(threads, triangles.len(), cut);
        numbered(builder, cut)
    }
}

impl Network<'_> {
    /// How many points there are.
    pub(crate) fn count(&self) -> usize {
        self.order.len()
    }

    /// A point, as pieces number them.
    pub(crate) fn point(&self, number: u32) -> &Point {
        &self.points[self.order[number as usize] as usize]
    }
}

fn merged<'s>(all: impl Iterator<Item = &'s Splits>) -> Splits {
    let mut merged = all.flatten().copied().collect::<Splits>();
    merged.sort_unstable();
    merged.dedup();
    merged
}

/// The points that split an edge or a segment.
fn of_ends(splits: &Splits, ends: [u32; 2]) -> impl Iterator<Item = u32> {
    let key = sorted(ends);
    let first = splits.partition_point(|(ends, _)| *ends < key);
    splits[first..].iter().take_while(move |(ends, _)| *ends == key).map(|(_, point)| *point)
}

/// Where a triangle is cut: its points, and pieces of these.
struct Cut {
    points: Vec<u32>,
    pieces: Vec<[usize; 3]>,
}

/// The network with points in the order in which pieces need them.
fn numbered(builder: Builder<'_>, cut: Vec<Option<Cut>>) -> Option<Network<'_>> {
    let mut numbers = vec![NONE; builder.table.points.len()];
    let mut order = Vec::new();
    let mut pieces = Vec::new();
    for (cut, t) in cut.into_iter().zip(0..) {
        let cut = cut?;
        let ids: Vec<u32> = cut.points.iter().map(|p| number(&mut numbers, &mut order, *p)).collect();
        pieces.extend(cut.pieces.iter().map(|v| (t, v.map(|v| ids[v]))));
    }
    Some(Network { soup: builder.soup, points: builder.table.points, order, pieces })
}

fn number(numbers: &mut [u32], order: &mut Vec<u32>, p: u32) -> u32 {
    if numbers[p as usize] == NONE {
        numbers[p as usize] = order.len() as u32;
        order.push(p);
    }
    numbers[p as usize]
}

impl Builder<'_> {
    /// Finds where segments cross, and what lies on which edge and segment.
    fn find(&mut self) -> Vec<Found> {
        let count = self.segments.len();
        let crossings: Vec<Vec<[u32; 2]>> = parallel::map(self.threads, count, |t| self.crossings(t));
        // A point where three planes meet is found in all three triangles.
        let all = || crossings.iter().enumerate().flat_map(|(t, pairs)| pairs.iter().map(move |pair| (t, *pair)));
        let mut keys: Vec<([u32; 3], usize)> = all().enumerate().map(|(i, (t, pair))| (self.key(t, pair), i)).collect();
        let places: Vec<(usize, [u32; 2])> = all().collect();
        keys.sort_unstable();
        let groups: Vec<&[([u32; 3], usize)]> = keys.chunk_by(|a, b| a.0[0] != NONE && a.0 == b.0).collect();
        let points = parallel::map(self.threads, groups.len(), |g| {
            let (t, pair) = places[groups[g][0].1];
            self.meeting(t, pair)
        });
        let mut numbers = vec![NONE; places.len()];
        for (group, point) in groups.iter().zip(points) {
            let Some(point) = point else { continue };
            let number = self.table.intern(point);
            group.iter().for_each(|(_, i)| numbers[*i] = number);
        }
        let mut starts = vec![0; count + 1];
        (0..count).for_each(|t| starts[t + 1] = starts[t] + crossings[t].len());
        parallel::map(self.threads, count, |t| self.found(t, &crossings[t], &numbers[starts[t]..starts[t + 1]]))
    }

    /// Three triangles whose planes meet at a crossing of segments; where it is told by edges, none.
    fn key(&self, t: usize, pair: [u32; 2]) -> [u32; 3] {
        let [a, b] = pair.map(|s| &self.segments[t][s as usize]);
        let mut key = [t as u32, a.other, b.other];
        key.sort_unstable();
        if a.edge.is_none() && b.edge.is_none() { key } else { [NONE; 3] }
    }

    fn meeting(&self, t: usize, pair: [u32; 2]) -> Option<Point> {
        let [a, b] = pair.map(|s| &self.segments[t][s as usize]);
        let plane = |s: &Segment| self.soup.plane(s.other as usize);
        match (&a.edge, &b.edge) {
            (None, None) => {
                let [first, second, third] = self.key(t, pair).map(|t| self.soup.plane(t as usize));
                on_planes(first, second, third)
            }
            (Some(edge), None) => on_line(&self.soup.edge(*edge), plane(b)),
            (None, Some(edge)) => on_line(&self.soup.edge(*edge), plane(a)),
            (Some(edge), Some(other)) => on_lines(&self.soup.edge(*edge), &self.soup.edge(*other), self.soup.plane(t).axis),
        }
    }

    fn flat(&self, t: usize, points: &[u32]) -> Flat<'_> {
        Flat::new(points.iter().map(|p| &self.table.points[*p as usize]).collect(), self.soup.plane(t).axis)
    }

    /// The pairs of segments of a triangle that cross inside of both.
    fn crossings(&self, t: usize) -> Vec<[u32; 2]> {
        let segments = &self.segments[t];
        let mut out = Vec::new();
        if segments.len() < 2 {
            return out;
        }
        let points: Vec<u32> = segments.iter().flat_map(|s| s.ends).collect();
        let flat = self.flat(t, &points);
        let ends = |s: usize| (2 * s, 2 * s + 1);
        let boxes: Vec<[[f64; 2]; 2]> = (0..segments.len()).map(|s| box_of(&flat, ends(s))).collect();
        // From left to right.
        let mut order: Vec<usize> = (0..boxes.len()).collect();
        order.sort_by(|a, b| boxes[*a][0][0].total_cmp(&boxes[*b][0][0]));
        let mut open: Vec<usize> = Vec::new();
        for s in order {
            let ([left, low], [_, high]) = (boxes[s][0], boxes[s][1]);
            open.retain(|o| boxes[*o][1][0] >= left);
            for o in &open {
                let meet = segments[*o].ends.iter().any(|end| segments[s].ends.contains(end));
                if !meet && boxes[*o][0][1] <= high && boxes[*o][1][1] >= low && flat.cross(ends(s), ends(*o)) {
                    out.push([s.min(*o) as u32, s.max(*o) as u32]);
                }
            }
            open.push(s);
        }
        out
    }

    fn found(&self, t: usize, crossings: &[[u32; 2]], numbers: &[u32]) -> Found {
        let (segments, sides) = (&self.segments[t], &self.sides[t]);
        if segments.is_empty() && sides.is_empty() {
            return Found::default();
        }
        let ends = segments.iter().map(|s| s.ends).chain(sides.iter().map(|side| side.0)).flatten();
        let mut points: Vec<u32> = ends.chain(numbers.iter().copied().filter(|n| *n != NONE)).collect();
        points.sort_unstable();
        points.dedup();
        let corners = self.corners[t];
        let all: Vec<u32> = points.iter().chain(&corners).copied().collect();
        let flat = self.flat(t, &all);
        let place = |p: u32| points.binary_search(&p).unwrap_or(0);
        let search = Search::new(&flat, points.len());
        // Which segment, and which point.
        let mut known: Vec<(u32, u32)> = crossings.iter().zip(numbers).flat_map(|(pair, n)| pair.map(|s| (s, *n))).collect();
        known.sort_unstable();
        let mut found = Found { edges: Vec::new(), segments: Vec::new(), points: Vec::new() };
        for k in 0..3 {
            let (a, b) = (points.len() + k, points.len() + (k + 1) % 3);
            let key = sorted([corners[k], corners[(k + 1) % 3]]);
            let sides = || sides.iter().filter(|side| usize::from(side.1) == k);
            let known = |p: usize| sides().any(|side| side.0.contains(&points[p]));
            let near = search.within(&flat, (a, b)).filter(|p| flat.certain_turn(a, b, *p) == 0 && !key.contains(&points[*p]));
            let on: Vec<usize> = near.filter(|p| known(*p) || is_between(&flat, (a, b), *p)).collect();
            for (ends, _) in sides() {
                let [low, high] = in_order(&flat, ends.map(place));
                let inside = on.iter().filter(|p| flat.cmp(low, **p).is_lt() && flat.cmp(**p, high).is_lt());
                found.segments.extend(inside.map(|p| (*ends, points[*p])));
            }
            found.edges.extend(on.into_iter().map(|p| (key, points[p])));
        }
        for (s, segment) in segments.iter().enumerate() {
            let (key, ends) = (sorted(segment.ends), (place(segment.ends[0]), place(segment.ends[1])));
            let known = |p: usize| known.binary_search(&(s as u32, points[p])).is_ok();
            let near = search
                .within(&flat, ends)
                .filter(|p| flat.certain_turn(ends.0, ends.1, *p) == 0 && ![ends.0, ends.1].contains(p));
            found.segments.extend(near.filter(|p| known(*p) || is_between(&flat, ends, *p)).map(|p| (key, points[p])));
        }
        found.points = points;
        found
    }

    fn cut(&self, t: usize, found: &Found, edges: &Splits, splits: &Splits) -> Option<Cut> {
        let (corners, segments) = (self.corners[t], &self.segments[t]);
        if !self.has_area[t] {
            return Some(Cut { points: Vec::new(), pieces: Vec::new() });
        }
        let mut extra: Vec<u32> = Vec::new();
        for k in 0..3 {
            extra.extend(of_ends(edges, [corners[k], corners[(k + 1) % 3]]));
        }
        let sides = self.sides[t].iter().map(|side| side.0);
        segments.iter().map(|s| s.ends).chain(sides).for_each(|ends| extra.extend(of_ends(splits, ends)));
        if segments.is_empty() && extra.is_empty() {
            return Some(Cut { points: corners.to_vec(), pieces: vec![[0, 1, 2]] });
        }
        extra.extend(segments.iter().flat_map(|s| s.ends));
        extra.sort_unstable();
        extra.dedup();
        extra.retain(|p| !corners.contains(p));
        self.along_a_curve(t, &mut extra);
        let points: Vec<u32> = corners.into_iter().chain(extra).collect();
        let mut places: Vec<(u32, usize)> = points.iter().copied().zip(0..).collect();
        places.sort_unstable();
        let flat = self.flat(t, &points).with(self.lines(t, edges, splits, points.len(), &places));
        let constraints = self.constraints(&flat, segments, found, splits, &points, &places);
        let mut pieces = triangulate(&flat, &constraints)?;
        if !self.soup.plane(t).looks_along() {
            pieces.iter_mut().for_each(|v| v.swap(1, 2));
        }
        Some(Cut { points, pieces })
    }

    /// Points of a triangle in an order in which each is near to the one before: so a triangulation that they are added to changes little.
    fn along_a_curve(&self, t: usize, points: &mut [u32]) {
        let seen = others(self.soup.plane(t).axis);
        let at = |p: u32| seen.map(|k| self.table.points[p as usize].high[k]);
        let corners = self.corners[t].map(at);
        let place = |p: u32| {
            let cell = |k: usize| {
                let [a, b, c] = corners.map(|corner| corner[k]);
                let (low, high) = (a.min(b).min(c), a.max(b).max(c));
                ((at(p)[k] - low) / (high - low) * f64::from(u16::MAX)) as u16
            };
            spread(cell(0)) << 1 | spread(cell(1))
        };
        points.sort_by_cached_key(|p| place(*p));
    }

    /// The points that are known to be on the edges and segments of a triangle.
    fn lines(&self, t: usize, edges: &Splits, splits: &Splits, points: usize, places: &[(u32, usize)]) -> Lines {
        let corners = self.corners[t];
        let edges = (0..3).map(|k| ([corners[k], corners[(k + 1) % 3]], edges));
        let all = edges.chain(self.segments[t].iter().map(|segment| (segment.ends, splits)));
        let place = |p: u32| places.binary_search_by_key(&p, |(p, _)| *p).ok().map(|i| places[i].1 as u32);
        let mut on = Vec::new();
        for (line, (ends, splits)) in (0..).zip(all) {
            on.extend(of_ends(splits, ends).chain(ends).filter_map(place).map(|p| (p, line)));
        }
        Lines::of(points, on)
    }

    /// Segments from point to point.
    fn constraints(
        &self,
        flat: &Flat<'_>,
        segments: &[Segment],
        found: &Found,
        splits: &Splits,
        points: &[u32],
        places: &[(u32, usize)],
    ) -> Vec<(usize, usize)> {
        let place = |p: u32| places.binary_search_by_key(&p, |(p, _)| *p).map_or(0, |i| places[i].1);
        // Points that other triangles found here were not looked at in this one.
        let strange: Vec<usize> = (0..points.len()).filter(|i| found.points.binary_search(&points[*i]).is_err()).collect();
        let mut out = Vec::new();
        for segment in segments {
            let ends = (place(segment.ends[0]), place(segment.ends[1]));
            let mut on: Vec<usize> = of_ends(splits, segment.ends).map(place).chain([ends.0, ends.1]).collect();
            let limits = box_of(flat, ends);
            on.extend(strange.iter().copied().filter(|i| is_within(&limits, flat.at(*i)) && is_between(flat, ends, *i)));
            on.sort_by(|a, b| flat.cmp(*a, *b));
            on.dedup();
            out.extend(on.windows(2).map(|pair| (pair[0].min(pair[1]), pair[0].max(pair[1]))));
        }
        out.sort_unstable();
        out.dedup();
        out
    }
}

/// The bits of a number, with one between each two of them.
fn spread(x: u16) -> u32 {
    let halves = [(8, 0x00ff_00ff), (4, 0x0f0f_0f0f), (2, 0x3333_3333), (1, 0x5555_5555)];
    halves.into_iter().fold(u32::from(x), |x, (by, mask)| (x | x << by) & mask)
}

fn box_of(flat: &Flat<'_>, (a, b): (usize, usize)) -> [[f64; 2]; 2] {
    let (a, b) = (flat.at(a), flat.at(b));
    [[a[0].min(b[0]), a[1].min(b[1])], [a[0].max(b[0]), a[1].max(b[1])]]
}

fn is_within([low, high]: &[[f64; 2]; 2], p: [f64; 2]) -> bool {
    (0..2).all(|k| low[k] <= p[k] && p[k] <= high[k])
}

fn in_order(flat: &Flat<'_>, [a, b]: [usize; 2]) -> [usize; 2] {
    if flat.cmp(a, b).is_lt() { [a, b] } else { [b, a] }
}

/// Is a point on the segment between two others?
fn is_between(flat: &Flat<'_>, (a, b): (usize, usize), p: usize) -> bool {
    let [low, high] = in_order(flat, [a, b]);
    flat.turn(a, b, p) == 0 && flat.cmp(low, p).is_lt() && flat.cmp(p, high).is_lt()
}

/// Points from left to right.
struct Search {
    order: Vec<usize>,
    at: Vec<[f64; 2]>,
}

impl Search {
    fn new(flat: &Flat<'_>, count: usize) -> Self {
        let mut order: Vec<usize> = (0..count).collect();
        order.sort_by(|a, b| flat.at(*a)[0].total_cmp(&flat.at(*b)[0]));
        let at = order.iter().map(|p| flat.at(*p)).collect();
        Self { order, at }
    }

    /// The points in the box of two others.
    fn within<'s>(&'s self, flat: &Flat<'_>, ends: (usize, usize)) -> impl Iterator<Item = usize> + 's {
        let limits = box_of(flat, ends);
        let first = self.at.partition_point(|p| p[0] < limits[0][0]);
        let count = self.at[first..].partition_point(|p| p[0] <= limits[1][0]);
        let near = self.at[first..first + count].iter().zip(&self.order[first..]);
        near.filter(move |(p, _)| limits[0][1] <= p[1] && p[1] <= limits[1][1]).map(|(_, p)| *p)
    }
}

/// Where a point is, rounded.
pub(crate) fn position(p: &Point, power: i32) -> [f64; 3] {
    p.high.map(|x| scaled(x, power))
}
