//! Damaged files: whatever bytes come, reading neither panics nor invents triangles nor takes memory beyond a multiple of them.

use proptest::prelude::*;

use super::text::tetrahedron_text;
use super::*;
use crate::io::read::facets::{self, Tally};

fn seeds() -> Vec<Vec<u8>> {
    let text = tetrahedron_text();
    vec![
        binary_file(b"seed", 4, &tetrahedron(), b""),
        binary_file(b"solid seed", 4, &tetrahedron(), b""),
        binary_file(b"", u32::MAX, &tetrahedron().repeat(5), b"tail"),
        text.clone().into_bytes(),
        text.replace('.', ",").to_uppercase().into_bytes(),
        text.repeat(3).into_bytes(),
        text.replace("endloop\n", "vertex 2 2 2\n endloop\n").into_bytes(),
    ]
}

/// Opens, and checks what must hold for any bytes.
fn survive(bytes: &[u8]) -> std::result::Result<(), TestCaseError> {
    match open(bytes) {
        Ok(file) => {
            prop_assert!(!file.records().is_empty());
            // The tersest vertex takes 13 bytes, and gives a triangle at most.
            prop_assert!(file.records().len() <= bytes.len() / 13);
            prop_assert!(file.findings().len() < 20);
            prop_assert!(file.findings().iter().all(|finding| finding.text.lines().count() == 1 && finding.text.len() < 2000));
            prop_assert_eq!(file.output_header(), binary::safe_header(file.output_header()));
        }
        Err(error) => prop_assert_eq!(error.class(), ErrorClass::Unreadable),
    }
    Ok(())
}

/// A cut file gives a beginning of what the whole gives, or nothing: never a triangle that was not there.
#[test]
fn f13_cutting_anywhere_invents_nothing() {
    for seed in seeds() {
        let whole = open(&seed).unwrap();
        for length in 0..seed.len() {
            if let Ok(cut) = open(&seed[..length]) {
                assert!(whole.records().starts_with(cut.records()), "cut at {length} of {}", seed.len());
            }
        }
    }
}

#[test]
fn a_cut_text_says_so() {
    let text = tetrahedron_text();
    let at = text.rfind("vertex").unwrap();
    let file = open(&text.as_bytes()[..at + 10]).unwrap();
    assert_eq!(file.records().len(), 3);
    assert_eq!(texts(&file), ["cut off within a facet, which was left out", "no endsolid"]);
    assert!(!file.is_flawless());
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, ..ProptestConfig::default() })]

    #[test]
    fn f13_any_bytes_are_survived(bytes in prop::collection::vec(any::<u8>(), 0..600)) {
        survive(&bytes)?;
    }

    #[test]
    fn f13_any_bytes_between_facets_are_survived(bytes in prop::collection::vec(any::<u8>(), 0..200), at in 0usize..1000) {
        let mut text = tetrahedron_text().into_bytes();
        let at = at % text.len();
        text.splice(at..at, bytes);
        survive(&text)?;
    }

    /// Byte flips, cuts, insertions, doublings: what copying, transfer and editors do to files.
    #[test]
    fn f13_mutated_files_are_survived(
        seed in 0usize..7, edits in prop::collection::vec((0u8..5, any::<usize>(), any::<u8>(), 0usize..80), 1..8),
    ) {
        let mut bytes = seeds().swap_remove(seed);
        for (kind, at, byte, length) in edits {
            let at = at % (bytes.len() + 1);
            let end = (at + length).min(bytes.len());
            match kind {
                0 => bytes.iter_mut().skip(at).take(1).for_each(|b| *b ^= byte),
                1 => bytes.truncate(at),
                2 => drop(bytes.drain(at..end)),
                3 => {
                    let copy = bytes[at..end].to_vec();
                    bytes.splice(at..at, copy).for_each(drop);
                }
                _ => bytes.splice(at..at, vec![byte; length]).for_each(drop),
            }
        }
        survive(&bytes)?;
    }

    /// The rule that lets threads share a text: cut before any `facet normal`, the pieces give what the whole gives.
    #[test]
    fn text_may_be_cut_before_any_facet(
        words in prop::collection::vec(0usize..20, 0..120),
        cuts in prop::collection::vec(any::<bool>(), 120),
        last: bool,
    ) {
        const WORDS: [&str; 20] = [
            "facet", "normal", "facet normal", "FACET\nNormal", "facet normal 0 0 1 outer loop", "vertex", "vertex 1 2 3",
            "vertex 1,5 x", "1.5", "endloop", "loop", "endfacet", "end", "solid", "solid name", "endsolid", "\n", "\r",
            "end facet", "nofacet normal",
        ];
        let text = words.iter().flat_map(|&word| [WORDS[word], " "]).collect::<String>();
        let text = text.as_bytes();
        let whole = facets::parse(text, 0, last);
        let (mut records, mut tally, mut from) = (Vec::new(), Tally::default(), 0);
        let mut cuts = cuts.iter();
        let mut at = 0;
        while let Some(begin) = facets::next_facet(text, at, text.len()) {
            at = begin + 1;
            if cuts.next() == Some(&true) && begin > from {
                let (more, next) = facets::parse(&text[from..begin], from as u64, false);
                records.extend(more);
                tally.append(next);
                from = begin;
            }
        }
        let (more, next) = facets::parse(&text[from..], from as u64, last);
        records.extend(more);
        tally.append(next);
        let bits = |records: &[Record]| records.as_flattened().to_vec();
        prop_assert_eq!(bits(&records), bits(&whole.0));
        prop_assert_eq!(tally, whole.1);
    }
}
