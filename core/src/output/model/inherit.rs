//! Attributes of triangles that are not those of the input as they were: turned, cut, or new.

use super::elements::{Element, local};
use crate::attributes::paint::Paint;
use crate::io::record::Point;

/// Attributes whose values are paint: PrusaSlicer's, then those of OrcaSlicer and Bambu Studio.
const PAINTS: [&[u8]; 8] = [
    b"custom_supports",
    b"custom_seam",
    b"mmu_segmentation",
    b"fuzzy_skin",
    b"paint_supports",
    b"paint_seam",
    b"paint_color",
    b"paint_fuzzy_skin",
];

/// An attribute by its name with prefix, and its value as it stands in the text.
pub(crate) type Attribute = (Vec<u8>, Vec<u8>);

/// Attributes of a triangle, and whether they say of each place of it what the input's said there.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Inherited {
    pub(crate) attributes: Vec<Attribute>,
    pub(crate) is_exact: bool,
}

/// Is the value of this attribute paint?
pub(crate) fn is_paint(name: &[u8]) -> bool {
    PAINTS.contains(&local(name))
}

/// The paint of a value, if it is one.
pub(crate) fn paint(value: &[u8]) -> Option<Paint> {
    Paint::parse(std::str::from_utf8(value).ok()?)
}

/// As they are.
pub(crate) fn all(element: &Element<'_>) -> Vec<Attribute> {
    element.attributes.iter().map(|(name, value)| (name.to_vec(), value.to_vec())).collect()
}

/// Those of the triangle with its second and third corner swapped.
pub(crate) fn turned(element: &Element<'_>) -> Inherited {
    let [first, second, third] = properties(element);
    let mut is_exact = true;
    let mut attributes = Vec::new();
    for (name, value) in &element.attributes {
        let value = match local(name) {
            b"p2" => third.unwrap_or(value).to_vec(),
            b"p3" => second.unwrap_or(value).to_vec(),
            _ if is_paint(name) => match paint(value) {
                Some(paint) => paint.mirrored().to_text().into_bytes(),
                None => {
                    is_exact = false;
                    value.to_vec()
                }
            },
            _ => value.to_vec(),
        };
        attributes.push((name.to_vec(), value));
    }
    // A property that is not given is the first one: swapped, it has to be said.
    let given = |name: &[u8]| element.value(name).is_some();
    if let (Some(first), true) = (first, given(b"p2") != given(b"p3")) {
        let missing: &[u8] = if given(b"p2") { b"p3" } else { b"p2" };
        let value = if given(b"p2") { second } else { third };
        attributes.push((missing.to_vec(), value.unwrap_or(first).to_vec()));
    }
    Inherited { attributes, is_exact }
}

/// Those of a part of the triangle, whose corners are given by their weights in it.
pub(crate) fn part(element: &Element<'_>, corners: [[f64; 3]; 3]) -> Inherited {
    let own = properties(element);
    let is_plain = own.iter().all(|property| *property == own[0]);
    let mut inherited = Inherited { attributes: Vec::new(), is_exact: is_plain };
    for (name, value) in &element.attributes {
        let value = match local(name) {
            b"p1" => nearest(own, corners[0]).unwrap_or(value).to_vec(),
            b"p2" => nearest(own, corners[1]).unwrap_or(value).to_vec(),
            b"p3" => nearest(own, corners[2]).unwrap_or(value).to_vec(),
            _ if is_paint(name) => match paint(value) {
                Some(paint) => {
                    let piece = paint.piece(corners);
                    inherited.is_exact &= piece.exact;
                    piece.paint.to_text().into_bytes()
                }
                None => {
                    inherited.is_exact = false;
                    value.to_vec()
                }
            },
            _ => value.to_vec(),
        };
        inherited.attributes.push((name.to_vec(), value));
    }
    // Paint without any state is not written.
    inherited.attributes.retain(|(name, value)| !is_paint(name) || !value.is_empty());
    inherited
}

/// The properties of the three corners; one that is not given is the first.
fn properties<'t>(element: &Element<'t>) -> [Option<&'t [u8]>; 3] {
    let first = element.value(b"p1");
    [first, element.value(b"p2").or(first), element.value(b"p3").or(first)]
}

/// The property of the corner that weighs most; the first of equals.
fn nearest(own: [Option<&[u8]>; 3], [a, b, c]: [f64; 3]) -> Option<&[u8]> {
    if a >= b && a >= c {
        own[0]
    } else if b >= c {
        own[1]
    } else {
        own[2]
    }
}

/// The weights of a triangle's corners at a place in its plane; a triangle without area has only its first corner.
pub(crate) fn weights([a, b, c]: [Point; 3], place: Point) -> [f64; 3] {
    let from_a = |p: Point| [0, 1, 2].map(|k| f64::from(p[k]) - f64::from(a[k]));
    let dot = |u: [f64; 3], v: [f64; 3]| u[0] * v[0] + u[1] * v[1] + u[2] * v[2];
    let (u, v, p) = (from_a(b), from_a(c), from_a(place));
    let (uu, uv, vv, pu, pv) = (dot(u, u), dot(u, v), dot(v, v), dot(p, u), dot(p, v));
    let area = uu * vv - uv * uv;
    if area <= 0.0 || !area.is_finite() {
        return [1.0, 0.0, 0.0];
    }
    let (second, third) = ((vv * pu - uv * pv) / area, (uu * pv - uv * pu) / area);
    [1.0 - second - third, second, third]
}

#[cfg(test)]
mod tests {
    use super::super::elements::Elements;
    use super::*;

    fn element(text: &str) -> Element<'_> {
        Elements::within(text.as_bytes(), 0..text.len()).next().unwrap()
    }

    fn shown(inherited: &Inherited) -> String {
        let word = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        inherited.attributes.iter().map(|(name, value)| format!("{}={} ", word(name), word(value))).collect()
    }

    #[test]
    fn colours_of_corners_go_with_their_corners() {
        let gradient = element("<triangle v1='0' v2='1' v3='2' pid='1' p1='7' p2='8' p3='9'/>");
        assert_eq!(shown(&turned(&gradient)), "pid=1 p1=7 p2=9 p3=8 ");
        let half = element("<triangle v1='0' v2='1' v3='2' pid='1' p1='7' p2='8'/>");
        assert_eq!(shown(&turned(&half)), "pid=1 p1=7 p2=7 p3=8 ");
        // The corners of a piece near the third, the first and the second corner.
        let corners = [[0.1, 0.1, 0.8], [0.9, 0.1, 0.0], [0.2, 0.5, 0.3]];
        assert_eq!(part(&gradient, corners), Inherited { is_exact: false, ..part(&gradient, corners) });
        assert_eq!(shown(&part(&gradient, corners)), "pid=1 p1=9 p2=7 p3=8 ");
        let plain = element("<triangle v1='0' v2='1' v3='2' pid='1' p1='7' other='x'/>");
        assert_eq!((shown(&part(&plain, corners)), part(&plain, corners).is_exact), ("pid=1 p1=7 other=x ".into(), true));
    }

    #[test]
    fn paint_of_one_state_is_that_of_each_piece() {
        let painted = element("<triangle v1='0' v2='1' v3='2' slic3rpe:mmu_segmentation='8'/>");
        let corners = [[1.0, 0.0, 0.0], [0.5, 0.5, 0.0], [0.3, 0.3, 0.4]];
        for inherited in [turned(&painted), part(&painted, corners)] {
            assert_eq!((shown(&inherited), inherited.is_exact), ("slic3rpe:mmu_segmentation=8 ".into(), true));
        }
        let odd = element("<triangle v1='0' v2='1' v3='2' paint_color='no paint'/>");
        assert!(!turned(&odd).is_exact && shown(&turned(&odd)) == "paint_color=no paint ");
    }

    #[test]
    fn weights_are_those_of_the_plane() {
        let triangle = [[0.0; 3], [2.0, 0.0, 0.0], [0.0, 4.0, 0.0]];
        assert_eq!(weights(triangle, [0.5, 1.0, 0.0]), [0.5, 0.25, 0.25]);
        assert_eq!(weights([[1.0; 3]; 3], [1.0; 3]), [1.0, 0.0, 0.0]);
    }
}
