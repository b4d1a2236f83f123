//! Which faults are tried.

use std::collections::BTreeMap;

use suture_tests::trace::calls::{GROUPS, KINDS, Kind};
use suture_tests::trace::{Fault, Role, What, When};

/// Calls of an undisturbed run, by role and kind.
pub(crate) type Counts = BTreeMap<(Role, &'static str), u64>;

/// Faults tried without `SUTURE_EXHAUSTIVE`.
const SAMPLE: usize = 80;
/// Looks before the first file is seen, and some more.
const FIRST_LOOKS: u64 = 100;
/// Runs differ in a few calls: the plan goes a little further than the run that was counted.
const BEYOND: u64 = 2;

/// The whole plan. Every error is tried once at every call. Thinned are: errors that last (at every fifth call, as what follows is much
/// the same), calls whose failing nobody looks at (`close`, at every eighth), and `EDQUOT`, which is handled as `ENOSPC` is.
pub(crate) fn all(counts: &Counts) -> Vec<Fault> {
    let mut plan = Vec::new();
    for ((role, name), count) in counts {
        let Some(kind) = KINDS.iter().find(|kind| kind.name == *name) else { continue };
        for n in 1..=count + BEYOND {
            at(kind, *role, n, &mut plan);
        }
    }
    let total: u64 = counts.values().sum();
    for (group, errno) in GROUPS {
        let calls = counts.iter().filter(|((_, name), _)| KINDS.iter().any(|k| k.name == *name && k.errnos.contains(&errno)));
        let calls: u64 = calls.map(|(_, n)| n).sum::<u64>().min(total);
        plan.extend((1..=calls).step_by(7).map(|n| fault(None, group, n, What::Errno(errno), When::On)));
    }
    // The short runs first.
    plan.sort_by_key(|fault| fault.when != When::Once);
    plan
}

/// Of the daemon's first looks at its folders, each fails once: they tell it which folders these are for the rest of its life.
pub(crate) fn first_looks() -> Vec<Fault> {
    (1..=FIRST_LOOKS).map(|n| fault(Some(Role::Daemon), "stat", n, What::Errno(libc::ENOMEM), When::Once)).collect()
}

fn at(kind: &Kind, role: Role, n: u64, plan: &mut Vec<Fault>) {
    let mut add = |what, when| plan.push(fault(Some(role), kind.name, n, what, when));
    let every = |k: u64| n % k == 1;
    for errno in kind.errnos {
        let rare = (*errno == libc::EDQUOT && !every(5)) || (kind.name == "close" && !every(8));
        if !rare {
            add(What::Errno(*errno), When::Once);
        }
        if every(5) && *errno != libc::EDQUOT {
            add(What::Errno(*errno), When::On);
        }
    }
    if kind.interruptible {
        if every(3) {
            add(What::Errno(libc::EINTR), When::Once);
        }
        if n <= 2 {
            add(What::Errno(libc::EINTR), When::Second);
        }
    }
    if kind.count.is_some() {
        add(if every(2) { What::One } else { What::Half }, When::Once);
        if n <= 2 {
            add(What::One, When::Second);
            add(What::Half, When::Second);
        }
    }
}

fn fault(role: Option<Role>, call: &str, n: u64, what: What, when: When) -> Fault {
    Fault { role, call: call.into(), n, what, when }
}

/// What is asked for by the environment.
pub(crate) fn choose(mut plan: Vec<Fault>) -> Vec<Fault> {
    if let Ok(only) = std::env::var("SUTURE_ONLY") {
        plan.retain(|fault| fault.to_string().starts_with(&only));
        return plan;
    }
    if std::env::var_os("SUTURE_EXHAUSTIVE").is_some() {
        let once = plan.iter().filter(|fault| fault.when == When::Once).count();
        eprintln!("{} faults, of which {once} happen once", plan.len());
        return plan;
    }
    let given = std::env::var("SUTURE_SEED").ok().and_then(|seed| seed.parse().ok());
    let seed: u64 = given.unwrap_or(20_261_123);
    eprintln!("SUTURE_SEED={seed}: {SAMPLE} of {} faults", plan.len());
    let mut dice = seed | 1;
    let mut chosen = Vec::new();
    while chosen.len() < SAMPLE && !plan.is_empty() {
        dice ^= dice << 13;
        dice ^= dice >> 7;
        dice ^= dice << 17;
        chosen.push(plan.swap_remove((dice % plan.len() as u64) as usize));
    }
    chosen
}
