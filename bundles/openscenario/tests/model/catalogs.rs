//! Tests that references to catalogs are followed, and that an entry is read with the assigned
//! parameters of the reference.

use crate::common::{with_catalogs, with_scenario};
use qcbus_openscenario::{EntityKind, Resolution, Scenario, StoryKind};

const VEHICLES: &str = "<CatalogLocations><VehicleCatalog><Directory path=\"v\"/></VehicleCatalog>\
                        <ManeuverCatalog><Directory path=\"m\"/></ManeuverCatalog></CatalogLocations>";

/// A vehicle with the parameter `fast` as its maximum speed, 70 by default.
const CAR: &str = "<Vehicle name=\"car\" vehicleCategory=\"car\"><ParameterDeclarations><ParameterDeclaration \
                   name=\"fast\" parameterType=\"double\" value=\"70\"/></ParameterDeclarations><Performance \
                   maxSpeed=\"$fast\"/></Vehicle>";

fn object(reference: &str) -> String {
    format!(
        "{VEHICLES}<Entities><ScenarioObject name=\"Ego\">{reference}</ScenarioObject></Entities><Storyboard/>"
    )
}

fn reference(catalog: &str, entry: &str, assigned: &str) -> String {
    format!(
        "<CatalogReference catalogName=\"{catalog}\" entryName=\"{entry}\"><ParameterAssignments>{assigned}\
         </ParameterAssignments></CatalogReference>"
    )
}

fn assign(name: &str, value: &str) -> String {
    format!("<ParameterAssignment parameterRef=\"{name}\" value=\"{value}\"/>")
}

fn fastest(scenario: &Scenario<'_>) -> Option<f64> {
    let ego = scenario.entities().object("Ego")?;
    ego.object(scenario)?
        .child("Performance")?
        .number("maxSpeed")
}

#[test]
fn catalog_entry_is_read_with_assigned_parameters() {
    for (assigned, expected) in [
        (String::new(), Some(70.0)),
        (assign("fast", "30"), Some(30.0)),
        (assign("$fast", "${10 * 3}"), Some(30.0)),
        (assign("fast", "red"), None),
    ] {
        let body = object(&reference("c0", "car", &assigned));
        with_catalogs(&body, &[CAR], |scenario| {
            assert_eq!(fastest(scenario), expected, "{assigned}");
            let kind = scenario.entities().object("Ego").map(|ego| ego.kind());
            assert_eq!(kind, Some(EntityKind::Vehicle));
            let faults: Vec<_> = scenario.assignment_faults().collect();
            assert_eq!(faults.len(), usize::from(expected.is_none()), "{assigned}");
        });
    }
}

#[test]
fn catalog_entry_does_not_see_scenario_parameters() {
    let parameters = "<ParameterDeclarations><ParameterDeclaration name=\"outer\" parameterType=\"double\" \
                      value=\"5\"/></ParameterDeclarations>";
    let car = CAR.replace("$fast", "$outer");
    let body = format!("{parameters}{}", object(&reference("c0", "car", "")));
    with_catalogs(&body, &[&car], |scenario| {
        assert_eq!(fastest(scenario), None);
    });
    let body = format!(
        "{parameters}{}",
        object(&reference("c0", "car", &assign("fast", "$outer")))
    );
    with_catalogs(&body, &[CAR], |scenario| {
        assert_eq!(fastest(scenario), Some(5.0));
    });
}

fn resolution<T>(body: &str, catalogs: &[&str], look: impl FnOnce(&Resolution<'_>) -> T) -> T {
    with_catalogs(body, catalogs, |scenario| {
        let reference = scenario.elements("CatalogReference").next();
        look(reference.map_or(&Resolution::Unknown, |reference| {
            scenario.resolution(reference)
        }))
    })
}

#[test]
fn unresolved_catalog_reference_gives_reason() {
    let to = |catalog: &str, entry: &str| object(&reference(catalog, entry, ""));
    let is = |body: &str, expected: &str| {
        let found = resolution(body, &[CAR], |resolution| format!("{resolution:?}"));
        assert!(found.starts_with(expected), "{expected}: {found}");
    };
    is(&to("c0", "car"), "Entry");
    is(&to("c0", "bus"), "NoEntry");
    is(&to("c9", "car"), "NoCatalog");
    is(&to("$unknown", "car"), "Unknown");
    let unlocated = to("c0", "car").replace("VehicleCatalog", "RouteCatalog");
    is(&unlocated, "OtherLocation");
    let nothing = resolution(&to("c0", "car").replace(VEHICLES, ""), &[], |found| {
        found.clone() == Resolution::NoLocation
    });
    assert!(nothing);
    let other = CAR
        .replace("<Vehicle", "<Maneuver")
        .replace("</Vehicle", "</Maneuver");
    assert!(resolution(&to("c0", "car"), &[&other], |found| matches!(
        found,
        Resolution::OtherElement(_)
    )));
}

const MOVES: &str = "<Maneuver name=\"brake\"><Event name=\"now\" priority=\"override\"><Action name=\"stop\"/></Event></Maneuver>";

#[test]
fn maneuver_from_catalog_belongs_to_storyboard() {
    let body = format!(
        "{VEHICLES}<Entities/><Storyboard><Story name=\"s\"><Act name=\"a\"><ManeuverGroup name=\"g\">{}\
         </ManeuverGroup></Act></Story></Storyboard>",
        reference("c1", "brake", "")
    );
    with_catalogs(&body, &[CAR, MOVES], |scenario| {
        let storyboard = scenario.storyboard();
        let found = storyboard.find("g::brake::now::stop");
        assert_eq!(
            found.iter().map(|one| one.kind()).collect::<Vec<_>>(),
            [StoryKind::Action]
        );
        assert!(storyboard.is_complete());
        let action = found[0].element(scenario);
        assert_eq!(
            action
                .ancestor("ManeuverGroup")
                .and_then(|group| group.text("name"))
                .as_deref(),
            Some("g")
        );
        assert!(
            action
                .reference()
                .is_some_and(|reference| reference.is("CatalogReference"))
        );
    });
}

#[test]
fn storyboard_reference_needs_path_without_gap() {
    let body = "<Entities/><Storyboard><Story name=\"s\"><Act name=\"a\"><ManeuverGroup name=\"g\"><Maneuver name=\"m\">\
                <Event name=\"x\"/></Maneuver></ManeuverGroup></Act><Act name=\"b\"><ManeuverGroup name=\"g\"><Maneuver \
                name=\"m\"><Event name=\"x\"/></Maneuver></ManeuverGroup></Act></Story></Storyboard>";
    with_scenario(body, |scenario| {
        let count = |reference: &str| scenario.storyboard().find(reference).len();
        assert_eq!(count("x"), 2);
        assert_eq!(count("a::g::m::x"), 1);
        assert_eq!(count("m::x"), 2);
        assert_eq!(count("a::x"), 0);
        assert_eq!(count("c"), 0);
    });
}

#[test]
fn circular_catalog_references_terminate() {
    let locations = "<CatalogLocations><ControllerCatalog><Directory path=\"a\"/></ControllerCatalog></CatalogLocations>";
    let inner = reference("c0", "driver", "");
    let driver = format!(
        "<Controller name=\"driver\"><ObjectController>{inner}</ObjectController></Controller>"
    );
    let body = format!(
        "{locations}<Entities><ScenarioObject name=\"Ego\"><ObjectController>{inner}</ObjectController></ScenarioObject></Entities>"
    );
    with_catalogs(&body, &[&driver], |scenario| {
        assert!(scenario.tops().count() < 20);
    });
}
