//! All repairs in their order.
//!
//! Weld and splits change stars, so components, orientation and loops come after them; the surface is filled before it is decided
//! which way is outward, since the signed volume of an open surface depends on the origin.

use std::time::Instant;

use crate::contract::error::{Error, Result};
use crate::contract::report::RepairName;
use crate::contract::settings::Bodies;
use crate::detect::coned_volume::coned_volume;
use crate::detect::holes;
use crate::detect::skin;
use crate::repairs::boolean::enclosed;
use crate::repairs::boolean::hidden;
use crate::repairs::boolean::resolve;
use crate::repairs::cleanup::copies;
use crate::repairs::cleanup::debris;
use crate::repairs::cleanup::degenerate;
use crate::repairs::cleanup::duplicates;
use crate::repairs::cleanup::sheets;
use crate::repairs::cleanup::surplus;
use crate::repairs::cleanup::surplus::complete_at_seams;
use crate::repairs::holes::fill;
use crate::repairs::holes::sheet_solids;
use crate::repairs::holes::skirt;
use crate::repairs::orient::directions;
use crate::repairs::orient::hollow;
use crate::repairs::orient::shell_copies;
use crate::repairs::orient::visibility;
use crate::repairs::rebuild;
use crate::repairs::separate::pinch_vertices;
use crate::repairs::shared::context::{Context, Handed, Repair};
use crate::repairs::shared::probes::Probes;
use crate::repairs::stitch::overlaps;
use crate::repairs::stitch::sew;
use crate::repairs::stitch::slits;
use crate::repairs::stitch::t_junctions;
use crate::repairs::stitch::weld;
use crate::repairs::stitch::zip;
use crate::repairs::wrap;

/// A step of the work on a file.
pub(crate) enum Step {
    /// Changes the mesh.
    Repair(Repair),
    /// Finds something out, and leaves the surface as it is.
    Look(fn(&mut Context<'_, '_>)),
    /// These steps again and again, so many times at most, until a round changes nothing: each can uncover work for the others. A count, so that
    /// results do not depend on time.
    Rounds(usize, &'static [Step]),
}

use Step::{Look, Repair as Do, Rounds};

/// Once: triangles of no area, copies and surplus sheets go.
const TIDY: Step = Rounds(1, &[Do(degenerate::DEGENERATE), Do(duplicates::DUPLICATE), Do(surplus::REPAIR)]);

/// What lies together becomes one.
const JOIN: Step = Rounds(4, &[TIDY, Do(weld::REPAIR), Do(sew::REPAIR), TIDY, Look(recognise_loops), Do(t_junctions::REPAIR)]);

/// From the file as it came to what is written.
pub(crate) const ALL: &[Step] = &[
    Do(degenerate::REPEATED),
    Do(duplicates::DUPLICATE),
    Do(copies::REPAIR),
    Look(|cx| complete_at_seams(cx.survey, &mut cx.work)),
    TIDY,
    // What was drawn twice with little between is one surface then, and no overlap.
    Do(weld::REPAIR),
    Do(sew::REPAIR),
    Do(overlaps::REPAIR),
    JOIN,
    Do(overlaps::copies::REPAIR),
    Do(zip::REPAIR),
    TIDY,
    Do(slits::REPAIR),
    Do(debris::REPAIR),
    Do(visibility::REPAIR),
    Do(directions::COHERENT),
    Do(sheet_solids::REPAIR),
    Do(shell_copies::REPAIR),
    Look(measure_volume),
    Do(skirt::REPAIR),
    Do(fill::REPAIR),
    Do(sheets::REPAIR),
    Do(shell_copies::OF_CLOSED),
    Do(directions::OUTWARD),
    Do(hollow::REPAIR),
    Look(probe_bodies),
    Do(resolve::REPAIR),
    Look(tell_dust),
    // What was cut off may stand for itself.
    Do(directions::OUTWARD),
    Look(tell_intersections_left),
    Do(enclosed::REPAIR),
    Do(hidden::REPAIR),
    Do(pinch_vertices::REPAIR),
    // What hung on a body by an edge or a vertex stands for itself now.
    Do(directions::OUTWARD),
    Do(rebuild::REPAIR),
    Do(wrap::REPAIR),
    Look(measure_bodies),
    Look(sheets::tell_in_material),
    Look(measure_skin),
];

/// Boundary loops are closed, and nothing else.
pub(crate) const FILL: &[Step] =
    &[Do(degenerate::REPEATED), Look(|cx| complete_at_seams(cx.survey, &mut cx.work)), Do(fill::REPAIR)];

/// Triangles are turned, and nothing else.
pub(crate) const ORIENT: &[Step] = &[
    Look(|cx| complete_at_seams(cx.survey, &mut cx.work)),
    Do(visibility::REPAIR),
    Do(directions::COHERENT),
    Do(directions::OUTWARD),
];

/// Bodies that cross become one, and what lies in the material of others goes.
pub(crate) const UNION: &[Step] = &[
    Look(|cx| complete_at_seams(cx.survey, &mut cx.work)),
    Do(directions::OUTWARD),
    Look(probe_bodies),
    Do(resolve::REPAIR),
    Look(tell_dust),
    Do(directions::OUTWARD),
    Look(tell_intersections_left),
    Do(enclosed::REPAIR),
    Do(hidden::REPAIR),
    Do(pinch_vertices::REPAIR),
    Do(directions::OUTWARD),
    Look(measure_bodies),
];

/// What is no solid is replaced by a wrap.
pub(crate) const WRAP: &[Step] = &[
    Look(|cx| complete_at_seams(cx.survey, &mut cx.work)),
    Look(probe_bodies),
    // Nobody has looked for crossings yet.
    Look(|cx| cx.handed.may_cross = true),
    Do(wrap::REPAIR),
    Look(measure_bodies),
];

/// As far as loops are recognised: surplus surface is gone, and vertices within the weld tolerance are one.
pub(crate) const RECOGNITION: &[Step] = &[
    Do(degenerate::REPEATED),
    Do(duplicates::DUPLICATE),
    Do(copies::REPAIR),
    Look(|cx| complete_at_seams(cx.survey, &mut cx.work)),
    TIDY,
    Do(weld::REPAIR),
    Do(sew::REPAIR),
    TIDY,
    Do(overlaps::REPAIR),
    Do(weld::REPAIR),
    TIDY,
    Look(recognise_loops),
];

/// Takes the steps in their order. Returns how much was done.
///
/// # Errors
/// [`Error::Starved`] when there is not memory enough; [`Error::Io`] with [`std::io::ErrorKind::Interrupted`] when `progress` cancels, before the
/// next repair.
pub(crate) fn take(steps: &[Step], cx: &mut Context<'_, '_>) -> Result<u64> {
    let mut all = 0;
    for step in steps {
        match step {
            Do(repair) => all += carry_out(repair, cx)?,
            Look(look) => look(cx),
            Rounds(most, steps) => {
                for _ in 0..*most {
                    let done = take(steps, cx)?;
                    all += done;
                    if done == 0 {
                        break;
                    }
                }
            }
        }
    }
    Ok(all)
}

/// Takes the steps as the stage `repair`, whose unit are triangles at defects: each step is told as an equal part of them.
///
/// # Errors
/// As [`take`].
pub(crate) fn take_all(steps: &[Step], cx: &mut Context<'_, '_>) -> Result<()> {
    let at_defects = cx.work.triangles.len() as u64;
    for (begun, step) in (0..).zip(steps) {
        cx.progress.at("repair", at_defects * begun / steps.len() as u64, at_defects);
        take(std::slice::from_ref(step), cx)?;
    }
    cx.progress.at("repair", at_defects, at_defects);
    Ok(())
}

fn carry_out(repair: &Repair, cx: &mut Context<'_, '_>) -> Result<u64> {
    let span = tracing::debug_span!("repair", name = repair.name.as_str()).entered();
    let start = Instant::now();
    let go_on = |cx: &Context<'_, '_>| match cx.progress.cancelled() {
        true => Err(Error::cancelled(cx.path, repair.name.as_str())),
        false => Ok(()),
    };
    go_on(cx)?;
    cx.work.is_changed_by(repair.name);
    let done = (repair.run)(cx)?;
    // A repair that saw it has left things undone.
    go_on(cx)?;
    drop(span);
    if done.changed {
        cx.changed(repair.name, repair.changes);
    }
    cx.account.add(repair.name, done.count, done.note, start.elapsed().as_secs_f64());
    Ok(done.count)
}

/// The boundary loops as they are the first time.
fn recognise_loops(cx: &mut Context<'_, '_>) {
    if cx.account.loops.is_none() {
        let (submesh, edges) = cx.work.edges();
        cx.account.loops = Some(holes::report(submesh, edges, cx.tolerance, cx.profile.gap_edge_share));
    }
}

/// The volume that is meant, while all of the surface is there and nothing is guessed.
fn measure_volume(cx: &mut Context<'_, '_>) {
    let pieces = cx.pieces();
    let inverted = directions::inside_out(cx.survey, &cx.work, &cx.reversed, &pieces);
    let (submesh, edges) = cx.work.edges();
    cx.account.enclosed.meant = coned_volume(cx.survey, submesh, edges, &pieces, &inverted.pieces);
    tracing::debug!(volume = ?cx.account.enclosed.meant, "The volume that is meant.");
}

/// Points in the bodies, if anything may lose one: all is closed that can be, and nothing is cut, removed or replaced yet.
fn probe_bodies(cx: &mut Context<'_, '_>) {
    let may_lose = !cx.handed.across.is_empty()
        || cx.before.nested_positive > 0
        || cx.profile.bodies == Bodies::Visible
        || cx.profile.check_self_intersections && cx.survey.crossing_pairs.as_ref().is_none_or(|pairs| !pairs.is_empty())
        || wrap::is_broken(&mut cx.work, cx.survey.threads());
    if may_lose {
        let pieces = cx.pieces();
        cx.handed.probes = Some(Probes::of(cx.survey, &cx.work, &cx.reversed, &pieces));
    }
}

fn tell_dust(cx: &mut Context<'_, '_>) {
    let note = "bodies that cutting left and no printer can see, dropped; listed in `regions`";
    cx.account.add(RepairName::Dust, cx.handed.dust, note.into(), 0.0);
}

fn tell_intersections_left(cx: &mut Context<'_, '_>) {
    for note in std::mem::take(&mut cx.handed.intersections_left) {
        cx.account.say(RepairName::SelfIntersectionsLeft, note);
    }
}

/// Looks for the points in the bodies that there are now.
fn measure_bodies(cx: &mut Context<'_, '_>) {
    if let Some(probes) = cx.handed.probes.take() {
        let pieces = cx.pieces();
        cx.account.volumes = Some(probes.look_for(cx.survey, &cx.work, &cx.reversed, &pieces, &cx.handed.wrapped));
    }
}

/// Holds the surface that there is now against the one that there was.
fn measure_skin(cx: &mut Context<'_, '_>) {
    let reach = cx.profile.skin_reach_relative * cx.survey.bounds.diagonal();
    if reach > 0.0 {
        let pieces = cx.pieces();
        let turned = (&cx.reversed, &cx.handed.dropped_by);
        cx.handed.explained.sort_unstable();
        let Handed { wrapped, explained, cavities, .. } = &cx.handed;
        let known = skin::Known { wrapped, explained, cavities };
        cx.account.skin = Some(skin::measure(cx.survey, &cx.work, turned, &pieces, &known, reach));
    }
}
