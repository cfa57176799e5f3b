use std::cell::LazyCell;

use crate::families::ids::{KINDS, Scope};
use crate::families::object_parts::{listed, named};
use crate::families::own_schema::OwnSchema;
use crate::prelude::*;
use foldhash::HashSet;

pub const RULE: Rule<Document> = Rule {
    run,
    ..Rule::after(READABLE)
};

/// Elements with the attributes that they need to be meaningful.
struct Needs {
    element: &'static str,
    parents: &'static [&'static str],
    attributes: &'static [&'static str],
}

const fn needs(
    element: &'static str,
    parents: &'static [&'static str],
    attributes: &'static [&'static str],
) -> Needs {
    Needs {
        element,
        parents,
        attributes,
    }
}

/// Required attributes. Other rules check object and section positions and reference directions.
const NEEDS: &[Needs] = &[
    needs("road", &["OpenDRIVE"], &["length"]),
    needs("type", &["road"], &["s", "type"]),
    needs("signal", &["signals"], &["s", "t", "orientation"]),
    needs("signalReference", &["signals"], &["id", "s", "t"]),
    needs("objectReference", &["objects"], &["id", "s", "t"]),
    needs("bridge", &["objects"], &["s", "length"]),
    needs("tunnel", &["objects"], &["s", "length"]),
    needs("cornerRoad", &["outline"], &["s", "t"]),
    needs("cornerLocal", &["outline"], &["u", "v"]),
    needs("vertexRoad", &["polyline"], &["s", "t"]),
    needs("vertexLocal", &["polyline"], &["u", "v"]),
    needs("repeat", &["object"], &["s", "length"]),
    needs(
        "validity",
        &["object", "signal", "signalReference", "objectReference"],
        &["fromLane", "toLane"],
    ),
    needs("laneLink", &["connection"], &["from", "to"]),
    needs("control", &["controller"], &["signalId"]),
    needs("dependency", &["signal"], &["id"]),
    needs("speed", &["type", "lane"], &["max"]),
];

fn run(document: &Document<'_>, found: &mut Sink<'_>) {
    let schema = OwnSchema::new(*document);
    ids(document, &schema, found);
    junctions(document, found);
    for needs in NEEDS {
        for node in document.elements(needs.element) {
            check(needs, node, &schema, found);
        }
    }
}

/// Reports missing and empty ids that must be unique in the file. No version allows empty ones.
fn ids(document: &Document<'_>, schema: &OwnSchema<'_>, found: &mut Sink<'_>) {
    let referred = KINDS.iter().filter(|kind| kind.scope == Scope::File);
    for kind in referred {
        for node in kind.nodes(document) {
            let (fault, place) = match node.attribute("id") {
                Some(id) if id.value().trim().is_empty() => ("an empty `id`", Place::from(id)),
                None if !schema.demands(node, "id") => ("no `id`", node.into()),
                _ => continue,
            };
            let text = format!(
                "this {} has {fault}; it must have one, so that other elements can refer to it",
                kind.name
            );
            found.issue(place, text);
        }
    }
}

/// Reports roads whose `junction` is empty. `junctions.cross_path.correct_junction_id` reports
/// connecting roads.
fn junctions(document: &Document<'_>, found: &mut Sink<'_>) {
    // Only few maps need this set.
    let connecting = LazyCell::new(|| {
        let connections = document.elements("connection");
        connections
            .filter_map(|one| one.attr("connectingRoad"))
            .collect::<HashSet<&str>>()
    });
    for road in document.elements("road") {
        let empty = road
            .attribute("junction")
            .filter(|junction| junction.value().trim().is_empty());
        let Some(junction) = empty.filter(|_| !is_user_data(road)) else {
            continue;
        };
        if road.attr("id").is_some_and(|id| connecting.contains(id)) {
            continue;
        }
        let text = format!(
            "`junction` of {} is empty; it must be `-1` for a road outside of junctions, because some readers take an \
             empty one for a junction",
            named(road)
        );
        found.issue(junction, text).level(Level::Warning);
    }
}

fn check(needs: &Needs, node: Node<'_>, schema: &OwnSchema<'_>, found: &mut Sink<'_>) {
    let lacks = |name: &&str| node.attribute(name).is_none();
    let mut missing: Vec<&str> = needs.attributes.iter().copied().filter(lacks).collect();
    let is_there = |parent: Node<'_>| needs.parents.iter().any(|name| parent.is(name));
    if missing.is_empty() || !node.parent().is_some_and(is_there) || is_user_data(node) {
        return;
    }
    missing.retain(|name| !schema.demands(node, name));
    if missing.is_empty() {
        return;
    }
    let text = format!(
        "{} has no {}; {} must be given, otherwise the element has no meaning",
        named(node),
        listed(&missing),
        listed(needs.attributes)
    );
    found.issue(node, text);
}
