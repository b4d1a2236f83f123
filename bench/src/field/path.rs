//! Straight moves of a plain G-code program.

use crate::space::Vector;

/// A straight move of the tool's tip, in millimetres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Move {
    /// Where it begins.
    pub from: Vector,
    /// Where it ends.
    pub to: Vector,
    /// Whether it cuts; rapid moves do not.
    pub is_cut: bool,
}

/// Why a program is not simulated.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PathError {
    /// A word asks for more than straight moves in millimetres.
    #[error("line {line}: {word} is not simulated: straight moves in absolute millimetres are")]
    Word {
        /// Its line, from 1.
        line: usize,
        /// The word.
        word: String,
    },
}

/// Codes that leave straight, absolute moves in millimetres as they are: planes, units, and what is switched off.
const PLAIN: [&str; 11] = ["17", "21", "40", "43", "49", "54", "64", "80", "90", "94", "98"];

/// The moves of a program. A G43 is taken for no offset: lengths of tools are in the program's own zero. Linear in the text.
///
/// # Errors
/// [`PathError`] of the first word that asks for anything else.
pub fn moves(code: &str) -> Result<Vec<Move>, PathError> {
    let (mut at, mut is_cut, mut moves) = ([0.0; 3], false, Vec::new());
    for (text, line) in code.lines().zip(1..) {
        let mut to = at;
        let text = without_comments(text);
        for (letter, number) in words(&text) {
            let bad = || PathError::Word { line, word: format!("{letter}{number}") };
            match letter {
                'X' | 'Y' | 'Z' => to[letter as usize - 'X' as usize] = number.parse().map_err(|_| bad())?,
                'G' => match number.trim_start_matches('0') {
                    "" => is_cut = false,
                    "1" => is_cut = true,
                    plain if PLAIN.contains(&plain) => {}
                    _ => return Err(bad()),
                },
                'N' | 'M' | 'T' | 'F' | 'S' | 'H' | 'O' => {}
                _ => return Err(bad()),
            }
        }
        if to != at {
            moves.push(Move { from: at, to, is_cut });
            at = to;
        }
    }
    Ok(moves)
}

/// A line without what stands in brackets, behind a semicolon, or is a mark of the tape; in capitals.
fn without_comments(line: &str) -> String {
    let mut depth = 0;
    let code = line.split(';').next().unwrap_or_default().chars();
    let kept = code.filter(|letter| {
        depth += i32::from(*letter == '(');
        let is_code = depth == 0;
        depth -= i32::from(*letter == ')');
        is_code && !letter.is_whitespace() && *letter != '%' && *letter != '/'
    });
    kept.collect::<String>().to_ascii_uppercase()
}

/// Letters, each with the text up to the next one.
fn words(line: &str) -> impl Iterator<Item = (char, &str)> {
    let mut starts: Vec<usize> =
        line.char_indices().filter(|(_, c)| !(c.is_ascii_digit() || "+-.".contains(*c))).map(|(n, _)| n).collect();
    starts.push(line.len());
    let pairs: Vec<(usize, usize)> = starts.windows(2).map(|pair| (pair[0], pair[1])).collect();
    pairs.into_iter().filter_map(move |(start, end)| {
        let word = line.get(start..end)?;
        let letter = word.chars().next()?;
        Some((letter, word.get(letter.len_utf8()..)?))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_modal_and_comments_are_none() {
        let code = "%\nN1 G00 G21 G90 T1 M6\nG0 X1.5 Y-2 (to Z9)\nG43H1 Z2.\nG01 Z-.5 F300\nX3 ; X9\n";
        let moves = moves(code).unwrap();
        let ends: Vec<(Vector, bool)> = moves.iter().map(|m| (m.to, m.is_cut)).collect();
        let expected =
            [([1.5, -2.0, 0.0], false), ([1.5, -2.0, 2.0], false), ([1.5, -2.0, -0.5], true), ([3.0, -2.0, -0.5], true)];
        assert_eq!(ends, expected);
        assert_eq!(moves[3].from, moves[2].to);
    }

    #[test]
    fn what_is_more_than_straight_is_named() {
        let word = |code: &str| moves(code).unwrap_err().to_string();
        assert!(word("G1 X1\nG2 X3 I1").starts_with("line 2: G2 "));
        assert!(word("G91").contains("G91") && word("G20").contains("G20") && word("X#1").contains('X'));
    }
}
