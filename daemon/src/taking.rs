//! Taking a file that was handed over. For files of a program's own that have their place already, the job is looked for first: the scan may have been
//! faster, and the job may have ended since.

use suture_store::{StoreError, Submitted};

use crate::attempt::Context;
use crate::handed::{Handed, Untaken};
use crate::orders::Orders;
use crate::scan::Reconciler;

/// Takes it, and answers.
///
/// # Errors
/// When the store failed.
pub(crate) fn take(
    context: &Context,
    reconciler: &mut Reconciler,
    orders: &mut Orders,
    handed: Handed,
) -> Result<(), StoreError> {
    let (answer, failed) = match submit(context, reconciler, orders, &handed) {
        Ok(answer) => (answer, None),
        Err(error) if error.is_callers() => (Err(Untaken::Refused(error.to_string())), None),
        Err(error) => (Err(Untaken::Unavailable("the job store failed; try again".into())), Some(error)),
    };
    if answer.as_ref().is_ok_and(|submitted| submitted.new) {
        context.schedule.news();
    }
    handed.answer(answer);
    failed.map_or(Ok(()), Err)
}

fn submit(
    context: &Context,
    reconciler: &mut Reconciler,
    orders: &mut Orders,
    handed: &Handed,
) -> Result<Result<Submitted, Untaken>, StoreError> {
    let mut submission = match reconciler.hand_over(handed) {
        Ok(submission) => submission,
        Err(untaken) => return Ok(Err(untaken)),
    };
    if handed.placed.is_some() {
        if let Some(id) = context.store.find(&submission.source)? {
            return Ok(Ok(Submitted { id, new: false, ended: false }));
        }
        match reconciler.is_there(&submission.source) {
            Ok(true) => {}
            Ok(false) => return Ok(Err(Untaken::Missing)),
            Err(error) => return Ok(Err(Untaken::Unavailable(format!("the file cannot be looked at: {error}")))),
        }
    }
    submission.priority = handed.priority.unwrap_or(submission.priority);
    let answers = context.store.submit(std::slice::from_ref(&submission))?;
    let Some(submitted) = answers.first().copied() else { return Ok(Err(Untaken::Missing)) };
    reconciler.known(&submission.source, submitted.id, submitted.new.then_some(submission.priority));
    orders.came(&submission.source.path, submitted.id, context.world.steady());
    Ok(Ok(submitted))
}
