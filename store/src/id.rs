//! Names for numbers that must not be mixed up, and the clock.

use std::fmt;
use std::sync::OnceLock;
use std::time::Instant;

use serde::{Deserialize, Deserializer, Serialize, Serializer, de};

macro_rules! number {
    ($(#[$doc:meta])* $name:ident($inner:ty)) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
        #[serde(transparent)]
        pub struct $name(pub $inner);

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                self.0.fmt(f)
            }
        }
    };
}

number! {
    /// A job's number, counted from 1 in order of submission, never used twice.
    JobId(u64)
}
number! {
    /// One life of the daemon: raised, durably, each time the store is opened. A claim of an earlier epoch is void.
    Epoch(u64)
}
number! {
    /// Fences a claim: larger than every token issued before. Who holds an older one can change nothing any more.
    Token(u64)
}
number! {
    /// How often a job was started, this time included; counted before the worker starts.
    Attempt(u32)
}
number! {
    /// The number of a transition: every durable change has the next one.
    Seq(u64)
}
number! {
    /// A digest of all that decides a result. It finds results that may be alike; that they are, whoever takes one sees for itself.
    Recipe(u64)
}
number! {
    /// Milliseconds since 1970 by the store's clock. For people and for pauses; nothing's correctness rests on it.
    Time(u64)
}

number! {
    /// One life of the machine: a digest of the system's boot id; 0 where the system has none.
    Boot(u64)
}

impl Attempt {
    /// The attempt after this one.
    pub fn next(self) -> Self {
        Self(self.0.saturating_add(1))
    }
}

impl std::str::FromStr for JobId {
    type Err = std::num::ParseIntError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        text.parse().map(Self)
    }
}

impl Time {
    /// This instant, later by `ms` milliseconds.
    pub fn plus_ms(self, ms: u64) -> Self {
        Self(self.0.saturating_add(ms))
    }
}

impl Boot {
    /// Is it known that the machine went down between the two?
    pub fn differs(self, other: Self) -> bool {
        self != Self(0) && other != Self(0) && self != other
    }
}

/// Where the store's time comes from, and in which life of the machine it is.
pub trait Clock: Send + Sync {
    /// The time of day.
    fn now(&self) -> Time;
    /// Which start of the machine this is.
    fn boot(&self) -> Boot;
    /// Milliseconds by a clock that only goes forward, from any beginning; nothing sets it.
    fn ticks(&self) -> u64;
}

/// The system's wall clock.
#[derive(Clone, Copy, Debug, Default)]
pub struct SystemClock;

impl Clock for SystemClock {
    fn now(&self) -> Time {
        let since = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap_or_default();
        Time(u64::try_from(since.as_millis()).unwrap_or(u64::MAX))
    }

    fn boot(&self) -> Boot {
        static BOOT: OnceLock<Boot> = OnceLock::new();
        // The first half of a random number of 128 bits.
        *BOOT.get_or_init(|| {
            let id = std::fs::read_to_string("/proc/sys/kernel/random/boot_id").unwrap_or_default();
            let digits: String = id.chars().filter(char::is_ascii_hexdigit).take(16).collect();
            Boot(u64::from_str_radix(&digits, 16).unwrap_or(0))
        })
    }

    fn ticks(&self) -> u64 {
        static BEGAN: OnceLock<Instant> = OnceLock::new();
        u64::try_from(BEGAN.get_or_init(Instant::now).elapsed().as_millis()).unwrap_or(u64::MAX)
    }
}

/// A content hash of 32 bytes (the daemon uses BLAKE3), hexadecimal in text.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Hash(pub [u8; 32]);

impl fmt::Display for Hash {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}

impl fmt::Debug for Hash {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

impl std::str::FromStr for Hash {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let wrong = "a hash is 64 hexadecimal digits";
        let digits: Option<Vec<u8>> = text.chars().map(|c| c.to_digit(16).and_then(|digit| u8::try_from(digit).ok())).collect();
        let bytes: Vec<u8> =
            digits.ok_or(wrong)?.chunks(2).map(|pair| pair.iter().fold(0, |sum, digit| (sum << 4) | digit)).collect();
        if text.len() != 64 {
            return Err(wrong);
        }
        bytes.try_into().map(Self).map_err(|_| wrong)
    }
}

impl Serialize for Hash {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for Hash {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        String::deserialize(deserializer)?.parse().map_err(de::Error::custom)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hash_text_is_reversible_and_strict() {
        let mut bytes = [0; 32];
        bytes[0] = 0xa5;
        bytes[31] = 0x0f;
        let text = Hash(bytes).to_string();
        assert!(text.starts_with("a500") && text.ends_with("000f") && text.len() == 64);
        assert_eq!(text.parse::<Hash>(), Ok(Hash(bytes)));
        assert!(text[1..].parse::<Hash>().is_err());
        assert!(text.replace('a', "g").parse::<Hash>().is_err());
    }
}
