//! Which schema a file is checked against, and what is allowed beside it.

mod support;

use std::sync::Arc;

use qcbus_document::FileKind;
use qcbus_schema::{Options, Outcome, Override, Severity, SkipReason, Version, check};
use support::{compiled, image, open};

fn map(header: &str, namespace: &str) -> String {
    format!(
        "<OpenDRIVE{namespace}><header {header}/>\
         <road id=\"1\" junction=\"-1\" length=\"1\" name=\"\"><planView><geometry hdg=\"0\" length=\"1\" s=\"0\" x=\"0\" y=\"0\"><line/></geometry></planView>\
         <lanes><laneSection s=\"0\"><center><lane id=\"0\" type=\"none\" level=\"false\"/></center>\
         <right><lane id=\"-1\" type=\"driving\" level=\"false\"><width sOffset=\"0\" a=\"1\" b=\"0\" c=\"0\" d=\"0\"/></lane></right></laneSection></lanes></road></OpenDRIVE>"
    )
}

/// What the check says about a text: the schema used, or why none was.
fn said(
    name: &str,
    kind: FileKind,
    text: &str,
    options: &Options,
) -> Result<(String, bool, usize), SkipReason> {
    let bytes = image(name, text);
    match check(&open(&bytes), kind, options) {
        Outcome::Skipped(reason) => Err(reason),
        Outcome::Checked(checked) => Ok((
            checked.schema.clone(),
            checked.newer,
            checked.violations.len(),
        )),
    }
}

fn said_of_map(header: &str) -> Result<(String, bool, usize), SkipReason> {
    said(
        "t.xodr",
        FileKind::Xodr,
        &map(header, ""),
        &Options::default(),
    )
}

#[test]
fn the_header_chooses_the_schema() {
    for (minor, title) in [
        ("4", "OpenDRIVE 1.4"),
        ("6", "OpenDRIVE 1.6"),
        ("7", "OpenDRIVE 1.7"),
        ("8", "OpenDRIVE 1.8.1"),
    ] {
        let (schema, newer, violations) =
            said_of_map(&format!("revMajor=\"1\" revMinor=\"{minor}\"")).expect("checked");
        assert_eq!((schema.as_str(), newer, violations), (title, false, 0));
    }
    assert_eq!(
        said_of_map("revMajor=\"1\" revMinor=\" 07 \"")
            .expect("checked")
            .0,
        "OpenDRIVE 1.7"
    );
}

#[test]
fn versions_without_a_schema_are_skipped_with_a_reason() {
    let zero = Version { major: 0, minor: 9 };
    assert_eq!(
        said_of_map("revMajor=\"0\" revMinor=\"9\""),
        Err(SkipReason::MajorZero(zero))
    );
    let old = Version { major: 1, minor: 0 };
    assert_eq!(
        said_of_map("revMajor=\"1\" revMinor=\"0\""),
        Err(SkipReason::NoSchema(old))
    );
    assert_eq!(
        said_of_map("revMajor=\"one\" revMinor=\"7\""),
        Err(SkipReason::NoVersion)
    );
    assert_eq!(
        said(
            "t.xodr",
            FileKind::Xodr,
            "<OpenDRIVE><road></OpenDRIVE>",
            &Options::default()
        ),
        Err(SkipReason::IllFormed)
    );
    let scenario = "<OpenSCENARIO><FileHeader revMajor=\"0\" revMinor=\"9\"/></OpenSCENARIO>";
    assert_eq!(
        said("t.xosc", FileKind::Xosc, scenario, &Options::default()),
        Err(SkipReason::MajorZero(zero))
    );
}

#[test]
fn a_version_newer_than_all_schemas_gets_information_only() {
    let text =
        map("revMajor=\"1\" revMinor=\"10\"", "").replace("<lanes>", "<futureLanes/><lanes>");
    let bytes = image("t.xodr", &text);
    let document = open(&bytes);
    let Outcome::Checked(checked) = check(&document, FileKind::Xodr, &Options::default()) else {
        panic!("skipped")
    };
    assert_eq!(
        (checked.schema.as_str(), checked.newer),
        (
            "OpenDRIVE 1.9 (1.8.1 with what the text of 1.9.0 adds)",
            true
        )
    );
    assert_eq!(checked.violations.len(), 1, "{:?}", checked.violations);
    assert_eq!(
        checked.severity(&checked.violations[0]),
        Severity::Information
    );
}

#[test]
fn a_default_namespace_disturbs_nothing_and_is_told() {
    let text = map(
        "revMajor=\"1\" revMinor=\"7\"",
        " xmlns=\"http://www.opendrive.org\"",
    );
    let bytes = image("t.xodr", &text);
    let document = open(&bytes);
    let Outcome::Checked(checked) = check(&document, FileKind::Xodr, &Options::default()) else {
        panic!("skipped")
    };
    assert!(checked.violations.is_empty(), "{:?}", checked.violations);
    assert_eq!(checked.namespace, Some("http://www.opendrive.org"));
}

fn scenario(group: &str) -> String {
    format!(
        "<OpenSCENARIO><FileHeader author=\"a\" date=\"2024-05-01T00:00:00\" description=\"d\" revMajor=\"1\" revMinor=\"0\"/>\
         <CatalogLocations/><RoadNetwork/><Entities/><Storyboard><Init><Actions/></Init><Story name=\"s\"><Act name=\"a\">{group}\
         <StartTrigger/></Act></Story><StopTrigger/></Storyboard></OpenSCENARIO>"
    )
}

#[test]
fn tags_of_modular_scenarios_are_allowed_where_they_belong() {
    let reference = "<ScenarioReference scenarioFileName=\"b.xosc\"><ManeuverGroupReference maneuverGroupName=\"m\">\
                     <ParameterReference key=\"value\" value=\"2\"/></ManeuverGroupReference></ScenarioReference>";
    let actors = "<Actors selectTriggeringEntities=\"false\"/>";
    let group = |inner: &str| {
        format!(
            "<ManeuverGroup maximumExecutionCount=\"1\" name=\"g\">{actors}{inner}</ManeuverGroup>"
        )
    };
    let ask = |text: &str| {
        said("t.xosc", FileKind::Xosc, text, &Options::default())
            .expect("checked")
            .2
    };
    assert_eq!(ask(&scenario(&group(reference))), 0);
    let offered = group("").replace("name=\"g\"", "name=\"g\" parameterAttributes=\"name\"");
    assert_eq!(ask(&scenario(&offered)), 0);
    let astray =
        scenario(&group("")).replace("<StopTrigger/>", &format!("{reference}<StopTrigger/>"));
    assert_eq!(
        ask(&astray),
        1,
        "only a maneuver group may refer to scenarios"
    );
    let alone = scenario(&group("<ParameterReference key=\"value\" value=\"2\"/>"));
    assert_eq!(
        ask(&alone),
        1,
        "a parameter reference without a scenario reference is no modular scenario"
    );
}

#[test]
fn schemas_of_the_user_come_first() {
    let own = compiled(
        "<xs:schema xmlns:xs=\"http://www.w3.org/2001/XMLSchema\"><xs:element name=\"OpenDRIVE\" type=\"xs:anyType\"/></xs:schema>",
    )
    .expect("a schema");
    let version = Some(Version { major: 1, minor: 9 });
    let mut options = Options::default();
    options.overrides.push(Override {
        sources: Default::default(),
        kind: FileKind::Xodr,
        version,
        schema: Arc::new(own),
    });
    let ask = |minor: &str| {
        said(
            "t.xodr",
            FileKind::Xodr,
            &map(&format!("revMajor=\"1\" revMinor=\"{minor}\""), ""),
            &options,
        )
        .expect("checked")
        .0
    };
    assert_eq!(ask("9"), "Test");
    assert_eq!(ask("7"), "OpenDRIVE 1.7");
}

#[test]
fn many_findings_of_one_kind_are_counted() {
    let widths = "<width/>".repeat(5_000);
    let text = map("revMajor=\"1\" revMinor=\"7\"", "").replace(
        "<width sOffset=\"0\" a=\"1\" b=\"0\" c=\"0\" d=\"0\"/>",
        &widths,
    );
    let bytes = image("t.xodr", &text);
    let document = open(&bytes);
    let Outcome::Checked(checked) = check(&document, FileKind::Xodr, &Options::default()) else {
        panic!("skipped")
    };
    assert_eq!(
        checked.violations.len(),
        5 * 20,
        "five attributes, twenty violations each"
    );
    let counted: u64 = checked.rest.iter().map(|rest| rest.count).sum();
    assert_eq!(counted, 5 * 4_980);
    assert!(checked.rest.iter().all(|rest| rest.subject == "width"));
}

#[test]
fn messages_say_where_a_late_child_belongs_and_what_a_short_attribute_meant() {
    let schema = compiled(
        "<xs:schema xmlns:xs='http://www.w3.org/2001/XMLSchema'><xs:element name='a'><xs:complexType>\
         <xs:sequence><xs:element name='first' minOccurs='0'/><xs:element name='then' minOccurs='0'/>\
         <xs:element name='last' minOccurs='0'/></xs:sequence>\
         <xs:attribute name='fromLane' use='required'/></xs:complexType></xs:element></xs:schema>",
    )
    .expect("a sound schema");
    let found = |text: &str| -> Vec<String> {
        let all = support::violations(&schema, "a.xodr", text);
        all.into_iter().map(|(_, text)| text).collect()
    };
    assert_eq!(
        found("<a fromLane='1'><then/><last/><first/></a>"),
        ["<first> in <a> comes too late: it must come before <then>"]
    );
    assert_eq!(
        found("<a from='1'/>"),
        ["<a> has no attribute from; did you mean \"fromLane\"?"]
    );
    assert_eq!(found("<a/>").len(), 1);
}
