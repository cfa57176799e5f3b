//! Tests of the data of a scenario's page.
#![allow(clippy::unwrap_used, reason = "a test that cannot continue panics")]

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;

use qcbus_messages::path_text::from_text;
use qcbus_reporter_samples::result;
use qcbus_reporter_sdk::{Line, Sources};
use serde_json::Value;

use crate::scene::Scene;

/// Files by path, then files on disk.
#[derive(Default)]
struct Files(BTreeMap<String, String>);

impl Sources for Files {
    fn line(&self, _: &str, _: u64, _: u64) -> Option<Line> {
        None
    }

    fn image(&self, path: &str, look: &mut dyn FnMut(&[u8])) {
        let path_on_disk = from_text(path);
        let bytes = match self.0.get(path) {
            Some(text) => text.clone().into_bytes(),
            None => match std::fs::read(&path_on_disk) {
                Ok(bytes) => bytes,
                Err(_) => return,
            },
        };
        let limits = qcbus_ingest::Limits::default();
        look(&qcbus_ingest::prepare_bytes(&path_on_disk, bytes, &limits).build());
    }
}

/// Returns the story of a scenario at a path, as JSON. It is null if there is none.
fn story(path: &Path, files: &Files) -> Value {
    let path = path.to_str().unwrap();
    let mut result = result("scenario.xosc", Vec::new());
    path.clone_into(&mut result.input);
    let scene = Scene::of(&result, files);
    let shown = |path: &str| path.to_owned();
    let story = scene.and_then(|scene| scene.story(path, &shown));
    serde_json::to_value(story).unwrap()
}

fn sample(name: &str) -> Value {
    let directory = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/scenes");
    story(&directory.join(name), &Files::default())
}

/// Returns the story of a scenario with this text in memory.
fn of_text(text: String) -> Value {
    let path = "/farm/scenario.xosc";
    let files = Files(BTreeMap::from([(path.to_owned(), text)]));
    story(Path::new(path), &files)
}

fn points(list: &Value) -> String {
    let list = list.as_array().unwrap();
    let pair = |at: usize| format!("({}, {})", list[at], list[at + 1]);
    match list.len() {
        0 => "no point".to_owned(),
        2 => pair(0),
        count => format!(
            "{} points from {} to {}",
            count / 2,
            pair(0),
            pair(count - 2)
        ),
    }
}

fn summary(story: &Value) -> String {
    let mut text = String::new();
    for one in story["entities"].as_array().unwrap() {
        let (size, at) = (&one["size"], &one["at"]);
        writeln!(text, "{} {} size {size} at {at}", one["kind"], one["name"]).unwrap();
    }
    for one in story["courses"].as_array().unwrap() {
        writeln!(
            text,
            "{} {} of {} in {}: {}; stops: {}; exact: {}",
            one["kind"],
            one["name"],
            one["entities"],
            one["element"],
            points(&one["points"]),
            points(&one["stops"]),
            one["exact"],
        )
        .unwrap();
    }
    for one in story["elements"].as_array().unwrap() {
        let rows = &one["rows"];
        writeln!(
            text,
            "{rows} {} {} {}: {}",
            one["start"], one["end"], one["head"], one["text"]
        )
        .unwrap();
    }
    writeln!(text, "{}", story["run"]).unwrap();
    text
}

#[test]
fn scenario_on_a_map_has_its_bodies_lines_and_times() {
    insta::assert_snapshot!(summary(&sample("harbour.xosc")));
}

#[test]
fn scenario_without_a_map_has_places_in_the_world() {
    insta::assert_snapshot!(summary(&sample("no_map.xosc")));
}

#[test]
fn modular_scenario_is_told_as_its_expansion() {
    let farm = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/farm/modular");
    let story = story(&farm.join("convoy.xosc"), &Files::default());
    let heads = story["elements"].as_array().unwrap().iter();
    let heads: Vec<&str> = heads.map(|it| it["head"].as_str().unwrap()).collect();
    assert!(
        heads.contains(&"maneuver group `lead.brake` of `first`"),
        "{heads:?}"
    );
}

#[test]
fn map_and_catalog_have_no_story() {
    let farm = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/farm");
    for file in [
        "maps/quay_straight.xodr",
        "catalogs/vehicles.xosc",
        "faulty/not_well_formed.xodr",
    ] {
        assert_eq!(
            story(&farm.join(file), &Files::default()),
            Value::Null,
            "{file}"
        );
    }
}

fn head(version: &str) -> String {
    format!(
        "<OpenSCENARIO><FileHeader {version} date=\"2026-11-20T08:00:00\" description=\"\" \
         author=\"\"/><RoadNetwork/><Entities><ScenarioObject name=\"ego\"/></Entities><Storyboard>\
         <Init><Actions/></Init>"
    )
}

fn storyboard(events: &str) -> String {
    format!(
        "{}<Story name=\"s\"><Act name=\"a\"><ManeuverGroup name=\"g\" maximumExecutionCount=\"1\">\
         <Actors selectTriggeringEntities=\"false\"><EntityRef entityRef=\"ego\"/></Actors>\
         <Maneuver name=\"m\">{events}</Maneuver></ManeuverGroup></Act></Story></Storyboard></OpenSCENARIO>",
        head("revMajor=\"1\" revMinor=\"3\"")
    )
}

#[test]
fn scenario_of_another_language_version_has_no_story() {
    let text = format!(
        "{}</Storyboard></OpenSCENARIO>",
        head("revMajor=\"2\" revMinor=\"0\"")
    );
    assert_eq!(of_text(text), Value::Null);
}

#[test]
fn very_long_trajectory_is_thinned_and_said() {
    let vertex = |at: u32| {
        format!(
            "<Vertex><Position><WorldPosition x=\"{at}\" y=\"{}\"/></Position></Vertex>",
            at % 7
        )
    };
    let line: String = (0..100_000).map(vertex).collect();
    let story = of_text(storyboard(&format!(
        "<Event name=\"e\" priority=\"parallel\"><Action name=\"x\"><PrivateAction><RoutingAction>\
         <FollowTrajectoryAction><TrajectoryRef><Trajectory name=\"t\" closed=\"false\"><Shape><Polyline>\
         {line}</Polyline></Shape></Trajectory></TrajectoryRef></FollowTrajectoryAction></RoutingAction>\
         </PrivateAction></Action></Event>"
    )));
    let points = story["courses"][0]["points"].as_array().unwrap();
    assert!(
        (1000..3100).contains(&points.len()),
        "{} numbers",
        points.len()
    );
    assert_eq!(points[points.len() - 2], 99_999.0);
    let cuts = story["cuts"].to_string();
    assert!(
        cuts.contains("1 routes and trajectories are drawn with fewer points"),
        "{cuts}"
    );
}

#[test]
fn thousands_of_events_are_cut_and_said() {
    let event = |at: u32| format!("<Event name=\"e{at}\" priority=\"parallel\"/>");
    let events: String = (0..12_000).map(event).collect();
    let story = of_text(storyboard(&events));
    assert_eq!(story["elements"].as_array().unwrap().len(), 10_000);
    let cuts = story["cuts"].to_string();
    assert!(
        cuts.contains("2004 storyboard elements are not in the timeline"),
        "{cuts}"
    );
    assert!(story.to_string().len() < 5_000_000);
}

#[test]
fn places_that_are_no_finite_numbers_are_unknown() {
    let text = "<OpenSCENARIO><FileHeader revMajor=\"1\" revMinor=\"3\"/><Entities><ScenarioObject \
                name=\"ego\"/></Entities><Storyboard><Init><Actions><Private entityRef=\"ego\">\
                <PrivateAction><TeleportAction><Position><WorldPosition x=\"NaN\" y=\"1e999\"/></Position>\
                </TeleportAction></PrivateAction></Private></Actions></Init></Storyboard></OpenSCENARIO>";
    let story = of_text(text.to_owned());
    assert_eq!(story["entities"][0]["at"], Value::Null);
}
