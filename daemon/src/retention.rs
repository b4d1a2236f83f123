//! What goes by itself, so that a farm's disk does not fill: results and reports by age and size, records of jobs by age and number, and
//! originals never, but to an archive, once a copy there was read back and compared.
//!
//! [`stock`] what may go · [`plan`] what of it is to, and why · [`crate::remove`], [`archive`] how a file goes · [`history`] which records go ·
//! [`sweep`] all of that, in [`turns`] · [`command`] says what would go.

mod archive;
pub(crate) mod command;
mod history;
mod plan;
mod stock;
pub(crate) mod sweep;
pub(crate) mod turns;
