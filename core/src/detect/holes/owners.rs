//! Whose loops these are: the pieces of surface that they belong to, and which of these can stand for themselves.
//!
//! A piece stands for itself if its own patches make a body of it that has room inside, and are small for its surface: a box without its lid does, a
//! sheet, one face of a box or half of a ball do not. What joins two such pieces is a guess, since each may have been a body of its own.

use glam::DVec3;

use super::loops::Loop;
use crate::submesh::components::{Components, Reversed, Through};
use crate::submesh::edges::Edges;
use crate::submesh::{Submesh, Vertex};
use crate::topology::survey::Survey;
use crate::util::ids::NONE;

/// A piece that is closed by its own patches encloses at least this share of its size to have room inside: the root of the area of one
/// side, cubed. A plate that rises by a fiftieth of its width on average.
const ROOM: f64 = 0.02;
/// Patches of a piece that stands for itself have no more than this share of the area of its surface: those of half a ball have half of it.
const PATCHED: f64 = 0.4;

/// An opening is no detail of its piece from this share of the piece's size on: the cube root of its volume, squared.
const LARGE: f64 = 0.1;

/// A piece of less than this share of all area is a detail, like a screw in a frame: nobody need look at whether it became one with others.
const DETAIL: f64 = 0.005;

/// The owners of some loops, by loop.
#[derive(Clone, Debug, Default)]
pub(crate) struct Owners {
    of_loop: Vec<u32>,
    /// The volume that the piece encloses once it is closed, by piece.
    volumes: Vec<f64>,
    /// The way that the piece's surface faces: 1 outward, -1 inward, as the largest one faces outward; 0: it does not stand for itself. By piece.
    stands: Vec<i8>,
    /// By piece.
    is_detail: Vec<bool>,
}

impl Owners {
    /// O(regions + submesh).
    pub(crate) fn of(survey: &Survey<'_>, submesh: &Submesh, edges: &Edges, reversed: &Reversed, loops: &[Loop]) -> Self {
        let components = Components::of(survey, submesh, edges, reversed, Through::EveryEdge);
        let of_loop: Vec<u32> = loops.iter().map(|rim| components.of_triangle[rim.triangles[0] as usize]).collect();
        let (measure, middle) = (&survey.measure, survey.measure.middle());
        let mut patches = vec![(0.0, 0.0); components.list.len()];
        for (rim, owner) in loops.iter().zip(&of_loop).filter(|(_, owner)| **owner != NONE) {
            let (volume, area) = fan(submesh, &rim.vertices, middle);
            let sum = &mut patches[*owner as usize];
            *sum = (sum.0 + volume, sum.1 + area);
        }
        let closed: Vec<(f64, f64, f64)> = components
            .list
            .iter()
            .zip(patches)
            .map(|(c, (volume, patched))| (measure.volume(c.extent) + volume, measure.area(c.extent), patched))
            .collect();
        let largest = closed.iter().map(|c| c.0).max_by(|a, b| a.abs().total_cmp(&b.abs())).unwrap_or(0.0);
        let volumes = closed.iter().map(|c| c.0.abs()).collect();
        let is_detail = are_details(closed.iter().map(|c| c.1));
        let stands = closed
            .into_iter()
            .map(|(volume, area, patched)| match stands_for_itself(volume, area, patched) {
                true if (volume > 0.0) == (largest > 0.0) => 1,
                true => -1,
                false => 0,
            })
            .collect();
        Self { of_loop, volumes, stands, is_detail }
    }

    /// All loops are of one piece.
    pub(crate) fn one(loops: usize) -> Self {
        Self { of_loop: vec![0; loops], volumes: vec![0.0], stands: vec![0], is_detail: vec![false] }
    }

    /// Do two loops, by number, belong to one piece?
    pub(crate) fn are_same(&self, a: usize, b: usize) -> bool {
        self.of_loop[a] == self.of_loop[b] && self.of_loop[a] != NONE
    }

    /// Do they belong to different ones, and do both of these stand for themselves, with material inside? (What faces inward is the wall of a cavity in another one.)
    pub(crate) fn are_bodies(&self, a: usize, b: usize) -> bool {
        !self.are_same(a, b) && [a, b].into_iter().all(|i| self.way(i) == 1)
    }

    /// Are they such bodies, and neither of them a detail?
    pub(crate) fn are_large_bodies(&self, a: usize, b: usize) -> bool {
        self.are_bodies(a, b) && [a, b].into_iter().all(|i| self.is_detail.get(self.of_loop[i] as usize) == Some(&false))
    }

    /// Do they belong to different ones, and do both of these stand for themselves, whichever way they face?
    pub(crate) fn stand(&self, a: usize, b: usize) -> bool {
        !self.are_same(a, b) && [a, b].into_iter().all(|i| self.way(i) != 0)
    }

    /// Is an opening of this area no detail of the piece that the loop belongs to? Of a cube its side is as large as the cube's size, of a shaft of
    /// thirty times its radius its end has an eighth of that.
    pub(crate) fn is_large(&self, i: usize, area: f64) -> bool {
        is_large(area, self.volumes.get(self.of_loop[i] as usize).copied().unwrap_or(0.0))
    }

    fn way(&self, i: usize) -> i8 {
        self.stands.get(self.of_loop[i] as usize).copied().unwrap_or(0)
    }
}

/// Is an opening of this area no detail of a piece of this volume? As [`Owners::is_large`].
pub(crate) fn is_large(area: f64, volume: f64) -> bool {
    // area³ of volume², so as to take no cube root.
    area.powi(3) >= LARGE.powi(3) * volume * volume
}

/// Of pieces of these areas, those that are details.
pub(crate) fn are_details(areas: impl Iterator<Item = f64> + Clone) -> Vec<bool> {
    let all: f64 = areas.clone().sum();
    areas.map(|area| area < DETAIL * all).collect()
}

/// Does a piece of this area stand for itself that encloses this volume with patches of so much area more?
pub(crate) fn stands_for_itself(volume: f64, area: f64, patched: f64) -> bool {
    let size = ((area + patched) / 2.0).powi(3).sqrt();
    volume.abs() >= ROOM * size && patched <= PATCHED * area
}

/// Volume under a fan over a loop, seen from a point, and its area.
pub(crate) fn fan(submesh: &Submesh, way: &[Vertex], from: DVec3) -> (f64, f64) {
    let n = way.len();
    let centre = way.iter().map(|v| submesh.place(*v)).sum::<DVec3>() / n as f64;
    let (mut volume, mut area) = (0.0, 0.0);
    for i in 0..n {
        let [a, b] = [i, (i + 1) % n].map(|k| submesh.place(way[k]));
        let normal = (a - centre).cross(b - centre);
        volume += (centre - from).dot(normal) / 6.0;
        area += normal.length() / 2.0;
    }
    (volume, area)
}
