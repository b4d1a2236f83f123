//! Sizes and durations as people write them: `512MiB`, `1.5 GB`, `5s`, `2m`, `300ms`; a bare number is bytes or seconds. And addresses.

use std::net::SocketAddr;
use std::time::Duration;

use jiff::Timestamp;
use jiff::tz::TimeZone;
use suture_core::OutputFormat;
use suture_core::words::{At, Count, Short};

/// Splits `text` into its number and its unit.
fn split(text: &str) -> Option<(f64, &str)> {
    let text = text.trim();
    let end = text.find(|c: char| !(c.is_ascii_digit() || c == '.')).unwrap_or(text.len());
    let (number, unit) = text.split_at(end);
    let number: f64 = number.parse().ok()?;
    Some((number, unit.trim()))
}

/// Reads a length in the units of a file.
///
/// # Errors
/// A box by two corners, as `0,0,0:10,10,5`; the least corner comes first in what is returned.
///
/// # Errors
/// A line for people when the text is no box.
pub(crate) fn parse_box(text: &str) -> Result<[[f64; 3]; 2], String> {
    let bad = || format!("`{text}` is no box (try 0,0,0:10,10,5)");
    let corner = |text: &str| -> Option<[f64; 3]> {
        let numbers: Vec<f64> =
            text.split(',').map(|x| x.trim().parse().ok().filter(|x: &f64| x.is_finite())).collect::<Option<_>>()?;
        numbers.try_into().ok()
    };
    let (a, b) = text.split_once(':').and_then(|(a, b)| corner(a).zip(corner(b))).ok_or_else(bad)?;
    Ok([std::array::from_fn(|axis| a[axis].min(b[axis])), std::array::from_fn(|axis| a[axis].max(b[axis]))])
}

/// A share of a whole, neither none of it nor all.
///
/// # Errors
/// A line for people when the text is no such share.
pub(crate) fn parse_share(text: &str) -> Result<f64, String> {
    let share = text.parse::<f64>().ok().filter(|share| *share > 0.0 && *share < 1.0);
    share.ok_or_else(|| "a share between 0 and 1, as 0.1".into())
}

/// A line for people when the text is no number above zero.
pub(crate) fn parse_length(text: &str) -> Result<f64, String> {
    let length = text.trim().parse().ok().filter(|length: &f64| length.is_finite() && *length > 0.0);
    length.ok_or_else(|| format!("`{text}` is no length above zero (try 3 or 0.5; in the units of the file)"))
}

/// Bytes from `1GiB`, `512 MiB`, `2G` (binary), `1.5GB` (decimal), `4096`.
///
/// # Errors
/// A line for people when the text is no size, or is zero.
pub(crate) fn parse_size(text: &str) -> Result<u64, String> {
    let bad = || format!("`{text}` is not a size (try 512MiB or 2GiB)");
    let (number, unit) = split(text).ok_or_else(bad)?;
    let factor: f64 = match unit.to_ascii_lowercase().as_str() {
        "" | "b" => 1.0,
        "k" | "kib" => 1024.0,
        "m" | "mib" => 1024.0 * 1024.0,
        "g" | "gib" => 1024.0 * 1024.0 * 1024.0,
        "t" | "tib" => 1024.0 * 1024.0 * 1024.0 * 1024.0,
        "kb" => 1e3,
        "mb" => 1e6,
        "gb" => 1e9,
        "tb" => 1e12,
        _ => return Err(bad()),
    };
    let bytes = number * factor;
    if !(1.0..9e18).contains(&bytes) {
        return Err(bad());
    }
    // In range, as just checked.
    Ok(bytes as u64)
}

/// A duration from `5s`, `300ms`, `2m`, `1h`, `90d`, `10` (seconds).
///
/// # Errors
/// A line for people when the text is no duration.
pub(crate) fn parse_duration(text: &str) -> Result<Duration, String> {
    let bad = || format!("`{text}` is not a duration (try 5s, 300ms or 2m)");
    let (number, unit) = split(text).ok_or_else(bad)?;
    let factor = match unit {
        "ms" => 1e-3,
        "" | "s" => 1.0,
        "m" | "min" => 60.0,
        "h" => 3600.0,
        "d" => 24.0 * 3600.0,
        _ => return Err(bad()),
    };
    Duration::try_from_secs_f64(number * factor).map_err(|_| bad())
}

/// A size as [`parse_size`] reads it, to the byte: `512MiB`, `1500B`.
pub(crate) fn write_size(bytes: u64) -> String {
    let units = [(1 << 40, "TiB"), (1 << 30, "GiB"), (1 << 20, "MiB"), (1 << 10, "KiB")];
    match units.iter().find(|(unit, _)| bytes >= *unit && bytes.is_multiple_of(*unit)) {
        Some((unit, name)) => format!("{}{name}", bytes / unit),
        None => format!("{bytes}B"),
    }
}

/// A duration as [`parse_duration`] reads it: `2m`, `300ms`, `1.5s`.
pub(crate) fn write_duration(duration: Duration) -> String {
    let (seconds, rest) = (duration.as_secs(), duration.subsec_nanos());
    match (seconds, rest) {
        (0, 0) => "0s".into(),
        (0, rest) if rest.is_multiple_of(1_000_000) => format!("{}ms", rest / 1_000_000),
        (_, 1..) => format!("{}s", duration.as_secs_f64()),
        (seconds, 0) if seconds.is_multiple_of(24 * 3600) => format!("{}d", seconds / (24 * 3600)),
        (seconds, 0) if seconds.is_multiple_of(3600) => format!("{}h", seconds / 3600),
        (seconds, 0) if seconds.is_multiple_of(60) => format!("{}m", seconds / 60),
        (seconds, 0) => format!("{seconds}s"),
    }
}

/// `617.0 KB`, `1.2 GB`: decimal, as file managers show it.
pub(crate) fn show_size(bytes: u64) -> String {
    const UNITS: [&str; 5] = ["B", "KB", "MB", "GB", "TB"];
    let (mut value, mut unit) = (bytes as f64, 0);
    while value >= 999.95 && unit + 1 < UNITS.len() {
        value /= 1000.0;
        unit += 1;
    }
    let name = UNITS.get(unit).copied().unwrap_or("B");
    if unit == 0 { format!("{bytes} B") } else { format!("{value:.1} {name}") }
}

/// `0.04 s`, `3.2 s`, `2 min 05 s`, `1 h 03 min`.
pub(crate) fn show_seconds(seconds: f64) -> String {
    let whole = seconds.round().max(0.0) as u64;
    match whole {
        0..10 => format!("{seconds:.2} s"),
        10..60 => format!("{seconds:.1} s"),
        60..3600 => format!("{} min {:02} s", whole / 60, whole % 60),
        _ => format!("{} h {:02} min", whole / 3600, whole / 60 % 60),
    }
}

/// `12 345 678`, as the engine writes it.
pub(crate) fn show_count(count: u64) -> String {
    Count(count).to_string()
}

/// Five digits, as the engine writes them.
pub(crate) fn show_number(value: f64) -> String {
    Short(value).to_string()
}

/// A place, as the engine writes it.
pub(crate) fn show_point(p: &[f32; 3]) -> String {
    At(*p).to_string()
}

/// A box.
pub(crate) fn show_box([lo, hi]: &[[f32; 3]; 2]) -> String {
    format!("{} to {}", show_point(lo), show_point(hi))
}

/// Day and time where the machine is, of milliseconds since 1970.
pub(crate) fn show_when(ms: u64) -> String {
    let zoned = |at: Timestamp| at.to_zoned(TimeZone::system()).strftime("%Y-%m-%d %H:%M:%S").to_string();
    i64::try_from(ms).ok().and_then(|ms| Timestamp::from_millisecond(ms).ok()).map_or_else(|| "?".into(), zoned)
}

/// An address to listen at.
///
/// # Errors
/// A line for people.
pub(crate) fn parse_listen(text: &str) -> Result<SocketAddr, String> {
    text.parse().map_err(|_| format!("`{text}` is no address with a port (try 127.0.0.1:7878)"))
}

/// Formats of results that can be asked for, by their endings.
pub(crate) const WRITTEN: &str = "stl, 3mf, ply, off, obj, amf";

/// The format whose names have this ending.
///
/// # Errors
/// A line that lists those that there are.
pub(crate) fn parse_format(text: &str) -> Result<OutputFormat, String> {
    OutputFormat::of_ending(text).ok_or_else(|| format!("one of {WRITTEN}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_as_people_write_them() {
        assert_eq!(parse_size("1GiB"), Ok(1 << 30));
        assert_eq!(parse_size(" 512 MiB"), Ok(512 << 20));
        assert_eq!(parse_size("1.5GB"), Ok(1_500_000_000));
        assert_eq!(parse_size("4096"), Ok(4096));
        for bad in ["", "GiB", "-1", "0", "1 parsec", "1e99", "nan"] {
            assert!(parse_size(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn durations_as_people_write_them() {
        assert_eq!(parse_duration("300ms"), Ok(Duration::from_millis(300)));
        assert_eq!(parse_duration("2m"), Ok(Duration::from_secs(120)));
        assert_eq!(parse_duration("10"), Ok(Duration::from_secs(10)));
        for bad in ["", "s", "-5s", "5 weeks"] {
            assert!(parse_duration(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn what_is_written_is_read_as_the_same() {
        for (bytes, text) in [(1, "1B"), (1536, "1536B"), (2048, "2KiB"), (3 << 30, "3GiB"), (1_500_000_000, "1500000000B")] {
            assert_eq!(write_size(bytes), text);
            assert_eq!(parse_size(text), Ok(bytes));
        }
        let ms = Duration::from_millis;
        for (duration, text) in [
            (ms(0), "0s"),
            (ms(300), "300ms"),
            (ms(1500), "1.5s"),
            (ms(90_000), "90s"),
            (ms(120_000), "2m"),
            (ms(7_200_000), "2h"),
            (Duration::from_nanos(1_000_001), "0.001000001s"),
        ] {
            assert_eq!(write_duration(duration), text);
            assert_eq!(parse_duration(text), Ok(duration));
        }
    }

    #[test]
    fn figures_as_people_read_them() {
        assert_eq!(show_size(84), "84 B");
        assert_eq!(show_size(999_999), "1.0 MB");
        assert_eq!(show_count(1_234_567), "1 234 567");
        assert_eq!(show_count(999), "999");
        assert_eq!(show_seconds(125.0), "2 min 05 s");
    }
}
