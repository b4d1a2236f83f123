//! No number in a report may be infinite or NaN: JSON has no such numbers, and would hold `null` where every reader expects a number.
//!
//! [`checked`] is the only way out of the engine. It goes over a report as any serialiser does, so that a new field cannot be forgotten.

use std::fmt::{self, Display};
use std::path::Path;

use serde::Serialize;
use serde::ser::{self, Serializer};

use crate::contract::error::{Error, Result};
use crate::contract::report::Report;

/// `report`, unless a number in it is not finite: coordinates at the ends of the range of f32 may lead to such numbers.
///
/// # Errors
/// [`Error::Refused`] names the first of them.
pub(crate) fn checked(input: &Path, report: Report) -> Result<Report> {
    match first_not_finite(&report) {
        None => Ok(report),
        Some(field) => Err(Error::Refused {
            path: input.into(),
            reason: format!(
                "`{field}` of its report has no finite value, for its coordinates are too large or too small to measure with"
            ),
            advice: "scale the model".into(),
        }),
    }
}

/// The first number that is not finite, by the names of the fields that lead to it.
fn first_not_finite(value: &impl Serialize) -> Option<String> {
    let mut walk = Walk { way: Vec::new() };
    value.serialize(&mut walk).err().map(|_| walk.way.join("."))
}

/// Goes over all numbers. After an error, `way` leads to the one that ended it.
struct Walk {
    way: Vec<&'static str>,
}

impl Walk {
    /// Below a field of this name.
    fn within(&mut self, name: &'static str, value: &(impl Serialize + ?Sized)) -> std::result::Result<(), NotFinite> {
        self.way.push(name);
        value.serialize(&mut *self)?;
        self.way.pop();
        Ok(())
    }
}

/// There is a number that is not finite.
#[derive(Debug)]
struct NotFinite;

impl Display for NotFinite {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a number is not finite")
    }
}

impl std::error::Error for NotFinite {}

impl ser::Error for NotFinite {
    /// What cannot be serialised for another reason is no less unfit for a report.
    fn custom<T: Display>(_: T) -> Self {
        Self
    }
}

/// Values that hold no number with a fraction.
macro_rules! pass {
    ($($name:ident($($kind:ty),*))*) => {
        $(fn $name(self, $(_: $kind),*) -> std::result::Result<(), NotFinite> {
            Ok(())
        })*
    };
}

impl Serializer for &mut Walk {
    type Ok = ();
    type Error = NotFinite;
    type SerializeSeq = Self;
    type SerializeTuple = Self;
    type SerializeTupleStruct = Self;
    type SerializeTupleVariant = Self;
    type SerializeMap = Self;
    type SerializeStruct = Self;
    type SerializeStructVariant = Self;

    pass! {
        serialize_bool(bool) serialize_char(char) serialize_str(&str) serialize_bytes(&[u8])
        serialize_i8(i8) serialize_i16(i16) serialize_i32(i32) serialize_i64(i64)
        serialize_u8(u8) serialize_u16(u16) serialize_u32(u32) serialize_u64(u64)
        serialize_none() serialize_unit() serialize_unit_struct(&'static str) serialize_unit_variant(&'static str, u32, &'static str)
    }

    fn serialize_f32(self, number: f32) -> std::result::Result<(), NotFinite> {
        if number.is_finite() { Ok(()) } else { Err(NotFinite) }
    }

    fn serialize_f64(self, number: f64) -> std::result::Result<(), NotFinite> {
        if number.is_finite() { Ok(()) } else { Err(NotFinite) }
    }

    fn serialize_some<T: Serialize + ?Sized>(self, value: &T) -> std::result::Result<(), NotFinite> {
        value.serialize(self)
    }

    fn serialize_newtype_struct<T: Serialize + ?Sized>(self, _: &'static str, value: &T) -> std::result::Result<(), NotFinite> {
        value.serialize(self)
    }

    fn serialize_newtype_variant<T: Serialize + ?Sized>(
        self,
        _: &'static str,
        _: u32,
        _: &'static str,
        value: &T,
    ) -> std::result::Result<(), NotFinite> {
        value.serialize(self)
    }

    fn serialize_seq(self, _: Option<usize>) -> std::result::Result<Self, NotFinite> {
        Ok(self)
    }

    fn serialize_tuple(self, _: usize) -> std::result::Result<Self, NotFinite> {
        Ok(self)
    }

    fn serialize_tuple_struct(self, _: &'static str, _: usize) -> std::result::Result<Self, NotFinite> {
        Ok(self)
    }

    fn serialize_tuple_variant(self, _: &'static str, _: u32, _: &'static str, _: usize) -> std::result::Result<Self, NotFinite> {
        Ok(self)
    }

    fn serialize_map(self, _: Option<usize>) -> std::result::Result<Self, NotFinite> {
        Ok(self)
    }

    fn serialize_struct(self, _: &'static str, _: usize) -> std::result::Result<Self, NotFinite> {
        Ok(self)
    }

    fn serialize_struct_variant(
        self,
        _: &'static str,
        _: u32,
        _: &'static str,
        _: usize,
    ) -> std::result::Result<Self, NotFinite> {
        Ok(self)
    }
}

/// Sequences of all kinds, element by element.
macro_rules! elements {
    ($($kind:ident::$one:ident)*) => {
        $(impl ser::$kind for &mut Walk {
            type Ok = ();
            type Error = NotFinite;

            fn $one<T: Serialize + ?Sized>(&mut self, value: &T) -> std::result::Result<(), NotFinite> {
                value.serialize(&mut **self)
            }

            fn end(self) -> std::result::Result<(), NotFinite> {
                Ok(())
            }
        })*
    };
}

elements! {
    SerializeSeq::serialize_element SerializeTuple::serialize_element
    SerializeTupleStruct::serialize_field SerializeTupleVariant::serialize_field
}

/// Structures of all kinds, field by field.
macro_rules! fields {
    ($($kind:ident)*) => {
        $(impl ser::$kind for &mut Walk {
            type Ok = ();
            type Error = NotFinite;

            fn serialize_field<T: Serialize + ?Sized>(&mut self, name: &'static str, value: &T) -> std::result::Result<(), NotFinite> {
                self.within(name, value)
            }

            fn end(self) -> std::result::Result<(), NotFinite> {
                Ok(())
            }
        })*
    };
}

fields! { SerializeStruct SerializeStructVariant }

impl ser::SerializeMap for &mut Walk {
    type Ok = ();
    type Error = NotFinite;

    fn serialize_key<T: Serialize + ?Sized>(&mut self, key: &T) -> std::result::Result<(), NotFinite> {
        key.serialize(&mut **self)
    }

    fn serialize_value<T: Serialize + ?Sized>(&mut self, value: &T) -> std::result::Result<(), NotFinite> {
        value.serialize(&mut **self)
    }

    fn end(self) -> std::result::Result<(), NotFinite> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contract::report::{BoundaryLoop, BoundaryLoops, Defects, EditRecords, LoopClass};

    #[test]
    fn a_number_that_is_not_finite_is_found_wherever_it_stands() {
        assert_eq!(first_not_finite(&Defects::default()), None);
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert_eq!(first_not_finite(&Defects { volume: bad, ..Defects::default() }).as_deref(), Some("volume"));
            let bounds = Some([[0.0; 3], [0.0, bad as f32, 0.0]]);
            assert_eq!(
                first_not_finite(&Defects { bounds, ..Defects::default() }).as_deref(),
                Some("bounds"),
                "in lists in an option"
            );
            let open = BoundaryLoop {
                class: LoopClass::Gap,
                rule: "a rule".into(),
                at: [0.0; 3],
                vertices: 3,
                perimeter: 1.0,
                area: 1.0,
                off_plane: 0.0,
                width: Some(bad),
                characteristic_distance: None,
                partner: None,
            };
            let loops = BoundaryLoops { classes: [(LoopClass::Gap, 1)].into(), listed: vec![open] };
            assert_eq!(first_not_finite(&loops).as_deref(), Some("listed.width"));
        }
        let moved = EditRecords { moved: vec![(1, [[0.0; 3], [0.0; 3], [f32::NAN; 3]])], ..EditRecords::default() };
        assert_eq!(first_not_finite(&moved).as_deref(), Some("moved"));
    }
}
