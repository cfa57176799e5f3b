use crate::families::corner_references::{Marking, markings};
use crate::families::object_parts::{Stands, has_outline, is_blank, named};
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    uids: &[IN_OUTLINE, IN_OBJECT],
    versions: "1.7.0..",
    backport: Backport::Lower { since: "" },
    run,
    ..Rule::after(READABLE)
};

const IN_OUTLINE: &str =
    "asam.net:xodr:1.9.0:road.object.object_marking.outline_corner_reference_count";
const IN_OBJECT: &str = "asam.net:xodr:1.7.0:road.object.marking.outline_corner_reference_count";

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let in_outlines = found
        .version()
        .is_some_and(|version| version >= Version::new(1, 9));
    for marking in markings(map) {
        let count = marking.references().count();
        if count >= 2 {
            continue;
        }
        let (uid, allowed) = match marking.outline {
            Some(outline) if in_outlines => {
                if refers_to_curve(marking, outline) {
                    continue;
                }
                (IN_OUTLINE, "at least 2 corners or 1 `curveLocal`")
            }
            None if !in_outlines
                && has_outline(marking.object)
                && is_blank(marking.node, "side") =>
            {
                (IN_OBJECT, "at least 2 corners")
            }
            _ => continue,
        };
        let text = format!(
            "the marking of {} lies on an outline and has {count} `cornerReference`; it must refer to {allowed}",
            named(marking.object)
        );
        found
            .issue(marking.node, text)
            .stands(map, marking.object)
            .uid(uid);
    }
}

/// Checks whether a marking refers to a curve. A curve includes both ends of the line.
fn refers_to_curve(marking: Marking<'_>, outline: Node<'_>) -> bool {
    marking.references().any(|reference| {
        let id = reference.attr("id");
        id.is_some()
            && outline
                .children_named("curveLocal")
                .any(|curve| curve.attr("id") == id)
    })
}
