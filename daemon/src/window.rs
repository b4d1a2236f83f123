//! The hours at which the daemon may work: `run_window = "20:00-07:00"`, by the clock on the wall of the machine's time zone.
//!
//! The clock is asked again at each look, so that a change of summer time or of the clock moves the hours with it, and nothing else: no job depends
//! on it.

use std::fmt;
use std::str::FromStr;

use jiff::Zoned;
use jiff::civil::Date;
use serde::{Deserialize, Deserializer, de};
use suture_store::Time;

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

impl RunWindow {
    /// When it closed last, as of now; where it never closes, when it was `otherwise` last. A time that the clock shows twice counts once, and one that it
    /// leaves out when it has gone by.
    pub(crate) fn closed(&self, otherwise: TimeOfDay, now: &Zoned) -> Option<Time> {
        let mut ends: Vec<u16> = self.0.iter().map(|part| part.to).filter(|end| !self.is_open_at(*end)).collect();
        if ends.is_empty() {
            ends.push(otherwise.0);
        }
        let at = |day: Date, minute: u16| {
            let time = day.at((minute / 60) as i8, (minute % 60) as i8, 0, 0);
            time.to_zoned(now.time_zone().clone()).ok().map(|time| time.timestamp())
        };
        let days = [now.date().yesterday().ok(), Some(now.date())];
        let all = days.into_iter().flatten().flat_map(|day| ends.iter().filter_map(move |end| at(day, *end)));
        let last = all.filter(|end| *end <= now.timestamp()).max()?;
        u64::try_from(last.as_millisecond()).ok().map(Time)
    }
}

/// A time of day, to the minute.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct TimeOfDay(u16);

impl TimeOfDay {
    /// Seven in the morning.
    pub(crate) const SEVEN: Self = Self(7 * 60);
}

impl FromStr for TimeOfDay {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let minute = minute_of(text).ok_or_else(|| format!("`{text}` is no time of day; write it as in \"07:00\""))?;
        Ok(Self(minute % DAY))
    }
}

impl fmt::Display for TimeOfDay {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:02}:{:02}", self.0 / 60, self.0 % 60)
    }
}

impl<'de> Deserialize<'de> for TimeOfDay {
    fn deserialize<D: Deserializer<'de>>(d: D) -> Result<Self, D::Error> {
        String::deserialize(d)?.parse().map_err(de::Error::custom)
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
        let parts: Vec<String> = self.0.iter().map(|part| format!("{}-{}", TimeOfDay(part.from), TimeOfDay(part.to))).collect();
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

    /// When the window closed last, where the clock shows `now`, with summer time as in the middle of Europe.
    fn closed(window: &str, otherwise: &str, now: &str) -> String {
        let zone = jiff::tz::TimeZone::posix("CET-1CEST,M3.5.0,M10.5.0/3").unwrap();
        let now = now.parse::<jiff::civil::DateTime>().unwrap().to_zoned(zone.clone()).unwrap();
        let window = if window.is_empty() { RunWindow::default() } else { window.parse().unwrap() };
        let closed = window.closed(otherwise.parse().unwrap(), &now).unwrap();
        let closed = jiff::Timestamp::from_millisecond(closed.0 as i64).unwrap().to_zoned(zone);
        closed.datetime().to_string()
    }

    #[test]
    fn a_night_ends_when_its_window_closes_or_at_a_time_of_day() {
        for (window, now, end) in [
            ("20:00-07:00", "2026-06-10T07:00:00", "2026-06-10T07:00:00"),
            ("20:00-07:00", "2026-06-10T06:59:59", "2026-06-09T07:00:00"),
            ("20:00-07:00", "2026-06-10T23:00:00", "2026-06-10T07:00:00"),
            ("12:00-13:00, 20:00-24:00", "2026-06-10T00:00:00", "2026-06-10T00:00:00"),
            ("12:00-13:00, 20:00-24:00", "2026-06-10T19:00:00", "2026-06-10T13:00:00"),
            // Where the next part begins, nothing ends.
            ("20:00-24:00, 00:00-07:00", "2026-06-10T03:00:00", "2026-06-09T07:00:00"),
            ("", "2026-06-10T08:30:00", "2026-06-10T08:30:00"),
            ("", "2026-06-10T08:29:59", "2026-06-09T08:30:00"),
            ("00:00-12:00, 12:00-24:00", "2026-06-10T09:00:00", "2026-06-10T08:30:00"),
        ] {
            assert_eq!(closed(window, "08:30", now), end, "{window} at {now}");
        }
    }

    /// Half past two is left out in spring, and comes twice in autumn.
    #[test]
    fn summer_time_makes_no_night_more_and_none_less() {
        let ends = |from: &str, hours: i64| {
            let zone = jiff::tz::TimeZone::posix("CET-1CEST,M3.5.0,M10.5.0/3").unwrap();
            let from = from.parse::<jiff::civil::DateTime>().unwrap().to_zoned(zone).unwrap();
            let window: RunWindow = "20:00-02:30".parse().unwrap();
            let looks = (0..hours * 60).map(|minute| from.checked_add(jiff::SignedDuration::from_mins(minute)).unwrap());
            looks.filter_map(|now| window.closed(TimeOfDay::SEVEN, &now)).collect::<std::collections::BTreeSet<_>>().len()
        };
        // The end before the first look, and that of the night.
        assert_eq!(ends("2026-03-28T12:00:00", 24), 2);
        assert_eq!(ends("2026-10-24T12:00:00", 24), 2);
        assert_eq!(ends("2026-06-10T12:00:00", 24), 2);
    }

    #[test]
    fn what_is_no_time_of_day_is_refused() {
        for text in ["", "7:00", "07", "24:01", "07:60", "at seven"] {
            assert!(text.parse::<TimeOfDay>().unwrap_err().contains("07:00"), "{text}");
        }
        assert_eq!(["07:05", "24:00"].map(|text| text.parse::<TimeOfDay>().unwrap().to_string()), ["07:05", "00:00"]);
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
