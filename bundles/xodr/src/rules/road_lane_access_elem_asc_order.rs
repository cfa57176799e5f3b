use crate::families::ascending;
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.1.0..",
    params: &[ascending::TOLERANCE],
    each: Some(each),
    ..Rule::after(READABLE)
};

/// First version in which one element holds all restrictions of a place.
const RESTRICTION_ELEMENTS: Version = Version::new(1, 8);

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    let lists_are_legal = found
        .version()
        .is_none_or(|version| version < RESTRICTION_ELEMENTS);
    let equal: ascending::Equal = if lists_are_legal {
        |_, _| None
    } else {
        replaced
    };
    ascending::lane_records(map.part(part), "access", equal, found);
}

fn replaced(before: Node<'_>, node: Node<'_>) -> Option<Level> {
    let names_its_vehicle = |node: Node<'_>| node.attribute("restriction").is_some();
    (!(names_its_vehicle(before) && names_its_vehicle(node))).then_some(Level::Warning)
}
