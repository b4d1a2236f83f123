//! Where a bucket is: `s3://bucket/prefix`. Nothing secret is in it.

use std::fmt;

/// A prefix of a bucket, below which the parts of a hot folder are.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct BucketAddress {
    pub bucket: String,
    /// Without a `/` at either end; may be empty.
    pub prefix: String,
}

/// How an address begins.
const SCHEME: &str = "s3://";

impl BucketAddress {
    /// `None`: it is the path of a folder.
    ///
    /// # Errors
    /// A line for people, for what begins as an address does and is none.
    pub(crate) fn parse(text: &str) -> Option<Result<Self, String>> {
        let rest = text.strip_prefix(SCHEME)?;
        let (bucket, prefix) = rest.split_once('/').unwrap_or((rest, ""));
        let prefix = prefix.trim_end_matches('/');
        let is_plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '.' | '_');
        let is_odd = |part: &str| part.is_empty() || part == "." || part == "..";
        if bucket.is_empty() || !bucket.chars().all(is_plain) || (!prefix.is_empty() && prefix.split('/').any(is_odd)) {
            return Some(Err(format!(
                "`{text}` is no bucket; write it as in \"s3://bucket/prefix\", without a name or key in it"
            )));
        }
        Some(Ok(Self { bucket: bucket.into(), prefix: prefix.into() }))
    }

    /// The key of a path below the prefix.
    pub(crate) fn key(&self, below: &str) -> String {
        if self.prefix.is_empty() { below.into() } else { format!("{}/{below}", self.prefix) }
    }
}

impl fmt::Display for BucketAddress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{SCHEME}{}", self.bucket)?;
        if self.prefix.is_empty() { Ok(()) } else { write!(f, "/{}", self.prefix) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn address(text: &str) -> BucketAddress {
        BucketAddress::parse(text).unwrap().unwrap()
    }

    #[test]
    fn an_address_names_a_bucket_and_a_prefix() {
        let farm = address("s3://prints/farm/a/");
        assert_eq!([farm.to_string(), farm.key("in/x.stl")], ["s3://prints/farm/a", "farm/a/in/x.stl"]);
        let all = address("s3://prints");
        assert_eq!([all.to_string(), all.key("in/x.stl")], ["s3://prints", "in/x.stl"]);
        assert_eq!(BucketAddress::parse("/srv/prints"), None);
        for wrong in ["s3://", "s3:///a", "s3://key:secret@host/a", "s3://a//b", "s3://a/../b"] {
            assert!(BucketAddress::parse(wrong).unwrap().unwrap_err().contains("is no bucket"), "{wrong}");
        }
    }
}
