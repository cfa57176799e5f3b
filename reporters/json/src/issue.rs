//! One issue as JSON.

use std::borrow::Cow;

use qcbus_formats::xqar::{Issue, Location};
use qcbus_reporter_sdk::{IssueLocation, issue_locations};
use serde::Serialize;

use crate::xml;

/// An issue in the form of ASAM's report, with its places.
#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct IssueJson<'r> {
    issue_id: u64,
    level: &'static str,
    description: &'r str,
    rule_uid: &'r str,
    locations: LocationsJson<'r>,
    domain_specific_info: Vec<String>,
    places: Vec<PlaceJson>,
}

/// ASAM's lists of locations by kind. `road` is an extension.
#[derive(Serialize, Default)]
struct LocationsJson<'r> {
    file: Vec<Described<'r, FileJson>>,
    xml: Vec<Described<'r, XmlJson<'r>>>,
    inertial: Vec<Described<'r, InertialJson>>,
    road: Vec<Described<'r, RoadJson>>,
    time: Vec<Described<'r, TimeJson>>,
    message: Vec<Described<'r, MessageJson<'r>>>,
}

#[derive(Serialize)]
struct Described<'r, T> {
    description: Cow<'r, str>,
    #[serde(flatten)]
    location: T,
}

#[derive(Serialize)]
struct FileJson {
    column: u64,
    row: u64,
    #[serde(skip_serializing_if = "Option::is_none")]
    offset: Option<u64>,
}

#[derive(Serialize)]
struct XmlJson<'r> {
    xpath: &'r str,
}

#[derive(Serialize, Clone, Copy)]
struct InertialJson {
    x: f64,
    y: f64,
    z: f64,
}

#[derive(Serialize)]
struct RoadJson {
    #[serde(rename = "roadId")]
    road_id: String,
    s: f64,
    t: f64,
}

#[derive(Serialize)]
struct TimeJson {
    time: f64,
}

#[derive(Serialize)]
struct MessageJson<'r> {
    index: u64,
    channel: Option<&'r str>,
    field: Option<&'r str>,
    time: Option<f64>,
}

/// A place with all known data; unknown fields are left out.
#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct PlaceJson {
    path: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    row: Option<u64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    column: Option<u64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    offset: Option<u64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    xpath: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    road: Option<RoadJson>,
    #[serde(skip_serializing_if = "Option::is_none")]
    inertial: Option<InertialJson>,
    #[serde(skip_serializing_if = "Option::is_none")]
    time: Option<f64>,
    #[serde(skip_serializing_if = "String::is_empty")]
    description: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    referred_at: Option<RowColumn>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    also: Vec<RowColumn>,
}

#[derive(Serialize)]
struct RowColumn {
    row: u64,
    column: u64,
}

/// Returns the JSON of an issue of the file at `input`.
pub(crate) fn issue<'r>(issue: &'r Issue, input: &str) -> IssueJson<'r> {
    IssueJson {
        issue_id: issue.id,
        level: issue.level.as_str(),
        description: &issue.description,
        rule_uid: &issue.rule_uid,
        locations: locations(issue),
        domain_specific_info: issue.written_info().map(|info| xml::text(&info)).collect(),
        places: issue_locations(issue)
            .into_iter()
            .map(|each| place(each, input))
            .collect(),
    }
}

fn locations(issue: &Issue) -> LocationsJson<'_> {
    let mut lists = LocationsJson::default();
    for group in &issue.locations {
        for location in &group.places {
            lists.add(group.written(), location);
        }
    }
    lists
}

impl<'r> LocationsJson<'r> {
    fn add(&mut self, description: Cow<'r, str>, location: &'r Location) {
        match location {
            &Location::File {
                row,
                column,
                offset,
            } => self.file.push(Described {
                description,
                location: FileJson {
                    column,
                    row,
                    offset,
                },
            }),
            Location::Xml { xpath } => self.xml.push(Described {
                description,
                location: XmlJson { xpath },
            }),
            &Location::Inertial { x, y, z } => self.inertial.push(Described {
                description,
                location: InertialJson { x, y, z },
            }),
            Location::Road { road_id, s, t } => self.road.push(Described {
                description,
                location: road((road_id.clone(), *s, *t)),
            }),
            &Location::Time { time } => self.time.push(Described {
                description,
                location: TimeJson { time },
            }),
            Location::Message {
                index,
                channel,
                field,
                time,
            } => self.message.push(Described {
                description,
                location: MessageJson {
                    index: *index,
                    channel: channel.as_deref(),
                    field: field.as_deref(),
                    time: *time,
                },
            }),
        }
    }
}

fn place(place: IssueLocation, input: &str) -> PlaceJson {
    let pair = |(row, column)| RowColumn { row, column };
    PlaceJson {
        path: place.path.unwrap_or_else(|| input.to_owned()),
        row: place.row,
        column: place.column,
        offset: place.offset,
        xpath: place.xpath,
        road: place.road.map(road),
        inertial: place.inertial.map(|(x, y, z)| InertialJson { x, y, z }),
        time: place.time,
        description: place.description,
        referred_at: place.referred_at.map(pair),
        also: place.also.into_iter().map(pair).collect(),
    }
}

fn road((road_id, s, t): (String, f64, f64)) -> RoadJson {
    RoadJson { road_id, s, t }
}
