//! An archive as a package.

use super::super::archive::{Archive, Entry, shown};
use super::super::finding::{Finding, Rejection};
use super::super::spool::{Context, Items};
use super::part_name::{relationships_of, resolve};
use super::relationships::{self, Relationship};
use crate::contract::error::Result;

const CONTENT_TYPES: &str = "[Content_Types].xml";
const START: &str = "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel";
/// Where all writers put the start part.
const USUAL_START: &str = "3D/3dmodel.model";
const SIGNATURES: &str = "http://schemas.openxmlformats.org/package/2006/relationships/digital-signature/origin";
/// Every part that is encrypted begins with this (3MF Secure Content 1.0.2, 2.3), whatever the relationships and the keystore say.
const ENCRYPTED: &[u8] = b"%3McF";

/// A package.
pub(crate) struct Opc<'a> {
    archive: Archive<'a>,
    /// The name of the start part, as the archive has it.
    pub(crate) start: String,
    /// There are digital signatures, which no changed package keeps.
    pub(crate) signed: bool,
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
        let has = |kind: &str| root.iter().any(|relationship| relationship.kind == kind);
        Ok(Self { signed: has(SIGNATURES), archive, start, findings })
    }

    /// The entries of the archive, in its order.
    pub(crate) fn entries(&self) -> &[Entry] {
        &self.archive.entries
    }

    /// The content of a part, in a spool.
    ///
    /// # Errors
    /// [`crate::Error::Unreadable`] if it is not there or encrypted; those of [`Archive::spooled`].
    pub(crate) fn spooled(&self, part: &str, context: &Context<'_>) -> Result<Items<1>> {
        let refuse = |reason: &str| Rejection::Unreadable(format!("the part {} {reason}", shown(part))).at(context.path);
        let entry = self.archive.find(part).filter(|entry| !entry.is_folder());
        let content = self.archive.spooled(entry.ok_or_else(|| refuse("is not in the package"))?, context)?;
        if content.all().as_flattened().starts_with(ENCRYPTED) {
            return Err(refuse("is encrypted (3MF Secure Content)"));
        }
        Ok(content)
    }

    /// The name of a part as the archive has it, if it is there.
    pub(crate) fn name_of(&self, part: &str) -> Option<&str> {
        self.archive.find(part).filter(|entry| !entry.is_folder()).map(|entry| entry.name.as_str())
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
