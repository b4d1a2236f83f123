//! Boundaries in the space of parameters alone: their curves in space, from the surface.

use super::build::{Builder, DEEPEST};
use super::directory::Entry;
use super::parameters::Parameters;
use super::places::Place;
use crate::curves::carrier::{Carrier, Tensor};
use crate::curves::curve::{Curve, Id, Role, Shape, Source};
use crate::curves::network::Use;
use crate::curves::vector::{Affine, Point, cross, sub, unit};

/// A surface, and the map from parameters as IGES counts them to those of the carrier.
pub(super) struct Carried {
    pub(super) carrier: Carrier,
    parameters: Affine,
    /// Where the surface's own matrix puts it.
    pub(super) map: Affine,
}

impl Carried {
    /// The map from parameters as the file counts them to those of the carrier.
    pub(super) fn parameters(&self) -> &Affine {
        &self.parameters
    }
}

/// Curves of a boundary; how far off they are and may be, if they are fitted.
type Composed = (Vec<Use>, Option<(f64, f64)>);

impl Builder<'_> {
    /// 142 without a curve in space: curves that are composed, or none, which is noted.
    pub(super) fn boundary_of_parameters(&mut self, entry: &Entry, parameters: &Parameters, place: Place) -> Vec<Use> {
        let kind = "a boundary is given in the space of parameters alone";
        match self.composed(entry, parameters, place) {
            Ok((uses, off)) => {
                let how = off.map_or("composed exactly".into(), |(off, wanted)| {
                    format!("fitted within {off:.1e}, {wanted:.1e} were wanted")
                });
                self.collector.findings.add(
                    entry.line,
                    kind,
                    format!("D{} of type {}; its curves are {how}", entry.number, entry.kind),
                );
                uses
            }
            Err(why) => {
                self.collector.findings.add(
                    entry.line,
                    kind,
                    format!("D{} of type {}; it has no curves: {why}", entry.number, entry.kind),
                );
                Vec::new()
            }
        }
    }

    fn composed(&mut self, entry: &Entry, parameters: &Parameters, place: Place) -> Result<Composed, String> {
        self.collector.may_fit()?;
        let carried = self.carried(parameters.pointer(2)?)?;
        let number = parameters.pointer(3)?;
        let flat = self.shape_of(number, 0)?.transformed(&carried.parameters);
        let tolerance = self.fitting(carried.carrier.size(&flat));
        let lifted = carried.carrier.lift(&flat, tolerance).map_err(|error| error.to_string())?;
        self.mark(number, 0);
        let map = self.places.map(place).after(&carried.map);
        let mut uses = Vec::with_capacity(lifted.shapes.len());
        for shape in lifted.shapes {
            if lifted.off.is_some() {
                self.collector.count_fit(&shape)?;
            }
            let source = Source { id: Id::Directory(entry.number.into()), line: entry.line };
            let (name, role, is_blanked) = (entry.name(), Role::Edge, entry.is_blanked);
            let shape = shape.transformed(&map);
            let curve = self.collector.push(Curve { shape, source, name, role, is_blanked, vertices: None });
            uses.extend(curve.map(|curve| Use { curve, is_reversed: false }));
        }
        Ok((uses, lifted.off.map(|off| (off, tolerance))))
    }

    /// Notes that a curve of parameters, and what it is made of, is read.
    fn mark(&mut self, number: u32, depth: usize) {
        self.done.insert(number);
        let Some(entry) = self.directory.get(number).copied().filter(|entry| entry.kind == 102 && depth < DEEPEST) else {
            return;
        };
        let Some(parameters) = self.parameters(&entry) else { return };
        let count = parameters.count(1, 2, 1).unwrap_or(0);
        (2..2 + count).filter_map(|at| parameters.pointer(at).ok()).for_each(|part| self.mark(part, depth + 1));
    }

    pub(super) fn carried(&mut self, number: u32) -> Result<Carried, String> {
        let entry = *self.directory.get(number).ok_or_else(|| format!("D{number} is not in the file"))?;
        let parameters = self.parameters(&entry).ok_or_else(|| format!("D{number} is damaged"))?;
        let map = if entry.matrix == 0 { Affine::IDENTITY } else { self.places.matrix(self.directory, entry.matrix)? };
        let (carrier, own) = match (entry.kind, entry.form) {
            (118, 1) => (self.ruled(&parameters)?, Affine::IDENTITY),
            (120, _) => self.turned(&parameters)?,
            (122, _) => self.drawn(&parameters)?,
            (128, _) => (tensor(&parameters)?, Affine::IDENTITY),
            (190..=198, _) => (self.equation(entry.kind, &parameters)?, Affine::IDENTITY),
            (kind, _) => return Err(format!("its surface is of type {kind}")),
        };
        Ok(Carried { carrier, parameters: own, map })
    }

    /// 118, form 1: two curves, and whether the second one is followed backwards.
    fn ruled(&mut self, parameters: &Parameters) -> Result<Carrier, String> {
        let [first, second] = [self.shape_of(parameters.pointer(1)?, 0)?, self.shape_of(parameters.pointer(2)?, 0)?];
        let second = if parameters.integer(3)? == 1 { second.reversed() } else { second };
        Ok(Carrier::Ruled([first, second]))
    }

    /// 120: axis, curve, and two angles. The first parameter is that of the curve.
    fn turned(&mut self, parameters: &Parameters) -> Result<(Carrier, Affine), String> {
        let Shape::Line([from, to]) = self.shape_of(parameters.pointer(1)?, 0)? else {
            return Err("an axis that is no line".into());
        };
        let axes = about(from, sub(to, from)).ok_or("an axis without a direction")?;
        let inverse = axes.inverse().ok_or("an axis without a direction")?;
        let profile = self.shape_of(parameters.pointer(2)?, 0)?.transformed(&inverse);
        let exchange = Affine { rows: [[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]], shift: [0.0; 3] };
        Ok((Carrier::Turned(axes, profile), exchange))
    }

    /// 122: a curve, and where its beginning is drawn to. Both parameters run from 0 to 1.
    fn drawn(&mut self, parameters: &Parameters) -> Result<(Carrier, Affine), String> {
        let curve = self.shape_of(parameters.pointer(1)?, 0)?;
        let vector = sub(parameters.point(2)?, curve.ends()[0]);
        let [low, high] = curve.domain();
        let stretch = Affine { rows: [[high - low, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], shift: [low, 0.0, 0.0] };
        Ok((Carrier::Drawn(curve, vector), stretch))
    }
}

/// 128: highest numbers of points, degrees, five properties, knots, weights, points; the first parameter runs fastest.
fn tensor(parameters: &Parameters) -> Result<Carrier, String> {
    let whole =
        |at: usize| parameters.integer(at).and_then(|n| usize::try_from(n).map_err(|_| format!("parameter {at} is no count")));
    let (counts, degrees) = ([whole(1)?, whole(2)?], [whole(3)?, whole(4)?]);
    let far = || "counts beyond all numbers".to_owned();
    let [rows, columns] = [counts[0].checked_add(1).ok_or_else(far)?, counts[1].checked_add(1).ok_or_else(far)?];
    let lengths = [rows.checked_add(degrees[0] + 1).ok_or_else(far)?, columns.checked_add(degrees[1] + 1).ok_or_else(far)?];
    let points = rows.checked_mul(columns).filter(|points| *points < parameters.len()).ok_or_else(far)?;
    let knots = [parameters.reals(10, lengths[0])?, parameters.reals(10 + lengths[0], lengths[1])?];
    let from = 10 + lengths[0] + lengths[1];
    let weights = parameters.reals(from, points)?;
    let coordinates = parameters.reals(from + points, 3 * points)?;
    let all: Vec<(Point, f64)> =
        coordinates.chunks_exact(3).zip(weights).filter_map(|(xyz, w)| Some((xyz.try_into().ok()?, w))).collect();
    let row = |number: usize| all.iter().skip(number).step_by(rows).copied().collect::<Vec<_>>();
    let tensor = Tensor::new(degrees, knots, (0..rows).map(row).collect()).map_err(|error| error.to_string())?;
    Ok(tensor.into())
}

/// Axes from a point, the third one along a vector.
pub(super) fn about(from: Point, along: Point) -> Option<Affine> {
    let z = unit(along)?;
    let least = |axis: &&Point| z.iter().zip(**axis).map(|(a, b)| (a * b).abs()).sum::<f64>();
    let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let away = axes.iter().min_by(|a, b| least(a).total_cmp(&least(b)))?;
    let x = unit(cross(*away, z))?;
    Some(Affine::from_axes([x, cross(z, x), z], from))
}
