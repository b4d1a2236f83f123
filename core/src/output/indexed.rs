//! Records as an indexed mesh: each distinct position is one vertex, numbered by the first corner that stands there.
//!
//! **In:** records of finite corners.
//! **Out:** the positions in the order of their numbers, and the three numbers of each record.
//! **Promise:** the same numbers for any memory and any threads. Memory: a bit for each corner, and tables of a share of the budget.
//!
//! Positions are told apart in classes by a hash, one table for each, so many that the tables fit; each class goes over all records. The first
//! corner at a position is spooled for each corner of a class, in the corners' order, so that reading the spools side by side gives the numbers of
//! all corners in one pass.

use std::fs::File;
use std::ops::Range;
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use memmap2::Mmap;
use rayon::prelude::*;

use crate::contract::error::{Error, Result};
use crate::contract::progress::Progress;
use crate::contract::settings::Limits;
use crate::geometry::position;
use crate::io::read_ahead::Guide;
use crate::io::record::{Point, Record};
use crate::io::write_behind;
use crate::topology::vertex_table::Weld;
use crate::util::parallel;
use crate::util::words::Count;

/// Bytes of a table for each of its vertices, at most: a position, its place among buckets that are not full, its first corner.
const BYTES_A_VERTEX: u64 = 72;
/// The tables take this share of the budget together.
const SHARE_OF_MEMORY: u64 = 3;
/// Words of corners' bits between two known ranks.
const STEP: usize = 16;
/// First corners that are appended to a spool at once.
const APPENDED: usize = 16 << 10;

/// An indexed mesh of records.
pub(crate) struct Indexed<'r> {
    records: &'r [Record],
    /// A bit for each corner: it is the first at its position.
    firsts: Vec<u64>,
    /// The number of such corners before every so many words.
    ranks: Vec<u32>,
    vertices: u32,
    classes: Vec<Class>,
}

/// The first corners at the positions of one class, one for each of its corners.
struct Class(Option<Mmap>);

impl Class {
    fn corner(&self, at: usize) -> u32 {
        let corners = self.0.as_ref().map_or(&[][..], |map| map.as_chunks::<4>().0);
        corners.get(at).copied().map_or(0, u32::from_le_bytes)
    }
}

/// Where a reading of the numbers stands in each class.
#[derive(Clone)]
pub(crate) struct Cursor(Vec<usize>);

/// Shared by the threads that make the classes.
struct Making<'a> {
    path: &'a Path,
    records: &'a [Record],
    classes: u64,
    most_vertices: usize,
    firsts: &'a [AtomicU64],
    overflown: AtomicBool,
    limits: &'a Limits,
    progress: &'a dyn Progress,
}

impl<'r> Indexed<'r> {
    /// Of these records, for an output of the file `path`. O(records · classes); one class is enough for some millions.
    ///
    /// # Errors
    /// [`Error::Refused`] for more corners than 32 bits count, [`Error::NoSpace`], [`Error::Io`].
    pub(crate) fn of(path: &Path, records: &'r [Record], limits: &Limits, progress: &dyn Progress) -> Result<Self> {
        let corners = records.len() as u64 * 3;
        if corners > u64::from(u32::MAX) {
            return Err(Error::Refused {
                path: path.into(),
                reason: format!("an indexed mesh of {} triangles has more corners than can be numbered", Count(records.len())),
                advice: "take binary STL for the result".into(),
            });
        }
        let threads = limits.threads.clamp(1, 8) as u64;
        let most_vertices = (limits.memory_bytes / SHARE_OF_MEMORY / threads / BYTES_A_VERTEX).max(1 << 10);
        // A closed mesh has half as many vertices as triangles.
        let mut classes = (records.len() as u64 * 2 / 3).div_ceil(most_vertices).max(threads).next_multiple_of(threads);
        loop {
            let firsts: Vec<AtomicU64> = (0..corners.div_ceil(64)).map(|_| AtomicU64::new(0)).collect();
            let making = Making {
                path,
                records,
                classes,
                most_vertices: most_vertices as usize,
                firsts: &firsts,
                overflown: AtomicBool::new(false),
                limits,
                progress,
            };
            let spools = making.all()?;
            if !making.overflown.load(Ordering::Relaxed) {
                let firsts = firsts.into_iter().map(AtomicU64::into_inner).collect();
                return Ok(Self::ranked(records, firsts, spools));
            }
            classes *= 2;
        }
    }

    fn ranked(records: &'r [Record], firsts: Vec<u64>, classes: Vec<Class>) -> Self {
        let mut vertices = 0;
        let mut ranks = Vec::with_capacity(firsts.len() / STEP + 1);
        for words in firsts.chunks(STEP) {
            ranks.push(vertices);
            vertices += words.iter().map(|word| word.count_ones()).sum::<u32>();
        }
        Self { records, firsts, ranks, vertices, classes }
    }

    /// So many vertices.
    pub(crate) fn vertices(&self) -> u32 {
        self.vertices
    }

    /// The positions whose first corners belong to these records, in the order of their numbers.
    pub(crate) fn positions(&self, records: Range<usize>) -> impl Iterator<Item = Point> {
        let of = move |record: usize| self.records.get(record).map(crate::io::record::corners).unwrap_or_default();
        records.flat_map(move |record| {
            let corners = of(record);
            (0..3).filter(move |k| self.is_first(record * 3 + k)).map(move |k| corners[k])
        })
    }

    fn is_first(&self, corner: usize) -> bool {
        self.firsts.get(corner / 64).is_some_and(|word| word >> (corner % 64) & 1 == 1)
    }

    /// A reading from the first record on.
    pub(crate) fn cursor(&self) -> Cursor {
        Cursor(vec![0; self.classes.len()])
    }

    /// The vertices of the next so many records.
    pub(crate) fn faces(&self, records: Range<usize>, cursor: &mut Cursor) -> Vec<[u32; 3]> {
        let classes = self.classes.len() as u64;
        let mut number = |point: Point| {
            let class = class_of(point, classes);
            let Some(at) = cursor.0.get_mut(class) else { return 0 };
            let first = self.classes.get(class).map_or(0, |class| class.corner(*at));
            *at += 1;
            self.rank(first)
        };
        let records = self.records.get(records).unwrap_or_default();
        records.iter().map(|record| position::corners(record).map(&mut number)).collect()
    }

    /// The number of the vertex whose first corner this is.
    fn rank(&self, first: u32) -> u32 {
        let (word, bit) = (first as usize / 64, first % 64);
        let step = word / STEP;
        let whole = self.firsts.get(step * STEP..word).unwrap_or_default();
        let before = self.firsts.get(word).map_or(0, |last| (last & ((1 << bit) - 1)).count_ones());
        self.ranks.get(step).copied().unwrap_or_default() + whole.iter().map(|word| word.count_ones()).sum::<u32>() + before
    }
}

impl Making<'_> {
    /// The spools of all classes; of no use once one has overflown.
    fn all(&self) -> Result<Vec<Class>> {
        parallel::in_pool(self.limits.threads, || (0..self.classes).into_par_iter().map(|class| self.class(class)).collect())
    }

    fn class(&self, class: u64) -> Result<Class> {
        let bytes = self.records.len() as u64 * 12 / self.classes;
        let file = write_behind::spooled(self.path, self.limits, (bytes, "the numbers of vertices"), |append| {
            let mut table = Weld::default();
            table.reset(((self.records.len() as u64 / 2 / self.classes) as usize).min(self.most_vertices));
            let mut first_of: Vec<u32> = Vec::new();
            let mut waiting: Vec<u8> = Vec::with_capacity(4 * APPENDED);
            let guide = Guide::new(self.records.as_flattened(), self.limits);
            let _pass = guide.in_order(self.records);
            for (number, record) in self.records.iter().enumerate() {
                for (k, point) in position::corners(record).into_iter().enumerate() {
                    if class_of(point, self.classes) != class as usize {
                        continue;
                    }
                    let corner = (number * 3 + k) as u32;
                    let vertex = table.vertex(point) as usize;
                    if vertex == first_of.len() {
                        first_of.push(corner);
                        if let Some(word) = self.firsts.get(corner as usize / 64) {
                            word.fetch_or(1 << (corner % 64), Ordering::Relaxed);
                        }
                    }
                    waiting.extend(first_of.get(vertex).copied().unwrap_or(corner).to_le_bytes());
                }
                if waiting.len() >= 4 * APPENDED {
                    append(&waiting)?;
                    waiting.clear();
                    if first_of.len() > self.most_vertices {
                        self.overflown.store(true, Ordering::Relaxed);
                    }
                    if self.overflown.load(Ordering::Relaxed) {
                        return Ok(());
                    }
                    self.tell(class, number)?;
                }
            }
            append(&waiting)
        })?;
        map(&file, self.limits)
    }

    fn tell(&self, class: u64, record: usize) -> Result<()> {
        if class == 0 {
            self.progress.at("number", record as u64, self.records.len() as u64);
        }
        if self.progress.cancelled() { Err(Error::cancelled(self.path, "numbering vertices")) } else { Ok(()) }
    }
}

fn map(file: &File, limits: &Limits) -> Result<Class> {
    let folder = limits.spool_folder();
    if file.metadata().map_err(Error::io(&folder, "mapping"))?.len() == 0 {
        return Ok(Class(None));
    }
    // SAFETY: the file has no name and this is its only handle: nobody changes or truncates it, and it is not written to any more.
    unsafe { Mmap::map(file) }.map(|map| Class(Some(map))).map_err(Error::io(&folder, "mapping"))
}

/// The class of a canonical position.
#[inline]
fn class_of(point: Point, classes: u64) -> usize {
    let [x, y, z] = position::bits(point).map(u64::from);
    let mixed = (x ^ y.rotate_left(21) ^ z.rotate_left(42)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    // The upper half of a product depends on all bits.
    let mixed = (mixed ^ mixed >> 29).wrapping_mul(0xbf58_476d_1ce4_e5b9) >> 32;
    ((mixed * classes) >> 32) as usize
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use std::collections::HashMap;

    use super::*;
    use crate::contract::progress::Quiet;
    use crate::io::record;

    /// Numbers by a table in memory.
    fn simple(records: &[Record]) -> (Vec<[u32; 3]>, Vec<[u32; 3]>) {
        let mut numbers = HashMap::new();
        let mut positions = Vec::new();
        let mut number = |point: Point| {
            *numbers.entry(position::bits(position::canonical(point))).or_insert_with(|| {
                positions.push(position::bits(point));
                positions.len() as u32 - 1
            })
        };
        let faces = records.iter().map(|record| record::corners(record).map(&mut number)).collect();
        (faces, positions)
    }

    fn limits(memory: u64, threads: usize) -> Limits {
        Limits { memory_bytes: memory, threads, ..Limits::default() }
    }

    fn assert_same(records: &[Record], limits: &Limits) {
        let indexed = Indexed::of(Path::new("a.stl"), records, limits, &Quiet).unwrap();
        let mut cursor = indexed.cursor();
        // In two readings, as a writer does.
        let half = records.len() / 2;
        let mut faces = indexed.faces(0..half, &mut cursor);
        faces.extend(indexed.faces(half..records.len(), &mut cursor));
        let positions: Vec<_> = indexed.positions(0..records.len()).map(position::bits).collect();
        assert_eq!((faces, positions), simple(records));
    }

    proptest! {
        #[test]
        fn numbers_are_those_of_the_first_corners(
            corners in prop::collection::vec(prop::array::uniform3(0u8..4), 0..300), threads in 1usize..4,
        ) {
            let point = |p: &[u8; 3]| p.map(|x| [-0.0, 0.0, 1.0, 2.5][usize::from(x)]);
            let records: Vec<_> = corners.chunks_exact(3).map(|c| record::encode([point(&c[0]), point(&c[1]), point(&c[2])], 0)).collect();
            assert_same(&records, &limits(1 << 20, threads));
        }
    }

    /// No position is shared, so the first guess of the classes is too small.
    #[test]
    fn many_positions_in_little_memory() {
        let records: Vec<_> = (0..40_000u16)
            .map(|k| record::encode([0, 1, 2].map(|corner| [f32::from(k), f32::from(corner as u16), 0.5]), 0))
            .collect();
        for threads in [1, 2] {
            assert_same(&records, &limits(1 << 20, threads));
        }
    }
}
