//! The start of an element: its name, and its attributes when they are asked for.

use std::borrow::Cow;
use std::ops::Range;
use std::sync::Arc;

use quick_xml::escape::unescape;
use quick_xml::events::attributes::Attributes;

use super::scopes::{LONGEST_URI, Scopes};

/// Attributes of an element, at most.
const MOST_ATTRIBUTES: usize = 256;
/// Namespaces that are declared where an element stands, at most: all are looked at for each name, and real files declare a dozen.
const MOST_SCOPES: usize = 64;
/// Bytes of a value that is asked for, at most.
const LONGEST_VALUE: usize = 64 << 10;

/// An attribute, its value as it stands.
#[derive(Clone, Debug)]
struct Attribute<'a> {
    namespace: Option<Arc<str>>,
    name: &'a str,
    value: &'a str,
}

/// The start of an element.
#[derive(Clone, Debug)]
pub(crate) struct Element<'a> {
    /// The namespace's URI, if there is one.
    pub(crate) namespace: Option<Arc<str>>,
    /// The name with its prefix, as it stands.
    pub(crate) raw_name: &'a str,
    /// The name without its prefix.
    pub(crate) name: &'a str,
    /// Where its start tag stands in the part.
    pub(crate) tag: Range<usize>,
    attributes: Vec<Attribute<'a>>,
}

/// A name's prefix, and what is behind it.
fn split(name: &str) -> (&str, &str) {
    name.split_once(':').unwrap_or(("", name))
}

impl<'a> Element<'a> {
    /// Reads a tag, without its brackets. Namespaces that it declares are added to `scopes`. An error says what is wrong with it.
    pub(super) fn read(inner: &'a str, tag: Range<usize>, scopes: &mut Scopes) -> Result<Self, String> {
        let name_end = inner.find(|c: char| c.is_ascii_whitespace()).unwrap_or(inner.len());
        let raw_name = inner.get(..name_end).unwrap_or_default();
        let mut raw: Vec<(&str, &str)> = Vec::new();
        for attribute in Attributes::new(inner, name_end).with_checks(true) {
            let attribute = attribute.map_err(|error| format!("has a damaged attribute ({error})"))?;
            if raw.len() == MOST_ATTRIBUTES {
                return Err(format!("has more than {MOST_ATTRIBUTES} attributes"));
            }
            let Cow::Borrowed(value) = attribute.value else { continue };
            let text = |bytes: &'a [u8]| std::str::from_utf8(bytes).unwrap_or_default();
            let (key, value) = (text(attribute.key.0), text(value));
            let prefix = if key == "xmlns" { Some("") } else { key.strip_prefix("xmlns:") };
            match prefix {
                None => raw.push((key, value)),
                Some(_) if value.len() > LONGEST_URI => return Err("declares a namespace of too long a name".into()),
                Some(prefix) => scopes.declare(prefix, &plain(value)?),
            }
            // Those that declare something are counted as well, or their number would have no bound.
            if scopes.len() > MOST_SCOPES {
                return Err("declares too many namespaces".into());
            }
        }
        let resolve = |(key, value): (&'a str, &'a str)| {
            let (prefix, name) = split(key);
            let namespace = if prefix.is_empty() { None } else { scopes.namespace(prefix) };
            Attribute { namespace, name, value }
        };
        let attributes = raw.into_iter().map(resolve).collect();
        let (prefix, name) = split(raw_name);
        Ok(Self { namespace: scopes.namespace(prefix), raw_name, name, tag, attributes })
    }

    /// This element of this namespace.
    pub(crate) fn is(&self, namespace: &str, name: &str) -> bool {
        self.name == name && self.namespace.as_deref() == Some(namespace)
    }

    /// The value of an attribute without a prefix. An error says what is wrong with it.
    pub(crate) fn plain(&self, name: &str) -> Result<Option<Cow<'a, str>>, String> {
        self.value(None, name)
    }

    /// The value of an attribute of this namespace.
    pub(crate) fn of(&self, namespace: &str, name: &str) -> Result<Option<Cow<'a, str>>, String> {
        self.value(Some(namespace), name)
    }

    fn value(&self, namespace: Option<&str>, name: &str) -> Result<Option<Cow<'a, str>>, String> {
        let found = self.attributes.iter().find(|a| a.name == name && a.namespace.as_deref() == namespace);
        let Some(found) = found else { return Ok(None) };
        if found.value.len() > LONGEST_VALUE {
            return Err(format!("has more than {} KiB in its attribute {name}", LONGEST_VALUE >> 10));
        }
        plain(found.value).map(Some)
    }

    /// There is an attribute of this name without a prefix.
    pub(crate) fn has(&self, name: &str) -> bool {
        self.attributes.iter().any(|a| a.name == name && a.namespace.is_none())
    }

    /// An attribute without a prefix, or with one, besides these without one.
    pub(crate) fn has_others_than(&self, names: &[&str]) -> bool {
        self.attributes.iter().any(|a| a.namespace.is_some() || !names.contains(&a.name))
    }
}

/// A value without references.
fn plain(value: &str) -> Result<Cow<'_, str>, String> {
    let plain = unescape(value).map_err(|_| "refers to an entity or a character that is not there".to_owned())?;
    // Section 2.2: no character of XML, not even by a reference.
    let is_none = |c: char| c < ' ' && !matches!(c, '\t' | '\n' | '\r') || matches!(c, '\u{fffe}' | '\u{ffff}');
    if plain.contains(is_none) { Err("holds a control character, which XML does not allow".into()) } else { Ok(plain) }
}
