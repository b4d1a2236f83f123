//! Faults have numbers, and tests are named after them: `f07_…` proves something of fault 7.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// Names of tests by the number of the fault.
pub(crate) type Proofs = BTreeMap<u32, BTreeSet<String>>;

/// The fault of a test of that name.
pub(crate) fn number_of(name: &str) -> Option<u32> {
    let (digits, rest) = name.strip_prefix('f')?.split_once('_')?;
    (digits.len() == 2 && !rest.is_empty()).then(|| digits.parse().ok()).flatten()
}

/// Adds the tests in a folder and those in it. Lines are read, since macros hide functions from a parser.
pub(crate) fn gather(folder: &Path, proofs: &mut Proofs) {
    let entries = std::fs::read_dir(folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    for path in entries.map(|entry| entry.expect("an entry").path()) {
        if path.is_dir() {
            gather(&path, proofs);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            let text = std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
            let names = tests_in(&text).into_iter().filter_map(|name| Some((number_of(&name)?, name)));
            names.for_each(|(number, name)| _ = proofs.entry(number).or_default().insert(name));
        }
    }
}

/// Names of the functions that stand below a line `#[test]`, with nothing but other attributes in between.
pub(crate) fn tests_in(text: &str) -> Vec<String> {
    let (mut names, mut is_test) = (Vec::new(), false);
    for line in text.lines().map(str::trim) {
        if line.starts_with("#[") || line.starts_with("//") {
            is_test |= line == "#[test]";
            continue;
        }
        let name = line.strip_prefix("fn ").and_then(|rest| rest.split('(').next());
        names.extend(name.filter(|_| is_test).map(str::to_owned));
        is_test = false;
    }
    names
}
