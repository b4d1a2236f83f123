//! What nobody sees from outside: a piece of surface goes that other pieces hide in all of six directions.
//!
//! After Yang et al., "Research on repair method of shoe mould for 3D printing", Computer Science and Application 11(4), 2021, section 3.2 (and the
//! patent of the same group): for each of Z, X, Y, −Z, −X, −Y, and each piece that is not known to be visible, take its largest triangle. If that
//! stands along the direction, or a ray from it meets another piece, the piece is hidden in this direction.
//!
//! What the paper leaves open is settled so. A piece is what stands for itself (`pieces::pieces`), closed or open, after crossings were cut. Of
//! several largest triangles the first in the file counts, measured in rounded arithmetic that is the same everywhere; triangles that a repair
//! has added are neither asked nor do they hide anything, since the paper decides before it fills. The ray begins inside of the
//! triangle, within a rounding of f64, which is far finer than what f32 can tell apart; whether a triangle stands along a direction and what a ray meets are
//! decided by exact predicates (`bodies`). Whether a piece is seen from one direction does not depend on the others, so that what
//! boxes tell is asked for all of them first.
//!
//! It is a rule of thumb, and no more than that: one triangle speaks for a piece, cavities go with what floats in them, and so does a part between
//! the jaws of another. What lies in the material of others, or in a closed piece, was to go; a body that lies in none, and a sheet,
//! may have been meant to stay, and a person is asked (`review`). Nothing that crosses anything goes.

use crate::contract::report::RepairName;
use crate::repairs::shared::context::{Changes, Done, Repair};
use std::collections::{BTreeMap, HashMap, HashSet};

use robust::Coord;

use crate::contract::report::{LoopLeft, MOST_LISTED, SheetDropped};
use crate::contract::settings::{Bodies, Profile};
use crate::detect::bodies::{self, Direction, Source};
use crate::detect::review::Enclosed;
use crate::geometry::boxes::BoxTree;
use crate::geometry::position::Position;
use crate::geometry::sums::Bounds;
use crate::io::record;
use crate::repairs::shared::pieces::{crossing, lies_in_material};
use crate::repairs::shared::work::Work;
use crate::submesh::components::{Components, Reversed};
use crate::submesh::{Origin, Submesh};
use crate::topology::survey::Survey;
use crate::util::words::{Count, Short};

/// Surface that other surface hides.
pub(crate) const REPAIR: Repair = Repair {
    name: RepairName::Hidden,
    changes: Changes::Pieces,
    run: |cx| {
        if cx.profile.bodies != Bodies::Visible {
            return Ok(Done::count(0, ""));
        }
        let pieces = cx.pieces();
        let mut hidden = remove(cx.survey, &mut cx.work, &mut cx.reversed, &pieces, &mut cx.account.loops_left, cx.profile);
        cx.account.sheets.append(&mut hidden.sheets);
        cx.account.enclose(hidden.expected.bodies, hidden.expected.volume);
        Ok(Done::count(hidden.pieces, hidden.to_string()))
    },
};

/// The paper's order: Z, X, Y, −Z, −X, −Y.
const DIRECTIONS: [Direction; 6] = [
    Direction { axis: 2, backward: false },
    Direction { axis: 0, backward: false },
    Direction { axis: 1, backward: false },
    Direction { axis: 2, backward: true },
    Direction { axis: 0, backward: true },
    Direction { axis: 1, backward: true },
];

/// Counts and volumes of the surface that was hidden.
#[derive(Clone, Debug, Default)]
pub(crate) struct Hidden {
    /// Pieces of any kind.
    pub(crate) pieces: u64,
    /// Of these, bodies, and what they enclose, in the file's units, cubed.
    pub(crate) bodies: u64,
    pub(crate) volume: f64,
    /// And cavities, which are filled thereby.
    pub(crate) cavities: u64,
    pub(crate) filled: f64,
    /// What may go without a person's look: bodies inside of closed pieces, and the volume that counted more than once.
    pub(crate) expected: Enclosed,
    /// Open pieces, the largest first.
    pub(crate) sheets: Vec<SheetDropped>,
}

impl std::fmt::Display for Hidden {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let others = self.pieces - self.bodies - self.cavities;
        let (bodies, cavities, others) = (Count(self.bodies), Count(self.cavities), Count(others));
        let (volume, filled) = (Short(self.volume), Short(self.filled));
        write!(f, "pieces of surface removed that others hide in all six directions; bodies: {bodies}, of {volume} units³, ")?;
        write!(f, "cavities, which are filled thereby: {cavities}, of {filled} units³, sheets and others: {others}")
    }
}

/// Removes what is hidden, and takes its loops off the list of those that are `left`. Nothing is removed if it is not known what crosses what.
/// Reads the chunks of pieces with others on both sides of them once, and for each direction those that a ray may meet.
/// `pieces`: as [`crate::repairs::shared::pieces::pieces`] finds them.
pub(crate) fn remove(
    survey: &Survey<'_>,
    work: &mut Work<'_>,
    reversed: &mut Reversed,
    pieces: &Components,
    left: &mut Vec<LoopLeft>,
    profile: &Profile,
) -> Hidden {
    let mut hidden = Hidden::default();
    let Some(crossing_pairs) = survey.crossing_pairs.as_deref().filter(|_| profile.bodies == Bodies::Visible) else {
        return hidden;
    };
    let submesh: &Submesh = work;
    let mut is_hidden = hidden_pieces(survey, submesh, pieces);
    if !is_hidden.contains(&true) {
        return hidden;
    }
    let crossing = crossing(survey, submesh, pieces, crossing_pairs.iter().map(|pair| pair.triangles));
    is_hidden.iter_mut().zip(crossing).for_each(|(hidden, crosses)| *hidden &= !crosses);
    let around = bodies::surroundings(survey, submesh, pieces, reversed, |piece| !piece.open);
    for (i, piece) in pieces.list.iter().enumerate().filter(|(i, _)| is_hidden[*i]) {
        hidden.pieces += 1;
        let volume = survey.measure.volume(piece.extent);
        let is_body = !piece.open && piece.extent.volume > 0;
        if is_body {
            hidden.bodies += 1;
            hidden.volume += volume;
            hidden.expected.bodies += u64::from(!around[i].around.is_empty());
        } else if !piece.open && piece.extent.volume < 0 {
            hidden.cavities += 1;
            hidden.filled -= volume;
        } else {
            let bounds = piece.bounds.normalised();
            let (bounds, area) = ([bounds.lo, bounds.hi], survey.measure.area(piece.extent));
            hidden.sheets.push(SheetDropped {
                bounds,
                area,
                triangles: piece.triangles,
                crosses: false,
                hidden: true,
                in_material: false,
            });
        }
        if lies_in_material(piece, around[i].winding()) {
            hidden.expected.volume += volume;
        }
    }
    // Stable: of equal ones the first in the file.
    hidden.sheets.sort_by(|a, b| b.area.total_cmp(&a.area));
    hidden.sheets.truncate(MOST_LISTED);
    crate::repairs::shared::pieces::take_away(work, reversed, pieces, &is_hidden);
    let there: HashSet<Position> = work.living().flat_map(|t| work.points(t)).map(Position::of).collect();
    left.retain(|rim| there.contains(&Position::of(rim.at)));
    hidden
}

/// Which pieces are seen from no direction.
fn hidden_pieces(survey: &Survey<'_>, submesh: &Submesh, pieces: &Components) -> Vec<bool> {
    let boxes: Vec<Bounds> = pieces.list.iter().map(|piece| piece.bounds).collect();
    let tree = BoxTree::new(&boxes);
    // A triangle with an area stands along four directions at most, so that a piece with nothing on one side along each axis is seen.
    let others_on_both_sides = |piece: u32, axis: usize| {
        [false, true].into_iter().all(|backward| {
            let direction = Direction { axis, backward };
            tree.meets_another(&extended(boxes[piece as usize], direction), piece)
        })
    };
    let count = pieces.list.len() as u32;
    let asked: Vec<bool> = (0..count).map(|piece| (0..3).any(|axis| others_on_both_sides(piece, axis))).collect();
    let mut is_hidden = vec![false; asked.len()];
    if !asked.contains(&true) {
        return is_hidden;
    }
    let largest = largest_triangles(survey, submesh, pieces, &asked);
    let sources = || {
        largest.iter().map(|(piece, largest)| {
            let corners = largest.corners(survey, submesh);
            (corners, Source { from: bodies::inner_point(&corners), component: *piece })
        })
    };
    for (corners, source) in sources() {
        let is_seen = |direction: &Direction| {
            !stands_along(&corners, *direction)
                && !tree.meets_another(&extended(bodies::box_around(source.from, 0.0), *direction), source.component)
        };
        is_hidden[source.component as usize] = !DIRECTIONS.iter().any(is_seen);
    }
    let is_of_the_file = |t: u32| !matches!(submesh.triangles[t as usize].origin, Origin::Added(_));
    for direction in DIRECTIONS {
        let asked = sources().filter(|(corners, s)| is_hidden[s.component as usize] && !stands_along(corners, direction));
        let asked = [(direction, asked.map(|(_, source)| source).collect::<Vec<Source>>())];
        let met = bodies::obstructed(survey, submesh, pieces, &asked, is_of_the_file);
        for (source, met) in asked[0].1.iter().zip(met.into_iter().flatten()) {
            is_hidden[source.component as usize] = met;
        }
    }
    is_hidden
}

/// The box and all that lies from it in a direction.
fn extended(mut of: Bounds, direction: Direction) -> Bounds {
    let Direction { axis, backward } = direction;
    if backward {
        of.lo[axis] = f32::NEG_INFINITY
    } else {
        of.hi[axis] = f32::INFINITY
    }
    of
}

/// Does the triangle's plane hold the direction? Exact.
fn stands_along(corners: &[[f32; 3]; 3], direction: Direction) -> bool {
    let flat = corners.map(|p| {
        let [x, y, _] = direction.upright(p.map(f64::from));
        Coord { x, y }
    });
    robust::orient2d(flat[0], flat[1], flat[2]) == 0.0
}

/// The largest triangle of a piece, as far as it is known.
#[derive(Clone, Copy, Debug)]
struct Largest {
    /// Square of twice the area.
    size: f64,
    record: u32,
    in_submesh: Option<u32>,
}

impl Largest {
    fn of(corners: &[[f32; 3]; 3], record: u32, in_submesh: Option<u32>) -> Self {
        let [a, b, c] = corners.map(|p| p.map(f64::from));
        let [u, v]: [[f64; 3]; 2] = [b, c].map(|p| std::array::from_fn(|k| p[k] - a[k]));
        let cross = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
        Self { size: cross[0] * cross[0] + cross[1] * cross[1] + cross[2] * cross[2], record, in_submesh }
    }

    /// The larger one; of equal ones what comes first in the file.
    fn or(self, other: Self) -> Self {
        let first = || (self.record, self.in_submesh) <= (other.record, other.in_submesh);
        if self.size > other.size || self.size == other.size && first() { self } else { other }
    }

    fn corners(&self, survey: &Survey<'_>, submesh: &Submesh) -> [[f32; 3]; 3] {
        self.in_submesh.map_or_else(|| record::corners(&survey.records[self.record as usize]), |t| submesh.points(t))
    }
}

/// The largest triangle of each piece that is asked about, of those that the file holds; pieces that consist of others have none.
fn largest_triangles(survey: &Survey<'_>, submesh: &Submesh, pieces: &Components, asked: &[bool]) -> BTreeMap<u32, Largest> {
    let is_asked = |piece: u32| asked.get(piece as usize) == Some(&true);
    let found = survey.visit_regular(
        |region| is_asked(pieces.of_region[region as usize]),
        HashMap::<u32, Largest>::new,
        |found, triangle, region| {
            let this = Largest::of(&record::corners(&survey.records[triangle as usize]), triangle, None);
            found.entry(pieces.of_region[region as usize]).and_modify(|known| *known = known.or(this)).or_insert(this);
        },
    );
    let in_submesh = submesh.living().filter_map(|t| {
        let piece = pieces.of_triangle[t as usize];
        let is_of_the_file = !matches!(submesh.triangles[t as usize].origin, Origin::Added(_));
        (is_of_the_file && is_asked(piece)).then(|| (piece, Largest::of(&submesh.points(t), submesh.record(t), Some(t))))
    });
    let mut largest: BTreeMap<u32, Largest> = BTreeMap::new();
    // Which of two is the larger does not depend on the order that they come in.
    for (piece, this) in found.into_iter().flatten().chain(in_submesh) {
        largest.entry(piece).and_modify(|known| *known = known.or(this)).or_insert(this);
    }
    largest.retain(|_, largest| largest.size > 0.0);
    largest
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::repairs::holes::fill;
    use crate::repairs::orient::directions;
    use crate::repairs::shared::pieces;
    use crate::testing::{After, Corners, after, cuboid, plate, reversed, shifted};

    fn nested(size: f32) -> Vec<Corners> {
        cuboid([-size; 3], [size; 3])
    }

    /// What is removed of a file that is filled and turned as in a repair.
    fn removed(mesh: &[Corners]) -> After<Hidden> {
        let profile = Profile { bodies: Bodies::Visible, ..Profile::default() };
        after(mesh, |d, turned| {
            let work = &mut Work::new(&mut d.submesh);
            directions::make_coherent(&d.survey, work, turned, &[]);
            let mut closed = fill::fill_loops(&d.survey, work, turned, &d.tolerance, (&profile, None), 1);
            let pieces = pieces::pieces(&d.survey, work, turned);
            directions::make_outward(&d.survey, work, turned, &pieces);
            let pieces = pieces::pieces(&d.survey, work, turned);
            let rims = closed.left.len();
            let hidden = remove(&d.survey, work, turned, &pieces, &mut closed.left, &profile);
            assert_eq!(rims - closed.left.len(), hidden.sheets.len(), "a sheet has one rim here");
            hidden
        })
    }

    #[test]
    fn what_a_body_encloses_goes_with_its_cavity() {
        let got = removed(&[nested(4.0), reversed(&nested(2.0)), nested(1.0)].concat());
        let hidden = got.result;
        assert_eq!((hidden.pieces, hidden.bodies, hidden.cavities, got.untouched), (2, 1, 1, 12));
        assert_eq!((hidden.volume, hidden.filled), (8.0, 64.0));
        // The body in the cavity was in no material, so that its volume is missing and the cavity's was added.
        assert_eq!((hidden.expected.bodies, hidden.expected.volume), (1, 0.0));
        let got = removed(&[nested(4.0), shifted(&nested(1.0), [2.0, 0.0, 0.0])].concat());
        assert_eq!((got.result.expected.bodies, got.result.expected.volume, got.untouched), (1, 8.0, 12));
    }

    #[test]
    fn what_is_seen_from_one_direction_stays() {
        // Five walls around a cube, whose top is the largest face: one side after the other is left open.
        let cube = cuboid([-1.0, -1.0, -0.5], [1.0, 1.0, 0.5]);
        let wall = |axis: usize, side: f32| {
            let (mut lo, mut hi) = ([-2.0f32; 3], [2.0f32; 3]);
            (lo[axis], hi[axis]) = if side > 0.0 { (3.0, 4.0) } else { (-4.0, -3.0) };
            cuboid(lo, hi)
        };
        let walls = |but: Option<(usize, f32)>| -> Vec<Corners> {
            let all = (0..3).flat_map(|axis| [(axis, 1.0), (axis, -1.0)]);
            all.filter(|this| Some(*this) != but).flat_map(|(axis, side)| wall(axis, side)).chain(cube.clone()).collect()
        };
        let got = removed(&walls(None)).result;
        assert_eq!((got.pieces, got.bodies, got.expected.bodies), (1, 1, 0), "it lies in no closed piece: a person is asked");
        for open in [(2, 1.0), (2, -1.0)] {
            assert_eq!(removed(&walls(Some(open))).result.pieces, 0, "{open:?}");
        }
        // The largest face stands along these.
        for hidden in [(0, 1.0), (0, -1.0), (1, 1.0), (1, -1.0)] {
            assert_eq!(removed(&walls(Some(hidden))).result.pieces, 1, "{hidden:?}");
        }
    }

    #[test]
    fn a_slanted_triangle_is_seen_from_any_side() {
        // A tetrahedron whose largest face looks along no axis.
        let o = [0.0; 3];
        let [x, y, z] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let wedge: Vec<Corners> = vec![[o, y, x], [o, x, z], [o, z, y], [x, y, z]];
        let walls = [
            cuboid([-1.0, -1.0, 2.0], [2.0, 2.0, 3.0]),
            cuboid([-1.0, -1.0, -2.0], [2.0, 2.0, -1.0]),
            cuboid([2.0, -1.0, -1.0], [3.0, 2.0, 2.0]),
            cuboid([-3.0, -1.0, -1.0], [-2.0, 2.0, 2.0]),
            cuboid([-1.0, 2.0, -1.0], [2.0, 3.0, 2.0]),
            cuboid([-1.0, -3.0, -1.0], [2.0, -2.0, 2.0]),
        ];
        let without = |gap: usize| -> Vec<Corners> {
            wedge.iter().copied().chain((0..6).filter(|i| *i != gap).flat_map(|i| walls[i].clone())).collect()
        };
        assert_eq!(removed(&without(6)).result.pieces, 1);
        for gap in 0..6 {
            assert_eq!(removed(&without(gap)).result.pieces, 0, "wall {gap}");
        }
    }

    #[test]
    fn a_sheet_inside_a_body_goes_and_is_named() {
        let sheet = shifted(&plate(2, |_, _| true), [-1.0, -1.0, 0.5]);
        let got = removed(&[nested(4.0), sheet].concat());
        let named = SheetDropped {
            bounds: [[-1.0, -1.0, 0.5], [1.0, 1.0, 0.5]],
            area: 4.0,
            triangles: 8,
            crosses: false,
            hidden: true,
            in_material: false,
        };
        assert_eq!((got.result.sheets, got.untouched), (vec![named], 12));
        assert!(got.verdict.good, "{:?}", got.verdict);
    }

    #[test]
    fn open_pieces_hide_as_closed_ones_do() {
        // A cube between two sheets, whose top and bottom are its largest faces.
        let cube = cuboid([1.0, 1.0, -0.5], [3.0, 3.0, 0.5]);
        let sheet = |z| shifted(&plate(4, |_, _| true), [0.0, 0.0, z]);
        assert_eq!(removed(&[sheet(2.0), cube.clone(), sheet(-2.0)].concat()).result.bodies, 1);
        assert_eq!(removed(&[sheet(2.0), cube].concat()).result.bodies, 0);
    }

    #[test]
    fn what_a_repair_has_closed_hides_nothing() {
        // A tray without its top, and what stands in it.
        let mut tray = nested(4.0);
        tray.drain(2..4);
        let inside = shifted(&nested(0.5), [1.0, 1.0, 1.0]);
        assert_eq!(removed(&[tray.clone(), inside].concat()).result.pieces, 0);
        assert_eq!(removed(&[nested(4.0), shifted(&nested(0.5), [1.0, 1.0, 1.0])].concat()).result.pieces, 1);
    }

    #[test]
    fn what_crosses_stays() {
        let across = cuboid([-1.0, -1.0, -1.0], [1.0, 1.0, 4.5]);
        assert_eq!(removed(&[nested(4.0), across].concat()).result.pieces, 0);
    }

    #[test]
    fn of_equal_triangles_the_first_in_the_file_is_asked() {
        let face: Corners = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let [a, b] = [3, 5].map(|record| Largest::of(&face, record, None));
        assert_eq!((a.or(b).record, b.or(a).record), (3, 3));
        let larger = Largest::of(&[[0.0; 3], [1.5, 0.0, 0.0], [0.0, 1.0, 0.0]], 9, None);
        assert_eq!((a.or(larger).record, larger.or(a).record), (9, 9));
    }
}
