//! The page's sections on how well holes are closed.

use super::book::Book;
use super::closing::PICTURES;
use super::made::{Closed, Shaped, Shaper};
use super::markdown::{self, mean_and_worst, or_dash};
use super::sides::Side;
use super::statistics::{Spread, spaced};

/// One rim of one hole, as every program closed it. Distances are lengths of the file.
struct Rim {
    bound: f64,
    suture: Option<f64>,
    implicit: Option<f64>,
    meshlib: Option<f64>,
    pymeshlab: Option<f64>,
    suture_normals: Option<f64>,
    meshlib_normals: Option<f64>,
}

impl Rim {
    /// From the lines of all programs.
    fn of(lines: &[&&Shaped]) -> Option<Self> {
        let of = |tool: Shaper| lines.iter().find(|line| line.tool == tool)?.measured.filter(|m| m.open_edges == 0);
        // A patch without vertices of its own is as far off as its triangles are.
        let far = |tool| of(tool).map(|m| m.vertices.unwrap_or(m.triangles));
        let (pymeshlab, suture) = (far(Shaper::Pymeshlab), of(Shaper::Suture));
        let best = lines.iter().filter(|line| line.tool.is_meshlib()).filter_map(|line| Some((far(line.tool)?, of(line.tool)?)));
        let best = best.min_by(|a, b| a.0.total_cmp(&b.0));
        Some(Self {
            bound: (2.0 * lines.first()?.chord_error).max(pymeshlab.unwrap_or(0.0) / 10.0),
            suture: far(Shaper::Suture),
            implicit: far(Shaper::SutureImplicit),
            meshlib: best.map(|best| best.0),
            pymeshlab,
            suture_normals: suture.and_then(|m| m.normals),
            meshlib_normals: best.and_then(|best| best.1.normals),
        })
    }

    /// Within the bound, no worse than MeshLib, normals within two degrees.
    fn holds(&self) -> bool {
        let far = self.suture.is_some_and(|far| far <= self.bound && self.meshlib.is_none_or(|theirs| far <= theirs));
        far && self.suture_normals.is_some_and(|angle| angle <= 2.0)
    }
}

/// How true patches are to surfaces that are known.
pub(super) fn shapes(book: &Book) -> String {
    let lines = book.last(|chapter| chapter.shaped().collect());
    let mut kinds: Vec<_> = lines.iter().map(|line| (line.surface.as_str(), line.hole.share)).collect();
    kinds.dedup();
    let mut samplings: Vec<_> = lines.iter().map(|line| line.hole.sampling).collect();
    samplings.sort_unstable_by(f64::total_cmp);
    samplings.dedup();
    let (mut rows, mut kept, mut all) = (String::new(), 0, 0);
    let mut shown = Vec::new();
    for kind in kinds {
        if shown.contains(&kind) {
            continue;
        }
        shown.push(kind);
        let rims: Vec<Rim> = samplings
            .iter()
            .filter_map(|sampling| {
                let same = |line: &&&Shaped| (line.surface.as_str(), line.hole.share) == kind && line.hole.sampling == *sampling;
                Rim::of(&lines.iter().filter(same).collect::<Vec<_>>())
            })
            .collect();
        kept += rims.iter().filter(|rim| rim.holds()).count();
        all += rims.len();
        rows += &markdown::row(&columns(kind, &rims));
    }
    if rows.is_empty() {
        return rows;
    }
    let text = "A round hole in a closed mesh of a sphere of radius 1, of a torus of radii 1 and 0.4 on its outer and its inner side, and of \
                the saddle z = (x² − y²)/2, its radius a share of the surface's smallest radius of curvature. Three figures each: the \
                rim's edges are 0.5, 1 and 4 times as long as the edges around. First the largest distance of a patch's new vertices from \
                the true surface (where there are none, of its triangles). Asked is at most the bound, which is a tenth of what \
                pymeshlab's `meshing_close_holes` leaves with refinement, or twice the chord error of the mesh around where that is more; \
                and not more than MeshLib's `fillHoleNicely`, for each hole the best of those four settings of its smoothing that leave the mesh around untouched. Then the largest \
                angle between vertex normals along the rim and the surface's, in degrees: at most 2.";
    let head = "| surface, hole | suture | suture, implicit | MeshLib, best | pymeshlab | bound | normals, suture | normals, MeshLib |\n\
                |---|---|---|---|---|---|---|---|\n";
    let [hole, bowl] = PICTURES.map(|name| format!("plots/{name}"));
    format!(
        "\n## The shape of patches\n\n{text}\n\n{head}{rows}\nAll of it holds of Suture in {kept} of {all} holes.\n\n\
         ![The sphere's hole of 40 %: open, and closed by pymeshlab, MeshLib and Suture]({hole})\n\n\
         *The sphere's hole of 40 %: open, and closed by pymeshlab, MeshLib (its best setting) and Suture*\n\n\
         ![A bowl of two skins without its rim: open, and closed by pymeshlab, MeshLib and Suture]({bowl})\n\n\
         *A bowl of two skins without its rim: open, capped by pymeshlab and MeshLib, bridged by Suture*\n"
    )
}

/// A row of the table: one hole, with figures for each sampling of its rim.
fn columns((surface, share): (&str, f64), rims: &[Rim]) -> [String; 8] {
    let each =
        |value: &dyn Fn(&Rim) -> Option<String>| rims.iter().map(|rim| or_dash(value(rim))).collect::<Vec<_>>().join(" / ");
    let far = |value: fn(&Rim) -> Option<f64>| each(&|rim| value(rim).map(|far| format!("{far:.1e}")));
    let angle = |value: fn(&Rim) -> Option<f64>| each(&|rim| value(rim).map(|angle| format!("{angle:.2}")));
    [
        format!("{surface}, {:.0} %", 100.0 * share),
        far(|rim| rim.suture),
        far(|rim| rim.implicit),
        far(|rim| rim.meshlib),
        far(|rim| rim.pymeshlab),
        far(|rim| Some(rim.bound)),
        angle(|rim| rim.suture_normals),
        angle(|rim| rim.meshlib_normals),
    ]
}

/// The section on real files with holes.
pub(super) fn files(book: &Book) -> String {
    let lines = book.last(|chapter| chapter.closed().collect());
    let mut rows = String::new();
    for side in [Side::Suture, Side::PymeshlabCompetent, Side::Meshlib] {
        let of: Vec<_> = lines.iter().filter(|line| line.side == side).copied().collect();
        if !of.is_empty() {
            rows += &markdown::row(&row(side, &of));
        }
    }
    if rows.is_empty() {
        return rows;
    }
    let open: Vec<_> = lines.iter().filter(|line| line.side == Side::Suture && !is_closed(line)).collect();
    let named = open.iter().filter(|line| line.named_open.is_some_and(|loops| loops > 0)).count();
    let text = "Real files with boundary edges, each given to all as the same binary STL. *Closed* and *manifold* are the judge's words; \
                pairs of triangles that cross or overlap are counted by `suture inspect` before and after, and *new* is what a file has \
                more than before. *Kept* is the share of a file's triangles that are in the output bit by bit, in the same direction. \
                *Taken* is the largest distance from the input to the output, *added* from the output to the input, as shares of the \
                diagonal; the latter is for the greater part a matter of how wide the holes are. These are means over the files that were \
                written, the worst file in brackets.";
    let head = "| | files | written | closed | closed, no new pair | closed and manifold | closed, manifold, no pair at all | files with new pairs | new pairs | pairs gone | kept | taken | added |\n\
                |---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|\n";
    let left = format!(
        "Of the {} files that Suture left open, its report names at least one open loop, with the rule that kept it so, in {named}.",
        open.len()
    );
    format!("\n## Closing real files\n\n{text}\n\n{head}{rows}\n{left}\n")
}

fn is_closed(line: &Closed) -> bool {
    line.after.is_some_and(|after| after.counts.closed())
}

fn is_manifold(line: &Closed) -> bool {
    line.after.is_some_and(|after| after.counts.manifold())
}

fn row(side: Side, lines: &[&Closed]) -> Vec<String> {
    let count = |is: &dyn Fn(&&&Closed) -> bool| lines.iter().filter(is).count().to_string();
    let new = |line: &Closed| -> i64 { pairs(line).map_or(0, |(before, after)| after as i64 - before as i64) };
    let mean = |value: fn(&Closed) -> Option<f64>, worst: fn(Spread) -> f64| {
        mean_and_worst(lines.iter().filter_map(|line| value(line)).collect(), worst)
    };
    let sum = |sign: i64| spaced(lines.iter().map(|line| (sign * new(line)).max(0) as u64).sum());
    vec![
        side.facts().name.into(),
        lines.len().to_string(),
        count(&|line| line.after.is_some()),
        count(&|line| is_closed(line)),
        count(&|line| is_closed(line) && new(line) <= 0),
        count(&|line| is_closed(line) && is_manifold(line)),
        count(&|line| is_closed(line) && is_manifold(line) && pairs(line).is_some_and(|(_, after)| after == 0)),
        count(&|line| new(line) > 0),
        sum(1),
        sum(-1),
        mean(|line| line.change.map(|change| change.kept), |spread| spread.least),
        mean(|line| line.change.map(|change| change.taken), |spread| spread.most),
        mean(|line| line.change.map(|change| change.added), |spread| spread.most),
    ]
}

fn pairs(line: &Closed) -> Option<(u64, u64)> {
    Some((line.before.pairs?, line.after?.pairs?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compare::made::Found;
    use crate::holes::{Change, Hole, Measured};
    use suture_bench::Counts;

    fn shaped(tool: Shaper, vertices: Option<f64>, triangles: f64, normals: f64) -> Shaped {
        let measured = Some(Measured { added: 1, vertices, triangles, normals: Some(normals), open_edges: 0, lost: 0 });
        Shaped { surface: "sphere".into(), hole: Hole { share: 0.1, sampling: 1.0 }, chord_error: 1e-3, tool, measured }
    }

    #[test]
    fn the_bound_is_a_tenth_of_pymeshlab_or_twice_the_chord_error_and_meshlib_its_best() {
        let suture = shaped(Shaper::Suture, Some(4e-3), 9.0, 1.0);
        let others = [shaped(Shaper::Meshlib, Some(8e-3), 9.0, 5.0), shaped(Shaper::MeshlibEqual, Some(5e-3), 9.0, 0.5)];
        let rim = |pymeshlab| {
            Rim::of(&[&&suture, &&others[0], &&others[1], &&shaped(Shaper::Pymeshlab, pymeshlab, 0.06, 9.0)]).unwrap()
        };
        assert_eq!((rim(Some(0.01)).bound, rim(Some(0.05)).bound), (2e-3, 0.05 / 10.0));
        assert!(!rim(Some(0.01)).holds() && rim(Some(0.05)).holds());
        // It added no vertices: its triangles count.
        assert_eq!(rim(None).bound, 0.06 / 10.0);
        assert_eq!((rim(None).meshlib, rim(None).meshlib_normals), (Some(5e-3), Some(0.5)));
    }

    #[test]
    fn files_are_counted_and_new_pairs_never_weighed_against_pairs_gone() {
        let found = |boundary_edges, pairs| Found {
            counts: Counts { triangles: 4, boundary_edges, ..Counts::default() },
            pairs: Some(pairs),
        };
        let line = |after: Option<Found>, kept| Closed {
            file: "a".into(),
            side: Side::Suture,
            before: found(3, 5),
            after,
            change: after.map(|_| Change { kept, taken: 0.001, added: 0.02 }),
            end: "exit 0".into(),
            seconds: 1.0,
            named_open: Some(0),
        };
        let lines = [line(Some(found(0, 7)), 1.0), line(Some(found(0, 0)), 0.9), line(Some(found(2, 5)), 0.8), line(None, 0.0)];
        let row = row(Side::Suture, &lines.iter().collect::<Vec<_>>());
        assert_eq!(row[1..10], ["4", "3", "2", "1", "2", "1", "1", "2", "5"]);
        assert_eq!(row[10..], ["90.000 % (80.00 %)", "0.100 % (0.10 %)", "2.000 % (2.00 %)"]);
    }
}
