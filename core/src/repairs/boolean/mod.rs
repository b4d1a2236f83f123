//! Closed surfaces that cross each other become one, and what lies inside of others goes.

pub(crate) mod cells;
pub(crate) mod clusters;
pub(crate) mod cut;
pub(crate) mod dust;
pub(crate) mod enclosed;
pub(crate) mod hidden;
pub(crate) mod meetings;
pub(crate) mod passes;
pub(crate) mod perturb;
pub(crate) mod refill;
pub(crate) mod resolve;
pub(crate) mod rounds;
pub(crate) mod select;
pub(crate) mod snap;
pub(crate) mod state;
pub(crate) mod track;
