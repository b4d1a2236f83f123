//! A ZIP archive, read safely.
//!
//! **In:** the bytes of an archive, mapped.
//! **Out:** its [`Entry`]s in the order of the central directory, each with the bytes that a writer copies for it; an entry's plain bytes, in memory or
//! in a spool.
//! **Promise:** each refusal names the entry. Two readers cannot read two things: duplicate names, overlapping entries, and a local header that
//! disagrees with the central directory are refused. Memory depends on the bytes that are there, never on a count or a size that the archive
//! claims. Nothing is unpacked to a path.
//!
//! By PKWARE's APPNOTE.TXT 6.3.10 (sections 4.3 to 4.5) and RFC 1951. The directory is read here and not by the crate `zip` (9.8): that lets a later
//! entry of a name replace the earlier one in silence, takes overlapping entries, and does not hold local headers against the directory.
//! Deflate is `flate2` on zlib-rs: Rust alone, and fast.

#[cfg(test)]
pub(crate) mod build;
mod central;
mod end;
mod entry;
mod fields;
mod inflate;
mod list;
mod local;
mod name;
#[cfg(test)]
mod tests;

pub(crate) use entry::Entry;
pub(crate) use list::Archive;
pub(crate) use name::shown;
