//! A mesh in as many parts as there are threads.

use suture_core::record::Record;

/// Runs `work` on parts of the records, each with the number of its first; results in their order.
pub(super) fn side_by_side<R: Send>(records: &[Record], threads: usize, work: impl Fn(usize, &[Record]) -> R + Sync) -> Vec<R> {
    let length = records.len().div_ceil(threads.max(1)).max(1);
    let parts: Vec<(usize, &[Record])> = records.chunks(length).enumerate().map(|(i, part)| (i * length, part)).collect();
    let Some((last, others)) = parts.split_last() else { return Vec::new() };
    std::thread::scope(|scope| {
        let work = &work;
        let others: Vec<_> = others
            .iter()
            .map(|(first, part)| {
                std::thread::Builder::new().spawn_scoped(scope, move || work(*first, part)).map_err(|_| (first, part))
            })
            .collect();
        let last = work(last.0, last.1);
        // Where no thread was to be had, this one does its part.
        let joined = others.into_iter().map(|other| match other {
            Ok(other) => other.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)),
            Err((first, part)) => work(*first, part),
        });
        joined.chain([last]).collect()
    })
}
