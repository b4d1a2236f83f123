//! `GET /metrics`: what was counted, and how things stand now, in the text format that Prometheus reads.

use std::path::Path;
use std::sync::Arc;

use axum::extract::State;
use axum::http::header::CONTENT_TYPE;
use axum::response::{IntoResponse, Response};
use suture_store::job::Kind;
use suture_store::{Clock, Query, StoreError, SystemClock};

use crate::attempt::Context;
use crate::event_metrics::{Label, head, sample, written};
use crate::fsx;
use crate::glance::size_of;
use crate::hosts;

use super::ask::ask;
use super::problem::Problem;
use super::shared::Shared;

/// `GET /metrics`.
pub(super) async fn metrics(State(shared): State<Arc<Shared>>) -> Result<Response, Problem> {
    let text = ask(&shared.context, |context| {
        let mut text = context.bus.metrics.text();
        jobs(&mut text, context)?;
        hosts(&mut text, context)?;
        targets(&mut text, context)?;
        folders(&mut text, context);
        process(&mut text, context);
        Ok(text)
    })
    .await?;
    Ok(([(CONTENT_TYPE, "text/plain; version=0.0.4; charset=utf-8")], text).into_response())
}

/// A family of values, as they are now.
fn gauge<'a>(text: &mut String, words: (&str, &str), values: impl IntoIterator<Item = (Vec<Label<'a>>, f64)>) {
    head(text, words, "gauge");
    values.into_iter().for_each(|(labels, value)| sample(text, words.0, &written(&labels), value));
}

fn jobs(text: &mut String, context: &Context) -> Result<(), Problem> {
    let counts = context.store.counts()?;
    let of_states = counts.iter().map(|(kind, count)| (vec![("state", kind.name())], *count as f64));
    gauge(text, ("suture_jobs", "Jobs in each state."), of_states);
    let kinds = vec![Kind::Queued, Kind::Waiting, Kind::Alone];
    let oldest = context.store.list(&Query { kinds, limit: 1, ..Query::default() })?;
    let waits = oldest.first().map_or(0, |job| SystemClock.now().0.saturating_sub(job.waits_since().0));
    let words = ("suture_queue_oldest_seconds", "How long the oldest job that waits has waited.");
    gauge(text, words, [(vec![], waits as f64 / 1000.0)]);
    let busy = context.schedule.computing();
    let idle = context.settings.now().workers.saturating_sub(busy);
    let of_workers = [(vec![("state", "busy")], busy as f64), (vec![("state", "idle")], idle as f64)];
    gauge(text, ("suture_workers", "Workers in each state."), of_workers);
    Ok(())
}

fn hosts(text: &mut String, context: &Context) -> Result<(), Problem> {
    let all = hosts::all(context)?;
    let of = |state: &'static str| all.iter().filter(|host| hosts::state(host) == state).count() as f64;
    gauge(
        text,
        ("suture_hosts", "Daemons that share the store, in each state."),
        hosts::STATES.map(|state| (vec![("state", state)], of(state))),
    );
    let works: u64 = all.iter().filter(|host| host.works()).map(|host| u64::from(host.station.workers)).sum();
    gauge(text, ("suture_farm_workers", "Workers of all hosts that take jobs."), [(vec![], works as f64)]);
    Ok(())
}

fn targets(text: &mut String, context: &Context) -> Result<(), Problem> {
    let config = context.settings.now();
    let pending = config.events.names().map(|name| Ok((vec![("target", name)], context.store.backlog(name)? as f64)));
    let pending = pending.collect::<Result<Vec<_>, StoreError>>()?;
    gauge(text, ("suture_webhook_pending", "Ends of jobs that a target was not told of yet."), pending);
    Ok(())
}

fn folders(text: &mut String, context: &Context) {
    let all = || context.folders.iter().map(|folder| (vec![("folder", folder.name.as_str())], folder));
    let reached: Vec<bool> = context.folders.iter().map(|folder| folder.check().is_ok()).collect();
    let up = all().zip(&reached).map(|((labels, _), reached)| (labels, f64::from(u8::from(*reached))));
    gauge(text, ("suture_folder_up", "Is the hot folder within reach?"), up);
    let scans = || all().filter_map(|(labels, folder)| Some((labels, context.pulse.scan_of(&folder.name)?)));
    let took = scans().map(|(labels, scan)| (labels, scan.took.as_secs_f64()));
    gauge(text, ("suture_folder_scan_seconds", "How long the last look at the folder took."), took);
    let words = ("suture_folder_last_scan_timestamp_seconds", "When the folder was looked at last.");
    gauge(text, words, scans().map(|(labels, scan)| (labels, scan.at.0 as f64 / 1000.0)));
    let config = context.settings.now();
    let free = |path: &Path| fsx::free_space(path, 0) as f64;
    // Results may lie on a disk of their own.
    // A folder that answers nothing would be waited for without end.
    let of_folders = context.folders.iter().zip(&reached).filter(|(_, reached)| **reached).flat_map(|(folder, _)| {
        let of = |role, path: &Path| (vec![("role", role), ("folder", folder.name.as_str())], free(path));
        [of("folder", &folder.root), of("results", &folder.out())]
    });
    let of_state = [(vec![("role", "state")], free(&config.state))];
    gauge(text, ("suture_disk_free_bytes", "Free space on the disks."), of_folders.chain(of_state));
    gauge(text, ("suture_store_size_bytes", "Size of the job store."), [(vec![], size_of(&config.state) as f64)]);
}

fn process(text: &mut String, context: &Context) {
    let build = vec![("version", env!("CARGO_PKG_VERSION"))];
    gauge(text, ("suture_build_info", "The program."), [(build, 1.0)]);
    let words = ("process_start_time_seconds", "When this life of the daemon began.");
    gauge(text, words, [(vec![], context.bus.life as f64 / 1000.0)]);
    // Values that the system does not tell are left out.
    let read = |name: &str| std::fs::read_to_string(Path::new("/proc/self").join(name)).unwrap_or_default();
    let statm = read("statm");
    let mut pages = statm.split(' ').map(|pages| pages.parse::<u64>().ok());
    let page = rustix::param::page_size() as f64;
    let memory = |pages: Option<Option<u64>>| pages.flatten().map(|pages| (vec![], pages as f64 * page));
    gauge(text, ("process_virtual_memory_bytes", "Virtual memory of the daemon."), memory(pages.next()));
    gauge(text, ("process_resident_memory_bytes", "Resident memory of the daemon."), memory(pages.next()));
    let open = std::fs::read_dir("/proc/self/fd").map(|files| files.count()).ok();
    gauge(text, ("process_open_fds", "Open files of the daemon."), open.map(|open| (vec![], open as f64)));
    let stat = read("stat");
    // Behind the name in brackets: user and system time are the twelfth and thirteenth.
    let ticks: Vec<u64> =
        stat.rsplit(") ").next().unwrap_or_default().split(' ').skip(11).take(2).filter_map(|n| n.parse().ok()).collect();
    let seconds = ticks.iter().sum::<u64>() as f64 / rustix::param::clock_ticks_per_second() as f64;
    let words = ("process_cpu_seconds_total", "Processor time of the daemon, without its workers.");
    head(text, words, "counter");
    sample(text, words.0, "", seconds);
}
