//! Paint of a part of the triangle.
//!
//! A part that is a node of the tree has that node's paint. Each other part is quartered until each cell is of one state, or until the
//! error is small, or eight times. A cell of several states takes the one that lacks most area up to there, its own area in the cell
//! included: so the errors of cells cancel, and the share of each state is right to about a cell.

use super::clip::{self, Weights};
use super::split::{Share, Way, in_quarter};
use super::tree::Paint;
use super::turn::ORDERS;
use std::collections::BTreeMap;

/// Paint of a part of a painted triangle.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Piece {
    /// Relative to the part's corners.
    pub(crate) paint: Paint,
    /// Whether it is the same paint, place by place, up to the rounding of the corners.
    pub(crate) exact: bool,
    /// Area that has another state now, as a share of the whole painted triangle; a bound of it where the part is nearly a node.
    pub(crate) misplaced: f64,
}

/// A part is quartered so often, at most. So its text has 4⁸ leaves and a third as many splits at most, and a straight line through it
/// makes about 2 000 digits.
const QUARTERINGS: u32 = 8;
/// Errors that end the quartering: of each state's area, as a share of the part, and of the misplaced area, as a share of the whole.
const SMALL: f64 = 1e-4;
/// Shares below this are the rounding of corners.
const ROUNDING: f64 = 1e-9;
/// Corners farther from a node's, in weights, are not meant to be these.
const NEAR: f64 = 1e-4;
/// A part with a smaller share of the triangle is a point.
const POINT: f64 = 1e-13;

const CORNERS: [Weights; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

impl Paint {
    /// The paint of a triangle that is a part of this one, either side up; its corners are given as weights of this one's corners.
    /// Its share of each state is right to 10⁻⁴. Not more than 10⁻⁴ of the whole is misplaced, unless cells of 4⁻⁸ of the part are too
    /// large for that: then it lies in the cells along the borders of states.
    ///
    /// O(n) in the tree, plus O(c) in cells with a border, of which there are about 2⁹ for a straight line.
    pub(crate) fn piece(&self, corners: [Weights; 3]) -> Piece {
        if let Paint::Uniform(_) = self {
            return Piece { paint: self.clone(), exact: true, misplaced: 0.0 };
        }
        let middle = std::array::from_fn(|k| corners.iter().map(|corner| corner[k]).sum::<f64>() / 3.0);
        let known = corners.as_flattened().iter().all(|weight| weight.is_finite());
        if let Some(node) = known.then(|| self.node_of(corners, middle)).flatten() {
            return node;
        }
        let state = self.state_at(middle);
        let share = clip::area(&corners);
        let regions = if share >= POINT { self.regions(corners) } else { Vec::new() };
        if regions.is_empty() {
            return Piece { paint: Paint::Uniform(state), exact: false, misplaced: 0.0 };
        }
        let mut depth = 0;
        loop {
            let mut cells = Cells::default();
            let paint = cells.paint(&regions, depth, 1.0, state);
            if depth == QUARTERINGS || cells.good(share) {
                return Piece { paint, exact: cells.misplaced <= ROUNDING, misplaced: cells.misplaced * share };
            }
            depth = cells.enough(share, depth);
        }
    }

    /// The node with these corners, or so near that the paint is the same up to [`SMALL`].
    fn node_of(&self, corners: [Weights; 3], middle: Weights) -> Option<Piece> {
        let (mut node, mut at, mut weights) = (self, CORNERS, middle);
        loop {
            for order in ORDERS {
                let apart = (0..3).map(|k| distance(corners[k], at[order[k]])).fold(0.0, f64::max);
                if apart > NEAR {
                    continue;
                }
                let misplaced = 2.0 * apart * borders(node, at);
                if misplaced <= SMALL * clip::area(&at) {
                    return Some(Piece { paint: node.turned(order), exact: apart == 0.0, misplaced });
                }
            }
            let Paint::Split(split) = node else { return None };
            weights.rotate_left(usize::from(split.first));
            let (child, inside) = split.way.child_at(weights);
            let (next, corners, _) = split.parts(at, Share::WHOLE).nth(child)?;
            (node, at, weights) = (next, corners, inside);
        }
    }

    /// The parts of leaves in the triangle with these corners. Empty if it has no area.
    fn regions(&self, corners: [Weights; 3]) -> Vec<Region> {
        let mut found = Vec::new();
        if let [Some(a), Some(b), Some(c)] = CORNERS.map(|corner| clip::weights_of(corners, corner)) {
            collect(self, [a, b, c], &mut found);
        }
        found
    }
}

/// A place's distance from another one: the largest difference of weights.
fn distance(a: Weights, b: Weights) -> f64 {
    (0..3).map(|k| (a[k] - b[k]).abs()).fold(0.0, f64::max)
}

/// Length of the borders of all leaves, in weights, each border twice but for the outer ones. O(n).
fn borders(paint: &Paint, at: [Weights; 3]) -> f64 {
    match paint {
        Paint::Uniform(_) => (0..3).map(|k| distance(at[k], at[(k + 1) % 3])).sum(),
        Paint::Split(split) => split.parts(at, Share::WHOLE).map(|(child, at, _)| borders(child, at)).sum(),
    }
}

/// A part of a cell with one state: a convex polygon.
struct Region {
    state: u32,
    outline: Vec<Weights>,
}

fn collect(paint: &Paint, at: [Weights; 3], found: &mut Vec<Region>) {
    if (0..3).any(|k| at.iter().all(|corner| corner[k] <= 0.0)) {
        return;
    }
    match paint {
        Paint::Uniform(state) => push(*state, at.to_vec(), found),
        Paint::Split(split) => split.parts(at, Share::WHOLE).for_each(|(child, at, _)| collect(child, at, found)),
    }
}

fn push(state: u32, outline: Vec<Weights>, found: &mut Vec<Region>) {
    let outline = clip::within(outline);
    if outline.len() >= 3 {
        found.push(Region { state, outline });
    }
}

impl Region {
    /// The part in a quarter of the cell.
    fn in_quarter(&self, quarter: usize, found: &mut Vec<Region>) {
        let moved = || self.outline.iter().map(|place| in_quarter(quarter, *place));
        let outside = (0..3).any(|corner| moved().all(|place| place[corner] <= 0.0));
        if !outside {
            push(self.state, moved().collect(), found);
        }
    }
}

/// Areas by state, in the order of states.
type Areas = Vec<(u32, f64)>;

fn areas_of(regions: &[Region]) -> Areas {
    let mut areas = Areas::new();
    for region in regions {
        let area = clip::area(&region.outline);
        match areas.binary_search_by_key(&region.state, |(state, _)| *state) {
            Ok(at) => areas.iter_mut().skip(at).take(1).for_each(|(_, sum)| *sum += area),
            Err(at) => areas.insert(at, (region.state, area)),
        }
    }
    areas
}

/// Cells of a part, and the errors made in them so far, as shares of the part.
#[derive(Default)]
struct Cells {
    /// The area that each state lacks.
    lacks: BTreeMap<u32, f64>,
    misplaced: f64,
}

impl Cells {
    /// Whether the errors are small, in a part with this share of the whole.
    fn good(&self, share: f64) -> bool {
        self.lacks.values().all(|lack| lack.abs() <= SMALL) && (self.misplaced <= ROUNDING || self.misplaced * share <= SMALL)
    }

    /// The next depth to try after this one. The misplaced area lies along borders, and halves with each quartering.
    fn enough(&self, share: f64, depth: u32) -> u32 {
        let (mut next, mut misplaced) = (depth + 1, self.misplaced * share / 2.0);
        while misplaced > SMALL && next < QUARTERINGS {
            (next, misplaced) = (next + 1, misplaced / 2.0);
        }
        next
    }

    /// A cell's paint. It may be quartered `depth` times; `size` is its share of the part, and `around` its state if no region is in it.
    fn paint(&mut self, regions: &[Region], depth: u32, size: f64, around: u32) -> Paint {
        let Some(first) = regions.first() else { return Paint::Uniform(around) };
        if regions.iter().all(|region| region.state == first.state) {
            return Paint::Uniform(first.state);
        }
        let areas = areas_of(regions);
        let all: f64 = areas.iter().map(|(_, area)| area).sum();
        let (most, largest) = areas.iter().fold((around, 0.0), |best, next| if next.1 > best.1 { *next } else { best });
        if all <= ROUNDING {
            return Paint::Uniform(around);
        }
        if all - largest <= ROUNDING * all {
            return Paint::Uniform(self.fill(most, &areas, size / all));
        }
        if depth == 0 {
            let chosen = self.neediest(&areas, size / all);
            return Paint::Uniform(self.fill(chosen, &areas, size / all));
        }
        let mut inside = Vec::new();
        let children: Vec<Paint> = (0..Way::Three.points().len())
            .map(|quarter| {
                inside.clear();
                regions.iter().for_each(|region| region.in_quarter(quarter, &mut inside));
                self.paint(&inside, depth - 1, size / 4.0, most)
            })
            .collect();
        match children.as_slice() {
            [first @ Paint::Uniform(_), others @ ..] if others.iter().all(|other| other == first) => first.clone(),
            _ => Paint::split(Way::Three, 0, children),
        }
    }

    /// The state that lacks most area with this cell's areas, of which 1 is `unit` in shares of the part.
    fn neediest(&self, areas: &Areas, unit: f64) -> u32 {
        let mut best = (0, f64::NEG_INFINITY);
        for (state, area) in areas {
            let lack = area * unit + self.lacks.get(state).copied().unwrap_or(0.0);
            if lack > best.1 {
                best = (*state, lack);
            }
        }
        best.0
    }

    /// Gives the cell to this state.
    fn fill(&mut self, chosen: u32, areas: &Areas, unit: f64) -> u32 {
        for (state, area) in areas.iter().map(|(state, area)| (*state, area * unit)) {
            if state != chosen {
                *self.lacks.entry(state).or_default() += area;
                *self.lacks.entry(chosen).or_default() -= area;
                self.misplaced += area;
            }
        }
        chosen
    }
}
