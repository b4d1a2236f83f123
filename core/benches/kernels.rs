//! The inner loops of the engine by themselves, one thread, a quarter of a million triangles of a generated surface.
//!
//! `cargo bench -p suture-core --features internals`; a part of a name as the last argument chooses. Items are triangles (of
//! `triangles_cross`, pairs of them).

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use suture_bench::generate::{Case, write};
use suture_core::internals::Mesh;
use suture_core::internals::{Triangle, triangles_cross};
use suture_core::record::{Record, corners};

fn main() {
    divan::main();
}

const TRIANGLES: u64 = 1 << 18;
/// As the engine's default.
const CHUNK: u32 = 32_768;

fn file(case: Case, triangles: u64) -> Vec<u8> {
    let mut bytes = Vec::new();
    write(case, triangles, 1, &mut bytes).expect("a vector takes what is written to it");
    bytes
}

fn time<T>(bencher: Bencher<'_, '_>, case: Case, mut kernel: impl FnMut(&mut Mesh) -> T) {
    let mut mesh = Mesh::new(&file(case, TRIANGLES), CHUNK).expect("so few triangles are not spooled");
    bencher.counter(ItemsCount::new(mesh.triangles())).bench_local(|| black_box(kernel(&mut mesh)));
}

#[divan::bench(sample_count = 20)]
fn plan(bencher: Bencher<'_, '_>) {
    time(bencher, Case::Clean, |mesh| mesh.plan());
}

/// In the order of the surface: runs are long.
#[divan::bench(sample_count = 20)]
fn run_lists_coherent(bencher: Bencher<'_, '_>) {
    time(bencher, Case::Clean, |mesh| mesh.gather());
}

/// In random order: a run a triangle.
#[divan::bench(sample_count = 20)]
fn run_lists_shuffled(bencher: Bencher<'_, '_>) {
    time(bencher, Case::Shuffled, |mesh| mesh.gather());
}

#[divan::bench(sample_count = 20)]
fn run_lists_read(bencher: Bencher<'_, '_>) {
    time(bencher, Case::Shuffled, |mesh| mesh.list());
}

#[divan::bench(sample_count = 20)]
fn weld(bencher: Bencher<'_, '_>) {
    time(bencher, Case::Clean, Mesh::weld);
}

/// Weld, star test, patches and sums of whole chunks.
#[divan::bench(sample_count = 20)]
fn chunks_clean(bencher: Bencher<'_, '_>) {
    time(bencher, Case::Clean, |mesh| mesh.solve());
}

#[divan::bench(sample_count = 20)]
fn chunks_mixed(bencher: Bencher<'_, '_>) {
    time(bencher, Case::Mixed, |mesh| mesh.solve());
}

#[divan::bench(sample_count = 20)]
fn sums(bencher: Bencher<'_, '_>) {
    time(bencher, Case::Clean, |mesh| mesh.measure());
}

/// The same as `chunks_clean` with the search for self-intersections.
#[divan::bench(sample_count = 20)]
fn chunks_clean_and_search(bencher: Bencher<'_, '_>) {
    time(bencher, Case::Clean, |mesh| mesh.solve_and_cross());
}

#[divan::bench(sample_count = 20)]
fn chunks_mixed_and_search(bencher: Bencher<'_, '_>) {
    time(bencher, Case::Mixed, |mesh| mesh.solve_and_cross());
}

#[divan::bench(sample_count = 20)]
fn box_tree_build(bencher: Bencher<'_, '_>) {
    time(bencher, Case::Clean, |mesh| mesh.grow_tree());
}

#[divan::bench(sample_count = 20)]
fn box_tree_query(bencher: Bencher<'_, '_>) {
    time(bencher, Case::Clean, |mesh| mesh.query_tree());
}

/// Every triangle with the one three places on in the file: near, and mostly apart.
#[divan::bench(sample_count = 20)]
fn triangles_cross_near(bencher: Bencher<'_, '_>) {
    let file = file(Case::Clean, TRIANGLES);
    let (records, _) = file[84..].as_chunks::<50>();
    let triangles: Vec<Triangle> = records.iter().map(|record: &Record| corners(record)).collect();
    bencher.counter(ItemsCount::new(triangles.len() - 3)).bench_local(|| {
        let pairs = triangles.iter().zip(triangles.iter().skip(3));
        pairs.filter(|(a, b)| triangles_cross(black_box(a), black_box(b))).count()
    });
}

/// The same, the second one turned by a quarter: boxes overlap, and many cross.
#[divan::bench(sample_count = 20)]
fn triangles_cross_through(bencher: Bencher<'_, '_>) {
    let file = file(Case::Clean, TRIANGLES);
    let (records, _) = file[84..].as_chunks::<50>();
    let triangles: Vec<Triangle> = records.iter().map(|record: &Record| corners(record)).collect();
    let turned: Vec<Triangle> = triangles.iter().map(|t| t.map(|p| around(t[0], p))).collect();
    bencher.counter(ItemsCount::new(triangles.len())).bench_local(|| {
        let pairs = triangles.iter().zip(&turned);
        pairs.filter(|(a, b)| triangles_cross(black_box(a), black_box(b))).count()
    });
}

/// A quarter of a turn about the line through `middle` along x, and a little to the side.
fn around(middle: [f32; 3], p: [f32; 3]) -> [f32; 3] {
    [p[0] + 1e-3, middle[1] - (p[2] - middle[2]) + 1e-3, middle[2] + (p[1] - middle[1])]
}
