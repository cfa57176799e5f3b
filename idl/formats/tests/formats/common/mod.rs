//! Common helpers of the tests.

use qcbus_formats::pool::{BundleOutcome, CheckerOutcome, Ending, PoolInput, Scope};
use qcbus_formats::xqar::{
    Checker, CheckerBundle, DomainInfo, InfoElement, Issue, Level, Location, Locations, Metadata,
    Param, Results, Status,
};

pub const UID: &str = "asam.net:xodr:1.4.0:road.length";
pub const OTHER_UID: &str = "qcbus.dev:xodr:1.0.0:header.attributes";

pub fn param(name: &str, value: &str) -> Param {
    Param {
        name: name.into(),
        value: value.into(),
    }
}

pub fn issue(level: Level, description: &str) -> Issue {
    Issue {
        id: 0,
        description: description.into(),
        level,
        rule_uid: UID.into(),
        locations: Vec::new(),
        domain_info: Vec::new(),
    }
}

pub fn xml_place(xpath: &str) -> Locations {
    let places = vec![Location::Xml {
        xpath: xpath.into(),
    }];
    Locations {
        description: "the road".into(),
        elsewhere: None,
        places,
    }
}

pub fn checker(id: &str, issues: Vec<Issue>) -> CheckerOutcome {
    CheckerOutcome {
        id: id.into(),
        description: format!("Looks at {id}.").into(),
        rule_uids: [UID].into_iter().collect(),
        ending: Some(Ending::Completed),
        issues,
        ..CheckerOutcome::default()
    }
}

pub fn bundle(name: &str, alias: &str, checkers: Vec<CheckerOutcome>) -> BundleOutcome {
    BundleOutcome {
        name: name.into(),
        alias: alias.into(),
        version: "0.1.0".into(),
        build_date: "2025-01-31".into(),
        description: format!("The bundle {name}."),
        checkers,
        ..BundleOutcome::default()
    }
}

pub fn input(bundles: Vec<BundleOutcome>) -> PoolInput<'static> {
    PoolInput {
        input_file: "/farm/town.xodr",
        config: None,
        bundles,
        remarks: Vec::new(),
        scope: Scope::Whole,
        separate: false,
        version: "0.1.0",
        build_date: "2025-01-31",
    }
}

/// Returns a result with one of each element.
pub fn full() -> Results {
    let road = Location::Road {
        road_id: "5".into(),
        s: 12.25,
        t: -1.75,
    };
    let file = Location::File {
        row: 12,
        column: 5,
        offset: Some(431),
    };
    let xml = Location::Xml {
        xpath: "/OpenDRIVE/road[@id='5']".into(),
    };
    let inertial = Location::Inertial {
        x: 1571.3260652726844,
        y: -1e-9,
        z: 0.0,
    };
    let mut rich = issue(
        Level::Error,
        "road 5 is 12.25 m long,\nits \"geometry\" <50 & more>",
    );
    rich.locations = vec![
        Locations {
            description: "road 5".into(),
            elsewhere: None,
            places: vec![file, xml, inertial, road.clone()],
        },
        Locations {
            description: "its end".into(),
            elsewhere: None,
            places: vec![road.clone(), road],
        },
    ];
    rich.domain_info = vec![DomainInfo {
        name: "example".into(),
        content: vec![InfoElement {
            name: "e:facts".into(),
            attributes: vec![("xmlns:e".into(), "urn:example".into())],
            text: String::new(),
            children: vec![InfoElement {
                name: "fact".into(),
                text: "a < b\u{7}".into(),
                ..InfoElement::default()
            }],
        }],
    }];
    let mut late = issue(Level::Warning, "the message is late");
    late.id = 1;
    late.rule_uid = OTHER_UID.into();
    late.locations = vec![Locations {
        description: String::new(),
        elsewhere: None,
        places: vec![
            Location::Time { time: 3.5 },
            Location::Message {
                index: 7,
                channel: Some("/odom".into()),
                field: None,
                time: Some(0.1),
            },
        ],
    }];
    let length = Checker {
        id: "check_road_length".into(),
        description: "The length is that of the geometry.".into(),
        summary: "2 issues.".into(),
        status: Some(Status::Completed),
        params: vec![param("tolerance", "0.01")],
        issues: vec![rich, late],
        addressed_rules: [UID.into(), OTHER_UID.into()].into(),
        metadata: vec![Metadata {
            key: "micros".into(),
            value: "88".into(),
            description: "Time taken in microseconds.".into(),
        }],
    };
    let skipped = Checker {
        id: "check_lanes".into(),
        description: "Lanes.".into(),
        summary: "Skipped: OpenDRIVE 1.4. 0 issues.".into(),
        status: Some(Status::Skipped),
        addressed_rules: [UID.into()].into(),
        ..Checker::default()
    };
    Results {
        version: "1.0.0".into(),
        bundles: vec![CheckerBundle {
            name: "xodrBundle".into(),
            version: "0.1.0".into(),
            build_date: "2025-01-31".into(),
            description: "Checks OpenDRIVE.".into(),
            summary: "2 checkers: 1 completed, 1 skipped, 0 error; 2 issues.".into(),
            params: vec![param("InputFile", "/farm/town.xodr")],
            checkers: vec![length, skipped],
        }],
    }
}
