use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    level: Level::Warning,
    // From 1.5 on the schema requires these attributes.
    versions: "..1.5.0",
    each: Some(each),
    ..Rule::after(READABLE)
};

const CUBIC: [&str; 5] = ["s", "a", "b", "c", "d"];
const IN_SECTION: [&str; 5] = ["sOffset", "a", "b", "c", "d"];
const SHAPE: [&str; 6] = ["s", "t", "a", "b", "c", "d"];
const GEOMETRY: [&str; 5] = ["s", "x", "y", "hdg", "length"];

/// Required attributes of the curves of a reference line.
const CURVES: [(&str, &[&str]); 4] = [
    ("arc", &["curvature"]),
    ("spiral", &["curvStart", "curvEnd"]),
    ("poly3", &["a", "b", "c", "d"]),
    (
        "paramPoly3",
        &["aU", "bU", "cU", "dU", "aV", "bV", "cV", "dV"],
    ),
];

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for road in map.part(part).roads() {
        of_reference_line(road, found);
        of_profile(road, road.elevation(), found);
        of_profile(road, &road.lateral().superelevation, found);
        for row in road.lateral().shape.rows() {
            for record in row.profile.records() {
                check(road, record.node(), &SHAPE, found);
            }
        }
        if let Some(layer) = road.permanent() {
            of_profile(road, layer.offset(), found);
        }
    }
    for lane in map.part(part).lanes() {
        for profile in [lane.widths(), lane.borders()] {
            for record in profile.records() {
                check(lane.at.road, record.node(), &IN_SECTION, found);
            }
        }
    }
}

fn of_reference_line(road: &Road<'_>, found: &mut Sink<'_>) {
    for geometry in road.plan_view().geometries() {
        check(road, geometry.node(), &GEOMETRY, found);
        for shape in geometry.shapes() {
            if let Some((_, names)) = CURVES.iter().find(|(name, _)| shape.is(name)) {
                check(road, shape, names, found);
            }
        }
    }
}

fn of_profile(road: &Road<'_>, profile: &Profile<'_>, found: &mut Sink<'_>) {
    for record in profile.records() {
        check(road, record.node(), &CUBIC, found);
    }
}

fn check(road: &Road<'_>, node: Node<'_>, names: &[&str], found: &mut Sink<'_>) {
    // Nearly all elements have their attributes in the order of the standard.
    let mut written = node.attributes();
    let in_order = |name: &&str| written.next().is_some_and(|attribute| attribute.is(name));
    if names.iter().all(in_order) {
        return;
    }
    let missing: Vec<String> = names
        .iter()
        .filter(|name| node.attribute(name).is_none())
        .map(|name| format!("`{name}`"))
        .collect();
    if missing.is_empty() {
        return;
    }
    let text = format!(
        "this `{}` of road `{}` has no {}; it should have all of {}, because readers assume a value for each \
         missing attribute",
        node.name(),
        road.id(),
        missing.join(" and no "),
        names.join(", ")
    );
    found.issue(node, text);
}
