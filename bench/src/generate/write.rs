//! The stream of records: counted in a first pass over the damaged cells alone, written in a second.

use std::collections::BTreeMap;
use std::io::Write;

use super::case::{Case, Density, Error, Result, Truth};
use super::cell::{Cell, cross, dot, minus};
use super::defect::Kind;
use super::noise::{Permutation, Random, hash, noise, turn};
use super::surface::{CELL_TRIANGLES, Ring, Triangle, on_grid};
use crate::counts::Counts;

pub(super) fn write((case, density): (Case, Density), triangles: u64, seed: u64, out: &mut impl Write) -> Result<Truth> {
    match case {
        Case::HugeFan => huge_fan(triangles, seed, out),
        Case::Shuffled => shuffled(triangles, seed, out),
        Case::TwoBodies => {
            let half = triangles / 2;
            let bodies = [(Ring::new(half, seed, 0.0), &[] as &[Kind]), (Ring::new(half, seed ^ 1, 110.0), case.kinds())];
            rings((case, density), seed, &bodies, out)
        }
        _ => rings((case, density), seed, &[(Ring::new(triangles, seed, 0.0), case.kinds())], out),
    }
}

/// Binary STL, record by record.
struct Stl<'a, W> {
    out: &'a mut W,
    buffer: Vec<u8>,
    written: u64,
    volume: f64,
}

impl<'a, W: Write> Stl<'a, W> {
    const FLUSH: usize = 1 << 20;

    fn begin(out: &'a mut W, case: Case, seed: u64, triangles: u64) -> Result<Self> {
        let count = u32::try_from(triangles).map_err(|_| Error::TooMany { triangles })?;
        let mut buffer = Vec::with_capacity(Self::FLUSH + 64);
        buffer.extend_from_slice(format!("{:80.80}", format!("suture-bench {case}, seed {seed}")).as_bytes());
        buffer.extend_from_slice(&count.to_le_bytes());
        Ok(Self { out, buffer, written: 0, volume: 0.0 })
    }

    fn put(&mut self, triangle: &Triangle) -> Result<()> {
        let [a, b, c] = *triangle;
        let normal = cross(minus(b, a), minus(c, a));
        let length = dot(normal, normal).sqrt();
        let scale = if length > 0.0 { 1.0 / length } else { 0.0 };
        let mut record = [0; 50];
        let numbers = normal.iter().map(|x| (x * scale) as f32).chain(triangle.iter().flatten().copied());
        for (bytes, number) in record.chunks_exact_mut(4).zip(numbers) {
            bytes.copy_from_slice(&number.to_le_bytes());
        }
        self.buffer.extend_from_slice(&record);
        self.written += 1;
        if self.buffer.len() >= Self::FLUSH {
            self.out.write_all(&self.buffer)?;
            self.buffer.clear();
        }
        Ok(())
    }

    fn end(self) -> Result<u64> {
        self.out.write_all(&self.buffer)?;
        self.out.flush()?;
        Ok(self.written)
    }
}

/// Six times the volume between a triangle and the origin.
fn six_volumes(triangle: &Triangle) -> f64 {
    let [a, b, c] = triangle.map(|p| p.map(f64::from));
    dot(a, cross(b, c))
}

/// Which cells are damaged, and how: one in each group of neighbours.
struct Sites {
    kinds: &'static [Kind],
    seed: u64,
    cells: u64,
    group: u64,
}

impl Sites {
    /// One for so many cells as `density` says, more in files too small to show every kind.
    fn new(kinds: &'static [Kind], seed: u64, cells: u64, density: Density) -> Self {
        let wanted = 4.max(kinds.len() as u64);
        Self { kinds, seed, cells, group: (cells / wanted).clamp(1, density.cells_per_defect()) }
    }

    /// The defect of a cell, with the randomness that shapes it.
    fn at(&self, cell: u64) -> Option<(Kind, Random)> {
        let group = cell / self.group;
        let start = group * self.group;
        let size = self.group.min(self.cells - start);
        let kind = *self.kinds.get((group % self.kinds.len().max(1) as u64) as usize)?;
        (cell - start == hash(self.seed, group) % size).then(|| (kind, Random::new(self.seed ^ 0x5172, cell)))
    }
}

/// Rings with local defects, and the cases that treat every triangle alike.
fn rings((case, density): (Case, Density), seed: u64, bodies: &[(Ring, &'static [Kind])], out: &mut impl Write) -> Result<Truth> {
    let mut truth = Truth {
        case,
        seed,
        counts: Counts { components: bodies.len() as u64, ..Counts::default() },
        injected: BTreeMap::new(),
        sound: Vec::new(),
        volume: 0.0,
        bodies: bodies.len() as u64,
        extra_bodies: 0,
    };
    let bodies: Vec<_> = bodies.iter().map(|(ring, kinds)| (ring, Sites::new(kinds, seed, ring.cells(), density))).collect();
    for (ring, sites) in &bodies {
        count_damage(ring, sites, &mut truth);
    }
    let mut stl = Stl::begin(out, case, seed, truth.counts.triangles)?;
    for (ring, sites) in &bodies {
        let mut cell = Cell::of(ring, 0, 0);
        for number in 0..ring.cells() {
            let (row, column) = place(ring, number);
            cell.move_to(ring, row, column);
            stl.volume += cell.written().map(six_volumes).sum::<f64>();
            let first = stl.written;
            let damage = sites.at(number);
            let damaged = damage.is_some();
            if let Some((kind, mut random)) = damage {
                kind.inflict(&mut cell, &mut random);
            }
            for (index, triangle) in cell.written().enumerate() {
                match case {
                    Case::InsideOut => stl.put(&[triangle[0], triangle[2], triangle[1]])?,
                    Case::Soup => stl.put(&jittered(triangle, index, ring, seed ^ number))?,
                    _ => stl.put(triangle)?,
                }
            }
            if !damaged && !matches!(case, Case::InsideOut | Case::Soup) {
                extend(&mut truth.sound, first, stl.written);
            }
        }
    }
    truth.volume = stl.volume / 6.0;
    let written = stl.end()?;
    debug_assert_eq!(written, truth.counts.triangles);
    if case == Case::Soup {
        truth.counts.boundary_edges = 3 * written;
        truth.counts.unbalanced_edges = 3 * written;
        truth.counts.boundary_loops = written;
        truth.counts.components = written;
        truth.injected.insert("loose triangles", written);
    }
    if case == Case::InsideOut {
        truth.injected.insert("bodies inside out", 1);
    }
    Ok(truth)
}

/// Row and column of a cell.
fn place(ring: &Ring, cell: u64) -> (usize, usize) {
    let cell = cell as usize;
    (cell / ring.cell_columns, cell % ring.cell_columns)
}

/// Joins the records from `first` to before `end` to the ranges so far.
fn extend(ranges: &mut Vec<std::ops::Range<u64>>, first: u64, end: u64) {
    match ranges.last_mut() {
        Some(last) if last.end == first => last.end = end,
        _ => ranges.push(first..end),
    }
}

/// Adds what the sites of one ring do to the truth.
fn count_damage(ring: &Ring, sites: &Sites, truth: &mut Truth) {
    let mut cell = Cell::of(ring, 0, 0);
    for number in 0..ring.cells() {
        let Some((kind, mut random)) = sites.at(number) else {
            truth.counts.triangles += CELL_TRIANGLES;
            continue;
        };
        let (row, column) = place(ring, number);
        cell.move_to(ring, row, column);
        kind.inflict(&mut cell, &mut random);
        truth.counts += Counts { triangles: cell.count(), ..cell.counts };
        *truth.injected.entry(kind.name()).or_default() += 1;
        truth.extra_bodies += u64::from(matches!(kind, Kind::NoiseShell | Kind::TouchingBody));
    }
}

/// A triangle of a sound cell with every corner moved. The six triangles of a vertex move it into six different octants, so
/// that no two of them can meet again by chance.
fn jittered(triangle: &Triangle, index: usize, ring: &Ring, seed: u64) -> Triangle {
    let reach = (ring.spacing() / 200.0).min(1e-4);
    std::array::from_fn(|corner| {
        let octant = index % 2 * 3 + corner;
        std::array::from_fn(|k| {
            let share = 0.625 + 0.375 * noise(seed, (index * 9 + corner * 3 + k) as u64);
            let step = reach * if octant >> k & 1 == 1 { share } else { -share };
            (f64::from(triangle[corner][k]) + step) as f32
        })
    })
}

/// A ring's triangles in random order; the middle quad of a damaged cell is missing.
fn shuffled(triangles: u64, seed: u64, out: &mut impl Write) -> Result<Truth> {
    let ring = Ring::new(triangles, seed, 0.0);
    let sites = Sites::new(&[Kind::Hole], seed, ring.cells(), Density::Sparse);
    let holes = (0..ring.cells()).filter(|&cell| sites.at(cell).is_some()).count() as u64;
    let mut truth = Truth {
        case: Case::Shuffled,
        seed,
        counts: Counts {
            triangles: ring.triangles() - 2 * holes,
            boundary_edges: 4 * holes,
            unbalanced_edges: 4 * holes,
            boundary_loops: holes,
            components: 1,
            ..Counts::default()
        },
        injected: BTreeMap::from([("holes", holes)]),
        sound: std::iter::once(0..ring.triangles() - 2 * holes).collect(),
        volume: 0.0,
        bodies: 1,
        extra_bodies: 0,
    };
    let middle = (super::surface::CELL / 2 * (super::surface::CELL + 1) * 2) as u64;
    let permutation = Permutation::new(seed, ring.triangles());
    let mut stl = Stl::begin(out, Case::Shuffled, seed, truth.counts.triangles)?;
    for position in 0..ring.triangles() {
        let index = permutation.at(position);
        let (i, j, half) = ring.locate(index);
        let triangle = Ring::CORNERS[half].map(|(di, dj)| ring.vertex(i + di, j + dj));
        stl.volume += six_volumes(&triangle);
        let (cell, inside) = (index / CELL_TRIANGLES, index % CELL_TRIANGLES);
        if inside / 2 != middle / 2 || sites.at(cell).is_none() {
            stl.put(&triangle)?;
        }
    }
    truth.volume = stl.volume / 6.0;
    stl.end()?;
    Ok(truth)
}

/// Two tips over a jagged rim, and one triangle missing.
fn huge_fan(triangles: u64, seed: u64, out: &mut impl Write) -> Result<Truth> {
    let rim = (triangles / 2).max(64);
    let mut stl = Stl::begin(out, Case::HugeFan, seed, 2 * rim - 1)?;
    let tips = [[0.0, 0.0, 20.0], [0.0, 0.0, -20.0]];
    let missing = hash(seed, 0) % rim;
    let vertex = |k: u64| {
        // The radius runs to and fro over 64 vertices: neighbours in angle stay apart however many there are.
        let (cos, sin) = turn(k % rim, rim);
        let wave = (k % rim % 64) as f64;
        let radius = 30.0 + wave.min(64.0 - wave) / 4.0 + 0.1 * noise(seed, k % rim);
        [(radius * cos) as f32, (radius * sin) as f32, on_grid(noise(seed ^ 1, k % rim))]
    };
    let mut from = vertex(0);
    for k in 0..rim {
        let to = vertex(k + 1);
        for (triangle, wanted) in [([tips[0], from, to], k != missing), ([tips[1], to, from], true)] {
            stl.volume += six_volumes(&triangle);
            if wanted {
                stl.put(&triangle)?;
            }
        }
        from = to;
    }
    let volume = stl.volume / 6.0;
    let written = stl.end()?;
    Ok(Truth {
        case: Case::HugeFan,
        seed,
        counts: Counts {
            triangles: written,
            boundary_edges: 3,
            boundary_loops: 1,
            unbalanced_edges: 3,
            components: 1,
            ..Counts::default()
        },
        injected: BTreeMap::from([("holes", 1)]),
        sound: std::iter::once(0..written).collect(),
        volume,
        bodies: 1,
        extra_bodies: 0,
    })
}
