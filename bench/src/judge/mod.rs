//! An independent judge of mesh files: plain sorting, no code of the engine's, so that it can be trusted about both sides of a
//! comparison.
//!
//! Vertices are identified by exact f32 coordinates (−0.0 = 0.0), as a slicer does; nothing is tolerated, nothing merged.
//! Triangles with a coordinate that is no number are dropped and counted; triangles with a repeated vertex are counted and left
//! out of everything else. [`judge`] does not look for self-intersections; [`solid()`] does, and says whether a file can be printed.
//! [`Bodies`] tells which bodies of a mesh are still in another one, [`fidelity()`] how much of a solid that was meant is there.
//!
//! O(n log n) time, about 100 bytes of memory a triangle.

mod bodies;
mod boxes;
mod exact;
mod fidelity;
mod judgement;
mod kept;
mod meet;
mod near;
mod shells;
mod skin;
mod solid;
mod stl;
mod topology;

use std::path::Path;

pub use bodies::{Bodies, Found as BodiesFound};
pub use fidelity::{Fidelity, fidelity};
pub use judgement::{Judgement, Triangle};
pub use kept::{Kept, Same, kept_in_order};
pub use near::Near;
pub use skin::{Place, Skin, skin};
pub use solid::{Fault, Solid, solid};
pub use stl::{Error, Result};

/// Judges a binary STL.
///
/// # Errors
/// When the file cannot be read, or is no binary STL whose length is what its count says.
pub fn judge(path: &Path) -> Result<Judgement> {
    Ok(topology::judge(stl::Soup::read(path)?))
}

/// The same of triangles, which are finite.
pub fn judge_triangles(triangles: &[Triangle]) -> Judgement {
    topology::judge(stl::Soup::of(triangles))
}

/// Signed volumes of the components that are sealed: every edge is used equally often in each direction.
pub fn volumes(triangles: &[Triangle]) -> Vec<f64> {
    let parts = topology::examine(stl::Soup::of(triangles)).1;
    parts.volumes.iter().zip(&parts.sealed).filter(|(_, sealed)| **sealed).map(|(volume, _)| *volume).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::generate::{self, Case, Density};

    /// The generators predict, the judge finds; neither knows how the other counts.
    #[test]
    fn finds_in_every_generated_file_what_was_put_there() {
        let folder = tempfile::tempdir().unwrap();
        for (case, density) in Case::ALL.into_iter().flat_map(|case| Density::ALL.map(|density| (case, density))) {
            for (triangles, seed) in [(512, 1), (3_000, 2), (20_000, 3)] {
                let path = folder.path().join("a.stl");
                let truth = generate::write_file_at(case, density, triangles, seed, &path).unwrap();
                let found = judge(&path).unwrap();
                assert_eq!(found.counts, truth.counts, "{case} {density:?}, {triangles} triangles, seed {seed}");
                assert_eq!(found.nonfinite, 0);
            }
        }
    }

    #[test]
    fn a_clean_file_encloses_the_volume_of_the_truth() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.stl");
        let truth = generate::write_file(Case::Clean, 20_000, 1, &path).unwrap();
        let found = judge(&path).unwrap();
        assert!(found.sound() && found.positive_bodies == 1);
        assert!((found.volume / truth.volume - 1.0).abs() < 1e-9, "{} {}", found.volume, truth.volume);
    }

    #[test]
    fn files_that_are_no_binary_stl_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.stl");
        for bytes in [&b""[..], b"solid a\nendsolid a\n", &[0; 85], &[1; 84]] {
            std::fs::write(&path, bytes).unwrap();
            assert!(matches!(judge(&path), Err(Error::Format { .. })));
        }
        assert!(matches!(judge(&folder.path().join("absent")), Err(Error::Io { .. })));
    }
}
