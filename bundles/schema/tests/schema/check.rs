//! Tests of the choice of the schema for a file, and of the deviations that are allowed.

use std::sync::Arc;

use crate::support::{compiled, image, open, table, violations};
use qcbus_document::FileKind;
use qcbus_schema::{Options, Outcome, Override, Severity, SkipReason, Version, check};

fn map(header: &str, namespace: &str) -> String {
    format!(
        "<OpenDRIVE{namespace}><header {header}/>\
         <road id=\"1\" junction=\"-1\" length=\"1\" name=\"\"><planView><geometry hdg=\"0\" length=\"1\" s=\"0\" x=\"0\" y=\"0\"><line/></geometry></planView>\
         <lanes><laneSection s=\"0\"><center><lane id=\"0\" type=\"none\" level=\"false\"/></center>\
         <right><lane id=\"-1\" type=\"driving\" level=\"false\"><width sOffset=\"0\" a=\"1\" b=\"0\" c=\"0\" d=\"0\"/></lane></right></laneSection></lanes></road></OpenDRIVE>"
    )
}

/// Returns the result of the check of a text: the schema that was used, or the reason why none was.
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
fn header_version_selects_schema() {
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
fn version_newer_than_all_schemas_gives_information_only() {
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
fn default_namespace_gives_no_violations() {
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
}

fn scenario(group: &str) -> String {
    format!(
        "<OpenSCENARIO><FileHeader author=\"a\" date=\"2024-05-01T00:00:00\" description=\"d\" revMajor=\"1\" revMinor=\"0\"/>\
         <CatalogLocations/><RoadNetwork/><Entities/><Storyboard><Init><Actions/></Init><Story name=\"s\"><Act name=\"a\">{group}\
         <StartTrigger/></Act></Story><StopTrigger/></Storyboard></OpenSCENARIO>"
    )
}

#[test]
fn modular_scenario_elements_are_allowed_in_their_places() {
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
        "a parameter reference without a scenario reference is not a modular scenario"
    );
}

#[test]
fn user_schemas_come_before_shipped_ones() {
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
fn message_gives_place_of_late_child_and_intended_attribute() {
    let schema = compiled(
        "<xs:schema xmlns:xs='http://www.w3.org/2001/XMLSchema'><xs:element name='a'><xs:complexType>\
         <xs:sequence><xs:element name='first' minOccurs='0'/><xs:element name='then' minOccurs='0'/>\
         <xs:element name='last' minOccurs='0'/></xs:sequence>\
         <xs:attribute name='fromLane' use='required'/></xs:complexType></xs:element></xs:schema>",
    )
    .expect("the schema is valid");
    let found = |text: &str| -> Vec<String> {
        let all = violations(&schema, "a.xodr", text);
        all.into_iter().map(|(_, text)| text).collect()
    };
    assert_eq!(
        found("<a fromLane='1'><then/><last/><first/></a>"),
        ["<first> in <a> comes too late: it must come before <then>"]
    );
    assert_eq!(
        found("<a from='1'/>"),
        ["Test defines no attribute `from` for `a`; did you mean \"fromLane\"?"]
    );
    assert_eq!(found("<a/>").len(), 1);
}

#[expect(clippy::panic, reason = "a test panics if its data is not as expected")]
/// Returns the violations of a map: their severities, rows and texts.
fn weighed(version: &str, text: &str) -> Vec<(Severity, u32, String)> {
    let header = format!("<OpenDRIVE><header revMajor=\"1\" revMinor=\"{version}\"/>");
    let bytes = image("t.xodr", &(header + text + "</OpenDRIVE>"));
    let document = open(&bytes);
    let Outcome::Checked(checked) = check(&document, FileKind::Xodr, &Options::default()) else {
        panic!("skipped")
    };
    let violations = checked.violations.iter();
    let listed = violations.map(|one| {
        let row = one.node.position().row;
        (checked.severity(one), row, one.text.clone())
    });
    let later = checked.later.iter().flat_map(|later| {
        let things = later.things.iter();
        things.map(|thing| {
            (
                Severity::Error,
                0,
                format!("{} {}", thing.what, thing.since),
            )
        })
    });
    listed.chain(later).collect()
}

const ROAD: &str = "<road name=\"\" length=\"9\" id=\"1\" junction=\"-1\"><planView>\
    <geometry s=\"0\" x=\"0\" y=\"0\" hdg=\"0\" length=\"9\"><line/></geometry></planView>";

#[test]
fn words_in_place_of_numbers_weigh_less_than_typos() {
    let map = |first: &str, second: &str| {
        format!(
            "{ROAD}<lanes><laneSection s=\"0\"><center><lane id=\"0\" type=\"none\" level=\"false\"/></center><right>\
             <lane id=\"-1\" type=\"{first}\" level=\"0\"><width sOffset=\"0\" a=\"3\" b=\"0\" c=\"0\" d=\"0\"/></lane>\
             <lane id=\"-2\" type=\"{second}\" level=\"0\"><width sOffset=\"0\" a=\"3\" b=\"0\" c=\"0\" d=\"0\"/></lane>\
             </right></laneSection></lanes></road>"
        )
    };
    let said = weighed("1", &map("driving", "sidewalk"));
    assert!(
        said.iter()
            .all(|(severity, ..)| *severity == Severity::Information),
        "{said:?}"
    );
    // One violation of each kind is listed for all.
    assert_eq!(said.len(), 3, "{said:?}");
    let said = weighed("1", &map("driving", "sidewlak"));
    let errors = said
        .iter()
        .filter(|(severity, ..)| *severity == Severity::Error);
    assert_eq!(errors.count(), 1, "{said:?}");
}

#[test]
fn features_of_later_version_are_reported_once() {
    let speed = |max: &str| {
        format!(
            "<road name=\"\" length=\"9\" id=\"1\" junction=\"-1\" rule=\"RHT\">\
             <type s=\"0\" type=\"rural\"><speed max=\"{max}\"/></type><planView>\
             <geometry s=\"0\" x=\"0\" y=\"0\" hdg=\"0\" length=\"9\"><line/></geometry></planView>\
             <elevationProfile/><lanes><laneSection s=\"0\"><center><lane id=\"0\" type=\"none\"/></center><right>\
             <lane id=\"-1\" type=\"driving\"><width sOffset=\"0\" a=\"3\" b=\"0\" c=\"0\" d=\"0\"/></lane>\
             </right></laneSection></lanes></road>"
        )
    };
    let said = weighed("4", &speed("13.9"));
    let levels: Vec<Severity> = said.iter().map(|(severity, ..)| *severity).collect();
    assert_eq!(
        levels,
        [
            Severity::Information,
            Severity::Information,
            Severity::Error
        ],
        "{said:?}"
    );
    assert_eq!(said[2].2, "`rule` of `road` 1.5");
    assert!(weighed("6", &speed("13.9")).is_empty());
    assert_eq!(weighed("4", &speed("fast")).len(), 3);
}

/// In 1.4, `userData` needs no attributes. A later version would complain about each of them.
#[test]
fn version_is_advised_only_if_the_file_violates_it_less() {
    let outlines = "<outlines><outline id=\"0\"><cornerLocal u=\"0\" v=\"0\" z=\"0\" height=\"1\"/></outline></outlines>";
    let advice = |more: &str| {
        let object = format!("<object id=\"1\" s=\"0\" t=\"0\" zOffset=\"0\">{outlines}</object>");
        let text = map("revMajor=\"1\" revMinor=\"4\"", "").replace(
            "</road>",
            &format!("<objects>{object}</objects>{more}</road>"),
        );
        let bytes = image("t.xodr", &text);
        match check(&open(&bytes), FileKind::Xodr, &Options::default()) {
            Outcome::Checked(checked) => checked.later.unwrap().advice,
            other => panic!("the version has a schema: {other:?}"),
        }
    };
    // The outlines came with 1.5, which has other violations of this file than 1.6.
    assert_eq!(advice("").map(|version| version.minor), Some(6));
    assert_eq!(advice(&"<userData/>".repeat(20)), None);
}

#[test]
fn features_of_later_version_are_not_reported_as_typos() {
    let outlines = "<outlines><outline id=\"0\"><cornerLocal u=\"0\" v=\"0\" z=\"0\" height=\"1\"/></outline></outlines>";
    let text = map("revMajor=\"1\" revMinor=\"4\"", "").replace(
        "</road>",
        &format!("<objects><object id=\"1\" s=\"0\" t=\"0\" zOffset=\"0\">{outlines}</object></objects></road>"),
    );
    let bytes = image("t.xodr", &text);
    let Outcome::Checked(checked) = check(&open(&bytes), FileKind::Xodr, &Options::default())
    else {
        panic!("the version has a schema");
    };
    assert!(checked.later.is_some_and(|later| later.version.minor == 5));
    let texts = checked.violations.iter().map(|one| &one.text);
    let texts: Vec<_> = texts.filter(|text| text.contains("outline")).collect();
    assert!(texts.is_empty(), "{texts:?}");
    // A name that no version contains may be a spelling mistake.
    let slip = text.replace("outlines>", "outlin>");
    let bytes = image("t.xodr", &slip);
    let Outcome::Checked(checked) = check(&open(&bytes), FileKind::Xodr, &Options::default())
    else {
        panic!("the version has a schema");
    };
    let mut texts = checked.violations.iter().map(|one| &one.text);
    assert!(texts.any(|text| text.ends_with("; did you mean \"outline\"?")));
}

#[test]
fn light_types_of_openscenario_1_2_are_alternatives() {
    let schema = table("xosc-1.2");
    let scenario = |light: &str| {
        format!(
            "<OpenSCENARIO><FileHeader revMajor=\"1\" revMinor=\"2\" date=\"2026-01-01T00:00:00\" description=\"\" \
             author=\"\"/><CatalogLocations/><RoadNetwork/><Entities/><Storyboard><Init><Actions><Private \
             entityRef=\"a\"><PrivateAction><AppearanceAction><LightStateAction><LightType>{light}</LightType>\
             <LightState mode=\"on\"/></LightStateAction></AppearanceAction></PrivateAction></Private></Actions></Init>\
             <StopTrigger/></Storyboard></OpenSCENARIO>"
        )
    };
    let bytes = image(
        "t.xosc",
        &scenario("<VehicleLight vehicleLightType=\"fogLights\"/>"),
    );
    let report = schema.validate(&open(&bytes), qcbus_schema::Limits::default());
    let excused = report.violations.iter();
    let excused = excused.filter(|one| one.known_schema_defect.is_some());
    assert_eq!(excused.count(), 2, "{:?}", report.violations);
    assert_eq!(report.violations.len(), 2, "{:?}", report.violations);
    // These violations are not faults of the file.
    let bytes = image("t.xosc", &scenario(""));
    let report = schema.validate(&open(&bytes), qcbus_schema::Limits::default());
    let faults = report.violations.iter();
    let faults = faults.filter(|one| one.known_schema_defect.is_none());
    assert_eq!(faults.count(), 1, "{:?}", report.violations);
}

#[test]
fn words_of_later_version_are_attributed_to_that_version() {
    let junction = |kind: &str| {
        format!("<junction name=\"\" id=\"1\" type=\"{kind}\"><connection id=\"0\"/></junction>")
    };
    // In 1.8 the type of the element depends on the value of the attribute.
    let told = |version: &str, kind: &str| {
        let said = weighed(version, &junction(kind));
        let texts = said.into_iter().map(|(_, _, text)| text);
        texts.filter(|text| text.contains(kind)).collect::<Vec<_>>()
    };
    assert_eq!(
        told("6", "direct"),
        ["`direct` as `type` of `junction` 1.7"]
    );
    assert_eq!(
        told("7", "crossing"),
        ["`crossing` as `type` of `junction` 1.8"]
    );
    assert!(told("7", "direct").is_empty());
    assert_eq!(told("6", "dirext").len(), 1);
}

#[test]
fn violation_message_explains_attribute_conflict() {
    let object = |attributes: &str, repeat: &str| {
        let said = weighed(
            "8",
            &format!(
                "<road length=\"9\" id=\"1\" junction=\"-1\"><planView>\
                 <geometry s=\"0\" x=\"0\" y=\"0\" hdg=\"0\" length=\"9\"><line/></geometry></planView>\
                 <lanes><laneSection s=\"0\"><center><lane id=\"0\" type=\"none\"/></center></laneSection></lanes>\
                 <objects><object id=\"1\" s=\"1\" t=\"1\" zOffset=\"0\" {attributes}>{repeat}</object></objects></road>"
            ),
        );
        let texts: Vec<String> = said.into_iter().map(|(_, _, text)| text).collect();
        texts.join("\n")
    };
    let both = object("radius=\"1\" width=\"2\"", "");
    assert!(
        both.contains("it has radius and width; an object must have either radius"),
        "{both}"
    );
    let repeat = "<repeat s=\"0\" length=\"9\" distance=\"0\" tStart=\"1\" tEnd=\"1\" heightStart=\"1\" \
                  heightEnd=\"1\" zOffsetStart=\"0\" zOffsetEnd=\"0\"/>";
    let dense = object("type=\"pole\"", repeat);
    assert!(dense.contains("it must be greater than 0"), "{dense}");
    let long = object("heading=\"1\"", "");
    assert!(
        long.contains("no attribute `heading` for `object`; did you mean \"hdg\"?"),
        "{long}"
    );
    let dangling = weighed(
        "8",
        "<junction id=\"1\"><connection id=\"0\" incomingRoad=\"7\" connectingRoad=\"8\" contactPoint=\"start\"/></junction>",
    );
    let mut texts = dangling.iter().map(|(_, _, text)| text);
    assert!(
        texts.any(|text| text.contains("is not defined: no <road> has it as its id")),
        "{dangling:?}"
    );
}

#[test]
fn invisible_text_is_named_by_its_code_point() {
    let text = map("revMajor=\"1\" revMinor=\"7\"", "").replace("<planView>", "\u{a0}<planView>");
    let bytes = image("t.xodr", &text);
    let Outcome::Checked(checked) = check(&open(&bytes), FileKind::Xodr, &Options::default())
    else {
        panic!("not checked");
    };
    let texts: Vec<&str> = checked
        .violations
        .iter()
        .map(|it| it.text.as_str())
        .collect();
    assert_eq!(
        texts,
        ["<road> may not contain text, but contains the invisible character U+00A0"]
    );
}
