//! Curves in JSON: `{"unit": "mm", "curves": [{"id": "a", "degree": 3, "knots": […], "points": [[x, y, z], …], "weights": […]}, {"line": [[…], […]]}]}`.
//!
//! Strict: whatever is not of this form is refused with its path, `curves[3].knots[0]`. Ends may have names in `"ends": ["p", "q"]`: the same name,
//! the same vertex.

use std::collections::HashMap;

use serde_json::{Map, Value};

use crate::curves::collect::significant;
use crate::curves::curve::{Curve, Id, Role, Shape, Source, Spline};
use crate::curves::network::{Network, ReadError, Unit};
use crate::curves::vector::Point;

/// Units and their millimetres.
const UNITS: [(&str, f64); 6] = [("mm", 1.0), ("cm", 10.0), ("m", 1000.0), ("inch", 25.4), ("foot", 304.8), ("µm", 1e-3)];

/// Reads a file. O(length); some 32 bytes of memory for each of its numbers at once.
///
/// # Errors
/// [`ReadError::Json`] of the first place that is wrong.
pub(crate) fn read(text: &[u8]) -> Result<Network, ReadError> {
    let value: Value = serde_json::from_slice(text).map_err(|error| refused("", error.to_string()))?;
    let top = Place { above: None, step: Step::Field(""), value: &value };
    let fields = top.object(&["unit", "curves"])?;
    let unit = match fields.get("unit") {
        Some(unit) => top.field("unit", unit).unit()?,
        None => return Err(top.refused("“unit” is missing")),
    };
    let curves = fields.get("curves").ok_or_else(|| top.refused("“curves” is missing"))?;
    let mut reader = Reader { vertices: HashMap::new(), digits: 0 };
    let mut list = Vec::new();
    for (number, curve) in top.field("curves", curves).items()?.enumerate() {
        list.push(reader.curve(number as u64, &curve)?);
    }
    Ok(Network { unit, resolution: None, digits: reader.digits, curves: list, faces: Vec::new(), findings: Vec::new() })
}

fn refused(path: &str, problem: impl Into<String>) -> ReadError {
    let path = if path.is_empty() { "the file".into() } else { path.into() };
    ReadError::Json { path, problem: problem.into() }
}

/// A value and where it stands. Its path is written when it is asked for: of what is right, nobody wants it.
#[derive(Clone, Copy)]
struct Place<'a> {
    above: Option<&'a Place<'a>>,
    step: Step<'a>,
    value: &'a Value,
}

/// The last step of a path.
#[derive(Clone, Copy)]
enum Step<'a> {
    Field(&'a str),
    Item(usize),
}

impl<'a> Place<'a> {
    fn path(&self) -> String {
        let above = self.above.map(Self::path).unwrap_or_default();
        match self.step {
            Step::Field(name) if above.is_empty() => name.to_owned(),
            Step::Field(name) => format!("{above}.{name}"),
            Step::Item(number) => format!("{above}[{number}]"),
        }
    }

    fn refused(&self, problem: impl Into<String>) -> ReadError {
        refused(&self.path(), problem)
    }

    fn field<'b>(&'b self, name: &'b str, value: &'b Value) -> Place<'b> {
        Place { above: Some(self), step: Step::Field(name), value }
    }

    fn object(&self, known: &[&str]) -> Result<&'a Map<String, Value>, ReadError> {
        let fields = self.value.as_object().ok_or_else(|| self.refused("an object is expected"))?;
        match fields.keys().find(|key| !known.contains(&key.as_str())) {
            Some(key) => Err(self.refused(format!("“{}” is unknown", crate::util::legible::legible(key)))),
            None => Ok(fields),
        }
    }

    fn items<'b>(&'b self) -> Result<impl ExactSizeIterator<Item = Place<'b>>, ReadError> {
        let list = self.value.as_array().ok_or_else(|| self.refused("a list is expected"))?;
        let item = |(number, value)| Place { above: Some(self), step: Step::Item(number), value };
        Ok(list.iter().enumerate().map(item))
    }

    fn text(&self) -> Result<&'a str, ReadError> {
        self.value.as_str().ok_or_else(|| self.refused("a string is expected"))
    }

    fn number(&self) -> Result<f64, ReadError> {
        self.value.as_f64().filter(|number| number.is_finite()).ok_or_else(|| self.refused("a number is expected"))
    }

    fn numbers(&self) -> Result<Vec<f64>, ReadError> {
        self.items()?.map(|item| item.number()).collect()
    }

    fn point(&self) -> Result<Point, ReadError> {
        let mut items = self.items()?;
        let count = items.len();
        let three = (items.next(), items.next(), items.next());
        let (Some(x), Some(y), Some(z), 3) = (three.0, three.1, three.2, count) else {
            return Err(self.refused(format!("three coordinates are expected, not {count}")));
        };
        Ok([x.number()?, y.number()?, z.number()?])
    }

    fn unit(&self) -> Result<Unit, ReadError> {
        let name = self.text()?;
        let known = UNITS.iter().find(|(known, _)| *known == name);
        let names: Vec<&str> = UNITS.iter().map(|(name, _)| *name).collect();
        let known = known.ok_or_else(|| self.refused(format!("one of {} is expected", names.join(", "))))?;
        Ok(Unit { name: name.into(), millimetres: known.1 })
    }
}

struct Reader {
    vertices: HashMap<String, u64>,
    digits: u32,
}

impl Reader {
    fn curve(&mut self, number: u64, place: &Place<'_>) -> Result<Curve, ReadError> {
        let fields = place.object(&["id", "ends", "line", "polyline", "degree", "knots", "points", "weights"])?;
        let field = |name: &'static str| fields.get(name).map(|value| place.field(name, value));
        let lack = |name: &str| place.refused(format!("“{name}” is missing"));
        let shape = match (field("line"), field("polyline"), field("degree")) {
            (Some(line), None, None) => match self.points(&line)?.as_slice() {
                &[start, end] => Shape::Line([start, end]),
                points => return Err(line.refused(format!("two points are expected, not {}", points.len()))),
            },
            (None, Some(line), None) => Shape::polyline(self.points(&line)?).map_err(|error| line.refused(error.to_string()))?,
            (None, None, Some(degree)) => {
                let knots = field("knots").ok_or_else(|| lack("knots"))?.numbers()?;
                let points = self.points(&field("points").ok_or_else(|| lack("points"))?)?;
                let weights = field("weights").map(|weights| weights.numbers()).transpose()?;
                let whole = degree.value.as_u64().and_then(|degree| usize::try_from(degree).ok());
                let whole = whole.ok_or_else(|| degree.refused("a whole number is expected"))?;
                let spline = Spline::new(whole, knots, points, weights, None);
                Shape::Spline(spline.map_err(|error| place.refused(error.to_string()))?)
            }
            _ => return Err(place.refused("one of “line”, “polyline” and “degree” is expected")),
        };
        let is_spline = matches!(shape, Shape::Spline(_));
        if let Some(name) = ["knots", "points", "weights"].into_iter().find(|name| !is_spline && fields.contains_key(*name)) {
            return Err(place.refused(format!("“{name}” without “degree”")));
        }
        let name = field("id").map(|id| id.text().map(str::to_owned)).transpose()?;
        let vertices = field("ends").map(|ends| self.ends(&ends)).transpose()?;
        let source = Source { id: Id::Place(number), line: 0 };
        Ok(Curve { shape, source, name, role: Role::Free, is_blanked: false, vertices })
    }

    fn points(&mut self, place: &Place<'_>) -> Result<Vec<Point>, ReadError> {
        let mut points = Vec::new();
        for item in place.items()? {
            let point = item.point()?;
            self.digits = point.iter().map(|x| significant(x.to_string().as_bytes())).fold(self.digits, u32::max);
            points.push(point);
        }
        Ok(points)
    }

    fn ends(&mut self, place: &Place<'_>) -> Result<[u64; 2], ReadError> {
        let items: Vec<Place<'_>> = place.items()?.collect();
        let [start, end] = items.as_slice() else { return Err(place.refused("two names are expected")) };
        let mut vertex = |name: &Place<'_>| -> Result<u64, ReadError> {
            let next = self.vertices.len() as u64;
            Ok(*self.vertices.entry(name.text()?.to_owned()).or_insert(next))
        };
        Ok([vertex(start)?, vertex(end)?])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn problem(text: &str) -> String {
        read(text.as_bytes()).unwrap_err().to_string()
    }

    #[test]
    fn curves_are_read() {
        let text = r#"{"unit": "inch", "curves": [
            {"id": "a", "degree": 1, "knots": [0, 0, 1, 1], "points": [[0, 0, 0], [1.25, 0, 0]], "weights": [1, 2], "ends": ["p", "q"]},
            {"line": [[1.25, 0, 0], [0, 0, 0]], "ends": ["q", "p"]},
            {"polyline": [[0, 0, 0], [1, 0, 0], [1, 1, 0]]}]}"#;
        let network = read(text.as_bytes()).unwrap();
        assert_eq!((network.unit.millimetres, network.digits), (25.4, 3));
        let [a, b, c] = &network.curves[..] else { panic!() };
        assert_eq!((a.name.as_deref(), a.vertices, b.vertices), (Some("a"), Some([0, 1]), Some([1, 0])));
        assert_eq!((a.shape.kind(), b.shape.kind(), c.shape.kind()), ("B-spline", "line", "polyline"));
    }

    #[test]
    fn what_is_wrong_is_told_with_its_path() {
        assert_eq!(problem(r#"{"curves": []}"#), "the file: “unit” is missing");
        assert_eq!(problem(r#"{"unit": "ell", "curves": []}"#), "unit: one of mm, cm, m, inch, foot, µm is expected");
        let of = |curve: &str| problem(&format!(r#"{{"unit": "mm", "curves": [{curve}]}}"#));
        assert_eq!(of(r#"{"line": [[0, 0, 0], [1, "x", 0]]}"#), "curves[0].line[1][1]: a number is expected");
        assert_eq!(of(r#"{"line": [[0, 0], [1, 0, 0]]}"#), "curves[0].line[0]: three coordinates are expected, not 2");
        assert_eq!(
            of(r#"{"degree": 1, "knots": [0, 1], "points": [[0, 0, 0], [1, 0, 0]]}"#),
            "curves[0]: 2 points of degree 1 do not go with 2 knots"
        );
        assert_eq!(of(r#"{"lines": []}"#), "curves[0]: “lines” is unknown");
        assert_eq!(of("{}"), "curves[0]: one of “line”, “polyline” and “degree” is expected");
        assert!(problem("{").starts_with("the file: EOF"));
    }
}
