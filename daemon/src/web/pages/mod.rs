//! Pages for people: what needs them, what goes on, what became of each file. Made here, whole, so that they need no script; what a script adds is that they are
//! current without being asked for again, and a view that can be turned. Whatever a file is called is text.

use std::sync::Arc;

use axum::routing::{MethodRouter, get, post};

use super::shared::Shared;

mod actions;
mod assets;
mod frame;
mod history;
mod hosts;
mod job;
mod login;
mod night;
mod places;

pub(super) use frame::{ForPeople, sorry};
pub(super) use login::{ASSETS, LOGIN, lead};

/// Each path with what can be done there.
pub(super) fn all() -> Vec<(&'static str, MethodRouter<Arc<Shared>>)> {
    vec![
        ("/", get(night::night)),
        ("/jobs", get(history::history)),
        ("/jobs/{id}", get(job::job)),
        ("/jobs/{id}/{action}", post(actions::act)),
        ("/hosts/{action}", post(hosts::act)),
        (LOGIN, get(login::form).post(login::login)),
        ("/logout", post(login::logout)),
        ("/assets/{*name}", get(assets::asset)),
    ]
}
