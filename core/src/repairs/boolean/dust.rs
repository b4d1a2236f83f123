//! Dust: bodies, and voids, that cutting left and no printer can see.
//!
//! Where surfaces nearly lie on each other, cutting leaves crumbs of a few triangles between them, as thick as the gaps that it closed. Dust is what
//! encloses less than 2⁻⁴⁰ (about 10⁻¹²) of what all closed surface of the result encloses: a cube of that volume has less than a ten-thousandth of
//! the size of the model. Dust is as well what encloses less than 2⁻²⁰ of it, and is either nowhere larger than 2⁻¹¹ of the model's diagonal (a grain of a
//! twentieth of a millimetre, where that is a hundred), or no thicker on average than 2⁻¹³ of it (a flake, or a needle, of a hundredth). Volumes
//! and areas are sums of integers ([`crate::geometry::sums`]), so that nothing depends on their order or on where the model lies.
//!
//! Only crumbs go. A surface that cutting did not make stays, however small, and so does one with a triangle of a body that was as small
//! before it was cut: that is a body of the file.

use crate::contract::report::{Region, RegionMethod};
use crate::repairs::boolean::state::State;
use crate::repairs::shared::pieces;
use crate::repairs::shared::pieces::take_away;
use crate::submesh::Origin;
use crate::submesh::components::{Component, Components};
use crate::topology::survey::Survey;
use crate::util::ids::NONE;

/// Two to this power is how many times dust would have to be there to be all of the result.
const SHARE: u32 = 40;

/// And so many times what is small or thin besides.
const SMALL_SHARE: u32 = 20;
/// Of the diagonal: what is nowhere larger is small, and what is no thicker is thin.
const SMALL: f64 = 1.0 / 2048.0;
const THIN: f64 = 1.0 / 8192.0;

/// Does a surface enclose less than this of all that is enclosed? The rest of the division is cut off, so that of next to nothing at all,
/// nothing is dust.
fn is_below(volume: i128, all: i128, share: u32) -> bool {
    i128::try_from(volume.unsigned_abs()).is_ok_and(|volume| volume < all >> share)
}

/// Can no printer see a piece of a result that encloses so much?
fn is_dust(survey: &Survey<'_>, piece: &Component, all: i128) -> bool {
    let diagonal = survey.bounds.diagonal();
    let is_small = || piece.bounds.diagonal() <= SMALL * diagonal;
    let (volume, area) = (survey.measure.volume(piece.extent), survey.measure.area(piece.extent));
    let is_thin = || 2.0 * volume.abs() <= THIN * diagonal * area;
    let volume = piece.extent.volume;
    is_below(volume, all, SHARE) || is_below(volume, all, SMALL_SHARE) && (is_small() || is_thin())
}

impl State<'_, '_, '_> {
    /// Drops dust. `before`: the pieces of surface before they were cut; `pieces`: as they are. Returns where each crumb was, and the pieces that
    /// there are then.
    pub(crate) fn drop_dust(&mut self, before: &Components, pieces: Components) -> (Vec<Region>, Components) {
        let all = pieces.list.iter().filter(|piece| !piece.open).map(|piece| piece.extent.volume).sum();
        let mut goes: Vec<bool> = pieces.list.iter().map(|piece| !piece.open && is_dust(self.survey, piece, all)).collect();
        let mut is_cut = vec![false; pieces.list.len()];
        for t in self.work.living() {
            let piece = pieces.of_triangle[t as usize] as usize;
            is_cut[piece] |= t >= self.first_triangle && !matches!(self.work.triangles[t as usize].origin, Origin::Input(_));
            let whole = before.list.get(self.clusters.of_triangle[t as usize] as usize);
            goes[piece] &= whole.is_some_and(|whole| !is_dust(self.survey, whole, all));
        }
        // Regular surface that was not cut is the file's.
        for piece in pieces.of_region.iter().filter(|piece| **piece != NONE) {
            goes[*piece as usize] = false;
        }
        goes.iter_mut().zip(is_cut).for_each(|(goes, is_cut)| *goes &= is_cut);
        let dust = pieces.list.iter().zip(&goes).filter(|(_, goes)| **goes);
        let regions = dust.map(|(piece, _)| {
            let bounds = piece.bounds.normalised();
            let (method, bounds, count) = (RegionMethod::Dropped, [bounds.lo, bounds.hi], piece.triangles);
            Region { method, bounds, count, rounds: 0, moved: 0.0, reason: None }
        });
        let regions: Vec<Region> = regions.collect();
        if regions.is_empty() {
            return (regions, pieces);
        }
        take_away(self.work, self.reversed, &pieces, &goes);
        (regions, pieces::pieces(self.survey, self.work, self.reversed))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dust_is_what_is_below_its_share_by_one() {
        let all = 1 << 60;
        let is_dust = |volume: i128, all: i128| is_below(volume, all, SHARE);
        assert!(is_dust((1 << 20) - 1, all) && is_dust(1 - (1 << 20), all) && is_dust(0, all));
        assert!(!is_dust(1 << 20, all) && !is_dust(-(1 << 20), all));
        assert!(!is_dust(0, 0) && !is_dust(-5, -7) && !is_dust(i128::MIN, i128::MAX));
    }
}
