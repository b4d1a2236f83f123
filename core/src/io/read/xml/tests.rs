//! XML that is sound, and XML that is a trap.

use proptest::prelude::*;

use super::super::finding::Rejection;
use super::*;

/// All elements with their depth and namespace, or why not.
fn read(text: &[u8]) -> Result<Vec<String>, String> {
    let told = |rejection| match rejection {
        Rejection::Unreadable(reason) => reason,
        other => format!("{other:?}"),
    };
    let mut xml = Xml::of("a.model", text).map_err(told)?;
    let mut seen = Vec::new();
    loop {
        match xml.next().map_err(told)? {
            Node::Start(element) => {
                seen.push(format!("<{} {}", element.namespace.as_deref().unwrap_or("-"), element.name));
            }
            Node::End(_) => seen.push(">".into()),
            Node::Text(text) => seen.push(text),
            Node::Over => return Ok(seen),
        }
    }
}

#[test]
fn names_are_told_by_their_namespace() {
    let text =
        br#"<?xml version="1.0" encoding="UTF-8"?><a xmlns="u:1" xmlns:p="u:2"><p:b/><b xmlns="u:3">x&amp;&#65;</b><c/></a>"#;
    let expected = ["<u:1 a", "<u:2 b", ">", "<u:3 b", "x", "&", "A", ">", "<u:1 c", ">", ">"];
    assert_eq!(read(text).unwrap(), expected);
    assert_eq!(read(b"\xef\xbb\xbf<a/>").unwrap(), ["<- a", ">"], "behind a byte order mark");
    assert_eq!(read(b"<x:a/>").unwrap(), ["<undeclared a", ">"]);
}

#[test]
fn f14_traps_in_xml_are_refused() {
    let laughs = b"<!DOCTYPE a [<!ENTITY l \"ha\"><!ENTITY m \"&l;&l;\">]><a>&m;</a>";
    assert!(read(laughs).unwrap_err().contains("document type"));
    let deep = ["<a>".repeat(65), "</a>".repeat(65)].concat();
    assert!(read(deep.as_bytes()).unwrap_err().contains("64 elements"));
    assert!(read(["<a>".repeat(64), "</a>".repeat(64)].concat().as_bytes()).is_ok());
    let many: String = (0..257).map(|i| format!(" a{i}=\"\"")).collect();
    assert!(read(format!("<a{many}/>").as_bytes()).unwrap_err().contains("256 attributes"));
    for (text, word) in [
        (b"<a>&m;</a>".as_slice(), "reference"),
        (b"<a>&#0;</a>", "reference"),
        (b"<a b=\"1\" b=\"2\"/>", "attribute"),
        (b"<a></b>", "end tag"),
        (b"</a>", "end tag"),
        (b"<a>", "ends within"),
        (b"<a><b", "no sound XML"),
        (b"text", "outside"),
        (b"<a>\xff</a>", "UTF-8"),
        (b"\xff\xfe<\0a\0", "UTF-16"),
        (b"<?xml version=\"1.0\" encoding=\"ISO-8859-1\"?><a/>", "ISO-8859-1"),
        (b"< a/>", "no sound XML"),
    ] {
        let reason = read(text).unwrap_err();
        assert!(reason.contains(word) && reason.contains("a.model"), "{word}: {reason}");
    }
}

#[test]
fn plain_content_is_skipped_only_where_it_is_plain() {
    for (inner, plain) in [
        ("<v a='1'/><v/>", true),
        ("", true),
        ("<!-- </l> --><v/>", false),
        ("<![CDATA[</l>]]>", false),
        ("<v></v>", false),
        ("<?x </l>?>", false),
    ] {
        let text = format!("<r><l>{inner}</l ><z/></r>");
        let mut xml = Xml::of("a", text.as_bytes()).unwrap();
        assert!(xml.child().unwrap().is_some() && xml.child().unwrap().is_some());
        let tag = xml.skip_plain();
        assert_eq!(tag.is_some(), plain, "{inner}");
        let tag = tag.unwrap_or_else(|| xml.skip().unwrap());
        assert_eq!(&text[tag], "</l >");
        assert_eq!(xml.child().unwrap().unwrap().name, "z");
    }
}

proptest! {
    #[test]
    fn f13_any_xml_is_read_or_refused(text in "[<>/a:=\"'&;!\\[\\]? -]{0,80}", bytes in prop::collection::vec(any::<u8>(), 0..80)) {
        let _ = (read(text.as_bytes()), read(&bytes));
    }
}
