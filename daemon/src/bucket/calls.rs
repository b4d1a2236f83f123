//! A call of an object store: it has a time limit, is made again with growing pauses, and what its error says is told apart. An error that is no
//! answer is never taken for one: nothing is known then.

use std::future::Future;
use std::pin::pin;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use object_store::Error;
use suture_store::patience::is_hurried;
use tokio::runtime::{Builder, Runtime};

use super::address::BucketAddress;
use super::object::Trouble;
use super::weather::Weather;

/// One call takes no longer.
pub(super) const CALL: Duration = Duration::from_secs(60);
/// So often a call is made before it counts as an outage, with a pause between that doubles.
const TRIES: u32 = 4;
/// The same before the daemon has begun, which waits for them.
const FIRST: (Duration, u32) = (Duration::from_secs(10), 1);
/// A call on its way takes no longer once the daemon is to end, and none is made again.
const LAST: Duration = if cfg!(test) { Duration::from_millis(200) } else { Duration::from_secs(10) };
/// A call asks this often whether the daemon is to end.
const TICK: Duration = Duration::from_millis(50);
const FIRST_PAUSE: Duration = if cfg!(test) { Duration::from_micros(100) } else { Duration::from_millis(100) };

/// A call may find this instead of what it is for.
#[derive(Debug)]
pub(super) enum Failed {
    /// There is no such object.
    Absent,
    /// Its condition does not hold.
    Unmet,
    Trouble(Trouble),
}

impl Failed {
    /// Where either means that the object is not the one that was looked at.
    pub(super) fn or_changed(self) -> Trouble {
        match self {
            Self::Absent | Self::Unmet => Trouble::Changed,
            Self::Trouble(trouble) => trouble,
        }
    }
}

impl<E: Into<Trouble>> From<E> for Failed {
    fn from(error: E) -> Self {
        Self::Trouble(error.into())
    }
}

/// The answer to a call, or for how long it was waited for in vain.
async fn within<T>(call: impl Future<Output = T>, limit: Duration, is_hurried: &impl Fn() -> bool) -> Result<T, Duration> {
    let mut call = pin!(call);
    let (mut waited, mut hurried) = (Duration::ZERO, Duration::ZERO);
    loop {
        if let Ok(answer) = tokio::time::timeout(TICK, call.as_mut()).await {
            return Ok(answer);
        }
        waited += TICK;
        hurried += if is_hurried() { TICK } else { Duration::ZERO };
        if waited >= limit || hurried >= LAST {
            return Err(waited);
        }
    }
}

/// Asked before each try of a call that others may see: may it still be made?
pub(crate) type Gate<'a> = &'a dyn Fn() -> Result<(), Trouble>;

/// Who makes the calls of one bucket.
#[derive(Debug)]
pub(super) struct Caller {
    pub address: BucketAddress,
    runtime: Runtime,
    pub weather: Weather,
    /// Set when the bucket was found good in this life.
    pub proved: OnceLock<()>,
    /// The daemon has begun, and may wait.
    pub is_patient: AtomicBool,
    /// Tells this life from others.
    pub life: u64,
}

impl Caller {
    /// Has a runtime of its own; asks nothing yet.
    ///
    /// # Errors
    /// A line for people.
    pub(super) fn new(address: &BucketAddress) -> Result<Self, String> {
        let runtime = Builder::new_multi_thread().worker_threads(1).thread_name("bucket").enable_all().build();
        let runtime = runtime.map_err(|error| format!("{address}: no thread can be started: {error}"))?;
        Ok(Self {
            address: address.clone(),
            runtime,
            weather: Weather::default(),
            proved: OnceLock::new(),
            is_patient: AtomicBool::new(false),
            life: random(),
        })
    }

    /// Why the bucket is out of reach; `None`: it answers, as far as anyone knows.
    pub(super) fn trouble(&self) -> Option<String> {
        let unproved = || self.proved.get().is_none().then(|| format!("{}: the object store has not answered yet", self.address));
        self.weather.trouble().or_else(unproved)
    }

    /// Makes a call until it is answered, or has failed too often.
    pub(super) fn call<T, F>(&self, make: impl Fn() -> F) -> Result<T, Failed>
    where
        F: Future<Output = Result<T, Error>>,
    {
        self.call_at(&|| Ok(()), make)
    }

    /// The same behind a gate.
    pub(super) fn call_at<T, F>(&self, gate: Gate, make: impl Fn() -> F) -> Result<T, Failed>
    where
        F: Future<Output = Result<T, Error>>,
    {
        let (limit, tries) = if self.is_patient.load(Ordering::Relaxed) { (CALL, TRIES) } else { FIRST };
        let (mut pause, mut n) = (FIRST_PAUSE, 1);
        loop {
            gate()?;
            let reason = match self.runtime.block_on(async { within(make(), limit, &is_hurried).await }) {
                Err(waited) => format!("no answer within {:.0} s", waited.as_secs_f64()),
                Ok(Ok(answer)) => {
                    self.weather.fair();
                    return Ok(answer);
                }
                Ok(Err(error)) => match meaning(&error) {
                    Meaning::Absent => {
                        self.weather.fair();
                        return Err(Failed::Absent);
                    }
                    Meaning::Unmet => {
                        self.weather.fair();
                        return Err(Failed::Unmet);
                    }
                    Meaning::Denied => {
                        return Err(Trouble::Denied(self.foul(&format!(
                            "{}; see that `AWS_…` in the environment lets this daemon use it",
                            one_line(&error)
                        )))
                        .into());
                    }
                    Meaning::Nothing => one_line(&error),
                },
            };
            if n >= tries || is_hurried() {
                return Err(Trouble::Away(self.foul(&format!("the object store does not serve us: {reason}"))).into());
            }
            // The pauses of many who wait for the same store are to differ.
            std::thread::sleep(pause.mul_f64(0.5 + (random() % 256) as f64 / 512.0));
            (pause, n) = (pause * 2, n + 1);
        }
    }

    /// Notes why it does not serve us, and returns the line.
    pub(super) fn foul(&self, reason: &str) -> String {
        let line = format!("{}: {reason}", self.address);
        self.weather.foul(&line);
        line
    }

    /// Of what asks for no object, the absent one is the bucket.
    pub(super) fn gone(&self, failed: Failed) -> Trouble {
        match failed {
            Failed::Absent => {
                Trouble::Denied(self.foul("there is no such bucket; see to its name, `AWS_ENDPOINT` and `AWS_REGION`"))
            }
            other => other.or_changed(),
        }
    }
}

#[derive(Debug, PartialEq)]
enum Meaning {
    Absent,
    Unmet,
    /// The bucket is not ours to use, or not in this way.
    Denied,
    /// Nothing is known of the object.
    Nothing,
}

fn meaning(error: &Error) -> Meaning {
    match error {
        Error::NotFound { .. } => Meaning::Absent,
        Error::AlreadyExists { .. } | Error::Precondition { .. } | Error::NotModified { .. } => Meaning::Unmet,
        Error::PermissionDenied { .. } | Error::Unauthenticated { .. } | Error::NotSupported { .. } => Meaning::Denied,
        _ => Meaning::Nothing,
    }
}

/// The error with its causes; of a document that a server added, its code alone, since such a document may repeat who asked.
fn one_line(error: &Error) -> String {
    let text = suture_store::job::one_line(&error.to_string());
    let (said, document) = text.split_once('<').unwrap_or((&text, ""));
    let code = document.split_once("Code>").and_then(|(_, rest)| rest.split_once('<')).map_or("", |(code, _)| code);
    let line = format!("{said}{code}");
    match line.char_indices().nth(200) {
        Some((at, _)) => format!("{}…", line.get(..at).unwrap_or_default()),
        None => line,
    }
}

/// 0, where the system has no random number to give.
fn random() -> u64 {
    let mut bytes = [0; 8];
    let _ = rustix::rand::getrandom(&mut bytes, rustix::rand::GetRandomFlags::empty());
    u64::from_le_bytes(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A call that nobody answers ends by its limit, or soon after the daemon is to end; one that is answered is not cut.
    #[test]
    fn a_call_waits_less_once_the_daemon_is_to_end() {
        let runtime = Builder::new_current_thread().enable_time().build().unwrap();
        let ended = |limit, is_hurried: &dyn Fn() -> bool| {
            runtime.block_on(async { within(std::future::pending::<()>(), limit, &is_hurried).await.unwrap_err() })
        };
        assert_eq!(ended(2 * TICK, &|| false), 2 * TICK);
        assert_eq!(ended(CALL, &|| true), LAST);
        let answer = async {
            tokio::time::sleep(3 * TICK).await;
            7
        };
        assert_eq!(runtime.block_on(async { within(answer, CALL, &|| true).await }), Ok(7));
    }

    #[test]
    fn nothing_of_who_asked_is_said() {
        let document = "403: <Error><Code>InvalidAccessKeyId</Code><AWSAccessKeyId>AKIA7</AWSAccessKeyId></Error>";
        let line = one_line(&Error::Generic { store: "S3", source: document.into() });
        assert!(line.ends_with("403: InvalidAccessKeyId"), "{line}");
    }

    #[test]
    fn an_error_that_is_no_answer_says_nothing_of_the_object() {
        let (path, source) = (|| String::from("a"), || "status code: 404".into());
        assert_eq!(meaning(&Error::Generic { store: "S3", source: source() }), Meaning::Nothing);
        assert_eq!(meaning(&Error::NotFound { path: path(), source: source() }), Meaning::Absent);
        assert_eq!(meaning(&Error::AlreadyExists { path: path(), source: source() }), Meaning::Unmet);
        assert_eq!(meaning(&Error::PermissionDenied { path: path(), source: source() }), Meaning::Denied);
    }
}
