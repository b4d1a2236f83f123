//! Surfaces that are straight from an outline to a point within it.

use super::blend::{self, Curves};
use super::chart::Chart;
use super::fans;
use super::layout::Rim;
use super::patch::{CUTS, Meshed, Task};
use super::report::{Method, Report, Surface};
use super::star;
use super::strand::Strand;
use super::unrolled;
use crate::curves::Use;
use crate::curves::elementary::{Elementary, Told};
use crate::curves::vector::{Point, distance};

impl Task<'_> {
    /// A cone that the file says, whose apex is within its only ring: straight to that from the curves.
    pub(super) fn around_apex(&self, told: &Told, report: &mut Report) -> Option<(Surface, Meshed)> {
        let Elementary::Cone { frame, .. } = told.surface else { return None };
        let [ring] = self.rings else { return None };
        let Chart::Turned(cone) = Chart::of(&told.surface) else { return None };
        if !unrolled::is_around(&cone, ring, report.gap) {
            return None;
        }
        // Edges half as long as those of the ring are no farther from the cone where that is a quarter as wide.
        let next = ring.iter().cycle().skip(1);
        let longest = ring.iter().zip(next).map(|(a, b)| distance(a.point, b.point)).fold(0.0, f64::max);
        self.around_centre((frame.origin, 0.5 * longest), report)
    }

    /// A cone over all curves to their middle.
    pub(super) fn centre(&self, curves: &Curves, report: &mut Report) -> Option<(Surface, Meshed)> {
        let blend::Cone { layout, curve, ends, centre } = blend::centre(curves, self.rings.first()?).ok()?;
        if blend::is_folded(&curve, centre) || !self.is_star(centre) {
            return None;
        }
        let meshed = self.mesh(layout)?;
        report.method = Method::Centre;
        Some((Surface::Centre { curve: Box::new(curve), ends, centre }, meshed))
    }

    /// Whether no two edges of the outline cross as seen from a point.
    fn is_star(&self, centre: Point) -> bool {
        let ring: Vec<Point> = self.rings.iter().take(1).flatten().map(|rim| rim.point).collect();
        star::is_star(&ring, centre)
    }

    /// A surface for each curve to their middle.
    pub(super) fn fans(&self, report: &mut Report) -> Option<(Surface, Meshed)> {
        let centre = fans::centre(&self.uses().collect::<Vec<_>>());
        if self.options.fans { self.around_centre((centre, f64::INFINITY), report) } else { None }
    }

    /// A surface for each curve to a centre, with edges no longer than so; spokes between them are divided until triangles are even or for so many rounds.
    fn around_centre(&self, (centre, longest): (Point, f64), report: &mut Report) -> Option<(Surface, Meshed)> {
        let ring = self.rings.first()?;
        let parts: Vec<(&Strand<'_>, Use)> = self.uses().collect();
        if self.is_dry || !self.is_star(centre) {
            return None;
        }
        let curves = parts.iter().map(|(strand, one)| fans::curve(strand, one, self.options)).collect::<Option<_>>()?;
        let mut shares = fans::even(ring, centre, self.options.inner);
        let mut meshed = self.fans_of(ring, (centre, longest), &mut shares)?;
        for _ in 0..CUTS {
            if meshed.poor[1] == 0 || !meshed.is_cut {
                break;
            }
            meshed = self.fans_of(ring, (centre, longest), &mut shares)?;
        }
        report.method = Method::Fans;
        Some((Surface::Fans { curves, centre }, meshed))
    }

    /// Triangles of all parts around a centre. Spokes are divided by shares of them, and these as parts wish it for the next time.
    fn fans_of(&self, ring: &[Rim], (centre, longest): (Point, f64), shares: &mut [Vec<f64>]) -> Option<Meshed> {
        let mut meshed = Meshed { longest: f64::INFINITY, ..Meshed::default() };
        let own = shares.to_vec();
        let mut whole = fans::Spokes::new(ring, centre, &own);
        for part in fans::parts(ring, centre) {
            let (layout, rims) = whole.laid(&part);
            let alone = Task { rings: &[rims], ..*self };
            let made = alone.mesh_within(layout, longest, self.most())?;
            meshed.poor = [0, 1].map(|kind| meshed.poor[kind] + made.poor[kind]);
            meshed.is_cut |= whole.divide(&part, &made.wishes, shares);
            meshed.wishes.extend(made.wishes);
            whole.take(&part, (made.points, made.triangles));
        }
        (meshed.points, meshed.triangles) = (whole.points, whole.triangles);
        fans::merge(shares);
        Some(meshed)
    }
}
