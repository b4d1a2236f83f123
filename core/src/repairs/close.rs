//! Closes boundary loops by triangulations between their vertices (METHODS C8, basic).

use std::collections::BTreeMap;

use super::loops::{self, Loop};
use crate::chunk::NONE;
use crate::fill::{self, FillSettings, Rim};
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

/// Fills every loop that the profile admits, in order; later ones see the edges of earlier ones.
pub(super) fn fill_loops(shop: &mut Shop, profile: &Profile, diagonal: f64) -> Closed {
    let edges = Edges::of(shop);
    let mut closed = Closed::default();
    for rim in loops::find(shop, &edges) {
        match fill(shop, &rim, profile, diagonal) {
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
