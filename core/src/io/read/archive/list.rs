//! All entries of an archive, checked against each other.

use super::super::finding::Rejection;
use super::entry::Entry;
use super::name::{self, Names, refused};
use super::{central, end, local};
use crate::util::words::Count;

/// Plain bytes of all entries together, at most.
const MOST_PLAIN: u64 = 64 << 30;
/// Plain bytes of a small archive. A larger one unpacks to no more than this many times its size. Models shrink to a tenth; deflate can shrink zeros to
/// a thousandth (RFC 1951: 258 bytes in two bits), and what was shrunk is to be read in a few seconds.
pub(super) const HARMLESS: u64 = 64 << 20;
pub(super) const MOST_TIMES: u64 = 200;
/// The digital signature behind the headers of a central directory (APPNOTE 4.3.13).
const SIGNATURE: &[u8] = b"PK\x05\x05";

/// An archive whose directory was read and checked.
#[derive(Debug)]
pub(crate) struct Archive<'a> {
    pub(crate) bytes: &'a [u8],
    /// In the order of the central directory.
    pub(crate) entries: Vec<Entry>,
    names: Names,
}

impl<'a> Archive<'a> {
    /// `bytes` begin as a ZIP archive does: with an entry, or with the end of an archive without any.
    pub(crate) fn looks_like(bytes: &[u8]) -> bool {
        bytes.starts_with(b"PK\x03\x04") || bytes.starts_with(b"PK\x05\x06")
    }

    /// Lists an archive. O(n log n) in its entries; about 200 bytes of memory for each, besides its name.
    ///
    /// # Errors
    /// A reason that names the entry.
    pub(crate) fn open(bytes: &'a [u8]) -> Result<Self, Rejection> {
        let directory = end::directory(bytes)?;
        let mut entries = Vec::new();
        let (mut names, mut plain, mut at) = (Names::default(), 0u64, directory.bytes.start);
        for number in 1..=directory.entries {
            let rest = bytes.get(at..directory.bytes.end).unwrap_or_default();
            let listed = central::read(rest, number)?;
            names.add(listed.name)?;
            plain = plain.saturating_add(listed.plain);
            if plain > MOST_PLAIN {
                let reason = format!("the archive unpacks to more than {} GiB", Count(MOST_PLAIN >> 30));
                return Err(Rejection::Unreadable(reason));
            }
            let times = plain / (bytes.len() as u64).max(1);
            if plain > HARMLESS && times > MOST_TIMES {
                let reason = format!("the archive claims to unpack to {} times its size, as no model does", Count(times));
                return Err(Rejection::Unreadable(reason));
            }
            // An entry ends before the directory does begin.
            let (whole, data) = local::check(bytes.get(..directory.bytes.start).unwrap_or_default(), &listed)?;
            entries.push(Entry {
                name: name::text(listed.name),
                raw_name: listed.name.to_vec(),
                method: listed.method,
                packed: listed.packed,
                plain: listed.plain,
                crc: listed.crc,
                flags: listed.flags,
                time: listed.time,
                whole,
                data,
                listed: at..at + listed.length,
            });
            at += listed.length;
        }
        let rest = bytes.get(at..directory.bytes.end).unwrap_or_default();
        if !rest.is_empty() && !rest.starts_with(SIGNATURE) {
            let reason = "the archive's central directory goes on behind its last entry";
            return Err(Rejection::Unreadable(reason.into()));
        }
        check_overlap(&entries)?;
        Ok(Self { bytes, entries, names })
    }

    /// The entry of this name, whatever the case of its ASCII letters.
    pub(crate) fn find(&self, name: &str) -> Option<&Entry> {
        self.entries.get(self.names.find(name)?)
    }
}

/// Refuses entries that share bytes: a small file would unpack to many times what is possible for each alone.
fn check_overlap(entries: &[Entry]) -> Result<(), Rejection> {
    let mut order: Vec<&Entry> = entries.iter().collect();
    order.sort_by_key(|entry| (entry.whole.start, entry.whole.end));
    for pair in order.windows(2) {
        if let [before, entry] = pair
            && before.whole.end > entry.whole.start
        {
            return Err(refused(&entry.name, format!("overlaps the entry {}", name::shown(&before.name))));
        }
    }
    Ok(())
}
