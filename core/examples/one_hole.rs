//! Finds the boundary loops of a mesh, closes one of them with a flat patch, and leaves the rest of the mesh alone.
//!
//! `cargo run -p suture-core --example one_hole`

use suture_core::operations::{Fill, fill, find_loops};
use suture_core::{Limits, Mesh, PatchShape, Quiet};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // The four sides of a box: it has no bottom and no top.
    let corners = (0..8u8).map(|n| [n & 1, n >> 1 & 1, n >> 2].map(f32::from)).collect();
    let sides = vec![[0, 1, 5], [0, 5, 4], [2, 6, 7], [2, 7, 3], [0, 4, 6], [0, 6, 2], [1, 3, 7], [1, 7, 5]];
    let mesh = Mesh::new(corners, sides)?;
    let limits = Limits::default();

    for found in find_loops(&mesh, &limits, &Quiet)? {
        println!("{} loop of {} vertices: {:?}", found.facts.class.name(), found.vertices.len(), found.vertices);
    }

    let top = mesh.vertices()[4];
    let how = Fill::default().only_loop(Some(top)).shape(PatchShape::Flat);
    let filled = fill(&mesh, &how, &limits, &Quiet)?;
    println!("{} faces now; left open: {:?}", filled.mesh.faces().len(), filled.report.loops_left);
    Ok(())
}
