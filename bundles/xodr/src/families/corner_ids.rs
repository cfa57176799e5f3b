//! Checks of the ids of outline corners.

use crate::families::object_parts::{Stands, named, objects, outlines};
use crate::prelude::*;

/// First version in which outlines contain markings.
const MARKINGS_IN_OUTLINES: Version = Version::new(1, 9);

/// Reports outlines whose first corner of this kind has an id other than zero.
pub(crate) fn first_is_zero(map: &RoadMap<'_>, sort: &str, found: &mut Sink<'_>) {
    for object in objects(map) {
        for outline in outlines(object) {
            let Some(first) = outline.child(sort) else {
                continue;
            };
            let Some(id) = number_of(first).filter(|id| *id != 0) else {
                continue;
            };
            let text = format!(
                "the first `{sort}` of the outline has the id {id}, but numbering should begin at 0"
            );
            found
                .issue(Place::attribute_or_node(first, "id"), text)
                .stands(map, object);
        }
    }
}

/// Reports the first corner of an outline whose id does not follow the previous one. It reports
/// nothing where one of the two corners has no id.
pub(crate) fn are_sequential(map: &RoadMap<'_>, sort: &'static str, found: &mut Sink<'_>) {
    for object in objects(map) {
        for outline in outlines(object) {
            let ids = outline
                .children_named(sort)
                .map(|corner| Some((corner, number_of(corner)?)));
            let Some(ids) = ids.collect::<Option<Vec<_>>>() else {
                continue;
            };
            let broken = ids
                .windows(2)
                .find(|pair| pair[0].1.checked_add(1) != Some(pair[1].1));
            if let Some([before, here]) = broken {
                let text = format!(
                    "the id {} of this `{sort}` follows {}; ids should increase by 1 from corner to corner",
                    here.1, before.1
                );
                found
                    .issue(Place::attribute_or_node(here.0, "id"), text)
                    .stands(map, object)
                    .at(before.0, "the previous corner");
            }
        }
    }
}

/// Reports corners without an id in outlines with markings.
pub(crate) fn are_mandatory(map: &RoadMap<'_>, sort: &'static str, found: &mut Sink<'_>) {
    for object in objects(map) {
        let refers = refers_to_corners(object, found.version());
        for outline in outlines(object) {
            let Some(markings) = outline.child("markings").or(refers) else {
                continue;
            };
            let nameless = outline
                .children_named(sort)
                .filter(|corner| corner.attr("id").is_none());
            for corner in nameless {
                let text = format!(
                    "this `{sort}` of {} has no `id`, but must have one, because the outline has markings",
                    named(object)
                );
                found
                    .issue(corner, text)
                    .stands(map, object)
                    .at(markings, "the markings");
            }
        }
    }
}

/// Returns the markings of the object that refer to corners of its only outline, as before 1.9.
fn refers_to_corners(object: Node<'_>, version: Option<Version>) -> Option<Node<'_>> {
    let is_old = version.is_some_and(|version| version < MARKINGS_IN_OUTLINES);
    let is_only = outlines(object).nth(1).is_none();
    let markings = object.child("markings").filter(|_| is_old && is_only)?;
    let refers = |marking: Node<'_>| marking.child("cornerReference").is_some();
    markings
        .children_named("marking")
        .any(refers)
        .then_some(markings)
}

/// Returns the id as a number, or `None` if it is missing or not a number.
fn number_of(corner: Node<'_>) -> Option<i64> {
    corner.i64("id").ok()
}
