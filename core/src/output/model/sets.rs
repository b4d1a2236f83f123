//! Sets of triangles, written with the numbers that their triangles have now.
//!
//! **In:** the text of an object's sets, and for each triangle of the output a triangle of the text that is in the same sets.
//! **Out:** the text with other references where numbers are others. A set that had ranges has single triangles first, then ranges; another one has single
//! triangles alone, since there are readers that know no others (lib3mf 2.5).
//! **Promise:** a set whose numbers are the same stays byte for byte, unless it refers to triangles that were not there, and may be now; of another one all
//! but its references does.
//!
//! By the 3MF Core Specification 1.3, section 4.1, Triangle Sets. Triangles that are in the same sets are a class, so that whoever asks for a triangle's
//! sets gets one number. Memory: 8 bytes for each range of a set, 24 for each place where sets begin or end, and the classes.

use std::collections::{BTreeMap, BTreeSet};
use std::io::Write;
use std::ops::Range;

use super::elements::{Element, Elements, Tag, local};

/// Sets of all classes together, and of all runs of the output, at most: work is of that order.
const MOST: usize = 1 << 22;

/// The class of triangles that are in no set.
pub(super) const IN_NONE: u32 = 0;

/// The sets of an object, as they stand in its text.
pub(super) struct Sets<'t> {
    text: &'t [u8],
    /// Where they stand.
    range: Range<usize>,
    sets: Vec<Set>,
    /// From this triangle on all are of this class, up to the next entry.
    stretches: Vec<(u32, u32)>,
    /// The sets of each class.
    classes: Vec<Vec<u32>>,
    /// Triangles of the text.
    triangles: u32,
}

/// A set.
#[derive(Default)]
struct Set {
    /// Its triangles, sorted and apart.
    members: Vec<Range<u32>>,
    /// It refers to ranges, too.
    has_ranges: bool,
    /// It refers to triangles that are not there.
    is_astray: bool,
}

/// The classes of the output's triangles, in order.
#[derive(Default)]
pub(super) struct Runs {
    /// From this triangle on all are of this class, up to the next entry.
    begins: Vec<(u32, u32)>,
    count: u32,
}

impl Runs {
    /// Appends a triangle.
    pub(super) fn push(&mut self, class: u32) {
        if self.begins.last().map_or(IN_NONE, |(_, last)| *last) != class {
            self.begins.push((self.count, class));
        }
        self.count = self.count.saturating_add(1);
    }
}

impl<'t> Sets<'t> {
    /// Of a mesh of so many triangles. `None` for sets in a form that is not understood, or too many of them. O(text + n log n) in the references.
    pub(super) fn parse(text: &'t [u8], range: Range<usize>, triangles: u32) -> Option<Self> {
        let sets = sets(text, range.clone(), triangles)?;
        let (stretches, classes) = classes(&sets)?;
        Some(Self { text, range, sets, stretches, classes, triangles })
    }

    /// The class of a triangle of the text. O(log n).
    pub(super) fn class_of(&self, triangle: u32) -> u32 {
        let behind = self.stretches.partition_point(|(first, _)| *first <= triangle);
        behind.checked_sub(1).and_then(|at| self.stretches.get(at)).map_or(IN_NONE, |(_, class)| *class)
    }

    /// The triangles of each set in the output. `None` for too many of them.
    fn renumbered(&self, runs: &Runs) -> Option<Vec<Vec<Range<u32>>>> {
        let mut all = vec![Vec::new(); self.sets.len()];
        let ends = runs.begins.iter().skip(1).map(|(first, _)| *first).chain([runs.count]);
        let mut work = 0;
        for ((first, class), end) in runs.begins.iter().zip(ends) {
            let sets = self.classes.get(*class as usize)?;
            work += sets.len();
            if work > MOST {
                return None;
            }
            for set in sets {
                add(all.get_mut(*set as usize)?, *first..end);
            }
        }
        Some(all)
    }

    /// Writes the sets as they are in the output; `None`: they cannot be, and nothing is written.
    pub(super) fn write(&self, runs: &Runs, put: &mut dyn FnMut(&[u8])) -> Option<()> {
        let renumbered = self.renumbered(runs)?;
        let are_more = runs.count > self.triangles;
        let mut writing = Writing { text: self.text, at: self.range.start, put };
        let mut sets = self.sets.iter().zip(&renumbered);
        let mut elements = Elements::within(self.text, self.range.clone());
        // The set that stands here, unless it stays: the prefix of its name, and what is still to be written of it.
        let mut open: Option<(&[u8], Option<Now<'_>>)> = None;
        while let Some(tag) = elements.next_tag() {
            match tag {
                Tag::Start(element) if is_set(&element) => {
                    let is_changed = |(set, now): &(&Set, &Vec<_>)| set.members != **now || (set.is_astray && are_more);
                    let changed = sets.next().filter(is_changed);
                    open = changed.map(|(set, now)| (prefix(element.name), Some((set.has_ranges, now.as_slice()))));
                }
                Tag::Empty(element) if is_set(&element) => _ = sets.next(),
                Tag::Start(element) | Tag::Empty(element) => {
                    let Some((prefix, now)) = open.as_mut().filter(|(prefix, _)| is_reference(&element, prefix)) else {
                        continue;
                    };
                    writing.reference(&element, prefix, now.take());
                }
                Tag::End(name, whole) => match &open {
                    Some(_) if local(name) == SET => open = None,
                    Some((prefix, _)) if is_named(name, prefix) => writing.at = whole.end,
                    _ => {}
                },
            }
        }
        writing.copy_to(self.range.end);
        Some(())
    }
}

/// The triangles of a set in the output; whether ranges of them may be written.
type Now<'n> = (bool, &'n [Range<u32>]);

const SET: &[u8] = b"triangleset";

fn is_set(element: &Element<'_>) -> bool {
    local(element.name) == SET
}

fn prefix(name: &[u8]) -> &[u8] {
    name.strip_suffix(local(name)).unwrap_or_default()
}

/// Is this the name of a reference within a set of this prefix? (Elements of others may stand there, too.)
fn is_named(name: &[u8], set: &[u8]) -> bool {
    prefix(name) == set && matches!(local(name), b"ref" | b"refrange")
}

fn is_reference(element: &Element<'_>, set: &[u8]) -> bool {
    is_named(element.name, set)
}

/// Text of sets on its way.
struct Writing<'w, 't> {
    text: &'t [u8],
    /// Up to here, the text is written.
    at: usize,
    put: &'w mut dyn FnMut(&[u8]),
}

impl Writing<'_, '_> {
    fn copy_to(&mut self, to: usize) {
        (self.put)(self.text.get(self.at..to).unwrap_or_default());
        self.at = to;
    }

    /// Writes all references of the set in the place of its first one, and nothing in the place of others. What stands between them stays, unless it is
    /// blank.
    fn reference(&mut self, element: &Element<'_>, prefix: &[u8], all: Option<Now<'_>>) {
        let before = self.text.get(self.at..element.whole.start).unwrap_or_default();
        let blanks = before.iter().rev().take_while(|byte| byte.is_ascii_whitespace()).count();
        let (kept, blank) = before.split_at(before.len() - blanks);
        (self.put)(kept);
        let begin = [blank, b"<", prefix].concat();
        let mut text = Vec::new();
        let (has_ranges, all) = all.unwrap_or_default();
        let is_range = |range: &&Range<u32>| has_ranges && range.len() > 1;
        for triangle in all.iter().filter(|range| !is_range(range)).flat_map(Range::clone) {
            text.extend_from_slice(&begin);
            // Writing to a vector cannot fail.
            let _ = write!(text, "ref index=\"{triangle}\"/>");
            self.put_if_long(&mut text);
        }
        for range in all.iter().filter(is_range) {
            text.extend_from_slice(&begin);
            let _ = write!(text, "refrange startindex=\"{}\" endindex=\"{}\"/>", range.start, range.end - 1);
            self.put_if_long(&mut text);
        }
        (self.put)(&text);
        self.at = element.whole.end;
    }

    fn put_if_long(&mut self, text: &mut Vec<u8>) {
        if text.len() >= 64 << 10 {
            (self.put)(text);
            text.clear();
        }
    }
}

/// Joins a range to others, none of which begins behind it.
fn add(all: &mut Vec<Range<u32>>, range: Range<u32>) {
    match all.last_mut() {
        Some(last) if last.end >= range.start => last.end = last.end.max(range.end),
        _ => all.push(range),
    }
}

/// All sets of a text.
fn sets(text: &[u8], range: Range<usize>, triangles: u32) -> Option<Vec<Set>> {
    let mut all: Vec<Set> = Vec::new();
    let (mut open, mut level) = (None, 0i64);
    let mut elements = Elements::within(text, range);
    while let Some(tag) = elements.next_tag() {
        match tag {
            Tag::Start(element) if is_set(&element) => {
                // A set in a set is none that is known.
                open.replace(prefix(element.name)).is_none().then_some(())?;
                all.push(Set::default());
                level += 1;
            }
            Tag::Empty(element) if is_set(&element) => all.push(Set::default()),
            Tag::Start(element) | Tag::Empty(element) => {
                if let (Some(set), Some(prefix)) = (all.last_mut(), open)
                    && is_reference(&element, prefix)
                    && let Some(all) = referred(&element)
                {
                    set.is_astray |= all.end > triangles.into();
                    let range = all.start.min(triangles.into()) as u32..all.end.min(triangles.into()) as u32;
                    if range.is_empty() {
                        continue;
                    }
                    set.has_ranges |= local(element.name) == b"refrange";
                    let set = &mut set.members;
                    // Most sets are in order, and become short at once.
                    if set.last().is_some_and(|last| last.start <= range.start) { add(set, range) } else { set.push(range) }
                }
            }
            Tag::End(name, _) if local(name) == SET => {
                open = None;
                level -= 1;
            }
            Tag::End(..) => {}
        }
    }
    // Text that is not understood ends the tags early.
    (level == 0 && elements.is_at_end()).then_some(())?;
    all.iter_mut().for_each(|set| set.members = sorted(std::mem::take(&mut set.members)));
    Some(all)
}

fn sorted(mut ranges: Vec<Range<u32>>) -> Vec<Range<u32>> {
    ranges.sort_unstable_by_key(|range| (range.start, range.end));
    let mut joined = Vec::with_capacity(ranges.len());
    ranges.into_iter().for_each(|range| add(&mut joined, range));
    joined
}

/// The numbers that a reference is to, be there such triangles or not.
fn referred(element: &Element<'_>) -> Option<Range<u64>> {
    let number = |name: &[u8]| std::str::from_utf8(element.value(name)?).ok()?.trim().parse::<u64>().ok();
    let (first, last) = match local(element.name) {
        b"ref" => (number(b"index")?, number(b"index")?),
        _ => (number(b"startindex")?, number(b"endindex")?),
    };
    (first <= last).then(|| first..last.saturating_add(1))
}

type Classes = (Vec<(u32, u32)>, Vec<Vec<u32>>);

/// The classes of triangles by the sets that they are in, and where each begins.
fn classes(sets: &[Set]) -> Option<Classes> {
    let mut events: Vec<(u32, bool, u32)> = Vec::new();
    for (number, set) in sets.iter().enumerate() {
        let number = u32::try_from(number).ok()?;
        events.extend(set.members.iter().flat_map(|range| [(range.start, true, number), (range.end, false, number)]));
    }
    events.sort_unstable();
    let (mut known, mut active) = (BTreeMap::from([(Vec::new(), IN_NONE)]), BTreeSet::new());
    let (mut stretches, mut work) = (Vec::new(), 0);
    for here in events.chunk_by(|a, b| a.0 == b.0) {
        for (_, begins, set) in here {
            if *begins {
                active.insert(*set)
            } else {
                active.remove(set)
            };
        }
        work += active.len();
        if work > MOST {
            return None;
        }
        let next = known.len() as u32;
        let class = *known.entry(active.iter().copied().collect()).or_insert(next);
        stretches.extend(here.first().map(|(first, ..)| (*first, class)));
    }
    let mut classes = vec![Vec::new(); known.len()];
    for (sets, class) in known {
        *classes.get_mut(class as usize)? = sets;
    }
    Some((stretches, classes))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn written(text: &str, triangles: u32, sources: &[Option<u32>]) -> Option<String> {
        let sets = Sets::parse(text.as_bytes(), 0..text.len(), triangles)?;
        let mut runs = Runs::default();
        sources.iter().for_each(|source| runs.push(source.map_or(IN_NONE, |source| sets.class_of(source))));
        let mut out = Vec::new();
        sets.write(&runs, &mut |bytes| out.extend_from_slice(bytes))?;
        Some(String::from_utf8(out).unwrap())
    }

    fn kept(range: Range<u32>) -> Vec<Option<u32>> {
        range.map(Some).collect()
    }

    const TEXT: &str = "<t:trianglesets>\n <t:triangleset name=\"front\" identifier=\"a\">\n  <t:ref index=\"1\"/>\n  <t:refrange startindex='3'\n endindex=\"5\" />\n \
        </t:triangleset>\n <t:triangleset identifier='b' name=\"all\"><t:refrange startindex=\"0\" endindex=\"9\"/></t:triangleset>\n</t:trianglesets>";

    #[test]
    fn sets_of_the_same_numbers_stay_byte_for_byte() {
        assert_eq!(written(TEXT, 10, &kept(0..10)).as_deref(), Some(TEXT));
    }

    #[test]
    fn references_are_those_of_the_new_numbers() {
        // Triangle 1 is cut into three, 4 is gone, and two new ones are in no set.
        let sources = [&[Some(0), Some(1), Some(1), Some(1), Some(2), Some(3)][..], &kept(5..10), &[None; 2]].concat();
        let expected = TEXT
            .replace(
                "  <t:ref index=\"1\"/>\n  <t:refrange startindex='3'\n endindex=\"5\" />",
                "  <t:refrange startindex=\"1\" endindex=\"3\"/>\n  <t:refrange startindex=\"5\" endindex=\"6\"/>",
            )
            .replace("endindex=\"9\"", "endindex=\"10\"");
        assert_eq!(written(TEXT, 10, &sources), Some(expected));
    }

    #[test]
    fn single_triangles_stand_first_and_all_but_references_stays() {
        let text = "<trianglesets><triangleset name=\"a\"><refrange startindex=\"0\" endindex=\"2\"></refrange><!-- a note --><x:ref index=\"0\"/>\
            <ref index=\"4\"/></triangleset><triangleset name=\"empty\"/></trianglesets>";
        // The last triangle stands first.
        let sources = [&[Some(4)][..], &kept(0..4)].concat();
        let same = written(text, 5, &sources);
        let expected = "<trianglesets><triangleset name=\"a\"><refrange startindex=\"0\" endindex=\"3\"/><!-- a note --><x:ref index=\"0\"/>\
            </triangleset><triangleset name=\"empty\"/></trianglesets>";
        assert_eq!(same.as_deref(), Some(expected));
        let apart = written(text, 5, &[Some(0), Some(1), Some(3), Some(4)]);
        assert!(apart.unwrap().contains("<ref index=\"3\"/><refrange startindex=\"0\" endindex=\"1\"/><!-- a note -->"));
        let gone = written(text, 5, &[Some(3)]);
        assert!(gone.unwrap().contains("<triangleset name=\"a\"><!-- a note --><x:ref index=\"0\"/></triangleset>"));
    }

    #[test]
    fn a_set_without_ranges_gets_none() {
        let text = "<triangleset>\n<ref index=\"2\"/> <ref index=\"1\"/>\n</triangleset>";
        let expected = "<triangleset>\n<ref index=\"0\"/>\n<ref index=\"1\"/>\n<ref index=\"2\"/>\n</triangleset>";
        assert_eq!(written(text, 4, &[Some(1), Some(2), Some(2), Some(3)]).as_deref(), Some(expected));
    }

    #[test]
    fn what_is_not_understood_is_none() {
        let nested = "<s><triangleset><triangleset><ref index=\"0\"/></triangleset></triangleset></s>";
        let cut = "<s><triangleset><ref index=\"0";
        for text in [nested, cut, "<s><triangleset><ref index=0/></triangleset></s>"] {
            assert_eq!(written(text, 3, &kept(0..3)), None, "{text}");
        }
        // A reference to nothing is none, and is not written anew.
        let astray = "<s><triangleset><ref index=\"7\"/><ref index=\"-1\"/><ref/><refrange startindex=\"2\" endindex=\"1\"/><ref index=\"2\"/></triangleset></s>";
        assert_eq!(written(astray, 3, &kept(1..3)).as_deref(), Some("<s><triangleset><ref index=\"1\"/></triangleset></s>"));
    }

    /// Each set begins where no other does, and all of them meet in one triangle: at each place as many are open as began before it.
    #[test]
    fn too_many_sets_of_too_many_triangles_are_none() {
        let all = 3_000;
        let set = |k| format!("<triangleset><refrange startindex=\"{}\" endindex=\"{}\"/></triangleset>", k, all + k);
        let text: String = (0..all).map(set).collect();
        assert!(Sets::parse(text.as_bytes(), 0..text.len(), 2 * all).is_none());
    }

    proptest! {
        /// Sets written and read again hold the triangles whose sources they held.
        #[test]
        fn each_triangle_is_in_the_sets_of_its_source(
            sets in prop::collection::vec(prop::collection::vec((0u32..20, 0u32..6), 1..5), 1..5),
            sources in prop::collection::vec(prop::option::of(0u32..20), 0..40),
        ) {
            let reference = |(from, more): &(u32, u32)| match more {
                0 => format!("<ref index=\"{from}\"/>"),
                _ => format!("<refrange startindex=\"{from}\" endindex=\"{}\"/>", from + more),
            };
            let set = |refs: &Vec<(u32, u32)>| format!("<triangleset>{}</triangleset>", refs.iter().map(reference).collect::<String>());
            let text: String = sets.iter().map(set).collect();
            let now = written(&text, 20, &sources).unwrap();
            let count = sources.len() as u32;
            let back = super::sets(now.as_bytes(), 0..now.len(), count).unwrap();
            prop_assert_eq!(back.len(), sets.len());
            for (set, Set { members, .. }) in sets.iter().zip(back) {
                let holds = |k: u32| set.iter().any(|(from, more)| (*from..=from + more).contains(&k));
                for (k, source) in (0..).zip(&sources) {
                    prop_assert_eq!(members.iter().any(|range| range.contains(&k)), source.is_some_and(holds), "{}", &now);
                }
            }
        }
    }
}
