//! Closes boundary loops: by a triangulation between their vertices, which is then shaped to continue the surface, where it has
//! room for that, and revoked where it crosses anything.

use crate::repairs::shared::account::RepairName;
use crate::repairs::shared::context::{Changes, Done, Repair};
use crate::repairs::shared::context::{PatchAcross, SheetRim};
use std::collections::{BTreeMap, BTreeSet};

use crate::algorithms::fairing::{Method, ShapeSettings};
use crate::algorithms::triangulate::{self, FillSettings, Rim, Unfillable, strip};
use crate::contract::report::LoopLeft;
use crate::contract::settings::{PatchShape, Profile};
use crate::detect::holes::{
    self, Shapes,
    loops::{self, Boundary, Loop},
};
use crate::geometry::exact::{self, Point};
use crate::geometry::tri_tri;
use crate::repairs::cleanup::degenerate;
use crate::repairs::holes::annular;
use crate::repairs::holes::fair;
use crate::repairs::holes::islands;
use crate::repairs::holes::patches::{Placed, are_joined, of_workshop};
use crate::repairs::shared::admission::{Admission, NotAdmitted};
use crate::repairs::shared::collisions::{self, Obstacle};
use crate::repairs::shared::work::Work;
use crate::submesh::components::{Components, Reversed, Through};
use crate::submesh::near::Tolerance;
use crate::submesh::{Origin, Shop, Vertex};
use crate::topology::survey::Survey;
use crate::util::parallel;
use crate::util::union_find::NONE;

/// Loops. Hands over what no patch closes.
pub(crate) const REPAIR: Repair = Repair {
    name: RepairName::Fill,
    changes: Changes::Surface,
    run: |cx| {
        let closed = fill_loops(cx.survey, &mut cx.work, &cx.reversed, cx.tolerance, cx.profile, cx.limits.threads);
        let parts: Vec<String> = closed.by_method.iter().map(|(name, count)| format!("{count} {name}")).collect();
        cx.account.loops_left = closed.left;
        cx.handed.kept_open = closed.kept_open;
        cx.handed.sheets = closed.sheets;
        cx.handed.across = closed.across;
        Ok(Done::count(closed.loops, format!("loops closed: {}", parts.join(", "))))
    },
};

/// What was closed, by method, and what was not.
#[derive(Debug, Default)]
pub(crate) struct Closed {
    pub(crate) loops: u64,
    pub(crate) by_method: BTreeMap<String, u64>,
    pub(crate) left: Vec<LoopLeft>,
    /// Of what was not closed, the rims of lone sheets.
    pub(crate) sheets: Vec<SheetRim>,
    /// A vertex of each loop that was left open on purpose: it was not admitted.
    pub(crate) kept_open: Vec<[f32; 3]>,
    /// Loops that nothing closes which crosses nothing: the triangles of patches that are to be cut along what they cross, and what to say of the
    /// loops if that does not come about.
    pub(crate) across: Vec<PatchAcross>,
}

/// Takes those patches back that are of surfaces which did not take part when crossings were resolved.
pub(crate) fn open_again(work: &mut Work<'_>, across: Vec<PatchAcross>, taken_part: &[bool]) -> Vec<LoopLeft> {
    let has_taken_part = |t: u32| taken_part.get(t as usize) == Some(&true);
    let back = across.into_iter().filter(|(triangles, _)| !triangles.clone().any(has_taken_part));
    back.map(|(triangles, left)| {
        triangles.for_each(|t| work.kill(t));
        left
    })
    .collect()
}

/// Longest list of open loops in a report.
const LISTED: usize = 1000;

/// A patch that lies flat on the triangles around its loop is put in only below this share of its component's area: it closes a
/// notch, while a flat sheet would become a body of no thickness.
const MAX_FLAT_SHARE: f64 = 0.1;
/// And only for loops of at most so many edges.
const MAX_FLAT_EDGES: usize = 64;

/// A patch that crosses anything is made anew by the next method, or around what it crosses, so many times, and is revoked then: one of
/// many vertices, which takes long, fewer times than a small one.
const GUARD_ROUNDS: (usize, usize) = (2, 4);
/// Vertices of a small one, at most.
const SMALL: usize = 64;

/// No patch is looked for around more triangles than this: what is so much in the way leaves no room.
const MAX_OBSTACLES: usize = 48;

/// Fills every loop that the profile admits. Patches are found in parallel and put in in the loops' order; one that meets an edge
/// that an earlier one has made is found anew, so that the result does not depend on the threads.
pub(crate) fn fill_loops(
    survey: &Survey<'_>,
    work: &mut Work<'_>,
    reversed: &Reversed,
    tolerance: &Tolerance,
    profile: &Profile,
    threads: usize,
) -> Closed {
    let (shop, edges) = work.edges();
    let Boundary { loops: rims, chains } = loops::boundary(shop, edges);
    let shapes = Shapes::of(shop, &rims, threads);
    let admission = Admission::of(survey, work, &rims, &shapes, reversed, tolerance, profile);
    let max_edges = profile.max_hole_edges as usize;
    let mut closing =
        Closing { admission, max_edges, rims: Vec::new(), placed: Vec::new(), open: Vec::new(), joints: Vec::new() };
    let first = closing.close_together(survey, work, rims, shapes, threads);
    closing.triangulate(work, first, threads);
    closing.close_flat(survey, work);
    if let Some(settings) = shape_settings(profile) {
        fair::smooth(survey, work, &mut closing.placed, &settings, threads);
    }
    if profile.check_self_intersections {
        closing.guard(survey, work, reversed);
    }
    let balances = profile.resolve_crossings && profile.fill_holes && survey.crossing_pairs.is_some();
    let mut balancing = closing.close_slits(work, balances);
    let mut across = Vec::new();
    if profile.resolve_crossings && survey.crossing_pairs.is_some() {
        across = closing.close_across(work);
    }
    let mut unclosed = Vec::new();
    let first_balancing = across.len();
    if balances {
        unclosed = closing.balance(work, &mut across);
    }
    balancing += (across.len() - first_balancing) as u64;
    let mut closed = closing.finish(work);
    if balancing > 0 {
        closed.loops += balancing;
        *closed.by_method.entry(BALANCING.into()).or_insert(0) += balancing;
    }
    closed.left.extend(unclosed.into_iter().take(LISTED.saturating_sub(closed.left.len())));
    if !profile.fill_holes {
        closed.kept_open.extend(chains.iter().map(|chain| work.positions[chain[0] as usize]));
    }
    closed.across = across;
    // Where edges were balanced, they are in the loops there.
    let chains = if balances { &[] } else { &chains[..] };
    for chain in chains.iter().take(LISTED.saturating_sub(closed.left.len())) {
        let length = chain.windows(2).map(|w| work.distance(w[0], w[1])).sum();
        closed.left.push(left(work, chain[0], chain.len() - 1, length, &NO_LOOP));
    }
    closed
}

fn left(shop: &Shop, from: Vertex, edges: usize, perimeter: f64, reason: &dyn std::fmt::Display) -> LoopLeft {
    LoopLeft { at: shop.positions[from as usize], edges: edges as u64, perimeter, reason: reason.to_string() }
}

/// Why a chain of boundary edges stays open.
const NO_LOOP: &str = "no loop, but a chain that ends where the triangles around disagree on their directions";
/// And why a loop does along which edges are not used equally often in both directions.
const UNBALANCED: &str = "along its edges, the triangles around disagree on their directions, or three surfaces meet";
/// What is said of those that were closed.
const BALANCING: &str = "where surfaces meet or disagree (to be cut along what they cross)";

fn shape_settings(profile: &Profile) -> Option<ShapeSettings> {
    let method = match profile.patch_shape {
        PatchShape::Flat => return None,
        PatchShape::Fair => Method::Fair,
        PatchShape::Implicit => Method::Implicit,
    };
    Some(ShapeSettings { method, ..ShapeSettings::default() })
}

/// The loops of a workshop while they are closed.
struct Closing<'p> {
    admission: Admission<'p>,
    max_edges: usize,
    rims: Vec<Loop>,
    placed: Vec<Placed>,
    /// Loops, by number, and why they are not closed.
    open: Vec<(u32, NotFilled)>,
    /// Triangles that join the rims of islands to those of their holes, ascending.
    joints: Vec<u32>,
}

impl Closing<'_> {
    /// Closes the rims of missing rings, and holes with islands, each by one patch. Takes in the loops: those from the number that it returns
    /// on are still to be closed.
    fn close_together(
        &mut self,
        survey: &Survey<'_>,
        work: &mut Work<'_>,
        rims: Vec<Loop>,
        shapes: Shapes,
        threads: usize,
    ) -> usize {
        let partners = shapes.partners();
        drop(shapes);
        let admits = |shop: &Shop, rim: &Loop| self.admission.check_joined(shop, rim).is_ok();
        let is_admitted = |shop: &Shop, group: &[&Loop]| {
            self.admission.check(shop, group[0]).is_ok() && group[1..].iter().all(|rim| admits(shop, rim))
        };
        let (mut done, mut placed) = (Vec::new(), Vec::new());
        let mut place = |work: &mut Work<'_>, group: &[&Loop], triangles: &[[Vertex; 3]], method| {
            let numbers = (done.len() as u32..).take(group.len()).collect();
            done.extend(group.iter().map(|rim| (*rim).clone()));
            placed.push(Placed::put_in(work, numbers, triangles, method));
        };
        let groups = islands::groups(survey, work, &rims, &partners.islands, |rim| self.admission.is_sheet(rim));
        let mut taken = vec![false; rims.len()];
        for (numbers, way) in islands::touching(work, &rims) {
            let group: Vec<&Loop> = numbers.iter().map(|i| &rims[*i]).collect();
            if is_admitted(work, &group)
                && let Some(patch) = islands::patch_touching(work, &way)
            {
                place(work, &group, &patch, "islands");
                numbers.iter().for_each(|i| taken[*i] = true);
            }
        }
        let is_free = |taken: &[bool], numbers: &[usize]| numbers.iter().all(|i| !taken[*i]);
        let is_ring = |pair: &[usize; 2]| is_free(&taken, pair) && pair.iter().all(|i| admits(work, &rims[*i]));
        let numbers: Vec<[usize; 2]> = partners.rings.into_iter().filter(is_ring).collect();
        let rings: Vec<[&Loop; 2]> = numbers.iter().map(|pair| pair.map(|i| &rims[i])).collect();
        annular::bridge(work, &rings, threads, |work, i, triangles| {
            place(work, &rings[i], triangles, "annular");
            numbers[i].iter().for_each(|i| taken[*i] = true);
        });
        let mut joined = Vec::new();
        let groups = groups.iter().map(|group| ("islands", group)).chain(partners.bored.iter().map(|group| ("annular", group)));
        for (method, numbers) in groups {
            let group: Vec<&Loop> = numbers.iter().map(|i| &rims[*i]).collect();
            if !is_free(&taken, numbers) || !is_admitted(work, &group) {
                continue;
            }
            numbers.iter().for_each(|i| taken[*i] = true);
            match islands::patch(work, &group) {
                Some(triangles) => place(work, &group, &triangles, method),
                None => {
                    self.joints.extend(islands::join_all(work, &group));
                    joined.extend_from_slice(&group[1..]);
                }
            }
        }
        if !taken.contains(&true) {
            self.rims = rims;
            return 0;
        }
        self.admission.joined(&joined);
        let first = done.len();
        let (shop, edges) = work.edges();
        done.extend(loops::find(shop, edges));
        (self.rims, self.placed) = (done, placed);
        first
    }

    /// Closes the loops from number `first` on, each for itself.
    fn triangulate(&mut self, work: &mut Work<'_>, first: usize, threads: usize) {
        let shop: &Shop = work;
        let patches =
            parallel::map(threads, self.rims.len() - first, |i| self.fill(shop, (first + i) as u32, Neighbours::Heeded, &[]));
        for (rim, patch) in (first as u32..).zip(patches) {
            let patch = match patch {
                Ok(patch) if meets_new_edge(work, self.rim(rim), &patch) => self.fill(work, rim, Neighbours::Heeded, &[]),
                other => other,
            };
            match patch {
                Ok(patch) => self.put_in(work, rim, &patch, patch.method.name()),
                Err(reason) => self.open.push((rim, reason)),
            }
        }
    }

    /// Small loops for which nothing else was found are closed flat on the triangles around.
    fn close_flat(&mut self, survey: &Survey<'_>, work: &mut Work<'_>) {
        if self.open.is_empty() {
            return;
        }
        let (shop, edges) = work.edges();
        let components = Components::of(survey, shop, edges, &Reversed::none(survey), Through::EveryEdge);
        for (rim, reason) in std::mem::take(&mut self.open) {
            let loop_ = self.rim(rim);
            let area = components.list[components.of_triangle[loop_.triangles[0] as usize] as usize].extent.area as f64;
            let flat = match reason {
                NotFilled::Method(Unfillable::Blocked | Unfillable::CrossesItself) if loop_.vertices.len() <= MAX_FLAT_EDGES => {
                    self.fill(work, rim, Neighbours::Ignored, &[])
                        .ok()
                        .filter(|p| twice_area(survey, work, loop_, p) <= area * MAX_FLAT_SHARE)
                }
                _ => None,
            };
            match flat {
                Some(patch) => self.put_in(work, rim, &patch, FLAT),
                None => self.open.push((rim, reason)),
            }
        }
    }

    /// Steps back where a patch crosses anything: from the shape to the triangulation it came from, to another one around what it
    /// crosses, to the first one that crosses only bodies that the loop's own runs into already, to none. (What is closed for itself and runs
    /// into others is a solid still, which an open one is not.)
    fn guard(&mut self, survey: &Survey<'_>, work: &mut Work<'_>, reversed: &Reversed) {
        let mut is_new = vec![true; self.placed.len()];
        for round in 0..=GUARD_ROUNDS.1 {
            let mut patch_of = vec![None; work.triangles.len()];
            for (i, patch) in (0..).zip(&self.placed) {
                patch.triangles().for_each(|t| patch_of[t as usize] = Some(i));
            }
            let Some(crossed) = collisions::crossed(survey, work, reversed, &patch_of, |patch| is_new[patch as usize]) else {
                return;
            };
            is_new.fill(false);
            for (i, mut obstacles) in crossed {
                let i = i as usize;
                if self.placed[i].across {
                    obstacles.retain(|obstacle| !obstacle.met_already);
                }
                if obstacles.is_empty() {
                    continue;
                }
                is_new[i] = true;
                if !self.step_back(work, i, obstacles, round) {
                    self.revoke(work, i, &mut is_new);
                }
            }
            if !is_new.contains(&true) {
                return;
            }
        }
    }

    /// Closes loops on one line by triangles of no area: they go, and the triangles along them are split at the vertices that they lack. Returns
    /// how many of these were no loops, but edges that lack a side, if they are to be balanced.
    fn close_slits(&mut self, work: &mut Work<'_>, balances: bool) -> u64 {
        let is_slit = |reason: &NotFilled| matches!(reason, NotFilled::Method(Unfillable::Collinear));
        let (slits, open): (Vec<_>, Vec<_>) = std::mem::take(&mut self.open).into_iter().partition(|(_, reason)| is_slit(reason));
        self.open = open;
        for (rim, _) in slits {
            let triangles = fan(self.rim(rim).vertices.len());
            self.put_in(work, rim, &triangulate::Patch { triangles, method: triangulate::Method::Triangle }, SLIT);
        }
        let mut balanced = 0;
        if balances {
            for way in self.unbalanced(work) {
                if is_on_one_line(work, &way) {
                    balanced += 1;
                    fan(way.len()).into_iter().for_each(|t| {
                        work.add(t.map(|i| way[i as usize]), Origin::Patch, NONE);
                    });
                }
            }
        }
        degenerate::remove(work);
        balanced
    }

    /// Loops of edges that lack a side, but for those that were left open.
    fn unbalanced(&self, work: &mut Work<'_>) -> Vec<Vec<Vertex>> {
        let open = self.open.iter().map(|(rim, _)| self.rim(*rim));
        let (shop, edges) = work.edges();
        loops::unbalanced(shop, edges, open)
    }

    /// Closes what is left as if nothing were in the way, each by a patch that may cross anything, itself included. Returns the triangles
    /// of each.
    fn close_across(&mut self, work: &mut Work<'_>) -> Vec<PatchAcross> {
        let mut across = Vec::new();
        for (rim, reason) in std::mem::take(&mut self.open) {
            let patch = match reason {
                NotFilled::NotAdmitted(_) => None,
                NotFilled::Crosses | NotFilled::Method(_) => self.patch_across(work, rim),
            };
            let Some(patch) = patch else {
                self.open.push((rim, reason));
                continue;
            };
            let loop_ = self.rim(rim);
            let left = left(work, loop_.vertices[0], loop_.vertices.len(), loop_.perimeter(work), &reason);
            self.put_in(work, rim, &patch, patch.method.name());
            if let Some(placed) = self.placed.last_mut() {
                placed.to_be_cut = true;
                across.push((placed.first..placed.first + placed.count, left));
            }
        }
        across
    }

    /// Closes whatever still lacks triangles on one side, as along an edge that three surfaces share: one that the patch then lies on, or that it
    /// parts from the others, goes when all is cut along what it crosses. Loops that were left open stay open. Returns those that nothing closes.
    fn balance(&self, work: &mut Work<'_>, across: &mut Vec<PatchAcross>) -> Vec<LoopLeft> {
        let mut unclosed = Vec::new();
        for way in self.unbalanced(work) {
            let points: Vec<Point> = way.iter().map(|v| work.positions[*v as usize]).collect();
            let n = way.len();
            let perimeter = (0..n).map(|i| work.distance(way[i], way[(i + 1) % n])).sum();
            let left = left(work, way[0], n, perimeter, &UNBALANCED);
            let rim = Rim { points: &points, apexes: &[], obstacles: &[], forbidden: &|_, _| false };
            let Some(patch) = triangulate::unchecked(&rim) else {
                unclosed.push(left);
                continue;
            };
            let first = work.triangles.len() as u32;
            for triangle in &patch.triangles {
                work.add(triangle.map(|i| way[i as usize]), Origin::Patch, NONE);
            }
            across.push((first..work.triangles.len() as u32, left));
        }
        unclosed
    }

    /// A patch that does not cross itself, if there is one, else any.
    fn patch_across(&self, shop: &Shop, rim: u32) -> Option<triangulate::Patch> {
        let valid = self.fill(shop, rim, Neighbours::Heeded, &[]).or_else(|_| self.fill(shop, rim, Neighbours::Ignored, &[]));
        if let Ok(patch) = valid {
            return Some(patch);
        }
        let loop_ = self.rim(rim);
        let points = loop_.points(shop);
        let joined = |i: u32, j: u32| are_joined(shop, loop_.vertices[i as usize], loop_.vertices[j as usize]);
        let any = |forbidden: &dyn Fn(u32, u32) -> bool| {
            triangulate::unchecked(&Rim { points: &points, apexes: &[], obstacles: &[], forbidden })
        };
        any(&joined).or_else(|| any(&|_, _| false))
    }

    /// Gives a patch up. Loops that it closed together are closed each for itself, where that is admitted.
    fn revoke(&mut self, work: &mut Work<'_>, i: usize, is_new: &mut Vec<bool>) {
        let rims = self.placed[i].rims.clone();
        if let [rim] = rims[..] {
            self.open.push((rim, NotFilled::Crosses));
            return;
        }
        for rim in rims {
            match self.fill(work, rim, Neighbours::Heeded, &[]) {
                Ok(patch) => {
                    self.put_in(work, rim, &patch, patch.method.name());
                    is_new.push(true);
                }
                Err(reason @ NotFilled::NotAdmitted(_)) => self.open.push((rim, reason)),
                Err(_) => self.open.push((rim, NotFilled::Crosses)),
            }
        }
    }

    /// Replaces a patch by the next one that may do, or by none.
    fn step_back(&mut self, work: &mut Work<'_>, i: usize, obstacles: Vec<Obstacle>, round: usize) -> bool {
        let again = round < guard_rounds(&self.placed[i], &self.rims);
        // What is put in in the last round would not be tested any more.
        let coarse = if again { std::mem::take(&mut self.placed[i].coarse) } else { Vec::new() };
        self.placed[i].coarse = Vec::new();
        let patch = &mut self.placed[i];
        if obstacles.iter().all(|obstacle| obstacle.met_already) && patch.spare.is_none() {
            let last = patch.triangles().map(|t| work.triangles[t as usize].v).collect();
            patch.spare = Some((patch.method, last));
        }
        patch.obstacles.extend(obstacles);
        patch.replace(work, &[]);
        let triangles = if !coarse.is_empty() {
            coarse
        } else if let (&[rim], true, true) = (patch.rims.as_slice(), patch.method != FLAT, again) {
            let tries: &[bool] = if self.rim(rim).vertices.len() > SMALL { &[false] } else { &[false, true] };
            let made = tries.iter().find_map(|across| {
                let heeded = self.placed[i].obstacles.iter().filter(|obstacle| !across || !obstacle.met_already);
                let heeded: Vec<tri_tri::Triangle> = heeded.map(|obstacle| obstacle.corners).collect();
                if heeded.len() > MAX_OBSTACLES {
                    return None;
                }
                self.fill(work, rim, Neighbours::Heeded, &heeded).ok().map(|patch| (patch, *across))
            });
            made.map_or_else(Vec::new, |(patch, across)| {
                (self.placed[i].method, self.placed[i].across) = (patch.method.name(), across);
                of_workshop(self.rim(rim), &patch)
            })
        } else {
            Vec::new()
        };
        let triangles = match self.placed[i].spare.take() {
            // It may run into what was put in since, which the next round shows.
            Some((method, spare)) if triangles.is_empty() && round < GUARD_ROUNDS.1 => {
                (self.placed[i].method, self.placed[i].across) = (method, true);
                spare
            }
            spare => {
                self.placed[i].spare = spare;
                triangles
            }
        };
        self.placed[i].replace(work, &triangles);
        !triangles.is_empty()
    }

    fn rim(&self, rim: u32) -> &Loop {
        &self.rims[rim as usize]
    }

    fn put_in(&mut self, work: &mut Work<'_>, rim: u32, patch: &triangulate::Patch, method: &'static str) {
        let triangles = of_workshop(self.rim(rim), patch);
        self.placed.push(Placed::put_in(work, vec![rim], &triangles, method));
    }

    fn finish(mut self, work: &mut Work<'_>) -> Closed {
        let mut closed = Closed::default();
        for patch in self.placed.iter().filter(|p| p.count > 0) {
            let loops = patch.rims.len() as u64;
            closed.loops += loops;
            let shaped = match patch {
                _ if !patch.coarse.is_empty() => " (shaped)",
                _ if patch.across => " (across a body met already)",
                _ if patch.to_be_cut => " (to be cut along what it crosses)",
                _ => "",
            };
            *closed.by_method.entry(format!("{}{shaped}", patch.method)).or_default() += loops;
        }
        self.drop_idle_joints(work);
        self.open.sort_by_key(|(rim, _)| *rim);
        let kept = self.open.iter().filter(|(_, reason)| matches!(reason, NotFilled::NotAdmitted(_)));
        closed.kept_open = kept.map(|(rim, _)| work.positions[self.rim(*rim).vertices[0] as usize]).collect();
        for (i, (rim, reason)) in self.open.iter().enumerate() {
            let rim = self.rim(*rim);
            if matches!(reason, NotFilled::NotAdmitted(NotAdmitted::Sheet)) {
                let listed = (i < LISTED).then_some(i);
                // Of an island's rim and its hole's together, some are joints, which are gone.
                if let Some(triangle) = rim.triangles.iter().copied().find(|t| work.lives(*t)) {
                    closed.sheets.push(SheetRim { triangle, edges: rim.vertices.len(), listed });
                }
            }
            if i >= LISTED {
                continue;
            }
            closed.left.push(left(work, rim.vertices[0], rim.vertices.len(), rim.perimeter(work), reason));
        }
        closed
    }

    /// What joined an island to a rim that stays open leads nowhere, unless a patch was closed along it.
    fn drop_idle_joints(&self, work: &mut Work<'_>) {
        let of_open = self.open.iter().flat_map(|(rim, _)| &self.rim(*rim).triangles).copied();
        let mut idle: BTreeSet<u32> = of_open.filter(|t| self.joints.binary_search(t).is_ok()).collect();
        // The two triangles of a joint stay or go together.
        loop {
            let is_needed = |t: &u32| {
                let v = work.triangles[*t as usize].v;
                (0..3).any(|k| {
                    work.star(v[k]).any(|(other, _)| {
                        let triangle = &work.triangles[other as usize];
                        triangle.v.contains(&v[(k + 1) % 3]) && triangle.origin == Origin::Patch && !idle.contains(&other)
                    })
                })
            };
            let needed: Vec<u32> = idle.iter().copied().filter(is_needed).collect();
            if needed.is_empty() {
                break;
            }
            needed.iter().for_each(|t| {
                idle.remove(t);
            });
        }
        idle.into_iter().for_each(|t| work.kill(t));
    }

    /// A triangulation of a loop that crosses none of the `obstacles`.
    fn fill(
        &self,
        shop: &Shop,
        rim: u32,
        neighbours: Neighbours,
        obstacles: &[tri_tri::Triangle],
    ) -> Result<triangulate::Patch, NotFilled> {
        let rim = self.rim(rim);
        self.admission.check(shop, rim)?;
        let points = rim.points(shop);
        let apexes = if neighbours == Neighbours::Heeded { rim.apexes(shop) } else { Vec::new() };
        let forbidden = |i: u32, j: u32| are_joined(shop, rim.vertices[i as usize], rim.vertices[j as usize]);
        let settings = FillSettings { max_vertices: self.max_edges, ..FillSettings::default() };
        let of_patch = Rim { points: &points, apexes: &apexes, obstacles, forbidden: &forbidden };
        if neighbours == Neighbours::Heeded
            && let Some(patch) = holes::folds(shop, rim).and_then(|folds| strip::zip(&of_patch, folds).ok())
            && !patch.triangles.iter().any(|t| of_patch.meets_obstacle(&of_patch.corners(*t)))
        {
            return Ok(patch);
        }
        Ok(triangulate::triangulate(&of_patch, &settings)?)
    }
}

fn guard_rounds(patch: &Placed, rims: &[Loop]) -> usize {
    let vertices: usize = patch.rims.iter().map(|rim| rims[*rim as usize].vertices.len()).sum();
    if vertices > SMALL { GUARD_ROUNDS.0 } else { GUARD_ROUNDS.1 }
}

fn is_on_one_line(shop: &Shop, way: &[Vertex]) -> bool {
    let [a, b] = [way[0], way[1]].map(|v| shop.positions[v as usize]);
    way[2..].iter().all(|v| exact::collinear(&a, &b, &shop.positions[*v as usize]))
}

/// Triangles around the first vertex of a loop.
fn fan(vertices: usize) -> Vec<[u32; 3]> {
    (2..vertices as u32).map(|n| [0, n - 1, n]).collect()
}

/// Twice the area of a patch, in the survey's units.
fn twice_area(survey: &Survey<'_>, shop: &Shop, rim: &Loop, patch: &triangulate::Patch) -> f64 {
    let corners = |t: &[u32; 3]| t.map(|i| shop.positions[rim.vertices[i as usize] as usize]);
    patch.triangles.iter().map(|t| survey.measure.triangle(&corners(t)).area).sum::<i128>() as f64
}

/// Name of the method that closes a loop on one line.
const SLIT: &str = "slit";

/// Name of the method that closes a small loop on the triangles around it.
const FLAT: &str = "flat on its neighbours";

/// A chord of the patch is an edge of the mesh by now.
fn meets_new_edge(shop: &Shop, rim: &Loop, patch: &triangulate::Patch) -> bool {
    let n = rim.vertices.len() as u32;
    patch.triangles.iter().any(|t| {
        (0..3).any(|k| {
            let (i, j) = (t[k], t[(k + 1) % 3]);
            j != (i + 1) % n && shop.has_edge(rim.vertices[i as usize], rim.vertices[j as usize])
        })
    })
}

/// Why a loop stays open.
#[derive(Debug, thiserror::Error)]
enum NotFilled {
    #[error(transparent)]
    NotAdmitted(#[from] NotAdmitted),
    #[error("every patch tried crosses the surface around")]
    Crosses,
    #[error(transparent)]
    Method(#[from] Unfillable),
}

/// Whether a patch must not lie on the triangles around its loop.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Neighbours {
    Heeded,
    Ignored,
}

/// All of it on a diagnosis, for tests.
#[cfg(test)]
pub(crate) fn fill(d: &mut crate::diagnosis::Diagnosis<'_>, profile: &Profile) -> Closed {
    let unturned = Reversed::none(&d.survey);
    // What nothing closes without crossing something is another pass's then.
    let profile = Profile { resolve_crossings: false, ..profile.clone() };
    fill_loops(&d.survey, &mut Work::new(&mut d.shop), &unturned, &d.tolerance, &profile, 1)
}

#[cfg(test)]
mod tests;
