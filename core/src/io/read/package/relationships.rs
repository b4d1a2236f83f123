//! Relationships of a package or of a part.

use super::super::finding::Rejection;
use super::super::xml::Xml;

const NAMESPACE: &str = "http://schemas.openxmlformats.org/package/2006/relationships";
/// Relationships of one part, at most.
const MOST: usize = 65_536;

/// One relationship.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Relationship {
    /// A URI.
    pub(crate) kind: String,
    /// The target as it stands.
    pub(crate) target: String,
    /// It leads out of the package.
    pub(crate) external: bool,
}

/// Reads a part of relationships. Memory: that of the part.
pub(super) fn read(part: &str, text: &[u8]) -> Result<Vec<Relationship>, Rejection> {
    let mut xml = Xml::of(part, text)?;
    let mut found = Vec::new();
    let Some(root) = xml.child()? else { return Err(xml.refuse("is empty")) };
    if !root.is(NAMESPACE, "Relationships") {
        return Err(xml.refuse("holds no relationships"));
    }
    while let Some(element) = xml.child()? {
        if element.is(NAMESPACE, "Relationship") {
            let value = |name: &str| element.plain(name).map_err(|reason| xml.refuse_element(&element, reason));
            let [kind, target, mode] = [value("Type")?, value("Target")?, value("TargetMode")?];
            if let (Some(kind), Some(target)) = (kind, target) {
                let external = mode.as_deref() == Some("External");
                found.push(Relationship { kind: kind.into_owned(), target: target.into_owned(), external });
            }
            if found.len() > MOST {
                return Err(xml.refuse("has too many relationships"));
            }
        }
        xml.skip()?;
    }
    Ok(found)
}
