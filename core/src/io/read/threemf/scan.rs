//! The plain form of vertices and triangles, as nearly all files have it: `<vertex x="…" y="…" z="…"/>`.
//!
//! Whatever is not of this form is `None`, and read by [`super::careful`]: also numbers that are none, such as those with references in them. What is of
//! this form gives the same there; tests hold the two against each other. Values that nobody asks for are not looked at, so that an error of XML in
//! them is not noticed.

use super::shards::{Corners, Points, Shard};

/// A stretch of vertices. `prefix`: of the names of 3MF Core here, with its colon.
pub(super) fn vertices(text: &[u8], prefix: &[u8]) -> Option<Points> {
    let mut points = Points::default();
    let name = [b"<", prefix, b"vertex"].concat();
    let mut at = first(text)?;
    while at < text.len() {
        let mut values = [None; 3];
        at = tag(text, at, &name, |key, value| match key {
            b"x" => put(&mut values, 0, value),
            b"y" => put(&mut values, 1, value),
            b"z" => put(&mut values, 2, value),
            _ => true,
        })?;
        points.push(values).then_some(())?;
    }
    Some(points)
}

/// A stretch of triangles, into a shard that is empty.
pub(super) fn triangles<'v>(text: &[u8], prefix: &[u8], mut shard: Shard<'v>) -> Option<Shard<'v>> {
    let name = [b"<", prefix, b"triangle"].concat();
    let mut at = first(text)?;
    while at < text.len() {
        let mut corners = Corners::default();
        at = tag(text, at, &name, |key, value| match key {
            b"v1" => put(&mut corners.indices, 0, value),
            b"v2" => put(&mut corners.indices, 1, value),
            b"v3" => put(&mut corners.indices, 2, value),
            b"pid" | b"p1" | b"p2" | b"p3" => {
                corners.property = true;
                true
            }
            _ => {
                corners.vendor = true;
                true
            }
        })?;
        shard.push(corners).then_some(())?;
    }
    Some(shard)
}

/// Notes a value. `false` if there is one already.
#[inline]
fn put<'t>(values: &mut [Option<&'t [u8]>; 3], at: usize, value: &'t [u8]) -> bool {
    match values.get_mut(at) {
        Some(slot @ None) => {
            *slot = Some(value);
            true
        }
        _ => false,
    }
}

/// Where the first tag begins, or the end of what is blank.
fn first(text: &[u8]) -> Option<usize> {
    let blank = blanks(text, 0);
    (blank == text.len() || text.get(blank) == Some(&b'<')).then_some(blank)
}

/// The place behind the blanks at `at`.
#[inline]
fn blanks(text: &[u8], mut at: usize) -> usize {
    while matches!(text.get(at), Some(b' ' | b'\t' | b'\r' | b'\n')) {
        at += 1;
    }
    at
}

/// Reads the tag at `at`, which begins with `<` and its name and has no content, and gives where the next one begins. Ends where `each` does not take an
/// attribute.
#[inline]
fn tag<'t>(text: &'t [u8], at: usize, name: &[u8], mut each: impl FnMut(&'t [u8], &'t [u8]) -> bool) -> Option<usize> {
    let mut at = at;
    if !text.get(at..)?.starts_with(name) {
        return None;
    }
    at += name.len();
    loop {
        let key_from = blanks(text, at);
        if text.get(key_from) == Some(&b'/') {
            (text.get(key_from + 1) == Some(&b'>')).then_some(())?;
            let next = blanks(text, key_from + 2);
            return (next == text.len() || text.get(next) == Some(&b'<')).then_some(next);
        }
        // A blank stands before each attribute.
        (key_from > at).then_some(())?;
        let mut key_to = key_from;
        while matches!(text.get(key_to)?, b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'_' | b'-' | b'.' | b':') {
            key_to += 1;
        }
        (text.get(key_to) == Some(&b'=') && text.get(key_to + 1) == Some(&b'"')).then_some(())?;
        let value_from = key_to + 2;
        let mut value_to = value_from;
        while *text.get(value_to)? != b'"' {
            value_to += 1;
        }
        let key = text.get(key_from..key_to)?;
        if key.is_empty() || key.starts_with(b"xmlns") || !each(key, text.get(value_from..value_to)?) {
            return None;
        }
        at = value_to + 1;
    }
}
