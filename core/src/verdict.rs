//! The verdict: what counts of defects say about a file.

use crate::report::{Defects, Verdict};
use crate::settings::Profile;
use crate::sums::Bounds;

/// What no version yet checks is called unchecked, never assumed.
const UNCHECKED: &str = "self-intersection";

/// Judges a file by the defects counted on its bytes and by what is wrong with the file itself.
pub(crate) fn judge(defects: &Defects, flaws: &[String]) -> Verdict {
    let closed = defects.triangles > defects.degenerate_index && defects.boundary_edges == 0;
    let manifold = defects.nonmanifold_edges == 0 && defects.nonmanifold_vertices == 0;
    let oriented = defects.inconsistent_edges == 0 && defects.unbalanced_edges == 0;
    let mut reasons: Vec<String> = flaws.to_vec();
    let mut say = |count: u64, what: &str| {
        if count > 0 {
            reasons.push(format!("{count} {what}"));
        }
    };
    say(defects.nonfinite, "triangles with NaN or infinite coordinates");
    say(defects.degenerate_index, "triangles with a repeated vertex");
    say(defects.degenerate_area, "triangles of no area");
    say(defects.duplicates_same, "duplicate triangles");
    say(defects.duplicates_opposite, "pairs of triangles back to back");
    say(defects.boundary_edges, "boundary edges");
    say(defects.nonmanifold_edges, "non-manifold edges");
    say(defects.nonmanifold_vertices, "non-manifold vertices");
    say(defects.inconsistent_edges, "edges whose triangles disagree");
    if defects.boundary_edges + defects.inconsistent_edges == 0 {
        say(defects.unbalanced_edges, "edges not used equally often in both directions");
    }
    say(defects.inverted_components, "components inside out");
    if defects.triangles == defects.degenerate_index {
        reasons.push("no triangle with three distinct vertices".into());
    } else if closed && oriented && defects.volume <= 0.0 {
        reasons.push("the enclosed volume is not positive".into());
    }
    let good = reasons.is_empty() && closed && manifold && oriented;
    let words: Vec<&str> =
        [(closed, "closed", "open"), (manifold, "manifold", "not manifold"), (oriented, "oriented", "not oriented")]
            .iter()
            .map(|(holds, yes, no)| if *holds { *yes } else { *no })
            .collect();
    Verdict {
        good,
        statement: format!("{}; {UNCHECKED} unchecked", words.join(", ")),
        closed,
        manifold,
        oriented,
        reasons,
        unchecked: vec![UNCHECKED.into()],
    }
}

/// What a good result has changed beyond the profile's limits, in words; empty when a person need not look. `surface`: the box of the
/// input's surface, triangles of no area left out.
pub(crate) fn review(before: &Defects, surface: &Bounds, after: &Defects, profile: &Profile) -> Vec<String> {
    let mut concerns = Vec::new();
    // The volume of an open or incoherent surface depends on the origin, and duplicates count twice: only what enclosed a volume
    // once can be compared.
    let enclosed = before.boundary_edges + before.unbalanced_edges + before.nonmanifold_edges + before.inverted_components == 0;
    if enclosed && before.volume > 0.0 {
        let change = (after.volume - before.volume).abs() / before.volume;
        if change > profile.max_volume_change {
            concerns.push(format!("the volume changed by {:.1} %, from {} to {}", change * 100.0, before.volume, after.volume));
        }
    }
    if let Some([lo, hi]) = after.bounds {
        let pairs = surface.lo.iter().zip(lo).chain(surface.hi.iter().zip(hi));
        let most = pairs.map(|(a, b)| (f64::from(*a) - f64::from(b)).abs()).fold(0.0, f64::max);
        if most > profile.max_box_change_relative * surface.diagonal() {
            concerns.push(format!("the bounding box moved by {most}"));
        }
    }
    let lost = before.bodies.saturating_sub(after.bodies + after.nested_positive);
    if lost > u64::from(profile.max_bodies_lost) {
        concerns.push(format!("{lost} of {} bodies were lost", before.bodies));
    }
    concerns
}
