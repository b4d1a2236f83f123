//! Closes boundary loops by triangulations between their vertices (METHODS C8, basic).

use std::collections::BTreeMap;

use super::loops::{self, Loop};
use crate::chunk::NONE;
use crate::fill::{self, FillSettings, Rim};
use crate::parallel;
use crate::report::LoopLeft;
use crate::settings::Profile;
use crate::shop::edges::Edges;
use crate::shop::{Origin, Shop};

/// What was closed, by method, and what was not.
#[derive(Debug, Default)]
pub(super) struct Closed {
    pub(super) loops: u64,
    pub(super) by_method: BTreeMap<&'static str, u64>,
    pub(super) left: Vec<LoopLeft>,
}

/// Longest list of open loops in a report.
const LISTED: usize = 1000;

/// Fills every loop that the profile admits. Patches are found in parallel and put in in the loops' order; one that meets an edge
/// that an earlier one has made is found anew, so that the result does not depend on the threads.
pub(super) fn fill_loops(shop: &mut Shop, profile: &Profile, diagonal: f64, threads: usize) -> Closed {
    let edges = Edges::of(shop);
    let rims = loops::find(shop, &edges);
    let patches = parallel::map(threads, rims.len(), |i| fill(shop, &rims[i], profile, diagonal));
    let mut closed = Closed::default();
    for (rim, patch) in rims.iter().zip(patches) {
        let patch = match patch {
            Ok(patch) if meets_new_edge(shop, rim, &patch) => fill(shop, rim, profile, diagonal),
            other => other,
        };
        match patch {
            Ok(patch) => {
                for t in patch.triangles {
                    shop.add(t.map(|i| rim.vertices[i as usize]), Origin::Patch, NONE);
                }
                closed.loops += 1;
                *closed.by_method.entry(patch.method.name()).or_default() += 1;
            }
            Err(reason) if closed.left.len() < LISTED => closed.left.push(LoopLeft {
                at: shop.positions[rim.vertices[0] as usize],
                edges: rim.vertices.len() as u64,
                perimeter: rim.perimeter(shop),
                reason,
            }),
            Err(_) => {}
        }
    }
    closed
}

/// A chord of the patch is an edge of the mesh by now.
fn meets_new_edge(shop: &Shop, rim: &Loop, patch: &fill::Patch) -> bool {
    let n = rim.vertices.len() as u32;
    patch.triangles.iter().any(|t| {
        (0..3).any(|k| {
            let (i, j) = (t[k], t[(k + 1) % 3]);
            j != (i + 1) % n && shop.has_edge(rim.vertices[i as usize], rim.vertices[j as usize])
        })
    })
}

fn fill(shop: &Shop, rim: &Loop, profile: &Profile, diagonal: f64) -> Result<fill::Patch, String> {
    if !profile.fill_holes {
        return Err("the profile fills no holes".into());
    }
    let n = rim.vertices.len();
    if n as u64 > u64::from(profile.max_hole_edges) {
        return Err(format!("more than the profile's {} edges", profile.max_hole_edges));
    }
    let bound = profile.max_hole_perimeter_relative * diagonal;
    if rim.perimeter(shop) > bound {
        return Err(format!("longer than the profile's {bound:.3}"));
    }
    let points = rim.points(shop);
    let apexes: Vec<_> = (0..n)
        .map(|i| {
            let ends = [rim.vertices[i], rim.vertices[(i + 1) % n]];
            let apex = shop.triangles[rim.triangles[i] as usize].v.into_iter().find(|v| !ends.contains(v));
            apex.map(|v| shop.positions[v as usize])
        })
        .collect();
    let forbidden = |i: u32, j: u32| {
        let (a, b) = (rim.vertices[i as usize], rim.vertices[j as usize]);
        if shop.complete[a as usize] { shop.has_edge(a, b) } else { shop.has_edge(b, a) }
    };
    let settings = FillSettings { max_vertices: profile.max_hole_edges as usize, ..FillSettings::default() };
    fill::triangulate(&Rim { points: &points, apexes: &apexes, forbidden: &forbidden }, &settings).map_err(|e| e.to_string())
}
