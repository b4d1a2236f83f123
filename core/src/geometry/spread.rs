//! Points spread over triangles by their areas, the same whatever order the triangles are looked at in.

use glam::DVec3;

use crate::geometry::distance::place;
use crate::util::scatter;

/// Points of a triangle, on average one for each such area. A number of the triangle decides where, and what becomes of the rest of the area.
#[inline]
pub(crate) fn points(corners: &[[f32; 3]; 3], number: u32, each: f64) -> impl Iterator<Item = DVec3> {
    let (a, b, c) = (place(corners[0]), place(corners[1]), place(corners[2]));
    let begin = scatter::share(number.into());
    let count = (b - a).cross(c - a).length() / 2.0 / each + begin;
    let count = if count.is_finite() { count as u32 } else { 0 };
    // Roberts' sequence: it fills the square evenly, wherever it ends.
    (1..=count).map(move |i| {
        let along = |step: f64| (begin + step * f64::from(i)).fract();
        let (u, v) = (along(0.754_877_666_246_692_7), along(0.569_840_290_998_053_3));
        let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
        a + (b - a) * u + (c - a) * v
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_are_as_many_as_the_area_asks_for_and_they_lie_on_the_triangle() {
        let corners = [[0.0, 0.0, 5.0], [4.0, 0.0, 5.0], [0.0, 2.0, 5.0]];
        let all: Vec<DVec3> = points(&corners, 7, 0.01).collect();
        assert!((400..=401).contains(&all.len()), "{}", all.len());
        assert!(all.iter().all(|p| p.z == 5.0 && p.x >= 0.0 && p.y >= 0.0 && p.x / 4.0 + p.y / 2.0 <= 1.0 + 1e-12));
        let near_the_tip = all.iter().filter(|p| p.x > 2.0).count();
        assert!((90..=110).contains(&near_the_tip), "a quarter of the area: {near_the_tip}");
    }

    #[test]
    fn many_small_triangles_have_points_by_their_area_together() {
        let corners = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let count = (0..10_000).flat_map(|number| points(&corners, number, 20.0)).count();
        assert!((200..300).contains(&count), "10,000 times 0.5 by 20 is 250: {count}");
        assert_eq!(points(&[[f32::NAN; 3]; 3], 1, 1.0).count() + points(&corners, 1, 0.0).count(), 0);
    }
}
