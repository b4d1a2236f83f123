//! What every [`JobStore`](crate::JobStore) must do, as one suite; and the small things that tests of store and daemon need.

use std::sync::Arc;

use crate::id::{Clock, Time};
use crate::store::StoreError;

mod chance;
mod claims;
mod deaths;
mod history;
mod notices;
mod pages;
mod past;
mod results;
pub mod server;
mod tools;
mod turns;

#[cfg(feature = "testkit")]
pub use crate::crash::at_crash_points;
pub use chance::Chance;
pub use tools::{ManualClock, Subject, dropped, result_of};

type Check = fn(&mut dyn Subject, &ManualClock) -> Result<(), StoreError>;

/// Runs every check on a fresh store from `make`.
///
/// # Panics
/// When the store does not do what [`JobStore`](crate::JobStore) promises.
pub fn conformance(make: &dyn Fn(Arc<dyn Clock>) -> Box<dyn Subject>) {
    let checks: [(&str, Check); 33] = [
        ("submission is idempotent", claims::submission_is_idempotent),
        ("a file that came back is new", claims::a_file_that_came_back_is_new),
        ("a file that may be gone is looked at again", claims::a_file_that_may_be_gone_is_looked_at_again),
        ("what was only noticed may be wanted later", claims::what_was_only_noticed_may_be_wanted_later),
        ("the oldest that fits is claimed", claims::the_oldest_that_fits_is_claimed),
        ("the more urgent goes first", claims::the_more_urgent_goes_first),
        ("the whole way", claims::the_whole_way),
        ("claims are fenced", claims::claims_are_fenced),
        ("folders take turns", turns::folders_take_turns),
        ("a folder has no more in work than it may", turns::a_folder_has_no_more_in_work_than_it_may),
        ("pauses are kept", claims::pauses_are_kept),
        ("a sampled job keeps its witness", claims::a_sampled_job_keeps_its_witness),
        ("a crash is retried once", deaths::a_crash_is_retried_once),
        ("the operator's wishes", deaths::the_operators_wishes),
        ("death of the daemon", deaths::death_of_the_daemon),
        ("suspects run alone", deaths::suspects_run_alone),
        ("who ran beside a killer is innocent", deaths::who_ran_beside_a_killer_is_innocent),
        ("power cuts blame no one", deaths::power_cuts_blame_no_one),
        ("a result that cannot be placed is parked", results::a_result_that_cannot_be_placed_is_parked),
        ("good results are found by what made them", results::good_results_are_found_by_what_made_them),
        ("results on their way are finished", results::results_on_their_way_are_finished),
        ("lists and counts agree", results::lists_and_counts_agree),
        ("pages are the latest first", pages::pages_are_the_latest_first),
        ("a file's latest job is found", pages::a_files_latest_job_is_found),
        ("threads get different jobs", results::threads_get_different_jobs),
        ("what is at rest can be forgotten", history::what_is_at_rest_can_be_forgotten),
        ("forgetting one job leaves the next of its file", history::forgetting_one_job_leaves_the_next_of_its_file),
        ("ends are told until they are acknowledged", notices::ends_are_told_until_they_are_acknowledged),
        ("notices outlive what becomes of their jobs", notices::notices_outlive_what_becomes_of_their_jobs),
        ("news are told once", notices::news_are_told_once),
        ("who does not subscribe costs nothing", notices::who_does_not_subscribe_costs_nothing),
        ("a new store says so", past::a_new_store_says_so),
        ("jobs of an earlier store come back", past::jobs_of_an_earlier_store_come_back),
    ];
    for (name, check) in checks {
        let clock = Arc::new(ManualClock::new(Time(1_000_000)));
        let mut subject = make(Arc::<ManualClock>::clone(&clock));
        if let Err(error) = check(subject.as_mut(), &clock) {
            panic!("{name}: {error}");
        }
    }
}
