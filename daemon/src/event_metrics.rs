//! Counters and histograms, in the text format that Prometheus reads. Names and labels are few and fixed: a file's name is never one of them.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Numbers that only grow.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Count {
    JobsFinished,
    JobFailures,
    JobAttempts,
    InputBytes,
    OutputBytes,
    Triangles,
    DefectsFound,
    DefectsLeft,
    StoreErrors,
    StoreRecoveries,
    EventsLost,
    Deliveries,
    Samples,
}

/// Measurements that are made again and again.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Timing {
    JobDuration,
    WorkerMaxRss,
    StoreFlush,
}

impl Count {
    const ALL: [Self; 13] = [
        Self::JobsFinished,
        Self::JobFailures,
        Self::JobAttempts,
        Self::InputBytes,
        Self::OutputBytes,
        Self::Triangles,
        Self::DefectsFound,
        Self::DefectsLeft,
        Self::StoreErrors,
        Self::StoreRecoveries,
        Self::EventsLost,
        Self::Deliveries,
        Self::Samples,
    ];

    fn words(self) -> (&'static str, &'static str) {
        match self {
            Self::JobsFinished => ("suture_jobs_finished_total", "Jobs that came to their end, by folder, profile and result."),
            Self::JobFailures => ("suture_job_failures_total", "Attempts and jobs that failed, by reason."),
            Self::JobAttempts => ("suture_job_attempts_total", "Attempts that were begun."),
            Self::InputBytes => ("suture_input_bytes_total", "Bytes of the originals of jobs that came to their end."),
            Self::OutputBytes => ("suture_output_bytes_total", "Bytes of meshes that were written."),
            Self::Triangles => ("suture_triangles_total", "Triangles that were read and written."),
            Self::DefectsFound => ("suture_defects_found_total", "Defects found in inputs, by kind."),
            Self::DefectsLeft => ("suture_defects_left_total", "Defects left in outputs, by kind."),
            Self::StoreErrors => ("suture_store_errors_total", "Errors of the job store."),
            Self::StoreRecoveries => (
                "suture_store_recoveries_total",
                "How often the job store came back after damage, loss or an end in the midst of work.",
            ),
            Self::EventsLost => ("suture_events_lost_total", "Events that slow listeners have missed."),
            Self::Deliveries => {
                ("suture_webhook_deliveries_total", "Messages to webhooks, and runs of `on_done`, by target and result.")
            }
            Self::Samples => ("suture_samples_total", "Jobs that were computed twice, by what came of the comparison."),
        }
    }
}

impl Timing {
    const ALL: [Self; 3] = [Self::JobDuration, Self::WorkerMaxRss, Self::StoreFlush];

    fn words(self) -> (&'static str, &'static str) {
        match self {
            Self::JobDuration => ("suture_job_duration_seconds", "How long stages of jobs took, the wait in the queue included."),
            Self::WorkerMaxRss => ("suture_worker_max_rss_bytes", "Largest resident memory of workers, mapped files included."),
            Self::StoreFlush => ("suture_store_flush_seconds", "How long changes of the job store took to be durable."),
        }
    }

    fn buckets(self) -> &'static [f64] {
        const MIB: f64 = 1_048_576.0;
        match self {
            Self::JobDuration => &[0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0, 3600.0, 14400.0],
            Self::WorkerMaxRss => &[32.0 * MIB, 64.0 * MIB, 128.0 * MIB, 256.0 * MIB, 512.0 * MIB, 1024.0 * MIB, 4096.0 * MIB],
            Self::StoreFlush => &[0.0003, 0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 1.0, 10.0],
        }
    }
}

/// One histogram: how often a value was at most each bound, or larger.
#[derive(Clone, Debug, Default)]
struct Histogram {
    counts: Vec<u64>,
    sum: f64,
    count: u64,
}

#[derive(Default)]
struct Values {
    counts: BTreeMap<(Count, String), u64>,
    timings: BTreeMap<(Timing, String), Histogram>,
}

/// All of them.
#[derive(Default)]
pub(crate) struct Metrics(Mutex<Values>);

/// A label and its value.
pub(crate) type Label<'a> = (&'static str, &'a str);

impl Metrics {
    fn values(&self) -> MutexGuard<'_, Values> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// So many more.
    pub(crate) fn add(&self, what: Count, labels: &[Label<'_>], more: u64) {
        let mut values = self.values();
        let value = values.counts.entry((what, written(labels))).or_default();
        *value = value.saturating_add(more);
    }

    /// One more measurement.
    pub(crate) fn observe(&self, what: Timing, labels: &[Label<'_>], value: f64) {
        let mut values = self.values();
        let histogram = values.timings.entry((what, written(labels))).or_default();
        histogram.counts.resize(what.buckets().len(), 0);
        histogram.counts.iter_mut().zip(what.buckets()).filter(|(_, bound)| value <= **bound).for_each(|(count, _)| *count += 1);
        histogram.sum += value;
        histogram.count += 1;
    }

    /// As text.
    pub(crate) fn text(&self) -> String {
        let mut text = String::new();
        let values = self.values();
        for what in Count::ALL {
            head(&mut text, what.words(), "counter");
            let of = values.counts.range((what, String::new())..).take_while(|((there, _), _)| *there == what);
            for ((_, labels), value) in of {
                sample(&mut text, what.words().0, labels, *value as f64);
            }
        }
        for what in Timing::ALL {
            head(&mut text, what.words(), "histogram");
            let of = values.timings.range((what, String::new())..).take_while(|((there, _), _)| *there == what);
            for ((_, labels), histogram) in of {
                lines(&mut text, what, labels, histogram);
            }
        }
        text
    }
}

fn lines(text: &mut String, what: Timing, labels: &str, histogram: &Histogram) {
    let name = what.words().0;
    let with = |bound: &str| {
        let comma = if labels.is_empty() { "" } else { "," };
        format!("{labels}{comma}le=\"{bound}\"")
    };
    for (bound, count) in what.buckets().iter().zip(&histogram.counts) {
        sample(text, &format!("{name}_bucket"), &with(&bound.to_string()), *count as f64);
    }
    sample(text, &format!("{name}_bucket"), &with("+Inf"), histogram.count as f64);
    sample(text, &format!("{name}_sum"), labels, histogram.sum);
    sample(text, &format!("{name}_count"), labels, histogram.count as f64);
}

/// Labels as they are written, without the braces.
pub(crate) fn written(labels: &[Label<'_>]) -> String {
    let escaped = |value: &str| value.replace('\\', "\\\\").replace('"', "\\\"").replace('\n', "\\n");
    labels.iter().map(|(name, value)| format!("{name}=\"{}\"", escaped(value))).collect::<Vec<_>>().join(",")
}

/// The head of a family of values.
pub(crate) fn head(text: &mut String, (name, help): (&str, &str), kind: &str) {
    // Writing to a string cannot fail.
    let _ = writeln!(text, "# HELP {name} {help}\n# TYPE {name} {kind}");
}

/// One value. `labels` as by [`written`].
pub(crate) fn sample(text: &mut String, name: &str, labels: &str, value: f64) {
    let _ = if labels.is_empty() { writeln!(text, "{name} {value}") } else { writeln!(text, "{name}{{{labels}}} {value}") };
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_counted_is_written() {
        let metrics = Metrics::default();
        metrics.add(Count::JobsFinished, &[("folder", "a \"b\"\\\n"), ("result", "ok")], 2);
        metrics.add(Count::JobsFinished, &[("folder", "a \"b\"\\\n"), ("result", "ok")], 1);
        metrics.add(Count::JobAttempts, &[], 7);
        metrics.observe(Timing::JobDuration, &[("stage", "queue")], 0.02);
        metrics.observe(Timing::JobDuration, &[("stage", "queue")], 99_999.0);
        let text = metrics.text();
        for line in [
            "# TYPE suture_jobs_finished_total counter",
            "suture_jobs_finished_total{folder=\"a \\\"b\\\"\\\\\\n\",result=\"ok\"} 3",
            "suture_job_attempts_total 7",
            "suture_job_duration_seconds_bucket{stage=\"queue\",le=\"0.01\"} 0",
            "suture_job_duration_seconds_bucket{stage=\"queue\",le=\"0.03\"} 1",
            "suture_job_duration_seconds_bucket{stage=\"queue\",le=\"+Inf\"} 2",
            "suture_job_duration_seconds_sum{stage=\"queue\"} 99999.02",
            "suture_job_duration_seconds_count{stage=\"queue\"} 2",
        ] {
            assert!(text.lines().any(|there| there == line), "{line}: {text}");
        }
    }
}
