//! Attribute words of an STL that is an STL again.

use super::*;
use crate::contract::report::AttributesKept;

/// A binary STL of these triangles with their words.
fn stl(triangles: &[(Corners, u16)]) -> Vec<u8> {
    let mut bytes = vec![b' '; 80];
    bytes.extend((triangles.len() as u32).to_le_bytes());
    triangles.iter().for_each(|(corners, word)| bytes.extend(record::encode(*corners, *word)));
    bytes
}

/// A cube of twelve triangles with the words 1 to 12, without the last one and with the first one twice.
fn damaged() -> Vec<u8> {
    let mut all: Vec<(Corners, u16)> = cube().into_iter().zip(1..).collect();
    *all.last_mut().unwrap() = all[0];
    stl(&all)
}

#[test]
fn words_that_stay_go_and_are_new_are_counted() {
    let result = repaired("stl", &damaged(), &Profile::default());
    assert_eq!(result.report.outcome, Outcome::Repaired, "{:?}", result.report.verdict);
    let expected = AttributesKept { kept: 11, divided: 0, approximated: 0, inherited: 1, lost: 1 };
    assert_eq!(result.report.attributes, Some(expected));
    assert_eq!(result.report.hints.iter().filter(|hint| hint.kind == HintKind::Attributes).count(), 1);
    // Without words there is nothing to tell, and of a copy neither.
    let plain: Vec<_> = cube()[..11].iter().map(|corners| (*corners, 0)).collect();
    assert_eq!(repaired("stl", &stl(&plain), &Profile::default()).report.attributes, None);
    let whole: Vec<_> = cube().into_iter().zip(1..).collect();
    assert_eq!(repaired("stl", &stl(&whole), &Profile::default()).report.attributes, None);
}

#[test]
fn the_profile_may_refuse_what_loses_a_word() {
    let profile = |attributes| Profile { attributes, ..Profile::default() };
    let refused = repaired("stl", &damaged(), &profile(KeepAttributes::Refuse));
    assert_eq!((refused.report.outcome, refused.output.len()), (Outcome::NotGood, 0), "{:?}", refused.report.verdict);
    assert_eq!(repaired("stl", &damaged(), &profile(KeepAttributes::Keep)).report.outcome, Outcome::NeedsReview);
    // Nothing is lost: the same bytes as without the wish.
    let open = stl(&cube().into_iter().zip(1..).take(11).collect::<Vec<_>>());
    let [free, strict] = [KeepAttributes::Best, KeepAttributes::Refuse].map(|wish| repaired("stl", &open, &profile(wish)));
    assert_eq!((strict.report.outcome, &strict.output), (Outcome::Repaired, &free.output));
    assert_eq!(strict.report.certificate.map(|own| own.blake3), strict.report.output.map(|own| own.blake3));
}
