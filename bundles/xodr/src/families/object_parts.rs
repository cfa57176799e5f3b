//! Objects of roads and junctions, and their parts (OpenDRIVE 1.9, chapter 13).

use crate::prelude::*;

/// Elements that are points of an outline.
pub(crate) const CORNERS: [&str; 3] = ["cornerRoad", "cornerLocal", "curveLocal"];

/// Returns the objects of all roads and junctions in document order.
pub(crate) fn objects<'a>(map: &RoadMap<'a>) -> impl Iterator<Item = Node<'a>> + use<'a> {
    below(map, "object", "objects")
}

/// Returns elements by name and by name of their direct parent, outside user data.
pub(crate) fn below<'a>(
    map: &RoadMap<'a>,
    name: &'static str,
    parent: &'static str,
) -> impl Iterator<Item = Node<'a>> + use<'a> {
    let all = map.root().map(|root| root.document().elements(name));
    all.into_iter()
        .flatten()
        .filter(move |node| stands_below(*node, parent))
}

/// Checks whether an element is a direct child of an element with this name, outside user data.
pub(crate) fn stands_below(node: Node<'_>, parent: &str) -> bool {
    node.parent().is_some_and(|above| above.is(parent)) && !is_user_data(node)
}

/// Returns the outlines of an object: in `<outlines>`, or directly in it as before 1.5.
pub(crate) fn outlines(object: Node<'_>) -> impl Iterator<Item = Node<'_>> {
    object
        .children_named("outlines")
        .flat_map(|list| list.children_named("outline"))
        .chain(object.children_named("outline"))
}

/// Checks whether an object has an outline.
pub(crate) fn has_outline(object: Node<'_>) -> bool {
    outlines(object).next().is_some()
}

/// Returns the corners and curves of an outline in document order.
pub(crate) fn corners(outline: Node<'_>) -> impl Iterator<Item = Node<'_>> {
    outline
        .children()
        .filter(|child| CORNERS.contains(&child.name()))
}

/// Returns the polylines of all skeletons.
pub(crate) fn polylines<'a>(map: &RoadMap<'a>) -> impl Iterator<Item = Node<'a>> + use<'a> {
    objects(map)
        .flat_map(|object| object.children_named("skeleton"))
        .flat_map(|skeleton| skeleton.children_named("polyline"))
}

/// Returns the attribute as a finite number.
pub(crate) fn number(node: Node<'_>, attribute: &str) -> Option<f64> {
    node.f64(attribute).ok().filter(|value| value.is_finite())
}

/// Reports tunnels or bridges without a type, or with a type that is not in the standard.
pub(crate) fn check_types(
    map: &RoadMap<'_>,
    name: &'static str,
    types: &[&str],
    found: &mut Sink<'_>,
) {
    for node in below(map, name, "objects") {
        let kind = node.attr("type").map_or("", str::trim);
        if types.contains(&kind) {
            continue;
        }
        let has = match kind {
            "" => "no `type`".to_owned(),
            kind => format!("the unknown type `{kind}`"),
        };
        let text = format!(
            "{} has {has}; its type must be one of {}",
            named(node),
            listed(types)
        );
        found
            .issue(Place::attribute_or_node(node, "type"), text)
            .stands(map, node);
    }
}

/// Checks whether the file has an older version than this.
pub(crate) fn is_before(found: &Sink<'_>, edition: (u16, u16)) -> bool {
    let version = found.version();
    version.is_some_and(|version| (version.major, version.minor) < edition)
}

/// Checks whether the schema of the file's version already reports a fact, which holds for the
/// versions `from` to `to`.
pub(crate) fn is_by_schema(found: &Sink<'_>, from: (u16, u16), to: (u16, u16)) -> bool {
    let version = found.version();
    version.is_some_and(|version| (from..=to).contains(&(version.major, version.minor)))
}

/// Checks whether a text attribute is missing or blank.
pub(crate) fn is_blank(node: Node<'_>, attribute: &str) -> bool {
    node.attr(attribute)
        .is_none_or(|text| text.trim().is_empty())
}

/// Returns an element as name and id: ``object `7` ``.
pub(crate) fn named(node: Node<'_>) -> String {
    match node.attr("id") {
        Some(id) => format!("{} `{id}`", node.name()),
        None => node.name().to_owned(),
    }
}

/// Returns names in backticks, as a list in a sentence.
pub(crate) fn listed(names: &[&str]) -> String {
    let quoted: Vec<String> = names.iter().map(|name| format!("`{name}`")).collect();
    match quoted.as_slice() {
        [] => String::new(),
        [only] => only.clone(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}

/// Adds the position of an element on its road to a finding.
pub(crate) trait Stands {
    /// Adds the position at `@s` and `@t`, raised by `@zOffset`, or the start of a bridge or
    /// tunnel. Adds nothing if one of them or the road is missing.
    fn stands<'a>(self, map: &RoadMap<'a>, node: Node<'a>) -> Self;
}

impl Stands for Finding<'_, '_> {
    fn stands<'a>(self, map: &RoadMap<'a>, node: Node<'a>) -> Self {
        let t = match node.name() {
            "bridge" | "tunnel" => Some(0.0),
            _ => number(node, "t"),
        };
        let place = number(node, "s").zip(t);
        let (Some(road), Some((s, t))) = (map.road_of(node), place) else {
            return self;
        };
        let finding = self.road(road.id(), s, t);
        let up = number(node, "zOffset").unwrap_or(0.0);
        match road.point(s, t, up) {
            Some(point) => finding.point(point.x, point.y, point.z),
            None => finding,
        }
    }
}

/// Returns the object, structure, signal or reference that contains an element.
pub(crate) fn owner(node: Node<'_>) -> Node<'_> {
    const OWNERS: [&str; 6] = [
        "object",
        "objectReference",
        "bridge",
        "tunnel",
        "signal",
        "signalReference",
    ];
    std::iter::once(node)
        .chain(node.ancestors())
        .find(|above| OWNERS.contains(&above.name()))
        .unwrap_or(node)
}
