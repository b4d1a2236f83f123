//! The global section: who wrote what, units, resolution.

use super::record::Record;
use crate::curves::export::error::ExportError;
use crate::curves::export::model::{Body, Header};
use crate::curves::export::number;

/// Units (IGES 5.3, table 2): millimetres, number, name.
const UNITS: [(f64, usize, &str); 10] = [
    (25.4, 1, "INCH"),
    (1.0, 2, "MM"),
    (304.8, 4, "FT"),
    (1_609_344.0, 5, "MI"),
    (1000.0, 6, "M"),
    (1e6, 7, "KM"),
    (0.0254, 8, "MIL"),
    (1e-3, 9, "UM"),
    (10.0, 10, "CM"),
    (2.54e-5, 11, "UIN"),
];
/// Columns of a line.
const WIDTH: usize = 72;

/// Lines of the section.
pub(super) fn section(body: &Body, header: &Header<'_>) -> Result<Vec<String>, ExportError> {
    let millimetres = body.unit.millimetres;
    let unit = UNITS.into_iter().find(|(size, ..)| (size / millimetres - 1.0).abs() <= 1e-12);
    let (_, flag, unit) = unit.ok_or(ExportError::Unit(millimetres))?;
    let mut lines = Vec::new();
    let mut record = Record::new(WIDTH, |line| {
        lines.push(line.to_owned());
        Ok(())
    });
    let real = |value: f64| {
        let mut text = String::new();
        number::real(&mut text, value, 'D');
        text
    };
    let (name, system, time) = (string(header.name), string(header.system), header.time.map(time).unwrap_or_default());
    let words = [
        // Delimiters; names of the part, its file, the program and its processor.
        [string(","), string(";"), name.clone(), name.clone(), system.clone(), system],
        // Bits of a whole number; powers of ten and digits of single and double precision; the part's name for who receives it.
        ["32".into(), "38".into(), "6".into(), "308".into(), "17".into(), name],
        // Scale; unit; weights of lines; time.
        [real(1.0), flag.to_string(), string(unit), "1".into(), real(1.0), time.clone()],
        // Resolution; largest coordinate; author and organisation; version 5.3; no standard of drafting.
        [real(body.tolerance), real(largest(body)), String::new(), String::new(), "11".into(), "0".into()],
    ];
    words.into_iter().flatten().chain([time, String::new()]).try_for_each(|word| record.word(word))?;
    record.finish()?;
    Ok(lines)
}

/// A string after Hollerith; nothing of one that is empty.
fn string(text: &str) -> String {
    let text = ascii(text);
    if text.is_empty() { text } else { format!("{}H{text}", text.len()) }
}

/// The format knows no other characters than these.
pub(super) fn ascii(text: &str) -> String {
    text.chars().map(|character| if matches!(character, ' '..='~') { character } else { '?' }).collect()
}

/// `YYYYMMDD.HHNNSS` of a time after ISO 8601; nothing of what is none.
fn time(time: &str) -> String {
    let digits: String = time.chars().filter(char::is_ascii_digit).take(14).collect();
    match digits.split_at_checked(8) {
        Some((day, time)) if time.len() == 6 => string(&format!("{day}.{time}")),
        _ => String::new(),
    }
}

/// The largest coordinate of any control point.
fn largest(body: &Body) -> f64 {
    let surfaces = body.faces.iter().flat_map(|face| face.surface.points.iter().flatten());
    let curves = body.edges.iter().flat_map(|edge| edge.curve.points());
    surfaces.chain(curves).chain(&body.vertices).flatten().fold(0.0, |largest, x| x.abs().max(largest))
}
