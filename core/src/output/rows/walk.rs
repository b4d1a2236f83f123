//! The way through the faces of a file beside that through the fates of their triangles.

use crate::geometry::position;
use crate::io::read::polygon;
use crate::io::record::{self, Point};
use crate::io::rows::{CHANNELS, Corner, FaceRow, Faces, NONE, Rows, Source};
use crate::output::model::{Change, Fate};

/// What became of a triangle of the file, or of a face whose triangles all stay.
#[derive(Clone, Copy, Debug)]
pub(super) enum Step<'r> {
    /// All triangles of the face stay. The number of its first triangle among all of the file, and which corners each has.
    Face(&'r FaceRow, u32, &'r [[u32; 3]]),
    /// One triangle of a face of which others do not stay.
    Stays(Own<'r>),
    Turned(Own<'r>),
    /// It has other corners now.
    Moved(Own<'r>),
    Gone(Own<'r>),
    /// A triangle that the file does not have: a part of one, or new.
    Made,
    /// A face of fewer than three corners.
    Short(&'r FaceRow),
}

/// A triangle of a face.
#[derive(Clone, Copy, Debug)]
pub(super) struct Own<'r> {
    pub(super) row: &'r FaceRow,
    /// Its number among all triangles of the file.
    pub(super) number: u32,
    /// Which corners of the face it has.
    pub(super) places: [u32; 3],
}

impl Own<'_> {
    /// The rows of its corners.
    pub(super) fn corners(&self) -> [Corner; 3] {
        self.places.map(|place| self.row.corners.get(place as usize).copied().unwrap_or([NONE; CHANNELS]))
    }

    /// This triangle as one whose values another takes.
    pub(super) fn source(&self) -> Source {
        let FaceRow { whole, corners, state } = self.row;
        Source { row: whole.clone(), places: Some(self.places), corners: corners.len() as u32, state: *state }
    }
}

/// Goes through the triangles of a file and those that are made, in the order of the edit. `None` if the faces of `rows` do not give the triangles of
/// `change`: then the file is of another build than it seems. O(n) in both.
pub(super) fn walk(rows: &dyn Rows, change: &Change<'_>, mut step: impl FnMut(Step<'_>)) -> Option<()> {
    let mut walk = Walk {
        faces: rows.faces(),
        rows,
        change,
        row: FaceRow::default(),
        triangles: Vec::new(),
        at: 0,
        stay: 0,
        first: 0,
        passed: 0,
    };
    let mut fits = true;
    change.each(|fate| fits = fits && walk.take(fate, &mut step).is_some());
    (fits && walk.at == walk.triangles.len() && walk.next_row(&mut step).is_none()).then_some(())
}

struct Walk<'w> {
    rows: &'w dyn Rows,
    change: &'w Change<'w>,
    faces: Box<dyn Faces + 'w>,
    row: FaceRow,
    /// The triangles of the row.
    triangles: Vec<[u32; 3]>,
    /// So many of them are passed, and so many of these stay and were not told of.
    at: usize,
    stay: usize,
    /// The number of the row's first triangle among all, and how many triangles are passed.
    first: u32,
    passed: u32,
}

impl Walk<'_> {
    fn take(&mut self, fate: Fate, step: &mut impl FnMut(Step<'_>)) -> Option<()> {
        if matches!(fate, Fate::Part(..) | Fate::New(_)) {
            self.tell(step);
            step(Step::Made);
            return Some(());
        }
        if self.at == self.triangles.len() {
            self.next_row(step)?;
        }
        let places = *self.triangles.get(self.at)?;
        self.fits(places)?;
        self.at += 1;
        self.passed += 1;
        if fate == Fate::Kept {
            self.stay += 1;
            if self.at == self.triangles.len() {
                self.tell(step);
            }
            return Some(());
        }
        let waiting = self.at - 1;
        self.at = waiting;
        self.tell(step);
        self.at = waiting + 1;
        let own = Own { row: &self.row, number: self.passed - 1, places };
        step(match fate {
            Fate::Turned => Step::Turned(own),
            Fate::Moved(_) => Step::Moved(own),
            _ => Step::Gone(own),
        });
        Some(())
    }

    /// Tells of the triangles that stay before [`Walk::at`].
    fn tell(&mut self, step: &mut impl FnMut(Step<'_>)) {
        let stay = std::mem::take(&mut self.stay);
        if stay > 0 && stay == self.triangles.len() {
            return step(Step::Face(&self.row, self.first, &self.triangles));
        }
        for back in (1..=stay).rev() {
            let Some(places) = self.triangles.get(self.at - back) else { return };
            let number = self.first + (self.at - back) as u32;
            step(Step::Stays(Own { row: &self.row, number, places: *places }));
        }
    }

    /// The next face that has triangles.
    fn next_row(&mut self, step: &mut impl FnMut(Step<'_>)) -> Option<()> {
        self.at = 0;
        self.first = self.passed;
        loop {
            self.triangles.clear();
            self.faces.next_face(&mut self.row)?;
            match self.row.corners.len() {
                0..3 => step(Step::Short(&self.row)),
                3 => self.triangles.push([0, 1, 2]),
                _ => {
                    let corners: Option<Vec<Point>> =
                        self.row.corners.iter().map(|corner| self.rows.position(corner[0])).collect();
                    polygon::cut(&corners?, |triangle| self.triangles.push(triangle.map(|place| place as u32)));
                }
            }
            if !self.triangles.is_empty() {
                return Some(());
            }
        }
    }

    /// The triangle of these corners of the row is the next one of the file.
    fn fits(&self, places: [u32; 3]) -> Option<()> {
        let came = self.change.came.get(self.passed as usize).map(record::corners)?;
        for (place, there) in places.into_iter().zip(came) {
            let corner = self.row.corners.get(place as usize)?;
            let own = self.rows.position(corner[0])?;
            if position::bits(own) != position::bits(there) {
                return None;
            }
        }
        Some(())
    }
}
