//! The global section: delimiters, units, scale and resolution.

use super::cards::{Card, WIDTH};
use super::parameters::{Delimiters, Parameters};
use crate::curves::finding::Findings;
use crate::curves::network::Unit;
use crate::util::legible::legible;

/// What the global section says.
#[derive(Clone, Debug)]
pub(super) struct Global {
    pub(super) delimiters: Delimiters,
    pub(super) unit: Unit,
    pub(super) resolution: Option<f64>,
}

/// Cards that are looked at, at most; the section has 26 parameters.
const LONGEST: usize = 4096;

/// Units by their flag (IGES 5.3, table 2): number, name, millimetres.
const UNITS: [(u32, &str, f64); 10] = [
    (1, "inch", 25.4),
    (2, "mm", 1.0),
    (4, "foot", 304.8),
    (5, "mile", 1_609_344.0),
    (6, "m", 1000.0),
    (7, "km", 1e6),
    (8, "mil", 0.0254),
    (9, "µm", 1e-3),
    (10, "cm", 10.0),
    (11, "microinch", 2.54e-5),
];
/// Other names for the same, as flag 3 leaves the choice to a name.
const NAMES: [(&str, u32); 19] = [
    ("IN", 1),
    ("INCH", 1),
    ("INCHES", 1),
    ("MM", 2),
    ("MILLIMETER", 2),
    ("MILLIMETERS", 2),
    ("MILLIMETRE", 2),
    ("FT", 4),
    ("FEET", 4),
    ("FOOT", 4),
    ("MI", 5),
    ("M", 6),
    ("METER", 6),
    ("METRE", 6),
    ("KM", 7),
    ("MIL", 8),
    ("UM", 9),
    ("CM", 10),
    ("UIN", 11),
];

impl Global {
    /// Reads the section.
    pub(super) fn of(cards: &[Card<'_>], findings: &mut Findings) -> Self {
        let mut text = Vec::new();
        for card in cards.iter().take(LONGEST) {
            text.extend_from_slice(card.data);
            // Blanks that were cut off count within strings.
            text.resize(text.len() + WIDTH.saturating_sub(card.data.len()), b' ');
        }
        let line = cards.first().map_or(0, |card| card.line);
        let (delimiters, rest) = Delimiters::of(&text);
        let values = Parameters::of(rest, delimiters);
        if cards.is_empty() {
            findings.add(0, "no global section; units are taken for inches", "");
        }
        // Numbers as the standard counts them: both delimiters are 1 and 2.
        let number = |at: usize| values.real(at - 3).ok().filter(|number| *number != 0.0);
        let flag = number(14).map(|flag| flag as u32);
        let name = values.text(15 - 3).map(|name| name.trim().to_ascii_uppercase());
        let unit = unit(flag, name.as_deref(), line, findings);
        let scale = number(13).filter(|scale| *scale > 0.0).unwrap_or(1.0);
        if scale != 1.0 {
            findings.add(line, "the model has a scale, which counts in its unit", scale.to_string());
        }
        let resolution = number(19).filter(|resolution| *resolution > 0.0);
        Self { delimiters, unit: Unit { millimetres: unit.millimetres / scale, ..unit }, resolution }
    }
}

/// The unit of a flag; of a name if the flag says so, or is not there.
fn unit(flag: Option<u32>, name: Option<&str>, line: u64, findings: &mut Findings) -> Unit {
    let known = |flag: u32| {
        let unit = UNITS.iter().find(|(number, ..)| *number == flag)?;
        Some(Unit { name: unit.1.into(), millimetres: unit.2 })
    };
    let named = name.and_then(|name| NAMES.iter().find(|(known, _)| *known == name)).map(|(_, flag)| *flag);
    match (flag, named) {
        (Some(flag), Some(other)) if flag != other && flag != 3 && known(flag).is_some() => {
            let text = format!("flag {flag}, name {}; the flag counts", legible(name.unwrap_or_default()));
            findings.add(line, "unit and its name differ", text);
            known(flag)
        }
        (Some(3) | None, Some(flag)) => known(flag),
        (Some(flag), _) => known(flag),
        (None, None) => None,
    }
    .unwrap_or_else(|| {
        let text =
            format!("flag {}, name “{}”; inches are the standard's default", flag.unwrap_or(0), legible(name.unwrap_or("")));
        findings.add(line, "the unit is unknown", text);
        Unit { name: "inch?".into(), millimetres: 25.4 }
    })
}
