//! The content of an entry: in memory if it is small, else in a file without a name.

use flate2::{Decompress, FlushDecompress, Status};

use super::super::finding::Rejection;
use super::super::spool::{Context, Items};
use super::entry::{Entry, Method};
use super::list::{Archive, HARMLESS, MOST_TIMES};
use super::name::refused;
use crate::contract::error::{Error, Result};
use crate::util::words::Count;

/// Bytes made between two looks at whether the work goes on.
const STEP: usize = 256 << 10;
/// An entry that is read into memory has no more bytes.
const SMALL: u64 = 1 << 20;

/// Why the content of an entry is not read: damage, or what became of it on its way.
enum Failure {
    Damaged(String),
    Other(Error),
}

impl Archive<'_> {
    /// The content of a small entry.
    ///
    /// # Errors
    /// [`Error::Unreadable`] if it is damaged, has more bytes than it claims, or more than a MiB.
    pub(crate) fn small(&self, entry: &Entry, context: &Context<'_>) -> Result<Vec<u8>> {
        if entry.plain > SMALL {
            let reason = format!("has {} bytes, more than the {} that it may have", Count(entry.plain), Count(SMALL));
            return Err(refused(&entry.name, reason).at(context.path));
        }
        let mut content = Vec::with_capacity(entry.plain as usize);
        self.unpack(entry, context, |bytes| {
            content.extend_from_slice(bytes);
            Ok(())
        })?;
        Ok(content)
    }

    /// The content of an entry, in a spool. Memory: half a MiB, and dirty pages that are bounded.
    ///
    /// # Errors
    /// [`Error::NoSpace`] if there is no room for the bytes that the entry claims, [`Error::Unreadable`] if it is damaged or has more of them,
    /// [`Error::Io`], also when the progress cancels.
    pub(crate) fn spooled(&self, entry: &Entry, context: &Context<'_>) -> Result<Items<1>> {
        if entry.plain > HARMLESS && entry.plain / entry.packed.max(1) > MOST_TIMES {
            let reason =
                format!("claims to unpack to {} times its size, as no model does", Count(entry.plain / entry.packed.max(1)));
            return Err(refused(&entry.name, reason).at(context.path));
        }
        context.make_room(entry.plain, "the content of the archive")?;
        let mut spool = context.text()?;
        self.unpack(entry, context, |bytes| spool.append(bytes.as_chunks().0))?;
        spool.map()
    }

    /// Gives the content piece by piece, and checks its length and its checksum.
    fn unpack(&self, entry: &Entry, context: &Context<'_>, mut take: impl FnMut(&[u8]) -> Result<()>) -> Result<()> {
        let packed = self.bytes.get(entry.data.clone()).unwrap_or_default();
        let (mut hasher, mut length) = (crc32fast::Hasher::new(), 0u64);
        let mut sink = |bytes: &[u8]| {
            length += bytes.len() as u64;
            if length > entry.plain {
                return Err(Failure::Damaged(format!("unpacks to more than the {} bytes that it claims", Count(entry.plain))));
            }
            hasher.update(bytes);
            if context.progress.cancelled() {
                return Err(Failure::Other(Error::cancelled(context.path, "reading")));
            }
            take(bytes).map_err(Failure::Other)
        };
        let done = match entry.method {
            // Folders, and whatever else has nothing in it.
            _ if entry.packed == 0 => Ok(()),
            Method::Stored => packed.chunks(STEP).try_for_each(&mut sink),
            Method::Deflated => inflate(packed, &mut sink),
        };
        let refuse = |reason: String| -> Rejection { refused(&entry.name, reason) };
        match done {
            Err(Failure::Other(error)) => return Err(error),
            Err(Failure::Damaged(reason)) => return Err(refuse(reason).at(context.path)),
            Ok(()) => {}
        }
        if length != entry.plain {
            let reason = format!("unpacks to {} bytes, and claims {}", Count(length), Count(entry.plain));
            return Err(refuse(reason).at(context.path));
        }
        // No fuzzer finds a checksum.
        if !cfg!(fuzzing) && hasher.finalize() != entry.crc {
            return Err(refuse("is damaged: its checksum is wrong".into()).at(context.path));
        }
        Ok(())
    }
}

/// Inflates all of `packed`, in pieces.
fn inflate(packed: &[u8], sink: &mut impl FnMut(&[u8]) -> std::result::Result<(), Failure>) -> std::result::Result<(), Failure> {
    let damaged = |reason: &str| Failure::Damaged(reason.into());
    let mut stream = Decompress::new(false);
    let mut buffer = vec![0; STEP];
    let mut rest = packed;
    loop {
        let (read, made) = (stream.total_in(), stream.total_out());
        let status = stream.decompress(rest, &mut buffer, FlushDecompress::None);
        let status = status.map_err(|_| damaged("is damaged: its data is no deflate stream"))?;
        let used = (stream.total_in() - read) as usize;
        let fresh = (stream.total_out() - made) as usize;
        rest = rest.get(used..).unwrap_or_default();
        sink(buffer.get(..fresh).unwrap_or_default())?;
        match status {
            Status::StreamEnd if rest.is_empty() => return Ok(()),
            Status::StreamEnd => return Err(damaged("has bytes behind the end of its data")),
            // Neither input taken nor output made: the stream wants more than there is.
            Status::Ok | Status::BufError if used == 0 && fresh == 0 => {
                return Err(damaged("is damaged: its data is cut off"));
            }
            Status::Ok | Status::BufError => {}
        }
    }
}
