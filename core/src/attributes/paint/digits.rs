//! Paint as text.
//!
//! The last digit comes first: it is the root. Each node is a digit whose lower two bits are the number of cut sides, 0 to 3.
//! - A split node has the number of the special corner in its upper two bits. Its children follow, the last one first.
//! - A leaf has its state in them. From 3 on they are both set, and digits follow whose sum is the state less 3, the first of which that is
//!   not 15 ends them. (`serialize` of PrusaSlicer never needs more than one; Bambu Studio's goes on after 15.)

use super::split::{Share, Way};
use super::tree::Paint;

/// Bits of a leaf that say that the state follows.
const STATE_FOLLOWS: u8 = 0b1100;
const LARGEST_DIGIT: u32 = 15;

impl Paint {
    /// Reads what slicers write. As for them, digits beyond the end of the tree mean nothing.
    /// `None` for other characters than 0 to 9 and A to F (slicers take them for 0), an end within the tree, a special corner that is none,
    /// and an area below 2⁻⁵² of the triangle.
    ///
    /// O(n) in the text's length; no deeper than 52 calls.
    pub(crate) fn parse(text: &str) -> Option<Paint> {
        node(&mut text.bytes().rev(), Share::WHOLE)
    }

    /// The text from which [`Paint::parse`] reads this, as slicers write it.
    ///
    /// O(n) in the tree, plus 1/15 of each state.
    pub(crate) fn to_text(&self) -> String {
        let mut digits = Vec::new();
        write(self, &mut digits);
        digits.iter().rev().map(|digit| char::from_digit(u32::from(*digit), 16).unwrap_or('0').to_ascii_uppercase()).collect()
    }
}

fn digit(text: &mut impl Iterator<Item = u8>) -> Option<u8> {
    match text.next()? {
        c @ b'0'..=b'9' => Some(c - b'0'),
        c @ b'A'..=b'F' => Some(c - b'A' + 10),
        _ => None,
    }
}

fn node(text: &mut impl Iterator<Item = u8>, share: Share) -> Option<Paint> {
    if !share.representable() {
        return None;
    }
    let code = digit(text)?;
    let Some(way) = Way::from_sides(code & 0b11) else { return leaf(code, text) };
    let first = code >> 2;
    if first > 2 {
        return None;
    }
    let mut children = Vec::with_capacity(4);
    for halvings in way.halvings().iter().rev() {
        children.push(node(text, share.halved(*halvings))?);
    }
    children.reverse();
    Some(Paint::split(way, first, children))
}

fn leaf(code: u8, text: &mut impl Iterator<Item = u8>) -> Option<Paint> {
    if code != STATE_FOLLOWS {
        return Some(Paint::Uniform(u32::from(code >> 2)));
    }
    let mut state = 3_u32;
    loop {
        let more = u32::from(digit(text)?);
        state = state.checked_add(more)?;
        if more != LARGEST_DIGIT {
            return Some(Paint::Uniform(state));
        }
    }
}

fn write(paint: &Paint, digits: &mut Vec<u8>) {
    match paint {
        Paint::Uniform(state @ 0..=2) => digits.push((*state as u8) << 2),
        Paint::Uniform(state) => {
            let rest = state - 3;
            digits.push(STATE_FOLLOWS);
            digits.extend((0..rest / LARGEST_DIGIT).map(|_| LARGEST_DIGIT as u8));
            digits.push((rest % LARGEST_DIGIT) as u8);
        }
        Paint::Split(split) => {
            digits.push(split.way.sides() | split.first << 2);
            split.children.iter().rev().for_each(|child| write(child, digits));
        }
    }
}
