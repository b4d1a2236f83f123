//! Reading binary STL, strictly: the length must be what the count says.

use std::fs::File;
use std::io::{BufReader, Read};
use std::path::{Path, PathBuf};

use super::judgement::Triangle;

/// Bytes before the first record.
const HEADER: u64 = 84;
/// Bytes of a record.
pub(super) const RECORD: usize = 50;

/// Why a file cannot be judged.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "each variant says what its fields are")]
pub enum Error {
    /// Reading failed.
    #[error("{}: {source}", path.display())]
    Io { path: PathBuf, source: std::io::Error },
    /// Not a binary STL, or its length is not what its count says.
    #[error("{}: no binary STL: {reason}", path.display())]
    Format { path: PathBuf, reason: String },
    /// Corners are numbered in 32 bits.
    #[error("{}: {triangles} triangles are more than can be judged", path.display())]
    TooMany { path: PathBuf, triangles: u64 },
}

/// The result of judging.
pub type Result<T> = std::result::Result<T, Error>;

/// One corner: a position as it sorts, and which corner of which triangle it is.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Corner {
    pub(super) position: [u32; 3],
    pub(super) number: u32,
}

/// A file's finite triangles.
#[derive(Default)]
pub(super) struct Soup {
    /// Three for each triangle, in file order.
    pub(super) corners: Vec<Corner>,
    pub(super) nonfinite: u64,
}

/// A binary STL, opened for reading its records in order.
pub(super) struct Records {
    path: PathBuf,
    reader: BufReader<File>,
    pub(super) count: u32,
    /// The header begins with `solid`, as a text does: whoever goes by that word misreads the file.
    pub(super) solid: bool,
}

impl Records {
    /// Corners must be countable in 32 bits.
    const MOST: u32 = u32::MAX / 3;

    pub(super) fn open(path: &Path) -> Result<Self> {
        let io = |source| Error::Io { path: path.into(), source };
        let format = |reason| Error::Format { path: path.into(), reason };
        let file = File::open(path).map_err(io)?;
        let length = file.metadata().map_err(io)?.len();
        let mut reader = BufReader::with_capacity(1 << 20, file);
        if length < HEADER {
            return Err(format(format!("{length} bytes are less than a header")));
        }
        let mut header = [0; HEADER as usize];
        reader.read_exact(&mut header).map_err(io)?;
        let [.., a, b, c, d] = header;
        let count = u32::from_le_bytes([a, b, c, d]);
        if length != HEADER + RECORD as u64 * u64::from(count) {
            return Err(format(format!("{count} triangles are promised, but the file has {length} bytes")));
        }
        if count > Self::MOST {
            return Err(Error::TooMany { path: path.into(), triangles: count.into() });
        }
        let solid = header[..5].eq_ignore_ascii_case(b"solid");
        Ok(Self { path: path.into(), reader, count, solid })
    }

    /// Calls `each` with every record and its number.
    pub(super) fn for_each(mut self, mut each: impl FnMut(u32, &[u8; RECORD])) -> Result<()> {
        let mut record = [0; RECORD];
        for index in 0..self.count {
            self.reader.read_exact(&mut record).map_err(|source| Error::Io { path: self.path.clone(), source })?;
            each(index, &record);
        }
        Ok(())
    }
}

impl Soup {
    pub(super) fn of(triangles: &[Triangle]) -> Self {
        let mut soup = Self { corners: Vec::with_capacity(3 * triangles.len()), nonfinite: 0 };
        triangles.iter().for_each(|&triangle| soup.push(triangle));
        soup
    }

    pub(super) fn read(path: &Path) -> Result<Self> {
        let records = Records::open(path)?;
        let mut soup = Self { corners: Vec::with_capacity(3 * records.count as usize), nonfinite: 0 };
        records.for_each(|_, record| soup.push(vertices(record)))?;
        Ok(soup)
    }

    /// Adds a triangle, or counts it when it has a coordinate that is no number.
    pub(super) fn push(&mut self, triangle: [[f32; 3]; 3]) {
        if !triangle.iter().flatten().all(|x| x.is_finite()) {
            self.nonfinite += 1;
            return;
        }
        for position in triangle {
            self.corners.push(Corner { position: position.map(order), number: self.corners.len() as u32 });
        }
    }
}

/// The three corners of a record.
fn vertices(record: &[u8; RECORD]) -> [[f32; 3]; 3] {
    let number = |at: usize| f32::from_le_bytes([record[at], record[at + 1], record[at + 2], record[at + 3]]);
    std::array::from_fn(|corner| std::array::from_fn(|axis| number(12 + 12 * corner + 4 * axis)))
}

/// Finite numbers as integers in the same order, both zeros alike.
fn order(x: f32) -> u32 {
    let bits = (x + 0.0).to_bits();
    if bits >> 31 == 1 { !bits } else { bits | 1 << 31 }
}

/// The inverse of [`order`].
pub(super) fn number(order: u32) -> f32 {
    f32::from_bits(if order >> 31 == 1 { order & !(1 << 31) } else { !order })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn order_keeps_the_order_and_comes_back() {
        let numbers = [f32::MIN, -1.5, -f32::MIN_POSITIVE, -1e-45, 0.0, 1e-45, 1.0, f32::MAX];
        assert!(numbers.windows(2).all(|pair| order(pair[0]) < order(pair[1])));
        assert!(numbers.iter().all(|&x| number(order(x)) == x));
        assert_eq!(order(-0.0), order(0.0));
    }
}
