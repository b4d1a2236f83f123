//! [`Requests`] of S3, each with a signature in its address, by the client and the keys that the object store has.

use std::fmt::Write as _;
use std::ops::Range;
use std::time::Duration;

use bytes::{Bytes, BytesMut};
use futures_util::StreamExt;
use hyper::header::{HeaderName, HeaderValue, IF_MATCH, IF_NONE_MATCH};
use hyper::{Method, Request, StatusCode};
use object_store::aws::AmazonS3;
use object_store::client::{HttpClient, HttpResponseBody};
use object_store::multipart::{MultipartStore, PartId};
use object_store::path::Path as Key;
use object_store::signer::{SignedUrlOptions, Signer};
use object_store::{Attributes, Error, MultipartId, PutMultipartOptions, Result};

use super::listing;
use super::object::Version;
use super::requests::{Page, Requests, Upload};
use crate::escape::escaped;

/// An address with a signature serves no longer.
const SIGNED_FOR: Duration = Duration::from_secs(300);
/// No answer to a question is longer: a page of a listing names a thousand keys, of a kilobyte each, and says a little more of each.
const MOST_SAID: usize = 16 << 20;
/// The version of what was put while a bucket kept none: the next object of the name takes its place.
const NO_VERSION: &str = "null";

/// A bucket on a server that speaks S3.
#[derive(Debug)]
pub(super) struct S3 {
    pub store: AmazonS3,
    pub client: HttpClient,
    pub bucket: String,
}

impl S3 {
    /// Asks, and returns the body of the answer.
    async fn ask(
        &self,
        method: Method,
        key: &Key,
        query: &[(&str, &str)],
        headers: &[(HeaderName, String)],
        body: String,
    ) -> Result<Bytes> {
        let mut options = SignedUrlOptions::new().with_query(query.iter().copied());
        let mut request = Request::builder().method(method.clone());
        for (name, value) in headers {
            let value = HeaderValue::from_str(value).map_err(generic)?;
            options = options.with_signed_header(name.clone(), value.clone());
            request = request.header(name, value);
        }
        let url = self.store.signed_url_opts(method, key, SIGNED_FOR, &options).await?;
        let request = request.uri(url.as_str()).body(body.into()).map_err(generic)?;
        let answer = self.client.execute(request).await.map_err(generic)?;
        let status = answer.status();
        let body = whole(answer.into_body()).await?;
        match status {
            // The last step of an upload, and a copy, may fail after the server has said that all is well.
            _ if status.is_success() && !listing::is_error(&body) => Ok(body),
            _ => Err(refused(status, key, &body)),
        }
    }
}

#[async_trait::async_trait]
impl Requests for S3 {
    async fn list(&self, prefix: &str, from: Option<&str>) -> Result<Page> {
        let mut query = vec![("list-type", "2"), ("encoding-type", "url"), ("prefix", prefix)];
        query.extend(from.map(|from| ("continuation-token", from)));
        let body = self.ask(Method::GET, &Key::default(), &query, &[], String::new()).await?;
        listing::read(&body).map_err(generic)
    }

    async fn delete(&self, key: &Key, version: &Version) -> Result<()> {
        let (mut query, mut headers) = (Vec::new(), Vec::new());
        match version {
            Version { id: Some(id), .. } if id != NO_VERSION => query.push(("versionId", id.as_str())),
            Version { etag: Some(etag), .. } => headers.push((IF_MATCH, etag.clone())),
            _ => return Err(generic("an object without an ETag is not removed")),
        }
        self.ask(Method::DELETE, key, &query, &headers, String::new()).await.map(drop)
    }

    async fn begin(&self, key: &Key, attributes: &Attributes) -> Result<MultipartId> {
        let options = PutMultipartOptions { attributes: attributes.clone(), ..PutMultipartOptions::default() };
        self.store.create_multipart_opts(key, options).await
    }

    async fn put_part(&self, to: &Upload, n: usize, bytes: Bytes) -> Result<PartId> {
        MultipartStore::put_part(&self.store, &to.key, &to.id, n, bytes.into()).await
    }

    async fn copy_part(&self, to: &Upload, n: usize, from: (&Key, &Version), range: Range<u64>) -> Result<PartId> {
        let (key, version) = from;
        let mut source = format!("{}/{}", self.bucket, encoded(key.as_ref()));
        if let Some(id) = &version.id {
            let _ = write!(source, "?versionId={}", encoded(id));
        }
        let header = HeaderName::from_static;
        let mut headers = vec![
            (header("x-amz-copy-source"), source),
            (header("x-amz-copy-source-range"), format!("bytes={}-{}", range.start, range.end.saturating_sub(1))),
        ];
        headers.extend(version.etag.clone().map(|etag| (header("x-amz-copy-source-if-match"), etag)));
        let number = (n + 1).to_string();
        let query = [("partNumber", number.as_str()), ("uploadId", to.id.as_str())];
        let body = self.ask(Method::PUT, &to.key, &query, &headers, String::new()).await?;
        Ok(PartId { content_id: listing::etag(&body).map_err(generic)? })
    }

    async fn complete_new(&self, upload: &Upload, parts: &[PartId]) -> Result<()> {
        let mut body = String::from("<CompleteMultipartUpload xmlns=\"http://s3.amazonaws.com/doc/2006-03-01/\">");
        for (n, part) in parts.iter().enumerate() {
            let etag = quick_xml::escape::escape(part.content_id.as_str());
            let _ = write!(body, "<Part><PartNumber>{}</PartNumber><ETag>{etag}</ETag></Part>", n + 1);
        }
        body += "</CompleteMultipartUpload>";
        let query = [("uploadId", upload.id.as_str())];
        self.ask(Method::POST, &upload.key, &query, &[(IF_NONE_MATCH, "*".into())], body).await.map(drop)
    }

    async fn abort(&self, upload: &Upload) -> Result<()> {
        self.store.abort_multipart(&upload.key, &upload.id).await
    }
}

/// All bytes of an answer to a question: a page of a listing, or a few words.
async fn whole(body: HttpResponseBody) -> Result<Bytes> {
    let (mut stream, mut all) = (body.bytes_stream(), BytesMut::new());
    while let Some(some) = stream.next().await {
        let some = some.map_err(generic)?;
        if all.len() + some.len() > MOST_SAID {
            return Err(generic(format!("an answer of more than {MOST_SAID} bytes")));
        }
        all.extend_from_slice(&some);
    }
    Ok(all.freeze())
}

fn generic(source: impl Into<Box<dyn std::error::Error + Send + Sync>>) -> Error {
    Error::Generic { store: "S3", source: source.into() }
}

/// An answer that is not what was asked for.
fn refused(status: StatusCode, key: &Key, body: &[u8]) -> Error {
    let (path, text) = (key.to_string(), String::from_utf8_lossy(body));
    let source = format!("status code: {}: {text}", status.as_u16()).into();
    match status {
        StatusCode::NOT_FOUND => Error::NotFound { path, source },
        StatusCode::PRECONDITION_FAILED => Error::Precondition { path, source },
        StatusCode::UNAUTHORIZED => Error::Unauthenticated { path, source },
        StatusCode::FORBIDDEN => Error::PermissionDenied { path, source },
        // S3 says so within a success, too.
        _ if text.contains("<Code>PreconditionFailed</Code>") => Error::Precondition { path, source },
        _ => Error::Generic { store: "S3", source },
    }
}

/// A key as an address has it: its parts, between `/`.
fn encoded(key: &str) -> String {
    key.split('/').map(escaped).collect::<Vec<_>>().join("/")
}

#[cfg(test)]
mod tests {
    use object_store::client::HttpResponse;

    use super::*;

    #[test]
    fn refusals_are_told_apart() {
        let of = |status, body: &str| refused(status, &Key::from("a"), body.as_bytes());
        assert!(matches!(of(StatusCode::PRECONDITION_FAILED, ""), Error::Precondition { .. }));
        assert!(matches!(of(StatusCode::NOT_FOUND, ""), Error::NotFound { .. }));
        assert!(matches!(of(StatusCode::FORBIDDEN, ""), Error::PermissionDenied { .. }));
        let late = of(StatusCode::OK, "<Error><Code>PreconditionFailed</Code></Error>");
        assert!(matches!(late, Error::Precondition { .. }), "{late}");
        assert!(matches!(of(StatusCode::OK, "<Error><Code>InternalError</Code></Error>"), Error::Generic { .. }));
        assert!(matches!(of(StatusCode::CONFLICT, ""), Error::Generic { .. }), "it is tried again");
    }

    #[test]
    fn an_answer_without_end_is_no_answer() {
        let said = |bytes: usize| {
            let runtime = tokio::runtime::Builder::new_current_thread().build().unwrap();
            runtime.block_on(whole(HttpResponse::new(HttpResponseBody::from(vec![b' '; bytes])).into_body()))
        };
        assert_eq!(said(MOST_SAID).unwrap().len(), MOST_SAID);
        assert!(said(MOST_SAID + 1).unwrap_err().to_string().contains("an answer of more than"));
    }

    #[test]
    fn a_key_is_written_as_an_address_wants_it() {
        assert_eq!(encoded("in/a b+ü#.stl"), "in/a%20b%2B%C3%BC%23.stl");
    }
}
