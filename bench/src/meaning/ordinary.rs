//! What any repair has to do every day.

use super::damage::{double, flip, lose, lose_near, lose_some, slivers, somewhere, split_alone};
use super::draft::{Draft, Entry};
use super::mesh::{Mesh, minus, plus, times};
use super::random::Chance;
use super::shapes::{any, beside_of, cuboid, cylinder, edged, farthest, reach, smooth, sphere};

pub(super) const FAMILIES: [Entry; 13] = [
    ("clean", "nothing broken", true, clean),
    ("assembly", "several sound bodies beside each other", true, assembly),
    ("single-triangles", "some triangles lost", true, triangles),
    ("patches-flat", "patches lost of a body with flat sides", true, patches_flat),
    ("patches-round", "patches lost of a round body", true, patches_round),
    ("t-junctions", "edges that only one of their triangles splits", true, junctions),
    ("duplicates", "triangles twice", true, duplicates),
    ("slivers", "triangles without area", true, no_area),
    ("overlapping", "bodies that go through each other", true, overlapping),
    ("overlapping-holes", "the same, triangles lost", true, overlapping_holes),
    ("touching", "bodies that touch in a vertex or along an edge", true, touching),
    ("mixed", "a little of each", true, mixed),
    ("mixed-assembly", "several bodies, a little of each", true, mixed_assembly),
];

fn clean(chance: &mut Chance) -> Draft {
    let body = any(chance);
    Draft::of(body.clone(), body)
}

/// Bodies in a row.
fn row(chance: &mut Chance) -> (Mesh, u64) {
    let mut all = any(chance);
    let count = chance.count(2, 5);
    for _ in 1..count {
        let body = any(chance);
        let gap = chance.scale(0.05, 10.0);
        all = all.and(&beside_of(&body, &all, gap));
    }
    (all, count as u64)
}

fn assembly(chance: &mut Chance) -> Draft {
    let (all, count) = row(chance);
    Draft::of(all.clone(), all).bodies(count..=count)
}

fn triangles(chance: &mut Chance) -> Draft {
    let body = any(chance);
    let count = chance.count(1, 6);
    Draft::of(lose_some(chance, &body, count), body).within(0.02)
}

/// One to three patches, or at least a triangle.
fn patches(chance: &mut Chance, body: &Mesh) -> Mesh {
    let mut damaged = body.clone();
    for _ in 0..chance.count(1, 3) {
        let place = somewhere(chance, body);
        damaged = lose_near(&damaged, place, reach(body) * chance.from(0.2, 0.45));
    }
    if damaged.0.len() == body.0.len() { lose_some(chance, body, 1) } else { damaged }
}

fn patches_flat(chance: &mut Chance) -> Draft {
    // Away from edges, where a flat patch is the whole truth.
    let size = std::array::from_fn(|_| chance.from(10.0, 30.0));
    let body = cuboid([0.0; 3], size).finer(chance.from(1.5, 3.0));
    let axis = chance.count(0, 2);
    let place = std::array::from_fn(|k| if k == axis { chance.one(&[0.0, size[k]]) } else { size[k] * chance.from(0.4, 0.6) });
    let least = (0..3).filter(|&k| k != axis).map(|k| size[k]).fold(f64::INFINITY, f64::min);
    let damaged = lose_near(&body, place, least * chance.from(0.15, 0.3));
    Draft::of(damaged, body)
}

fn patches_round(chance: &mut Chance) -> Draft {
    let body = smooth(chance).finer(3.0);
    Draft::of(patches(chance, &body), body).within(0.03)
}

fn junctions(chance: &mut Chance) -> Draft {
    let body = any(chance);
    let share = chance.scale(0.01, 0.5);
    Draft::of(split_alone(chance, &body, share), body)
}

fn duplicates(chance: &mut Chance) -> Draft {
    let body = any(chance);
    let share = chance.scale(0.01, 1.0);
    let damaged = double(chance, &body, share, 0.0);
    let turned = chance.is(0.3);
    let extra = Mesh(damaged.0.iter().skip(1).step_by(37).map(|face| if turned { face.turned() } else { *face }).collect());
    Draft::of(damaged.and(&extra), body)
}

fn no_area(chance: &mut Chance) -> Draft {
    let body = any(chance);
    let share = chance.scale(0.01, 0.5);
    Draft::of(slivers(chance, &body, share), body).with_slivers()
}

/// Two or three bodies, each a little within the last one.
fn overlap(chance: &mut Chance) -> (Mesh, u64) {
    let mut all = any(chance);
    let count = chance.count(2, 3);
    let mut last = all.clone();
    for _ in 1..count {
        let body = match chance.count(0, 2) {
            0 => any(chance),
            1 => sphere(chance.from(4.0, 8.0), 20),
            _ => cylinder(chance.from(2.0, 5.0), -15.0, 15.0, 20),
        };
        let to = chance.direction();
        let (out, back) = (farthest(&last, to), farthest(&body, times(to, -1.0)));
        let depth = reach(&last).min(reach(&body)) * chance.from(0.2, 1.0);
        let by = minus(minus(out, back), times(to, depth));
        last = body.moved(by);
        all = all.and(&last);
    }
    (all, count as u64)
}

fn overlapping(chance: &mut Chance) -> Draft {
    let (all, count) = overlap(chance);
    Draft::of(all.clone(), all).bodies(1..=count)
}

fn overlapping_holes(chance: &mut Chance) -> Draft {
    let (all, count) = overlap(chance);
    let lost = chance.count(1, 5);
    Draft::of(lose_some(chance, &all, lost), all).within(0.02).bodies(1..=count)
}

fn touching(chance: &mut Chance) -> Draft {
    let size: [f64; 3] = std::array::from_fn(|_| chance.from(5.0, 15.0));
    let fine = chance.from(3.0, 10.0);
    let first = cuboid([0.0; 3], size).finer(fine);
    let by = if chance.is(0.5) { size } else { [size[0], size[1], 0.0] };
    let all = first.and(&first.moved(by));
    Draft::of(all.clone(), all).bodies(1..=2)
}

/// A little of each that leaves the shape as it is.
fn worn(chance: &mut Chance, body: &Mesh) -> Mesh {
    let mut damaged = split_alone(chance, body, 0.01);
    damaged = double(chance, &damaged, 0.02, 0.0);
    damaged = flip(chance, &damaged, 0.05);
    let place = somewhere(chance, &damaged);
    let step = times(chance.direction(), 0.3);
    damaged = lose_near(&damaged, plus(place, step), reach(body) * 0.2);
    lose(chance, &damaged, 0.004)
}

fn mixed(chance: &mut Chance) -> Draft {
    let body = if chance.is(0.5) { edged(chance) } else { smooth(chance) };
    Draft::of(worn(chance, &body), body).within(0.03)
}

fn mixed_assembly(chance: &mut Chance) -> Draft {
    let (all, count) = row(chance);
    Draft::of(worn(chance, &all), all).within(0.03).bodies(count..=count)
}
