//! Made-up answer of a bundle on a map of [`crate::maps`]: always the same, with any rules.

use qcbus_formats::pool::{BundleOutcome, CheckerOutcome, Ending};
use qcbus_formats::xqar::{Issue, Level, Location, Locations};

/// Number of checkers of the bundle, about as many as in a standard bundle.
const CHECKERS: u32 = 200;
/// One of this many checkers finds something.
const FINDS: u32 = 10;
/// Number of findings of each checker that has any.
const FINDINGS: u32 = 50;
/// Number of roads, the first of the map, that findings point at.
const ROADS: u32 = 80;

/// Returns the answer of a bundle: 200 checkers, 1,000 findings.
pub fn answer() -> BundleOutcome {
    BundleOutcome {
        name: "generatedBundle".to_owned(),
        alias: "generated".to_owned(),
        version: "1.0.0".to_owned(),
        build_date: "2026-03-02".to_owned(),
        description: "Says always the same.".to_owned(),
        checkers: (0..CHECKERS).map(checker).collect(),
        ..BundleOutcome::default()
    }
}

fn checker(number: u32) -> CheckerOutcome {
    let uid = format!("example.com:xodr:1.7.0:road.generated.rule_{number}");
    let findings = if number.is_multiple_of(FINDS) {
        FINDINGS
    } else {
        0
    };
    CheckerOutcome {
        id: format!("check_example_xodr_generated_rule_{number}").into(),
        description: "What a rule wants is said in one sentence of about this length.".into(),
        rule_uids: [uid.clone()].into_iter().collect(),
        ending: Some(Ending::Completed),
        issues: (0..findings).map(|it| issue(number, it, &uid)).collect(),
        ..CheckerOutcome::default()
    }
}

/// Returns findings of one checker, as many as travel in one message.
pub fn findings(count: u32) -> Vec<Issue> {
    let uid = "example.com:xodr:1.7.0:road.generated.rule_0";
    (0..count).map(|it| issue(0, it, uid)).collect()
}

fn issue(checker: u32, number: u32, uid: &str) -> Issue {
    let road = 1 + (checker + number) % ROADS;
    let s = f64::from(number) * 1.234_567;
    let part = 1 + number % 8;
    let places = |xpath: String| {
        vec![
            Location::Xml { xpath },
            Location::Road {
                road_id: road.to_string(),
                s,
                t: -3.5,
            },
            Location::Inertial {
                x: s * 10.0,
                y: s / 3.0,
                z: 0.0,
            },
        ]
    };
    Issue {
        id: 0,
        description: format!(
            "lane -2 of road {road} is {s:.3} m wide at s = {s:.2} m; what is allowed is said here"
        ),
        level: match number % 3 {
            0 => Level::Error,
            1 => Level::Warning,
            _ => Level::Information,
        },
        rule_uid: uid.to_owned(),
        locations: vec![
            Locations {
                description: "a lane".to_owned(),
                elsewhere: None,
                places: places(format!(
                    "/OpenDRIVE/road[@id='{road}']/lanes/laneSection/right/lane[@id='-2']"
                )),
            },
            Locations {
                description: "a geometry".to_owned(),
                elsewhere: None,
                places: places(format!(
                    "/OpenDRIVE/road[@id='{road}']/planView/geometry[{part}]"
                )),
            },
        ],
        domain_info: Vec::new(),
    }
}
