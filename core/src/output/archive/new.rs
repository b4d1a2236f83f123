//! An archive of new entries.

use std::path::Path;

use super::headers::{Label, Placed};
use super::writer::Writer;
use crate::contract::error::Result;
use crate::contract::progress::Progress;
use crate::contract::settings::Limits;

/// Takes the bytes of a content one after the other.
pub(crate) type Sink<'s> = dyn FnMut(&[u8]) -> Result<()> + Send + 's;

/// Gives a content to a sink.
pub(crate) type Fill<'p> = Box<dyn FnOnce(&mut Sink<'_>) -> Result<()> + Send + 'p>;

/// A new entry.
pub(crate) struct Part<'p> {
    pub(crate) name: &'p str,
    /// Bytes of the content, at most.
    pub(crate) most: u64,
    pub(crate) fill: Fill<'p>,
}

/// Writes these entries, whose names are ASCII, to the new file `output`, and syncs it unless that is deferred. Call it within a pool of threads.
///
/// # Errors
/// [`crate::Error::Io`], cancellation among them, and those of the content.
pub(crate) fn write_new(parts: Vec<Part<'_>>, output: &Path, limits: &Limits, progress: &dyn Progress) -> Result<()> {
    let mut writer = Writer::new(output, limits, progress)?;
    let mut placed: Vec<(&str, Placed)> = Vec::with_capacity(parts.len());
    for Part { name, most, fill } in parts {
        let there = writer.pack((&Label::new(name), 0), most, |content| fill(&mut |bytes| content.put(bytes)))?;
        placed.push((name, there));
    }
    writer.finish(placed.iter().map(|(name, there)| (Label::new(name), there)), limits)
}

#[cfg(test)]
mod tests {
    use std::io::Read;

    use super::*;
    use crate::contract::progress::Quiet;
    use crate::io::read::Archive;
    use crate::util::parallel;

    /// Bytes that do not repeat soon.
    fn noise(length: usize) -> Vec<u8> {
        (0..length as u32).map(|k| (k.wrapping_mul(2_654_435_761) >> 13) as u8).collect()
    }

    /// An archive of entries of these contents, given in pieces of this length.
    fn archive(contents: &[Vec<u8>], piece: usize, most: u64, threads: usize) -> Vec<u8> {
        let folder = tempfile::tempdir().unwrap();
        let output = folder.path().join("out");
        let names: Vec<String> = (0..contents.len()).map(|k| format!("{k}.bin")).collect();
        let part = |(name, content): (&'static str, Vec<u8>)| Part {
            name,
            most: most.max(content.len() as u64),
            fill: Box::new(move |sink: &mut Sink<'_>| content.chunks(piece).try_for_each(sink)),
        };
        let parts = names.into_iter().map(|name| &*name.leak()).zip(contents.iter().cloned()).map(part).collect();
        let limits = Limits { threads, ..Limits::default() };
        parallel::in_pool(threads, || write_new(parts, &output, &limits, &Quiet)).unwrap();
        std::fs::read(output).unwrap()
    }

    /// Blocks are of 1 MiB: just so many, a little less, a little more, and more than are deflated at once.
    #[test]
    fn contents_are_read_again_whatever_their_lengths_and_the_threads() {
        let block = 1 << 20;
        let contents: Vec<Vec<u8>> = [0, 1, block - 1, block, block + 1, 2 * block, 9 * block].map(noise).into();
        let first = archive(&contents, 300_000, 0, 1);
        for (piece, threads) in [(300_000, 3), (block, 1), (5 * block, 2)] {
            assert!(archive(&contents, piece, 0, threads) == first, "{piece} {threads}");
        }
        // Headers are as wide as the contents may become.
        for bytes in [first, archive(&contents, block, 1 << 33, 2)] {
            let archive = Archive::open(&bytes).map_err(|rejection| rejection.at(Path::new("a"))).unwrap();
            assert_eq!(archive.entries.len(), contents.len());
            for (entry, content) in archive.entries.iter().zip(&contents) {
                let mut plain = Vec::new();
                flate2::read::DeflateDecoder::new(&bytes[entry.data.clone()]).read_to_end(&mut plain).unwrap();
                assert!(plain == *content && entry.crc == crc32fast::hash(content), "{}", entry.name);
            }
        }
    }

    #[test]
    fn an_error_of_a_content_is_that_of_the_archive() {
        let folder = tempfile::tempdir().unwrap();
        let failed = || crate::Error::cancelled(Path::new("a"), "making text");
        let part = Part { name: "a", most: 9, fill: Box::new(|_: &mut Sink<'_>| Err(failed())) };
        let result = write_new(vec![part], &folder.path().join("out"), &Limits::default(), &Quiet);
        assert!(result.unwrap_err().is_cancellation());
    }
}
