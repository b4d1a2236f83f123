//! Triangles of a file as an STL of their own, without a name, which goes the way of a file.

use std::fs::File;
use std::path::Path;

use crate::contract::error::Result;
use crate::engine::files;
use crate::engine::work::Work;
use crate::io::read::{HEADER_BYTES, MeshFile, PREFIX_BYTES};
use crate::io::record::Record;
use crate::io::write_behind::{self, Nameless};

/// Records that are appended at once.
const APPENDED: usize = 1 << 14;

/// These records as an STL, opened; it is there as long as the second value is held. Errors and reports name it `path`. `passed` is called where the pages of
/// records before may go.
///
/// # Errors
/// [`crate::Error::NoSpace`], [`crate::Error::Io`].
pub(super) fn open(
    path: &Path,
    header: &[u8; HEADER_BYTES],
    records: &[Record],
    passed: impl Fn(),
    work: Work<'_>,
) -> Result<(MeshFile, Nameless)> {
    let spool = Nameless::of(write(path, header, records, passed, work)?);
    Ok((files::open(&spool.path(), work.limits, work.progress)?.called(path), spool))
}

fn write(path: &Path, header: &[u8; HEADER_BYTES], records: &[Record], passed: impl Fn(), work: Work<'_>) -> Result<File> {
    let bytes = (PREFIX_BYTES + size_of_val(records)) as u64;
    write_behind::spooled(path, work.limits, (bytes, "the triangles of an object"), |append| {
        append(header)?;
        append(&(records.len() as u32).to_le_bytes())?;
        records.chunks(APPENDED).try_for_each(|chunk| {
            append(chunk.as_flattened())?;
            passed();
            Ok(())
        })
    })
}
