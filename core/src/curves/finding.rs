//! Oddities of a file, each with the line where it stands.

use std::collections::BTreeMap;

use crate::util::legible::escaped;

/// Something odd about a file, or something of it that is not read.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub struct Finding {
    /// Line of the file, from 1; 0 if it is about the file as a whole.
    pub line: u64,
    /// One line for people.
    pub text: String,
}

/// Findings that are kept of one kind; the others are counted.
const KEPT: u64 = 20;
/// Characters of details of a finding, at most.
const LONGEST: usize = 400;

/// Collects findings, those of the same kind up to 20, and counts what is not read by its name. Memory: O(kinds).
#[derive(Debug, Default)]
pub(crate) struct Findings {
    list: Vec<Finding>,
    kinds: BTreeMap<&'static str, (u64, u64)>,
    unread: BTreeMap<String, (u64, u64)>,
}

impl Findings {
    /// Notes a finding of a kind; the kind is its text, followed by the details.
    pub(crate) fn add(&mut self, line: u64, kind: &'static str, details: impl AsRef<str>) {
        let (count, last) = self.kinds.entry(kind).or_default();
        *count += 1;
        *last = line;
        if *count <= KEPT {
            let details = escaped(details.as_ref(), LONGEST);
            let text = if details.is_empty() { kind.to_owned() } else { format!("{kind}: {details}") };
            self.list.push(Finding { line, text });
        }
    }

    /// Counts a thing that is not read, by its name.
    pub(crate) fn unread(&mut self, line: u64, name: impl Into<String>) {
        let (count, first) = self.unread.entry(name.into()).or_insert((0, line));
        *count += 1;
        *first = line.min(*first);
    }

    /// All of them: in the order of their lines, then what is not read.
    #[must_use]
    pub(crate) fn finish(self) -> Vec<Finding> {
        let mut list = self.list;
        for (kind, (count, line)) in self.kinds.into_iter().filter(|(_, (count, _))| *count > KEPT) {
            list.push(Finding { line, text: format!("{kind}: {} more of them", count - KEPT) });
        }
        list.sort();
        let unread = self.unread.into_iter();
        list.extend(unread.map(|(name, (count, line))| Finding { line, text: format!("not read: {count} × {name}") }));
        list
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn many_of_a_kind_are_counted() {
        let mut findings = Findings::default();
        (1..=25).for_each(|line| findings.add(line, "a line is no card", "x\u{1b}"));
        findings.unread(7, "114 (parametric spline surface)");
        findings.unread(5, "114 (parametric spline surface)");
        let list = findings.finish();
        assert_eq!(list.len(), 22);
        assert_eq!(list[0], Finding { line: 1, text: "a line is no card: x\\u{1b}".into() });
        assert_eq!(list[20].text, "a line is no card: 5 more of them");
        assert_eq!(list[21], Finding { line: 5, text: "not read: 2 × 114 (parametric spline surface)".into() });
    }
}
