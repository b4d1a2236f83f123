//! The end of an archive, which says where its central directory lies (APPNOTE 4.3.14 to 4.3.16).

use std::ops::Range;

use super::super::finding::Rejection;
use super::fields::{long, short, word};
use crate::util::words::Count;

const END: [u8; 4] = *b"PK\x05\x06";
const END_BYTES: usize = 22;
const END64: u32 = 0x0606_4b50;
const END64_BYTES: usize = 56;
const LOCATOR: u32 = 0x0706_4b50;
const LOCATOR_BYTES: usize = 20;
/// Bytes of a comment, at most.
const COMMENT: usize = 0xffff;
/// Entries of an archive, at most: no package of a print has more, and each costs memory.
pub(super) const MOST_ENTRIES: u64 = 65_536;

/// The central directory.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Directory {
    pub(super) bytes: Range<usize>,
    /// As many as there is room for, at most.
    pub(super) entries: usize,
}

/// The fields of the end of an archive.
#[derive(Clone, Copy, Debug)]
struct End {
    disks: [u32; 2],
    entries_here: u64,
    entries: u64,
    size: u64,
    offset: u64,
}

/// Finds the central directory.
pub(super) fn directory(bytes: &[u8]) -> Result<Directory, Rejection> {
    let refuse = |reason: String| Err(Rejection::Unreadable(reason));
    let Some((at, end)) = find(bytes) else {
        return refuse("the end of the ZIP archive is missing, it is cut off or damaged".into());
    };
    let (limit, end) = match locate(bytes, at) {
        Ok(None) => (at, end),
        Ok(Some((limit, wide))) if agree(end, wide) => (limit, wide),
        Ok(Some(_)) => return refuse("the archive has two ends that disagree".into()),
        Err(()) => return refuse("the archive's ZIP64 end is damaged".into()),
    };
    if end.disks != [0, 0] || end.entries_here != end.entries {
        return refuse("a part of an archive of several disks".into());
    }
    if end.entries > MOST_ENTRIES {
        return refuse(format!("an archive of {} entries, more than {}", Count(end.entries), Count(MOST_ENTRIES)));
    }
    let range = usize::try_from(end.offset).ok().zip(end.offset.checked_add(end.size).and_then(|to| usize::try_from(to).ok()));
    match range {
        Some((from, to)) if to <= limit => {
            let entries = end.entries as usize;
            if entries > (to - from) / super::central::HEADER_BYTES {
                return refuse(format!(
                    "the archive claims {} entries, its central directory has no room for them",
                    Count(entries)
                ));
            }
            Ok(Directory { bytes: from..to, entries })
        }
        _ => refuse("the archive's central directory is not where the archive says".into()),
    }
}

/// The last end record whose comment ends with the file.
fn find(bytes: &[u8]) -> Option<(usize, End)> {
    let first = bytes.len().saturating_sub(END_BYTES + COMMENT);
    let tail = bytes.get(first..)?;
    memchr::memmem::rfind_iter(tail, &END).find_map(|at| {
        let record = tail.get(at..)?;
        let comment = usize::from(short(record, 20)?);
        (record.len() == END_BYTES + comment).then_some(())?;
        let end = End {
            disks: [short(record, 4)?.into(), short(record, 6)?.into()],
            entries_here: short(record, 8)?.into(),
            entries: short(record, 10)?.into(),
            size: word(record, 12)?.into(),
            offset: word(record, 16)?.into(),
        };
        Some((first + at, end))
    })
}

/// The ZIP64 end before the end at byte `at`, and where it begins, if there is one. An error where it is damaged.
fn locate(bytes: &[u8], at: usize) -> Result<Option<(usize, End)>, ()> {
    let Some(locator) = at.checked_sub(LOCATOR_BYTES).and_then(|from| bytes.get(from..at)) else { return Ok(None) };
    if word(locator, 0) != Some(LOCATOR) {
        return Ok(None);
    }
    let read = || {
        let from = usize::try_from(long(locator, 8)?).ok()?;
        let record = bytes.get(from..at - LOCATOR_BYTES)?;
        let whole = record.len() >= END64_BYTES && word(record, 0)? == END64 && word(locator, 4)? == 0;
        whole.then_some(())?;
        let end = End {
            disks: [word(record, 16)?, word(record, 20)?],
            entries_here: long(record, 24)?,
            entries: long(record, 32)?,
            size: long(record, 40)?,
            offset: long(record, 48)?,
        };
        Some((from, end))
    };
    read().map(Some).ok_or(())
}

/// The fields of the short end are those of the wide one, or say by all bits set that they stand there.
fn agree(short: End, wide: End) -> bool {
    let same = |short: u64, wide: u64, all: u64| short == wide || short == all;
    let disks = short.disks.iter().zip(wide.disks).all(|(short, wide)| same((*short).into(), wide.into(), 0xffff));
    disks
        && same(short.entries_here, wide.entries_here, 0xffff)
        && same(short.entries, wide.entries, 0xffff)
        && same(short.size, wide.size, 0xffff_ffff)
        && same(short.offset, wide.offset, 0xffff_ffff)
}
