use crate::families::object_parts::named;
use crate::families::switches::by_id;
use crate::prelude::*;
use qcbus_opendrive::Switch;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.7.0..",
    backport: Backport::Lower { since: "" },
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let all = by_id(map);
    for switch in map.roads().iter().flat_map(Road::switches) {
        let Some(node) = switch.node().child("partner") else {
            continue;
        };
        // Another rule reports a partner that does not exist.
        let Some((_, partner)) = node.attr("id").and_then(|id| all.get(id)) else {
            continue;
        };
        let side = |switch: Switch<'_>| {
            switch
                .side_track()
                .and_then(|track| track.id().map(str::to_owned))
        };
        let (here, there) = (side(switch), side(*partner));
        let (this, other) = (named(switch.node()), named(partner.node()));
        let text = if switch.node() == partner.node() {
            format!("{this} is its own partner; a single switch must not have a partner")
        } else if let (Some(here), Some(there)) = (&here, &there)
            && here != there
        {
            format!(
                "the side track of {this} is road `{here}`, but that of its partner {other} is road `{there}`; \
                 only switches that are joined by the same side track may be partners"
            )
        } else if partner.partner_id() != switch.id() {
            let has = partner
                .partner_id()
                .map_or("none".to_owned(), |id| format!("switch `{id}`"));
            format!(
                "the partner of {this} is {other}, but the partner of the latter is {has}; partners must refer \
                 to each other"
            )
        } else {
            continue;
        };
        found
            .issue(Place::attribute_or_node(node, "id"), text)
            .at(partner.node(), "the other switch");
    }
}
