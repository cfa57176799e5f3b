//! Date-times in the notation of OpenSCENARIO: the extended format of ISO 8601 (`xsd:dateTime`).

use std::fmt;

use crate::types::text::trim;

/// A point in time. Points with and without a time zone do not compare.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DateTime {
    /// Seconds since 1970-01-01T00:00:00. They are in UTC if there is a zone.
    pub seconds: f64,
    /// The year as written.
    pub year: i64,
    /// Whether a zone was given.
    pub has_zone: bool,
}

/// Reason why a text is no date-time, as a sentence fragment.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DateTimeError(pub &'static str);

impl fmt::Display for DateTimeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.0)
    }
}

const FORM: DateTimeError = DateTimeError("must be written like 2026-01-31T18:30:00+01:00");

impl DateTime {
    /// Parses `yyyy-MM-ddThh:mm:ss[.f][Z|±hh:mm]`.
    ///
    /// # Errors
    /// Fails if the text has another form, or if the day or time does not exist.
    pub fn parse(text: &str) -> Result<DateTime, DateTimeError> {
        let text = trim(text);
        let (sign, rest) = text.strip_prefix('-').map_or((1, text), |rest| (-1, rest));
        let (date, time) = rest.split_once('T').ok_or(FORM)?;
        let mut date = date.split('-');
        let year = digits(date.next(), 4..=9)? * sign;
        let month = digits(date.next(), 2..=2)?;
        let day = digits(date.next(), 2..=2)?;
        if date.next().is_some() {
            return Err(FORM);
        }
        if !(1..=12).contains(&month) {
            return Err(DateTimeError("has a month that is not from 01 to 12"));
        }
        if day < 1 || day > days(year, month) {
            return Err(DateTimeError("has a day that does not exist in its month"));
        }
        let (clock, zone) = split_zone(time)?;
        let of_day = clock_seconds(clock)?;
        let days = days_since_1970(year, month, day);
        Ok(DateTime {
            seconds: days as f64 * 86_400.0 + of_day - zone.unwrap_or(0) as f64 * 60.0,
            year,
            has_zone: zone.is_some(),
        })
    }
}

fn digits(text: Option<&str>, len: std::ops::RangeInclusive<usize>) -> Result<i64, DateTimeError> {
    let text = text.ok_or(FORM)?;
    let plain = len.contains(&text.len()) && text.bytes().all(|byte| byte.is_ascii_digit());
    if plain {
        text.parse().map_err(|_| FORM)
    } else {
        Err(FORM)
    }
}

/// Splits a time into the clock and the zone in minutes.
fn split_zone(time: &str) -> Result<(&str, Option<i64>), DateTimeError> {
    if let Some(clock) = time.strip_suffix('Z') {
        return Ok((clock, Some(0)));
    }
    let Some(at) = time.rfind(['+', '-']) else {
        return Ok((time, None));
    };
    let (clock, zone) = time.split_at(at);
    let sign = if zone.starts_with('-') { -1 } else { 1 };
    let (hours, minutes) = zone[1..].split_once(':').ok_or(DateTimeError(
        "has a time zone that is not written like +01:00",
    ))?;
    let (hours, minutes) = (digits(Some(hours), 2..=2)?, digits(Some(minutes), 2..=2)?);
    let minutes_in_all = hours * 60 + minutes;
    if minutes > 59 || minutes_in_all > 14 * 60 {
        return Err(DateTimeError("has a time zone beyond ±14:00"));
    }
    Ok((clock, Some(sign * minutes_in_all)))
}

fn clock_seconds(clock: &str) -> Result<f64, DateTimeError> {
    let mut parts = clock.split(':');
    let hours = digits(parts.next(), 2..=2)?;
    let minutes = digits(parts.next(), 2..=2)?;
    let seconds = parts.next().ok_or(FORM)?;
    if parts.next().is_some() {
        return Err(FORM);
    }
    let (whole, fraction) = match seconds.split_once('.') {
        Some((whole, fraction)) => (whole, Some(fraction)),
        None => (seconds, None),
    };
    let whole = digits(Some(whole), 2..=2)?;
    let part = match fraction {
        None => 0.0,
        Some(text) if !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit()) => {
            format!("0.{text}").parse().map_err(|_| FORM)?
        }
        Some(_) => return Err(FORM),
    };
    let midnight = hours == 24 && minutes == 0 && whole == 0 && part == 0.0;
    if !midnight && (hours > 23 || minutes > 59 || whole > 59) {
        return Err(DateTimeError("has a time that does not exist"));
    }
    Ok((hours * 3600 + minutes * 60 + whole) as f64 + part)
}

fn days(year: i64, month: i64) -> i64 {
    let leap = year % 4 == 0 && (year % 100 != 0 || year % 400 == 0);
    match month {
        2 if leap => 29,
        2 => 28,
        4 | 6 | 9 | 11 => 30,
        _ => 31,
    }
}

/// Returns the days in the proleptic Gregorian calendar (Howard Hinnant, "chrono-compatible
/// low-level date algorithms", `days_from_civil`).
fn days_since_1970(year: i64, month: i64, day: i64) -> i64 {
    let year = if month <= 2 { year - 1 } else { year };
    let era = year.div_euclid(400);
    let of_era = year.rem_euclid(400);
    let of_year = (153 * ((month + 9) % 12) + 2) / 5 + day - 1;
    era * 146_097 + of_era * 365 + of_era / 4 - of_era / 100 + of_year - 719_468
}

#[cfg(test)]
mod tests {
    use super::DateTime;

    fn seconds(text: &str) -> Option<f64> {
        DateTime::parse(text).ok().map(|time| time.seconds)
    }

    #[test]
    fn instants_are_counted_from_1970() {
        assert_eq!(seconds("1970-01-01T00:00:00"), Some(0.0));
        assert_eq!(seconds("2000-03-01T00:00:00Z"), Some(951_868_800.0));
        assert_eq!(
            seconds(" 2020-02-29T12:00:00.5+01:00 "),
            Some(1_582_974_000.5)
        );
        assert_eq!(
            seconds("2020-02-28T24:00:00"),
            seconds("2020-02-29T00:00:00")
        );
    }

    #[test]
    fn impossible_dates_are_refused() {
        for text in [
            "",
            "T",
            "2026-02-30T00:00:00",
            "2025-02-29T00:00:00",
            "2026-13-01T00:00:00",
            "2026-01-01",
            "2026-01-01T25:00:00",
            "2026-01-01T24:00:01",
            "2026-01-01T00:60:00",
            "2026-01-01T00:00:60",
            "20260101T000000",
            "2026-01-01T00:00:00.",
            "2026-01-01T00:00:00+1",
            "2026-01-01T00:00:00+15:00",
            "26-01-01T00:00:00",
            "2026-01-01 00:00:00",
            "2026-1-01T00:00:00",
            "2026-01-01T00:00",
        ] {
            assert!(DateTime::parse(text).is_err(), "{text}");
        }
    }
}
