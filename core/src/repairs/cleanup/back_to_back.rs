//! Triangles back to back: on the same three vertices, in both directions.
//!
//! The two of a pair wind around nothing together, so that taking both away leaves every winding number as it is: that is the rule. A wall of no
//! thickness inside a body goes, and so do the skins of a core and of the pocket that it fills. One of them stays where the surface needs it. Pairs
//! that hang together are decided together:
//!
//! * Beside other surface one of each stays if fewer edges lack a partner with it, and if more triangles stand around that need it
//!   than there are pairs, or nothing surrounds them. (A part of a surface that is there twice; not a core that has lost a triangle.)
//! * On their own, and not surrounded by other surface, one side stays: a body that was exported with both sides.
//! * Two triangles on their own enclose nothing: both go.
//!
//! Some may be turned. So an edge lacks a partner if an odd number of triangles stand at it, whichever way round, and two in one direction that hang
//! together with pairs are one, too: the wall between a core and its pocket is of both kinds then.
//!
//! Where pairs go, so does what is left of such a pair whose other half is lost: a smaller piece of surface at their edges, if fewer edges lack a
//! partner without it.

use crate::detect::bodies;
use crate::detect::bodies::surrounded::are_surrounded;
use crate::submesh::components::{Components, Reversed, Through};
use crate::submesh::edges::{Edge, Edges};
use crate::submesh::{Submesh, Vertex};
use crate::topology::survey::Survey;
use crate::util::ids::NONE;
use crate::util::union_find::{find, unite};

/// Triangles on one set of vertices, in both directions; or two in one direction that hang together with such: one of them is turned. Or the two
/// sides of a wall ([`super::walls`]).
pub(crate) struct Pair {
    pub(crate) forward: Vec<u32>,
    pub(crate) backward: Vec<u32>,
    /// The edges around the forward side of a wall; of triangles on one set of vertices none, since any of them tells.
    pub(crate) rim: Box<[[Vertex; 2]]>,
}

impl Pair {
    fn all(&self) -> impl Iterator<Item = u32> {
        self.forward.iter().chain(&self.backward).copied()
    }

    /// The edges around the forward ones.
    fn around(&self, submesh: &Submesh) -> impl Iterator<Item = [Vertex; 2]> {
        let v = submesh.triangles[self.forward[0] as usize].v;
        let of_triangle = if self.rim.is_empty() { &[0, 1, 2][..] } else { &[] };
        of_triangle.iter().map(move |k| [v[*k], v[(k + 1) % 3]]).chain(self.rim.iter().copied())
    }

    fn is_one_way(&self) -> bool {
        self.backward.is_empty()
    }

    /// Copies in one direction where pairs in both are fewer among what hangs together, or where surface is closed with them, so that none is turned.
    pub(crate) fn set_apart(submesh: &Submesh, edges: &Edges, pairs: &mut Vec<Self>) -> Vec<Self> {
        let [mut parents, mut patches]: [Vec<u32>; 2] = [(); 2].map(|()| (0..pairs.len() as u32).collect());
        let mut is_unbalanced = vec![false; pairs.len()];
        for around in uses(submesh, edges, pairs).chunk_by(|a, b| a.0 == b.0) {
            let one_way = |(_, i, _): &&(u32, u32, bool)| pairs[*i as usize].is_one_way();
            let is_open = edges.get(around[0].0 as usize).is_unbalanced();
            around.iter().for_each(|(_, i, _)| {
                unite(&mut parents, around[0].1, *i);
                is_unbalanced[*i as usize] |= is_open;
            });
            if let Some((_, first, _)) = around.iter().find(one_way) {
                around.iter().filter(one_way).for_each(|(_, i, _)| {
                    unite(&mut patches, *first, *i);
                });
            }
        }
        // A patch of copies that closes with what is around has no turned triangle, and is no part of a wall.
        let mut is_turned = vec![false; pairs.len()];
        for i in (0..pairs.len() as u32).filter(|i| is_unbalanced[*i as usize]) {
            is_turned[find(&mut patches, i) as usize] = true;
        }
        // The more decide: a surface that is there twice, of which some triangles are turned, is no wall.
        let mut both_ways = vec![0i64; pairs.len()];
        for (i, pair) in (0..).zip(pairs.iter()) {
            both_ways[find(&mut parents, i) as usize] += if pair.is_one_way() { -1 } else { 1 };
        }
        let mut number = 0..;
        let is_apart = |pair: &mut Self| {
            let Some(i) = number.next() else { return false };
            pair.is_one_way() && (both_ways[find(&mut parents, i) as usize] < 0 || !is_turned[find(&mut patches, i) as usize])
        };
        pairs.extract_if(.., is_apart).collect()
    }
}

/// Triangles that are to go.
#[derive(Default)]
pub(crate) struct Surplus {
    /// Walls that pieces of surface have in common, whole: each piece is closed with its side of them.
    pub(crate) common: Vec<u32>,
    /// The triangles that are left of such pairs.
    pub(crate) halves: Vec<u32>,
    /// Others.
    pub(crate) sides: Vec<u32>,
    /// Those of the common walls that are in sets of which many face the same way.
    pub(crate) unsure: Vec<u32>,
}

/// Which triangles of the pairs have to go. `gone`: other triangles that go. O(submesh), and rays through the file where a set may be surrounded.
pub(crate) fn surplus(survey: &Survey<'_>, submesh: &Submesh, edges: &Edges, pairs: &[Pair], gone: &[u32]) -> Surplus {
    let mut result = Surplus::default();
    if pairs.is_empty() {
        return result;
    }
    let rest = Rest::of(submesh, pairs, gone);
    let sets = sets(submesh, edges, pairs, &rest);
    let pieces = Pieces::beside(survey, submesh, edges, &sets);
    let is_needed: Vec<bool> = sets.iter().map(|set| pieces.need(set)).collect();
    let asked: Vec<usize> = (0..sets.len()).filter(|s| !is_needed[*s] && sets[*s].depends_on_place()).collect();
    let point = |s: &usize| bodies::inner_point(&submesh.points(pairs[sets[*s].pairs[0].0 as usize].forward[0]));
    let found = are_surrounded(survey, submesh, &asked.iter().map(point).collect::<Vec<_>>(), |t| rest.holds(t));
    let mut is_surrounded = vec![false; sets.len()];
    asked.iter().zip(found).for_each(|(s, is)| is_surrounded[*s] = is);
    for (s, set) in sets.iter().enumerate() {
        let stays = is_needed[s] || set.depends_on_place() && !is_surrounded[s];
        let of_set = set.pairs.iter().map(|(i, votes)| (&pairs[*i as usize], *votes));
        if stays {
            for (pair, votes) in of_set {
                let stays = side_that_stays(pair, votes);
                result.sides.extend(pair.all().filter(|t| !stays.contains(t)));
            }
            continue;
        }
        let is_common = set.gain <= 0 && set.has_neighbours || is_surrounded[s];
        if is_common && set.is_mixed(pairs) {
            result.unsure.extend(set.pairs.iter().flat_map(|(i, _)| pairs[*i as usize].all()));
        }
        let into = if is_common { &mut result.common } else { &mut result.sides };
        of_set.for_each(|(pair, _)| into.extend(pair.all()));
        result.halves.extend(pieces.halves(submesh, edges, set, &rest));
    }
    result.halves.sort_unstable();
    result.halves.dedup();
    result
}

/// The side that fits the neighbours; the first where they do not tell.
fn side_that_stays(pair: &Pair, votes: i64) -> &[u32] {
    let (forward, backward) = (&pair.forward[..], &pair.backward[..]);
    let is_forward = votes > 0 || pair.is_one_way() || votes == 0 && forward.iter().min() < backward.iter().min();
    let side = if is_forward { forward } else { backward };
    if pair.rim.is_empty() { &side[..1] } else { side }
}

/// A set of pairs that hang together.
#[derive(Default)]
struct Set {
    /// Each with how many more of its edges need a forward triangle than a backward one.
    pairs: Vec<(u32, i64)>,
    /// How many edges fewer lack a partner if one of each pair stays.
    gain: i64,
    /// Other triangles stand at its edges.
    has_neighbours: bool,
    /// Other triangles at those of its edges that lack a partner without it.
    needy: Vec<u32>,
}

impl Set {
    /// Whether it goes depends on what is around.
    fn depends_on_place(&self) -> bool {
        if self.has_neighbours { self.gain > 0 } else { self.pairs.len() > 1 }
    }

    /// Do a quarter or more of its pairs face one way?
    fn is_mixed(&self, pairs: &[Pair]) -> bool {
        4 * self.pairs.iter().filter(|(i, _)| pairs[*i as usize].is_one_way()).count() >= self.pairs.len()
    }
}

/// The triangles that are in no pair and stay.
struct Rest(Vec<bool>);

impl Rest {
    fn of(submesh: &Submesh, pairs: &[Pair], gone: &[u32]) -> Self {
        let mut is_rest = vec![true; submesh.triangles.len()];
        pairs.iter().flat_map(Pair::all).chain(gone.iter().copied()).for_each(|t| is_rest[t as usize] = false);
        Self(is_rest)
    }

    fn holds(&self, t: u32) -> bool {
        self.0[t as usize]
    }

    /// Those at an edge.
    fn at<'e>(&'e self, edge: &Edge<'e>) -> impl Iterator<Item = (u32, i64)> + 'e {
        let uses = edge.uses.iter().filter(|u| self.0[u.triangle() as usize]);
        uses.map(|u| (u.triangle(), if u.forward() { 1 } else { -1 }))
    }

    /// One at an edge lacks a partner, whichever way round they are.
    fn is_odd(&self, edge: &Edge<'_>) -> bool {
        self.at(edge).count() % 2 == 1
    }

    /// How many more of them use an edge forward than backward.
    fn balance(&self, edge: &Edge<'_>) -> i64 {
        self.at(edge).map(|(_, way)| way).sum()
    }
}

/// By edge, the pairs that use it, and whether forward is along it.
fn uses(submesh: &Submesh, edges: &Edges, pairs: &[Pair]) -> Vec<(u32, u32, bool)> {
    let mut uses: Vec<(u32, u32, bool)> = Vec::with_capacity(3 * pairs.len());
    for (i, pair) in (0..).zip(pairs) {
        uses.extend(pair.around(submesh).filter_map(|[a, b]| edges.number(a, b).map(|edge| (edge, i, a < b))));
    }
    uses.sort_unstable();
    uses
}

/// The pairs that hang together through edges, set by set.
fn sets(submesh: &Submesh, edges: &Edges, pairs: &[Pair], rest: &Rest) -> Vec<Set> {
    let uses = uses(submesh, edges, pairs);
    let mut parents: Vec<u32> = (0..pairs.len() as u32).collect();
    for around in uses.chunk_by(|a, b| a.0 == b.0) {
        around.iter().for_each(|(_, i, _)| {
            unite(&mut parents, around[0].1, *i);
        });
    }
    let mut sets: Vec<Set> = pairs.iter().map(|_| Set::default()).collect();
    let mut votes = vec![0i64; pairs.len()];
    for around in uses.chunk_by(|a, b| a.0 == b.0) {
        let set = &mut sets[find(&mut parents, around[0].1) as usize];
        let edge = edges.get(around[0].0 as usize);
        let balance = rest.balance(&edge);
        set.has_neighbours |= rest.at(&edge).next().is_some();
        // Whichever way round they are: one may be turned.
        let (lacking, sides) = (rest.is_odd(&edge), around.len() % 2 == 1);
        if lacking {
            set.needy.extend(rest.at(&edge).map(|(t, _)| t));
        }
        set.gain += i64::from(lacking) - i64::from(lacking != sides);
        around.iter().for_each(|(_, i, along)| votes[*i as usize] += if *along { -balance } else { balance });
    }
    (0..).zip(votes).for_each(|(i, votes)| sets[find(&mut parents, i) as usize].pairs.push((i, votes)));
    sets.retain(|set| !set.pairs.is_empty());
    sets
}

/// Pieces of surface beside pairs, at edges that lack a partner. A piece reaches through edges of two triangles.
struct Pieces {
    all: Option<Components>,
    /// Triangles in the submesh with the piece that each belongs to, by piece.
    triangles: Vec<(u32, u32)>,
}

impl Pieces {
    fn beside(survey: &Survey<'_>, submesh: &Submesh, edges: &Edges, sets: &[Set]) -> Self {
        if sets.iter().all(|set| set.needy.is_empty()) {
            return Self { all: None, triangles: Vec::new() };
        }
        let all = Components::of(survey, submesh, edges, &Reversed::none(survey), Through::ManifoldEdges);
        let mut is_beside = vec![false; all.list.len()];
        sets.iter().flat_map(|set| at(&all, set)).for_each(|piece| is_beside[piece as usize] = true);
        let of = |t: u32| all.of_triangle[t as usize];
        let beside = submesh.living().filter(|t| of(*t) != NONE && is_beside[of(*t) as usize]);
        let mut triangles: Vec<(u32, u32)> = beside.map(|t| (of(t), t)).collect();
        triangles.sort_unstable();
        Self { all: Some(all), triangles }
    }

    /// Does surface of no fewer triangles need the set?
    fn need(&self, set: &Set) -> bool {
        let around = self.all.iter().flat_map(|all| at(all, set).into_iter().map(|piece| all.list[piece as usize].triangles));
        set.gain > 0 && around.sum::<u64>() >= set.pairs.len() as u64
    }

    /// The triangles of pieces smaller than the set, without which fewer edges lack a partner once the set is gone.
    fn halves(&self, submesh: &Submesh, edges: &Edges, set: &Set, rest: &Rest) -> Vec<u32> {
        let Some(all) = &self.all else { return Vec::new() };
        let mut halves = Vec::new();
        for piece in at(all, set) {
            let first = self.triangles.partition_point(|(of, _)| *of < piece);
            let own: Vec<u32> = self.triangles[first..].iter().take_while(|(of, _)| *of == piece).map(|(_, t)| *t).collect();
            let is_whole = own.len() as u64 == all.list[piece as usize].triangles;
            if is_whole && own.len() < set.pairs.len() && worse_without(submesh, edges, rest, &own) < 0 {
                halves.extend(own);
            }
        }
        halves
    }
}

/// The pieces at the edges of a set that lack a partner, ascending.
fn at(pieces: &Components, set: &Set) -> Vec<u32> {
    let mut at: Vec<u32> = set.needy.iter().map(|t| pieces.of_triangle[*t as usize]).filter(|piece| *piece != NONE).collect();
    at.sort_unstable();
    at.dedup();
    at
}

/// How many edges more lack a partner without these triangles.
fn worse_without(submesh: &Submesh, edges: &Edges, rest: &Rest, triangles: &[u32]) -> i64 {
    let mut own: Vec<(u32, i64)> = Vec::with_capacity(3 * triangles.len());
    for t in triangles {
        let v = submesh.triangles[*t as usize].v;
        for k in 0..3 {
            let (a, b) = (v[k], v[(k + 1) % 3]);
            own.extend(edges.number(a, b).map(|edge| (edge, if a < b { 1 } else { -1 })));
        }
    }
    own.sort_unstable();
    let of_edge = |around: &[(u32, i64)]| {
        let now = rest.balance(&edges.get(around[0].0 as usize));
        (now - around.iter().map(|(_, way)| way).sum::<i64>()).abs() - now.abs()
    };
    own.chunk_by(|a, b| a.0 == b.0).map(of_edge).sum()
}

#[cfg(test)]
mod tests {
    use crate::contract::settings::Bodies;
    use crate::repairs::cleanup::duplicates::{Dropped, drop_duplicates};
    use crate::repairs::shared::work::Work;
    use crate::testing::{After, Corners, after, cube, cuboid, reversed, shifted};
    use crate::util::scatter;

    fn dropped(triangles: &[Corners], bodies: Bodies) -> After<Dropped> {
        after(triangles, |d, _| drop_duplicates(&d.survey, &mut Work::new(&mut d.submesh), bodies))
    }

    /// A block with a pocket, and the core that fills it.
    fn block_and_core() -> [Vec<Corners>; 3] {
        let core = shifted(&cube(), [1.0; 3]);
        [cuboid([0.0; 3], [3.0; 3]), reversed(&core), core]
    }

    #[test]
    fn a_core_that_fills_its_pocket_is_one_with_its_host() {
        let got = dropped(&block_and_core().concat(), Bodies::Union);
        assert_eq!(got.result, Dropped { all: 24, walls: 24, unsure: 0 });
        assert!(got.verdict.good && (got.defects.volume - 27.0).abs() < 1e-9, "{:?}", got.defects);
    }

    #[test]
    fn a_core_that_is_kept_keeps_its_skin() {
        assert_eq!(dropped(&block_and_core().concat(), Bodies::Keep).result, Dropped::default());
    }

    /// However many are turned, pairs and copies in one direction go together.
    #[test]
    fn a_core_with_many_turned_triangles_leaves_no_cavity() {
        // As long as most of the wall still faces the other side of itself: else it is a surface drawn twice.
        for turned in 1..=6usize {
            let mut mesh = block_and_core().concat();
            // A step that meets all of them once.
            (0..turned).for_each(|i| mesh[12 + i * 7 % 24].swap(0, 1));
            let got = dropped(&mesh, Bodies::Union);
            let (all, triangles) = (got.result, got.defects.triangles);
            // A quarter or more: it may have been the wall of a cavity.
            let unsure = if turned < 3 { 0 } else { 24 };
            assert_eq!((all, triangles), (Dropped { all: 24, walls: 24, unsure }, 12), "turned: {turned}");
        }
    }

    /// Many specks of such walls, together a speck, asked for a person at files of millions of triangles.
    #[test]
    fn walls_that_are_a_speck_of_the_surface_are_not_told_of() {
        for (side, unsure) in [(8.0, 24), (200.0, 0)] {
            let mut mesh = block_and_core().concat();
            (0..6).for_each(|i| mesh[12 + i * 7 % 24].swap(0, 1));
            mesh.extend(cuboid([300.0; 3], [300.0 + side; 3]));
            assert_eq!(dropped(&mesh, Bodies::Union).result, Dropped { all: 24, walls: 24, unsure }, "side: {side}");
        }
    }

    /// A block with a pocket that is open above, and the inlay that fills it, each with the same wall.
    #[test]
    fn an_inlay_beside_turned_triangles_leaves_no_pocket() {
        let is_top = |t: &&Corners| t.iter().all(|p| p[2] == 1.0);
        let block = cuboid([0.0; 3], [1.0; 3]);
        let frame: Vec<Corners> = cuboid([-1.0, -1.0, -1.0], [2.0, 2.0, 1.0]).iter().filter(|t| !is_top(t)).copied().collect();
        let ring = [[-1.0, -1.0], [2.0, -1.0], [2.0, 2.0], [-1.0, 2.0], [0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        let at = |i: usize| [ring[i][0], ring[i][1], 1.0f32];
        let top = (0..4).flat_map(|k| {
            let (a, b, c, d) = (at(k), at((k + 1) % 4), at(4 + (k + 1) % 4), at(4 + k));
            [[a, b, c], [a, c, d]]
        });
        let pocket: Vec<Corners> = reversed(&block).iter().filter(|t| !is_top(t)).copied().collect();
        let all = [frame, top.collect(), pocket, block.clone()].concat();
        for turned in 0..all.len() {
            let mut mesh = all.clone();
            mesh[turned].swap(0, 1);
            let got = dropped(&mesh, Bodies::Union);
            assert_eq!((got.result, got.defects.triangles), (Dropped { all: 20, walls: 20, unsure: 0 }, 20), "turned: {turned}");
        }
    }

    /// Whichever of either is lost, its other half goes, too.
    #[test]
    fn a_core_that_lost_a_triangle_leaves_no_cavity() {
        for lost in 12..36 {
            let mut mesh = block_and_core().concat();
            mesh.remove(lost);
            let got = dropped(&mesh, Bodies::Union);
            assert_eq!((got.result.all, got.defects.triangles), (23, 12), "without {lost}");
        }
    }

    /// A triangle of either turned makes a copy of one of the other.
    #[test]
    fn a_core_with_a_turned_triangle_leaves_no_cavity() {
        for turned in 12..36 {
            let mut mesh = block_and_core().concat();
            mesh[turned].swap(0, 1);
            let got = dropped(&mesh, Bodies::Union);
            assert_eq!((got.result.all, got.defects.triangles), (24, 12), "turned: {turned}");
        }
    }

    /// It is nobody's core: what was exported with both sides is a body, even where one side lacks something.
    #[test]
    fn a_body_with_both_sides_stays_if_one_side_lacks_a_triangle() {
        let mut both = [cube(), reversed(&cube())].concat();
        both.remove(15);
        let got = dropped(&both, Bodies::Union);
        assert_eq!((got.result, got.defects.triangles), (Dropped { all: 11, walls: 0, unsure: 0 }, 12));
    }

    /// Rays from one of them pass through others, whose triangles face any way.
    #[test]
    fn bodies_drawn_twice_with_directions_at_random_all_stay() {
        for seed in 0..32u64 {
            let bodies: Vec<Corners> = (0..5u8).flat_map(|i| shifted(&cube(), [3.0 * f32::from(i), 0.0, 0.0])).collect();
            let mut mesh = [&bodies[..], &bodies[..]].concat();
            let is_turned = |i: usize| scatter::share(1000 * seed + i as u64) < 0.5;
            (0..mesh.len()).filter(|i| is_turned(*i)).for_each(|i| mesh[i].swap(0, 1));
            let got = dropped(&mesh, Bodies::Union);
            assert_eq!((got.result.walls, got.defects.triangles, got.defects.boundary_edges), (0, 60, 0), "seed {seed}");
        }
    }

    #[test]
    fn a_part_of_a_surface_that_is_there_twice_stays_once() {
        for count in 1..7 {
            let doubled = [cube(), reversed(&cube()[..count])].concat();
            let got = dropped(&doubled, Bodies::Union);
            assert_eq!((got.result.all, got.defects.triangles, got.defects.boundary_edges), (count as u64, 12, 0), "{count}");
        }
    }
}
