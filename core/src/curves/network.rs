//! What is read of a file: curves, and faces with the loops that bound them.

use crate::curves::curve::{self, Curve, Source};
use crate::curves::elementary::Told;
use crate::curves::finding::Finding;
use crate::curves::vector::{Affine, Point, is_finite};

/// The unit of length of a file.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Unit {
    /// As the file calls it, or a usual name.
    pub name: String,
    /// Millimetres in a unit of its coordinates; scales of the header counted in.
    pub millimetres: f64,
}

/// A curve in a loop.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Use {
    /// Its number in [`Network::curves`].
    pub curve: usize,
    /// Whether the loop follows it from its end to its beginning.
    pub is_reversed: bool,
}

/// A face of a file.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Face {
    /// Where it stands.
    pub source: Source,
    /// What it is called in the file's format: `144`, `ADVANCED_FACE`.
    pub entity: String,
    /// What its surface is called there: `128`, `PLANE`; empty if unknown.
    pub surface: String,
    /// Its surface, if that has an equation.
    pub told: Option<Told>,
    /// Curves around it in their order; empty of a surface that nothing trims, and where a sphere has a pole for a boundary.
    pub outer: Vec<Use>,
    /// Curves around each of its holes.
    pub inner: Vec<Vec<Use>>,
    /// Whether no boundary trims its surface.
    pub is_untrimmed: bool,
    /// Whether it bounds a void of a solid: the solid is around it.
    pub is_void: bool,
}

/// Curves and faces of a file.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Network {
    /// Of all coordinates.
    pub unit: Unit,
    /// The distance below which the file itself takes points for the same (its resolution or uncertainty), in its unit.
    pub resolution: Option<f64>,
    /// Significant digits of its coordinates: the most that any of them has.
    pub digits: u32,
    /// Curves in space, those of composites one by one.
    pub curves: Vec<Curve>,
    /// Faces and their boundaries.
    pub faces: Vec<Face>,
    /// What is odd, damaged or not read.
    pub findings: Vec<Finding>,
}

impl Network {
    /// Corners of a box around all curves, of their control points; `None` without curves.
    #[must_use]
    pub fn bounds(&self) -> Option<[Point; 2]> {
        let mut bounds = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
        for corner in self.curves.iter().flat_map(|curve| curve.shape.bounds()) {
            curve::widen(&mut bounds, corner);
        }
        bounds.into_iter().all(is_finite).then_some(bounds)
    }

    /// Adds the curves and faces of another file, in the unit of this one. Ends of the two meet by place: vertices of the other file are dropped, for its
    /// numbers mean nothing here. O(its curves).
    pub fn append(&mut self, other: Self) {
        let factor = other.unit.millimetres / self.unit.millimetres;
        let first = self.curves.len();
        let map = Affine::scaling(factor);
        let scaled = |curve: Curve| {
            let shape = if factor == 1.0 { curve.shape } else { curve.shape.transformed(&map) };
            Curve { shape, vertices: None, ..curve }
        };
        self.curves.extend(other.curves.into_iter().map(scaled));
        let mut faces = other.faces;
        faces.iter_mut().for_each(|face| face.told = face.told.and_then(|told| told.transformed(&map)));
        for used in faces.iter_mut().flat_map(|face| std::iter::once(&mut face.outer).chain(&mut face.inner)).flatten() {
            used.curve += first;
        }
        self.faces.extend(faces);
        let resolution = other.resolution.map(|length| length * factor);
        self.resolution = self.resolution.into_iter().chain(resolution).reduce(f64::max);
        self.digits = self.digits.min(other.digits);
        self.findings.extend(other.findings);
    }
}

/// Why nothing of a file is read.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ReadError {
    /// Neither IGES nor STEP nor JSON, by its content.
    #[error("neither IGES nor STEP nor JSON; it begins with “{0}”")]
    Unknown(String),
    /// The binary form of IGES, which the standard itself gave up.
    #[error("binary IGES is not read; write the file again in ASCII")]
    Binary,
    /// An IGES file without a single directory entry.
    #[error("an IGES file without a directory: {0}")]
    NoDirectory(&'static str),
    /// A STEP file without a single instance of an entity.
    #[error("a STEP file without data")]
    NoData,
    /// JSON that is not what is expected, with the path to the place: `curves[3].knots[0]`.
    #[error("{path}: {problem}")]
    Json {
        /// Where.
        path: String,
        /// The fault, in words.
        problem: String,
    },
}

#[cfg(test)]
mod tests {
    use crate::curves::loops::{self, Options};

    /// Three sides of a square in millimetres, and the fourth one in metres: together they are one loop.
    #[test]
    fn files_of_different_units_form_one_loop() {
        let read = |text: &str| crate::curves::read(text.as_bytes()).unwrap();
        let mut network = read(
            r#"{"unit": "mm", "curves": [{"line": [[0, 0, 0], [1, 0, 0]]}, {"line": [[1, 0, 0], [1, 1, 0]]}, {"line": [[1, 1, 0], [0, 1, 0]]}]}"#,
        );
        network.append(read(r#"{"unit": "m", "curves": [{"line": [[0, 0.001, 0], [0, 0, 0]]}]}"#));
        assert_eq!(network.bounds(), Some([[0.0; 3], [1.0, 1.0, 0.0]]));
        let found = loops::find(&network, &Options::default());
        assert_eq!(found.loops.iter().map(|own| own.uses.len()).collect::<Vec<_>>(), [4]);
    }
}
