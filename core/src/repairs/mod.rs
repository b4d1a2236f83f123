//! All repairs of one file, in their order, on its workshop. What comes out is an edit against the input.
//!
//! Weld and splits change stars, so components, orientation and loops come after them; the surface is filled before it is decided
//! what is outward, since the signed volume of an open surface depends on the origin.

mod admit;
mod annular;
mod apart;
mod close;
mod collinear;
mod debris;
mod duplicates;
mod facing;
mod guard;
mod islands;
mod junction;
mod lap;
mod layer;
mod merge;
mod orient;
mod overlay;
mod overrun;
mod placed;
mod probes;
mod regions;
mod resolve;
mod seat;
mod sheets;
mod smooth;
mod surplus;
mod swallowed;
mod unpin;
mod visible;
mod work;
mod wrap;
mod zip;

use std::path::Path;
use std::time::Instant;

use crate::contract::error::Result;
use crate::contract::progress::Progress;
use crate::contract::report::{BoundaryLoops, LoopLeft, Region, Regions, Repair, SheetDropped, Volumes, Wrap};
use crate::contract::settings::{Bodies, Guarantee, Limits, Profile};
use crate::detect::holes;
use crate::detect::verdict::Swallowed;
use crate::diagnosis::Diagnosis;
use crate::geometry::arrange::Rational;
use crate::submesh::components::{Components, Reversed};
use crate::submesh::near::Tolerance;
use crate::topology::survey::Survey;
use overlay::Overlay;
use probes::Probes;
use resolve::{Means, Resolved};
use work::Work;

/// What the repairs did; the mesh itself is in the diagnosis' shop.
pub(crate) struct Repaired {
    pub(crate) reversed: Reversed,
    pub(crate) repairs: Vec<Repair>,
    /// The boundary loops as they were recognised, before any was closed.
    pub(crate) loops: BoundaryLoops,
    pub(crate) loops_left: Vec<LoopLeft>,
    pub(crate) sheets: Vec<SheetDropped>,
    pub(crate) swallowed: Swallowed,
    /// What was replaced because nothing else made it a solid, or would have been.
    pub(crate) wraps: Vec<Wrap>,
    /// What became of the volume of bodies; `None` where nothing was done that might have lost any.
    pub(crate) volumes: Option<Volumes>,
    pub(crate) regions: Regions,
    /// The triangles that replace it, which are not in the shop.
    pub(crate) wrapped: Vec<[[f32; 3]; 3]>,
}

/// Rounds of weld, split and clean-up: each round can uncover work for the next. A count, so that results do not depend on time.
const ROUNDS: usize = 4;

const DEGENERATE: &str = "triangles without area removed, their T-junctions closed";
const DUPLICATE: &str = "triangles on the vertices of another one";

/// Repairs what the profile allows.
///
/// # Errors
/// [`Error::Starved`] when there is not memory enough.
pub(crate) fn run(
    diagnosis: &mut Diagnosis<'_>,
    path: &Path,
    profile: &Profile,
    limits: &Limits,
    progress: &dyn Progress,
) -> Result<Repaired> {
    let threads = limits.threads;
    let mut log = Log::default();
    let mut reversed = Reversed::none(&diagnosis.survey);
    let Diagnosis { survey, shop, tolerance, defects } = diagnosis;
    let shop = &mut Work::new(shop);
    prepare(survey, shop, tolerance, &mut log);
    let mut loops = None;
    for _ in 0..ROUNDS {
        let mut changes = weld(survey, shop, tolerance, &mut log);
        loops.get_or_insert_with(|| report_loops(shop, tolerance, profile));
        changes += log.time("t_junction", "vertices inside a neighbour's edge, which was split there", || {
            junction::split_edges(shop, tolerance)
        });
        if changes == 0 {
            break;
        }
    }
    log.time("zip", "vertices merged with the one that faces them across a narrow gap", || zip::zip(shop, tolerance, profile));
    clean(survey, shop, &mut log);
    log.time("overrun", "triangles of slits whose sides run past each other into the model, cut back", || {
        overrun::cut_back(survey, shop)
    });
    log.time("debris", "triangles of open specks dropped, which together are next to nothing of the surface", || {
        debris::drop(survey, shop, profile)
    });
    let mut faced = facing::Faced::default();
    if profile.resolve_crossings && survey.crossing_pairs.is_some() {
        log.time("facing", "triangles turned that are seen from behind, or whose neighbours are", || {
            faced = facing::face_outward(survey, shop, &mut reversed);
            faced.triangles
        });
    }
    let mut contradictions = 0;
    log.time("orient", "triangles turned to agree with their neighbours", || {
        let turned = orient::make_coherent(survey, shop, &mut reversed, &faced.settled);
        contradictions = turned.contradictions;
        turned.triangles
    });
    if contradictions > 0 {
        tracing::info!(edges = contradictions, "No orientation satisfies all edges: a surface is one-sided.");
    }
    let (mut loops_left, mut kept_open, mut closed_across) = (Vec::new(), Vec::new(), Vec::new());
    let mut seated = 0;
    log.time("seat", "rims of open shapes that stand on other surface, let down into it", || {
        seated = seat::let_down(survey, shop, &reversed, profile);
        seated
    });
    let mut lone = Vec::new();
    let mut methods = String::new();
    log.time("fill", "", || {
        let closed = close::fill_loops(survey, shop, &reversed, tolerance, profile, threads);
        (loops_left, kept_open) = (closed.left, closed.kept_open);
        lone = closed.sheets;
        closed_across = closed.across;
        let parts: Vec<String> = closed.by_method.iter().map(|(name, count)| format!("{count} {name}")).collect();
        methods = format!("loops closed: {}", parts.join(", "));
        closed.loops
    });
    log.note("fill", methods);
    let mut sheets = Vec::new();
    log.time("sheets", "open sheets dropped that can be no part of a solid, listed in `sheets_dropped`", || {
        sheets = sheets::drop(survey, shop, &mut reversed, &lone, &mut loops_left, profile);
        sheets.len() as u64
    });
    let mut pieces = outward(survey, shop, &mut reversed, &mut log);
    // All is closed that can be, and nothing is cut, removed or replaced yet.
    let may_lose = !closed_across.is_empty()
        || defects.nested_positive > 0
        || profile.bodies == Bodies::Visible
        || profile.check_self_intersections && survey.crossing_pairs.as_ref().is_none_or(|pairs| !pairs.is_empty())
        || wrap::is_broken(shop);
    let probes = may_lose.then_some(()).and_then(|()| {
        let turned = pieces.is_none().then(|| orient::pieces(survey, shop, &reversed));
        pieces.as_ref().or(turned.as_ref()).map(|pieces| Probes::of(survey, shop, &reversed, pieces))
    });
    let mut resolved = Resolved::default();
    if profile.resolve_crossings {
        let across = seated > 0 || !closed_across.is_empty();
        log.try_time("resolve", "", || {
            let means = Means { path, limits, progress };
            resolved = resolve::resolve(&Rational, survey, shop, &mut reversed, profile, across, &means)?;
            Ok(resolved.pairs)
        })?;
        log.time("dust", "bodies that cutting left, each of less than 2⁻⁴⁰ of all volume, dropped", || {
            resolved.dust.len() as u64
        });
        let open = close::open_again(shop, closed_across, &resolved.taken_part);
        log.take_back("fill", open.len() as u64);
        loops_left.extend(open);
        if resolved.divided {
            // What was cut off may stand for itself.
            pieces = outward(survey, shop, &mut reversed, &mut log);
        }
    }
    if resolved.pairs > 0 {
        log.note(
            "resolve",
            format!(
                "pairs of triangles that crossed; rounds: {}, vertices moved by at most {:e}, bodies that became part of others: {}, with {:.4} units³ of them",
                resolved.rounds, resolved.displaced, resolved.bodies, resolved.volume
            ),
        );
    }
    for (failure, pieces) in &resolved.left {
        log.say("crossings left", format!("of {pieces} pieces of surface: {failure}"));
    }
    let mut swallowed = Swallowed::default();
    let mut hidden = visible::Hidden::default();
    log.time("swallowed", "", || {
        let pieces = pieces.get_or_insert_with(|| orient::pieces(survey, shop, &reversed));
        swallowed = swallowed::remove(survey, shop, &mut reversed, pieces, profile);
        swallowed.bodies
    });
    log.time("hidden", "", || {
        let pieces = pieces.get_or_insert_with(|| orient::pieces(survey, shop, &reversed));
        hidden = visible::remove(survey, shop, &mut reversed, pieces, &mut loops_left, profile);
        hidden.pieces
    });
    log.note("hidden", hidden.to_string());
    sheets.append(&mut hidden.sheets);
    let Swallowed { bodies, volume, .. } = &swallowed;
    let note = format!("bodies in the material of others removed: {bodies}, of {volume:.4} units³ together");
    log.note("swallowed", note);
    swallowed.bodies += resolved.bodies + hidden.expected.bodies;
    swallowed.volume += resolved.volume + hidden.expected.volume;
    let mut separated = apart::Separated::default();
    log.time("separated", "", || {
        separated = apart::separate(survey, shop, &reversed, profile);
        unpin::unpin(survey, shop, &reversed, profile, &mut separated);
        separated.vertices + separated.edges + separated.removed
    });
    log.note("separated", separated.to_string());
    if separated.vertices + separated.edges + separated.removed > 0 {
        // What hung on a body by an edge or a vertex stands for itself now.
        outward(survey, shop, &mut reversed, &mut log);
    }
    let mut wraps = wrap::Wraps::default();
    // What was resolved crosses nothing any more.
    let may_cross = !profile.resolve_crossings || !resolved.left.is_empty() || separated.edges > 0;
    if profile.guarantee == Guarantee::Wrap && (may_cross || wrap::is_broken(shop)) {
        log.time("wrap", "regions that nothing else made a solid, replaced by a surface around what they enclose", || {
            let overlay = || Overlay::of(survey, shop, &reversed);
            let pairs = if profile.check_self_intersections {
                overlay().and_then(|overlay| overlay.crossing_pairs(survey, shop))
            } else {
                Some(Vec::new())
            };
            wraps = wrap::replace(survey, shop, &mut reversed, pairs.as_deref(), &kept_open, profile, threads);
            wraps.regions
        });
        loops_left.retain(|left| !wraps.replaced(left.at));
    }
    let volumes = probes.map(|probes| {
        let pieces = orient::pieces(survey, shop, &reversed);
        probes.look_for(survey, shop, &reversed, &pieces, &wraps.triangles)
    });
    let mut all = std::mem::take(&mut resolved.regions);
    all.append(&mut resolved.dust);
    all.append(&mut swallowed.regions);
    all.append(&mut separated.regions);
    all.extend(sheets.iter().map(Region::from));
    let left = resolved.regions_left.into_iter().chain(separated.regions_left);
    all.extend(left.filter(|left| !wraps.replaced(left.at)).map(|left| left.region));
    all.extend(wraps.listed.iter().map(Region::from));
    Ok(Repaired {
        reversed,
        repairs: log.repairs,
        loops: loops.unwrap_or_default(),
        loops_left,
        sheets,
        swallowed,
        wraps: wraps.listed,
        volumes,
        regions: regions::told(all),
        wrapped: wraps.triangles,
    })
}

/// Turns what is inside out; the pieces of surface, if nothing was turned.
fn outward(survey: &Survey<'_>, work: &mut Work<'_>, reversed: &mut Reversed, log: &mut Log) -> Option<Components> {
    let mut pieces = None;
    log.time("outward", "components that were inside out", || {
        let found = orient::pieces(survey, work, reversed);
        let turned = orient::make_outward(survey, work, reversed, &found).0;
        // Of what was turned, the volume is another now.
        pieces = (turned == 0).then_some(found);
        turned
    });
    pieces
}

/// The boundary loops of a workshop, with their kinds. They are what is left when surplus surface is gone and vertices within the weld
/// tolerance are one, which the workshop is brought to.
pub(crate) fn recognise(diagnosis: &mut Diagnosis<'_>, profile: &Profile) -> BoundaryLoops {
    let Diagnosis { survey, shop, tolerance, defects } = diagnosis;
    if defects.boundary_edges == 0 {
        return BoundaryLoops::default();
    }
    let shop = &mut Work::new(shop);
    let mut log = Log::default();
    prepare(survey, shop, tolerance, &mut log);
    weld(survey, shop, tolerance, &mut log);
    report_loops(shop, tolerance, profile)
}

fn report_loops(work: &mut Work<'_>, tolerance: &Tolerance, profile: &Profile) -> BoundaryLoops {
    let (shop, edges) = work.edges();
    holes::report(shop, edges, tolerance, profile.gap_edge_share)
}

/// Drops what is no surface of its own, and fetches what the removal of the rest may need.
fn prepare(survey: &mut Survey<'_>, shop: &mut Work<'_>, tolerance: &Tolerance, log: &mut Log) {
    log.time("degenerate", DEGENERATE, || duplicates::drop_repeated(shop));
    log.time("duplicate", DUPLICATE, || duplicates::drop_duplicates(shop));
    log.time("lap", "triangles of surface that lay on another one, which faces the same way", || {
        lap::cut_back(survey, shop, tolerance)
    });
    complete_at_seams(survey, shop);
}

/// Cleans up, makes vertices within tolerance one, and cleans up after that.
fn weld(survey: &Survey<'_>, shop: &mut Work<'_>, tolerance: &Tolerance, log: &mut Log) -> u64 {
    const NOTE: &str = "boundary vertices within the weld tolerance, moved to the one with most triangles";
    let mut changes = clean(survey, shop, log);
    changes += log.time("tolerance_weld", NOTE, || {
        let welded = merge::weld(shop, tolerance);
        if welded.taken_back > 0 {
            tracing::info!(clusters = welded.taken_back, "Welds taken back, since they made an edge of more than two triangles.");
        }
        welded.vertices
    });
    changes + clean(survey, shop, log)
}

/// Fetches the stars that the removal of surplus surface may need. Duplicates are gone by then: they make non-manifold edges of no
/// interest.
fn complete_at_seams(survey: &mut Survey<'_>, work: &mut Work<'_>) {
    let (shop, edges) = work.edges();
    let wanted = surplus::wanted_stars(survey, shop, edges);
    if !wanted.is_empty() {
        let positions: Vec<[f32; 3]> = wanted.iter().map(|v| shop.positions[*v as usize]).collect();
        let new = survey.promote(&positions);
        work.extend(survey, &new, &wanted);
    }
}

/// Removes what is not surface: repeated vertices, duplicates, triangles of no area, surplus sheets.
fn clean(survey: &Survey<'_>, shop: &mut Work<'_>, log: &mut Log) -> u64 {
    let mut changes = log.time("degenerate", DEGENERATE, || duplicates::drop_repeated(shop) + collinear::remove(shop));
    changes += log.time("duplicate", DUPLICATE, || duplicates::drop_duplicates(shop));
    changes += log
        .time("surplus", "triangles of sheets that hang from a closed surface or cross a body", || surplus::remove(survey, shop));
    changes
}

/// What was done, by name, in order of first use.
#[derive(Default)]
struct Log {
    repairs: Vec<Repair>,
}

impl Log {
    /// Times `work`, which returns how much it did, and adds it up under `name`.
    fn time(&mut self, name: &str, note: &str, work: impl FnOnce() -> u64) -> u64 {
        self.try_time(name, note, || Ok(work())).unwrap_or(0)
    }

    /// As [`Self::time`], of what may fail.
    fn try_time(&mut self, name: &str, note: &str, work: impl FnOnce() -> Result<u64>) -> Result<u64> {
        let span = tracing::debug_span!("repair", name).entered();
        let start = Instant::now();
        let count = work()?;
        drop(span);
        let seconds = start.elapsed().as_secs_f64();
        match self.repairs.iter_mut().find(|r| r.name == name) {
            Some(repair) => {
                repair.count += count;
                repair.seconds += seconds;
            }
            None if count > 0 => self.repairs.push(Repair { name: name.into(), count, note: note.into(), seconds }),
            None => {}
        }
        Ok(count)
    }

    /// Counts less of what was done.
    fn take_back(&mut self, name: &str, count: u64) {
        if let Some(repair) = self.repairs.iter_mut().find(|r| r.name == name) {
            repair.count -= count;
        }
    }

    /// Says something of a repair that has changed nothing.
    fn say(&mut self, name: &str, note: String) {
        tracing::info!(name, note, "A repair changed nothing.");
        self.repairs.push(Repair { name: name.into(), count: 0, note, seconds: 0.0 });
    }

    fn note(&mut self, name: &str, note: String) {
        if let Some(repair) = self.repairs.iter_mut().find(|r| r.name == name) {
            repair.note = note;
        }
    }
}
