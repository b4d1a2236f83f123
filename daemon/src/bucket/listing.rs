//! Answers of S3 in XML, as far as anyone here needs them.

use quick_xml::Reader;
use quick_xml::escape::unescape;
use quick_xml::events::Event;

use super::requests::{Listed, Page};

/// Elements lie no deeper in one another.
const DEPTH: usize = 16;

/// Reads a page of a listing, whose keys are written as in an address if it says so.
///
/// # Errors
/// In words, when it is none.
pub(super) fn read(body: &[u8]) -> Result<Page, String> {
    let (mut page, mut is_cut, mut is_page, mut is_encoded) = (Page::default(), false, false, false);
    let mut now: Option<Listed> = None;
    each(body, &mut |path, event| {
        match (path, event) {
            (["ListBucketResult"], Piece::Begin) => is_page = true,
            (["ListBucketResult", "Contents"], Piece::Begin) => now = Some(Listed { key: String::new(), seen: String::new() }),
            (["ListBucketResult", "Contents"], Piece::End) => page.found.extend(now.take()),
            ([.., "Contents", "Key"], Piece::Text(text)) => {
                if let Some(now) = &mut now {
                    now.key = text;
                }
            }
            ([.., "Contents", "ETag" | "Size" | "LastModified"], Piece::Text(text)) => {
                if let Some(now) = &mut now {
                    now.seen += &text;
                    now.seen.push(' ');
                }
            }
            (["ListBucketResult", "NextContinuationToken"], Piece::Text(text)) => page.next = Some(text),
            (["ListBucketResult", "IsTruncated"], Piece::Text(text)) => is_cut = text == "true",
            (["ListBucketResult", "EncodingType"], Piece::Text(text)) => is_encoded = text == "url",
            _ => {}
        }
        Ok(())
    })?;
    if !is_page {
        return Err("the answer is no listing".into());
    }
    if is_cut && page.next.is_none() {
        return Err("a part of a listing does not say where it goes on".into());
    }
    page.next = page.next.filter(|_| is_cut);
    // A server that knows no such thing does as if nobody had asked for it.
    for one in page.found.iter_mut().filter(|_| is_encoded) {
        one.key = decoded(&one.key).ok_or("a key is no text")?;
    }
    Ok(page)
}

/// The ETag in the answer to a copy.
///
/// # Errors
/// In words, when there is none.
pub(super) fn etag(body: &[u8]) -> Result<String, String> {
    let mut found = None;
    each(body, &mut |path, event| {
        if let ([_, "ETag"], Piece::Text(text)) = (path, event) {
            found = Some(text);
        }
        Ok(())
    })?;
    found.ok_or_else(|| "the answer to a copy has no ETag".into())
}

/// Is it the answer of a server that failed after it had begun to answer?
pub(super) fn is_error(body: &[u8]) -> bool {
    let mut is_error = false;
    // The reader finds out by itself that an answer is no XML.
    let _ = each(body, &mut |path, _| {
        is_error |= path == ["Error"];
        Ok(())
    });
    is_error
}

/// Is told each piece of a document, with the names of the elements that it lies in.
type Visit<'a> = &'a mut dyn FnMut(&[&str], Piece) -> Result<(), String>;

enum Piece {
    Begin,
    Text(String),
    End,
}

/// Walks through a document.
fn each(body: &[u8], visit: Visit) -> Result<(), String> {
    let text = std::str::from_utf8(body).map_err(|_| "the answer is no text")?;
    let (mut reader, mut path, mut held) = (Reader::from_str(text), Vec::<String>::new(), String::new());
    loop {
        match reader.read_event().map_err(|error| format!("the answer is no XML: {error}"))? {
            Event::Start(element) => {
                held.clear();
                if path.len() == DEPTH {
                    return Err("the answer is nested too deep".into());
                }
                path.push(String::from_utf8_lossy(element.local_name().as_ref()).into_owned());
                told(&path, Piece::Begin, visit)?;
            }
            // Text comes in pieces, with what stands for a character between them.
            Event::Text(text) => held += &text.decode().map_err(|error| error.to_string())?,
            Event::CData(text) => held += &text.decode().map_err(|error| error.to_string())?,
            Event::GeneralRef(name) => {
                let name = name.decode().map_err(|error| error.to_string())?;
                held += &unescape(&format!("&{name};")).map_err(|error| error.to_string())?;
            }
            Event::End(_) => {
                if !held.trim().is_empty() {
                    told(&path, Piece::Text(std::mem::take(&mut held)), visit)?;
                }
                told(&path, Piece::End, visit)?;
                held.clear();
                path.pop();
            }
            Event::Eof if path.is_empty() => return Ok(()),
            Event::Eof => return Err("the answer was cut".into()),
            _ => {}
        }
    }
}

fn told(path: &[String], piece: Piece, visit: Visit) -> Result<(), String> {
    visit(&path.iter().map(String::as_str).collect::<Vec<_>>(), piece)
}

/// The text that an address writes so.
fn decoded(text: &str) -> Option<String> {
    let (mut bytes, mut rest) = (Vec::with_capacity(text.len()), text.bytes());
    while let Some(byte) = rest.next() {
        bytes.push(match byte {
            b'+' => b' ',
            b'%' => {
                let mut digit = || char::from(rest.next()?).to_digit(16).and_then(|digit| u8::try_from(digit).ok());
                digit()? << 4 | digit()?
            }
            other => other,
        });
    }
    String::from_utf8(bytes).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_tells_its_keys_and_where_it_goes_on() {
        let body = "<?xml version=\"1.0\"?><ListBucketResult xmlns=\"http://s3.amazonaws.com/doc/2006-03-01/\"><Name>b</Name>\
             <EncodingType>url</EncodingType>\
             <IsTruncated>true</IsTruncated><NextContinuationToken>a&amp;b=</NextContinuationToken>\
             <Contents><Key>in/a+b%2B%C3%BC.stl</Key><LastModified>2026</LastModified><ETag>&quot;1f&quot;</ETag><Size>3</Size>\
             <Owner><ID>x</ID></Owner></Contents><Contents><Key>in//%01</Key><Size>0</Size></Contents></ListBucketResult>";
        let page = read(body.as_bytes()).unwrap();
        assert_eq!(page.next.as_deref(), Some("a&b="));
        let keys: Vec<_> = page.found.iter().map(|one| (one.key.as_str(), one.seen.as_str())).collect();
        assert_eq!(keys, [("in/a b+ü.stl", "2026 \"1f\" 3 "), ("in//\u{1}", "0 ")]);
        let plain = read(body.replace("<EncodingType>url</EncodingType>", "").as_bytes()).unwrap();
        assert_eq!(plain.found[0].key, "in/a+b%2B%C3%BC.stl", "it does not say that keys are written in another way");
        let last = body.replace("true", "false");
        assert_eq!(read(last.as_bytes()).unwrap().next, None);
        assert!(read(&body.as_bytes()[..body.len() - 30]).is_err(), "a listing that was cut says nothing of what is not in it");
        let deep = format!("<ListBucketResult>{}{}</ListBucketResult>", "<a>".repeat(1000), "</a>".repeat(1000));
        for other in ["", "Oops", "<html></html>", deep.as_str()] {
            assert!(read(other.as_bytes()).is_err(), "{other}");
        }
    }

    #[test]
    fn an_error_that_comes_late_is_seen() {
        assert!(is_error(b"<?xml version=\"1.0\"?><Error><Code>InternalError</Code></Error>"));
        assert!(!is_error(b"<CompleteMultipartUploadResult><Key>Error</Key></CompleteMultipartUploadResult>"));
        assert_eq!(etag(b"<CopyPartResult><ETag>&quot;1f-2&quot;</ETag></CopyPartResult>").unwrap(), "\"1f-2\"");
        assert!(etag(b"<CopyPartResult></CopyPartResult>").is_err());
    }
}
