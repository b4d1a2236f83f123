//! Faces, and the loops that bound them.

use super::builder::{Builder, Place};
use super::curves::directed;
use crate::curves::curve::{Id, Shape, Source};
use crate::curves::elementary::Told;
use crate::curves::network::{Face, Use};

/// Entities that are faces with bounds.
pub(super) const FACES: [&str; 3] = ["ADVANCED_FACE", "FACE_SURFACE", "FACE"];

/// Surfaces that have an equation, or may have one.
const EQUATIONS: [&str; 6] =
    ["PLANE", "CYLINDRICAL_SURFACE", "CONICAL_SURFACE", "SPHERICAL_SURFACE", "TOROIDAL_SURFACE", "SURFACE_OF_REVOLUTION"];

impl Builder<'_> {
    /// A face with its bounds and its surface.
    pub(super) fn face(&mut self, id: u64, place: Place) {
        if !self.visited.insert((id, place)) {
            return;
        }
        let record = match self.record(id, &FACES) {
            Ok(record) => record,
            Err(why) => return self.note(id, "damaged and not read", &why),
        };
        let bounds = match record.references(1) {
            Ok(bounds) => bounds,
            Err(why) => return self.note(id, "damaged and not read", &why),
        };
        self.done.insert(id);
        let mut loops: Vec<(bool, Vec<Use>)> = Vec::new();
        for bound in bounds {
            let read = self.record(bound, &["FACE_BOUND", "FACE_OUTER_BOUND"]);
            match read.and_then(|record| Ok((record.name.is("FACE_OUTER_BOUND"), record.reference(1)?, record.truth(2)?))) {
                Ok((is_outer, ring, is_same)) => {
                    let mut uses = Vec::new();
                    let found = self.ring(ring, place);
                    directed(&mut uses, &found, !is_same);
                    self.collector.bound(&uses);
                    loops.push((is_outer, uses));
                }
                Err(why) => self.note(bound, "damaged and not read", &why),
            }
        }
        if loops.iter().filter(|(is_outer, _)| *is_outer).count() > 1 {
            self.note(id, "a face has several outer bounds; the first counts", "");
        }
        // Without one that is told to be it, the first is the outer one.
        let outer = loops.iter().position(|(is_outer, _)| *is_outer).unwrap_or(0);
        let outer = if loops.is_empty() { Vec::new() } else { loops.remove(outer).1 };
        let surface = record.reference(2).ok().map(|surface| self.surface(surface)).unwrap_or_default();
        let is_same = record.truth(3).unwrap_or(true);
        let told = record.reference(2).ok().and_then(|id| self.told(id, &surface, is_same, place));
        let is_untrimmed = outer.is_empty() && loops.is_empty();
        let inner = loops.into_iter().map(|(_, uses)| uses).collect();
        let source = Source { id: Id::Instance(id), line: self.line(id) };
        self.faces.push(Face {
            source,
            entity: record.name.to_string(),
            surface,
            told,
            outer,
            inner,
            is_untrimmed,
            is_void: self.is_void,
        });
    }

    /// EDGE_LOOP: edges in their order. POLY_LOOP: straight ones from point to point. VERTEX_LOOP: none.
    pub(super) fn ring(&mut self, id: u64, place: Place) -> Vec<Use> {
        let record = match self.record(id, &["EDGE_LOOP", "POLY_LOOP", "VERTEX_LOOP", "PATH", "OPEN_PATH"]) {
            Ok(record) => record,
            Err(why) => {
                self.note(id, "damaged and not read", &why);
                return Vec::new();
            }
        };
        if record.name.is("VERTEX_LOOP") {
            return Vec::new();
        }
        let parts = match record.references(1) {
            Ok(parts) => parts,
            Err(why) => {
                self.note(id, "damaged and not read", &why);
                return Vec::new();
            }
        };
        if record.name.is("POLY_LOOP") {
            return self.polygon(id, &parts, place);
        }
        parts.into_iter().filter_map(|part| self.edge(part, place)).collect()
    }

    fn polygon(&mut self, id: u64, points: &[u64], place: Place) -> Vec<Use> {
        let mut uses = Vec::new();
        for (from, to) in points.iter().zip(points.iter().cycle().skip(1)) {
            let ends = self.point(*from).and_then(|start| Ok([start, self.point(*to)?]));
            match ends {
                Ok([start, end]) if start != end => {
                    let curve = self.push(id, Shape::Line([start, end]), place, None);
                    uses.extend(curve.map(|curve| Use { curve, is_reversed: false }));
                }
                Ok(_) => {}
                Err(why) => self.note(id, "damaged and not read", &why),
            }
        }
        uses
    }

    /// CURVE_BOUNDED_SURFACE: a surface with boundaries that are composites.
    pub(super) fn bounded_surface(&mut self, id: u64, place: Place) {
        if !self.visited.insert((id, place)) {
            return;
        }
        let read = self.record(id, &["CURVE_BOUNDED_SURFACE"]).and_then(|record| {
            let is_implicit = record.truth(3).unwrap_or(false);
            Ok((record.reference(1)?, record.references(2)?, is_implicit))
        });
        let (surface, boundaries, is_implicit) = match read {
            Ok(read) => read,
            Err(why) => return self.note(id, "damaged and not read", &why),
        };
        self.done.insert(id);
        let (mut outer, mut loops) = (None, Vec::new());
        for boundary in boundaries {
            let is_outer = self.record(boundary, &["OUTER_BOUNDARY_CURVE"]).is_ok();
            let uses = self.uses(boundary, place, 0).map(|uses| uses.to_vec()).unwrap_or_default();
            self.collector.bound(&uses);
            if is_outer && outer.is_none() {
                outer = Some(uses);
            } else {
                loops.push(uses);
            }
        }
        if outer.is_none() && !is_implicit && !loops.is_empty() {
            outer = Some(loops.remove(0));
        }
        let is_untrimmed = outer.is_none();
        let id_of_surface = surface;
        let surface = self.surface(id_of_surface);
        // Programs do not keep to the direction of these boundaries.
        let told = self.told(id_of_surface, &surface, true, place).map(|told| Told { is_left: None, ..told });
        let source = Source { id: Id::Instance(id), line: self.line(id) };
        let (entity, outer) = ("CURVE_BOUNDED_SURFACE".to_owned(), outer.unwrap_or_default());
        self.faces.push(Face { source, entity, surface, told, outer, inner: loops, is_untrimmed, is_void: self.is_void });
    }

    /// The surface of a face where that is placed, if it has an equation.
    fn told(&mut self, id: u64, name: &str, is_same: bool, place: Place) -> Option<Told> {
        // B-spline surfaces are long, and never are one of these.
        if !EQUATIONS.contains(&name) {
            return None;
        }
        match self.carried(id, 0) {
            Ok(carried) => carried.carrier.told(is_same)?.transformed(&self.map_of(place)),
            Err(why) => {
                self.note(id, "a surface that is damaged and not used", &why);
                None
            }
        }
    }

    /// What a surface is called.
    fn surface(&mut self, id: u64) -> String {
        let records = self.records(id).unwrap_or_default();
        let named = records.iter().map(|record| record.name.to_string()).find(|name| name.contains("SURFACE") || name == "PLANE");
        named.unwrap_or_default()
    }
}
