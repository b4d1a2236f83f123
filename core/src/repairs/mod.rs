//! Repairs: the submesh of a file is changed until the file is printable, as far as the profile allows.
//!
//! **In:** a [`Diagnosis`].
//! **Out:** the submesh as it is to be written, and an [`Account`] of what was done and where.
//! **Promise:** a repair changes triangles of the submesh by way of `work` only, and turns or drops regions of regular surface as a whole;
//! what it may change stands in its entry. What is not proved valid is taken back.
//!
//! [`pipeline`] lists the repairs in their order; `context` says what a repair may know and what it hands on. Each repair has a file,
//! with its entry for the list at the top.

mod boolean;
mod cleanup;
mod holes;
mod orient;
mod pipeline;
mod rebuild;
mod separate;
mod shared;
mod stitch;
mod wrap;

use std::path::Path;

use crate::contract::error::Result;
use crate::contract::progress::{Latched, Progress};
use crate::contract::report::{BoundaryLoops, Region, Regions};
use crate::contract::settings::{Limits, Profile};
use crate::diagnosis::Diagnosis;
pub(crate) use crate::repairs::cleanup::duplicates::NOTE as DUPLICATE_NOTE;
pub(crate) use crate::repairs::orient::directions::NOTE as ORIENT_NOTE;
pub(crate) use crate::repairs::shared::account::Account;
use crate::repairs::shared::context::Context;
pub(crate) use crate::repairs::stitch::weld::NOTE as WELD_NOTE;
use crate::submesh::components::Reversed;

/// The repairs that are made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Steps {
    /// Everything that the profile allows.
    All,
    /// Boundary loops are closed: all, or the one through this place.
    Fill(Option<[f32; 3]>),
    /// Triangles are turned.
    Orient,
    /// Bodies are united.
    Union,
    /// Regions that are no solid are replaced.
    Wrap,
}

impl Steps {
    fn list(self) -> &'static [pipeline::Step] {
        match self {
            Self::All => pipeline::ALL,
            Self::Fill(_) => pipeline::FILL,
            Self::Orient => pipeline::ORIENT,
            Self::Union => pipeline::UNION,
            Self::Wrap => pipeline::WRAP,
        }
    }
}

/// The account of all repairs; the mesh itself is in the diagnosis' submesh.
pub(crate) struct Repaired {
    pub(crate) reversed: Reversed,
    pub(crate) account: Account,
    pub(crate) regions: Regions,
    /// Triangles that replace others and are not in the submesh.
    pub(crate) wrapped: Vec<[[f32; 3]; 3]>,
}

/// Makes these repairs, as far as the profile allows.
///
/// # Errors
/// [`Error::Starved`](crate::Error::Starved) when there is not memory enough.
pub(crate) fn run(
    diagnosis: &mut Diagnosis<'_>,
    steps: Steps,
    path: &Path,
    profile: &Profile,
    limits: &Limits,
    progress: &dyn Progress,
) -> Result<Repaired> {
    let progress = Latched::new(progress);
    let mut cx = Context::of(diagnosis, path, profile, limits, &progress);
    if let Steps::Fill(only_loop) = steps {
        cx.handed.only_loop = only_loop;
    }
    pipeline::take_all(steps.list(), &mut cx)?;
    let Context { reversed, mut account, mut handed, .. } = cx;
    let mut all = std::mem::take(&mut account.regions);
    all.extend(account.sheets.iter().map(Region::from));
    let unsettled = std::mem::take(&mut handed.unsettled);
    all.extend(unsettled.into_iter().filter(|left| !handed.is_replaced(left.at)).map(|left| left.region));
    all.extend(account.wraps.iter().map(Region::from));
    Ok(Repaired { reversed, account, regions: shared::region_report::summarise(all), wrapped: handed.wrapped })
}

/// The boundary loops of a file, with their kinds, as they are when surplus surface is gone and vertices within the weld tolerance are one, which
/// the submesh is brought to.
///
/// # Errors
/// None as yet; those of repairs.
pub(crate) fn recognise(
    diagnosis: &mut Diagnosis<'_>,
    path: &Path,
    profile: &Profile,
    limits: &Limits,
    progress: &dyn Progress,
) -> Result<BoundaryLoops> {
    if diagnosis.defects.boundary_edges == 0 {
        return Ok(BoundaryLoops::default());
    }
    let mut cx = Context::of(diagnosis, path, profile, limits, progress);
    pipeline::take(pipeline::RECOGNITION, &mut cx)?;
    Ok(cx.account.loops.unwrap_or_default())
}
