//! Vertices and triangles in any form that is XML, one element at a time.

use std::borrow::Cow;
use std::ops::Range;
use std::path::Path;

use super::super::finding::Rejection;
use super::super::vertices::Vertices;
use super::super::xml::{Element, Node, Scopes, Xml};
use super::attributes::Attributes;
use super::extensions::is_core;
use super::shards::{Corners, Points, Shard};
use crate::contract::error::Result;

/// Elements that are read before they are handed on.
const AT_A_TIME: usize = 1 << 16;

/// A piece of a part: all of it, where the piece lies, and the namespaces there.
#[derive(Clone)]
pub(super) struct Piece<'a> {
    pub(super) part: &'a str,
    pub(super) text: &'a [u8],
    pub(super) range: Range<usize>,
    pub(super) scopes: &'a Scopes,
}

impl<'a> Piece<'a> {
    fn xml(&self) -> Xml<'a> {
        Xml::within(self.part, self.text, self.range.clone(), self.scopes.clone())
    }
}

/// Gives elements of 3MF Core of one name to `each`, up to a number. Whether that was the last of them.
fn elements(
    xml: &mut Xml<'_>,
    name: &str,
    mut each: impl FnMut(&Attributes<'_, '_>) -> std::result::Result<(), Rejection>,
) -> std::result::Result<bool, Rejection> {
    let mut count = 0;
    while count < AT_A_TIME {
        match xml.next()? {
            Node::Start(element) => {
                if is_core(&element, name) {
                    each(&Attributes { xml, element: &element })?;
                    count += 1;
                }
                xml.skip()?;
            }
            Node::Over => return Ok(true),
            Node::End(_) | Node::Text(_) => {}
        }
    }
    Ok(false)
}

type Value<'a> = Option<Cow<'a, str>>;

fn three<'a>(attributes: &Attributes<'_, 'a>, names: [&str; 3]) -> std::result::Result<[Value<'a>; 3], Rejection> {
    let [a, b, c] = names;
    Ok([attributes.plain(a)?, attributes.plain(b)?, attributes.plain(c)?])
}

fn bytes<'v>(values: &'v [Value<'_>; 3]) -> [Option<&'v [u8]>; 3] {
    values.each_ref().map(|value| value.as_deref().map(str::as_bytes))
}

/// All vertices of a piece, some at a time.
///
/// # Errors
/// [`crate::Error::Unreadable`] where the XML is not sound, and those of `take`.
pub(super) fn vertices(piece: &Piece<'_>, path: &Path, mut take: impl FnMut(Points) -> Result<()>) -> Result<()> {
    let mut xml = piece.xml();
    loop {
        let mut points = Points::default();
        let over = elements(&mut xml, "vertex", |attributes| {
            points.push(bytes(&three(attributes, ["x", "y", "z"])?));
            Ok(())
        });
        let over = over.map_err(|rejection| rejection.at(path))?;
        take(points)?;
        if over {
            return Ok(());
        }
    }
}

/// All triangles of a piece, some at a time.
///
/// # Errors
/// [`crate::Error::Unreadable`] where the XML is not sound, and those of `take`.
pub(super) fn triangles<'v>(
    piece: &Piece<'_>,
    path: &Path,
    vertices: Vertices<'v>,
    mut take: impl FnMut(Shard<'v>) -> Result<()>,
) -> Result<()> {
    let mut xml = piece.xml();
    loop {
        let mut shard = Shard::of(vertices);
        let over = elements(&mut xml, "triangle", |attributes| {
            let values = three(attributes, ["v1", "v2", "v3"])?;
            shard.push(Corners { indices: bytes(&values), ..properties(attributes.element) });
            Ok(())
        });
        let over = over.map_err(|rejection| rejection.at(path))?;
        take(shard)?;
        if over {
            return Ok(());
        }
    }
}

fn properties(element: &Element<'_>) -> Corners<'static> {
    let property = ["pid", "p1", "p2", "p3"].iter().any(|name| element.has(name));
    let vendor = element.has_others_than(&["v1", "v2", "v3", "pid", "p1", "p2", "p3"]);
    Corners { property, vendor, ..Corners::default() }
}
