//! The verdict: what counts of defects say about a file.

use crate::report::{Defects, Verdict};

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
    say(defects.inverted_components, "components inside out");
    if defects.triangles == defects.degenerate_index {
        reasons.push("no triangle with three distinct vertices".into());
    } else if closed && oriented && defects.volume <= 0.0 {
        reasons.push("the enclosed volume is not positive".into());
    }
    let good = reasons.is_empty() && closed && manifold && oriented;
    let words: Vec<&str> = [
        (closed, "closed", "open"),
        (manifold, "manifold", "not manifold"),
        (oriented, "oriented", "not oriented"),
    ]
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
