//! Which of the files that may go are to go, and why. Pure.
//!
//! An age counts from when a file came where it is. Of what has too many bytes in all, the oldest go first; but nothing that is younger than
//! [`GRACE_MS`], lest a large result goes before anyone has seen it. A file from the future, as a clock sees it that was set back, stays.

use std::path::PathBuf;

use suture_store::{Hash, Time};

use crate::config::keep::{Bound, Keep};
use crate::units::{write_duration, write_size};

/// What is younger does not go for its size: a day, in milliseconds.
const GRACE_MS: u64 = 24 * 3600 * 1000;

/// What a file is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum What {
    /// A repaired mesh, or a best attempt.
    Result,
    /// A report.
    Report,
    /// A receipt, the result of which is gone.
    Receipt,
    /// A dropped file, wherever it was moved to.
    Original,
}

impl What {
    /// A word for it.
    pub(crate) fn word(self) -> &'static str {
        match self {
            Self::Result => "result",
            Self::Report => "report",
            Self::Receipt => "receipt",
            Self::Original => "original",
        }
    }
}

/// A file that may go.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Piece {
    pub what: What,
    /// Below the hot folder.
    pub path: PathBuf,
    pub bytes: u64,
    /// When it came there.
    pub since: Time,
    /// Of its content, by its receipt: with another one it is someone else's by now.
    pub hash: Option<Hash>,
}

/// One that is to go.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Going {
    pub piece: Piece,
    /// In words.
    pub why: String,
}

/// Those of a hot folder that are to go now, the oldest first.
pub(crate) fn going(pieces: Vec<Piece>, keep: &Keep, now: Time) -> Vec<Going> {
    let (originals, others): (Vec<_>, Vec<_>) = pieces.into_iter().partition(|piece| piece.what == What::Original);
    let (results, reports): (Vec<_>, Vec<_>) = others.into_iter().partition(|piece| piece.what == What::Result);
    let kinds =
        [(results, keep.results, "results"), (reports, keep.reports, "reports"), (originals, keep.originals, "originals")];
    kinds.into_iter().flat_map(|(pieces, bound, words)| beyond(pieces, bound, words, now)).collect()
}

fn beyond(mut pieces: Vec<Piece>, bound: Bound, words: &str, now: Time) -> Vec<Going> {
    let older = |piece: &Piece, ms: u64| now.0.saturating_sub(piece.since.0) > ms;
    let is_old = |piece: &Piece| {
        let age = bound.age.filter(|age| older(piece, u64::try_from(age.as_millis()).unwrap_or(u64::MAX)));
        age.map(|age| format!("older than {}", write_duration(age)))
    };
    pieces.sort_by(|a, b| (a.since, &a.path).cmp(&(b.since, &b.path)));
    let mut left: u64 = pieces.iter().filter(|piece| is_old(piece).is_none()).map(|piece| piece.bytes).sum();
    let mut going = Vec::new();
    for piece in pieces {
        let over = bound.size.filter(|size| left > *size && older(&piece, GRACE_MS));
        let why = match (is_old(&piece), over) {
            (Some(why), _) => why,
            (None, Some(size)) => {
                left -= piece.bytes;
                format!("more than {} of {words}", write_size(size))
            }
            (None, None) => continue,
        };
        going.push(Going { piece, why });
    }
    going
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    const DAY: u64 = GRACE_MS;
    const NOW: Time = Time(1000 * DAY);

    fn piece(what: What, name: &str, bytes: u64, days_old: u64) -> Piece {
        Piece { what, path: name.into(), bytes, since: Time(NOW.0 - days_old * DAY), hash: None }
    }

    fn named(pieces: Vec<Piece>, keep: &Keep, now: Time) -> Vec<(String, String)> {
        going(pieces, keep, now).into_iter().map(|one| (one.piece.path.display().to_string(), one.why)).collect()
    }

    fn days(days: u64) -> Option<Duration> {
        Some(Duration::from_millis(days * DAY))
    }

    #[test]
    fn by_default_everything_stays() {
        let all = [What::Result, What::Report, What::Receipt, What::Original].map(|what| piece(what, "a", u64::MAX / 8, 999));
        assert!(named(all.to_vec(), &Keep::default(), NOW).is_empty());
    }

    #[test]
    fn each_kind_has_an_age_of_its_own() {
        let keep = Keep {
            results: Bound { age: days(10), size: None },
            reports: Bound { age: days(20), size: None },
            ..Keep::default()
        };
        let all = |age| {
            [What::Result, What::Report, What::Receipt, What::Original].map(|what| piece(what, what.word(), 1, age)).to_vec()
        };
        assert!(named(all(10), &keep, NOW).is_empty(), "not older yet");
        assert_eq!(named(all(11), &keep, NOW), [("result".into(), "older than 10d".into())]);
        let gone: Vec<String> = named(all(21), &keep, NOW).into_iter().map(|(name, _)| name).collect();
        assert_eq!(gone, ["result", "receipt", "report"], "never an original, of which nothing is said");
    }

    #[test]
    fn of_too_much_the_oldest_goes_but_nothing_of_today() {
        let keep = Keep { results: Bound { age: days(30), size: Some(100) }, ..Keep::default() };
        let results = |sizes: [(u64, u64); 4]| {
            sizes.iter().enumerate().map(|(i, (bytes, age))| piece(What::Result, &i.to_string(), *bytes, *age)).collect()
        };
        let all = results([(60, 2), (60, 3), (1000, 31), (60, 4)]);
        let gone = named(all, &keep, NOW);
        let expected = [("2", "older than 30d"), ("3", "more than 100B of results"), ("1", "more than 100B of results")];
        assert_eq!(gone, expected.map(|(name, why)| (name.to_owned(), why.to_owned())));
        assert!(named(results([(60, 0), (60, 1), (900, 0), (60, 1)]), &keep, NOW).is_empty());
        assert!(named(results([(25, 2), (25, 3), (25, 4), (25, 5)]), &keep, NOW).is_empty(), "just as much as may be");
    }

    #[test]
    fn f15_a_clock_that_was_set_back_lets_everything_stay() {
        let keep = Keep { results: Bound { age: days(1), size: Some(1) }, ..Keep::default() };
        let all = || vec![piece(What::Result, "a", 10, 5), piece(What::Result, "b", 10, 3)];
        assert!(named(all(), &keep, Time(0)).is_empty());
        assert_eq!(named(all(), &keep, NOW).len(), 2);
    }
}
