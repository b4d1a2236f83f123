//! A ZIP archive, written: entries that are new or changed are packed, all others are copied as they stand.
//!
//! **In:** an [`Archive`], and the new content of some of its entries; or the names of new entries, and their content piece by piece.
//! **Out:** an archive of the same entries in the same order; or of the new ones.
//! **Promise:** local header, data and descriptor of an entry that is kept are the same bytes. The same bytes come out for any number of threads, and at
//! any time.
//!
//! By PKWARE's APPNOTE.TXT 6.3.10, sections 4.3 and 4.5.3.

mod headers;
mod new;
mod writer;

use std::path::Path;

use crate::contract::error::Result;
use crate::contract::progress::Progress;
use crate::contract::settings::Limits;
use crate::io::read::{Archive, Entry};
use crate::util::parallel;
use headers::{Label, Placed, short};
pub(crate) use new::{Part, Sink, write_new};
use writer::{BLOCK, Writer};

/// Writes `archive` to the new file `output`, with the content that `replaced` gives for the entry of a number, and syncs it unless that is deferred.
///
/// # Errors
/// [`crate::Error::Io`], cancellation among them.
pub(crate) fn write<'c>(
    archive: &Archive<'_>,
    replaced: impl Fn(usize) -> Option<&'c [u8]>,
    output: &Path,
    limits: &Limits,
    progress: &dyn Progress,
) -> Result<()> {
    let mut writer = Writer::new(output, limits, progress)?;
    // In the order in which they stand in the archive.
    let mut order: Vec<usize> = (0..archive.entries.len()).collect();
    order.sort_by_key(|number| archive.entries.get(*number).map(|entry| entry.whole.start));
    let mut placed: Vec<(usize, &Entry, Placed)> = Vec::with_capacity(order.len());
    for number in order {
        let Some(entry) = archive.entries.get(number) else { continue };
        let there = match replaced(number) {
            Some(content) => parallel::in_pool(limits.threads, || pack(&mut writer, archive, entry, content, progress))?,
            None => keep(&mut writer, archive, entry)?,
        };
        placed.push((number, entry, there));
    }
    placed.sort_by_key(|(number, ..)| *number);
    writer.finish(placed.iter().map(|(_, entry, there)| (label(archive, entry), there)), limits)
}

fn label<'l>(archive: &Archive<'l>, entry: &'l Entry) -> Label<'l> {
    let listed = archive.bytes.get(entry.listed.clone()).unwrap_or_default();
    Label { name: &entry.raw_name, time: entry.time, listed }
}

fn keep(writer: &mut Writer<'_>, archive: &Archive<'_>, entry: &Entry) -> Result<Placed> {
    let at = writer.at();
    for part in archive.bytes.get(entry.whole.clone()).unwrap_or_default().chunks(BLOCK) {
        writer.append(part)?;
    }
    let version = short(label(archive, entry).listed, 6);
    let Entry { flags, crc, packed, plain, .. } = *entry;
    Ok(Placed { at, version, flags, method: entry.method.number(), crc, packed, plain })
}

fn pack(
    writer: &mut Writer<'_>,
    archive: &Archive<'_>,
    entry: &Entry,
    content: &[u8],
    progress: &dyn Progress,
) -> Result<Placed> {
    let total = content.len() as u64;
    let mut done = 0;
    writer.pack((&label(archive, entry), entry.flags), total, |packing| {
        content.chunks(BLOCK).try_for_each(|block| {
            packing.put(block)?;
            done += block.len() as u64;
            progress.at("pack", done, total);
            Ok(())
        })
    })
}
