//! What outlines of a package take, counted.

use super::super::finding::Rejection;
use super::super::xml::{Scopes, Xml};

/// Bytes that outlines of a package take, at most: so many, and so many for each byte of the archive. A small one unpacks to very many empty objects.
const MOST_BYTES: usize = 24 << 20;
const MOST_A_BYTE: usize = 8;

/// An object with its mesh, in bytes (measured, as the others are, with lists that grow by doubling).
pub(super) const OBJECT: usize = 512;
/// A component.
pub(super) const COMPONENT: usize = 192;
/// An item of the build.
pub(super) const ITEM: usize = 256;

/// Counts what outlines take.
#[derive(Debug)]
pub(super) struct Budget {
    spent: usize,
    most: usize,
    /// Namespaces that were kept last.
    kept: Scopes,
}

impl Budget {
    /// For an archive of so many bytes.
    pub(super) fn of(archive: usize) -> Self {
        Self { spent: 0, most: MOST_BYTES.saturating_add(archive.saturating_mul(MOST_A_BYTE)), kept: Scopes::default() }
    }

    /// Counts a thing that takes so many bytes.
    pub(super) fn spend(&mut self, xml: &Xml<'_>, bytes: usize) -> Result<(), Rejection> {
        self.spent = self.spent.saturating_add(bytes);
        if self.spent > self.most {
            return Err(xml.refuse(format!("has too many objects: they take more than {} MiB", self.most >> 20)));
        }
        Ok(())
    }

    /// Counts namespaces that are kept, unless they are those that were kept before.
    pub(super) fn keep(&mut self, xml: &Xml<'_>, scopes: &Scopes) -> Result<(), Rejection> {
        if self.kept.is_shared(scopes) {
            return Ok(());
        }
        self.kept = scopes.clone();
        self.spend(xml, scopes.bytes())
    }
}
