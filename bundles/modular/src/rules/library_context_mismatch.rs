use std::collections::HashSet;

use crate::assembly::{Assembly, Modular, place};
use crate::families::copies::{Taken, short_name};
use crate::families::finds::Finds;
use crate::prelude::*;
use qcbus_schema::Version;

pub const RULE: Rule<Modular> = Rule {
    level: Level::Warning,
    run,
    ..Rule::DEFAULTS
};

fn run(assembly: &Assembly<'_>, found: &mut Sink<'_>) {
    let mut seen = HashSet::new();
    for reference in &assembly.expansion.references {
        let Some(target) = reference.target.filter(|target| seen.insert(*target)) else {
            continue;
        };
        say_version(assembly, reference, assembly.piece(target), found);
    }
    // Only the first group from another map is reported for each piece.
    let mut seen = HashSet::new();
    for taken in assembly.taken() {
        let piece = taken.copy.piece;
        if !seen.contains(&piece) && say_map(assembly, &taken, found) {
            seen.insert(piece);
        }
    }
    let mut finds = Finds::default();
    for taken in assembly.taken() {
        note_prefix(&taken, &mut finds);
    }
    finds.say(found);
}

/// Notes a group with another namespace prefix than the referring group.
fn note_prefix<'d>(taken: &Taken<'_, 'd>, finds: &mut Finds<'d>) {
    let group = taken.copy.group;
    let (theirs, own) = (group.prefix(), taken.reference.group.prefix());
    if theirs == own {
        return;
    }
    let written = |prefix: &str| match prefix {
        "" => "no prefix".to_owned(),
        prefix => format!("the prefix `{prefix}:`"),
    };
    let name = match theirs {
        "" => group.name().to_owned(),
        prefix => format!("{prefix}:{}", group.name()),
    };
    let text = format!(
        "the group `{}` of `{}` is written with {}, and the group that it replaces with {}: most readers of the \
         expanded scenario treat `{name}` as another element, which they ignore or refuse; write both in the \
         same way",
        taken.own_name(),
        short_name(group.document()),
        written(theirs),
        written(own)
    );
    finds.brought(taken.at(), group.into(), "the group", text);
}

/// Reports that a library file names no version, so the version of its groups is unknown.
fn say_no_version(
    reference: &Followed<'_>,
    library: Document<'_>,
    own: Version,
    found: &mut Sink<'_>,
) {
    let Some(root) = library.root() else {
        return;
    };
    let text = format!(
        "`{}` names no version of the standard, so its groups are read by the version of this scenario, {own}; \
         give it a `FileHeader` with `revMajor` and `revMinor`",
        short_name(library)
    );
    let at = place(Spot::of(reference.node, "scenarioFileName"));
    let place = root.child("FileHeader").unwrap_or(root);
    found
        .issue(at, text)
        .at(place, "the place for the version of the library file");
}

fn say_version<'d>(
    assembly: &Assembly<'d>,
    reference: &Followed<'d>,
    library: Document<'d>,
    found: &mut Sink<'_>,
) {
    let root = assembly.root();
    let Some(own) = assembly.version_of(root) else {
        return;
    };
    let Some(theirs) = assembly.version_of(library) else {
        return say_no_version(reference, library, own, found);
    };
    let header = library.root().and_then(|root| root.child("FileHeader"));
    let Some(header) = header.filter(|_| own != theirs) else {
        return;
    };
    let text = format!(
        "`{}` is written for version {theirs} of the standard, but this scenario for {own}, by which its groups \
         are read; use the same version in both",
        short_name(library)
    );
    let minor = match own.major == theirs.major {
        true => "revMinor",
        false => "revMajor",
    };
    found
        .issue(place(Spot::of(reference.node, "scenarioFileName")), text)
        .at(
            Place::attribute_or_node(header, minor),
            "the version of the library file",
        );
}

/// Reports that a group keeps places of another map. Returns `false` when there is no finding.
fn say_map(assembly: &Assembly<'_>, taken: &Taken<'_, '_>, found: &mut Sink<'_>) -> bool {
    let library = taken.copy.group.document();
    let (Some(own), Some(theirs)) = (map_of(assembly.root()), map_of(library)) else {
        return false;
    };
    let path = |map: Node<'_>| map.attr("filepath").unwrap_or("").to_owned();
    let (own_path, their_path) = (path(own), path(theirs));
    // Only file names are compared: the directory may differ, and a parameter may have any value.
    let differ = !own_path.contains('$')
        && !their_path.contains('$')
        && file_name(&own_path) != file_name(&their_path);
    if !differ {
        return false;
    }
    let Some(bound) = bound(taken) else {
        return false;
    };
    let text = format!(
        "the group `{}` of `{}` was written for the map `{their_path}`, but this scenario has `{own_path}`: `{}` \
         in the group refers to a place on the other map, unless keys change it",
        taken.own_name(),
        short_name(library),
        bound.name()
    );
    found
        .issue(place(taken.at()), text)
        .at(
            Place::attribute_or_node(theirs, "filepath"),
            "the map of the library file",
        )
        .at(bound, "an element that refers to a place on it");
    true
}

fn map_of(document: Document<'_>) -> Option<Node<'_>> {
    let map = document.root()?.child("RoadNetwork")?.child("LogicFile")?;
    map.attr("filepath")
        .is_some_and(|path| !path.trim().is_empty())
        .then_some(map)
}

fn file_name(path: &str) -> &str {
    path.trim().rsplit(['/', '\\']).next().unwrap_or(path)
}

/// Elements that depend on the map, with the attributes that refer to it.
const OF_THE_MAP: &[(&str, &[&str])] = &[
    ("AbsoluteTargetLane", &["value"]),
    (
        "GeoPosition",
        &["latitude", "longitude", "latitudeDeg", "longitudeDeg"],
    ),
    ("LanePosition", &["roadId", "laneId", "s"]),
    ("RoadPosition", &["roadId", "s", "t"]),
    ("TrafficSignalCondition", &["name"]),
    ("TrafficSignalStateAction", &["name"]),
    ("WorldPosition", &["x", "y"]),
];

/// Returns an element of a group that depends on its own map, if keys set none of its map
/// attributes. If a key sets one, its author is assumed to have checked the others.
fn bound<'d>(taken: &Taken<'_, 'd>) -> Option<Node<'d>> {
    taken.elements().find(|element| {
        let row = OF_THE_MAP.iter().find(|(name, _)| element.is(name));
        let attributes = row.map_or(&[][..], |(_, attributes)| attributes);
        let mut attributes = attributes
            .iter()
            .filter_map(|name| element.attribute(name))
            .peekable();
        let is_kept = |attribute: Attribute<'_>| {
            taken.copy.edit(attribute).is_none() && !attribute.value().contains('$')
        };
        attributes.peek().is_some() && attributes.all(is_kept)
    })
}
