//! Tiny meshes whose contacts follow from the definition, and comparison with all pairs tested one by one.

use std::collections::BTreeMap;

use proptest::prelude::*;

use super::{CellView, Effort, Finder, Standing};
use crate::geometry::axis::Axis;
use crate::geometry::collinear::is_collinear;
use crate::geometry::position::Position;
use crate::geometry::sums::Bounds;
use crate::geometry::tri_tri::{Contact, Triangle, triangles_cross};
use crate::io::record;
use crate::stream::plan::{ChunkId, HomeBox, Plan};
use crate::util::ids::NONE;

type Point = [f32; 3];
type Pairs = Vec<(u32, u32, Contact)>;

/// A welded mesh.
struct Mesh {
    positions: Vec<Point>,
    triangles: Vec<[u32; 3]>,
    collinear: Vec<bool>,
    regular: Vec<bool>,
}

impl Mesh {
    fn new(soup: &[Triangle]) -> Self {
        let mut positions: Vec<Point> = Vec::new();
        let mut numbers = BTreeMap::new();
        let mut vertex = |p: Point| {
            let p = Position::of(p);
            *numbers.entry(p).or_insert_with(|| {
                positions.push(p.coordinates());
                positions.len() as u32 - 1
            })
        };
        let triangles: Vec<[u32; 3]> = soup
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(&mut vertex);
                if a == b || b == c || c == a { [NONE, a, b] } else { [a, b, c] }
            })
            .collect();
        let collinear = soup.iter().map(|[a, b, c]| is_collinear(a, b, c)).collect();
        let mut mesh = Self { positions, triangles, collinear, regular: Vec::new() };
        mesh.regular = (0..mesh.positions.len() as u32).map(|v| mesh.is_regular(v)).collect();
        mesh
    }

    /// One closed, coherent fan without collinear triangles: going from triangle to triangle meets each once and comes back.
    fn is_regular(&self, v: u32) -> bool {
        let mut after = BTreeMap::new();
        let around = || (0..self.triangles.len()).filter(|t| self.triangles[*t][0] != NONE && self.triangles[*t].contains(&v));
        for t in around() {
            let k = self.triangles[t].iter().position(|u| *u == v).unwrap();
            let [next, previous] = [1, 2].map(|s| self.triangles[t][(k + s) % 3]);
            if self.collinear[t] || after.insert(next, previous).is_some() {
                return false;
            }
        }
        let Some(start) = after.keys().next().copied() else { return false };
        let (mut at, mut steps) = (start, 0);
        // It may run into a ring that does not hold the start.
        while let Some(next) = after.get(&at).filter(|_| steps < after.len()) {
            (at, steps) = (*next, steps + 1);
            if at == start {
                break;
            }
        }
        at == start && steps == around().count() && steps >= 3
    }

    /// What the cell sees, asked for its pairs; in numbers of the mesh.
    fn pairs_of(&self, finder: &mut Finder, cell: HomeBox, effort: Effort) -> (Pairs, u64) {
        let home: Vec<bool> = self.positions.iter().map(|p| cell.holds(*p)).collect();
        let is_member = |t: &u32| {
            let [a, b, c] = self.triangles[*t as usize];
            a != NONE && (home[a as usize] || home[b as usize] || home[c as usize])
        };
        let meets = |t: &u32| {
            let t = self.triangles[*t as usize];
            let mut bounds = Bounds::EMPTY;
            if t[0] != NONE {
                bounds.include(&t.map(|v| self.positions[v as usize]));
            }
            cell.meets(&bounds)
        };
        let all = || 0..self.triangles.len() as u32;
        let seen: Vec<u32> = all().filter(is_member).chain(all().filter(|t| !is_member(t) && meets(t))).collect();
        // Numbered by first appearance, as a chunk does.
        let mut local = vec![NONE; self.positions.len()];
        let mut vertices = Vec::new();
        let triangles: Vec<[u32; 3]> = seen
            .iter()
            .map(|t| {
                self.triangles[*t as usize].map(|v| {
                    if local[v as usize] == NONE {
                        local[v as usize] = vertices.len() as u32;
                        vertices.push(v as usize);
                    }
                    local[v as usize]
                })
            })
            .collect();
        let left_out: Vec<u32> = (0..seen.len() as u32).filter(|i| self.collinear[seen[*i as usize] as usize]).collect();
        let standing = |v: &usize| match (home[*v], self.regular[*v]) {
            (false, _) => Standing::Away,
            (true, false) => Standing::Irregular,
            (true, true) => Standing::Regular,
        };
        let view = CellView {
            positions: &vertices.iter().map(|v| self.positions[*v]).collect::<Vec<_>>(),
            triangles: &triangles,
            left_out: &left_out,
            standing: &vertices.iter().map(standing).collect::<Vec<_>>(),
            cell,
        };
        let mut pairs = Vec::new();
        let tested = finder.pairs(&view, effort, |some, others, contact| {
            for (k, i) in some.iter().enumerate() {
                for j in if others.is_empty() { &some[k + 1..] } else { others } {
                    let [i, j] = [i, j].map(|t| seen[*t as usize]);
                    pairs.push((i.min(j), i.max(j), contact));
                }
            }
        });
        pairs.sort_unstable_by_key(|p| (p.0, p.1));
        (pairs, tested)
    }

    fn by_brute_force(&self) -> Pairs {
        let corners = |t: u32| self.triangles[t as usize].map(|v| self.positions[v as usize]);
        let solid: Vec<u32> = (0..self.triangles.len() as u32)
            .filter(|t| self.triangles[*t as usize][0] != NONE && !self.collinear[*t as usize])
            .collect();
        let pairs = solid.iter().enumerate().flat_map(|(k, i)| solid[k + 1..].iter().map(move |j| (*i, *j)));
        pairs.map(|(i, j)| (i, j, triangles_cross(&corners(i), &corners(j)))).filter(|p| p.2.is_crossing()).collect()
    }
}

/// With slabs beside the boxes.
const ASKEW: Effort = Effort { askew: true, ..Effort::ALL };

fn whole(soup: &[Triangle]) -> (Pairs, u64) {
    Mesh::new(soup).pairs_of(&mut Finder::default(), HomeBox::ALL, Effort::ALL)
}

/// The pairs and the count of a mesh cut into cells of about `size` triangles.
fn in_cells(soup: &[Triangle], size: u32, effort: Effort) -> (Pairs, u64) {
    let records: Vec<record::Record> = soup.iter().map(|t| record::encode(*t, 0)).collect();
    let plan = Plan::new(&records, &crate::io::read_ahead::Guide::NONE, size);
    let (mesh, mut finder) = (Mesh::new(soup), Finder::default());
    let (mut pairs, mut counted) = (Vec::new(), 0);
    for chunk in 0..plan.chunks() as u32 {
        let (found, tested) = mesh.pairs_of(&mut finder, plan.home_box(ChunkId(chunk)), effort);
        pairs.extend(found);
        counted += tested;
    }
    pairs.sort_unstable_by_key(|p| (p.0, p.1));
    (pairs, counted)
}

/// Whole, and however it is cut, the same as all pairs tested one by one.
fn agrees(soup: &[Triangle]) -> Result<(), TestCaseError> {
    let expected = Mesh::new(soup).by_brute_force();
    let mut most = u64::MAX;
    let around = soup.first().zip(soup.last()).and_then(|(a, b)| Axis::through([a[0], b[1]]));
    for effort in [Effort::ALL, ASKEW, Effort { around, ..ASKEW }] {
        let (pairs, tested) = Mesh::new(soup).pairs_of(&mut Finder::default(), HomeBox::ALL, effort);
        prop_assert_eq!(&pairs, &expected);
        prop_assert!(tested <= most, "{} with slabs, {} without", tested, most);
        most = tested;
        for size in [2, 5, 11] {
            let (pairs, counted) = in_cells(soup, size, effort);
            prop_assert_eq!(&pairs, &expected, "in cells of {}", size);
            prop_assert_eq!(counted, tested, "in cells of {}", size);
        }
    }
    Ok(())
}

const FLOOR: Triangle = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]];

/// What `other` and the floor do, which is the same the other way round, seen from elsewhere, and in other units.
fn with_floor(other: Triangle) -> Option<Contact> {
    let contacts: Vec<Option<Contact>> = (0..6)
        .map(|way| {
            let turned = |t: Triangle| t.map(|p| [p[way % 3], p[(way + 1) % 3], p[(way + 2) % 3]].map(|c| c * 0.125));
            let (a, b) = (turned(FLOOR), turned(other));
            whole(&if way < 3 { [a, b] } else { [b, a] }).0.first().map(|p| p.2)
        })
        .collect();
    assert!(contacts.iter().all(|c| *c == contacts[0]), "{other:?}: {contacts:?}");
    contacts[0]
}

#[test]
fn without_common_corners() {
    let (cross, overlap) = (Some(Contact::Cross), Some(Contact::Overlap));
    for (name, other, contact) in [
        ("pierces", [[1.0, 1.0, -1.0], [1.0, 1.0, 1.0], [3.0, 3.0, 1.0]], cross),
        ("a wall whose lower edge lies in the floor", [[1.0, 1.0, 0.0], [2.0, 1.0, 0.0], [1.5, 1.0, 2.0]], cross),
        ("a wall that stands on the floor's edge", [[1.0, 0.0, 0.0], [3.0, 0.0, 0.0], [2.0, 0.0, 2.0]], None),
        ("a corner stands on the floor", [[1.0, 1.0, 0.0], [1.0, 1.0, 2.0], [2.0, 1.0, 2.0]], None),
        ("a corner stands on an edge", [[2.0, 0.0, 0.0], [2.0, -1.0, 2.0], [3.0, -1.0, 2.0]], None),
        ("an edge passes an edge in a point", [[2.0, 0.0, -1.0], [2.0, 0.0, 1.0], [2.0, -2.0, 0.0]], None),
        ("lies across", [[1.0, 1.0, 0.0], [5.0, 1.0, 0.0], [1.0, 5.0, 0.0]], overlap),
        ("lies inside", [[0.5, 0.5, 0.0], [1.0, 0.5, 0.0], [0.5, 1.0, 0.0]], overlap),
        ("lies beside", [[5.0, 5.0, 0.0], [6.0, 5.0, 0.0], [5.0, 6.0, 0.0]], None),
        ("lies edge along edge", [[1.0, 0.0, 0.0], [3.0, 0.0, 0.0], [2.0, -2.0, 0.0]], None),
        ("hovers by the smallest number", [[1.0, 1.0, 1e-38], [1.0, 1.0, 2.0], [2.0, 1.0, 2.0]], None),
        ("dips in by the smallest number", [[1.0, 1.0, -1e-38], [1.0, 1.0, 2.0], [2.0, 1.0, 2.0]], cross),
    ] {
        assert_eq!(with_floor(other), contact, "{name}");
    }
}

#[test]
fn with_one_common_corner() {
    let (cross, overlap) = (Some(Contact::Cross), Some(Contact::Overlap));
    let o = [0.0; 3];
    for (name, other, contact) in [
        ("goes away", [o, [-1.0, -1.0, 1.0], [-1.0, -1.0, 2.0]], None),
        ("pierces from the corner on", [o, [3.0, 3.0, 1.0], [3.0, 3.0, -1.0]], cross),
        ("one edge lies in the floor", [o, [1.0, 1.0, 0.0], [1.0, 1.0, 2.0]], cross),
        ("one edge lies along an edge", [o, [2.0, 0.0, 0.0], [1.0, 0.0, 2.0]], None),
        ("lies across", [o, [1.0, 2.0, 0.0], [2.0, 1.0, 0.0]], overlap),
        ("lies opposite", [o, [-1.0, -2.0, 0.0], [-2.0, -1.0, 0.0]], None),
        ("lies edge along edge", [o, [2.0, 0.0, 0.0], [1.0, -2.0, 0.0]], None),
    ] {
        assert_eq!(with_floor(other), contact, "{name}");
    }
}

#[test]
fn with_two_or_three_common_corners() {
    let overlap = Some(Contact::Overlap);
    let [o, x, y] = FLOOR;
    for (name, other, contact) in [
        ("a wall", [x, o, [1.0, 0.0, 3.0]], None),
        ("continues flat", [x, o, [1.0, -3.0, 0.0]], None),
        ("folded back flat", [x, o, [3.0, 1.0, 0.0]], overlap),
        ("a copy", [o, x, y], overlap),
        ("a copy seen from below", [o, y, x], overlap),
    ] {
        assert_eq!(with_floor(other), contact, "{name}");
    }
}

/// The twelve triangles of a box, outward.
fn cuboid(lo: [f32; 3], hi: [f32; 3]) -> Vec<Triangle> {
    let corner = |i: usize| std::array::from_fn(|k| if i >> k & 1 == 1 { hi[k] } else { lo[k] });
    let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    faces.iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]].map(|t| t.map(|i| corner(*i)))).collect()
}

#[test]
fn boxes() {
    let with_unit = |lo, hi| whole(&[cuboid([0.0; 3], [4.0; 3]), cuboid(lo, hi)].concat()).0.len();
    assert_eq!(with_unit([5.0; 3], [6.0; 3]), 0, "apart");
    assert_eq!(with_unit([1.0; 3], [3.0; 3]), 0, "inside");
    assert_eq!(with_unit([4.0; 3], [8.0; 3]), 0, "corner to corner");
    assert_eq!(with_unit([4.0, 4.0, 0.0], [8.0, 8.0, 4.0]), 0, "edge to edge");
    // Two triangles on two.
    assert_eq!(with_unit([4.0, 0.0, 0.0], [8.0, 4.0, 4.0]), 2, "face to face, split the same way");
    assert!(with_unit([1.0, 1.0, 4.0], [3.0, 3.0, 6.0]) > 0, "a smaller one on top");
    assert!(with_unit([2.0; 3], [6.0; 3]) > 0, "through each other");
}

#[test]
fn triangles_around_good_vertices_are_not_tested() {
    // An octahedron: triangles share a vertex, or lie in opposite octants.
    let ring: Vec<Point> = [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]].to_vec();
    let reversed: Vec<Point> = ring.iter().rev().copied().collect();
    let soup = [fan([1.0, 0.0, 0.0], &ring), fan([-1.0, 0.0, 0.0], &reversed)].concat();
    assert_eq!(whole(&soup), (Vec::new(), 0));
}

/// The triangles from `apex` to a ring.
fn fan(apex: Point, ring: &[Point]) -> Vec<Triangle> {
    (0..ring.len()).map(|i| [apex, ring[i], ring[(i + 1) % ring.len()]]).collect()
}

/// `n` positions that go `turns` times round the x axis, at up to `height`.
fn ring(n: usize, turns: f32, height: f32) -> Vec<Point> {
    let angle = |i: usize| i as f32 / n as f32 * turns * std::f32::consts::TAU;
    (0..n).map(|i| [(i % 7) as f32 / 6.0 * height, angle(i).cos() * 8.0, angle(i).sin() * 8.0]).collect()
}

/// Below the rings, and smaller than all their positions, so that it alone decides whether pairs of its triangles count.
const BELOW: Point = [-4.0, 0.0, 0.0];

#[test]
fn stars_that_go_round_once_are_certified() {
    for n in [3, 4, 6, 12, 100, 1000] {
        let (pairs, tested) = whole(&fan(BELOW, &ring(n, 1.0, 1.5)));
        assert_eq!((pairs.len(), tested), (0, 0), "{n}");
    }
    // Twice round the apex, which is regular by its fan alone.
    let star = fan(BELOW, &ring(15, 2.0, 1.5));
    let (pairs, tested) = whole(&star);
    assert_eq!(pairs, Mesh::new(&star).by_brute_force());
    assert!(!pairs.is_empty() && tested > 0);
}

#[test]
fn two_hubs_joined_along_a_ring_cost_no_more_than_their_triangles() {
    let ring = ring(3000, 1.0, 0.0);
    let reversed: Vec<Point> = ring.iter().rev().copied().collect();
    let soup = [fan(BELOW, &reversed), fan([9.0, 0.0, 0.0], &ring)].concat();
    let (pairs, tested) = whole(&soup);
    assert!(pairs.is_empty());
    assert!(tested < 30_000, "{}", tested);
    let (pairs, counted) = in_cells(&soup, 1000, Effort::ALL);
    assert_eq!((pairs.len(), counted), (0, tested));
}

/// Sectors too narrow for single precision, as those of a fan of a million triangles are.
#[test]
fn hubs_with_very_narrow_sectors_are_certified() {
    let angle = |i: usize| (i / 2) as f64 / 300.0 * std::f64::consts::TAU + (i % 2) as f64 * 7e-7;
    let ring: Vec<Point> = (0..600).map(|i| [0.0, (angle(i).cos() * 8.0) as f32, (angle(i).sin() * 8.0) as f32]).collect();
    let soup = fan(BELOW, &ring);
    let (pairs, tested) = whole(&soup);
    assert_eq!((pairs.len(), tested), (0, 0));
    assert_eq!(in_cells(&soup, 60, Effort::ALL), (pairs, tested));
}

/// A cone's side and its base, and thin rods side by side along a diagonal.
#[test]
fn what_lies_askew_in_boxes_of_others_is_told_apart_by_slabs() {
    let cone = |n: usize| {
        let ring = ring(n, 1.0, 0.0);
        let reversed: Vec<Point> = ring.iter().rev().copied().collect();
        [fan([0.0; 3], &reversed), fan([9.0, 0.0, 0.0], &ring)].concat()
    };
    let rods = |n: usize| {
        let way = |i: usize| [(i % 40) as f32, 0.0, (i / 40) as f32];
        let rod = |i: usize| {
            let ends = [[0.0; 3], [0.25, 0.0, 0.0], [0.0, 0.0, 0.25]].map(|p: Point| [0, 1, 2].map(|k| p[k] + way(i)[k]));
            let ring = [0, 2, 1].map(|k| ends[k]);
            [fan(ends[0].map(|x| x + 100.0), &ring), vec![ends]].concat()
        };
        (0..n / 4).flat_map(rod).collect::<Vec<Triangle>>()
    };
    for soup in [cone(1500), rods(3000)] {
        let (pairs, tested) = whole(&soup);
        assert!(pairs.is_empty() && tested > 200_000, "{} {tested}", pairs.len());
        let (pairs, tested) = Mesh::new(&soup).pairs_of(&mut Finder::default(), HomeBox::ALL, ASKEW);
        assert!(pairs.is_empty() && tested < 10 * soup.len() as u64, "{tested}");
        assert_eq!(in_cells(&soup, 300, ASKEW), (pairs, tested));
    }
}

/// Two hubs over one jagged rim, whose triangles lie in each other's boxes.
#[test]
fn double_cones_are_told_apart_around_their_axis() {
    let tips = [[-20.0, 0.0, 0.0], [20.0, 0.0, 0.0]];
    let jagged = |(i, [_, y, z]): (usize, &Point)| {
        let times = 4.0 + (i % 16) as f32 / 8.0;
        [(i * 7 % 5) as f32, y * times, z * times]
    };
    let rim: Vec<Point> = ring(3000, 1.0, 0.0).iter().enumerate().map(jagged).collect();
    let reversed: Vec<Point> = rim.iter().rev().copied().collect();
    let soup = [&fan(tips[0], &rim)[1..], &fan(tips[1], &reversed)].concat();
    let around = Effort { around: Axis::through(tips), ..ASKEW };
    let (pairs, tested) = Mesh::new(&soup).pairs_of(&mut Finder::default(), HomeBox::ALL, around);
    assert!(pairs.is_empty() && tested < 2 * soup.len() as u64, "{} {tested}", pairs.len());
    assert_eq!(in_cells(&soup, 300, around), (pairs, tested));
    let (_, without) = Mesh::new(&soup).pairs_of(&mut Finder::default(), HomeBox::ALL, ASKEW);
    assert!(without > 20 * tested, "{without} {tested}");
}

/// A hub with a fault at its rim: the pairs of its triangles that do not have the hub as their smallest vertex.
#[test]
fn faults_around_hubs_are_found_in_any_cell() {
    let ring = ring(600, 1.0, 1.5);
    for apex in [BELOW, [1.0, 0.0, 0.0], [20.0, 0.0, 0.0]] {
        let mut soup = fan(apex, &ring);
        // A second triangle on one edge of the hub, and a copy of one: two vertices of the rim are no longer regular.
        soup.push([ring[7], apex, [-1.0, ring[7][1] * 1.5, ring[7][2]]]);
        soup.push(soup[400]);
        let expected = Mesh::new(&soup).by_brute_force();
        let (pairs, tested) = whole(&soup);
        assert_eq!(pairs, expected);
        assert_eq!(in_cells(&soup, 40, Effort::ALL), (expected, tested));
    }
}

#[test]
fn pairs_end_at_the_allowance() {
    // In one plane, each over the next.
    let soup: Vec<Triangle> = (0..300).map(|i| FLOOR.map(|[x, y, z]| [x + i as f32 / 256.0, y, z])).collect();
    let (pairs, tested) = whole(&soup);
    assert_eq!((pairs.len() as u64, tested), (300 * 299 / 2, 300 * 299 / 2));
    let (_, tested) = Mesh::new(&soup).pairs_of(&mut Finder::default(), HomeBox::ALL, Effort { allowance: 1000, ..Effort::ALL });
    assert!((1001..300 * 299 / 2).contains(&tested), "{tested}");
    let (all, tested) =
        Mesh::new(&soup).pairs_of(&mut Finder::default(), HomeBox::ALL, Effort { allowance: 300 * 299 / 2, ..Effort::ALL });
    assert_eq!((all, tested), (pairs, 300 * 299 / 2), "exactly what is allowed");
}

#[test]
fn copies_count_once_each() {
    let [o, x, y] = FLOOR;
    let mut soup: Vec<Triangle> = (0..300).map(|i| [[o, x, y], [y, o, x], [o, y, x]][i % 3]).collect();
    let (pairs, tested) = whole(&soup);
    assert_eq!((pairs.len() as u64, tested), (300 * 299 / 2, 299));
    assert_eq!(in_cells(&soup, 40, Effort::ALL), (pairs, tested));
    // Two that cross all of them, one of which is there twice, and each other.
    soup.push([[1.0, 1.0, -1.0], [1.0, 1.0, 1.0], [3.0, 3.0, 1.0]]);
    soup.extend([[[0.5, 1.0, -1.0], [0.5, 1.0, 1.0], [3.0, 1.5, 0.5]]; 2]);
    let (pairs, tested) = whole(&soup);
    assert_eq!(pairs, Mesh::new(&soup).by_brute_force());
    assert!(tested <= 303, "{tested}");
    assert_eq!(in_cells(&soup, 40, Effort::ALL), (pairs, tested));
}

#[test]
fn parallel_planes_one_float_apart_are_not_counted() {
    let above = FLOOR.map(|p| [p[0] + 0.5, p[1] + 0.5, f32::from_bits(1)]);
    assert_eq!(whole(&[FLOOR, above]), (Vec::new(), 0));
}

#[test]
fn nothing_to_look_at() {
    for soup in [vec![], vec![[[1.0; 3]; 3]], vec![[[0.0; 3], [1.0; 3], [2.0; 3]]; 3]] {
        assert_eq!(whole(&soup), (Vec::new(), 0));
    }
}

fn small_integers(side: i8) -> impl Strategy<Value = Triangle> {
    let point = move || prop::array::uniform3(0..side).prop_map(|p| p.map(f32::from));
    [point(), point(), point()]
}

proptest! {
    /// On few positions nearly everything touches, overlaps or shares vertices.
    #[test]
    fn soups_on_small_grids(soup in prop::collection::vec(small_integers(4), 1..40)) {
        agrees(&soup)?;
    }

    #[test]
    fn soups_on_larger_grids(soup in prop::collection::vec(small_integers(20), 1..80)) {
        agrees(&soup)?;
    }

    /// Any finite floats: under- and overflow in every filter.
    #[test]
    fn soups_of_any_floats(soup in prop::collection::vec(prop::array::uniform3(prop::array::uniform3(
        any::<u32>().prop_map(|b| Some(f32::from_bits(b)).filter(|c| c.is_finite()).unwrap_or(0.0)))), 1..24)) {
        agrees(&soup)?;
    }

    /// Closed surfaces, so that stars are certified: a lattice of cells, those that are set enclosed by faces, with corners
    /// moved so that some of it crosses.
    #[test]
    fn closed_surfaces(cells in prop::array::uniform27(any::<bool>()), moved in prop::collection::vec((0..4_u8, 0..4_u8, 0..4_u8,
                       prop::array::uniform3(-6..7_i8)), 0..6)) {
        let set = |p: [i8; 3]| p.iter().all(|c| (0..3).contains(c)) && cells[(p[0] * 9 + p[1] * 3 + p[2]) as usize];
        let mut soup = Vec::new();
        for i in 0..27_i8 {
            let p = [i / 9, i / 3 % 3, i % 3];
            for k in 0..6 {
                let mut beyond = p;
                beyond[k / 2] += if k % 2 == 0 { -1 } else { 1 };
                if set(p) && !set(beyond) {
                    let lo = p.map(f32::from);
                    soup.extend_from_slice(&cuboid(lo, lo.map(|c| c + 1.0))[[8, 10, 4, 6, 0, 2][k]..][..2]);
                }
            }
        }
        for (x, y, z, by) in moved {
            let from = [x, y, z].map(f32::from);
            for p in soup.as_flattened_mut().iter_mut().filter(|p| **p == from) {
                *p = [0, 1, 2].map(|k| from[k] + f32::from(by[k]) * 0.25);
            }
        }
        agrees(&soup)?;
    }

    /// A star over a ring of any heights and radii is certified or not; either way the answer is that of all pairs.
    #[test]
    fn stars(spokes in prop::collection::vec((1..20_u8, -20..20_i8), 3..12), turns in 1..3_u8, apex in prop::array::uniform3(-4..4_i8)) {
        let n = spokes.len() as f32;
        let ring: Vec<Point> = spokes.iter().enumerate().map(|(i, (radius, height))| {
            let angle = i as f32 / n * f32::from(turns) * std::f32::consts::TAU;
            [angle.cos() * f32::from(*radius), angle.sin() * f32::from(*radius), f32::from(*height)]
        }).collect();
        agrees(&fan(apex.map(f32::from), &ring))?;
    }
}
