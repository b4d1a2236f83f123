//! Opens a package: its start part, and the parts that it leads to.

use std::collections::{HashMap, HashSet};

use super::super::archive::{Archive, shown};
use super::super::finding::{Finding, Rejection};
use super::super::package::Opc;
use super::super::spool::Context;
use super::budget::Budget;
use super::model::{Content, Model, Part};
use super::outline;
use super::roles::Roles;
use crate::contract::error::Result;
use crate::util::words::Counted;

impl Model {
    /// Reads the outline of a package. Each part that is needed is unpacked into a spool.
    ///
    /// # Errors
    /// [`crate::Error::Unreadable`] with a reason that names the entry, the part or the object; [`crate::Error::NoSpace`], [`crate::Error::Io`].
    pub(crate) fn open(bytes: &[u8], context: &Context<'_>) -> Result<Self> {
        let reject = |rejection: Rejection| rejection.at(context.path);
        let archive = Archive::open(bytes).map_err(reject)?;
        let roles = Roles::read(&archive, context)?;
        let package = Opc::open(archive, context)?;
        let (mut parts, mut budget, mut by_name) = (Vec::new(), Budget::of(bytes.len()), HashMap::new());
        let start = package.start.clone();
        let mut known = HashSet::from([start.to_ascii_lowercase()]);
        let mut waiting = vec![start];
        while let Some(name) = waiting.pop() {
            let text = package.spooled(&name, context)?;
            let part = outline::read(&name, text, &mut budget).map_err(reject)?;
            let mut next = Vec::new();
            for path in paths(&part, parts.is_empty()) {
                if known.insert(path.to_ascii_lowercase()) {
                    let found = package.name_of(path).map(str::to_owned);
                    let missing = || format!("the part {} refers to {}, which is not in the package", shown(&name), shown(path));
                    next.push(found.ok_or_else(|| reject(Rejection::Unreadable(missing())))?);
                }
            }
            waiting.extend(next.into_iter().rev());
            by_name.insert(name.to_ascii_lowercase(), parts.len());
            parts.push(part);
        }
        let entries = package.entries().to_vec();
        let mut model = Self { entries, parts, by_name, signed: package.signed, findings: package.findings, roles };
        if model.parts.iter().any(|part| part.draft) {
            model.findings.push(Finding::flaw("a model of the draft 0.93 of 3MF"));
        }
        let mirrored = model.check_build().map_err(reject)?;
        if mirrored > 0 {
            let text = format!("{} of the build as mirror images", Counted(mirrored, "object", "objects"));
            model.findings.push(Finding { harmless: true, ..Finding::flaw(text) });
        }
        Ok(model)
    }
}

/// The parts that a part refers to, in order.
fn paths(part: &Part, with_build: bool) -> impl Iterator<Item = &str> {
    let of_objects = part.objects.iter().flat_map(|object| match &object.content {
        Content::Components(components) => components.as_slice(),
        _ => &[],
    });
    let items = if with_build { part.items.as_slice() } else { &[] };
    of_objects.chain(items.iter().map(|item| &item.component)).filter_map(|component| component.path.as_deref())
}
