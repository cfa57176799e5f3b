use crate::families::object_parts::{CORNERS, Stands, is_before, objects, outlines};
use crate::prelude::*;
use qcbus_sdk::fault_of;

pub const RULE: Rule<Roads> = Rule {
    uids: &[OUTLINE, LOCAL, ROAD, CURVE],
    versions: "1.7.0..",
    backport: Backport::Alike { since: "" },
    run,
    ..Rule::after(READABLE)
};

const OUTLINE: &str = "asam.net:xodr:1.9.0:road.object.outline.outline_followed_by_corner";
const LOCAL: &str = "asam.net:xodr:1.7.0:road.corner_local.element_min_amount";
const ROAD: &str = "asam.net:xodr:1.7.0:road.corner_road.element_min_amount";
const CURVE: &str = "asam.net:xodr:1.9.0:road.curve_local.element_min_amount";

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for object in objects(map) {
        for outline in outlines(object) {
            check(map, object, outline, found);
        }
    }
}

fn check<'a>(map: &RoadMap<'a>, object: Node<'a>, outline: Node<'a>, found: &mut Sink<'_>) {
    let [road, local, curves] = CORNERS.map(|sort| outline.children_named(sort).count());
    let is_closed = matches!(outline.attr("closed"), Some("true" | "1"));
    if is_closed && road.max(local) == 2 && curves == 0 {
        let text = "the outline is closed, but two corners enclose no area; a closed outline needs at least three";
        let mild = if is_before(found, (1, 7)) {
            Level::Information
        } else {
            Level::Warning
        };
        let finding = found.issue(outline, text).level(mild);
        let uid = if road == 2 { ROAD } else { LOCAL };
        finding.stands(map, object).uid(uid);
    }
    if road >= 2 || local >= 2 || curves >= 1 {
        return;
    }
    let stray = outline
        .children()
        .find(|child| matches!(child.name(), "line" | "arc" | "paramPoly3"));
    let (uid, text) = match (road, local, stray) {
        (1, 0, _) => (
            ROAD,
            "the outline has 1 `cornerRoad`, but needs at least 2".to_owned(),
        ),
        (0, 1, _) => (
            LOCAL,
            "the outline has 1 `cornerLocal`, but needs at least 2".to_owned(),
        ),
        (0, 0, Some(shape)) => {
            let text = format!(
                "the outline has no `curveLocal`, but contains a `{}` itself; at least 1 `curveLocal` must \
                 contain the curve",
                shape.name()
            );
            (CURVE, text)
        }
        _ => {
            let text = format!(
                "the outline has {road} `cornerRoad`, {local} `cornerLocal` and no `curveLocal`; it needs at \
                 least 2, 2 or 1 of them respectively"
            );
            (OUTLINE, text)
        }
    };
    found
        .issue(outline, text)
        .stands(map, object)
        .uid(uid)
        .fault(fault_of(outline));
}
