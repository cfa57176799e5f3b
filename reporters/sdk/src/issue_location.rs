//! Places of an issue, including those in other files.

use qcbus_formats::location::OtherPlace;
use qcbus_formats::xqar::{Issue, Location, Locations};
use qcbus_messages::ResultMessage;

/// Place of an issue, collected from the different kinds of locations in a result.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct IssueLocation {
    /// Path of the file; `None` for the checked file itself.
    pub path: Option<String>,
    /// Line, from 1. A 0 for "unknown" from other tools is `None` here.
    pub row: Option<u64>,
    /// Column in characters, from 1. A 0 for "unknown" from other tools is `None` here.
    pub column: Option<u64>,
    /// Bytes from the start of the file, if known.
    pub offset: Option<u64>,
    /// XPath of the element or attribute.
    pub xpath: Option<String>,
    /// Id of the road, and `s` and `t` in metres.
    pub road: Option<(String, f64, f64)>,
    /// `x`, `y` and `z` in metres.
    pub inertial: Option<(f64, f64, f64)>,
    /// Time in seconds from the start.
    pub time: Option<f64>,
    /// Number of a message in a trace, and its channel.
    pub message: Option<(u64, String)>,
    /// Description of the place.
    pub description: String,
    /// Row and column of the reference to another file, in the checked file.
    pub referred_at: Option<(u64, u64)>,
    /// Further rows and columns with the same description.
    pub also: Vec<(u64, u64)>,
}

/// Returns the places of an issue in their order; the first is the main one.
pub fn issue_locations(issue: &Issue) -> Vec<IssueLocation> {
    // Another tool may give only the place in the other file.
    if let ([], [info]) = (issue.locations.as_slice(), issue.domain_info.as_slice())
        && let Some(place) = OtherPlace::from_info(info)
    {
        return vec![moved(&place, IssueLocation::default())];
    }
    let place_of = |locations: &Locations| match &locations.elsewhere {
        Some(other) => moved(other, gather(locations)),
        None => gather(locations),
    };
    issue.locations.iter().map(place_of).collect()
}

/// Returns the display path of another file. It is relative to the base directory of the checked
/// file's path if the file is below that directory.
pub fn path_for_people<'p>(result: &ResultMessage, path: &'p str) -> &'p str {
    let base = result.input.strip_suffix(&result.display_path);
    let base = base.filter(|base| base.ends_with('/'));
    let short = base.and_then(|base| path.strip_prefix(base));
    short.unwrap_or(path)
}

/// Collects all data of one `Locations`.
fn gather(locations: &Locations) -> IssueLocation {
    let mut place = IssueLocation {
        description: locations.description.trim().to_owned(),
        ..IssueLocation::default()
    };
    let mut seen_file = false;
    for location in &locations.places {
        match location {
            Location::File {
                row,
                column,
                offset,
            } if !seen_file => {
                seen_file = true;
                (place.row, place.column) = (from_one(*row), from_one(*column));
                place.offset = *offset;
            }
            Location::File { row, column, .. } => place.also.push((*row, *column)),
            other => gather_one(&mut place, other),
        }
    }
    let main = (place.row.unwrap_or(0), place.column.unwrap_or(0));
    place.also.retain(|&other| other != main && other.0 > 0);
    place
}

fn gather_one(place: &mut IssueLocation, location: &Location) {
    match location {
        Location::File { .. } => {}
        Location::Xml { xpath } => {
            place.xpath.get_or_insert_with(|| xpath.clone());
        }
        Location::Inertial { x, y, z } => {
            place.inertial.get_or_insert((*x, *y, *z));
        }
        Location::Road { road_id, s, t } => {
            place.road.get_or_insert_with(|| (road_id.clone(), *s, *t));
        }
        Location::Time { time } => {
            place.time.get_or_insert(*time);
        }
        Location::Message { index, channel, .. } => {
            let channel = channel.clone().unwrap_or_default();
            place.message.get_or_insert((*index, channel));
        }
    }
}

/// Returns the place in the other file; the gathered place is the reference to it.
fn moved(other: &OtherPlace, gathered: IssueLocation) -> IssueLocation {
    let referred_at = gathered
        .row
        .map(|row| (row, gathered.column.unwrap_or_default()));
    IssueLocation {
        referred_at,
        offset: None,
        path: Some(other.path.clone()),
        row: from_one(other.row),
        column: from_one(other.column),
        xpath: other.xpath.clone(),
        also: Vec::new(),
        ..gathered
    }
}

fn from_one(number: u64) -> Option<u64> {
    (number > 0).then_some(number)
}

#[cfg(test)]
mod tests {
    use qcbus_formats::xqar::{DomainInfo, Level};

    use super::*;

    fn issue(locations: Vec<Locations>, domain_info: Vec<DomainInfo>) -> Issue {
        Issue {
            id: 1,
            description: "text".into(),
            level: Level::Error,
            rule_uid: "a:b:1.0.0:c.d".into(),
            locations,
            domain_info,
        }
    }

    fn at(description: &str, row: u64, column: u64) -> Locations {
        Locations {
            description: description.into(),
            elsewhere: None,
            places: vec![
                Location::File {
                    row,
                    column,
                    offset: None,
                },
                Location::Xml { xpath: "/a".into() },
            ],
        }
    }

    fn elsewhere(path: &str, row: u64, column: u64) -> OtherPlace {
        OtherPlace {
            path: path.into(),
            row,
            column,
            xpath: Some("/map/road[2]".into()),
        }
    }

    #[test]
    fn place_in_other_file_keeps_its_reference() {
        let other = Locations {
            elsewhere: Some(elsewhere("/m/t.xodr", 12, 5)),
            ..at("the road", 7, 9)
        };
        let found = issue_locations(&issue(vec![at("here", 3, 4), other], Vec::new()));
        assert_eq!(found[0].path, None);
        assert_eq!(found[1].path.as_deref(), Some("/m/t.xodr"));
        assert_eq!((found[1].row, found[1].column), (Some(12), Some(5)));
        assert_eq!(found[1].xpath.as_deref(), Some("/map/road[2]"));
        assert_eq!(found[1].referred_at, Some((7, 9)));
        assert_eq!(found[1].description, "the road");
    }

    #[test]
    fn zeros_mean_unknown_and_repeats_are_dropped() {
        let mut locations = at("x", 0, 0);
        for row in [0, 8] {
            locations.places.push(Location::File {
                row,
                column: 0,
                offset: None,
            });
        }
        let found = issue_locations(&issue(vec![locations], Vec::new()));
        assert_eq!((found[0].row, found[0].column), (None, None));
        assert_eq!(found[0].also, [(8, 0)]);
    }

    #[test]
    fn other_file_is_place_without_locations() {
        let found = issue_locations(&issue(
            Vec::new(),
            vec![elsewhere("/c.xosc", 0, 4).to_info()],
        ));
        assert_eq!(found.len(), 1);
        assert_eq!(
            (found[0].path.as_deref(), found[0].row),
            (Some("/c.xosc"), None)
        );
    }
}
