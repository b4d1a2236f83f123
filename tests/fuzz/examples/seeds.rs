//! Writes the seeds of all targets to `corpus/`, a folder for each.

use std::path::Path;

fn main() -> std::io::Result<()> {
    let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus");
    for (target, seeds) in suture_fuzz::seeds::all() {
        let folder = corpus.join(target);
        std::fs::create_dir_all(&folder)?;
        for (k, seed) in seeds.iter().enumerate() {
            std::fs::write(folder.join(format!("seed-{k}")), seed)?;
        }
    }
    Ok(())
}
