//! One report of several meshes: the objects of a package.
//!
//! Counts, areas and volumes are sums. What is a word or a place is listed for all, with the object's name where it needs one. An outcome, a rule
//! or a figure that has a limit is the worst of all.

use crate::contract::report::{
    BoundaryLoops, Certificate, Defects, EditSummary, Faithful, Features, MOST_LISTED, ObjectReport, Outcome, Regions, Repair,
    Report, Residue, RuleOutcome, SelfIntersections, Simplified, Skin, SkinChange, Smoothed, ThinWalls, Verdict, Volumes,
};

/// A part of a package, as errors and reports name it.
pub(crate) struct Section {
    pub(crate) id: u32,
    pub(crate) name: String,
    /// The name of the part that holds it.
    pub(crate) part: String,
    pub(crate) report: Report,
}

impl Section {
    /// Its name for people.
    pub(crate) fn label(&self) -> String {
        if self.name.is_empty() { format!("object {}", self.id) } else { format!("object {} ({})", self.id, self.name) }
    }

    fn listed(&self) -> ObjectReport {
        let report = &self.report;
        ObjectReport {
            id: self.id,
            name: self.name.clone(),
            part: self.part.clone(),
            outcome: report.outcome,
            triangles: report.input.triangles,
            before: report.before.clone(),
            after: report.after.clone(),
            repairs: report.repairs.clone(),
            edit: report.edit.clone(),
            verdict: report.verdict.clone(),
            certificate: report.certificate.clone(),
        }
    }
}

/// The report of all sections; `None` without one. Facts of files, cost and stages are still to come.
pub(crate) fn together(sections: &[Section]) -> Option<Report> {
    let (first, others) = sections.split_first()?;
    let mut all = first.report.clone();
    if !others.is_empty() {
        all.edit_records = None;
        name_reasons(&mut all.verdict, &first.label());
    }
    for section in others {
        join(&mut all, section);
    }
    all.objects = sections.iter().take(MOST_LISTED).map(Section::listed).collect();
    Some(all)
}

/// Gives the certificate the bytes that it is of.
pub(crate) fn certify(report: &mut Report) {
    let facts = report.output.as_ref().unwrap_or(&report.input);
    if let Some(certificate) = &mut report.certificate {
        (certificate.blake3, certificate.bytes, certificate.triangles) = (facts.blake3.clone(), facts.bytes, facts.triangles);
        if let Some(faithful) = &mut certificate.faithful {
            (faithful.original, faithful.bytes) = (report.input.blake3.clone(), report.input.bytes);
        }
    }
}

fn name_reasons(verdict: &mut Verdict, label: &str) {
    verdict.reasons.iter_mut().for_each(|reason| *reason = format!("{label}: {reason}"));
}

fn join(all: &mut Report, section: &Section) {
    let report = &section.report;
    // What was not written anew is as it was.
    if all.after.is_some() || report.after.is_some() {
        let mut after = all.after.take().unwrap_or_else(|| all.before.clone());
        defects(&mut after, report.after.as_ref().unwrap_or(&report.before));
        all.after = Some(after);
    }
    defects(&mut all.before, &report.before);
    all.outcome = worse(all.outcome, report.outcome);
    if report.tolerances.diagonal > all.tolerances.diagonal {
        all.tolerances = report.tolerances.clone();
    }
    loops(&mut all.loops, &report.loops);
    report.repairs.iter().for_each(|other| repair(&mut all.repairs, other));
    append(&mut all.loops_left, &report.loops_left);
    append(&mut all.sheets_dropped, &report.sheets_dropped);
    append(&mut all.wraps, &report.wraps);
    all.volume_meant = all.volume_meant.zip(report.volume_meant).map(|(a, b)| a + b);
    merge(&mut all.volumes, &report.volumes, volumes);
    merge(&mut all.skin, &report.skin, skin);
    regions(&mut all.regions, &report.regions);
    edit(&mut all.edit, &report.edit);
    let mut other = report.verdict.clone();
    name_reasons(&mut other, &section.label());
    verdict(&mut all.verdict, other);
    merge(&mut all.certificate, &report.certificate, certificate);
    for hint in &report.hints {
        if !all.hints.iter().any(|there| there.text == hint.text) && all.hints.len() < MOST_LISTED {
            all.hints.push(hint.clone());
        }
    }
    merge(&mut all.thin_walls, &report.thin_walls, thin_walls);
    merge(&mut all.features, &report.features, features);
    merge(&mut all.residue, &report.residue, residue);
    merge(&mut all.smoothed, &report.smoothed, smoothed);
    merge(&mut all.simplified, &report.simplified, simplified);
    for stage in &report.stages {
        match all.stages.iter_mut().find(|there| there.name == stage.name) {
            Some(there) => there.seconds += stage.seconds,
            None => all.stages.push(stage.clone()),
        }
    }
}

/// Both, or whichever there is.
fn merge<T: Clone>(all: &mut Option<T>, other: &Option<T>, join: impl FnOnce(&mut T, &T)) {
    match (all.as_mut(), other) {
        (Some(all), Some(other)) => join(all, other),
        (None, Some(other)) => *all = Some(other.clone()),
        (_, None) => {}
    }
}

/// The first one that is there.
fn keep_first<T: Clone>(all: &mut Option<T>, other: &Option<T>) {
    merge(all, other, |_, _| ());
}

fn append<T: Clone>(all: &mut Vec<T>, other: &[T]) {
    let room = MOST_LISTED.saturating_sub(all.len());
    all.extend(other.iter().take(room).cloned());
}

fn worse(a: Outcome, b: Outcome) -> Outcome {
    let rank = |outcome| match outcome {
        Outcome::Clean => 0,
        Outcome::Repaired => 1,
        Outcome::NeedsReview => 2,
        Outcome::NotGood => 3,
    };
    if rank(b) > rank(a) { b } else { a }
}

/// The box around both.
fn around(a: Option<[[f32; 3]; 2]>, b: Option<[[f32; 3]; 2]>) -> Option<[[f32; 3]; 2]> {
    match (a, b) {
        (Some([lo, hi]), Some([low, high])) => {
            Some([[0, 1, 2].map(|k| lo[k].min(low[k])), [0, 1, 2].map(|k| hi[k].max(high[k]))])
        }
        (a, b) => a.or(b),
    }
}

fn defects(all: &mut Defects, other: &Defects) {
    macro_rules! sums {
        ($($field:ident),*) => { $(all.$field += other.$field;)* };
    }
    sums!(
        triangles,
        nonfinite,
        vertices,
        vertices_used,
        edges,
        degenerate_index,
        degenerate_area,
        duplicates_same,
        duplicates_opposite,
        boundary_edges,
        boundary_loops,
        nonmanifold_edges,
        nonmanifold_vertices,
        inconsistent_edges,
        unbalanced_edges,
        components,
        inverted_components,
        bodies,
        cavities,
        nested_positive,
        noncommon_vertices,
        weldable_vertices,
        area,
        volume
    );
    // Where one was not looked at, nobody knows of all.
    all.self_intersections =
        all.self_intersections.take().zip(other.self_intersections.as_ref()).map(|(all, other)| SelfIntersections {
            triangles: all.triangles + other.triangles,
            crossing_pairs: all.crossing_pairs + other.crossing_pairs,
            overlapping_pairs: all.overlapping_pairs + other.overlapping_pairs,
            // Numbers are those of one mesh.
            listed: Vec::new(),
            given_up: all.given_up || other.given_up,
        });
    all.bounds = around(all.bounds, other.bounds);
    all.euler = all.euler.zip(other.euler).map(|(a, b)| a + b);
    all.at_least.extend(other.at_least.iter().cloned());
    all.at_least.sort_unstable();
    all.at_least.dedup();
}

fn loops(all: &mut BoundaryLoops, other: &BoundaryLoops) {
    for (class, count) in &other.classes {
        *all.classes.entry(*class).or_default() += count;
    }
    let before = all.listed.len() as u32;
    let room = MOST_LISTED.saturating_sub(all.listed.len());
    all.listed.extend(other.listed.iter().take(room).cloned().map(|mut listed| {
        listed.partner = listed.partner.map(|partner| partner + before);
        listed
    }));
}

fn repair(all: &mut Vec<Repair>, other: &Repair) {
    match all.iter_mut().find(|there| there.name == other.name) {
        Some(there) => {
            there.count += other.count;
            there.seconds += other.seconds;
        }
        None => all.push(other.clone()),
    }
}

fn volumes(all: &mut Volumes, other: &Volumes) {
    all.bodies += other.bodies;
    all.points += other.points;
    all.volume += other.volume;
    all.outside += other.outside;
    all.lost += other.lost;
    all.filled += other.filled;
    append(&mut all.listed, &other.listed);
    append(&mut all.filled_listed, &other.filled_listed);
}

fn skin(all: &mut Skin, other: &Skin) {
    all.reach = all.reach.max(other.reach);
    skin_change(&mut all.lost, &other.lost);
    skin_change(&mut all.invented, &other.invented);
}

fn skin_change(all: &mut SkinChange, other: &SkinChange) {
    all.area += other.area;
    all.share = all.share.max(other.share);
    all.farthest = all.farthest.max(other.farthest);
    for cause in &other.causes {
        match all.causes.iter_mut().find(|there| there.repair == cause.repair) {
            Some(there) => there.area += cause.area,
            None => all.causes.push(cause.clone()),
        }
    }
    append(&mut all.places, &other.places);
}

fn regions(all: &mut Regions, other: &Regions) {
    all.total += other.total;
    append(&mut all.listed, &other.listed);
}

fn edit(all: &mut EditSummary, other: &EditSummary) {
    all.untouched += other.untouched;
    all.deleted += other.deleted;
    all.flipped += other.flipped;
    all.moved += other.moved;
    all.added += other.added;
    all.max_move = all.max_move.max(other.max_move);
}

fn verdict(all: &mut Verdict, other: Verdict) {
    // The statement of the first that is not good, or of the first.
    if all.good && !other.good {
        all.statement = other.statement;
    }
    all.good &= other.good;
    all.closed &= other.closed;
    all.manifold &= other.manifold;
    all.oriented &= other.oriented;
    all.free_of_self_intersection = match (all.free_of_self_intersection, other.free_of_self_intersection) {
        (Some(a), Some(b)) => Some(a && b),
        _ => None,
    };
    append(&mut all.reasons, &other.reasons);
    all.unchecked.extend(other.unchecked);
    all.unchecked.sort_unstable();
    all.unchecked.dedup();
}

/// The worse of two outcomes of a rule.
fn worse_rule(a: RuleOutcome, b: RuleOutcome) -> RuleOutcome {
    match (a, b) {
        (RuleOutcome::Failed, _) | (_, RuleOutcome::Failed) => RuleOutcome::Failed,
        (RuleOutcome::Unchecked, _) | (_, RuleOutcome::Unchecked) => RuleOutcome::Unchecked,
        _ => RuleOutcome::Passed,
    }
}

fn certificate(all: &mut Certificate, other: &Certificate) {
    all.printable &= other.printable;
    all.triangles += other.triangles;
    all.missing.extend(other.missing.iter().cloned());
    all.missing.sort_unstable();
    all.missing.dedup();
    for (rule, found) in all.rules.iter_mut().zip(&other.rules) {
        rule.outcome = worse_rule(rule.outcome, found.outcome);
        rule.count = rule.count.zip(found.count).map(|(a, b)| a + b);
    }
    merge(&mut all.faithful, &other.faithful, faithful);
}

fn faithful(all: &mut Faithful, other: &Faithful) {
    all.failed.extend(other.failed.iter().cloned());
    all.failed.sort_unstable();
    all.failed.dedup();
    for (rule, found) in all.rules.iter_mut().zip(&other.rules) {
        rule.outcome = worse_rule(rule.outcome, found.outcome);
        rule.figure = match (rule.figure, found.figure) {
            (Some(a), Some(b)) => Some(a.max(b)),
            (a, b) => a.or(b),
        };
    }
}

fn features(all: &mut Features, other: &Features) {
    all.removed += other.removed;
    all.left += other.left;
    all.triangles_gone += other.triangles_gone;
    all.triangles_added += other.triangles_added;
    keep_first(&mut all.why_not, &other.why_not);
    append(&mut all.listed, &other.listed);
}

fn residue(all: &mut Residue, other: &Residue) {
    all.moved += other.moved;
    all.displacement = all.displacement.max(other.displacement);
    all.deviation = all.deviation.max(other.deviation);
    all.volume_change += other.volume_change;
    all.triangles_before += other.triangles_before;
    all.triangles_after += other.triangles_after;
    merge(&mut all.path_fit, &other.path_fit, |all, other| *all = all.min(*other));
    keep_first(&mut all.path_axes, &other.path_axes);
    let new = other.findings.iter().filter(|finding| !all.findings.contains(finding)).cloned().collect::<Vec<_>>();
    append(&mut all.findings, &new);
    keep_first(&mut all.why_not, &other.why_not);
    append(&mut all.regions, &other.regions);
    merge(&mut all.suspects, &other.suspects, |all, other| append(all, other));
}

fn smoothed(all: &mut Smoothed, other: &Smoothed) {
    all.passes = all.passes.max(other.passes);
    all.moved += other.moved;
    all.held += other.held;
    all.displacement = all.displacement.max(other.displacement);
    all.volume_change += other.volume_change;
    keep_first(&mut all.why_not, &other.why_not);
}

fn simplified(all: &mut Simplified, other: &Simplified) {
    all.before += other.before;
    all.after += other.after;
    all.to_result = all.to_result.max(other.to_result);
    all.from_result = all.from_result.max(other.from_result);
    all.volume_change += other.volume_change;
    keep_first(&mut all.why_not, &other.why_not);
}

fn thin_walls(all: &mut ThinWalls, other: &ThinWalls) {
    let points = all.points + other.points;
    let thin = all.share * all.points as f64 + other.share * other.points as f64;
    all.share = if points > 0 { thin / points as f64 } else { 0.0 };
    all.points = points;
    append(&mut all.places, &other.places);
}
