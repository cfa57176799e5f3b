use crate::prelude::*;
use qcbus_schema::{Checked, Code, Detail, Violation};
use qcbus_schema_rule::{Harm, Validated, run_with};

pub const RULE: Rule<Validated> = Rule {
    after: &["check_asam_xodr_xml_version_is_defined"],
    readers: Some(Readers::by_case(
        "readers pass over the order of children, older headers, and most faults of road marks, \
         objects, signals and foreign data",
    )),
    run,
    ..qcbus_schema_rule::RULE
};

/// What CARLA, SUMO's netconvert and maliput do with violations. Measured with single faults in
/// small maps, and with maps of public projects.
const HARM: Harm = Harm {
    of_violation: harm,
    // Readers decide by what they find, not by the version.
    of_old_header: Level::Warning,
};

fn run(checked: &Checked<'_>, found: &mut Sink<'_>) {
    run_with(checked, found, &HARM);
}

/// Elements whose content readers pass over, or read leniently: what stands beside the road, and
/// how it looks. The geometry of roads and lanes and their links are outside of them.
const LENIENT: [&str; 8] = [
    "roadMark",
    "objects",
    "signals",
    "userData",
    "material",
    "dataQuality",
    "boundary",
    "surface",
];

/// Attributes without which an element has no place or cannot be referred to.
const PLACES: [&str; 11] = [
    "s", "t", "sOffset", "id", "x", "y", "z", "u", "v", "dx", "dy",
];

fn harm(violation: &Violation<'_>) -> Level {
    let parent = || violation.node.parent();
    let node = match violation.detail {
        Detail::Before => parent().unwrap_or(violation.node),
        _ => violation.node,
    };
    let around = || std::iter::once(node).chain(node.ancestors());
    let is_lenient = around().any(|it| LENIENT.iter().any(|name| it.is(name)));
    let attribute = violation.attribute.map(|attribute| attribute.name());
    let harmless = match violation.code {
        Code::MisplacedElement => true,
        Code::MissingElement => {
            let comes_later = violation.detail == Detail::Later;
            comes_later || is_lenient || node.is("left") || node.is("right")
        }
        Code::UnexpectedElement
        | Code::RepeatedElement
        | Code::UnexpectedAttribute
        | Code::UnexpectedText
        | Code::ConditionFailed
        | Code::DuplicateKey => is_lenient,
        Code::MissingAttribute => is_lenient && !lacks_place(violation),
        // maliput refuses an unknown orientation.
        Code::InvalidValue if attribute == Some("orientation") => false,
        Code::InvalidValue => {
            is_lenient && (is_code(node, attribute) || !is_broken_number(violation))
        }
        _ => false,
    };
    match harmless {
        true => Level::Warning,
        false => Level::Error,
    }
}

/// Checks whether an element lacks an attribute without which it has no place.
fn lacks_place(violation: &Violation<'_>) -> bool {
    let Detail::Missing(name) = &violation.detail else {
        return false;
    };
    PLACES.contains(&name.as_str()) || (name == "type" && violation.node.is("signal"))
}

/// Checks whether a value is a code, which readers keep as a text.
fn is_code(node: Node<'_>, attribute: Option<&str>) -> bool {
    let codes = ["type", "subtype", "unit", "country", "countryRevision"];
    node.is("signal") && attribute.is_some_and(|name| codes.contains(&name))
}

/// Checks whether a number is expected and the value is none. Readers convert every number, also of
/// elements that they do not use.
fn is_broken_number(violation: &Violation<'_>) -> bool {
    let Some(attribute) = &violation.attribute else {
        return false;
    };
    let value = attribute.value();
    let number = value.trim().parse::<f64>();
    violation.detail == Detail::Number && !number.is_ok_and(f64::is_finite)
}
