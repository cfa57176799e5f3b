use crate::families::shown::{beside, number};
use crate::prelude::*;
use qcbus_document::ValueError;

pub const RULE: Rule<Document> = Rule {
    after: &["check_asam_xodr_xml_fileheader_is_present"],
    run,
    ..Rule::DEFAULTS
};

/// Tolerance in metres by which a bound may be less than the other.
const ROUNDING: f64 = 1e-9;

/// First version whose header table requires ISO 8601.
const ISO_DATES_SINCE: Version = Version::new(1, 6);

fn run(document: &Document<'_>, found: &mut Sink<'_>) {
    let Some(root) = document.root() else { return };
    let mut headers = root.children_named("header");
    let Some(header) = headers.next() else { return };
    for second in headers {
        let text = "there is a second `header`; a file must have exactly one";
        found.issue(second, text).at(header, "the first one");
    }
    if let Some(before) = root.children().next().filter(|first| *first != header) {
        let text = format!(
            "the header comes after `{}`; it must be the first element in the file",
            before.name()
        );
        found
            .issue(header, text)
            .level(Level::Warning)
            .at(before, "the element before it");
    }
    extent(header, found);
    numbers(
        header.child("offset"),
        &[("x", "m"), ("y", "m"), ("z", "m"), ("hdg", "rad")],
        found,
    );
    date(header, found);
}

/// Checks the extent in metres: the greater bound must not be below the smaller one.
fn extent(header: Node<'_>, found: &mut Sink<'_>) {
    numbers(
        Some(header),
        &[("north", "m"), ("south", "m"), ("east", "m"), ("west", "m")],
        found,
    );
    for (greater, smaller) in [("north", "south"), ("east", "west")] {
        if let (Ok(most), Ok(least)) = (header.f64(greater), header.f64(smaller))
            && most < least - ROUNDING
        {
            let text = format!(
                "`{greater}` is {} m and less than `{smaller}`, which is {} m; it must be the greater bound",
                beside(most, least),
                number(least)
            );
            found.issue(Place::attribute_or_node(header, greater), text);
        }
    }
}

/// Checks that each given attribute is a finite double.
fn numbers(node: Option<Node<'_>>, attributes: &[(&'static str, &str)], found: &mut Sink<'_>) {
    let Some(node) = node else { return };
    for (name, unit) in attributes {
        let value = match node.f64(name) {
            Err(ValueError::Missing { .. }) => continue,
            Ok(number) if number.is_finite() => continue,
            _ => node.attr(name).unwrap_or_default(),
        };
        let text = format!(
            "`{name}` of `{}` is `{value}`, but must be a finite number [{unit}] that fits a double (IEEE 754)",
            node.name()
        );
        found.issue(Place::attribute_or_node(node, name), text);
    }
}

fn date(header: Node<'_>, found: &mut Sink<'_>) {
    let Some(date) = header.attr("date").filter(|date| !date.trim().is_empty()) else {
        return;
    };
    if found
        .version()
        .is_none_or(|version| version < ISO_DATES_SINCE)
    {
        no_such_day(header, date, found);
        return;
    }
    if is_iso_8601(date) {
        return;
    }
    // The standard prefers one form but allows all of ISO 8601.
    let fault = if is_other_iso_8601(date) {
        "has a form of ISO 8601 that some readers do not know; the preferred form is"
    } else {
        "does not have the form that ISO 8601 requires, such as"
    };
    let text = format!("the date `{date}` {fault} `2026-01-31T12:30:00`");
    found
        .issue(Place::attribute_or_node(header, "date"), text)
        .level(Level::Information);
}

/// Reports a date in ISO form with a day that does not exist. In versions that do not require ISO
/// 8601, any other form is allowed.
fn no_such_day(header: Node<'_>, date: &str, found: &mut Sink<'_>) {
    let day = date.trim().get(..10).unwrap_or_default();
    let mut parts = day.split('-');
    let shape = [4, 2, 2].map(|count| {
        parts
            .next()
            .is_some_and(|part| digits(part, count).is_some())
    });
    if shape == [true; 3] && !is_day(day) {
        let text = format!(
            "the date `{date}` has the day `{day}`, which does not exist in any calendar; a date must be written \
             as year, month and day"
        );
        found
            .issue(Place::attribute_or_node(header, "date"), text)
            .level(Level::Warning);
    }
}

/// Checks for `YYYY-MM-DD`, optionally `Thh:mm`, seconds, a fraction, and `Z` or an offset.
fn is_iso_8601(text: &str) -> bool {
    let (day, time) = match text.split_once('T') {
        Some((day, time)) => (day, Some(time)),
        None => (text, None),
    };
    is_day(day) && time.is_none_or(is_time)
}

/// Checks for the other forms of ISO 8601: without separators, by week, by day of the year, or with
/// less precision.
fn is_other_iso_8601(text: &str) -> bool {
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

fn is_day(text: &str) -> bool {
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

fn digits(text: &str, count: usize) -> Option<u32> {
    let plain = text.len() == count && text.bytes().all(|byte| byte.is_ascii_digit());
    plain.then(|| text.parse().ok()).flatten()
}

#[cfg(test)]
mod tests {
    use super::is_iso_8601;

    #[test]
    fn iso_8601_dates_are_recognised() {
        for right in [
            "2024-02-29",
            "2026-01-31T12:30:00",
            "2026-01-31T12:30:00.25Z",
            "2026-01-31T12:30+01:00",
        ] {
            assert!(is_iso_8601(right), "{right}");
        }
        for wrong in [
            "2023-02-29",
            "Thu Apr 20 14:40:28 2017",
            "2026-1-31",
            "2026-01-31T24:01:00",
            "2026-01-31T12:30:00.",
            "",
        ] {
            assert!(!is_iso_8601(wrong), "{wrong}");
        }
    }
}
