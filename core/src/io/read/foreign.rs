//! Names for what is no mesh, so that the refusal says what the file is rather than what it is not. Consulted only once a file
//! has failed to be an STL; a name found here never decides anything.

/// How a foreign file begins, and what to call it.
const BEGINNINGS: &[(&[u8], &str)] = &[
    (b"\x89PNG\r\n\x1a\n", "a PNG picture"),
    (b"\xff\xd8\xff", "a JPEG picture"),
    (b"GIF8", "a GIF picture"),
    (b"II*\0", "a TIFF picture"),
    (b"MM\0*", "a TIFF picture"),
    (b"%PDF", "a PDF document"),
    (b"PK\x03\x04", "a ZIP archive (3MF files are such, too)"),
    (b"\x1f\x8b", "a gzip archive"),
    (b"Rar!", "a RAR archive"),
    (b"7z\xbc\xaf\x27\x1c", "a 7-Zip archive"),
    (b"BLENDER", "a Blender file"),
    (b"glTF", "a glTF model"),
    (b"Kaydara FBX", "an FBX model"),
    (b"\x7fELF", "a program"),
    (b"MZ\x90", "a Windows program"),
    (b"\xff\xfe", "UTF-16 text"),
    (b"\xfe\xff", "UTF-16 text"),
    (b"<\0?\0", "UTF-16 text"),
    (b"\0<\0?", "UTF-16 text"),
    (b"SQLite format 3", "a database"),
    (b"version https://git-lfs", "a Git LFS pointer, not the file it stands for"),
    (b"ISO-10303-21", "a STEP model"),
    (b"#VRML", "a VRML model"),
    (b"DBRep_DrawableShape", "an OpenCASCADE BREP model"),
    (b"<!doctype html", "a web page"),
    (b"<html", "a web page"),
    (b"<?xml", "an XML document"),
];

/// What `bytes` are, with what is missing for a mesh: a phrase that completes "cannot be read as a mesh: …".
pub(super) fn describe(bytes: &[u8]) -> String {
    let head = bytes.get(..4096).unwrap_or(bytes);
    let name = beginning(head).or_else(|| riff(head)).or_else(|| bitmap(head, bytes.len())).or_else(|| text(head));
    match name {
        Some(name) => format!("{name}, not an STL mesh"),
        None if super::binary::is_blank(bytes.get(..1 << 20).unwrap_or(bytes)) => "nothing but zero bytes".into(),
        None if holds(head, b"facet normal") => "text STL with control characters among its first facets: damaged".into(),
        None if bytes.len() < 84 + 50 => format!("only {} bytes, too few for a single triangle", bytes.len()),
        None if is_text(head) => "text, but not of an STL: no \"solid\" with facets".into(),
        None => {
            "neither text nor binary STL: the length does not fit the count, and the records do not look like triangles".into()
        }
    }
}

fn beginning(head: &[u8]) -> Option<&'static str> {
    let fits = |begin: &[u8]| head.get(..begin.len()).is_some_and(|h| h.eq_ignore_ascii_case(begin));
    BEGINNINGS.iter().find(|(begin, _)| fits(begin)).map(|&(_, name)| name)
}

/// WebP pictures, regular and film share one container.
fn riff(head: &[u8]) -> Option<&'static str> {
    head.starts_with(b"RIFF").then(|| if head.get(8..12) == Some(b"WEBP") { "a WebP picture" } else { "a sound or film" })
}

/// Two letters are too little to go by: the length must stand behind them.
fn bitmap(head: &[u8], length: usize) -> Option<&'static str> {
    let size = head.get(2..6)?.first_chunk().copied().map(u32::from_le_bytes)?;
    (head.starts_with(b"BM") && size as usize == length).then_some("a BMP picture")
}

/// Text formats without a magic number, by the shape of their lines.
fn text(head: &[u8]) -> Option<&'static str> {
    if !is_text(head) {
        return None;
    }
    let lines = || head.split(|&byte| byte == b'\n' || byte == b'\r').map(<[u8]>::trim_ascii).filter(|line| !line.is_empty());
    let most = |fits: fn(&[u8]) -> bool| {
        let (count, all) = lines().fold((0, 0), |(count, all), line| (count + usize::from(fits(line)), all + 1));
        all > 1 && count * 2 > all
    };
    let any = |begin: &[u8]| lines().any(|line| line.starts_with(begin));
    if any(b"G1 ") || any(b"G0 ") || any(b"G28") {
        Some("G-code")
    } else if most(is_hex_dump_line) {
        Some("a hex dump")
    } else {
        None
    }
}

/// Beginning with at least six hexadecimal digits in a row, or of nothing but short groups of them.
fn is_hex_dump_line(line: &[u8]) -> bool {
    let leading = line.iter().take_while(|byte| byte.is_ascii_hexdigit()).count();
    let offset = leading >= 6 && line.get(leading).is_none_or(|&byte| byte == b':' || byte == b' ');
    let mut groups = line.split(|byte| byte.is_ascii_whitespace());
    offset || groups.all(|group| matches!(group.len(), 0 | 2 | 4 | 8) && group.iter().all(u8::is_ascii_hexdigit))
}

/// Does `text` hold `word` in any case?
pub(super) fn holds(text: &[u8], word: &[u8]) -> bool {
    text.windows(word.len()).any(|window| window.eq_ignore_ascii_case(word))
}

/// No control character but white space.
pub(super) fn is_text(bytes: &[u8]) -> bool {
    bytes.iter().all(|&byte| byte >= b' ' || byte.is_ascii_whitespace() || byte == 0x0b)
}

#[cfg(test)]
mod tests {
    use super::describe;

    #[test]
    fn common_strangers_are_called_by_name() {
        let dump = b"00000000: 7374 6c20 6669 6c65 0000\n00000010: 0000 0000 0000 0000 0000\n";
        for (bytes, name) in [
            (b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR".as_slice(), "a PNG picture"),
            (b"\xff\xd8\xff\xe0\0\x10JFIF", "a JPEG picture"),
            (b"RIFF\0\0\0\0WEBPVP8 ", "a WebP picture"),
            (b"<!DOCTYPE html><html>", "a web page"),
            (dump, "a hex dump"),
            (b"G28 ; home\nG1 X10 Y10\n", "G-code"),
        ] {
            assert_eq!(describe(bytes), format!("{name}, not an STL mesh"));
        }
    }

    #[test]
    fn what_has_no_name_is_described() {
        assert_eq!(describe(&[0; 500]), "nothing but zero bytes");
        assert_eq!(describe(&[1, 2, 3]), "only 3 bytes, too few for a single triangle");
        assert!(describe("a letter to a friend\n".repeat(50).as_bytes()).starts_with("text, but not of an STL"));
        assert!(describe(b"solid a\nfacet normal 0 0 1\x10").contains("damaged"));
        assert!(describe(&[7; 500]).starts_with("neither text nor binary STL"));
    }
}
