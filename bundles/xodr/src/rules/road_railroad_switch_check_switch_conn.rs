use std::collections::HashMap;

use crate::families::object_parts::named;
use crate::families::switches::by_id;
use crate::prelude::*;
use qcbus_opendrive::Switch;

pub const RULE: Rule<Roads> = Rule {
    uids: &[CONNECTION, PARENT],
    versions: "1.7.0..",
    backport: Backport::Lower { since: "" },
    run,
    ..Rule::after(READABLE)
};

const CONNECTION: &str = "asam.net:xodr:1.7.0:road.railroad.switch.check_switch_conn";
/// UID of a requirement in the table of `mainTrack` without an identifier.
const PARENT: &str = "qcbus.dev:xodr:1.7.0:road.railroad.switch.main_track_is_parent";

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let all: HashMap<&str, (&Road<'_>, Switch<'_>)> = by_id(map);
    for road in map.roads() {
        for switch in road.switches() {
            main_track(road, switch, found);
            if let Some((_, partner)) = switch.partner_id().and_then(|id| all.get(id)) {
                connection(switch, *partner, found);
            }
        }
    }
}

/// Checks that the switch lies on its main track and leads off it.
fn main_track(road: &Road<'_>, switch: Switch<'_>, found: &mut Sink<'_>) {
    let Some(main) = switch.main_track() else {
        return;
    };
    let Some(id) = main.id() else { return };
    let place = Place::attribute_or_node(main.node(), "id");
    if id != road.id() {
        let text = format!(
            "the main track of {} is road `{id}`, but the switch is defined on road `{}`; both must be the same",
            named(switch.node()),
            road.id()
        );
        found.issue(place, text).uid(PARENT);
    } else if switch.side_track().and_then(|side| side.id()) == Some(id) {
        let text = format!(
            "road `{id}` is both the main and the side track of {}; a switch must lead to another road",
            named(switch.node())
        );
        found.issue(place, text);
    }
}

/// Checks that a road joins the partners and is the side track of both.
fn connection(switch: Switch<'_>, partner: Switch<'_>, found: &mut Sink<'_>) {
    let (Some(side), Some(main)) = (switch.side_track(), partner.main_track()) else {
        return;
    };
    if switch.node() != partner.node() && side.id().is_some() && side.id() == main.id() {
        let text = format!(
            "the side track of {} leads to road `{}`, which is the main track of its partner {}; two switches \
             must be joined by a common side track",
            named(switch.node()),
            side.id().unwrap_or_default(),
            named(partner.node())
        );
        found
            .issue(Place::attribute_or_node(side.node(), "id"), text)
            .at(main.node(), "the partner's main track");
    }
}
