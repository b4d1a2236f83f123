//! Namespaces that are declared where an element stands.

use std::sync::Arc;

/// Bytes of a namespace's URI, at most.
pub(super) const LONGEST_URI: usize = 1024;
const XML: &str = "http://www.w3.org/XML/1998/namespace";
/// What stands for the namespace of a prefix that is not declared; no URI.
const UNDECLARED: &str = "undeclared";

/// Prefixes and their namespaces, the inner ones last. Cheap to copy as long as nothing is declared.
#[derive(Clone, Debug, Default)]
pub(crate) struct Scopes(Arc<Vec<(Box<str>, Arc<str>)>>);

impl Scopes {
    pub(super) fn len(&self) -> usize {
        self.0.len()
    }

    /// Both are one list, which takes no more memory than one of them.
    pub(crate) fn is_shared(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }

    /// Bytes that the list takes.
    pub(crate) fn bytes(&self) -> usize {
        self.0.iter().map(|(prefix, uri)| 64 + prefix.len() + uri.len()).sum()
    }

    pub(super) fn declare(&mut self, prefix: &str, uri: &str) {
        Arc::make_mut(&mut self.0).push((prefix.into(), uri.into()));
    }

    pub(super) fn truncate(&mut self, length: usize) {
        if length < self.0.len() {
            Arc::make_mut(&mut self.0).truncate(length);
        }
    }

    /// The namespace of a prefix; that of no prefix is the default one.
    pub(crate) fn namespace(&self, prefix: &str) -> Option<Arc<str>> {
        let declared = self.0.iter().rev().find(|(known, _)| **known == *prefix).map(|(_, uri)| uri.clone());
        match (declared, prefix) {
            (Some(uri), _) => Some(uri).filter(|uri| !uri.is_empty()),
            (None, "") => None,
            (None, "xml") => Some(XML.into()),
            (None, _) => Some(UNDECLARED.into()),
        }
    }
}
