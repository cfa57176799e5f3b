use crate::families::boards::{Carrier, carriers};
use crate::families::object_parts::{Stands, named};
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    uids: &[STATIC, STATIC_DYNAMIC, VARIABLE],
    versions: "1.8.0..",
    run,
    ..Rule::after(READABLE)
};

const STATIC: &str = "asam.net:xodr:1.8.0:road.signal.boards.static_board_use_correct_type";
/// UID of a requirement in the same list without an identifier.
const STATIC_DYNAMIC: &str = "qcbus.dev:xodr:1.8.0:road.signal.boards.static_board_is_not_dynamic";
/// UID of a requirement in 14.7.2 without an identifier.
const VARIABLE: &str = "qcbus.dev:xodr:1.8.0:road.signal.boards.vms_board_use_correct_type";

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for carrier in carriers(map) {
        // Another rule reports a multi board without one of its halves.
        if carrier.is_called("multiBoard") {
            continue;
        }
        match (carrier.fixed, carrier.variable) {
            (Some(_), None) => {
                demand(
                    map,
                    carrier,
                    ("type", &["staticBoard"]),
                    "static boards only",
                    STATIC,
                    found,
                );
                demand(
                    map,
                    carrier,
                    ("dynamic", &["no", "false", "0"]),
                    "static boards only",
                    STATIC_DYNAMIC,
                    found,
                );
            }
            (None, Some(_)) => {
                demand(
                    map,
                    carrier,
                    ("type", &["vmsBoard"]),
                    "variable boards only",
                    VARIABLE,
                    found,
                );
                demand(
                    map,
                    carrier,
                    ("dynamic", &["yes", "true", "1"]),
                    "variable boards only",
                    VARIABLE,
                    found,
                );
            }
            _ => {}
        }
    }
}

fn demand<'a>(
    map: &RoadMap<'a>,
    carrier: Carrier<'a>,
    (attribute, allowed): (&str, &[&str]),
    boards: &str,
    uid: &str,
    found: &mut Sink<'_>,
) {
    let value = carrier.node.attr(attribute).map_or("", str::trim);
    if allowed.contains(&value) {
        return;
    }
    let text = format!(
        "{} carries {boards}, but its `{attribute}` is `{value}`; it must be `{}`",
        named(carrier.node),
        allowed[0]
    );
    found
        .issue(Place::attribute_or_node(carrier.node, attribute), text)
        .stands(map, carrier.node)
        .uid(uid);
}
