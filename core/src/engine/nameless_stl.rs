//! Triangles of a file as an STL of their own, without a name, which goes the way of a file.

use std::fs::File;
use std::os::unix::fs::FileExt;
use std::path::Path;

use crate::contract::error::{Error, Result};
use crate::engine::files;
use crate::engine::work::Work;
use crate::io::read::{HEADER_BYTES, MeshFile, PREFIX_BYTES};
use crate::io::record::Record;
use crate::io::write_behind::{self, Nameless};

/// A mesh in a file without a name, which is there as long as the second value is held.
pub(super) type Spooled = (MeshFile, Nameless);

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
) -> Result<Spooled> {
    let spool = Nameless::of(write(path, header, records, passed, work)?);
    Ok((files::open(&spool.path(), work.limits, work.progress)?.called(path), spool))
}

/// The same of at most so many records, which `fill` appends bit by bit.
///
/// # Errors
/// [`crate::Error::NoSpace`], [`crate::Error::Io`], those of `fill`.
pub(super) fn filled(
    path: &Path,
    most: usize,
    work: Work<'_>,
    fill: impl FnOnce(&mut dyn FnMut(&[Record]) -> Result<()>) -> Result<()>,
) -> Result<Spooled> {
    let bytes = (PREFIX_BYTES + most * size_of::<Record>()) as u64;
    let mut count = 0_u32;
    let file = write_behind::spooled(path, work.limits, (bytes, "the triangles of a pass"), |append| {
        append(&[0; PREFIX_BYTES])?;
        fill(&mut |records| {
            count += records.len() as u32;
            append(records.as_flattened())
        })
    })?;
    let counted = file.write_all_at(&count.to_le_bytes(), HEADER_BYTES as u64);
    counted.map_err(Error::io(&work.limits.spool_folder(), "spooling"))?;
    let spool = Nameless::of(file);
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
