//! The surface and the mesh of one outline: methods tried in their order of trust.

use super::blend::{self, Curves};
use super::carrier;
use super::chords::{self, Chord};
use super::fit::FitError;
use super::improve::Improved;
use super::layout::{Corner, Layout, Rim, Wish};
use super::lifted::Lifted;
use super::options::{Options, Outline};
use super::poor::{self, Angles, Split};
use super::refine;
use super::report::{Method, Problem, Report, Surface};
use super::side;
use super::sides;
use super::space;
use super::strand::{Kind, Strand};
use super::triangles;
use super::tried::Tried;
use super::unrolled;
use crate::curves::Use;
use crate::curves::elementary::Elementary;
use crate::curves::vector::{Point, distance, dot, scale};
use crate::util::each::Each;

/// Gaps between curves count as inaccuracy of these up to this share of the size.
const GAP: f64 = 3e-5;
/// Products of points within and on outlines that heights may cost.
const COSTLIEST: f64 = 1e8;

/// Rounds in which cuts, or spokes to a centre, are divided, at most.
pub(super) const CUTS: u32 = 12;

/// An outline with all that it needs.
#[derive(Clone, Copy, Debug)]
pub(super) struct Task<'a> {
    pub(super) outline: &'a Outline,
    /// By the numbers of curves.
    pub(super) strands: &'a [Option<Strand<'a>>],
    pub(super) rings: &'a [Vec<Rim>],
    pub(super) options: &'a Options,
    pub(super) longest: f64,
    pub(super) chord: f64,
    /// Whether the length of edges that the surface wants is all that is asked for: nothing is meshed then, and no heights are made.
    pub(super) is_dry: bool,
    pub(super) tried: &'a Tried,
    /// Edges that other outlines have too.
    pub(super) chords: &'a [Chord],
}

/// The surface of an outline and its triangles.
#[derive(Clone, Debug)]
pub(super) struct Patch {
    pub(super) surface: Surface,
    pub(super) report: Report,
    pub(super) points: Vec<Point>,
    pub(super) triangles: Vec<[Corner; 3]>,
    /// Whether all edges to points within have a triangle on each side.
    pub(super) is_plain: bool,
    /// The longest edge that the surface allows.
    pub(super) longest: f64,
    /// Where its curves are to be divided so that its triangles become even.
    pub(super) splits: Vec<Split>,
}

impl Patch {
    /// Triangles that are to become better; no surface at all is worse than any number of them.
    pub(super) fn flaws(&self) -> usize {
        if self.is_filled() { self.report.poor } else { usize::MAX }
    }

    /// Whether it has a surface.
    pub(super) fn is_filled(&self) -> bool {
        !matches!(self.surface, Surface::Fallback(_))
    }
}

/// Points within, triangles, and the longest edge that the surface allows.
#[derive(Clone, Debug, Default)]
pub(super) struct Meshed {
    pub(super) points: Vec<Point>,
    pub(super) triangles: Vec<[Corner; 3]>,
    /// Whether all edges to points within are known to have a triangle on each side: there are no cuts.
    pub(super) is_plain: bool,
    pub(super) longest: f64,
    /// Triangles below 0.4: at corners of the outline below 15°, and elsewhere.
    pub(super) poor: [usize; 2],
    /// Where to divide edges of rings for the sake of those elsewhere.
    pub(super) wishes: Vec<Wish>,
    /// Whether there are wishes for spokes.
    pub(super) is_cut: bool,
    /// Whether triangles beside each other face away from each other.
    pub(super) turns_back: bool,
}

impl Meshed {
    /// Nothing but the longest edge.
    pub(super) fn dry(longest: f64) -> Self {
        Self { longest, ..Self::default() }
    }
}

impl<'a> Task<'a> {
    pub(super) fn uses(&self) -> impl Iterator<Item = (&'a Strand<'a>, Use)> {
        let strands = self.strands;
        let all = self.outline.rings().flatten();
        all.filter_map(move |one| strands.get(one.curve).and_then(Option::as_ref).map(|strand| (strand, *one)))
    }

    pub(super) fn patch(&self, surface: Surface, mut report: Report, meshed: Meshed) -> Patch {
        let Meshed { points, triangles, is_plain, longest, poor, wishes, .. } = meshed;
        [report.sharp, report.poor] = poor;
        let splits = if wishes.is_empty() { Vec::new() } else { poor::splits(self.outline, self.rings, &wishes) };
        Patch { surface, report, points, triangles, is_plain, longest, splits }
    }

    /// Fills it.
    pub(super) fn run(&self) -> Patch {
        let probes: Vec<Point> = self.uses().flat_map(|(strand, _)| strand.probes.iter().copied()).collect();
        let size = space::size(&probes);
        let cosines = self.cosines();
        let mut report = Report {
            method: Method::Fallback,
            sides: cosines.iter().filter(|cosine| **cosine <= self.options.smooth).count(),
            size,
            error: 0.0,
            chord: self.sag(),
            gap: self.gap(),
            tangent: 0,
            kink: 0.0,
            is_folded: false,
            is_told: false,
            is_left: None,
            is_ambiguous: self.is_ambiguous(),
            is_flipped: false,
            sharp: 0,
            poor: 0,
            problem: None,
        };
        if self.rings.first().is_none_or(|ring| ring.len() < 3) {
            report.problem = Some(Problem::Small);
            return self.fallback(report);
        }
        if self.is_open(size) {
            report.problem = Some(Problem::Open);
            return self.fallback(report);
        }
        let tolerance = self.options.carrier.unwrap_or(1e-5 * size).max(report.gap.min(GAP * size));
        let found = self.carrier(&probes, tolerance, &mut report);
        let found = found.or_else(|| self.blended(cosines, (&probes, tolerance), &mut report));
        match found {
            Some((surface, meshed)) => self.patch(surface, report, meshed),
            None => {
                if self.tried.plane.get().is_some_and(Option::is_some) {
                    report.problem = Some(Problem::Crosses);
                }
                self.fallback(report)
            }
        }
    }

    fn fallback(&self, report: Report) -> Patch {
        let rings = self.rings.iter().map(|ring| ring.iter().map(|rim| rim.vertex).collect()).collect();
        Patch {
            surface: Surface::Fallback(rings),
            report,
            points: Vec::new(),
            triangles: Vec::new(),
            is_plain: false,
            longest: f64::INFINITY,
            splits: Vec::new(),
        }
    }

    fn carrier(&self, probes: &[Point], tolerance: f64, report: &mut Report) -> Option<(Surface, Meshed)> {
        if let Some(found) = self.told(probes, tolerance, report) {
            return Some(found);
        }
        let plane = self.tried.plane.get_or_init(|| carrier::plane(probes, tolerance));
        if let Some(found) = plane.and_then(|plane| self.carried(plane, Method::Plane, (probes, tolerance), report)) {
            return Some(found);
        }
        if !self.options.recognises {
            return None;
        }
        let carriers = self.tried.carriers.get_or_init(|| {
            let kinds: Vec<Kind> = self.uses().map(|(strand, _)| strand.kind).collect();
            carrier::recognise(&kinds, probes, tolerance)
        });
        carriers.iter().find_map(|carrier| self.carried(*carrier, Method::Recognised, (probes, tolerance), report))
    }

    /// The surface that the file says, if the curves are near it.
    fn told(&self, probes: &[Point], tolerance: f64, report: &mut Report) -> Option<(Surface, Meshed)> {
        let told = self.tried.told?;
        let far = carrier::farthest(&told.surface, probes);
        if far > tolerance.max(carrier::NEAR * report.size) {
            return None;
        }
        let is_told = |report: &mut Report| (report.is_told, report.is_left) = (true, told.is_left);
        if let Some(found) = self.around_apex(&told, report) {
            is_told(report);
            return Some(found);
        }
        let surface = side::facing(told, self.rings)?;
        let layout = unrolled::on_carrier(&surface, (self.rings, told.is_left), tolerance.max(far))?;
        let meshed = self.mesh(layout)?;
        report.method = if matches!(surface, Elementary::Plane(_)) { Method::Plane } else { Method::Recognised };
        report.error = far;
        is_told(report);
        report.is_ambiguous = told.is_ambiguous();
        Some((Surface::Carrier(surface), meshed))
    }

    /// A surface that circles and straight lines fix, where the other curves are near it alone; none where it was said how near they
    /// have to be.
    fn implied(&self, probes: &[Point], tolerance: f64, report: &mut Report) -> Option<(Surface, Meshed)> {
        if !self.options.recognises || self.options.carrier.is_some() {
            return None;
        }
        let carriers = self.tried.implied.get_or_init(|| {
            let exact = || self.uses().filter(|(strand, _)| strand.kind != Kind::Other);
            let kinds: Vec<Kind> = exact().map(|(strand, _)| strand.kind).collect();
            let points: Vec<Point> = exact().flat_map(|(strand, _)| strand.probes.iter().copied()).collect();
            carrier::implied(&kinds, &points, probes, tolerance)
        });
        carriers.iter().find_map(|carrier| {
            let tolerance = tolerance.max(carrier::farthest(carrier, probes));
            self.carried(*carrier, Method::Recognised, (probes, tolerance), report)
        })
    }

    /// The outline on a carrier, if it can be laid flat there.
    fn carried(
        &self,
        carrier: Elementary,
        method: Method,
        (probes, tolerance): (&[Point], f64),
        report: &mut Report,
    ) -> Option<(Surface, Meshed)> {
        let layout = unrolled::on_carrier(&carrier, (self.rings, None), tolerance)?;
        let meshed = self.mesh(layout)?;
        report.method = method;
        report.error = carrier::farthest(&carrier, probes);
        Some((Surface::Carrier(carrier), meshed))
    }

    /// Coons surfaces, carriers that are near, heights, and a centre.
    fn blended(&self, cosines: Vec<f64>, (probes, tolerance): (&[Point], f64), report: &mut Report) -> Option<(Surface, Meshed)> {
        if self.rings.len() > 1 {
            let found = self.implied(probes, tolerance, report);
            let found = if self.is_dry { found } else { found.or_else(|| self.heights(report)) };
            report.problem = found.is_none().then_some(Problem::Holes);
            return found;
        }
        let choices = sides::choices(&cosines, self.options.smooth);
        let curves = match self.curves(cosines) {
            Ok((curves, error)) => {
                report.error = error;
                curves
            }
            Err(problem) => {
                let found = self.fans(report);
                report.problem = found.is_none().then_some(problem.into());
                return found;
            }
        };
        // Four sides meet all curves; with less of them, a surface is a guess.
        let four = choices.iter().any(|corners| corners.len() == 4);
        let coons = if four { self.coons(&curves, &choices, report) } else { None };
        let coons = coons.or_else(|| self.implied(probes, tolerance, report));
        let coons = coons.or_else(|| if four { None } else { self.coons(&curves, &choices, report) });
        if self.is_dry {
            return coons;
        }
        let found = coons.or_else(|| self.heights(report));
        let found = found.or_else(|| self.centre(&curves, report)).or_else(|| self.fans(report));
        report.problem = found.is_none().then_some(Problem::Folds);
        found
    }

    fn heights(&self, report: &mut Report) -> Option<(Surface, Meshed)> {
        let count = self.rings.iter().map(Vec::len).sum::<usize>() as f64;
        if count * count > COSTLIEST {
            return None;
        }
        let (layout, frame) = blend::heights(self.rings)?;
        let most = (COSTLIEST / count) as usize;
        let meshed = self.mesh_within(layout, f64::INFINITY, most.min(self.options.inner))?;
        report.method = Method::Heights;
        Some((Surface::Heights(frame), meshed))
    }

    pub(super) fn mesh(&self, layout: Layout) -> Option<Meshed> {
        let longest = self.allowed(&layout);
        self.mesh_within(layout, longest, self.most())
    }

    /// The longest edge that a surface allows.
    pub(super) fn allowed(&self, layout: &Layout) -> f64 {
        layout.longest(self.chord, self.options.angle)
    }

    /// Points within, at most: long outlines need them in proportion.
    pub(super) fn most(&self) -> usize {
        self.options.inner.max(4 * self.rings.iter().map(Vec::len).sum::<usize>())
    }

    /// Meshes a layout, whose cuts are divided until triangles are even or for so many rounds.
    pub(super) fn mesh_within(&self, mut layout: Layout, longest: f64, most: usize) -> Option<Meshed> {
        let longest = self.longest.min(longest);
        let mut meshed = self.mesh_of(&layout, longest, most)?;
        for _ in 0..CUTS {
            if meshed.poor[1] == 0 || !layout.divide(&meshed.wishes) {
                break;
            }
            meshed = self.mesh_of(&layout, longest, most)?;
        }
        Some(meshed)
    }

    /// Triangles of a layout.
    fn mesh_of(&self, layout: &Layout, longest: f64, most: usize) -> Option<Meshed> {
        let Layout { chart, rings, added, is_mirrored } = layout;
        let is_mirrored = *is_mirrored;
        let mirrored = |[x, y]: [f64; 2]| [if is_mirrored { -x } else { x }, y];
        let places: Vec<Vec<[f64; 2]>> =
            rings.iter().map(|ring| ring.iter().map(|(_, place)| mirrored(*place)).collect()).collect();
        if self.is_dry {
            return Some(Meshed { longest, ..Meshed::default() });
        }
        let flat = triangles::triangles(&places)?;
        let corners: Vec<Corner> = rings.iter().flatten().map(|(corner, _)| *corner).collect();
        let known = self.rings.iter().flatten().map(|rim| (rim.vertex, rim.point));
        let mut known: Vec<(u32, Point)> = known.collect();
        known.sort_by_key(|(vertex, _)| *vertex);
        let point = |corner: &Corner| match corner {
            Corner::Rim(vertex) => {
                let at = known.partition_point(|(number, _)| number < vertex);
                known.get(at).map_or([0.0; 3], |(_, point)| *point)
            }
            Corner::Inner(number) => added.get(*number as usize).copied().unwrap_or_default(),
        };
        let rim = corners.iter().map(point).collect();
        let mut lifted = Lifted::new(flat);
        refine::refine(&mut lifted, longest, corners.len() + most);
        lifted.raise(rim, chart, is_mirrored);
        let blocking = refine::refine(&mut lifted, longest, corners.len() + most);
        let turns_back = lifted.is_folded();
        let mut improved = Improved::new(lifted);
        improved.run(most);
        chords::divide(&mut improved.lifted, &corners, self.chords);
        let angles = Angles::new(rings, &improved.lifted);
        let poor = angles.count(&improved.lifted);
        let wishes = if poor[1] > 0 { angles.wishes(&blocking, &improved.lifted) } else { Vec::new() };
        let first = added.len() as u32;
        let corner = |number: u32| {
            let within = || Corner::Inner(first + number - corners.len() as u32);
            corners.get(number as usize).copied().unwrap_or_else(within)
        };
        let triangles = improved.lifted.flat.triangles.iter().map(|triangle| triangle.each(corner)).collect();
        let points = added.iter().chain(improved.lifted.points.get(corners.len()..).unwrap_or_default()).copied().collect();
        let is_plain = added.is_empty();
        Some(Meshed { points, triangles, is_plain, longest, poor, wishes, is_cut: false, turns_back })
    }

    /// Curves fitted, in the direction of the outer loop, and the largest error.
    pub(super) fn curves(&self, cosines: Vec<f64>) -> Result<(Curves, f64), FitError> {
        let mut parts = Vec::with_capacity(self.outline.outer.len());
        let mut largest = 0.0_f64;
        for one in &self.outline.outer {
            let Some(strand) = self.strands.get(one.curve).and_then(Option::as_ref) else { continue };
            let (spline, error) = strand.fitted(self.options.fit(strand.length)).as_ref().map_err(Clone::clone)?;
            largest = largest.max(*error);
            let spline = if one.is_reversed { spline.clone().reversed() } else { spline.clone() };
            parts.push((spline, strand.length));
        }
        Ok((Curves { parts, cosines }, largest))
    }

    /// Cosines between tangents where each curve of the outer loop begins.
    pub(super) fn cosines(&self) -> Vec<f64> {
        let turned = |one: &Use| {
            let strand = self.strands.get(one.curve).and_then(Option::as_ref)?;
            let [start, end] = strand.tangents();
            Some(if one.is_reversed { [scale(end, -1.0), scale(start, -1.0)] } else { [start, end] })
        };
        let tangents: Vec<[Point; 2]> = self.outline.outer.iter().filter_map(turned).collect();
        let before = tangents.iter().cycle().skip(tangents.len().saturating_sub(1));
        tangents.iter().zip(before).map(|(one, before)| dot(before[1], one[0])).collect()
    }

    /// The largest distance of curves from their edges, at the middles of these.
    fn sag(&self) -> f64 {
        let mut largest = 0.0_f64;
        for ring in self.rings {
            for (one, next) in ring.iter().zip(ring.iter().cycle().skip(1)) {
                if let Some(middle) = self.middle(one, next) {
                    let chord = scale(crate::curves::vector::add(one.point, next.point), 0.5);
                    largest = largest.max(distance(middle, chord));
                }
            }
        }
        largest
    }

    /// The point of a curve in the middle of an edge, of the outer loop alone; straight curves have none.
    fn middle(&self, one: &Rim, next: &Rim) -> Option<Point> {
        let used = self.outline.outer.get(one.part as usize)?;
        let strand = self.strands.get(used.curve).and_then(Option::as_ref)?;
        let to = if next.part == one.part && next.share > one.share { next.share } else { 1.0 };
        let middle = 0.5 * (one.share + to);
        (!matches!(strand.kind, Kind::Straight(_))).then(|| strand.point(if used.is_reversed { 1.0 - middle } else { middle }))
    }

    /// The largest distance of ends that follow each other.
    fn gap(&self) -> f64 {
        self.gaps().fold(0.0, |most, (gap, _)| most.max(gap))
    }

    /// Whether curves that follow each other do not meet: by more than inaccuracy, and than half of the shorter one's length.
    fn is_open(&self, size: f64) -> bool {
        self.gaps().any(|(gap, shorter)| gap > (0.5 * shorter).max(GAP * size))
    }

    /// Distances of ends that follow each other, each with the length of the shorter curve.
    fn gaps(&self) -> impl Iterator<Item = (f64, f64)> {
        let loops = self.outline.rings();
        loops.flat_map(|uses| {
            let ends = |one: &Use| {
                let strand = self.strands.get(one.curve).and_then(Option::as_ref)?;
                let [a, b] = strand.shape.ends();
                Some((if one.is_reversed { [b, a] } else { [a, b] }, strand.length))
            };
            let all: Vec<([Point; 2], f64)> = uses.iter().filter_map(ends).collect();
            let pair = |at: usize| {
                let ((one, length), (next, other)) = (all.get(at)?, all.get((at + 1) % all.len())?);
                Some((distance(one[1], next[0]), length.min(*other)))
            };
            (0..all.len()).filter_map(pair).collect::<Vec<_>>()
        })
    }

    /// Whether its curves are one circle, or circles around one axis alone.
    fn is_ambiguous(&self) -> bool {
        self.uses().all(|(strand, _)| matches!(strand.kind, Kind::Round { .. }))
            && self.rings.iter().zip(self.outline.rings()).all(|(_, uses)| uses.len() == 1)
    }
}
