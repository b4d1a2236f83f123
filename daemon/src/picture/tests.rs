use suture_core::record::encode;

use super::*;

/// A tetrahedron on the axes: the face that looks to (1, 1, 1), and the three others.
fn faces() -> Vec<Record> {
    let [o, x, y, z] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    [[x, y, z], [o, y, x], [o, z, y], [o, x, z]].map(|corners| encode(corners, 0)).into()
}

fn options(threads: usize) -> Options {
    Options { size: (64, 48), eye: Some(Eye { around: 45.0, above: 35.0 }), behind: false, threads, memory: 1 << 20 }
}

/// How many pixels are about of a colour.
fn count(picture: &Picture, like: impl Fn([u8; 3]) -> bool) -> usize {
    picture.pixels.iter().filter(|p| like(**p)).count()
}

fn is_grey([r, _, b]: [u8; 3]) -> bool {
    r < b
}

fn is_orange([r, g, b]: [u8; 3]) -> bool {
    r > 150 && g > 60 && b < 100
}

fn is_red([r, g, b]: [u8; 3]) -> bool {
    r > 180 && g < 60 && b < 80
}

fn is_green([r, g, b]: [u8; 3]) -> bool {
    g > r && g > b
}

fn is_violet([r, g, b]: [u8; 3]) -> bool {
    b > r && r > g && b - g > 40
}

#[test]
fn the_outside_is_grey_the_inside_orange_and_the_rest_white() {
    let whole = draw(&[&faces()], &options(1)).unwrap();
    assert!(is_grey(whole.pixels[26 * 64 + 32]), "{:?}", whole.pixels[26 * 64 + 32]);
    assert_eq!((whole.pixels[0], whole.one_in), ([255; 3], 1));
    assert_eq!(count(&whole, is_red) + count(&whole, is_orange), 0);
    // Without the nearest face one looks into it, and its three edges have one triangle.
    let open = draw(&[&faces()[1..]], &options(1)).unwrap();
    assert!(count(&open, is_orange) > 300 && count(&open, is_red) > 30);
}

#[test]
fn of_two_meshes_one_sees_what_goes_and_what_is_new() {
    let before = faces()[1..].to_vec();
    let after = faces();
    let pair = draw(&[&before, &after], &options(1)).unwrap();
    assert_eq!(pair.width, 128);
    assert!(count(&pair, is_green) > 300, "the new face");
    let back = draw(&[&after, &before], &options(1)).unwrap();
    assert!(count(&back, is_violet) > 300 && count(&back, is_green) == 0, "the face that goes");
}

/// Seen from behind, the new face would not be.
#[test]
fn the_camera_stands_where_most_changes_are_seen() {
    let (mut before, after) = (faces(), faces());
    for k in 0..4 {
        let changed = before.remove(k);
        let pair = draw(&[&before, &after], &Options { eye: None, ..options(2) }).unwrap();
        // Of the three on the axes, the one below is seen from below.
        assert!(count(&pair, is_green) > 50, "face {k}");
        before.insert(k, changed);
    }
}

#[test]
fn the_same_picture_whatever_the_threads() {
    // A fan of slivers through each other: many ties and near ties of depth.
    let spoke = |i: u32| {
        let angle = f64::from(i) * 0.37;
        let tip = [angle.cos() as f32, angle.sin() as f32, (0.1 * (angle * 3.0).sin()) as f32];
        encode([[0.0; 3], tip, [tip[1], -tip[0], tip[2]]], 0)
    };
    let records: Vec<Record> = (0..500).map(spoke).collect();
    let one = draw(&[&records, &records[3..]], &options(1)).unwrap();
    for threads in [2, 3, 7] {
        assert_eq!(one, draw(&[&records, &records[3..]], &options(threads)).unwrap(), "{threads} threads");
    }
}

#[test]
fn no_numbers_break_it() {
    let odd = [f32::NAN, f32::INFINITY, f32::MAX, -f32::MAX, f32::MIN_POSITIVE, 0.0, -0.0, 1e30];
    let mut records = Vec::new();
    for (i, a) in odd.iter().enumerate() {
        for b in odd {
            records.push(encode([[*a, b, 0.0], [b, 1.0, *a], [odd[i % 3], *a, b]], 0));
        }
    }
    draw(&[&records], &options(2)).unwrap();
    let flat = [encode([[0.0; 3]; 3], 0)];
    assert_eq!(count(&draw(&[&flat], &options(1)).unwrap(), |p| p != [255; 3]), 0);
    assert_eq!(draw(&[&records[..1]], &options(1)), None, "nothing is finite");
    assert_eq!(draw(&[&[]], &options(1)), None);
}

/// Each triangle fills the picture: one in some is drawn, and said so.
#[test]
fn very_much_to_fill_is_bounded() {
    let records = vec![encode([[-9.0, -9.0, 0.0], [9.0, -9.0, 0.0], [0.0, 9.0, 0.0]], 0); 60_000];
    let large = Options { size: (800, 600), eye: Some(Eye { around: 0.0, above: 90.0 }), behind: false, threads: 2, memory: 0 };
    assert!(draw(&[&records], &large).unwrap().one_in > 10);
}

#[test]
fn a_png_is_read_back() {
    let picture = draw(&[&faces()], &options(1)).unwrap();
    let bytes = picture.png().unwrap();
    let mut reader = png::Decoder::new(io::Cursor::new(bytes)).read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut pixels).unwrap();
    assert_eq!(pixels, picture.pixels.as_flattened());
}

/// Without the face that looks to (1, 1, 1): from there one looks into it, from behind one does not.
#[test]
fn from_the_opposite_side_one_sees_the_other_faces() {
    let open = &faces()[1..];
    let of = |behind: bool| draw(&[open], &Options { behind, ..options(1) }).unwrap();
    let seen = [false, true].map(|behind| count(&of(behind), is_orange));
    assert!(seen[0] > 300 && seen[1] < 30, "{seen:?}");
    assert!(count(&of(true), is_grey) > 300);
}

/// A square of lines, one of them of no surface, and the square as two triangles.
#[test]
fn curves_are_drawn_in_their_colours_beside_their_mesh() {
    let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
    let mark = |k: usize| if k == 0 { Mark::Left } else { Mark::Bounds };
    let strokes: Vec<Stroke> = (0..4).map(|k| Stroke { points: vec![corners[k], corners[(k + 1) % 4]], mark: mark(k) }).collect();
    let mesh = [[0, 1, 2], [0, 2, 3]].map(|face: [usize; 3]| encode(face.map(|k| corners[k]), 0));
    let eye = Some(Eye { around: -90.0, above: 90.0 });
    let options = Options { size: (100, 100), eye, behind: false, threads: 1, memory: 1 << 30 };
    let picture = draw_curves(&strokes, &mesh, &options).unwrap();
    let at = |x: usize, y: usize| picture.pixels[y * 200 + x];
    assert_eq!((picture.width, picture.height), (200, 100));
    // The left panel is paper within its lines, the right one is not.
    assert_eq!(at(50, 50), [255; 3]);
    assert!(at(150, 50)[0] < 250);
    // Lines share their pixels with paper.
    let has = |is_painted: fn([u8; 3]) -> bool, from: usize| (0..100).any(|y| (from..from + 100).any(|x| is_painted(at(x, y))));
    let is_red = |[red, green, _]: [u8; 3]| red > 200 && green < 130;
    let is_dark = |[red, _, blue]: [u8; 3]| red < 140 && blue < 170;
    assert!(has(is_red, 0) && has(is_dark, 0) && has(is_dark, 100));
    assert!(draw_curves(&[], &[], &options).is_none());
}
