//! Notes on single conditions of the published schemas: explanations as text, and schema defects
//! that reject documents which the standard allows.
//!
//! An entry names a condition by its compiled form and not by a line number. A test checks that
//! every entry still occurs in a shipped table.

use qcbus_document::{Attribute, Node};

use crate::violation::Code;

pub(crate) const COMPLETE_OUTLINE: &str =
    "(if @useCompleteOutline (not cornerReference) (> (count cornerReference) 1))";
pub(crate) const SIDE: &str = "(if @side (not cornerReference) (> (count cornerReference) 1))";
pub(crate) const MULTI_BOARD: &str = "(or (not (= @type \"multiBoard\")) (and (= @type \"multiBoard\") \
     (= @dynamic (true)) (> (count vmsBoard) 0) (> (count staticBoard) 0)))";
pub(crate) const CONNECTION_IDS: &str =
    "(= (count connection/@id) (count-distinct connection/@id))";
pub(crate) const BORDER_AND_OFFSET: &str =
    "(if (> (count laneOffset) 0) (= (count laneSection//border) 0) (true))";
pub(crate) const RADIUS: &str = "(or (not (or @radius @width @length)) (and @radius (not (or @width @length))) \
     (and @width @length (not @radius)))";
pub(crate) const CROSS_SECTION: &str =
    "(or (not crossSectionSurface) (and (not superelevation) (not shape)))";

/// Returns the explanation of a condition for the element that breaks it.
pub(crate) fn explanation(node: Node<'_>, condition: &str) -> Option<String> {
    let fixed = match condition {
        COMPLETE_OUTLINE => {
            "with useCompleteOutline, <cornerReference> is not allowed; without it, at least two are required"
        }
        SIDE => {
            "with the attribute side, <cornerReference> is not allowed; without it, at least two are required"
        }
        MULTI_BOARD => {
            "a signal of type multiBoard must be dynamic and have at least one <vmsBoard> and one <staticBoard>"
        }
        CONNECTION_IDS => "two <connection> elements of this junction have the same id",
        BORDER_AND_OFFSET => "lanes may be described by <laneOffset> or by <border>, not by both",
        RADIUS => return Some(radius(node)),
        CROSS_SECTION => "<crossSectionSurface> excludes <superelevation> and <shape>",
        _ => return by_type(node, condition),
    };
    Some(fixed.to_owned())
}

/// Describes which of the mutually exclusive attributes an object has.
fn radius(object: Node<'_>) -> String {
    let there: Vec<&str> = ["radius", "width", "length"]
        .into_iter()
        .filter(|name| object.attribute(name).is_some())
        .collect();
    format!(
        "it has {}; an object must have either radius, or both width and length, or none of them",
        there.join(" and ")
    )
}

/// Conditions on the distance of repeated objects, with their explanation.
const DISTANCES: [(&str, &str); 3] = [
    (
        "(= repeat/@distance 0)",
        "0, because the object continues without gaps",
    ),
    (
        "(> repeat/@distance 0)",
        "greater than 0, because the copies are separate",
    ),
    (
        "(!= repeat/@distance 0)",
        "different from 0, because the copies are separate",
    ),
];

/// Explains conditions that forbid children by the type of an object.
fn by_type(node: Node<'_>, condition: &str) -> Option<String> {
    let ty = node.attr("type")?;
    if !condition.starts_with(&format!("(if (= @type \"{ty}\") (and ")) {
        return None;
    }
    let banned: Vec<&str> = condition
        .split("(not ")
        .skip(1)
        .map(|rest| rest.split([')', ' ']).next().unwrap_or(""))
        .filter(|name| !name.contains('/'))
        .filter(|name| match name.strip_prefix('@') {
            Some(attribute) => node.attribute(attribute).is_some(),
            None => node.child(name).is_some(),
        })
        .collect();
    if banned.is_empty() {
        let distance = node
            .child("repeat")
            .and_then(|repeat| repeat.attr("distance"))?;
        let allowed = DISTANCES
            .iter()
            .find(|(test, _)| condition.contains(test))
            .map_or("another", |(_, allowed)| allowed);
        return Some(format!(
            "the distance \"{distance}\" of <repeat> is invalid for an object of type {ty}; it must be {allowed}"
        ));
    }
    Some(format!(
        "an object of type {ty} must not have {}",
        banned.join(", ")
    ))
}

/// Returns the schema defect that causes a failed condition, if there is one.
pub(crate) fn condition(node: Node<'_>, condition: &str) -> Option<&'static str> {
    match condition {
        COMPLETE_OUTLINE => {
            let references = node.children_named("cornerReference").count();
            match node.attr("useCompleteOutline") {
                Some("false") if references > 1 => Some(
                    "it tests whether useCompleteOutline is present, not whether it is true; \"false\" with \
                     corner references is rejected although the standard allows it",
                ),
                None if references == 0 => Some(
                    "useCompleteOutline is optional in the standard, but without it the schema requires corner \
                     references",
                ),
                _ => None,
            }
        }
        MULTI_BOARD => {
            let complete = node.child("vmsBoard").is_some() && node.child("staticBoard").is_some();
            (complete && node.attr("dynamic") == Some("yes")).then_some(
                "it compares dynamic, whose values are yes and no, with the boolean true; therefore no such \
                 signal is valid",
            )
        }
        _ => None,
    }
}

/// Returns the defect of the schema with this title that causes a missing child, if any.
pub(crate) fn missing_child(parent: Node<'_>, names: &[&str], title: &str) -> Option<&'static str> {
    if names.contains(&"_OpenDriveElement") {
        return Some(
            "it requires a child <_OpenDriveElement>, which is the name of an internal base type and not meant \
             for files",
        );
    }
    let profile = parent.is("elevationProfile") || parent.is("lateralProfile");
    if profile && matches!(title, "OpenDRIVE 1.4" | "OpenDRIVE 1.5") {
        return Some(
            "it requires records in a profile that may be omitted; an empty profile, which means the same, is \
             rejected",
        );
    }
    let alternatives = ALTERNATIVES.iter().find(|(name, _)| parent.is(name));
    let one_is_there = |both: &[&str; 2]| both.iter().any(|one| parent.child(one).is_some());
    (title == "OpenSCENARIO 1.2" && alternatives.is_some_and(|(_, both)| one_is_there(both)))
        .then_some(
            "it requires both children in sequence, but the standard requires one or the other",
        )
}

/// Returns the defect of the schema with this title that causes a misplaced child, if any.
pub(crate) fn misplaced_child(
    child: Node<'_>,
    parent: Node<'_>,
    title: &str,
) -> Option<&'static str> {
    let is_addition = ["userData", "include", "dataQuality"]
        .iter()
        .any(|name| child.is(name));
    let either = matches!(title, "OpenDRIVE 1.5" | "OpenDRIVE 1.6");
    (either && parent.is("geometry") && is_addition).then_some(
        "it allows additional data only instead of a curve; the other versions allow it beside the curve",
    )
}

/// Returns the defect of the schema with this title that forbids elements in this parent, if there
/// is one.
pub(crate) fn children_of_none(parent: Node<'_>, title: &str) -> Option<&'static str> {
    let is_old = matches!(title, "OpenDRIVE 1.1" | "OpenDRIVE 1.2");
    (is_old && parent.is("userData")).then_some(
        "it allows no elements in userData; later versions allow whatever an application needs",
    )
}

/// Elements of OpenSCENARIO 1.2 with alternative children. Its schema lists these children as a
/// sequence.
const ALTERNATIVES: [(&str, [&str; 2]); 3] = [
    ("AppearanceAction", ["LightStateAction", "AnimationAction"]),
    ("LightType", ["VehicleLight", "UserDefinedLight"]),
    (
        "ComponentAnimation",
        ["VehicleComponent", "UserDefinedComponent"],
    ),
];

/// Returns the defect of the schema with this title that causes the violation `code` of an
/// attribute, if there is one.
pub(crate) fn attribute(code: Code, attribute: Attribute<'_>, title: &str) -> Option<&'static str> {
    match (code, title) {
        (Code::InvalidValue, _) => value(attribute, title),
        (Code::UnexpectedAttribute, "OpenDRIVE 1.1")
            if attribute.name() == "level" && is_in_center(attribute.node()) =>
        {
            Some(
                "it allows level on the lanes of both sides, but not on the center lane, where files have it as \
                 well",
            )
        }
        (Code::UnexpectedAttribute, "OpenDRIVE 1.2")
            if attribute.name() == "laneChange"
                && attribute.node().is("roadMark")
                && attribute.node().parent().is_some_and(is_in_center) =>
        {
            Some(
                "it allows laneChange on the lanes of both sides, but not on the center lane, where it means the \
                 same",
            )
        }
        (Code::UnexpectedAttribute, "OpenDRIVE 1.1" | "OpenDRIVE 1.2")
            if attribute.name() == "signalId" && attribute.node().is("control") =>
        {
            Some(
                "it spells the attribute signalID; all files and the later versions spell it signalId",
            )
        }
        _ => None,
    }
}

fn is_in_center(lane: Node<'_>) -> bool {
    lane.is("lane") && lane.parent().is_some_and(|parent| parent.is("center"))
}

/// Lane type names in files of version 1.1.
const LANE_TYPES: [&str; 23] = [
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
    "mwyEntry",
    "mwyExit",
];

fn value(attribute: Attribute<'_>, title: &str) -> Option<&'static str> {
    let (node, word) = (attribute.node(), attribute.value().trim());
    match (title, attribute.name()) {
        ("OpenDRIVE 1.1", "type") if node.is("lane") && LANE_TYPES.contains(&word) => {
            Some("it uses numbers for the types of lanes; the standard and all files use words")
        }
        ("OpenDRIVE 1.1", "type") if node.is("object") && is_word(word) => {
            Some("it uses numbers for the types of objects; files and the later versions use words")
        }
        ("OpenDRIVE 1.1", "type") if node.is("signal") && is_word(word) => {
            Some("it uses numbers for the types of signals; files and the later versions use words")
        }
        ("OpenDRIVE 1.1", "id") if (node.is("object") || node.is("signal")) && is_word(word) => {
            Some(
                "it uses numbers for the ids of objects and signals; files and the later versions use any text",
            )
        }
        ("OpenDRIVE 1.1", "level") if node.is("lane") && matches!(word, "true" | "false") => {
            Some("it uses numbers for level; the standard and all files use true and false")
        }
        ("OpenDRIVE 1.4", "max") if node.is("speed") && is_decimal(word) => Some(
            "it allows only whole numbers, although speeds in m/s are seldom whole; later versions allow \
             decimals",
        ),
        ("OpenDRIVE 1.8.1", "sStart" | "sEnd") if node.is("segment") && word == "begin" => {
            Some("it uses start; the text and the examples of the standard use begin")
        }
        _ => None,
    }
}

fn is_word(text: &str) -> bool {
    text.starts_with(|c: char| c.is_ascii_alphabetic())
}

fn is_decimal(word: &str) -> bool {
    word.parse()
        .is_ok_and(|speed: f64| speed.is_finite() && speed >= 0.0)
}

/// Returns the conditions with an explanation or a known defect. A test checks that they still
/// occur.
#[doc(hidden)]
pub fn known_conditions() -> [&'static str; 7] {
    [
        COMPLETE_OUTLINE,
        SIDE,
        MULTI_BOARD,
        CONNECTION_IDS,
        BORDER_AND_OFFSET,
        RADIUS,
        CROSS_SECTION,
    ]
}
