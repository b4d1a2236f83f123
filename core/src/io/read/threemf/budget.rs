//! What outlines of a package take, counted.

use super::super::finding::Rejection;
use super::super::xml::Xml;

/// Bytes that outlines of a package take, at most: a small archive unpacks to very many empty objects.
const MOST_BYTES: usize = 256 << 20;
/// Counts what outlines take.
#[derive(Debug, Default)]
pub(super) struct Budget {
    spent: usize,
}

impl Budget {
    /// Counts a thing with these strings.
    pub(super) fn spend(&mut self, xml: &Xml<'_>, strings: usize) -> Result<(), Rejection> {
        self.spent = self.spent.saturating_add(strings).saturating_add(512);
        if self.spent > MOST_BYTES {
            return Err(xml.refuse(format!("has too many objects: they take more than {} MiB", MOST_BYTES >> 20)));
        }
        Ok(())
    }
}
