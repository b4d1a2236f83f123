//! Expressions in square brackets, functions and parameters (NISTIR 6556, section 3.3; LinuxCNC, "G-code overview", expressions).

use super::fault::{Fault, refused, syntax};
use super::number::Cursor;
use super::parameters::Parameters;
use crate::util::legible::legible_bytes;

/// Brackets within brackets, at most.
const DEEPEST: u32 = 64;

/// Operators with what binds tighter, longest spellings first.
static OPERATORS: [(&[u8], u8, Operator); 16] = [
    (b"**", 5, Operator::Power),
    (b"*", 4, Operator::Times),
    (b"/", 4, Operator::Over),
    (b"mod", 4, Operator::Modulo),
    (b"+", 3, Operator::Plus),
    (b"-", 3, Operator::Minus),
    (b"eq", 2, Operator::Equal),
    (b"ne", 2, Operator::Unequal),
    (b"gt", 2, Operator::Greater),
    (b"ge", 2, Operator::AtLeast),
    (b"lt", 2, Operator::Less),
    (b"le", 2, Operator::AtMost),
    (b"and", 1, Operator::And),
    (b"or", 1, Operator::Or),
    (b"xor", 1, Operator::Xor),
    (b"nand", 1, Operator::Nand),
];

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Operator {
    Power,
    Times,
    Over,
    Modulo,
    Plus,
    Minus,
    Equal,
    Unequal,
    Greater,
    AtLeast,
    Less,
    AtMost,
    And,
    Or,
    Xor,
    Nand,
}

impl Operator {
    fn apply(self, a: f64, b: f64) -> Result<f64, Fault> {
        let truth = |is: bool| f64::from(u8::from(is));
        Ok(match self {
            Self::Power if a < 0.0 && b.fract() != 0.0 => return refused("a negative number to a power that is not whole"),
            Self::Power => a.powf(b),
            Self::Times => a * b,
            Self::Over if b == 0.0 => return refused("a division by zero"),
            Self::Over => a / b,
            Self::Modulo if b == 0.0 => return refused("a remainder of a division by zero"),
            Self::Modulo => a.rem_euclid(b.abs()),
            Self::Plus => a + b,
            Self::Minus => a - b,
            // Differences below it are none, so that counters in tenths end their loops.
            Self::Equal => truth((a - b).abs() < EQUAL),
            Self::Unequal => truth((a - b).abs() >= EQUAL),
            Self::Greater => truth(a > b),
            Self::AtLeast => truth(a >= b),
            Self::Less => truth(a < b),
            Self::AtMost => truth(a <= b),
            Self::And => truth(a != 0.0 && b != 0.0),
            Self::Or => truth(a != 0.0 || b != 0.0),
            Self::Xor => truth((a != 0.0) != (b != 0.0)),
            Self::Nand => truth(!(a != 0.0 && b != 0.0)),
        })
    }
}

/// LinuxCNC's tolerance of `EQ` and `NE`.
const EQUAL: f64 = 1e-6;

/// A value: a number, a parameter, a function or an expression in brackets, with or without signs before it.
pub(super) fn value(cursor: &mut Cursor<'_>, parameters: &Parameters) -> Result<f64, Fault> {
    primary(cursor, parameters, 0)
}

/// The value within brackets, from the opening to the closing one.
fn bracket(cursor: &mut Cursor<'_>, parameters: &Parameters, depth: u32) -> Result<f64, Fault> {
    if depth > DEEPEST {
        return refused("more than 64 brackets within each other");
    }
    if !cursor.eat(b"[") {
        return syntax("a bracket is missing");
    }
    let value = binary(cursor, parameters, 1, depth)?;
    if cursor.eat(b"]") { Ok(value) } else { syntax("a bracket is not closed") }
}

fn binary(cursor: &mut Cursor<'_>, parameters: &Parameters, least: u8, depth: u32) -> Result<f64, Fault> {
    let mut left = primary(cursor, parameters, depth + 1)?;
    while let Some((word, strength, operator)) = next_operator(cursor).filter(|(_, strength, _)| *strength >= least) {
        cursor.at += word.len();
        let right = binary(cursor, parameters, strength + 1, depth)?;
        left = operator.apply(left, right)?;
    }
    Ok(left)
}

/// The operator that comes next; mostly there is none, which the first byte tells.
fn next_operator(cursor: &Cursor<'_>) -> Option<(&'static [u8], u8, Operator)> {
    let first = cursor.peek().filter(|byte| *byte != b']')?;
    let is_next = |word: &[u8]| word.first() == Some(&first) && cursor.rest().starts_with(word);
    OPERATORS.iter().find(|(word, ..)| is_next(word)).copied()
}

fn primary(cursor: &mut Cursor<'_>, parameters: &Parameters, depth: u32) -> Result<f64, Fault> {
    let mut sign = 1.0;
    loop {
        match cursor.peek() {
            Some(b'-') => sign = -sign,
            Some(b'+') => {}
            _ => break,
        }
        cursor.at += 1;
    }
    let value = match cursor.peek() {
        Some(b'0'..=b'9' | b'.') => match cursor.number() {
            Some(number) => number,
            None => return syntax("a number is not readable"),
        },
        Some(b'[') => bracket(cursor, parameters, depth + 1)?,
        Some(b'#') => parameter(cursor, parameters, depth + 1)?,
        Some(b'a'..=b'z') => function(cursor, parameters, depth + 1)?,
        _ => return syntax(format!("a number is missing before “{}”", legible_bytes(cursor.rest()))),
    };
    Ok(sign * value)
}

/// The name of a parameter in angle brackets, behind its opening one.
pub(super) fn name<'a>(cursor: &mut Cursor<'a>) -> Result<&'a [u8], Fault> {
    match cursor.until(b'>') {
        Some(name) => Ok(name),
        None => syntax("a name is not closed"),
    }
}

/// The number of a parameter, behind its `#`.
pub(super) fn number_of(cursor: &mut Cursor<'_>, parameters: &Parameters, depth: u32) -> Result<f64, Fault> {
    if depth > DEEPEST {
        return refused("more than 64 parameters of parameters");
    }
    match cursor.peek() {
        Some(b'#') => parameter(cursor, parameters, depth + 1),
        _ => primary(cursor, parameters, depth + 1),
    }
}

fn parameter(cursor: &mut Cursor<'_>, parameters: &Parameters, depth: u32) -> Result<f64, Fault> {
    if depth > DEEPEST {
        return refused("more than 64 parameters of parameters");
    }
    cursor.at += 1;
    if cursor.eat(b"<") {
        let name = name(cursor)?;
        return match parameters.named(name) {
            Some(value) => Ok(value),
            None if name.starts_with(b"_hal[") || name.starts_with(b"_ini[") => {
                refused(format!("#<{}> is a value of the machine, which is not known", legible_bytes(name)))
            }
            None => refused(format!("#<{}> is used before it is set", legible_bytes(name))),
        };
    }
    let number = number_of(cursor, parameters, depth + 1)?;
    parameters.numbered(number)
}

fn function(cursor: &mut Cursor<'_>, parameters: &Parameters, depth: u32) -> Result<f64, Fault> {
    const NAMES: [&[u8]; 14] =
        [b"abs", b"acos", b"asin", b"atan", b"cos", b"exists", b"exp", b"fix", b"fup", b"ln", b"round", b"sin", b"sqrt", b"tan"];
    let Some(name) = NAMES.into_iter().find(|name| cursor.rest().starts_with(name)) else {
        return syntax(format!("a value is missing before “{}”", legible_bytes(cursor.rest())));
    };
    cursor.at += name.len();
    if name == b"exists" {
        return exists(cursor, parameters);
    }
    let value = bracket(cursor, parameters, depth)?;
    let result = match name {
        b"abs" => value.abs(),
        b"acos" => value.acos().to_degrees(),
        b"asin" => value.asin().to_degrees(),
        b"atan" => {
            if !cursor.eat(b"/") {
                return syntax("ATAN has no second value");
            }
            value.atan2(bracket(cursor, parameters, depth)?).to_degrees()
        }
        b"cos" => value.to_radians().cos(),
        b"exp" => value.exp(),
        b"fix" => value.floor(),
        b"fup" => value.ceil(),
        b"ln" => value.ln(),
        b"round" => value.round(),
        b"sin" => value.to_radians().sin(),
        b"sqrt" => value.sqrt(),
        _ => value.to_radians().tan(),
    };
    if result.is_finite() {
        Ok(result)
    } else {
        refused(format!("{}[{value}] has no value", String::from_utf8_lossy(name).to_uppercase()))
    }
}

/// Whether a named parameter is set: `EXISTS[#<name>]`.
fn exists(cursor: &mut Cursor<'_>, parameters: &Parameters) -> Result<f64, Fault> {
    if !cursor.eat(b"[#<") {
        return syntax("EXISTS has no name");
    }
    let is_set = parameters.named(name(cursor)?).is_some();
    if cursor.eat(b"]") { Ok(f64::from(u8::from(is_set))) } else { syntax("a bracket is not closed") }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn eval(text: &str) -> Result<f64, Fault> {
        let mut parameters = Parameters::default();
        parameters.set_numbered(1.0, 3.0)?;
        parameters.set_numbered(3.0, 4.0)?;
        parameters.set_named(b"depth", 2.5);
        value(&mut Cursor::new(text.as_bytes()), &parameters)
    }

    /// Examples of the standard, and by hand.
    #[test]
    fn expressions_have_values() {
        for (text, expected) in [
            ("[1+acos[0]-[#3**[4.0/2]]]", 75.0),
            ("[2**3**2]", 64.0),
            ("##1", 4.0),
            ("-[#<depth>*2]", -5.0),
            ("atan[1]/[1]", 45.0),
            ("[[1lt2]and[2gt3]]", 0.0),
            ("[1+2*3-4/2]", 5.0),
            ("[10mod3]", 1.0),
            ("fix[-2.8]", -3.0),
            ("fup[2.2]", 3.0),
            ("exists[#<depth>]", 1.0),
            ("exists[#<nothing>]", 0.0),
        ] {
            assert!((eval(text).expect(text) - expected).abs() < 1e-12, "{text}");
        }
        assert!(matches!(eval("[1/0]"), Err(Fault::Refused(_))));
        assert!(matches!(eval("#<nothing>"), Err(Fault::Refused(_))));
        assert!(matches!(eval("[1+"), Err(Fault::Syntax(_))));
        assert!(matches!(eval(&"[".repeat(5000)), Err(Fault::Refused(_))));
        assert!(matches!(eval(&"#".repeat(5000)), Err(Fault::Refused(_))));
    }
}
