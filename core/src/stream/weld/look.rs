//! Whether triangles share positions at all, by a look at some of them.

use std::collections::BTreeMap;

use super::reach::Cells;
use crate::geometry::distance::{Tolerance, longest_edge, place};
use crate::geometry::position::Position;
use crate::geometry::sums::Bounds;
use crate::io::read_ahead::Guide;
use crate::io::record::{self, Record};
use crate::stream::columns::{Columns, Extremes};
use crate::util::scatter;

/// Smaller files are worked on as a whole.
const FEWEST: usize = 1 << 17;
/// Triangles in a row that are looked at together, and how many such rows.
const ROW: usize = 512;
const ROWS: usize = 32;
/// Corners that are looked at where rows do not tell.
const SAMPLE: usize = 1 << 15;
/// Cells from which corners are taken, in tolerances.
const CELL: f64 = 256.0;

/// Corners by what is there besides.
#[derive(Default)]
struct Seen {
    corners: usize,
    /// Another triangle has a corner at the same place.
    shared: usize,
    /// None has, but one has a corner within the tolerance.
    near: usize,
}

/// One triangle of so many may be smaller than what the weld asks for: by its longest edge, since slivers are for the weld to close.
const SMALLER: usize = 64;

/// The widest tolerance that triangles are large enough for, if most corners are near others, and hardly any is where another one is. A look at some triangles of
/// each part of the file; where neighbours are not near each other in the file, a pass through all of it for the corners in some places. `reach`: by the box of the
/// triangles, of which it is shown some. A box says nothing of the triangles where something lies far off.
pub(crate) fn widest_if_nothing_is_shared(
    records: &[Record],
    guide: &Guide<'_>,
    reach: impl Fn(&Bounds) -> Tolerance,
) -> Option<f64> {
    if records.len() < FEWEST {
        return None;
    }
    let step = records.len() / ROWS;
    guide.ask_for((0..ROWS).map(|i| ((i * step) as u32, ROW as u32)));
    let sample = || records.chunks(step).take(ROWS).map(|row| &row[..ROW.min(row.len())]);
    let rows: Vec<Vec<(Position, u32)>> =
        sample().map(|row| row.iter().zip(0..).flat_map(|(record, i)| corners(record).map(move |p| (p, i))).collect()).collect();
    let mut bounds = Bounds::EMPTY;
    rows.iter().flatten().for_each(|(p, _)| bounds.include(&[p.coordinates()]));
    let Tolerance { weld, edge_share } = reach(&bounds);
    let widest = edge_share * small(sample().flatten());
    let weld = weld.min(widest);
    if weld <= 0.0 {
        return None;
    }
    let mut seen = Seen::default();
    rows.into_iter().for_each(|row| seen.look(row, weld));
    if seen.shared + seen.near < seen.corners / 4 {
        seen = Seen::default();
        seen.look(scattered(records, guide, weld), weld);
    }
    (seen.near > seen.corners / 2 && seen.shared < seen.corners / 8).then_some(widest)
}

/// The longest edge of a small one of some triangles.
fn small<'r>(records: impl Iterator<Item = &'r Record>) -> f64 {
    let finite = records.filter(|record| record::all_finite(record));
    let mut lengths: Vec<f64> = finite.map(|record| longest_edge(&record::corners(record))).collect();
    lengths.sort_unstable_by(f64::total_cmp);
    lengths.get(lengths.len() / SMALLER).copied().unwrap_or(0.0)
}

/// The box of all finite triangles.
pub(crate) fn bounds(records: &[Record], guide: &Guide<'_>) -> Bounds {
    let (mut bounds, mut extremes) = (Bounds::EMPTY, Extremes::EMPTY);
    let finite = guide.blocks(records).flatten().filter(|record| record::all_finite(record));
    finite.for_each(|record| extremes.include(&Columns::of(record)));
    extremes.add_to(&mut bounds);
    bounds.normalised()
}

fn corners(record: &Record) -> impl Iterator<Item = Position> {
    let corners = record::corners(record);
    let finite = corners.iter().flatten().all(|x| x.is_finite());
    corners.into_iter().filter(move |_| finite).map(Position::of)
}

/// Corners in some cells, with the numbers of their triangles.
fn scattered(records: &[Record], guide: &Guide<'_>, weld: f64) -> Vec<(Position, u32)> {
    let share = SAMPLE as f64 / (3 * records.len()) as f64;
    let is_wanted = |p: Position| {
        let [x, y, z] = p.coordinates().map(|x| (f64::from(x) / (CELL * weld)).floor() as i64 as u64);
        scatter::share(x ^ y.rotate_left(21) ^ z.rotate_left(42)) < share
    };
    let mut all = Vec::new();
    for (number, record) in (0..).zip(guide.blocks(records).flatten()) {
        all.extend(corners(record).filter(|p| is_wanted(*p)).map(|p| (p, number)));
        if all.len() > 16 * SAMPLE {
            break;
        }
    }
    all
}

impl Seen {
    /// Adds corners of triangles, each with the triangle's number.
    fn look(&mut self, mut corners: Vec<(Position, u32)>, weld: f64) {
        corners.sort_unstable();
        corners.dedup();
        self.corners += corners.len();
        let cells = Cells::new(weld);
        let mut alone: BTreeMap<[i64; 3], Vec<Position>> = BTreeMap::new();
        for group in corners.chunk_by(|a, b| a.0 == b.0) {
            match group {
                [(p, _)] => alone.entry(cells.of(place(p.coordinates()))).or_default().push(*p),
                _ => self.shared += group.len(),
            }
        }
        let is_near = |p: &&Position| {
            let here = place(p.coordinates());
            let others = |cell| alone.get(&cell).into_iter().flatten();
            let mut is_near = false;
            cells.near(here, weld, |cell| {
                is_near |= others(cell).any(|q| q != *p && here.distance(place(q.coordinates())) <= weld)
            });
            is_near
        };
        self.near += alone.values().flatten().filter(is_near).count();
    }
}
