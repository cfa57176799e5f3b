//! Tests that elements and attributes have the types of the schema of their version.

use std::path::Path;

use qcbus_document::{Document, FileKind};
use qcbus_ingest::{Limits, prepare_bytes};
use qcbus_schema::{Typing, Version};

const SCENARIO: &str = "<OpenSCENARIO><FileHeader revMajor='1' revMinor='3'/><Entities><ScenarioObject name='Ego'>\
                        <Vehicle name='car' vehicleCategory='car'><Performance maxSpeed='70'/><Nonsense a='1'>\
                        <Performance/></Nonsense></Vehicle></ScenarioObject></Entities></OpenSCENARIO>";

fn with_typing<T>(version: (u32, u32), look: impl FnOnce(Document<'_>, Option<Typing>) -> T) -> T {
    let image = prepare_bytes(Path::new("a.xosc"), SCENARIO.into(), &Limits::default()).build();
    let document = Document::open(&image).unwrap();
    let version = Version {
        major: version.0,
        minor: version.1,
    };
    look(document, Typing::of(&document, FileKind::Xosc, version))
}

#[test]
fn element_class_depends_on_path_from_root() {
    with_typing((1, 3), |document, typing| {
        let typing = typing.unwrap();
        let classes = |name: &str| -> Vec<_> {
            document
                .elements(name)
                .map(|node| typing.class(node))
                .collect()
        };
        assert_eq!(classes("ScenarioObject"), [Some("ScenarioObject")]);
        assert_eq!(classes("Nonsense"), [None]);
        assert_eq!(classes("Performance"), [Some("Performance"), None]);
    });
}

#[test]
fn attribute_values_have_type_or_word_list() {
    with_typing((1, 2), |document, typing| {
        let typing = typing.unwrap();
        let value = |element: &str, attribute: &str| {
            let node = document.elements(element).next().unwrap();
            typing.value(node.attribute(attribute).unwrap())
        };
        assert_eq!(
            value("Performance", "maxSpeed").unwrap().name(),
            Some("Double")
        );
        let category = value("Vehicle", "vehicleCategory").unwrap();
        assert!(
            category
                .words()
                .unwrap()
                .iter()
                .any(|word| &**word == "tram")
        );
        assert!(value("Vehicle", "name").unwrap().words().is_none());
        assert!(value("Nonsense", "a").is_none());
    });
}

#[test]
fn newer_version_uses_newest_schema_and_old_uses_none() {
    assert!(with_typing((1, 4), |_, typing| typing.is_some()));
    assert!(with_typing((0, 9), |_, typing| typing.is_none()));
}
