//! Conversion of one issue into a SARIF result.

use qcbus_formats::xqar::{Checker, Issue, Level};
use qcbus_reporter_sdk::{IssueLocation, fingerprint, issue_locations};

use crate::artifact::Paths;
use crate::limits::MOST_PLACES;
use crate::log::{
    ArtifactLocation, FindingProperties, Fingerprints, Location, LogicalLocation, Message,
    PhysicalLocation, Region, SarifResult, Severity,
};
use crate::text;

/// Largest line or column number. Tools that read SARIF use 32 bits, and no file has more.
const LARGEST_LINE: u64 = i32::MAX as u64;

/// Returns the id of the rule that an issue violates.
pub(crate) fn rule_id(checker: &Checker, issue: &Issue) -> String {
    let named = [issue.rule_uid.as_str(), &checker.id].map(text::name);
    let mut named = named.into_iter().filter(|name| !name.is_empty());
    named.next().unwrap_or_else(|| "unnamed".to_owned())
}

/// Returns the severity of a level.
pub(crate) fn severity(level: Level) -> Severity {
    match level {
        Level::Error => Severity::Error,
        Level::Warning => Severity::Warning,
        Level::Information => Severity::Note,
    }
}

/// Returns an issue of the file with this display path as a SARIF result.
pub(crate) fn finding(
    display_path: &str,
    paths: &Paths,
    checker: &Checker,
    issue: &Issue,
) -> SarifResult {
    let places = issue_locations(issue);
    let rule_id = rule_id(checker, issue);
    let hash = fingerprint(display_path, &rule_id, issue, places.first());
    let (related_locations, left_out) = related(&places, paths);
    SarifResult {
        level: severity(issue.level),
        message: plain(&text::message(&issue.description)),
        locations: vec![main(places.first(), paths)],
        related_locations,
        partial_fingerprints: Fingerprints {
            primary_location_line_hash: hash,
        },
        properties: properties(places.first(), left_out),
        rule_id,
        rule_index: None,
    }
}

/// Returns a message without Markdown.
pub(crate) fn plain(text: &str) -> Message {
    Message {
        text: text.to_owned(),
        markdown: None,
    }
}

/// Returns the location of a whole file.
pub(crate) fn whole_file(file: ArtifactLocation) -> Location {
    Location {
        physical_location: PhysicalLocation {
            artifact_location: file,
            region: None,
        },
        logical_locations: Vec::new(),
        message: None,
    }
}

/// Returns the main place in the checked file, or the reference to it if it is in another file.
fn main(place: Option<&IssueLocation>, paths: &Paths) -> Location {
    let mut location = whole_file(paths.checked());
    let Some(place) = place else {
        return location;
    };
    location.physical_location.region = match &place.path {
        None => region(place.row, place.column),
        Some(_) => {
            let reference = place.referred_at;
            reference.and_then(|(row, column)| region(Some(row), Some(column)))
        }
    };
    if place.path.is_none() {
        location.logical_locations = element(place);
        location.message = seen(place);
    }
    location
}

/// Returns the other places without duplicates, up to the limit, and the number left out.
fn related(places: &[IssueLocation], paths: &Paths) -> (Vec<Location>, Option<usize>) {
    let mut related = Vec::new();
    let mut left_out = 0;
    for (number, place) in places.iter().enumerate() {
        let own = (number > 0 || place.path.is_some()).then(|| full(place, paths));
        let also = place.also.iter().map(|&(row, column)| {
            let mut location = whole_file(paths.checked());
            location.physical_location.region = region(Some(row), Some(column));
            location.message = seen(place);
            location
        });
        for location in own.into_iter().chain(also) {
            // One of the places is reserved for the main place.
            match related.contains(&location) {
                true => {}
                false if related.len() + 1 < MOST_PLACES => related.push(location),
                false => left_out += 1,
            }
        }
    }
    (related, (left_out > 0).then_some(left_out))
}

fn full(place: &IssueLocation, paths: &Paths) -> Location {
    let file = match &place.path {
        Some(path) => paths.other(path),
        None => paths.checked(),
    };
    let mut location = whole_file(file);
    location.physical_location.region = region(place.row, place.column);
    location.logical_locations = element(place);
    location.message = seen(place);
    location
}

fn element(place: &IssueLocation) -> Vec<LogicalLocation> {
    let name = |xpath: &String| LogicalLocation {
        fully_qualified_name: text::name(xpath),
    };
    let mut named = place.xpath.iter().map(name).collect::<Vec<_>>();
    named.retain(|it| !it.fully_qualified_name.is_empty());
    named
}

fn seen(place: &IssueLocation) -> Option<Message> {
    let said = place.description.trim();
    (!said.is_empty()).then(|| plain(&text::message(said)))
}

fn region(row: Option<u64>, column: Option<u64>) -> Option<Region> {
    let known = |number: &u64| (1..=LARGEST_LINE).contains(number);
    Some(Region {
        start_line: row.filter(known)?,
        start_column: column.filter(known),
    })
}

fn properties(place: Option<&IssueLocation>, left_out: Option<usize>) -> FindingProperties {
    let road = place.and_then(|place| place.road.as_ref());
    let point = place.and_then(|place| place.inertial);
    FindingProperties {
        road: road.map(|(id, ..)| text::name(id)),
        s: road.and_then(|&(_, s, _)| metres(s)),
        t: road.and_then(|&(.., t)| metres(t)),
        x: point.and_then(|(x, ..)| metres(x)),
        y: point.and_then(|(_, y, _)| metres(y)),
        z: point.and_then(|(.., z)| metres(z)),
        places_left_out: left_out,
    }
}

/// Rounds a number to the millimetre. JSON has no representation of NaN and infinity, and no place
/// on Earth is further than 10^9 m. Within these bounds, a number reads back unchanged.
fn metres(number: f64) -> Option<f64> {
    let is_place = number.is_finite() && number.abs() < 1e9;
    // Adding zero converts negative zero to zero.
    is_place.then(|| (number * 1000.0).round() / 1000.0 + 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn impossible_line_numbers_are_unknown() {
        let at = |row, column| region(row, column).map(|it| (it.start_line, it.start_column));
        assert_eq!(at(Some(3), Some(4)), Some((3, Some(4))));
        assert_eq!(at(Some(3), Some(0)), Some((3, None)));
        assert_eq!(at(Some(3), Some(u64::MAX)), Some((3, None)));
        for row in [None, Some(0), Some(u64::MAX)] {
            assert_eq!(at(row, Some(4)), None);
        }
    }

    #[test]
    fn positions_are_rounded_and_implausible_ones_dropped() {
        assert_eq!(metres(12.345_678), Some(12.346));
        assert_eq!(metres(-0.000_1).map(f64::to_bits), Some(0.0_f64.to_bits()));
        for number in [f64::NAN, f64::INFINITY, 1e300, -1e9] {
            assert_eq!(metres(number), None);
        }
    }
}
