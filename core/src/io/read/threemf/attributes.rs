//! Attributes of an element, refused in its name where they are wrong.

use std::borrow::Cow;

use super::super::finding::Rejection;
use super::super::xml::{Element, Xml};
use super::extensions::PRODUCTION;

/// Reads attributes of an element, and refuses them in its name.
pub(super) struct Attributes<'x, 'a> {
    pub(super) xml: &'x Xml<'a>,
    pub(super) element: &'x Element<'a>,
}

impl<'a> Attributes<'_, 'a> {
    pub(super) fn refuse(&self, reason: impl std::fmt::Display) -> Rejection {
        self.xml.refuse_element(self.element, reason)
    }

    pub(super) fn plain(&self, name: &str) -> Result<Option<Cow<'a, str>>, Rejection> {
        self.element.plain(name).map_err(|reason| self.refuse(reason))
    }

    pub(super) fn of(&self, namespace: &str, name: &str) -> Result<Option<Cow<'a, str>>, Rejection> {
        self.element.of(namespace, name).map_err(|reason| self.refuse(reason))
    }

    /// The value of an attribute, empty if it is not there.
    pub(super) fn text(&self, name: &str) -> Result<String, Rejection> {
        Ok(self.plain(name)?.unwrap_or_default().into_owned())
    }

    /// A value of the production extension, empty if it is not there.
    pub(super) fn production(&self, name: &str) -> Result<String, Rejection> {
        Ok(self.of(PRODUCTION, name)?.unwrap_or_default().into_owned())
    }

    /// A number of a resource or of something in it.
    pub(super) fn id(&self, name: &str) -> Result<Option<u32>, Rejection> {
        let Some(text) = self.plain(name)? else { return Ok(None) };
        let id = text.trim().parse().map_err(|_| self.refuse(format!("has no number in its attribute {name}")))?;
        Ok(Some(id))
    }
}
