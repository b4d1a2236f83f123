//! Strings: their escapes.

/// Characters of a string that are kept.
const LONGEST: usize = 1 << 10;

/// A string as people read it: `''`, `\\`, `\S\`, `\P?\`, `\X\`, `\X2\` and `\X4\` resolved. Pages of ISO 8859 but the first are not
/// told apart; bytes above 127 are UTF-8, or Latin.
pub(super) fn decoded(text: &[u8]) -> String {
    let text = text.get(..8 * LONGEST).unwrap_or(text);
    let mut all = String::new();
    let mut rest = text;
    while let Some((&byte, next)) = rest.split_first() {
        if all.len() > LONGEST {
            break;
        }
        rest = match rest {
            [b'\'', b'\'', next @ ..] => {
                all.push('\'');
                next
            }
            [b'\\', b'\\', next @ ..] => {
                all.push('\\');
                next
            }
            [b'\\', b'S', b'\\', low, next @ ..] => {
                all.push(char::from(low | 0x80));
                next
            }
            [b'\\', b'P', b'A'..=b'I', b'\\', next @ ..] => next,
            [b'\\', b'X', b'\\', next @ ..] => hexadecimal(next, 2, &mut all).unwrap_or(next),
            [b'\\', b'X', b'2', b'\\', next @ ..] => run(next, 4, &mut all),
            [b'\\', b'X', b'4', b'\\', next @ ..] => run(next, 8, &mut all),
            // Ends of lines within a string are no part of it.
            [b'\r' | b'\n', next @ ..] => next,
            _ if byte < 0x80 => {
                all.push(char::from(byte));
                next
            }
            _ => {
                let count = rest.iter().take_while(|byte| **byte >= 0x80).count();
                let (high, next) = rest.split_at_checked(count).unwrap_or((rest, &[]));
                match std::str::from_utf8(high) {
                    Ok(high) => all.push_str(high),
                    Err(_) => all.extend(high.iter().copied().map(char::from)),
                }
                next
            }
        };
    }
    all
}

/// Characters of so many digits each, up to `\X0\`.
fn run<'a>(mut text: &'a [u8], digits: usize, all: &mut String) -> &'a [u8] {
    let mut half = None;
    while !text.is_empty() && all.len() <= LONGEST {
        if let Some(rest) = text.strip_prefix(b"\\X0\\") {
            return rest;
        }
        let Some((code, rest)) = code(text, digits) else { return text };
        text = rest;
        // Two halves of a character outside of the first plane.
        match (half.take(), code) {
            (None, 0xd800..=0xdbff) => half = Some(code),
            (Some(high), 0xdc00..=0xdfff) => all.extend(char::from_u32(0x10000 + ((high & 0x3ff) << 10 | code & 0x3ff))),
            _ => all.push(char::from_u32(code).unwrap_or('\u{fffd}')),
        }
    }
    text
}

fn hexadecimal<'a>(text: &'a [u8], digits: usize, all: &mut String) -> Option<&'a [u8]> {
    let (code, rest) = code(text, digits)?;
    all.push(char::from_u32(code)?);
    Some(rest)
}

fn code(text: &[u8], digits: usize) -> Option<(u32, &[u8])> {
    let (word, rest) = text.split_at_checked(digits)?;
    let code = u32::from_str_radix(std::str::from_utf8(word).ok()?, 16).ok()?;
    Some((code, rest))
}
