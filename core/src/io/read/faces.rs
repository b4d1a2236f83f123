//! Faces by their vertices become records.

use super::finding::{Finding, Rejection};
use super::polygon::{self, Cut};
use super::vertices::Vertices;
use crate::io::record::{self, Point, Record};
use crate::util::words::{Count, Counted};

/// Most corners of one face. Cutting a polygon takes memory and time by its corners, and no program writes such a face of a mesh.
pub(super) const MOST_CORNERS: usize = 1 << 19;

/// Counts of faces, by what became of them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Tally {
    /// All that were pushed.
    pub(super) faces: u64,
    /// Of fewer than three corners, which give no triangle.
    pub(super) short: u64,
    /// Of more than three corners, which were cut into triangles.
    pub(super) polygons: u64,
    /// Of these, polygons whose triangles may lie outside of them ([`Cut::Fan`]).
    pub(super) fans: u64,
    /// The number of the first of them among all faces, from 1.
    pub(super) first_fan: Option<u64>,
    /// Of more corners than a face can have; left out.
    pub(super) huge: u64,
    /// With an index that no vertex has; left out.
    pub(super) astray: u64,
    /// The number of the first of them among all faces, from 1.
    pub(super) first_astray: Option<u64>,
}

impl Tally {
    /// There are faces that give no triangle.
    pub(super) fn has_short(&self) -> bool {
        self.short > 0
    }

    /// Joins the counts of the faces behind these.
    pub(super) fn append(&mut self, behind: Self) {
        self.first_astray = self.first_astray.or(behind.first_astray.map(|first| self.faces + first));
        self.first_fan = self.first_fan.or(behind.first_fan.map(|first| self.faces + first));
        self.faces += behind.faces;
        self.short += behind.short;
        self.polygons += behind.polygons;
        self.fans += behind.fans;
        self.huge += behind.huge;
        self.astray += behind.astray;
    }

    /// Refuses faces that are lost for the most part.
    pub(super) fn judge(&self) -> Result<(), Rejection> {
        if self.huge > self.faces / 2 {
            let faces = Counted(self.faces, "face", "faces");
            let reason = format!("{} of {faces} have more than {} corners", Count(self.huge), Count(MOST_CORNERS));
            return Err(Rejection::Unreadable(reason));
        }
        if self.astray > self.faces / 2 {
            let faces = Counted(self.faces, "face", "faces");
            let reason = format!("{} of {faces} refer to vertices that are not there", Count(self.astray));
            return Err(Rejection::Unreadable(reason));
        }
        Ok(())
    }

    /// What is odd about these faces.
    pub(super) fn findings(&self) -> Vec<Finding> {
        let mut found = Vec::new();
        if self.astray > 0 {
            let faces = Counted(self.astray, "face refers", "faces refer");
            let first = self.first_astray.unwrap_or_default();
            found.push(Finding::loss(format!(
                "{faces} to vertices that are not there, left out; the first is face {}",
                Count(first)
            )));
        }
        if self.huge > 0 {
            let faces = Counted(self.huge, "face", "faces");
            found.push(Finding::loss(format!("{faces} of more than {} corners, left out", Count(MOST_CORNERS))));
        }
        if self.short > 0 {
            found.push(Finding::flaw(format!("{} of fewer than three corners, left out", Counted(self.short, "face", "faces"))));
        }
        if self.polygons > 0 {
            let text = format!("{} of more than three corners, cut into triangles", Counted(self.polygons, "face", "faces"));
            found.push(Finding { harmless: true, ..Finding::flaw(text) });
        }
        if self.fans > 0 {
            let faces = Counted(self.fans, "polygon", "polygons");
            let first = Count(self.first_fan.unwrap_or_default());
            let reasons = "of too many corners, or that cross themselves too much to be cut well";
            found.push(Finding::flaw(format!("{faces} {reasons}, read as fans from one corner; the first is face {first}")));
        }
        found
    }
}

/// Makes records of the faces of one piece of a file.
pub(super) struct Faces<'v> {
    vertices: Vertices<'v>,
    pub(super) records: Vec<Record>,
    pub(super) tally: Tally,
    corners: Vec<Point>,
}

impl<'v> Faces<'v> {
    /// For faces of these vertices.
    pub(super) fn of(vertices: Vertices<'v>) -> Self {
        Self { vertices, records: Vec::new(), tally: Tally::default(), corners: Vec::new() }
    }

    /// Appends a face that is a triangle, by the indices of its vertices.
    #[inline]
    pub(super) fn triangle(&mut self, indices: [u64; 3]) {
        let [a, b, c] = indices;
        self.triangle_at([self.vertices.get(a), self.vertices.get(b), self.vertices.get(c)]);
    }

    /// Appends a face that is a triangle, by its corners; one without a position refers to a vertex that is not there.
    #[inline]
    pub(super) fn triangle_at(&mut self, corners: [Option<Point>; 3]) {
        self.tally.faces += 1;
        match corners {
            [Some(a), Some(b), Some(c)] => self.records.push(record::encode([a, b, c], 0)),
            _ => self.astray(),
        }
    }

    /// Appends a face of any number of corners, by the indices of its vertices. O(corners log corners) for the polygons of real files.
    pub(super) fn polygon(&mut self, indices: impl ExactSizeIterator<Item = u64>) {
        self.tally.faces += 1;
        if indices.len() > MOST_CORNERS {
            self.tally.huge += 1;
            return;
        }
        self.corners.clear();
        for index in indices {
            match self.vertices.get(index) {
                Some(corner) => self.corners.push(corner),
                None => return self.astray(),
            }
        }
        match *self.corners.as_slice() {
            [] | [_] | [_, _] => self.tally.short += 1,
            [a, b, c] => self.records.push(record::encode([a, b, c], 0)),
            ref corners => {
                self.tally.polygons += 1;
                let (records, at) = (&mut self.records, |place: usize| corners.get(place).copied().unwrap_or_default());
                records.reserve(corners.len());
                if polygon::cut(corners, |triangle| records.push(record::encode(triangle.map(at), 0))) == Cut::Fan {
                    self.tally.fans += 1;
                    self.tally.first_fan = self.tally.first_fan.or(Some(self.tally.faces));
                }
            }
        }
    }

    /// Counts a face of too many corners.
    pub(super) fn huge(&mut self) {
        self.tally.faces += 1;
        self.tally.huge += 1;
    }

    /// Counts a face whose indices are not there.
    pub(super) fn lost(&mut self) {
        self.tally.faces += 1;
        self.astray();
    }

    /// Counts a face that was pushed, and cannot be made.
    #[cold]
    fn astray(&mut self) {
        self.tally.astray += 1;
        self.tally.first_astray = self.tally.first_astray.or(Some(self.tally.faces));
    }
}

#[cfg(test)]
mod tests {
    use super::super::vertices::packed;
    use super::*;

    #[test]
    fn triangles_polygons_and_what_is_neither() {
        let points = [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
        let packed = points.map(packed);
        let mut faces = Faces::of(Vertices::spooled(&packed));
        faces.triangle([0, 1, 2]);
        faces.polygon([0, 1, 2, 3].into_iter());
        faces.polygon([3, 2].into_iter());
        faces.triangle([0, 1, 4]);
        faces.polygon([0, u64::MAX, 1].into_iter());
        let corners: Vec<_> = faces.records.iter().map(record::corners).collect();
        assert_eq!(corners.len(), 3);
        assert_eq!(corners[0], [points[0], points[1], points[2]]);
        let expected = Tally { faces: 5, short: 1, polygons: 1, astray: 2, first_astray: Some(4), ..Tally::default() };
        assert_eq!(faces.tally, expected);
        assert!(!expected.findings().iter().any(|finding| finding.text.contains("fan")));
        let mut all = expected;
        all.append(expected);
        assert_eq!(all, Tally { faces: 10, short: 2, polygons: 2, astray: 4, first_astray: Some(4), ..Tally::default() });
        assert!(all.judge().is_ok() && Tally { faces: 3, astray: 2, ..Tally::default() }.judge().is_err());
    }

    #[test]
    fn f13_a_face_of_too_many_corners_is_refused_by_name() {
        let points = [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0]].map(packed);
        let mut faces = Faces::of(Vertices::spooled(&points));
        faces.polygon(vec![0u64; MOST_CORNERS + 1].into_iter());
        let said = format!("{:?}", faces.tally.judge());
        assert!(said.contains("1 of 1 face have more than 524 288 corners") && faces.records.is_empty(), "{said}");
        (0..2).for_each(|_| faces.triangle([0, 1, 2]));
        let found = faces.tally.findings();
        assert!(faces.tally.judge().is_ok() && found[0].text == "1 face of more than 524 288 corners, left out");
    }

    #[test]
    fn a_polygon_that_becomes_a_fan_makes_a_finding() {
        // A bow tie of five corners, whose halves cancel: it has no plane.
        let points = [[0.0; 3], [2.0, 2.0, 0.0], [2.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 2.0, 0.0]];
        let packed = points.map(packed);
        let mut faces = Faces::of(Vertices::spooled(&packed));
        faces.triangle([0, 1, 2]);
        faces.polygon([0, 1, 2, 3, 4].into_iter());
        let mut tally = faces.tally;
        assert_eq!((tally.fans, tally.first_fan, faces.records.len()), (1, Some(2), 4));
        tally.append(faces.tally);
        assert_eq!((tally.fans, tally.first_fan), (2, Some(2)));
        let found = tally.findings();
        let fan = found.iter().find(|finding| finding.text.contains("fan")).unwrap();
        assert!(fan.text.contains("2 polygons") && fan.text.ends_with("the first is face 2") && !fan.harmless, "{fan:?}");
    }
}
