//! `qcbus timeline`: the story of a scenario as text and as JSON, and scenarios without one.

use std::path::Path;

use serde_json::{Value, json};

use crate::support::cli::{Cli, Said, sample_farm};

const SPEED: &str = "<SpeedActionDynamics dynamicsShape=\"linear\" dynamicsDimension=\"time\" value=\"3\"/>\
    <SpeedActionTarget><AbsoluteTargetSpeed value=\"4\"/></SpeedActionTarget>";

/// Returns a scenario of one car with the given stories and stop trigger.
pub(crate) fn scenario(stories: &str, stop: &str) -> String {
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>
<OpenSCENARIO>
<FileHeader revMajor=\"1\" revMinor=\"2\" date=\"2026-03-02T08:00:00\" description=\"\" author=\"qcbus\"/>
<CatalogLocations>
<ManeuverCatalog><Directory path=\"moves\"/></ManeuverCatalog>
</CatalogLocations>
<RoadNetwork><LogicFile filepath=\"quay.xodr\"/></RoadNetwork>
<Entities>
<ScenarioObject name=\"ego\">
<Vehicle name=\"saloon\" vehicleCategory=\"car\">
<BoundingBox><Center x=\"1.4\" y=\"0\" z=\"0.75\"/><Dimensions width=\"1.8\" length=\"4.5\" height=\"1.5\"/></BoundingBox>
<Performance maxSpeed=\"60\" maxAcceleration=\"5\" maxDeceleration=\"9\"/>
<Axles>
<FrontAxle maxSteering=\"0.5\" wheelDiameter=\"0.65\" trackWidth=\"1.6\" positionX=\"2.7\" positionZ=\"0.325\"/>
<RearAxle maxSteering=\"0\" wheelDiameter=\"0.65\" trackWidth=\"1.6\" positionX=\"0\" positionZ=\"0.325\"/>
</Axles>
<Properties/>
</Vehicle>
</ScenarioObject>
<ScenarioObject name=\"cone\">
<MiscObject name=\"cone\" miscObjectCategory=\"obstacle\" mass=\"1\">
<BoundingBox><Center x=\"0\" y=\"0\" z=\"0.3\"/><Dimensions width=\"0.3\" length=\"0.3\" height=\"0.6\"/></BoundingBox>
<Properties/>
</MiscObject>
</ScenarioObject>
</Entities>
<Storyboard>
<Init><Actions><Private entityRef=\"ego\">
<PrivateAction><TeleportAction><Position><LanePosition roadId=\"1\" laneId=\"-1\" s=\"20\"/></Position></TeleportAction></PrivateAction>
<PrivateAction><LongitudinalAction><SpeedAction>
<SpeedActionDynamics dynamicsShape=\"step\" dynamicsDimension=\"time\" value=\"0\"/>
<SpeedActionTarget><AbsoluteTargetSpeed value=\"12\"/></SpeedActionTarget>
</SpeedAction></LongitudinalAction></PrivateAction>
</Private></Actions></Init>
{stories}
<StopTrigger>{stop}</StopTrigger>
</Storyboard>
</OpenSCENARIO>
"
    )
}

/// Returns a story with one maneuver.
pub(crate) fn story(events: &str) -> String {
    group(&format!("<Maneuver name=\"swerve\">{events}</Maneuver>"))
}

/// Returns a story with one maneuver group.
fn group(maneuvers: &str) -> String {
    let start = when("begin", &time("greaterOrEqual", 0.0));
    format!(
        "<Story name=\"drive\"><Act name=\"along the quay\">
<ManeuverGroup name=\"cars\" maximumExecutionCount=\"1\">
<Actors selectTriggeringEntities=\"false\"><EntityRef entityRef=\"ego\"/></Actors>
{maneuvers}
</ManeuverGroup>
<StartTrigger>{start}</StartTrigger>
</Act></Story>"
    )
}

/// Returns an event with one action.
pub(crate) fn event(name: &str, condition: &str, action: &str) -> String {
    format!(
        "<Event name=\"{name}\" priority=\"parallel\"><Action name=\"{name} now\"><PrivateAction>\
         {action}</PrivateAction></Action><StartTrigger>{}</StartTrigger></Event>\n",
        when(name, condition)
    )
}

pub(crate) fn brake() -> String {
    format!("<LongitudinalAction><SpeedAction>{SPEED}</SpeedAction></LongitudinalAction>")
}

/// Returns a condition group with one condition that has no edge.
fn when(name: &str, condition: &str) -> String {
    format!(
        "<ConditionGroup><Condition name=\"{name}\" delay=\"0\" conditionEdge=\"none\">\
         {condition}</Condition></ConditionGroup>"
    )
}

pub(crate) fn time(rule: &str, seconds: f64) -> String {
    format!(
        "<ByValueCondition><SimulationTimeCondition value=\"{seconds}\" rule=\"{rule}\"/>\
         </ByValueCondition>"
    )
}

pub(crate) fn complete(kind: &str, name: &str) -> String {
    format!(
        "<ByValueCondition><StoryboardElementStateCondition storyboardElementType=\"{kind}\" \
         storyboardElementRef=\"{name}\" state=\"completeState\"/></ByValueCondition>"
    )
}

fn traveled(meters: f64) -> String {
    format!(
        "<ByEntityCondition><TriggeringEntities triggeringEntitiesRule=\"any\">\
         <EntityRef entityRef=\"ego\"/></TriggeringEntities><EntityCondition>\
         <TraveledDistanceCondition value=\"{meters}\"/></EntityCondition></ByEntityCondition>"
    )
}

/// Returns events of every sort: at a known time, after another, at an unknown time, without an end,
/// and never.
fn swerving() -> String {
    let keep = "<LateralAction><LaneOffsetAction continuous=\"true\">\
        <LaneOffsetActionDynamics dynamicsShape=\"linear\" maxLateralAcc=\"1\"/>\
        <LaneOffsetTarget><AbsoluteTargetLaneOffset value=\"0.4\"/></LaneOffsetTarget>\
        </LaneOffsetAction></LateralAction>";
    let show = "<VisibilityAction graphics=\"true\" traffic=\"true\" sensors=\"true\"/>";
    [
        event("brake", &time("greaterThan", 4.0), &brake()),
        event("follow", &complete("event", "brake"), &brake()),
        event("pass", &traveled(50.0), show),
        event("keep left", &time("greaterThan", 12.0), keep),
        event("return", &complete("action", "keep left now"), &brake()),
    ]
    .concat()
}

/// Creates a cli with a map and this scenario as `a.xosc`.
pub(crate) fn cli(scenario: &str) -> Cli {
    let cli = Cli::new();
    let map = std::fs::read(sample_farm().join("maps/quay_straight.xodr")).unwrap();
    cli.write("quay.xodr", map);
    cli.write("a.xosc", scenario);
    cli
}

fn as_json(said: &Said) -> Value {
    serde_json::from_str(&said.stdout).unwrap()
}

/// Returns the element of this name in the JSON of a story.
fn named<'v>(story: &'v Value, name: &str) -> &'v Value {
    let elements = story["elements"].as_array().unwrap();
    elements.iter().find(|it| it["name"] == name).unwrap()
}

/// Runs the command on `a.xosc` and returns its output.
fn told(cli: &Cli) -> String {
    cli.qcbus(&["timeline", "a.xosc"]).whole(cli)
}

#[test]
fn story_names_times_and_reasons() {
    let stop = when("stop", &time("greaterThan", 30.0));
    let cli = cli(&scenario(&story(&swerving()), &stop));
    insta::assert_snapshot!(told(&cli));
}

#[test]
fn end_of_the_run_is_told_in_every_case() {
    let mut text = String::new();
    for stop in [
        String::new(),
        when("stop", &traveled(80.0)),
        when("stop", &complete("event", "keep left")),
        when("stop", &complete("event", "brake")),
    ] {
        let cli = cli(&scenario(&story(&swerving()), &stop));
        let said = told(&cli);
        let line = said.lines().find(|line| line.contains("he run ")).unwrap();
        text.push_str(&format!("{line}\n"));
    }
    insta::assert_snapshot!(text);
}

#[test]
fn json_has_the_same_times_and_reasons() {
    let stop = when("stop", &time("greaterThan", 30.0));
    let cli = cli(&scenario(&story(&swerving()), &stop));
    let said = cli.qcbus(&["timeline", "a.xosc", "--json"]);
    assert_eq!((said.code, &*said.stderr), (Some(0), ""));
    let story = as_json(&said);
    assert_eq!(story["schema"], 1);
    let file = cli.path().join("a.xosc");
    assert_eq!(story["file"], file.to_str().unwrap());
    assert_eq!(story["timesKnown"], true);
    assert_eq!(
        (&story["warnings"], &story["unknown"]),
        (&json!([]), &json!([]))
    );
    assert_eq!(
        story["init"],
        json!([
            {"entity": "ego", "position": "road `1`, lane `-1`, s 20 m", "x": 20.0, "y": -1.75,
             "heading": 0.0, "speed": 12.0, "actions": []},
            {"entity": "cone", "position": null, "x": null, "y": null, "heading": null,
             "speed": null, "actions": []},
        ])
    );
    assert_eq!(story["run"]["waitsUntil"], "simulation time > 30 s");
    assert_eq!(story["run"]["end"]["earliest"], 30.0);
    assert_eq!(story["run"]["neverEnds"], Value::Null);

    let brake = named(&story, "brake");
    assert_eq!(
        (&brake["kind"], &brake["start"]["earliest"]),
        (&json!("event"), &json!(4.0))
    );
    assert_eq!(brake["end"]["earliest"], 7.0);
    assert_eq!(brake["waitsUntil"], "simulation time > 4 s");
    let parent = usize::try_from(brake["parent"].as_u64().unwrap()).unwrap();
    assert_eq!(story["elements"][parent]["name"], "swerve");
    let action = named(&story, "brake now");
    assert_eq!(action["action"], "SpeedAction");
    assert!(
        action["place"].as_str().unwrap().contains("/a.xosc:"),
        "{action}"
    );
    assert_eq!(named(&story, "cars")["actors"], json!(["ego"]));
    assert_eq!(named(&story, "pass")["start"]["latest"], Value::Null);
    let never = named(&story, "return");
    assert_eq!(never["start"], json!({"earliest": null, "latest": null}));
    assert!(
        never["neverStarts"]
            .as_str()
            .unwrap()
            .contains("continuous"),
        "{never}"
    );
}

#[test]
fn encodings_of_the_same_scenario_have_the_same_story() {
    let text = scenario(&story(&swerving()), "");
    let cli = cli(&text);
    let plain = cli.qcbus(&["timeline", "a.xosc"]);
    let utf16 = text.replace("UTF-8", "UTF-16");
    let utf16 = std::iter::once(0xFEFF).chain(utf16.encode_utf16());
    let utf16: Vec<u8> = utf16.flat_map(u16::to_le_bytes).collect();
    let latin1 = text.replace("UTF-8", "ISO-8859-1").into_bytes();
    for bytes in [utf16, latin1] {
        cli.write("b.xosc", bytes);
        let said = cli.qcbus(&["timeline", "b.xosc"]);
        assert_eq!((said.code, &said.stdout), (Some(0), &plain.stdout));
    }
}

#[test]
fn archive_has_the_story_of_its_expansion() {
    let cli = Cli::new();
    for name in [
        "modular/convoy.xosc",
        "modular/moves.xosc",
        "maps/quay_straight.xodr",
    ] {
        cli.write(name, std::fs::read(sample_farm().join(name)).unwrap());
    }
    cli.qcbus(&[
        "pack",
        "modular/convoy.xosc",
        "modular/moves.xosc",
        "-o",
        "modular/a.mosc",
    ]);
    let said = cli.qcbus(&["timeline", "modular/a.mosc"]);
    assert_eq!(
        said.stdout,
        cli.qcbus(&["timeline", "modular/convoy.xosc"]).stdout
    );
    insta::assert_snapshot!(said.whole(&cli));
}

/// Returns the page about the command.
fn page() -> String {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    std::fs::read_to_string(root.join("docs/timeline.md")).unwrap()
}

#[test]
fn document_shows_the_story_of_the_sample() {
    let sample = sample_farm().join("modular/convoy.xosc");
    let said = Cli::new().qcbus(&["timeline", sample.to_str().unwrap()]);
    let block = format!("```text\n{}```", said.stdout);
    assert!(page().contains(&block), "{block}");
}

#[test]
fn document_describes_every_key() {
    let sample = sample_farm().join("modular/convoy.xosc");
    let said = Cli::new().qcbus(&["timeline", sample.to_str().unwrap(), "--json"]);
    let story = as_json(&said);
    let page = page();
    for object in [
        &story,
        &story["init"][0],
        &story["elements"][0],
        &story["run"],
    ] {
        for key in object.as_object().unwrap().keys() {
            assert!(page.contains(&format!("`{key}`")), "{key}");
        }
    }
}

#[test]
fn missing_maneuver_makes_the_times_unknown() {
    let reference = "<CatalogReference catalogName=\"moves\" entryName=\"cut in\"/>";
    let stop = when("stop", &time("greaterThan", 30.0));
    let cli = cli(&scenario(&group(reference), &stop));
    insta::assert_snapshot!(told(&cli));

    let said = cli.qcbus(&["timeline", "a.xosc", "--json"]);
    assert_eq!(said.code, Some(3), "{}", said.whole(&cli));
    let story = as_json(&said);
    assert_eq!(story["timesKnown"], false);
    let text = |list: &str| story[list][0]["text"].as_str().unwrap().to_owned();
    assert!(
        text("warnings").contains("`moves` does not exist"),
        "{story}"
    );
    assert!(text("unknown").contains("`cut in`"), "{story}");
    assert_eq!(
        named(&story, "cars")["start"],
        json!({"earliest": 0.0, "latest": null})
    );
}

#[test]
fn missing_map_keeps_the_times() {
    let cli = cli(&scenario(&story(&swerving()), ""));
    std::fs::remove_file(cli.path().join("quay.xodr")).unwrap();
    let said = cli.qcbus(&["timeline", "a.xosc", "--json"]);
    assert_eq!(said.code, Some(0), "{}", said.whole(&cli));
    assert!(said.stderr.contains("/a.xosc:7:"), "{}", said.stderr);
    let story = as_json(&said);
    assert_eq!(story["init"][0]["x"], Value::Null);
    assert_eq!(named(&story, "brake")["start"]["earliest"], 4.0);
    let text = story["warnings"][0]["text"].as_str().unwrap();
    assert!(text.contains("`quay.xodr` does not exist"), "{text}");
}

#[test]
fn files_without_a_story_are_refused() {
    let text = scenario(&story(&swerving()), "");
    let cli = cli(&text);
    cli.write("broken.xosc", text.replace("</Event>", ""));
    cli.write("cut.xosc", &text[..text.len() / 2]);
    cli.write("empty.xosc", "");
    cli.write(
        "map.xosc",
        std::fs::read(cli.path().join("quay.xodr")).unwrap(),
    );
    let catalog = sample_farm().join("catalogs/vehicles.xosc");
    cli.write("catalog.xosc", std::fs::read(catalog).unwrap());
    cli.write(
        "old.xosc",
        text.replace(
            "revMajor=\"1\" revMinor=\"2\"",
            "revMajor=\"0\" revMinor=\"9\"",
        ),
    );
    let group = "<ManeuverGroup name=\"cars\"";
    let reference = "<ScenarioReference scenarioFileName=\"gone.xosc\"/>";
    let group_of_other = text.replace(
        group,
        &format!("<ManeuverGroup name=\"x\">{reference}</ManeuverGroup>{group}"),
    );
    cli.write("modular.xosc", group_of_other);
    let mut all = String::new();
    for name in [
        "nowhere.xosc",
        "quay.xodr",
        "broken.xosc",
        "cut.xosc",
        "empty.xosc",
        "map.xosc",
        "catalog.xosc",
        "old.xosc",
        "modular.xosc",
    ] {
        let said = cli.qcbus(&["timeline", name]);
        assert_eq!(said.stdout, "", "{name}");
        all.push_str(&format!("$ qcbus timeline {name}\n{}\n", said.whole(&cli)));
    }
    insta::assert_snapshot!(all);
}

#[test]
fn names_cannot_control_the_terminal() {
    let text = scenario(&story(&swerving()), "").replace("swerve", "a&#10;b\u{202e}c");
    let cli = cli(&text);
    let said = cli.qcbus(&["timeline", "a.xosc", "--color", "always"]);
    assert!(said.stdout.contains("`a\\nb\\u{202e}c`"), "{}", said.stdout);
    assert!(
        said.stdout.contains("\u{1b}[1;91mnever starts\u{1b}[0m"),
        "{}",
        said.stdout
    );
}
