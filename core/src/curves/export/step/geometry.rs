//! Points, curves and surfaces (ISO 10303-42, section 4).

use std::io::{self, Write};

use super::text::{Instances, Record};
use crate::curves::curve::Spline;
use crate::curves::export::canonical::canonical;
use crate::curves::export::model::Surface;
use crate::curves::export::number::multiplicities;

/// A point of two or three coordinates.
pub(super) fn point<W: Write>(coordinates: &[f64], instances: &mut Instances<'_, W>) -> io::Result<u64> {
    instances.put(|record| {
        record.say("CARTESIAN_POINT('',");
        record.list(coordinates, |record, x| record.real(*x));
        record.say(")");
    })
}

/// A B-spline curve in space, or of two dimensions in the space of parameters.
pub(super) fn curve<W: Write>(curve: &Spline, dimensions: usize, instances: &mut Instances<'_, W>) -> io::Result<u64> {
    let curve = canonical(curve);
    let mut ids = Vec::with_capacity(curve.points().len());
    for coordinates in curve.points() {
        ids.push(point(coordinates.get(..dimensions).unwrap_or(coordinates), instances)?);
    }
    let (counts, knots) = multiplicities(curve.knots());
    let is_closed = curve.points().first() == curve.points().last();
    let base = |record: &mut Record| {
        record.integer(curve.degree());
        record.say(",");
        record.references(&ids);
        record.say(",.UNSPECIFIED.,");
        record.truth(is_closed);
        record.say(",.F.");
    };
    let ends = |record: &mut Record| {
        record.list(&counts, |record, count| record.integer(*count));
        record.say(",");
        record.list(&knots, |record, knot| record.real(*knot));
        record.say(",.UNSPECIFIED.");
    };
    instances.put(|record| match curve.weights() {
        None => {
            record.say("B_SPLINE_CURVE_WITH_KNOTS('',");
            base(record);
            record.say(",");
            ends(record);
            record.say(")");
        }
        Some(weights) => {
            record.say("(BOUNDED_CURVE()B_SPLINE_CURVE(");
            base(record);
            record.say(")B_SPLINE_CURVE_WITH_KNOTS(");
            ends(record);
            record.say(")CURVE()GEOMETRIC_REPRESENTATION_ITEM()RATIONAL_B_SPLINE_CURVE(");
            record.list(weights, |record, weight| record.real(*weight));
            record.say(")REPRESENTATION_ITEM(''))");
        }
    })
}

/// A B-spline surface: rows of points along `v`, one behind the other along `u`.
pub(super) fn surface<W: Write>(surface: &Surface, tolerance: f64, instances: &mut Instances<'_, W>) -> io::Result<u64> {
    let mut rows = Vec::with_capacity(surface.points.len());
    for row in &surface.points {
        let ids = row.iter().map(|coordinates| point(coordinates, instances)).collect::<io::Result<Vec<u64>>>()?;
        rows.push(ids);
    }
    let [p, q] = surface.degrees;
    let [u, v] = [&surface.knots[0], &surface.knots[1]].map(|knots| multiplicities(knots));
    let is_closed = surface.is_closed(tolerance);
    let base = |record: &mut Record| {
        record.say(&format!("{p},{q},"));
        record.list(&rows, |record, row| record.references(row));
        record.say(",.UNSPECIFIED.,");
        is_closed.into_iter().for_each(|is_closed| {
            record.truth(is_closed);
            record.say(",");
        });
        record.say(".F.");
    };
    let ends = |record: &mut Record| {
        for counts in [&u.0, &v.0] {
            record.list(counts, |record, count| record.integer(*count));
            record.say(",");
        }
        for knots in [&u.1, &v.1] {
            record.list(knots, |record, knot| record.real(*knot));
            record.say(",");
        }
        record.say(".UNSPECIFIED.");
    };
    instances.put(|record| match surface.rational() {
        None => {
            record.say("B_SPLINE_SURFACE_WITH_KNOTS('',");
            base(record);
            record.say(",");
            ends(record);
            record.say(")");
        }
        Some(weights) => {
            record.say("(BOUNDED_SURFACE()B_SPLINE_SURFACE(");
            base(record);
            record.say(")B_SPLINE_SURFACE_WITH_KNOTS(");
            ends(record);
            record.say(")GEOMETRIC_REPRESENTATION_ITEM()RATIONAL_B_SPLINE_SURFACE(");
            record.list(weights, |record, row| record.list(row, |record, weight| record.real(*weight)));
            record.say(")REPRESENTATION_ITEM('')SURFACE())");
        }
    })
}
