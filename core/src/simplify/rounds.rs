//! Rounds: the mesh is parted into cells, each is simplified by itself with what it shares with others as it is, and all become one mesh again. The next
//! round has other cells. Which collapses are done depends on the mesh alone: not on threads, nor on time.

use rayon::prelude::*;

use crate::geometry::sums::Bounds;
use crate::simplify::cell::{Obstacle, Rules, Work};
use crate::simplify::crossed::{Before, Look};
use crate::simplify::net::Net;
use crate::simplify::partition::{Partition, Planes};
use crate::simplify::patch::{FIXED, Patch};
use crate::simplify::queue::BUCKETS;
use crate::simplify::task::Barred;
use crate::util::ids::NONE;

/// The share of collapses still wanted that a step looks for, so that none goes too far.
const STEP: f64 = 0.85;

/// Steps of a round, at most; each does about a half of what is left.
const STEPS: usize = 24;

/// Items that a thread takes at once.
const BLOCK: usize = 1 << 12;

/// The share of the edges that the first step looks at that collapse, as is guessed: each collapse changes the price of about ten edges. Each step goes
/// through the memory of all cells, so that few are wanted.
const FIRST_YIELD: f64 = 0.2;

/// A step looks at so many times as many edges as are to collapse, at most.
const LEAST_YIELD: f64 = 0.02;

/// A goal is reached if at most one in so many triangles is left besides.
const NEARLY: usize = 100;

/// A cell, and a place in it.
#[derive(Clone, Copy, Default)]
struct Seat {
    cell: u32,
    place: u32,
}

/// The mesh in cells.
struct Parted {
    partition: Partition,
    /// By vertices, its cell and its place among those of the cell.
    seats: Vec<Seat>,
    /// Faces by cells, from where to where.
    faces: Vec<u32>,
    starts: Vec<usize>,
    /// By faces, its cell and its place there; [`NONE`] for the cell of those of more than one.
    face_seats: Vec<Seat>,
    /// Facts of the triangles of more than one cell.
    between: Between,
}

impl Parted {
    fn new(net: &Net, planes: Planes) -> Self {
        let partition = Partition::new(&net.points, planes);
        let mut seats = vec![Seat::default(); net.points.len()];
        for (c, cell) in (0..).zip(&partition.cells) {
            for (place, v) in (0..).zip(&partition.order[cell.start..cell.end]) {
                seats[*v as usize] = Seat { cell: c, place };
            }
        }
        let cell_of = |face: &[u32; 3]| {
            let [a, b, c] = face.map(|v| seats[v as usize].cell);
            Seat { cell: if a == b && b == c { a } else { NONE }, place: 0 }
        };
        let mut face_seats: Vec<Seat> = net.faces.par_iter().with_min_len(BLOCK).map(cell_of).collect();
        let mut counts = vec![0_u32; partition.cells.len()];
        for seat in &mut face_seats {
            if let Some(count) = counts.get_mut(seat.cell as usize) {
                seat.place = *count;
                *count += 1;
            }
        }
        let mut starts = vec![0_usize; partition.cells.len() + 1];
        for (c, count) in counts.iter().enumerate() {
            starts[c + 1] = starts[c] + *count as usize;
        }
        let in_cells = || {
            let mut faces = vec![0_u32; starts.last().copied().unwrap_or(0)];
            for (f, seat) in face_seats.iter().enumerate().filter(|(_, seat)| seat.cell != NONE) {
                faces[starts[seat.cell as usize] + seat.place as usize] = f as u32;
            }
            faces
        };
        let (faces, between) = rayon::join(in_cells, || Between::new(net, &partition, &seats, &face_seats));
        Self { partition, seats, faces, starts, face_seats, between }
    }

    fn vertices(&self, c: usize) -> &[u32] {
        let cell = &self.partition.cells[c];
        &self.partition.order[cell.start..cell.end]
    }

    fn faces(&self, c: usize) -> &[u32] {
        &self.faces[self.starts[c]..self.starts[c + 1]]
    }

    /// The points and the triangles of a cell.
    fn before(&self, net: &Net, c: usize) -> Before {
        let points = self.vertices(c).iter().map(|v| net.points[*v as usize]).collect();
        let corners = self.faces(c).iter().flat_map(|f| net.faces[*f as usize].map(|v| self.seats[v as usize].place)).collect();
        Before { points, corners }
    }

    fn patch(&self, net: &Net, c: usize, unit: f64) -> Patch {
        let Before { points, corners } = self.before(net, c);
        let vertices = self.vertices(c);
        let quadrics = vertices.iter().map(|v| net.quadrics[*v as usize]).collect();
        let kind = |v: &u32| if self.between.is_shared[*v as usize] { FIXED } else { net.kinds[*v as usize] };
        let kinds = vertices.iter().map(kind).collect();
        let strict = vertices.iter().map(|v| net.strict[*v as usize]).collect();
        Patch::new(points, quadrics, [kinds, strict], corners, unit)
    }

    fn work(&self, net: &Net, c: usize, rules: Rules, is_guarded: bool) -> Work {
        let triangle = |f: &u32| -> Obstacle {
            let face = net.faces[*f as usize];
            (face, face.map(|v| net.points[v as usize]))
        };
        let obstacles = self.between.obstacles[c].iter().map(triangle).collect();
        Work::new(
            self.patch(net, c, rules.unit),
            self.partition.cells[c],
            (obstacles, self.between.outer[c].clone()),
            rules,
            is_guarded,
        )
    }
}

/// Triangles of more than one cell.
struct Between {
    /// Their vertices.
    is_shared: Vec<bool>,
    /// By cells, which of them reach into it.
    obstacles: Vec<Vec<u32>>,
    /// By cells, edges of them with both ends in it, by numbers of vertices in the cell, in order.
    outer: Vec<Vec<[u32; 2]>>,
}

impl Between {
    fn new(net: &Net, partition: &Partition, seats: &[Seat], face_seats: &[Seat]) -> Self {
        let mut is_shared = vec![false; net.points.len()];
        let mut obstacles = vec![Vec::new(); partition.cells.len()];
        let mut outer = vec![Vec::new(); partition.cells.len()];
        for (f, _) in face_seats.iter().enumerate().filter(|(_, seat)| seat.cell == NONE) {
            let face = net.faces[f];
            face.iter().for_each(|v| is_shared[*v as usize] = true);
            let bounds = Bounds::of(&face.map(|v| net.points[v as usize]));
            partition.each_meeting(&bounds, &mut |cell| obstacles[cell].push(f as u32));
            for k in 0..3 {
                let ends = [face[k], face[(k + 1) % 3]];
                let [from, to] = ends.map(|v| seats[v as usize]);
                if from.cell == to.cell {
                    outer[from.cell as usize].push([from.place.min(to.place), from.place.max(to.place)]);
                }
            }
        }
        outer.iter_mut().for_each(|edges| edges.sort_unstable());
        Self { is_shared, obstacles, outer }
    }
}

/// The goal of a round.
#[derive(Clone, Copy, Debug)]
pub(super) struct Goal {
    /// Triangles of the whole mesh.
    pub(super) triangles: usize,
    /// How many times as many are left of those that a round may change, if it is more than one.
    pub(super) margin: f64,
}

/// The outcome of a round.
pub(super) struct Round {
    /// The number in the new mesh that each vertex has become.
    pub(super) became: Vec<u32>,
    /// Cells that had to be done again with a guard.
    pub(super) redone: usize,
    /// Why edges were left alone.
    pub(super) barred: Barred,
    /// About as many triangles are left in cells as the goal wants, not more.
    pub(super) is_reached: bool,
}

/// Simplifies by one round.
pub(super) fn round(net: &mut Net, rules: Rules, planes: Planes, goal: Goal) -> Round {
    let parted = Parted::new(net, planes);
    let cells = parted.partition.cells.len();
    let mut works: Vec<Work> = (0..cells).into_par_iter().with_max_len(1).map(|c| parted.work(net, c, rules, false)).collect();
    let wanted = wanted(net, &parted, goal);
    advance(&mut works, wanted);
    let live: usize = works.iter().map(|work| work.patch.live).sum();
    let is_reached = live <= wanted + wanted / NEARLY;
    let redone: Vec<bool> = works
        .par_iter_mut()
        .enumerate()
        .with_max_len(1)
        .map_init(Look::default, |look, (c, work)| {
            let is_crossed =
                work.patch.live < parted.faces(c).len() && look.is_crossed(work, parted.vertices(c), &parted.before(net, c));
            if is_crossed {
                let live = work.patch.live;
                *work = parted.work(net, c, rules, true);
                work.advance(BUCKETS, live);
            }
            is_crossed
        })
        .collect();
    let barred = works.iter().fold(Barred::default(), |barred, work| barred.or(work.barred));
    let became = merge(net, &parted, &works);
    // To give memory back takes its time, too.
    works.into_par_iter().for_each(drop);
    Round { became, redone: redone.into_iter().filter(|was| *was).count(), barred, is_reached }
}

/// How many triangles of single cells are to be left. Those whose vertices all stay are not counted on.
fn wanted(net: &Net, parted: &Parted, goal: Goal) -> usize {
    let stays = |f: usize| net.faces[f].iter().all(|v| net.kinds[*v as usize] == FIXED);
    let staying = parted.faces.iter().filter(|f| stays(**f as usize)).count();
    let staying_in_all = (0..net.faces.len()).into_par_iter().filter(|f| stays(*f)).count();
    let (own, all) = (parted.faces.len() - staying, net.faces.len() - staying_in_all);
    let left = goal.triangles.saturating_sub(staying_in_all);
    if own == 0 || own == all {
        return staying + (left as f64 * goal.margin.max(1.0)) as usize;
    }
    let share = own as f64 / all as f64;
    staying + ((left as f64 * share * goal.margin) as usize).max(left.saturating_sub(all - own))
}

/// Advances all cells, at about the same cost, until so many triangles are left in them.
fn advance(works: &mut [Work], wanted: usize) {
    if let [work] = works {
        work.advance(BUCKETS, wanted);
        return;
    }
    // The share of the edges looked at that collapse: the others are stale, or may not.
    let mut yields = FIRST_YIELD;
    for step in 0..STEPS {
        let live: usize = works.iter().map(|work| work.patch.live).sum();
        let Some(excess) = live.checked_sub(wanted).filter(|excess| *excess > 0) else { return };
        let is_last = step + 1 == STEPS || excess < 4 * works.len();
        let rank = (excess as f64 / 2.0 * STEP / yields) as usize;
        let most = if wanted == 0 || is_last { BUCKETS } else { bucket_at(works, rank) };
        let shares: Vec<usize> = works.iter().map(|work| work.counts().take(most + 1).sum()).collect();
        let collapses = in_parts(excess.div_ceil(2), &shares);
        let looked_at: Vec<usize> = works
            .par_iter_mut()
            .with_max_len(1)
            .zip(collapses)
            .map(|(work, collapses)| {
                let least = if wanted == 0 { 0 } else { work.patch.live.saturating_sub(2 * collapses) };
                work.advance(most, least)
            })
            .collect();
        let left: usize = works.iter().map(|work| work.patch.live).sum();
        if is_last || wanted == 0 || (left == live && most == BUCKETS) {
            return;
        }
        let looked_at: usize = looked_at.into_iter().sum();
        yields = ((live - left) as f64 / 2.0 / looked_at.max(1) as f64).clamp(LEAST_YIELD, 1.0);
    }
}

/// The bucket of the edge of this rank in all cells, beyond all of them if there are no more.
fn bucket_at(works: &[Work], rank: usize) -> usize {
    let mut counts = vec![0; BUCKETS];
    works.iter().for_each(|work| counts.iter_mut().zip(work.counts()).for_each(|(sum, count)| *sum += count));
    let mut before = 0;
    let holds = |count: &usize| {
        before += count;
        before > rank
    };
    counts.iter().position(holds).unwrap_or(BUCKETS)
}

/// A number in parts of such shares; their sum is the number, if there is any share.
fn in_parts(number: usize, shares: &[usize]) -> Vec<usize> {
    let sum = shares.iter().sum::<usize>().max(1) as u128;
    let mut before = 0;
    let up_to = |share: usize| (number as u128 * share as u128 / sum) as usize;
    let part = |share: &usize| {
        before += share;
        up_to(before) - up_to(before - share)
    };
    shares.iter().map(part).collect()
}

/// Makes one mesh of all cells and what they share, in the old order. Returns what each old vertex has become.
fn merge(net: &mut Net, parted: &Parted, works: &[Work]) -> Vec<u32> {
    let old = |v: u32| {
        let Seat { cell, place } = parted.seats[v as usize];
        let patch = &works[cell as usize].patch;
        let mut at = place;
        while patch.became[at as usize] != at {
            at = patch.became[at as usize];
        }
        parted.vertices(cell as usize)[at as usize]
    };
    // The vertex that each one has become, by its old number; then by its new one.
    let mut became: Vec<u32> = (0..net.points.len() as u32).into_par_iter().with_min_len(BLOCK).map(old).collect();
    let kept: Vec<u32> = (0..).zip(&became).filter(|(v, became)| *v == **became).map(|(v, _)| v).collect();
    let mut numbers = vec![NONE; became.len()];
    (0..).zip(&kept).for_each(|(number, v)| numbers[*v as usize] = number);
    let face = |f: usize| {
        let Seat { cell, place } = parted.face_seats[f];
        let Some(work) = works.get(cell as usize) else { return Some(net.faces[f].map(|v| numbers[v as usize])) };
        let vertices = parted.vertices(cell as usize);
        let corners = work.patch.face(place as usize);
        (corners[0] != NONE).then(|| corners.map(|v| numbers[vertices[v as usize] as usize]))
    };
    let faces = (0..net.faces.len()).into_par_iter().with_min_len(BLOCK).filter_map(|f| Some((face(f)?, net.origins[f])));
    (net.faces, net.origins) = faces.unzip();
    let of = |v: &u32| {
        let Seat { cell, place } = parted.seats[*v as usize];
        (&works[cell as usize].patch, place as usize)
    };
    let gather = || kept.par_iter().with_min_len(BLOCK);
    net.points = gather().map(|v| of(v).0.points[of(v).1]).collect();
    net.quadrics = gather().map(|v| of(v).0.quadrics[of(v).1]).collect();
    net.strict = gather().map(|v| of(v).0.strict[of(v).1]).collect();
    net.kinds = gather().map(|v| net.kinds[*v as usize]).collect();
    net.homes = gather().map(|v| net.homes[*v as usize]).collect();
    became.par_iter_mut().with_min_len(BLOCK).for_each(|v| *v = numbers[*v as usize]);
    became
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_make_the_whole() {
        assert_eq!(in_parts(7, &[1, 0, 1, 1]), [2, 0, 2, 3]);
        assert_eq!(in_parts(7, &[0, 0]), [0, 0]);
    }
}
