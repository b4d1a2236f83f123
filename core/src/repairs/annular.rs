//! Missing rings: the two loops that bound one are closed by a strip between them (METHODS C5, D; source S3).
//!
//! Closed each for itself, a tube that has lost a ring would become two bodies, and the mouth of a vessel without its rim be shut.

use super::close::{are_joined, is_admitted};
use super::work::Work;
use crate::chunk::NONE;
use crate::fill::exact::Point;
use crate::fill::{Rim, Unfillable, strip};
use crate::holes;
use crate::holes::loops::{self, Loop};
use crate::parallel;
use crate::settings::Profile;
use crate::shop::{Origin, Shop, Vertex};
use crate::survey::Survey;

/// Bridges all pairs of loops of which the profile admits both; says how many loops that has closed. Those between which no valid strip was
/// found stay open. Strips are found in parallel and put in in order; one that meets an edge of an earlier one is found anew.
pub(super) fn bridge(survey: &Survey<'_>, work: &mut Work<'_>, profile: &Profile, threads: usize) -> u64 {
    if !profile.fill_holes {
        return 0;
    }
    let diagonal = survey.bounds.diagonal();
    let (shop, edges) = work.edges();
    let rims = loops::find(shop, edges);
    let pairs: Vec<[&Loop; 2]> = holes::rings(shop, &rims)
        .into_iter()
        .map(|pair| pair.map(|i| &rims[i]))
        .filter(|pair| pair.iter().all(|rim| is_admitted(shop, rim, profile, diagonal)))
        .collect();
    let strips = parallel::map(threads, pairs.len(), |i| between(shop, &pairs[i]));
    let mut closed = 0;
    for (pair, strip) in pairs.iter().zip(strips) {
        let vertices = concatenated(pair);
        let strip = match strip {
            Ok(strip) if meets_new_edge(work, pair, &strip) => between(work, pair),
            other => other,
        };
        match strip {
            Ok(strip) => {
                for t in strip {
                    work.add(t.map(|i| vertices[i as usize]), Origin::Patch, NONE);
                }
                closed += 2;
            }
            Err(reason) => tracing::info!(%reason, "No strip between two loops around a missing ring; each is closed for itself."),
        }
    }
    closed
}

/// The strip, over the vertices of the first loop and then those of the second.
pub(super) fn between(shop: &Shop, pair: &[&Loop; 2]) -> Result<Vec<[u32; 3]>, Unfillable> {
    let [a, b] = pair.map(|rim| (rim.points(shop), rim.apexes(shop)));
    // A strip has no chords within a rim.
    let none = |_: u32, _: u32| false;
    let vertices = concatenated(pair);
    let joined = |i: u32, j: u32| are_joined(shop, vertices[i as usize], vertices[j as usize]);
    strip::bridge([&rim(&a, &none), &rim(&b, &none)], &joined)
}

fn rim<'a>((points, apexes): &'a (Vec<Point>, Vec<Option<Point>>), forbidden: &'a dyn Fn(u32, u32) -> bool) -> Rim<'a> {
    Rim { points, apexes, forbidden }
}

fn concatenated(pair: &[&Loop; 2]) -> Vec<Vertex> {
    pair.iter().flat_map(|rim| rim.vertices.iter().copied()).collect()
}

/// An edge between the two loops is one of the mesh by now.
fn meets_new_edge(shop: &Shop, pair: &[&Loop; 2], strip: &[[u32; 3]]) -> bool {
    let vertices = concatenated(pair);
    let second = pair[0].vertices.len() as u32;
    strip.iter().any(|t| {
        (0..3).any(|k| {
            let (i, j) = (t[k], t[(k + 1) % 3]);
            (i < second) != (j < second) && shop.has_edge(vertices[i as usize], vertices[j as usize])
        })
    })
}
