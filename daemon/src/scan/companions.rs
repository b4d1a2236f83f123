//! The files that an OBJ names: its material libraries, and the textures that these name. Wavefront Technologies, "Object Files (.obj)" (Appendix B1 of
//! the Advanced Visualizer manual; `mtllib`) and "MTL material format" ("Material Library File (.mtl)"; texture map statements and their options).
//!
//! **In:** the beginning of such a file, and its path below `in/`. **Out:** paths below `in/`, in the order of the rows, each once.
//! **Promise:** bytes need not be UTF-8; nothing is opened; no path leads out of `in/`, names a mesh, or has a part that the scan does not see.
//!
//! Names may have spaces in them. Where a row has several libraries, each but the last must end in `.mtl`: else `my part.mtl` would be two. A backslash
//! parts folders, as a slash does: most of these files come from Windows.

use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};

use crate::folder::{NameKind, name_kind};

/// Of each file so many bytes are read, from its beginning.
pub(super) const BEGINNING: u64 = 1 << 20;
/// An OBJ has so many companions, at most.
pub(super) const MOST: usize = 1000;

/// Statements of a library that end in the name of a texture, but for those that begin with `map_`.
const TEXTURES: [&[u8]; 5] = [b"bump", b"disp", b"decal", b"refl", b"norm"];
/// Begins as those do, and has no name: a switch.
const SWITCH: &[u8] = b"map_aat";
/// Options of a texture, and how many words follow each.
const OPTIONS: [(&[u8], usize); 11] = [
    (b"-blendu", 1),
    (b"-blendv", 1),
    (b"-bm", 1),
    (b"-boost", 1),
    (b"-cc", 1),
    (b"-clamp", 1),
    (b"-colorspace", 1),
    (b"-imfchan", 1),
    (b"-mm", 2),
    (b"-texres", 1),
    (b"-type", 1),
];
/// Options that one to three numbers follow.
const VECTORS: [&[u8]; 3] = [b"-o", b"-s", b"-t"];

/// Is that the name of a file that may name others?
pub(super) fn is_obj(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("obj"))
}

/// The libraries that an OBJ names. O(bytes).
pub(super) fn libraries(text: &[u8], obj: &Path) -> Vec<PathBuf> {
    let names =
        rows(text).into_iter().filter_map(|row| value_of(&row, |word| word.eq_ignore_ascii_case(b"mtllib")).map(<[u8]>::to_vec));
    let names: Vec<Vec<u8>> = names.flat_map(|names| parted(&names)).collect();
    below(obj, names.iter().map(Vec::as_slice))
}

/// The textures that a library names. O(bytes).
pub(super) fn textures(text: &[u8], library: &Path) -> Vec<PathBuf> {
    let is_texture = |word: &[u8]| {
        let begins = word.get(..4).is_some_and(|begin| begin.eq_ignore_ascii_case(b"map_")) && !word.eq_ignore_ascii_case(SWITCH);
        begins || TEXTURES.iter().any(|known| word.eq_ignore_ascii_case(known))
    };
    let names: Vec<Vec<u8>> = rows(text)
        .into_iter()
        .filter_map(|row| value_of(&row, is_texture).map(|value| without_options(value).to_vec()))
        .collect();
    below(library, names.iter().map(Vec::as_slice))
}

/// The rows of a text without comments; a backslash at the end of a line joins it with the next one.
fn rows(text: &[u8]) -> Vec<Vec<u8>> {
    let mut rows = Vec::new();
    let mut begun: Vec<u8> = Vec::new();
    for line in text.split(|byte| *byte == b'\n') {
        let line = line.trim_ascii_end();
        if let Some(half) = line.strip_suffix(b"\\") {
            begun.extend_from_slice(half);
            begun.push(b' ');
            continue;
        }
        begun.extend_from_slice(line);
        let row = std::mem::take(&mut begun);
        if may_name(&row) {
            rows.push(row);
        }
    }
    rows.extend(Some(begun).filter(|row| may_name(row)));
    rows
}

/// Most rows are vertices and faces, and need not be kept.
fn may_name(row: &[u8]) -> bool {
    row.trim_ascii_start().first().is_some_and(|first| b"mMbBdDrRnN".contains(first))
}

/// What follows the first word of a row, if that is a word wanted.
fn value_of(row: &[u8], is_wanted: impl Fn(&[u8]) -> bool) -> Option<&[u8]> {
    let (word, value) = first_word(row)?;
    is_wanted(word).then_some(value)
}

/// The first word and the rest, without spaces around it.
fn first_word(text: &[u8]) -> Option<(&[u8], &[u8])> {
    let text = text.trim_ascii();
    let end = text.iter().position(u8::is_ascii_whitespace).unwrap_or(text.len());
    let (word, rest) = text.split_at_checked(end)?;
    (!word.is_empty()).then_some((word, rest.trim_ascii_start()))
}

/// The names in a row of libraries.
fn parted(names: &[u8]) -> Vec<Vec<u8>> {
    let mut all = Vec::new();
    let mut name: Vec<u8> = Vec::new();
    for part in names.split(u8::is_ascii_whitespace) {
        if !name.is_empty() {
            name.push(b' ');
        }
        name.extend_from_slice(part);
        let ends = name.len().checked_sub(4).and_then(|at| name.get(at..)).is_some_and(|end| end.eq_ignore_ascii_case(b".mtl"));
        if ends {
            all.push(std::mem::take(&mut name));
        }
    }
    all.push(name);
    all
}

/// The name behind the options of a texture.
fn without_options(mut value: &[u8]) -> &[u8] {
    while let Some((word, rest)) = first_word(value) {
        let is = |known: &[u8]| word.eq_ignore_ascii_case(known);
        if let Some((_, words)) = OPTIONS.iter().find(|(known, _)| is(known)) {
            value = (0..*words).fold(rest, |rest, _| first_word(rest).map_or(&[][..], |(_, rest)| rest));
        } else if VECTORS.iter().any(|known| is(known)) {
            value = rest;
            for _ in 0..3 {
                match first_word(value) {
                    Some((number, rest)) if is_number(number) => value = rest,
                    _ => break,
                }
            }
        } else {
            break;
        }
    }
    value
}

fn is_number(word: &[u8]) -> bool {
    std::str::from_utf8(word).is_ok_and(|word| word.parse::<f64>().is_ok())
}

/// The files of these names, seen from the file `from`; each once, and no more than may be.
fn below<'a>(from: &Path, names: impl Iterator<Item = &'a [u8]>) -> Vec<PathBuf> {
    let mut known = BTreeSet::new();
    names.filter_map(|name| named(from, name)).filter(|path| known.insert(path.clone())).take(MOST).collect()
}

/// The path below `in/` that a name in the file `from` stands for, if it may be a companion.
fn named(from: &Path, name: &[u8]) -> Option<PathBuf> {
    let name = name.trim_ascii();
    let name = name.strip_prefix(b"\"").and_then(|name| name.strip_suffix(b"\"")).unwrap_or(name);
    let is_separator = |byte: &u8| matches!(byte, b'/' | b'\\');
    let has_drive = matches!(name, [letter, b':', ..] if letter.is_ascii_alphabetic());
    if name.is_empty() || name.first().is_some_and(is_separator) || has_drive || name.contains(&0) {
        return None;
    }
    let mut path = from.parent().unwrap_or(Path::new("")).to_owned();
    for part in name.split(is_separator) {
        match part {
            b"" | b"." => {}
            b".." => {
                if !path.pop() {
                    return None;
                }
            }
            part => path.push(OsStr::from_bytes(part)),
        }
    }
    let is_seen = path.iter().all(|part| name_kind(part) != NameKind::Ignored);
    let is_file =
        name.last().is_some_and(|last| !is_separator(last)) && !matches!(name.rsplit(is_separator).next(), Some(b"." | b".."));
    let kind = path.file_name().map(name_kind);
    (is_seen && is_file && kind == Some(NameKind::Foreign)).then_some(path)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn of_obj(text: &[u8], obj: &str) -> Vec<String> {
        libraries(text, Path::new(obj)).iter().map(|path| path.to_string_lossy().into_owned()).collect()
    }

    fn of_library(text: &str, library: &str) -> Vec<String> {
        textures(text.as_bytes(), Path::new(library)).iter().map(|path| path.to_string_lossy().into_owned()).collect()
    }

    #[test]
    fn libraries_of_an_obj() {
        let text = b"# mtllib no.mtl\nmtllib part.mtl\nv 0 0 0\r\n  MTLLIB\tsub\\my part.MTL \r\nmtllib a.mtl b c.mtl d\nmtllib ./part.mtl\n\
            mtllib \"quoted name.mtl\"\nusemtl red\nmtllib\nmtllib joined\\\n.mtl\nmtllibx no.mtl\nmtllib last.mtl";
        let found = of_obj(text, "scan/part.obj");
        let expected = ["part.mtl", "sub/my part.MTL", "a.mtl", "b c.mtl", "d", "quoted name.mtl", "joined .mtl", "last.mtl"];
        assert_eq!(found, expected.map(|name| format!("scan/{name}")));
        assert_eq!(of_obj(b"mtllib part.mtl", "part.obj"), ["part.mtl"]);
        let latin = libraries(b"mtllib \xe4.mtl\n", Path::new("a.obj"));
        assert_eq!(latin[0].as_os_str().as_bytes(), b"\xe4.mtl", "not UTF-8");
    }

    #[test]
    fn textures_of_a_library() {
        let text = "newmtl red\nKd 1 0 0\nmap_Kd wood.png\nmap_Ks -s 1 1 1 -o 0.5 -bm 1 tex\\my wood.png\nbump -clamp on -mm 0 1 b.tga\n\
            refl -type sphere sky.jpg\nnorm n.png\ndisp -t 1 2 d.png\ndecal x.png\nmap_aat on\nmap_Bump -bm 0.3 B.png\nmap_d -s 2\n\
            map_Pr -unknown 3.png\nmap_Ke 2 sides.png\n";
        let expected = [
            "wood.png",
            "tex/my wood.png",
            "b.tga",
            "sky.jpg",
            "n.png",
            "d.png",
            "x.png",
            "B.png",
            "-unknown 3.png",
            "2 sides.png",
        ];
        assert_eq!(of_library(text, "m/part.mtl"), expected.map(|name| format!("m/{name}")));
        assert_eq!(of_library("map_Kd ../wood.png", "m/part.mtl"), ["wood.png"]);
    }

    /// What may not be a companion, whoever names it.
    #[test]
    fn hostile_names_lead_nowhere() {
        for name in [
            "/etc/passwd",
            "\\\\server\\share\\a.mtl",
            "C:\\a.mtl",
            "c:a.mtl",
            "../a.mtl",
            "../../a.mtl",
            "sub/../../../a.mtl",
            "..",
            ".",
            "sub/",
            "sub/..",
            ".hidden.mtl",
            ".suture/a.mtl",
            "sub/.git/a.mtl",
            "other.stl",
            "part.obj",
            "a.tmp",
            "part.obj.suture.json",
            "a\0.mtl",
            "\"\"",
            "",
        ] {
            let row = format!("mtllib {name}\n");
            let found: Vec<_> = of_obj(row.as_bytes(), "part.obj");
            assert!(found.is_empty(), "{name}: {found:?}");
        }
        assert_eq!(of_obj(b"mtllib ../../a.mtl\nmtllib ../b.mtl", "order/part.obj"), ["b.mtl"], "out of the order, not of in/");
    }

    #[test]
    fn names_are_bounded() {
        let text: String = (0..2 * MOST).map(|n| format!("mtllib {n}.mtl\n")).collect();
        assert_eq!(of_obj(text.as_bytes(), "a.obj").len(), MOST);
    }

    const WORDS: [&[u8]; 15] =
        [b"mtllib ", b"map_Kd ", b"-s 1 ", b"../", b"/", b"\\", b"\n", b"a", b".mtl", b" ", b"\xff", b"C:", b".", b"\"", b".stl"];

    proptest! {
        /// Whatever bytes come, and whatever they name: it lies below `in/`, is seen by the scan, and is no mesh.
        #[test]
        fn no_bytes_lead_out(text in proptest::collection::vec(proptest::sample::select(&WORDS[..]), 0..60)) {
            let text = text.concat();
            for path in libraries(&text, Path::new("x/y/a.obj")).into_iter().chain(textures(&text, Path::new("x/a.mtl"))) {
                prop_assert!(path.components().all(|part| matches!(part, std::path::Component::Normal(_))), "{:?}", path);
                prop_assert!(path.iter().all(|part| name_kind(part) != NameKind::Ignored));
                prop_assert_eq!(path.file_name().map(name_kind), Some(NameKind::Foreign));
            }
        }
    }
}
