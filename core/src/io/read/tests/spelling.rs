//! The same mesh with characters that are cut, and with line ends of all systems in one file.

use super::hostile::{MESH, MODEL, amf, amf_object, object, package_of, triangles};
use super::text::tetrahedron_text;
use super::*;
use crate::io::record::Point;

/// One triangle in each text format, `$` where a name or a comment may stand.
fn forms() -> [(&'static str, String); 5] {
    [
        ("stl", format!("solid $\n{}", tetrahedron_text().split_once('\n').unwrap().1)),
        (
            "ply",
            "ply\nformat ascii 1.0\ncomment $\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n\
             property list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"
                .into(),
        ),
        ("off", "OFF\n# $\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n".into()),
        ("obj", "# $\nv 0 0 0\nv 1 0 0\nv 0 1 0\no $\nf 1 2 3\n".into()),
        ("amf", amf(&amf_object(1)).replace("<object", "<!-- $ -->\n<metadata type=\"name\">$</metadata>\n<object").replace("><", ">\n<")),
    ]
}

fn mesh(bytes: &[u8]) -> Vec<[Point; 3]> {
    triangles(&open(bytes).unwrap_or_else(|error| panic!("{error}: {}", String::from_utf8_lossy(bytes))))
}

#[test]
fn f13_line_ends_of_all_systems_in_one_file() {
    for (name, form) in forms() {
        let plain = mesh(form.as_bytes());
        for first in 0..3 {
            let mut turn = first;
            let mixed: String = form
                .chars()
                .map(|c| {
                    turn += usize::from(c == '\n');
                    if c == '\n' { ["\n", "\r", "\r\n"][turn % 3].to_owned() } else { c.to_string() }
                })
                .collect();
            assert_eq!(mesh(mixed.as_bytes()), plain, "{name} {mixed:?}");
        }
    }
}

#[test]
fn f13_a_character_that_is_cut_costs_no_triangle() {
    // The first byte alone of a letter of two, the first three of one of four, one that continues nothing, and a letter that is whole.
    let cuts: [&[u8]; 4] = [b"\xc3", b"\xf0\x9f\x98", b"\xa9", "\u{e9}".as_bytes()];
    for (name, form) in forms() {
        let plain = mesh(form.as_bytes());
        for cut in cuts {
            let parts: Vec<&[u8]> = form.split('$').map(str::as_bytes).collect();
            assert_eq!(mesh(&parts.join(cut)), plain, "{name} {cut:?}");
            // At the end of the file.
            assert_eq!(mesh(&[form.as_bytes(), b"\n# ", cut].concat()), plain, "{name} {cut:?}");
        }
    }
    // In XML of a package such a character is damage. In a name that is whole it is none.
    let named = |name: &[u8]| {
        let text = MODEL.replace("<object>", &object(1, MESH)).replace("id='1'>", "id='1' name='$'>");
        let parts: Vec<&[u8]> = text.split('$').map(str::as_bytes).collect();
        package_of(&parts.join(name), &[])
    };
    assert_eq!(triangles(&open(&named("\u{e9}".as_bytes())).unwrap()).len(), 1);
    assert!(reason(&named(b"\xc3")).contains("UTF-8"));
}

#[test]
fn f13_a_character_across_two_windows_is_whole() {
    // Windows of an OBJ end behind a line, those of others at a tag or a row: the letters stand around a mebibyte.
    for shift in 0..4 {
        let filler = "x".repeat((1 << 20) - 40 + shift);
        for letters in ["\u{e9}".repeat(40), "\u{1f600}".repeat(20)] {
            for (name, form) in forms() {
                let long = form.replacen('$', &format!("{filler}{letters}"), 1);
                let found = open(long.as_bytes());
                // Headers may be too long to be sound, but not read by halves.
                match found {
                    Ok(file) => assert_eq!(triangles(&file), mesh(form.as_bytes()), "{name}"),
                    Err(error) => assert_eq!(error.class(), ErrorClass::Unreadable, "{name}"),
                }
            }
        }
    }
}
