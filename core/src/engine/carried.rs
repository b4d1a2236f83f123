//! What a file says besides positions and faces, on its way into the result.

use std::collections::BTreeSet;
use std::path::Path;

use rayon::prelude::*;

use super::copying;
use super::files::{self, Made};
use crate::contract::error::{Error, Result};
use crate::contract::hint::{Hint, HintKind};
use crate::contract::progress::Progress;
use crate::contract::report::{AttributesKept, FaceOrigin, Outcome, Report};
use crate::contract::settings::{KeepAttributes, Limits, Profile};
use crate::geometry::position;
use crate::io::read::MeshFile;
use crate::io::record::{self, Record};
use crate::io::rows::Said;
use crate::io::write_behind::WriteBehind;
use crate::output::edit::Edit;
use crate::output::emit;
use crate::output::model::{Account, Change};
use crate::output::rows::Planned;
use crate::util::words;

/// The fate of what a file says, where it says anything. `planned`: it is written into the file's own rows.
pub(crate) fn account(said: &Said<'_>, planned: Option<&Planned<'_>>, triangles: usize) -> Option<Account> {
    match (said, planned) {
        (Said::Nothing, _) => None,
        (_, Some(planned)) => Some(planned.account),
        (said, None) => Some(Account { lost: said.triangles(triangles), ..Account::default() }),
    }
}

/// The fate of the attribute words of an STL that is an STL again, where one of them is touched or the profile asks. O(edit), and O(n) then.
pub(crate) fn words_account(mesh: &MeshFile, edit: &Edit, profile: &Profile) -> Option<Account> {
    let records = mesh.records();
    let has_word = |record: &Record| record::attribute(record) != 0;
    let gone = edit.deleted_where(|t| records.get(t as usize).is_some_and(has_word));
    let new: Vec<FaceOrigin> = edit.added_with_origins().filter(|(record, _)| has_word(record)).map(|(_, from)| from).collect();
    // Nearly all files have no word but 0.
    if gone.is_empty() && new.is_empty() && profile.attributes == KeepAttributes::Best {
        return None;
    }
    let parents: BTreeSet<u32> = edit.added_with_origins().filter_map(|(_, from)| from.input_face()).collect();
    let divided = new.iter().filter(|from| from.input_face().is_some()).count() as u64;
    let words = records.par_iter().filter(|record| has_word(record)).count() as u64;
    let account = Account {
        kept: words - gone.len() as u64,
        divided,
        approximated: 0,
        inherited: new.len() as u64 - divided,
        lost: gone.iter().filter(|t| !parents.contains(t)).count() as u64,
    };
    (account != Account::default()).then_some(account)
}

/// How the file is written in its own rows, where it can be.
pub(crate) fn plan<'p>(said: &'p Said<'_>, made: &'p Made) -> Option<Planned<'p>> {
    let Said::Rows(rows) = said else { return None };
    Planned::of(&**rows, Change { came: made.mesh.as_it_came(), now: made.mesh.records(), edit: &made.edit })
}

/// Does what the profile says of attributes that are lost or only about right: `harm` names them. `false`: nothing is to be written.
pub(crate) fn heed(report: &mut Report, profile: &Profile, harm: Option<String>) -> bool {
    report.hints.retain(|hint| hint.kind != HintKind::Attributes);
    let Some(harm) = harm else { return true };
    match profile.attributes {
        KeepAttributes::Refuse => {
            report.outcome = Outcome::NotGood;
            report.verdict.good = false;
            report.verdict.reasons.insert(0, format!("{harm}: the profile `{}` refuses that", profile.name));
            (report.output, report.certificate) = (None, None);
            return false;
        }
        KeepAttributes::Keep => ask_for_review(report, harm),
        KeepAttributes::Best => {
            let lost = report.attributes.as_ref().map_or(0, |own| own.lost);
            let text = format!("colours, paint or other attributes of {} are lost", words::triangles(lost));
            report.hints.extend((lost > 0).then_some(Hint { kind: HintKind::Attributes, text }));
        }
    }
    true
}

/// Asks a person to look at a result that is good, or that somebody has to look at anyway.
pub(crate) fn ask_for_review(report: &mut Report, reason: String) {
    if report.outcome.is_good() || report.outcome == Outcome::NeedsReview {
        report.outcome = Outcome::NeedsReview;
        report.verdict.reasons.insert(0, reason);
    }
}

/// Asks a person to look at a result that is no copy, if there is a doubt.
pub(crate) fn ask_if_doubtful(report: &mut Report, doubt: Option<&str>) {
    if let Some(reason) = doubt.filter(|_| report.outcome == Outcome::Repaired) {
        ask_for_review(report, reason.into());
    }
}

/// The harm that an account tells of.
pub(crate) fn harm(account: Account) -> Option<String> {
    let harmed = account.lost + account.approximated;
    let words = || format!("colours, paint or other attributes of {} are lost or only about right", words::triangles(harmed));
    (harmed > 0).then(words)
}

/// Writes the new file `output`, and opens it.
///
/// # Errors
/// [`Error::Io`], cancellation among them.
pub(crate) fn write(planned: &Planned<'_>, output: &Path, limits: &Limits, progress: &dyn Progress) -> Result<MeshFile> {
    let file = emit::create(output).map_err(Error::io(output, "creating"))?;
    let behind = WriteBehind::new(&file, limits).map_err(Error::io(output, "creating"))?;
    planned.write(&mut |bytes| {
        if progress.cancelled() {
            return Err(Error::cancelled(output, "writing"));
        }
        behind.append(bytes).map_err(Error::io(output, "writing"))
    })?;
    behind.finish().map_err(Error::io(output, "syncing"))?;
    if !limits.defer_sync {
        file.sync_all().map_err(Error::io(output, "syncing"))?;
    }
    files::open(output, limits, progress)
}

/// Does the written file hold the triangles of `result`, in its own order? O(n).
///
/// # Errors
/// [`Error::Io`] if not.
pub(crate) fn confirm(planned: &Planned<'_>, result: &MeshFile, written: &MeshFile) -> Result<()> {
    let mut rest = written.records();
    let mut holds = written.is_flawless();
    for range in planned.order() {
        let made = result.records().get(range.start as usize..range.end as usize).unwrap_or_default();
        let Some((there, behind)) = rest.split_at_checked(made.len()).filter(|_| holds) else {
            holds = false;
            break;
        };
        rest = behind;
        holds = made
            .iter()
            .zip(there)
            .all(|(a, b)| position::corners(a).map(position::bits) == position::corners(b).map(position::bits));
    }
    if holds && rest.is_empty() && written.records().len() == result.records().len() {
        return Ok(());
    }
    Err(copying::differs(written.path()))
}

impl Account {
    /// For the report.
    pub(crate) fn told(self) -> AttributesKept {
        let Self { kept, divided, approximated, inherited, lost } = self;
        AttributesKept { kept, divided, approximated, inherited, lost }
    }
}

#[cfg(test)]
mod tests;
