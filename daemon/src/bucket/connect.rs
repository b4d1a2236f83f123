//! The client of an object store, as the environment or the instance says (`AWS_…`): no key stands in a setting, a job or a message.

use std::sync::Arc;
use std::time::Duration;

use object_store::aws::{AmazonS3Builder, AmazonS3ConfigKey};
use object_store::client::{HttpConnector, ReqwestConnector};
use object_store::{BackoffConfig, ClientOptions, RetryConfig};

use super::address::BucketAddress;
use super::s3::S3;

/// Where keys come from, other than from a profile; one is enough.
const SOURCES: [&str; 4] = [
    "AWS_ACCESS_KEY_ID",
    "AWS_WEB_IDENTITY_TOKEN_FILE",
    "AWS_CONTAINER_CREDENTIALS_RELATIVE_URI",
    "AWS_CONTAINER_CREDENTIALS_FULL_URI",
];

/// The client; a call takes no longer than `limit`. It repeats once what a server answers with 5xx, 429 or 408, and what did not reach it; anything else
/// it does not: whoever calls does, and looks what became of it.
///
/// # Errors
/// A line for people.
pub(super) fn connect(address: &BucketAddress, limit: Duration) -> Result<Arc<S3>, String> {
    let told: Vec<_> =
        std::env::vars_os().filter_map(|(name, value)| Some((name.into_string().ok()?, value.into_string().ok()?))).collect();
    has_source(&told).and_then(|()| is_encrypted(&told)).map_err(|what| format!("{address}: {what}"))?;
    // Another part of the program may have said so before.
    let _ = rustls::crypto::ring::default_provider().install_default();
    let backoff = BackoffConfig { init_backoff: Duration::from_millis(100), max_backoff: Duration::from_secs(2), base: 2.0 };
    let retry = RetryConfig { backoff, max_retries: 1, retry_timeout: Duration::from_secs(20) };
    let mut client = ClientOptions::new().with_timeout(limit).with_connect_timeout(Duration::from_secs(5));
    let mut builder = AmazonS3Builder::new();
    for (name, value) in told.into_iter().filter(|(name, _)| name.starts_with("AWS_")) {
        match name.to_ascii_lowercase().parse() {
            Ok(AmazonS3ConfigKey::Client(key)) => client = client.with_config(key, value),
            // Parts would carry sums that the last step of an upload must repeat; all that is written is read back anyway.
            Ok(AmazonS3ConfigKey::Checksum) => {}
            Ok(key) => builder = builder.with_config(key, value),
            Err(_) => {}
        }
    }
    let made = ReqwestConnector::default().connect(&client).and_then(|http| {
        let store = builder.with_client_options(client).with_bucket_name(&address.bucket).with_retry(retry).build()?;
        Ok(Arc::new(S3 { store, client: http, bucket: address.bucket.clone() }))
    });
    made.map_err(|error| format!("{address}: {error}"))
}

/// A profile of `~/.aws` is not read: without another source, the keys of the machine would be taken in its stead, and nobody be told.
fn has_source(told: &[(String, String)]) -> Result<(), &'static str> {
    let is_set = |name: &str| told.iter().any(|(other, value)| other == name && !value.is_empty());
    if is_set("AWS_PROFILE") && !SOURCES.iter().any(|name| is_set(name)) {
        return Err("`AWS_PROFILE` is set, but profiles are not read; set `AWS_ACCESS_KEY_ID` and `AWS_SECRET_ACCESS_KEY`, \
                    as `aws configure export-credentials --format env` writes them, or unset it");
    }
    Ok(())
}

/// An address without TLS is used only by those who say that they mean it: the client would refuse it, and not say why.
fn is_encrypted(told: &[(String, String)]) -> Result<(), &'static str> {
    let is_plain = |(name, value): &(String, String)| name.starts_with("AWS_ENDPOINT") && value.starts_with("http://");
    if told.iter().any(is_plain) && !told.iter().any(|(name, _)| name == "AWS_ALLOW_HTTP") {
        return Err("`AWS_ENDPOINT` is without TLS (http://); set `AWS_ALLOW_HTTP=true` if that is meant");
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_profile_alone_is_refused() {
        let told = |names: &[&str]| names.iter().map(|name| ((*name).into(), "x".into())).collect::<Vec<_>>();
        assert!(has_source(&told(&["AWS_PROFILE"])).unwrap_err().contains("profiles are not read"));
        has_source(&told(&["AWS_PROFILE", "AWS_ACCESS_KEY_ID"])).unwrap();
        has_source(&told(&["AWS_REGION"])).unwrap();
    }

    #[test]
    fn an_endpoint_without_tls_is_said_to_be_meant() {
        let told = |told: &[(&str, &str)]| told.iter().map(|(name, value)| ((*name).into(), (*value).into())).collect::<Vec<_>>();
        let plain = ("AWS_ENDPOINT_URL", "http://minio:9000");
        assert!(is_encrypted(&told(&[plain])).unwrap_err().contains("AWS_ALLOW_HTTP"));
        is_encrypted(&told(&[plain, ("AWS_ALLOW_HTTP", "true")])).unwrap();
        is_encrypted(&told(&[("AWS_ENDPOINT", "https://minio:9000")])).unwrap();
    }
}
