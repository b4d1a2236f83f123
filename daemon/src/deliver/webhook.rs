//! A message to a webhook, signed so that the receiver can tell that it is ours, and when it was sent:
//!
//! ```text
//! Suture-Delivery: 19ac4f0e2b1-17            the same at each try, and of no other message
//! Suture-Signature: t=1764169445,v1=5257a8…  HMAC-SHA256 with the secret, of `1764169445.` and the body
//! ```

use std::path::Path;
use std::time::Duration;

use hmac::{Hmac, KeyInit, Mac};
use sha2::Sha256;
use suture_store::Time;

use super::http;
use super::pace::Outcome;
use crate::config::events::Webhook;
use crate::world::World;

/// How long a receiver may take in all.
const PATIENCE: Duration = Duration::from_secs(10);
/// A shorter secret could be guessed.
const SHORTEST: usize = 16;

/// Sends it once.
pub(super) fn send(hook: &Webhook, id: &str, body: &[u8], world: &dyn World, is_cut: &dyn Fn() -> bool) -> Outcome {
    let mut headers = vec![("Suture-Delivery", id.to_owned())];
    if let Some(file) = &hook.secret_file {
        match secret(file).and_then(|secret| sign(&secret, world.wall(), body)) {
            Ok(signature) => headers.push(("Suture-Signature", signature)),
            Err(why) => return Outcome::Again { why, after: None },
        }
    }
    let began = world.steady();
    let is_over = || is_cut() || world.steady().duration_since(began) >= PATIENCE;
    match http::post(&hook.url, &headers, body, &is_over) {
        Ok(answer) => Outcome::of(answer.status, answer.retry_after),
        Err(_) if is_cut() => Outcome::Cut,
        Err(error) => Outcome::Again { why: error.to_string(), after: None },
    }
}

/// Read at each try, so that another one needs no restart.
fn secret(file: &Path) -> Result<String, String> {
    let text = std::fs::read_to_string(file).map_err(|error| format!("{}: cannot read the secret: {error}", file.display()))?;
    let secret = text.trim();
    if secret.len() < SHORTEST {
        let file = file.display();
        return Err(format!("{file}: a secret has {SHORTEST} characters at least (try `openssl rand -hex 32`)"));
    }
    Ok(secret.to_owned())
}

fn sign(secret: &str, at: Time, body: &[u8]) -> Result<String, String> {
    let seconds = at.0 / 1000;
    let mut mac = Hmac::<Sha256>::new_from_slice(secret.as_bytes()).map_err(|error| format!("the secret is no key: {error}"))?;
    mac.update(format!("{seconds}.").as_bytes());
    mac.update(body);
    let digest: String = mac.finalize().into_bytes().iter().map(|byte| format!("{byte:02x}")).collect();
    Ok(format!("t={seconds},v1={digest}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As `printf '1764169445.{"a":1}' | openssl dgst -sha256 -hmac 0123456789abcdef` has it.
    #[test]
    fn a_signature_is_what_others_compute() {
        let signed = sign("0123456789abcdef", Time(1_764_169_445_999), b"{\"a\":1}").unwrap();
        assert_eq!(signed, "t=1764169445,v1=05e98058f3c371c29d6cc8dbd4d61042a270275ed498196bb506b4cc74fbfeb4");
    }

    #[test]
    fn a_secret_that_is_short_or_missing_is_said_so() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("secret");
        assert!(secret(&file).unwrap_err().contains("cannot read the secret"));
        std::fs::write(&file, " short \n").unwrap();
        assert!(secret(&file).unwrap_err().contains("openssl rand"));
        std::fs::write(&file, "  0123456789abcdef\n").unwrap();
        assert_eq!(secret(&file).unwrap(), "0123456789abcdef");
    }
}
