//! An archive as a package.

use std::collections::BTreeSet;

use super::super::archive::{Archive, Entry, shown};
use super::super::finding::{Finding, Rejection};
use super::super::spool::{Context, Items};
use super::super::xml::Xml;
use super::part_name::{relationships_of, resolve};
use super::relationships::{self, Relationship};
use crate::contract::error::Result;

const CONTENT_TYPES: &str = "[Content_Types].xml";
const START: &str = "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel";
/// Where all writers put the start part.
const USUAL_START: &str = "3D/3dmodel.model";
const SIGNATURES: &str = "http://schemas.openxmlformats.org/package/2006/relationships/digital-signature/origin";
const ENCRYPTED: &str = "http://schemas.openxmlformats.org/package/2006/relationships/encryptedfile";
const KEYSTORE: &str = "http://schemas.microsoft.com/3dmanufacturing/2019/04/keystore";
const KEYSTORE_NAMESPACE: &str = "http://schemas.microsoft.com/3dmanufacturing/securecontent/2019/04";

/// A package.
pub(crate) struct Opc<'a> {
    archive: Archive<'a>,
    /// The name of the start part, as the archive has it.
    pub(crate) start: String,
    /// There are digital signatures, which no changed package keeps.
    pub(crate) signed: bool,
    /// Parts that are encrypted, in lower case.
    encrypted: BTreeSet<String>,
    pub(crate) findings: Vec<Finding>,
}

impl<'a> Opc<'a> {
    /// Reads what a package says of itself.
    ///
    /// # Errors
    /// Those of the archive, and [`crate::Error::Unreadable`] if there is no start part, or more than one.
    pub(crate) fn open(archive: Archive<'a>, context: &Context<'_>) -> Result<Self> {
        let reject = |rejection: Rejection| rejection.at(context.path);
        let mut findings = Vec::new();
        if archive.find(CONTENT_TYPES).is_none() {
            findings.push(Finding::flaw("the package does not say of which types its parts are"));
        }
        let root = relationships(&archive, "", context)?;
        let start = start(&archive, &root, &mut findings).map_err(reject)?;
        let mut package = Self { archive, start, signed: false, encrypted: BTreeSet::new(), findings };
        package.signed = root.iter().any(|relationship| relationship.kind == SIGNATURES);
        package.note_encrypted("", &root);
        for keystore in root.iter().filter(|relationship| relationship.kind == KEYSTORE && !relationship.external) {
            package.read_keystore(&keystore.target, context)?;
        }
        Ok(package)
    }

    /// The entries of the archive, in its order.
    pub(crate) fn entries(&self) -> &[Entry] {
        &self.archive.entries
    }

    /// The relationships of a part, none if it has none.
    pub(crate) fn relationships(&mut self, part: &str, context: &Context<'_>) -> Result<Vec<Relationship>> {
        let found = relationships(&self.archive, part, context)?;
        self.note_encrypted(part, &found);
        Ok(found)
    }

    /// The content of a part, in a spool.
    ///
    /// # Errors
    /// [`crate::Error::Unreadable`] if it is not there or encrypted; those of [`Archive::spooled`].
    pub(crate) fn spooled(&self, part: &str, context: &Context<'_>) -> Result<Items<1>> {
        let refuse = |reason: &str| Rejection::Unreadable(format!("the part {} {reason}", shown(part))).at(context.path);
        if self.encrypted.contains(&part.to_ascii_lowercase()) {
            return Err(refuse("is encrypted (3MF Secure Content)"));
        }
        let entry = self.archive.find(part).filter(|entry| !entry.is_folder());
        self.archive.spooled(entry.ok_or_else(|| refuse("is not in the package"))?, context)
    }

    /// The name of a part as the archive has it, if it is there.
    pub(crate) fn name_of(&self, part: &str) -> Option<&str> {
        self.archive.find(part).filter(|entry| !entry.is_folder()).map(|entry| entry.name.as_str())
    }

    fn note_encrypted(&mut self, source: &str, found: &[Relationship]) {
        let targets = found.iter().filter(|relationship| relationship.kind == ENCRYPTED && !relationship.external);
        self.encrypted.extend(targets.filter_map(|to| resolve(source, &to.target)).map(|name| name.to_ascii_lowercase()));
    }

    /// Notes the parts that a keystore has keys for.
    fn read_keystore(&mut self, target: &str, context: &Context<'_>) -> Result<()> {
        let reject = |rejection: Rejection| rejection.at(context.path);
        let Some(entry) = resolve("", target).and_then(|name| self.archive.find(&name)) else { return Ok(()) };
        let text = self.archive.small(entry, context)?;
        let mut xml = Xml::of(&entry.name, &text).map_err(reject)?;
        let mut encrypted = Vec::new();
        loop {
            match xml.next().map_err(reject)? {
                super::super::xml::Node::Start(element) if element.is(KEYSTORE_NAMESPACE, "resourcedata") => {
                    let path = element.plain("path").map_err(|reason| reject(xml.refuse_element(&element, reason)))?;
                    encrypted.extend(path.and_then(|path| resolve("", &path)).map(|name| name.to_ascii_lowercase()));
                }
                super::super::xml::Node::Over => break,
                _ => {}
            }
        }
        self.encrypted.extend(encrypted);
        Ok(())
    }
}

/// The relationships of a part, or of the package.
fn relationships(archive: &Archive<'_>, part: &str, context: &Context<'_>) -> Result<Vec<Relationship>> {
    let Some(entry) = archive.find(&relationships_of(part)) else { return Ok(Vec::new()) };
    let text = archive.small(entry, context)?;
    relationships::read(&entry.name, &text).map_err(|rejection| rejection.at(context.path))
}

/// The start part: 3MF Core 2.1 says that there is one relationship to it.
fn start(archive: &Archive<'_>, root: &[Relationship], findings: &mut Vec<Finding>) -> std::result::Result<String, Rejection> {
    let refuse = |reason: String| Err(Rejection::Unreadable(reason));
    let mut targets: Vec<&str> =
        root.iter().filter(|relationship| relationship.kind == START).map(|found| found.target.as_str()).collect();
    targets.dedup();
    if root.iter().any(|relationship| relationship.kind == START && relationship.external) {
        return refuse("the model of this 3MF package lies outside of it".into());
    }
    let target = match targets.as_slice() {
        [target] => resolve("", target).unwrap_or_default(),
        [] if archive.find(USUAL_START).is_some() => {
            findings.push(Finding::flaw("the package does not say which part its model is; read as usual"));
            USUAL_START.into()
        }
        [] => return refuse("a ZIP archive, but no 3MF package: no part is said to be its model".into()),
        _ => return refuse(format!("{} parts are said to be the model of this 3MF package", targets.len())),
    };
    match archive.find(&target) {
        Some(entry) if !entry.is_folder() => Ok(entry.name.clone()),
        _ => refuse(format!("the model of this 3MF package, {}, is not in it", shown(&target))),
    }
}
