//! tobj, a peer that is a Rust crate: this program loads one OBJ by it, in a process that `formats` measures.

use std::path::Path;
use std::time::Instant;

use serde_json::json;

use super::error::Error;

/// Loads an OBJ, triangulated, and returns the line that every script of `pipelines/` ends with: the seconds of the stage `load`, and how
/// many triangles were read.
///
/// # Errors
/// When tobj cannot load it.
pub(crate) fn load_obj(path: &Path) -> Result<String, Error> {
    let settings = tobj::LoadOptions { triangulate: true, ..Default::default() };
    let begin = Instant::now();
    let (models, _) = tobj::load_obj(path, &settings).map_err(|error| Error::Mesh(error.to_string()))?;
    let seconds = begin.elapsed().as_secs_f64();
    let triangles: usize = models.iter().map(|model| model.mesh.indices.len() / 3).sum();
    Ok(json!({ "stages": [{ "name": "load", "seconds": seconds }], "facts": { "triangles": triangles } }).to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_square_is_two_triangles() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("square.obj");
        std::fs::write(&path, "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n").unwrap();
        let said: serde_json::Value = serde_json::from_str(&load_obj(&path).unwrap()).unwrap();
        assert_eq!(said["facts"]["triangles"], 2);
        assert!(said["stages"][0]["seconds"].as_f64().is_some_and(|seconds| seconds > 0.0), "{said}");
        assert!(load_obj(&folder.path().join("none.obj")).is_err());
    }
}
