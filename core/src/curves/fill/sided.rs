//! Coons surfaces of one outline: by each choice of corners, made once, meshed where they do not fold.

use super::blend::{self, Curves};
use super::coons::Coons;
use super::patch::{Meshed, Patch, Task};
use super::report::{Method, Report, Surface};
use super::tried::{Sided, Unfolded};

/// Parameters each way at which a surface is looked at again.
const FINER: u32 = 64;

impl Task<'_> {
    pub(super) fn coons(&self, curves: &Curves, choices: &[Vec<usize>], report: &mut Report) -> Option<(Surface, Meshed)> {
        let Unfolded { all, is_folded } = self.tried.coons.get_or_init(|| self.unfolded(curves, choices));
        report.is_folded = *is_folded;
        for Sided { coons, lengths, longest } in all {
            // A dry run needs neither the outline on the map nor the surface.
            if self.is_dry {
                return Some((Surface::Fallback(Vec::new()), Meshed::dry(self.longest.min(*longest))));
            }
            let layout = blend::laid(coons.clone(), lengths, self.rings.first()?);
            let Some(meshed) = self.mesh_within(layout, *longest, self.most()) else { continue };
            // Triangles that turn back are evidence enough for a closer look.
            if meshed.turns_back && coons.is_folded(FINER) {
                report.is_folded = true;
                continue;
            }
            report.method = match coons.sides {
                2 => Method::Ruled,
                3 => Method::Triangle,
                _ => Method::Coons,
            };
            return Some((Surface::Coons(Box::new(coons.clone())), meshed));
        }
        None
    }

    /// Coons surfaces that do not fold, by the choices of corners, of each the one upon a surface of revolution first.
    fn unfolded(&self, curves: &Curves, choices: &[Vec<usize>]) -> Unfolded {
        let mut all: Vec<(Coons, Vec<f64>)> = Vec::new();
        for (plain, lengths) in choices.iter().filter_map(|corners| blend::coons(curves, corners).ok()) {
            let based = if self.options.recognises { blend::based(&plain) } else { None };
            all.extend(based.into_iter().chain([plain]).map(|coons| (coons, lengths.clone())));
        }
        let count = all.len();
        let ring = self.rings.first().map_or(&[][..], Vec::as_slice);
        all.retain(|(coons, _)| !blend::is_coons_folded(coons, ring));
        let is_folded = all.len() < count;
        let sided = |(coons, lengths): (Coons, Vec<f64>)| {
            let longest = self.allowed(&blend::laid(coons.clone(), &lengths, ring));
            Sided { coons, lengths, longest }
        };
        Unfolded { all: all.into_iter().map(sided).collect(), is_folded }
    }

    /// The same outline on a Coons surface that has been bent; `None` if that cannot be laid flat.
    pub(super) fn bent(&self, coons: Coons, report: Report) -> Option<Patch> {
        let mut lengths = vec![0.0; coons.sides];
        for (one, (side, ..)) in self.outline.outer.iter().zip(&coons.spans) {
            let length = self.strands.get(one.curve).and_then(Option::as_ref).map_or(0.0, |strand| strand.length);
            lengths.iter_mut().skip(*side).take(1).for_each(|sum| *sum += length);
        }
        let meshed = self.mesh(blend::laid(coons.clone(), &lengths, self.rings.first()?))?;
        Some(self.patch(Surface::Coons(Box::new(coons)), report, meshed))
    }
}
