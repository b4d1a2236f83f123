//! The hours at which the daemon may work: `run_window = "20:00-07:00"`, by the clock on the wall of the machine's time zone.
//!
//! The clock is asked again at each look, so that a change of summer time or of the clock moves the hours with it, and nothing else: no job depends
//! on it.

use std::fmt;
use std::str::FromStr;

use jiff::Zoned;
use serde::{Deserialize, Deserializer, de};

/// Minutes of a day.
const DAY: u16 = 24 * 60;

/// A part of the day, from a minute to before another one; over midnight if that is the smaller one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Part {
    from: u16,
    to: u16,
}

/// Parts of the day; the whole day if there is none.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct RunWindow(Vec<Part>);

impl RunWindow {
    /// Is it open at this minute of the day?
    fn is_open_at(&self, minute: u16) -> bool {
        let is_in = |part: &Part| match part.from < part.to {
            true => (part.from..part.to).contains(&minute),
            false => minute >= part.from || minute < part.to,
        };
        self.0.is_empty() || self.0.iter().any(is_in)
    }

    /// Is it open when the clock on the wall shows this? The clock is asked only where it changes something.
    pub(crate) fn is_open(&self, now: &dyn Fn() -> Zoned) -> bool {
        self.0.is_empty() || {
            let now = now();
            self.is_open_at(now.hour() as u16 * 60 + now.minute() as u16)
        }
    }
}

impl FromStr for RunWindow {
    type Err = String;

    /// Such as `20:00-07:00`, or several with commas between them.
    fn from_str(text: &str) -> Result<Self, String> {
        text.split(',').map(|part| part.trim().parse()).collect::<Result<Vec<Part>, String>>().map(Self)
    }
}

impl FromStr for Part {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || format!("`{text}` is no part of a day; write it as in \"20:00-07:00\"");
        let (from, to) = text.split_once('-').ok_or_else(wrong)?;
        let part = Self { from: minute_of(from).ok_or_else(wrong)?, to: minute_of(to).ok_or_else(wrong)? % DAY };
        if part.from == part.to {
            return Err(format!("`{text}` has no length; leave `run_window` out to work at all hours"));
        }
        Ok(part)
    }
}

/// The minute of the day that `20:00` is; 24:00 is the last one's end.
fn minute_of(text: &str) -> Option<u16> {
    let (hours, minutes) = text.trim().split_once(':')?;
    let number = |text: &str| (text.len() == 2).then(|| text.parse::<u16>().ok()).flatten();
    let (hours, minutes) = (number(hours)?, number(minutes)?);
    let minute = hours * 60 + minutes;
    (minutes < 60 && minute <= DAY).then_some(minute)
}

impl fmt::Display for RunWindow {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let time = |minute: u16| format!("{:02}:{:02}", minute / 60, minute % 60);
        let parts: Vec<String> = self.0.iter().map(|part| format!("{}-{}", time(part.from), time(part.to))).collect();
        f.write_str(&parts.join(", "))
    }
}

impl<'de> Deserialize<'de> for RunWindow {
    fn deserialize<D: Deserializer<'de>>(d: D) -> Result<Self, D::Error> {
        String::deserialize(d)?.parse().map_err(de::Error::custom)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn is_open(window: &str, time: &str) -> bool {
        window.parse::<RunWindow>().unwrap().is_open_at(minute_of(time).unwrap())
    }

    #[test]
    fn a_night_goes_over_midnight() {
        for time in ["20:00", "23:59", "00:00", "06:59"] {
            assert!(is_open("20:00-07:00", time), "{time}");
        }
        for time in ["07:00", "12:00", "19:59"] {
            assert!(!is_open("20:00-07:00", time), "{time}");
        }
        assert!(is_open("12:00-13:00, 20:00-24:00", "12:30") && is_open("12:00-13:00, 20:00-24:00", "23:59"));
        assert!(!is_open("12:00-13:00, 20:00-24:00", "00:00"));
    }

    #[test]
    fn without_a_window_all_hours_are_open() {
        assert!((0..DAY).all(|minute| RunWindow::default().is_open_at(minute)));
        assert!(RunWindow::default().is_open(&|| unreachable!("the clock is not asked")));
    }

    #[test]
    fn what_is_no_part_of_a_day_is_refused() {
        for text in ["", "20:00", "20-07", "20:00-25:00", "20:60-07:00", "8:00-9:00", "24:00-24:30", "at night"] {
            assert!(text.parse::<RunWindow>().is_err(), "{text}");
        }
        assert!("07:00-07:00".parse::<RunWindow>().unwrap_err().contains("no length"));
        assert_eq!("20:00-24:00,  12:00-13:00".parse::<RunWindow>().unwrap().to_string(), "20:00-00:00, 12:00-13:00");
    }
}
