//! Repairs a mesh from memory and prints where each face of the result comes from.
//!
//! `cargo run -p suture-core --example origins`

use suture_core::{FaceOrigin, Limits, Mesh, Profile, Quiet, repair_mesh};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // A cube of side 1. One of its faces is missing, and one is turned over.
    let corners = (0..8u8).map(|n| [n & 1, n >> 1 & 1, n >> 2].map(f32::from)).collect();
    let faces = vec![
        [0, 2, 3],
        [0, 3, 1],
        [4, 5, 7],
        [4, 7, 6],
        [0, 1, 5],
        [0, 5, 4],
        [2, 6, 7],
        [2, 7, 3],
        [0, 4, 6],
        [0, 2, 6],
        [1, 3, 7],
    ];
    let mesh = Mesh::new(corners, faces)?;

    let repaired = repair_mesh(&mesh, &Profile::default(), &Limits::default(), &Quiet)?;

    println!("{}", repaired.report.verdict.statement);
    for (face, (corners, origin)) in repaired.mesh.faces().iter().zip(&repaired.origins).enumerate() {
        let origin = match origin {
            FaceOrigin::Input(before) => format!("face {before}, as it was"),
            FaceOrigin::Flipped(before) => format!("face {before}, turned over"),
            FaceOrigin::Repair(repair) => format!("made by the repair `{repair}`"),
            other => format!("{other:?}"),
        };
        println!("face {face} {corners:?}: {origin}");
    }
    Ok(())
}
