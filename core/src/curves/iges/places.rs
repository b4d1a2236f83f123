//! Where entities are placed: by matrices (124), which may be placed themselves, and by instances of subfigures.

use std::collections::HashMap;

use super::directory::Directory;
use crate::curves::vector::Affine;

/// The number of a placement.
pub(super) type Place = usize;

/// Where nothing moves anything.
pub(super) const HERE: Place = 0;
/// Matrices within each other, at most.
const DEEPEST: usize = 32;

/// Placements by their numbers; the same chain of matrices has the same number.
#[derive(Debug)]
pub(super) struct Places {
    maps: Vec<Affine>,
    known: HashMap<(Place, (u32, u32)), Place>,
    matrices: HashMap<u32, Affine>,
}

impl Places {
    pub(super) fn new() -> Self {
        Self { maps: vec![Affine::IDENTITY], known: HashMap::new(), matrices: HashMap::new() }
    }

    /// The map of a placement.
    pub(super) fn map(&self, place: Place) -> Affine {
        self.maps.get(place).copied().unwrap_or(Affine::IDENTITY)
    }

    /// The placement of what an entry places by its map, within another placement. Of an entry that places the same several
    /// times, the second number is that of the place.
    pub(super) fn within(&mut self, around: Place, entry: (u32, u32), map: impl FnOnce() -> Affine) -> Place {
        if let Some(place) = self.known.get(&(around, entry)) {
            return *place;
        }
        self.maps.push(self.map(around).after(&map()));
        let place = self.maps.len() - 1;
        self.known.insert((around, entry), place);
        place
    }

    /// The map of the matrix of an entry, by what its own matrix does behind it.
    ///
    /// # Errors
    /// Why there is none: no matrix, damaged, or matrices that go round in a circle.
    pub(super) fn matrix(&mut self, directory: &Directory<'_>, number: u32) -> Result<Affine, String> {
        if let Some(map) = self.matrices.get(&number) {
            return Ok(*map);
        }
        let mut map = Affine::IDENTITY;
        let mut next = number;
        for _ in 0..DEEPEST {
            let entry = directory.get(next).filter(|entry| entry.kind == 124);
            let entry = entry.ok_or_else(|| format!("its matrix D{next} is no matrix"))?;
            let parameters = directory.parameters(entry).map_err(|why| format!("its matrix D{next}: {why}"))?;
            let values = parameters.reals(1, 12).map_err(|why| format!("its matrix D{next}: {why}"))?;
            let values: [f64; 12] = values.try_into().map_err(|_| "its matrix is damaged")?;
            let [a, b, c, x, d, e, f, y, g, h, i, z] = values;
            map = Affine { rows: [[a, b, c], [d, e, f], [g, h, i]], shift: [x, y, z] }.after(&map);
            next = entry.matrix;
            if next == 0 {
                self.matrices.insert(number, map);
                return Ok(map);
            }
        }
        Err(format!("its matrix D{number} is placed by more than {DEEPEST} others, or by itself"))
    }
}
