//! Rows as strips of triangles: each index makes one with the two before it, of alternating direction; a negative one begins anew.
//!
//! One after the other, since all of a mesh may be one strip.

use super::cursor::{Collector, Cursor};
use super::layout::{Layout, Step};
use super::polygons::Made;
use crate::contract::error::Result;
use crate::io::read::vertices::Vertices;

/// Triangles that are handed over at a time.
const AT_ONCE: usize = 64 << 10;

/// Takes up to `rows` rows of this layout. Returns how many were whole; of one that was cut off, what there was is taken.
///
/// # Errors
/// Those of `collector`.
pub(in crate::io) fn take<'v>(
    rows: u64,
    layout: &Layout,
    vertices: Vertices<'v>,
    cursor: &mut impl Cursor,
    collector: &mut impl Collector<Made<'v>>,
) -> Result<u64> {
    let mut made = Made::of(vertices, 0);
    let mut whole = 0;
    while whole < rows {
        let mut there = true;
        for step in layout.steps() {
            there = match *step {
                Step::List { length, item, indices: true } => match cursor.length(length, item) {
                    Some(items) => {
                        let next = std::iter::from_fn(|| cursor.index(item)).take(items);
                        strip(next, items, &mut made, |made| {
                            collector.take(std::mem::replace(made, Made::of(vertices, AT_ONCE)))
                        })?
                    }
                    None => false,
                },
                step => cursor.pass(step).is_some(),
            };
            if !there {
                break;
            }
        }
        if !there {
            break;
        }
        whole += 1;
    }
    collector.take(made)?;
    Ok(whole)
}

/// Takes a strip of `items` indices. Returns whether all were there.
fn strip<'v>(
    indices: impl Iterator<Item = i64>,
    items: usize,
    made: &mut Made<'v>,
    mut full: impl FnMut(&mut Made<'v>) -> Result<()>,
) -> Result<bool> {
    let (mut seen, mut before, mut length, mut turned) = (0, [0; 2], 0_u8, false);
    for index in indices {
        seen += 1;
        if index < 0 {
            (length, turned) = (0, false);
            continue;
        }
        let index = index.cast_unsigned();
        let [a, b] = before;
        if length < 2 {
            length += 1;
        } else {
            // An index that is repeated joins two strips, and makes no triangle.
            if a != b && b != index && a != index {
                made.faces.triangle(if turned { [b, a, index] } else { [a, b, index] });
            }
            turned = !turned;
        }
        before = [b, index];
        if made.faces.records.len() >= AT_ONCE {
            full(made)?;
        }
    }
    Ok(seen == items)
}
