//! `dateTime`, `date` and `time`.

/// Checks for `-?YYYY-MM-DDThh:mm:ss(.s+)?zone?`
pub(crate) fn is_date_time(text: &str) -> bool {
    let Some((date, time)) = text.split_once('T') else {
        return false;
    };
    is_day(date) && is_time(time)
}

/// Checks for `-?YYYY-MM-DDzone?`
pub(crate) fn is_date(text: &str) -> bool {
    without_zone(text).is_some_and(is_day)
}

/// Checks for `hh:mm:ss(.s+)?zone?`
pub(crate) fn is_time(text: &str) -> bool {
    without_zone(text).is_some_and(is_clock)
}

fn without_zone(text: &str) -> Option<&str> {
    if let Some(rest) = text.strip_suffix('Z') {
        return Some(rest);
    }
    let Some(at) = text
        .len()
        .checked_sub(6)
        .filter(|&at| text.is_char_boundary(at))
    else {
        return Some(text);
    };
    let (rest, zone) = text.split_at(at);
    let Some(offset) = zone
        .strip_prefix(['+', '-'])
        .filter(|zone| zone.as_bytes()[2] == b':')
    else {
        return Some(text);
    };
    let hours = two_digits(&offset[..2])?;
    let minutes = two_digits(&offset[3..])?;
    (hours < 14 && minutes < 60 || hours == 14 && minutes == 0).then_some(rest)
}

fn is_day(text: &str) -> bool {
    let text = text.strip_prefix('-').unwrap_or(text);
    let mut parts = text.split('-');
    let (Some(year), Some(month), Some(day), None) =
        (parts.next(), parts.next(), parts.next(), parts.next())
    else {
        return false;
    };
    let year_fits = year.len() >= 4
        && year.bytes().all(|byte| byte.is_ascii_digit())
        && (year.len() == 4 || !year.starts_with('0'))
        && year != "0000";
    let (Some(month), Some(day)) = (two_digits(month), two_digits(day)) else {
        return false;
    };
    year_fits && (1..=12).contains(&month) && day >= 1 && day <= days_in(month, year)
}

fn days_in(month: u32, year: &str) -> u32 {
    // The calendar repeats every 400 years, so the last four digits decide: 10,000 = 25 × 400.
    let year: u32 = year[year.len() - 4..].parse().unwrap_or(0);
    let leap = year.is_multiple_of(4) && (!year.is_multiple_of(100) || year.is_multiple_of(400));
    match month {
        2 if leap => 29,
        2 => 28,
        4 | 6 | 9 | 11 => 30,
        _ => 31,
    }
}

fn is_clock(text: &str) -> bool {
    let mut parts = text.split(':');
    let (Some(hours), Some(minutes), Some(seconds), None) =
        (parts.next(), parts.next(), parts.next(), parts.next())
    else {
        return false;
    };
    let (whole, fraction) = seconds.split_once('.').unwrap_or((seconds, "0"));
    let fraction_fits = !fraction.is_empty() && fraction.bytes().all(|byte| byte.is_ascii_digit());
    let (Some(hours), Some(minutes), Some(whole)) =
        (two_digits(hours), two_digits(minutes), two_digits(whole))
    else {
        return false;
    };
    let midnight =
        hours == 24 && minutes == 0 && whole == 0 && fraction.bytes().all(|byte| byte == b'0');
    fraction_fits && minutes < 60 && whole < 60 && (hours < 24 || midnight)
}

fn two_digits(text: &str) -> Option<u32> {
    let plain = text.len() == 2 && text.bytes().all(|byte| byte.is_ascii_digit());
    plain.then(|| text.parse().ok()).flatten()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn date_times_follow_calendar_and_clock() {
        for good in [
            "2024-02-29T12:00:00",
            "2020-03-20T12:00:00Z",
            "2020-01-01T24:00:00",
            "2020-01-01T00:00:00.25+01:00",
            "-0001-12-31T23:59:59-14:00",
            "12020-01-01T00:00:00",
        ] {
            assert!(is_date_time(good), "{good}");
        }
        for bad in [
            "2023-02-29T12:00:00",
            "2020-03-20",
            "2020-13-01T00:00:00",
            "2020-01-01T24:00:01",
            "2020-01-01T00:00",
            "0000-01-01T00:00:00",
            "2020-01-01T00:00:00+15:00",
            "2020-01-01T00:00:00.",
            "20-01-01T00:00:00",
            "2020-01-01 00:00:00",
            "2020-01-01T00:00:00+ä1:0",
            "",
        ] {
            assert!(!is_date_time(bad), "{bad}");
        }
        assert!(is_date("2020-01-31Z") && !is_date("2020-04-31"));
        assert!(is_time("23:59:59.5-02:30") && !is_time("23:60:00"));
    }
}
