//! What this process has spent, read from the system. Linux; zero where the system does not say.

/// User and system time in seconds.
pub(crate) fn cpu_seconds() -> f64 {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9
}

/// Largest resident set so far, mapped file pages included.
pub(crate) fn peak_resident_bytes() -> u64 {
    status_kilobytes("VmHWM:") * 1024
}

/// Anonymous memory now.
pub(crate) fn anonymous_bytes() -> u64 {
    // `statm`, in pages, takes the system a tenth of the time of `status`; what is not shared with a file is anonymous.
    let pages = std::fs::read_to_string("/proc/self/statm").unwrap_or_default();
    let mut pages = pages.split_whitespace().skip(1).map(|n| n.parse::<u64>().unwrap_or(0));
    let (resident, of_files) = (pages.next().unwrap_or(0), pages.next().unwrap_or(0));
    resident.saturating_sub(of_files) * rustix::param::page_size() as u64
}

fn status_kilobytes(field: &str) -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|l| l.strip_prefix(field));
    line.and_then(|l| l.split_whitespace().next()).and_then(|n| n.parse().ok()).unwrap_or(0)
}
