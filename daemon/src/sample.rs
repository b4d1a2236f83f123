//! Jobs that are computed twice and compared. Equal inputs give equal bytes; where a machine's memory or processor is faulty, or the engine is, they do
//! not, and nothing else would tell. Which jobs those are follows from their numbers alone, so that all hosts agree, and go on to after a restart.

use suture_store::{Hash, Host, Job, JobId, Recipe, Witness};

/// Of jobs in a store that machines share, one in so many is computed twice unless it is said otherwise.
pub(crate) const SHARED_ONE_IN: u64 = 1000;
/// For so many milliseconds another host is left the second attempt.
const OTHERS_FIRST_MS: u64 = 60_000;
/// The engine whose results are compared.
const ENGINE: &str = env!("CARGO_PKG_VERSION");

/// Is it one of those, of which there is one in so many? 0: none is.
pub(crate) fn is_one(id: JobId, one_in: u64) -> bool {
    let [a, b, c, d, e, f, g, h, ..] = *blake3::hash(&id.0.to_be_bytes()).as_bytes();
    u64::from_be_bytes([a, b, c, d, e, f, g, h]).checked_rem(one_in) == Some(0)
}

/// The result of the first attempt, to compare with.
pub(crate) fn witness(daemon: &str, recipe: Recipe, output: Hash) -> Witness {
    Witness::new(daemon, ENGINE, recipe, output)
}

/// Does the daemon of this name that has claimed `job` leave it to one of these hosts, since it made the first result itself?
pub(crate) fn is_for_another(job: &Job, daemon: &str, hosts: &dyn Fn() -> Vec<Host>) -> bool {
    let Some(witness) = &job.witness else { return false };
    // Both times are the store's.
    if !witness.is_by(daemon) || job.changed.0.saturating_sub(witness.at.0) >= OTHERS_FIRST_MS {
        return false;
    }
    let could = |host: &Host| {
        host.daemon != daemon && host.station.version == witness.engine && host.takes(&job.source.folder, job.source.size)
    };
    hosts().iter().any(could)
}

/// The end of the second attempt.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Second {
    /// A result that may go to `out/`.
    Good { recipe: Recipe, output: Hash },
    /// None that may. `recipe`: of what there is instead, if there is anything.
    Bad { recipe: Option<Recipe> },
    /// The file is beyond a limit of this host.
    Refused,
}

/// The outcome of the comparison.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Compared {
    Equal,
    /// In words for people: who made what, and what to do.
    Different(String),
    /// An upgrade came between the attempts.
    OtherVersion,
    /// Something else that decides the result, or whether there is one, was not the same: nothing is compared.
    Unlike,
}

impl Compared {
    /// The words for them, as labels.
    pub(crate) const WORDS: [&'static str; 4] = ["equal", "different", "other_version", "not_compared"];

    pub(crate) fn word(&self) -> &'static str {
        let [equal, different, other_version, not_compared] = Self::WORDS;
        match self {
            Self::Equal => equal,
            Self::Different(_) => different,
            Self::OtherVersion => other_version,
            Self::Unlike => not_compared,
        }
    }
}

/// How the words for a difference begin.
const DIFFERS: &str = "computed twice, with two results: ";

/// Does it say that two attempts differ: the reason of a job, or of a report?
pub(crate) fn is_difference(reason: &str) -> bool {
    reason.starts_with(DIFFERS)
}

/// Compares what `daemon` made with what an earlier attempt did.
pub(crate) fn compare(witness: &Witness, daemon: &str, second: Second) -> Compared {
    if witness.engine != ENGINE {
        return Compared::OtherVersion;
    }
    let made = match second {
        // The settings of hosts may differ.
        Second::Good { recipe, .. } | Second::Bad { recipe: Some(recipe), .. } if recipe != witness.recipe => {
            return Compared::Unlike;
        }
        // Too little memory is a refusal, never another result: the other host had more.
        Second::Refused => return Compared::Unlike,
        Second::Good { output, .. } if output == witness.output => return Compared::Equal,
        Second::Good { output, .. } => format!("BLAKE3 {output}"),
        Second::Bad { .. } => "no good result".to_owned(),
    };
    let suspects = if witness.is_by(daemon) {
        "memory or processor of that host are faulty, or the engine is: pause it (`suture jobs pause`), test its memory"
    } else {
        "memory or processor of one of these hosts are faulty, or the engine is: drain both (`suture hosts drain`), test their memory"
    };
    Compared::Different(format!(
        "{DIFFERS}{} made BLAKE3 {}, then {daemon} made {made}, both with version {ENGINE}; {suspects}, and send \
         the file to the makers of Suture; `suture jobs retry` computes it anew",
        witness.daemon, witness.output
    ))
}

#[cfg(test)]
mod tests {
    use suture_store::testkit::dropped;
    use suture_store::{Roles, Station, Time};

    use super::*;

    #[test]
    fn about_one_in_so_many_is_chosen_by_its_number_alone() {
        let chosen = |one_in| (1..=30_000).filter(|id| is_one(JobId(*id), one_in)).count();
        assert_eq!([chosen(0), chosen(1)], [0, 30_000]);
        let (tenth, thousandth) = (chosen(10), chosen(1000));
        // Of 30,000 draws: the mean, and six deviations to either side.
        assert!((2688..=3312).contains(&tenth) && (1..=63).contains(&thousandth), "{tenth}, {thousandth}");
        // Of hosts with settings of their own, one that samples ten times as often has all jobs of the other.
        assert!((1..=30_000).filter(|id| is_one(JobId(*id), 1000)).all(|id| is_one(JobId(id), 10)));
    }

    fn made_by(daemon: &str) -> Witness {
        witness(daemon, Recipe(7), Hash([1; 32]))
    }

    fn good(recipe: u64, hash: u8) -> Second {
        Second::Good { recipe: Recipe(recipe), output: Hash([hash; 32]) }
    }

    #[test]
    fn equal_bytes_are_equal_and_others_name_who_made_what() {
        let first = made_by("a:/state");
        assert_eq!(compare(&first, "b:/state", good(7, 1)), Compared::Equal);
        let Compared::Different(words) = compare(&first, "b:/state", good(7, 2)) else { panic!("they differ") };
        for part in [
            format!("a:/state made BLAKE3 {}", Hash([1; 32])),
            format!("b:/state made BLAKE3 {}", Hash([2; 32])),
            format!("version {ENGINE}"),
            "drain both (`suture hosts drain`)".into(),
        ] {
            assert!(words.contains(&part), "{part}: {words}");
        }
        let Compared::Different(words) = compare(&first, "a:/state", good(7, 2)) else { panic!("they differ") };
        assert!(words.contains("of that host are faulty") && words.contains("pause it"), "{words}");
    }

    /// Names may be long: what to do is said all the same.
    #[test]
    fn the_reason_fits_a_record() {
        let name = "n".repeat(suture_store::job::MAX_DAEMON);
        let Compared::Different(words) = compare(&made_by(&name), &name.replace('n', "m"), good(7, 2)) else {
            panic!("they differ")
        };
        assert_eq!(suture_store::job::one_line(&words), words);
        assert!(is_difference(&words) && !is_difference("changed more than the profile allows"));
    }

    #[test]
    fn no_result_after_a_result_is_a_difference_and_a_refusal_is_none() {
        let first = made_by("a:/state");
        for recipe in [None, Some(Recipe(7))] {
            let compared = compare(&first, "b:/state", Second::Bad { recipe });
            let Compared::Different(words) = compared else { panic!("{recipe:?}: {compared:?}") };
            assert!(words.contains("then b:/state made no good result"), "{words}");
        }
        assert_eq!(compare(&first, "b:/state", Second::Bad { recipe: Some(Recipe(8)) }), Compared::Unlike);
        assert_eq!(compare(&first, "b:/state", Second::Refused), Compared::Unlike);
    }

    #[test]
    fn what_is_not_made_alike_is_not_compared() {
        assert_eq!(compare(&made_by("a:/state"), "b:/state", good(8, 2)), Compared::Unlike);
        let older = Witness { engine: "0.0.1".into(), ..made_by("a:/state") };
        assert_eq!(compare(&older, "b:/state", good(7, 2)), Compared::OtherVersion);
    }

    fn host(daemon: &str) -> Host {
        Host {
            daemon: daemon.into(),
            station: Station { version: ENGINE.into(), ..Station::default() },
            folders: vec!["hot".into()],
            began: Time(1),
            seen: Time(2),
            is_alive: true,
            is_draining: false,
            running: 0,
        }
    }

    /// The second attempt is another host's for a minute, if there is one that could make it.
    #[test]
    fn who_made_the_first_leaves_the_second_to_another_who_could() {
        let witness = Witness { at: Time(1000), ..made_by("a:/state") };
        let source = dropped("part.stl", 84).unwrap().source;
        let claimed = |ms| {
            let job = Job::queued(JobId(1), source.clone(), Time(500));
            Job { witness: Some(Box::new(witness.clone())), changed: Time(1000 + ms), ..job }
        };
        let leaves =
            |job: &Job, daemon: &str, other: Host| is_for_another(job, daemon, &|| vec![host("a:/state"), other.clone()]);
        assert!(leaves(&claimed(5), "a:/state", host("b:/state")));
        assert!(!leaves(&claimed(5), "b:/state", host("b:/state")), "it is the other one");
        assert!(leaves(&claimed(OTHERS_FIRST_MS - 1), "a:/state", host("b:/state")));
        assert!(!leaves(&claimed(OTHERS_FIRST_MS), "a:/state", host("b:/state")), "nobody came");
        assert!(!leaves(&Job { witness: None, ..claimed(5) }, "a:/state", host("b:/state")), "it is the first");
        assert!(!is_for_another(&claimed(5), "a:/state", &|| vec![host("a:/state")]), "nobody is there");
        let b = host("b:/state");
        let shows: Roles = "intake,control".parse().unwrap();
        for unable in [
            Host { is_alive: false, ..b.clone() },
            Host { is_draining: true, ..b.clone() },
            Host { folders: vec!["other".into()], ..b.clone() },
            Host { station: Station { version: "0.0.1".into(), ..b.station.clone() }, ..b.clone() },
            Host { station: Station { largest: Some(83), ..b.station.clone() }, ..b.clone() },
            Host { station: Station { roles: shows, ..b.station.clone() }, ..b.clone() },
        ] {
            assert!(!leaves(&claimed(5), "a:/state", unable.clone()), "{unable:?}");
        }
    }
}
