//! Can a file be printed? All of it, by this judge's own means.

use std::path::Path;

use super::judgement::Judgement;
use super::meet::meeting;
use super::shells::Shells;
use super::stl;
use super::stl::{Result, Soup};
use super::topology::{Components, examine};

/// The judge's findings in a file.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "compare", derive(serde::Serialize, serde::Deserialize))]
pub struct Solid {
    /// Of the file as it is.
    pub judgement: Judgement,
    /// Triangles that cross or overlap another one: that have a segment in common which is not an edge of both, or an area.
    pub meeting: u64,
    /// Sealed components of negative volume that no others wind around: no cavities.
    pub inside_out: u64,
    /// A binary file whose header begins with `solid`, as a text does.
    pub solid_header: bool,
}

/// Why a file cannot be printed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Fault {
    /// It has no triangle.
    Empty,
    /// A coordinate is no finite number.
    NotFinite,
    /// The count in the header is not that of the file.
    Header,
    /// An edge has one triangle.
    Open,
    /// An edge has more than two triangles, or a vertex more than one fan.
    NonManifold,
    /// Two neighbours disagree on their directions.
    NotOriented,
    /// Two triangles cross.
    SelfIntersecting,
    /// It encloses a negative volume.
    InsideOut,
}

impl Fault {
    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Empty => "empty",
            Self::NotFinite => "coordinates that are no numbers",
            Self::Header => "a header like a text's",
            Self::Open => "open",
            Self::NonManifold => "not manifold",
            Self::NotOriented => "not oriented",
            Self::SelfIntersecting => "self-intersecting",
            Self::InsideOut => "inside out",
        }
    }
}

impl Solid {
    /// The first thing that keeps it from being printed; `None`: it can be.
    pub fn fault(&self) -> Option<Fault> {
        let Judgement { counts, nonfinite, volume, .. } = &self.judgement;
        [
            (Fault::Empty, counts.triangles == counts.degenerate_index),
            (Fault::NotFinite, *nonfinite > 0),
            (Fault::Header, self.solid_header),
            (Fault::Open, !counts.closed()),
            (Fault::NonManifold, !counts.manifold()),
            (Fault::NotOriented, !counts.oriented()),
            (Fault::SelfIntersecting, self.meeting > 0),
            (Fault::InsideOut, self.inside_out > 0 || *volume <= 0.0),
        ]
        .into_iter()
        .find_map(|(fault, is)| is.then_some(fault))
    }
}

/// Judges a binary STL: topology, self-intersections, and what is inside out.
///
/// O(n log n + pairs of triangles whose boxes touch) time.
///
/// # Errors
/// As [`super::judge`].
pub fn solid(path: &Path) -> Result<Solid> {
    let solid_header = stl::Records::open(path)?.solid;
    let (judgement, components) = examine(Soup::read(path)?);
    let meeting = meeting(&components.triangles);
    Ok(Solid { judgement, meeting, inside_out: inside_out(components), solid_header })
}

/// Lines that are tried for a component.
const LINES: usize = 24;

/// Sealed components of negative volume that the other sealed ones do not wind around.
fn inside_out(components: Components) -> u64 {
    if components.sealed.iter().zip(&components.volumes).all(|(&sealed, &volume)| !sealed || volume >= 0.0) {
        return 0;
    }
    let shells = Shells::from(components);
    let largest = shells.largest_triangles(LINES);
    let is_out = |component: usize| {
        let around = largest[component].iter().find_map(|&triangle| {
            let line = shells.line_through(triangle);
            shells.winding(line, shells.depth_in(triangle, line), |other| other as usize != component)
        });
        // Where no line is certain, it is not shown to be a cavity.
        around.is_none_or(|around| around < 1)
    };
    let parts = &shells.components;
    (0..largest.len()).filter(|&c| parts.sealed[c] && parts.volumes[c] < 0.0 && is_out(c)).count() as u64
}

#[cfg(test)]
mod tests {
    use super::super::Triangle;
    use super::super::shells::tests::{cuboid, inside_out};
    use super::*;

    fn fault(triangles: &[Triangle]) -> Option<Fault> {
        let file = tempfile::NamedTempFile::new().unwrap();
        let mut bytes = vec![0; 80];
        bytes.extend((triangles.len() as u32).to_le_bytes());
        for triangle in triangles {
            bytes.extend([0; 12]);
            bytes.extend(triangle.iter().flatten().flat_map(|x| x.to_le_bytes()));
            bytes.extend([0; 2]);
        }
        std::fs::write(file.path(), &bytes).unwrap();
        let found = solid(file.path()).unwrap().fault();
        if found.is_none() {
            bytes[..5].copy_from_slice(b"Solid");
            std::fs::write(file.path(), bytes).unwrap();
            assert_eq!(solid(file.path()).unwrap().fault(), Some(Fault::Header));
        }
        found
    }

    #[test]
    fn the_first_fault_is_named() {
        let cube = || cuboid([0.0; 3], [4.0; 3]);
        let inner = || cuboid([1.0; 3], [2.0; 3]);
        assert_eq!(fault(&cube()), None);
        assert_eq!(fault(&[]), Some(Fault::Empty));
        assert_eq!(fault(&[[[1.0; 3]; 3]]), Some(Fault::Empty));
        assert_eq!(fault(&[cube(), vec![[[f32::NAN; 3]; 3]]].concat()), Some(Fault::NotFinite));
        assert_eq!(fault(&cube()[1..]), Some(Fault::Open));
        assert_eq!(fault(&[cube(), cuboid([4.0; 3], [5.0; 3])].concat()), Some(Fault::NonManifold));
        let mut turned = cube();
        turned[0].swap(0, 1);
        assert_eq!(fault(&turned), Some(Fault::NotOriented));
        assert_eq!(fault(&[cube(), cuboid([3.0; 3], [5.0; 3])].concat()), Some(Fault::SelfIntersecting));
        // On top of each other, with no vertex in common.
        assert_eq!(fault(&[cube(), cuboid([1.0, 1.0, 4.0], [2.0, 2.0, 5.0])].concat()), Some(Fault::SelfIntersecting));
        assert_eq!(fault(&inside_out(cube())), Some(Fault::InsideOut));
        // A cavity, and a body beside that is inside out.
        assert_eq!(fault(&[cube(), inside_out(inner())].concat()), None);
        assert_eq!(fault(&[cube(), inside_out(cuboid([5.0; 3], [6.0; 3]))].concat()), Some(Fault::InsideOut));
        assert_eq!(fault(&[cube(), inner()].concat()), None);
    }
}
