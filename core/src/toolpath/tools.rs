//! Tools that people describe: `3=ball,d=6` of a command line, and tables of LinuxCNC.

use super::options::Units;
use super::program::ReadError;
use super::tool::{Shape, Tool};
use crate::curves::{Finding, Findings};
use crate::util::legible::{escaped, legible};

fn bad(text: &str, problem: impl Into<String>) -> ReadError {
    // The problem may have words of the text, and these any character.
    ReadError::Tool { text: legible(text), problem: escaped(&problem.into(), 200) }
}

/// Reads a tool as the command line has it: its number, `=`, a form, and `key=value` in any order.
///
/// Forms: `flat`, `ball`, `bull` (with `r`), `taper` (with `a`, and `tip`), `drill` (`a` is the angle of its point, 118° if
/// none). Keys: `d` diameter, `r` radius of the corner, `tip` diameter of the tip, `a` degrees, `l` length; lengths in
/// millimetres, or inches with `in` behind them (`d=0.25in`). Without a number the tool is 0, that of a path that names none.
///
/// # Errors
/// [`ReadError::Tool`].
pub fn parse(text: &str) -> Result<Tool, ReadError> {
    let (number, rest) = match text.split_once('=') {
        Some((number, rest)) if number.trim().bytes().all(|byte| byte.is_ascii_digit()) && !number.trim().is_empty() => {
            (number.trim().parse().map_err(|_| bad(text, "its number is too great"))?, rest)
        }
        _ => (0, text),
    };
    let mut words = rest.split(',').map(str::trim);
    let form = words.next().unwrap_or_default().to_ascii_lowercase();
    let (mut d, mut r, mut tip, mut a, mut l) = (None, None, None, None, None);
    for word in words {
        let Some((key, value)) = word.split_once('=') else { return Err(bad(text, format!("“{word}” is no key=value"))) };
        let is_angle = key.trim() == "a";
        let slot = match key.trim() {
            "d" => &mut d,
            "r" => &mut r,
            "tip" => &mut tip,
            "a" => &mut a,
            "l" => &mut l,
            other => return Err(bad(text, format!("“{other}” is no key; there are d, r, tip, a, l"))),
        };
        *slot = Some(measure(value.trim(), is_angle).ok_or_else(|| bad(text, format!("“{value}” is no measure")))?);
    }
    let diameter: f64 = d.filter(|d| *d > 0.0).ok_or_else(|| bad(text, "it needs a diameter: d=6"))?;
    let shape = match form.as_str() {
        "flat" | "cylindrical" => Shape::Flat,
        "ball" | "ballnose" => Shape::Ball,
        "bull" | "bullnose" => match r.filter(|r| *r <= 0.5 * diameter) {
            Some(corner) => Shape::BullNose { corner },
            None => return Err(bad(text, "a bull nose needs the radius of its corner, up to half of its diameter: r=1")),
        },
        "taper" | "conical" | "vbit" => match a.filter(|a| *a < 90.0) {
            Some(angle) => Shape::Taper { tip: tip.unwrap_or(0.0), angle },
            None => return Err(bad(text, "a taper needs the angle between its flank and its axis: a=15")),
        },
        "drill" => Shape::Drill { angle: a.filter(|a| *a <= 180.0).unwrap_or(118.0) },
        other => return Err(bad(text, format!("“{other}” is no form; there are flat, ball, bull, taper, drill"))),
    };
    Ok(Tool { length: l.unwrap_or(f64::INFINITY), ..Tool::new(number, shape, diameter) })
}

/// A length in millimetres, or an angle; not negative.
fn measure(text: &str, is_angle: bool) -> Option<f64> {
    let (number, unit) = if is_angle {
        (text.trim_end_matches("deg").trim_end_matches('°'), 1.0)
    } else if let Some(number) = text.strip_suffix("mm") {
        (number, 1.0)
    } else {
        text.strip_suffix("in").map_or((text, 1.0), |number| (number, 25.4))
    };
    number.trim().parse().ok().map(|value: f64| value * unit).filter(|value| value.is_finite() && *value >= 0.0)
}

/// Whether a text is a table of LinuxCNC: its lines begin with `T` and `P`, and nothing else.
pub(crate) fn is_table(text: &[u8]) -> bool {
    let mut rows =
        text.split(|byte| *byte == b'\n').map(<[u8]>::trim_ascii).filter(|row| !row.is_empty() && row[0] != b';').take(50);
    let is_row = |row: &[u8]| {
        let row = row.split(|byte| *byte == b';').next().unwrap_or_default();
        let mut words = row.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
        let is_word = |word: &[u8]| word.first().is_some_and(|letter| b"TPDZXYABCUVWIJQtpdzxyabcuvwijq".contains(letter));
        let is_tool = words.next().is_some_and(|word| word.len() > 1 && word[0].eq_ignore_ascii_case(&b'T'));
        let is_pocket = words.next().is_some_and(|word| word.len() > 1 && word[0].eq_ignore_ascii_case(&b'P'));
        is_tool && is_pocket && words.all(is_word)
    };
    let is_first = rows.next().is_some_and(is_row);
    is_first && rows.all(is_row)
}

/// Reads a table of LinuxCNC (`T1 P1 D6 Z0 ;6 mm ball`). Forms are those that the comments name, or else flat as a guess.
/// O(length).
///
/// # Errors
/// [`ReadError::Unknown`] if it is none.
pub fn read_table(bytes: &[u8], units: Units) -> Result<(Vec<Tool>, Vec<Finding>), ReadError> {
    if !is_table(bytes) {
        return Err(ReadError::Unknown(crate::util::legible::legible_bytes(bytes)));
    }
    let (mut tools, mut findings) = (Vec::new(), Findings::default());
    for (row, line) in bytes.split(|byte| *byte == b'\n').zip(1..) {
        let row = String::from_utf8_lossy(row);
        let (words, comment) = row.split_once(';').unwrap_or((&row, ""));
        let word = |letter: char| {
            let word = words.split_ascii_whitespace().find(|word| word.starts_with([letter, letter.to_ascii_lowercase()]))?;
            word.get(1..)?.parse::<f64>().ok()
        };
        let Some(number) = word('T').filter(|number| (0.0..1e9).contains(number)) else { continue };
        let Some(diameter) = word('D').map(f64::abs).filter(|diameter| *diameter > 0.0) else {
            findings.add(line, "a tool without a diameter", number.to_string());
            continue;
        };
        let diameter = diameter * units.millimetres();
        let comment = comment.to_ascii_lowercase();
        let shape = if comment.contains("ball") {
            Shape::Ball
        } else if comment.contains("drill") {
            Shape::Drill { angle: 118.0 }
        } else {
            Shape::Flat
        };
        let is_guess = shape == Shape::Flat && !comment.contains("mill");
        tools.push(Tool { line, is_guess, ..Tool::new(number as u32, shape, diameter) });
    }
    Ok((tools, findings.finish()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tools_of_a_command_line() {
        assert_eq!(parse("3=ball,d=6"), Ok(Tool::new(3, Shape::Ball, 6.0)));
        assert_eq!(parse("flat,d=0.25in"), Ok(Tool::new(0, Shape::Flat, 6.35)));
        let bull = Tool { length: 20.0, ..Tool::new(12, Shape::BullNose { corner: 1.0 }, 8.0) };
        assert_eq!(parse("12 = bull, d=8, r=1, l=20"), Ok(bull));
        assert_eq!(parse("1=taper,d=6,a=15,tip=0.5"), Ok(Tool::new(1, Shape::Taper { tip: 0.5, angle: 15.0 }, 6.0)));
        for text in ["3=ball", "3=cube,d=6", "3=bull,d=6", "3=ball,d=-6", "3=ball,x=6", "99999999999=ball,d=1", "", "="] {
            assert!(matches!(parse(text), Err(ReadError::Tool { .. })), "{text}");
        }
        // Words of the text are told without what would damage a line or a terminal.
        for text in ["2=ta\u{0}per,d=6", "2=ball,\u{1b}d=6", "2=ball,d\u{7}", "2=ball,d=6\u{202e}"] {
            let told = parse(text).unwrap_err().to_string();
            assert!(told.chars().all(|one| !one.is_control() && one != '\u{202e}'), "{told:?}");
        }
    }

    #[test]
    fn tables_of_linuxcnc() {
        let text = b"T1 P1 Z0.5 D3 ;3mm end mill\nT2 P4 D1.5 ;ball\nT3 P5\n";
        let (tools, findings) = read_table(text, Units::Millimetres).expect("a table");
        assert_eq!((tools.len(), tools[1].shape, findings.len()), (2, Shape::Ball, 1));
        assert!(!is_table(b"T1 M6\nG0 X1\n") && !is_table(b""));
    }
}
