//! Surfaces of faces that have an equation, and on which side of their boundary the faces are.

use super::build::Builder;
use super::directory::Entry;
use super::parameters::Parameters;
use super::places::Place;
use super::surfaces::{Carried, about};
use crate::curves::carrier::Carrier;
use crate::curves::elementary::Told;
use crate::curves::vector::{Affine, Point, cross, sub};

/// Places of a boundary in the space of parameters, whose area tells its direction.
const SAMPLES: u32 = 512;

impl Builder<'_> {
    /// The surface of a face that is placed, if it has an equation: 120, and 190 to 198. Where faces of solids (510) are, follows from the direction of
    /// their loops; where trimmed ones are (144), from the area of the outer boundary in the space of parameters; bounded ones (143) may be on either side.
    pub(super) fn told(&mut self, surface: u32, (face, bound): (&Entry, Option<u32>), place: Place) -> Option<Told> {
        if !matches!(self.directory.get(surface)?.kind, 120 | 190 | 192 | 194 | 196 | 198) {
            return None;
        }
        let carried = self.carried(surface).ok()?;
        let is_left = match face.kind {
            // Parameters in the other order turn the natural normal over.
            510 => Some(self.directory.get(surface)?.kind != 120),
            144 => self.runs_anticlockwise(bound?, &carried),
            _ => None,
        };
        let told = carried.carrier.told(is_left.unwrap_or(true))?;
        let told = told.transformed(&self.places.map(place).after(&carried.map))?;
        Some(Told { is_left: told.is_left.filter(|_| is_left.is_some()), ..told })
    }

    /// Whether a boundary (142) runs anticlockwise in the space of the carrier's parameters; `None` of one without a curve there, or without an area.
    fn runs_anticlockwise(&mut self, bound: u32, carried: &Carried) -> Option<bool> {
        let entry = *self.directory.get(bound).filter(|entry| entry.kind == 142)?;
        let parameters = self.parameters(&entry)?;
        let shape = self.shape_of(parameters.pointer(3).ok()?, 0).ok()?.transformed(carried.parameters());
        let [low, high] = shape.domain();
        let places: Vec<Point> =
            (0..SAMPLES).map(|at| shape.point(low + (high - low) * f64::from(at) / f64::from(SAMPLES))).collect();
        let first = places.first().copied()?;
        let area: f64 = places.windows(2).map(|pair| cross(sub(pair[0], first), sub(pair[1], first))[2]).sum();
        (area.is_finite() && area != 0.0).then_some(area > 0.0)
    }

    /// 190 plane, 192 cylinder, 194 cone, 196 sphere, 198 torus: a point, an axis, and radii; the reference direction is of forms that nothing here asks for.
    pub(super) fn equation(&mut self, kind: u32, parameters: &Parameters) -> Result<Carrier, String> {
        let origin = self.own_point(parameters.pointer(1)?, 116)?;
        if kind == 196 {
            return Ok(Carrier::Sphere(Affine { shift: origin, ..Affine::IDENTITY }, parameters.real(2)?));
        }
        let along = self.own_point(parameters.pointer(2)?, 123)?;
        let axes = about(origin, along).ok_or("an axis without a direction")?;
        Ok(match kind {
            190 => Carrier::Plane(axes),
            192 => Carrier::Cylinder(axes, parameters.real(3)?),
            194 => Carrier::Cone(axes, [parameters.real(3)?, parameters.real(4)?.to_radians().tan()]),
            198 => Carrier::Torus(axes, [parameters.real(3)?, parameters.real(4)?]),
            _ => return Err(format!("its surface is of type {kind}")),
        })
    }

    /// The coordinates of a point (116) or a direction (123).
    fn own_point(&mut self, number: u32, kind: u32) -> Result<Point, String> {
        let entry =
            *self.directory.get(number).filter(|entry| entry.kind == kind).ok_or_else(|| format!("D{number} is no {kind}"))?;
        let parameters = self.parameters(&entry).ok_or_else(|| format!("D{number} is damaged"))?;
        parameters.point(1)
    }
}
