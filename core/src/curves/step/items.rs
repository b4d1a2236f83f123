//! Items of representations: solids, shells, sets, and other representations that are mapped.

use super::builder::{Builder, DEEPEST, Place};
use super::curves::is_curve;
use super::faces::FACES;
use super::record::Record;

impl Builder<'_> {
    /// Reads an item and all that it is made of.
    pub(super) fn item(&mut self, id: u64, place: Place, depth: usize) {
        if depth > DEEPEST {
            return self.note(id, "items are more than 32 within each other, or one within itself", "");
        }
        let records = match self.records(id) {
            Ok(records) => records,
            Err(why) => return self.note(id, "damaged and not read", &why),
        };
        if is_curve(&records) {
            drop(self.uses(id, place, 0));
            return;
        }
        let Some(record) = records.first() else { return };
        let name = record.name.to_string();
        match name.as_str() {
            name if FACES.contains(&name) => self.face(id, place),
            "CURVE_BOUNDED_SURFACE" => self.bounded_surface(id, place),
            "EDGE_CURVE" | "ORIENTED_EDGE" => drop(self.edge(id, place)),
            "EDGE_LOOP" | "POLY_LOOP" => drop(self.ring(id, place)),
            "MAPPED_ITEM" => self.mapped(id, record, place, depth),
            "MANIFOLD_SOLID_BREP"
            | "FACETED_BREP"
            | "SHELL_BASED_SURFACE_MODEL"
            | "FACE_BASED_SURFACE_MODEL"
            | "CLOSED_SHELL"
            | "OPEN_SHELL"
            | "CONNECTED_FACE_SET"
            | "EDGE_BASED_WIREFRAME_MODEL"
            | "SHELL_BASED_WIREFRAME_MODEL"
            | "CONNECTED_EDGE_SET"
            | "WIRE_SHELL"
            | "GEOMETRIC_SET"
            | "GEOMETRIC_CURVE_SET" => self.parts(id, record, &[1], place, depth),
            "BREP_WITH_VOIDS" => self.parts(id, record, &[1, 2], place, depth),
            "ORIENTED_CLOSED_SHELL" | "ORIENTED_OPEN_SHELL" => self.parts(id, record, &[2], place, depth),
            "ORIENTED_FACE" => self.parts(id, record, &[3], place, depth),
            // Complex solids have their shell in the record of their kind.
            _ if records.len() > 1 => {
                let solid = records.iter().find(|record| record.name.is("MANIFOLD_SOLID_BREP"));
                match solid {
                    Some(solid) => self.parts(id, solid, &[0], place, depth),
                    None => self.note_unread(id, &name),
                }
            }
            name if name.starts_with("AXIS") => {}
            name => self.note_unread(id, name),
        }
    }

    /// Items that values of a record refer to.
    fn parts(&mut self, id: u64, record: &Record<'_>, places: &[usize], place: Place, depth: usize) {
        // What is within itself would be read over and over.
        if !self.visited.insert((id, place)) {
            return;
        }
        self.done.insert(id);
        let around = self.is_void;
        for at in places {
            self.is_void = around || (*at == 2 && record.name.is("BREP_WITH_VOIDS"));
            let found = record.references(*at).or_else(|_| record.reference(*at).map(|part| vec![part]));
            match found {
                Ok(found) => found.into_iter().for_each(|part| self.item(part, place, depth + 1)),
                Err(why) => self.note(id, "damaged and not read", &why),
            }
        }
        self.is_void = around;
    }

    /// MAPPED_ITEM: all of another representation, its origin put somewhere else.
    fn mapped(&mut self, id: u64, record: &Record<'_>, place: Place, depth: usize) {
        if !self.count_instance(id) {
            return;
        }
        let mut read = || -> Result<_, String> {
            let map = self.record(record.reference(1)?, &["REPRESENTATION_MAP"])?;
            let origin = self.map(map.reference(0)?)?.inverse().ok_or("an origin that is flat")?;
            Ok((map.reference(1)?, self.map(record.reference(2)?)?.after(&origin)))
        };
        match read() {
            Ok((representation, map)) => {
                let place = self.within(place, &map);
                self.representation_items(representation, place, depth + 1);
            }
            Err(why) => self.note(id, "damaged and not read", &why),
        }
    }
}
