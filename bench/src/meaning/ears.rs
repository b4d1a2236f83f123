//! Triangles of a polygon with holes, by clipping ears. O(n³) at worst, for outlines of some dozens of points.

type P = [f64; 2];

fn area(a: P, b: P, c: P) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Twice the signed area of a loop.
#[cfg(test)]
fn loop_area(points: &[P]) -> f64 {
    (0..points.len()).map(|i| area([0.0; 2], points[i], points[(i + 1) % points.len()])).sum()
}

fn crosses(a: P, b: P, c: P, d: P) -> bool {
    area(a, b, c) * area(a, b, d) < 0.0 && area(c, d, a) * area(c, d, b) < 0.0
}

/// Triangles (as points) of an outline that runs counterclockwise, with holes that run clockwise.
pub(super) fn triangles(outline: &[P], holes: &[Vec<P>]) -> Vec<[P; 3]> {
    let mut ring = outline.to_vec();
    let mut left: Vec<&Vec<P>> = holes.iter().collect();
    let rightmost = |hole: &&Vec<P>| hole.iter().map(|p| p[0]).fold(f64::NEG_INFINITY, f64::max);
    left.sort_by(|a, b| rightmost(b).total_cmp(&rightmost(a)));
    while !left.is_empty() {
        let hole = left.remove(0);
        let (at, from) = bridge(&ring, hole, &left);
        let around = (0..=hole.len()).map(|k| hole[(from + k) % hole.len()]);
        let inserted: Vec<P> = around.chain([ring[at]]).collect();
        ring.splice(at + 1..at + 1, inserted);
    }
    clip(ring)
}

/// The shortest segment from the ring to a hole that crosses nothing.
fn bridge(ring: &[P], hole: &[P], others: &[&Vec<P>]) -> (usize, usize) {
    let mut pairs: Vec<_> = (0..ring.len()).flat_map(|i| (0..hole.len()).map(move |j| (i, j))).collect();
    let far = |&(i, j): &(usize, usize)| (ring[i][0] - hole[j][0]).powi(2) + (ring[i][1] - hole[j][1]).powi(2);
    pairs.sort_by(|a, b| far(a).total_cmp(&far(b)).then(a.cmp(b)));
    let free = |&&(i, j): &&(usize, usize)| {
        let all = [ring, hole].into_iter().chain(others.iter().map(|other| &other[..]));
        all.flat_map(|points| (0..points.len()).map(|k| (points[k], points[(k + 1) % points.len()])))
            .all(|(a, b)| !crosses(ring[i], hole[j], a, b))
    };
    pairs.iter().find(free).copied().unwrap_or((0, 0))
}

/// The smallest angle's measure: height over the longest side.
fn shape(a: P, b: P, c: P) -> f64 {
    let side = |a: P, b: P| (a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2);
    area(a, b, c) / side(a, b).max(side(b, c)).max(side(c, a))
}

fn clip(mut ring: Vec<P>) -> Vec<[P; 3]> {
    let mut found = Vec::new();
    while ring.len() > 3 {
        let count = ring.len();
        let ear = |i: usize| [ring[(i + count - 1) % count], ring[i], ring[(i + 1) % count]];
        let is_free = |i: usize| {
            let [a, b, c] = ear(i);
            let inside = |p: P| area(a, b, p) >= 0.0 && area(b, c, p) >= 0.0 && area(c, a, p) >= 0.0;
            area(a, b, c) > 0.0 && ring.iter().all(|&p| p == a || p == b || p == c || !inside(p))
        };
        let quality = |i: usize| {
            let [a, b, c] = ear(i);
            shape(a, b, c)
        };
        let best = (0..count).filter(|&i| is_free(i)).max_by(|&a, &b| quality(a).total_cmp(&quality(b)).then(b.cmp(&a)));
        let Some(best) = best else { break };
        found.push(ear(best));
        ring.remove(best);
    }
    found.extend(<[P; 3]>::try_from(ring).ok());
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_triangles_cover_the_polygon_once() {
        let square = [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]];
        let holes = [vec![[1.0, 1.0], [1.0, 2.0], [2.0, 1.5]], vec![[2.5, 2.5], [2.5, 3.5], [3.5, 3.5], [3.5, 2.5]]];
        let found = triangles(&square, &holes);
        assert!(found.iter().all(|t| area(t[0], t[1], t[2]) > 0.0));
        let all: f64 = found.iter().map(|t| area(t[0], t[1], t[2])).sum();
        let wanted = loop_area(&square) + holes.iter().map(|hole| loop_area(hole)).sum::<f64>();
        assert!((all - wanted).abs() < 1e-12 && found.len() == 11 + 2 * 2 - 2, "{all} {wanted} {}", found.len());
    }
}
