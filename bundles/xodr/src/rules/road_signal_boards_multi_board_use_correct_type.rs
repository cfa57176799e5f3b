use crate::families::boards::carriers;
use crate::families::object_parts::{Stands, named};
use crate::prelude::*;

pub static RULE: Rule<Roads> = Rule {
    id: "check_asam_xodr_road_signal_boards_multi_board_use_correct_type",
    uids: &["asam.net:xodr:1.8.0:road.signal.boards.multi_board_use_correct_type"],
    versions: "1.8.0..",
    after: super::READABLE,
    page: include_str!("road_signal_boards_multi_board_use_correct_type.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for carrier in carriers(map) {
        let (Some(fixed), Some(variable)) = (carrier.fixed, carrier.variable) else {
            continue;
        };
        if carrier.is_called("multiBoard") {
            continue;
        }
        let text = format!(
            "{} carries static and variable boards, but its type is `{}`; it must be `multiBoard`",
            named(carrier.node),
            carrier.node.attr("type").unwrap_or_default()
        );
        found
            .issue(Place::attribute_or_node(carrier.node, "type"), text)
            .stands(map, carrier.node)
            .at(fixed, "a static board")
            .at(variable, "a variable board");
    }
}
