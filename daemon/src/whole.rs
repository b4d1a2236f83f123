//! Does a file end where a whole one of its format does? Little of it is read, and none of it is understood.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};

/// So many zeros at the end, eight records of them, are no triangles.
const ZEROS: usize = 8 * 50;
/// Bytes of the beginning and of the end that are looked at.
const BEGINNING: u64 = 2048;
const END: u64 = 1024;
/// Bytes of the end of a ZIP archive, without its comment.
const ZIP_END: usize = 22;

/// Has the file the length, or the end, that a whole one has? Of binary STL and of a PLY of triangles, the length that the header announces; `endsolid`,
/// `</amf>`, the end of a ZIP archive; of other text, the end of a line. A file whose size was set before it was written ends in zeros. Reads 3 KB at
/// most.
///
/// # Errors
/// As `read`.
pub(crate) fn is_whole(mut file: &File) -> io::Result<bool> {
    let size = file.metadata()?.len();
    file.seek(SeekFrom::Start(0))?;
    let mut head = Vec::new();
    file.take(BEGINNING.min(size)).read_to_end(&mut head)?;
    let length = END.min(size);
    file.seek(SeekFrom::Start(size - length))?;
    let mut tail = Vec::new();
    file.take(length).read_to_end(&mut tail)?;
    Ok(ends_well(&head, &tail, size))
}

fn ends_well(head: &[u8], tail: &[u8], size: u64) -> bool {
    let zeros = tail.iter().rev().take_while(|byte| **byte == 0).count();
    if ends_a_solid(tail) || tail.trim_ascii_end().ends_with(b"</amf>") {
        return true;
    }
    if head.starts_with(b"PK\x03\x04") {
        return ends_an_archive(tail);
    }
    if zeros >= ZEROS {
        return false;
    }
    if head.starts_with(b"ply") && !says(head, "format ascii") {
        return triangles_of_ply(head) == Some(size);
    }
    let announced =
        head.get(80..84).and_then(|count| count.first_chunk()).map(|count| 84 + 50 * u64::from(u32::from_le_bytes(*count)));
    announced == Some(size) || (is_other_text(head) && is_other_text(tail) && tail.ends_with(b"\n"))
}

/// Is the last line of text one that begins with `endsolid`, in any case?
fn ends_a_solid(tail: &[u8]) -> bool {
    let text = tail.trim_ascii_end();
    let line = text.rsplit(|&b| b == b'\n' || b == b'\r').next().unwrap_or_default().trim_ascii_start();
    line.get(..8).is_some_and(|word| word.eq_ignore_ascii_case(b"endsolid"))
}

/// Does the end of an archive's directory stand here, and its comment end where the file does?
fn ends_an_archive(tail: &[u8]) -> bool {
    let ends = |at: usize| {
        let comment = tail.get(at + 20..at + ZIP_END).and_then(|length| length.first_chunk()).copied().map(u16::from_le_bytes);
        comment.is_some_and(|comment| at + ZIP_END + usize::from(comment) == tail.len())
    };
    tail.windows(4).enumerate().any(|(at, mark)| mark == b"PK\x05\x06" && ends(at))
}

/// The length of a binary PLY of vertices of numbers and faces of three corners; `None` if the header says anything else, or is longer.
fn triangles_of_ply(head: &[u8]) -> Option<u64> {
    const MARK: &[u8] = b"end_header\n";
    let end = head.windows(MARK.len()).position(|window| window == MARK)? + MARK.len();
    let text = std::str::from_utf8(head.get(..end)?).ok()?;
    let (mut size, mut count) = (end as u64, 0u64);
    for line in text.lines() {
        let words: Vec<&str> = line.split_ascii_whitespace().collect();
        let each = match words.as_slice() {
            ["element", "vertex" | "face", number] => {
                count = number.parse().ok()?;
                continue;
            }
            ["element", ..] => return None,
            ["property", "list", length, item, _] => width(length)? + 3 * width(item)?,
            ["property", kind, _] => width(kind)?,
            _ => continue,
        };
        size = size.checked_add(count.checked_mul(each)?)?;
    }
    Some(size)
}

/// Bytes of a number of a PLY.
fn width(kind: &str) -> Option<u64> {
    match kind {
        "char" | "uchar" | "int8" | "uint8" => Some(1),
        "short" | "ushort" | "int16" | "uint16" => Some(2),
        "int" | "uint" | "float" | "int32" | "uint32" | "float32" => Some(4),
        "double" | "float64" => Some(8),
        _ => None,
    }
}

fn says(head: &[u8], words: &str) -> bool {
    head.windows(words.len()).any(|window| window == words.as_bytes())
}

/// Text of a format that has no mark of its end. A text STL has one.
fn is_other_text(bytes: &[u8]) -> bool {
    let is_letter = |byte: &u8| *byte >= b' ' || byte.is_ascii_whitespace();
    !bytes.is_empty() && bytes.iter().all(is_letter) && !says(bytes, "facet") && !says(bytes, "<amf")
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    fn whole(bytes: &[u8]) -> bool {
        let mut file = tempfile::tempfile().unwrap();
        file.write_all(bytes).unwrap();
        is_whole(&file).unwrap()
    }

    /// Each file is whole, and none of its beginnings is.
    #[test]
    fn every_format_says_where_it_ends() {
        let stl = [&[0; 80][..], &2u32.to_le_bytes(), &[7; 100]].concat();
        let header = "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
            element face 1\nproperty list uchar int vertex_indices\nend_header\n";
        let ply = [header.as_bytes(), &[1; 36 + 13]].concat();
        let zip = [b"PK\x03\x04 some entry".as_slice(), b"PK\x05\x06", &[0; 16], &3u16.to_le_bytes(), b"abc"].concat();
        let amf = b"<amf><object/></amf>\n".to_vec();
        let text = b"solid a\nfacet normal 0 0 1\nendsolid a\n".to_vec();
        for file in [stl, ply, zip, amf, text.clone()] {
            assert!(whole(&file), "{file:?}");
            // The mark of a text, and the line's end behind it.
            let last = if file == text { b"ndsolid a\n".len() } else { 3 };
            for end in [file.len() / 2, file.len() - last] {
                assert!(!whole(&file[..end]), "{end} of {file:?}");
            }
        }
    }

    #[test]
    fn text_without_a_mark_ends_with_a_line() {
        for text in ["v 0 0 0\nf 1 2 3\n", "OFF\n3 1 0\n", "ply\nformat ascii 1.0\n3 0 1 2\n"] {
            assert!(whole(text.as_bytes()) && !whole(&text.as_bytes()[..text.len() - 1]), "{text}");
            assert!(!whole(&[text.as_bytes(), &[0; 500]].concat()), "zeros behind {text}");
        }
        assert!(!whole(b"solid a\nfacet normal 0 0 1\n"), "a text STL has a mark");
        assert!(!whole(b""));
    }

    #[test]
    fn f21_lengths_of_complete_files() {
        let mut binary = vec![0; 84 + 100];
        binary[80] = 2;
        assert!(whole(&binary));
        assert!(!whole(&binary[..183]), "cut short");
        assert!(!whole(&[&binary[..], b"x"].concat()), "still growing, or with a tail");
        let mut half = vec![7; 84 + 50 * 20];
        half[80..84].copy_from_slice(&20_u32.to_le_bytes());
        assert!(whole(&half));
        half[84 + 50 * 10..].fill(0);
        assert!(!whole(&half), "D6: its size was set before it was written");
        assert!(whole(b"solid a\nfacet\nENDSOLID a\r\n"));
        assert!(!whole(b"solid a\nfacet normal 0 0 1"));
        assert!(!whole(b""));
    }
}
