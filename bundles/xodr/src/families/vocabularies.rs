//! The closed vocabularies of OpenDRIVE, with the words of all versions together. The schemas of
//! 1.1 to 1.3 list none, and the schema of 1.6 leaves out some.

use crate::prelude::*;

/// The valid words of an attribute.
pub(crate) struct Vocabulary {
    /// Names of the elements with the attribute.
    pub elements: &'static [&'static str],
    /// Names of their parents; empty means any parent.
    pub parents: &'static [&'static str],
    pub attribute: &'static str,
    pub words: &'static [&'static str],
    /// Severity of an unknown word. Readers use a default for an unknown weight of a line, but not
    /// for an unknown direction.
    pub level: Level,
}

const fn of(
    elements: &'static [&'static str],
    parents: &'static [&'static str],
    attribute: &'static str,
    words: &'static [&'static str],
    level: Level,
) -> Vocabulary {
    Vocabulary {
        elements,
        parents,
        attribute,
        words,
        level,
    }
}

use Level::{Error, Warning};

const LINK: &[&str] = &["predecessor", "successor"];
const TRAFFIC: &[&str] = &["signal", "signalReference", "object", "objectReference"];
const TRAFFIC_LISTS: &[&str] = &["signals", "objects"];
const DIRECTIONS: &[&str] = &["+", "-", "none"];

pub(crate) const VOCABULARIES: &[Vocabulary] = &[
    of(LINK, &["link"], "elementType", &["road", "junction"], Error),
    of(LINK, &["link"], "contactPoint", &["start", "end"], Error),
    of(LINK, &["link"], "elementDir", &["+", "-"], Error),
    of(
        &["connection"],
        &["junction"],
        "contactPoint",
        &["start", "end"],
        Error,
    ),
    of(
        &["connection"],
        &["junction"],
        "type",
        &["default", "virtual"],
        Error,
    ),
    of(
        &["junction"],
        &["OpenDRIVE"],
        "type",
        &["default", "direct", "virtual", "crossing"],
        Error,
    ),
    of(&["road"], &["OpenDRIVE"], "rule", &["RHT", "LHT"], Error),
    of(
        &["type"],
        &["road"],
        "type",
        &[
            "unknown",
            "rural",
            "motorway",
            "town",
            "lowSpeed",
            "pedestrian",
            "bicycle",
            "townExpressway",
            "townCollector",
            "townArterial",
            "townPrivate",
            "townLocal",
            "townPlayStreet",
        ],
        Error,
    ),
    of(
        &["speed"],
        &["type", "lane"],
        "unit",
        &["m/s", "mph", "km/h"],
        Error,
    ),
    of(TRAFFIC, TRAFFIC_LISTS, "orientation", DIRECTIONS, Error),
    of(TRAFFIC, TRAFFIC_LISTS, "dynamic", &["yes", "no"], Error),
    of(
        &["paramPoly3"],
        &["geometry"],
        "pRange",
        &["arcLength", "normalized"],
        Error,
    ),
    of(
        &["lane"],
        &["left", "center", "right"],
        "type",
        &[
            "none",
            "driving",
            "stop",
            "shoulder",
            "biking",
            "sidewalk",
            "border",
            "restricted",
            "parking",
            "bidirectional",
            "median",
            "special1",
            "special2",
            "special3",
            "roadWorks",
            "tram",
            "rail",
            "entry",
            "exit",
            "offRamp",
            "onRamp",
            "connectingRamp",
            "bus",
            "taxi",
            "HOV",
            "mwyEntry",
            "mwyExit",
            "curb",
            "shared",
            "walking",
            "slipLane",
        ],
        Error,
    ),
    of(
        &["roadMark"],
        &["lane"],
        "type",
        &[
            "none",
            "solid",
            "broken",
            "solid solid",
            "solid broken",
            "broken solid",
            "broken broken",
            "botts dots",
            "grass",
            "curb",
            "custom",
            "edge",
        ],
        Error,
    ),
    of(
        &["roadMark"],
        &["lane"],
        "laneChange",
        &["increase", "decrease", "both", "none"],
        Error,
    ),
    of(
        &["roadMark"],
        &["lane"],
        "weight",
        &["standard", "bold"],
        Warning,
    ),
    of(
        &["roadMark"],
        &["lane"],
        "color",
        &[
            "standard", "blue", "green", "red", "white", "yellow", "orange", "violet", "black",
        ],
        Warning,
    ),
    of(
        &["tunnel"],
        &["objects"],
        "type",
        &["standard", "underpass"],
        Warning,
    ),
    of(
        &["bridge"],
        &["objects"],
        "type",
        &["concrete", "steel", "brick", "wood"],
        Warning,
    ),
];
