//! Dates and times in the forms of ISO 8601.

/// Checks for `YYYY-MM-DD`, optionally `Thh:mm`, seconds, a fraction, and `Z` or an offset.
pub(crate) fn is_iso_8601(text: &str) -> bool {
    let (day, time) = match text.split_once('T') {
        Some((day, time)) => (day, Some(time)),
        None => (text, None),
    };
    is_day(day) && time.is_none_or(is_time)
}

/// Checks for the other forms of ISO 8601: without separators, by week, by day of the year, or with
/// less precision.
pub(crate) fn is_other_iso_8601(text: &str) -> bool {
    let (day, time) = text
        .split_once('T')
        .map_or((text, None), |(day, time)| (day, Some(time)));
    let shape: String = day
        .chars()
        .map(|c| if c.is_ascii_digit() { 'd' } else { c })
        .collect();
    let known = [
        "dddd",
        "dddd-dd",
        "dddddddd",
        "dddd-ddd",
        "ddddddd",
        "dddd-Wdd",
        "dddd-Wdd-d",
        "ddddWdd",
        "ddddWddd",
        "dddd-dd-dd",
    ];
    let is_whole = !matches!(shape.as_str(), "dddd" | "dddd-dd" | "dddd-Wdd" | "ddddWdd");
    let plain_time = |time: &str| {
        let end = time.find(['Z', '+', '-', '.', ',']).unwrap_or(time.len());
        let digits = time.get(..end).unwrap_or_default();
        matches!(digits.len(), 2 | 4 | 6) && digits.bytes().all(|byte| byte.is_ascii_digit())
    };
    let exists = match (day.get(..4), day.get(4..6), day.get(6..)) {
        (Some(year), Some(month), Some(day)) if shape == "dddddddd" => {
            is_day(&format!("{year}-{month}-{day}"))
        }
        _ => shape != "dddd-dd-dd" || is_day(day),
    };
    exists
        && known.contains(&shape.as_str())
        && time.is_none_or(|time| is_whole && (plain_time(time) || is_time(time)))
}

/// Checks for a day that exists.
pub(crate) fn is_day(text: &str) -> bool {
    let parts: Vec<&str> = text.split('-').collect();
    let [year, month, day] = parts.as_slice() else {
        return false;
    };
    let leap = digits(year, 4).is_some_and(|y| y % 4 == 0 && (y % 100 != 0 || y % 400 == 0));
    let last = match digits(month, 2) {
        Some(4 | 6 | 9 | 11) => 30,
        Some(2) if leap => 29,
        Some(2) => 28,
        Some(1..=12) => 31,
        _ => return false,
    };
    digits(year, 4).is_some() && digits(day, 2).is_some_and(|day| (1..=last).contains(&day))
}

fn is_time(text: &str) -> bool {
    let (clock, zone) = match text.find(['Z', '+', '-']) {
        Some(at) => text.split_at(at),
        None => (text, ""),
    };
    let zone_is_right = match zone.as_bytes() {
        [] | [b'Z'] => true,
        [b'+' | b'-', ..] => {
            is_clock(&zone[1..], 2) || digits(&zone[1..], 2).is_some_and(|hours| hours < 24)
        }
        _ => false,
    };
    let (clock, fraction) = clock.split_once(['.', ',']).unwrap_or((clock, "0"));
    let is_fraction = !fraction.is_empty() && fraction.bytes().all(|byte| byte.is_ascii_digit());
    zone_is_right && is_fraction && (is_clock(clock, 2) || is_clock(clock, 3))
}

/// Checks for `hh:mm` or `hh:mm:ss`. A leap second is allowed.
fn is_clock(text: &str, fields: usize) -> bool {
    let parts: Vec<&str> = text.split(':').collect();
    let within =
        |(part, limit): (&&str, u32)| digits(part, 2).is_some_and(|number| number <= limit);
    parts.len() == fields && parts.iter().zip([23, 59, 60]).all(within)
}

/// Parses a number with exactly `count` digits.
pub(crate) fn digits(text: &str, count: usize) -> Option<u32> {
    let plain = text.len() == count && text.bytes().all(|byte| byte.is_ascii_digit());
    plain.then(|| text.parse().ok()).flatten()
}
