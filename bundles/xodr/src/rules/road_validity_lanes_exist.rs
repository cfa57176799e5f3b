use crate::families::object_parts::{named, number, owner};
use crate::families::on_road::OnRoad;
use crate::prelude::*;
use qcbus_opendrive::Validity;

pub const RULE: Rule<Roads> = Rule {
    level: Level::Warning,
    each: Some(each),
    ..Rule::after(READABLE)
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for road in map.part(part).roads() {
        let lists = [road.objects_node(), road.signals_node()];
        for holder in lists.into_iter().flatten().flat_map(|list| list.children()) {
            let validities: Vec<Node<'_>> = holder.children_named("validity").collect();
            if !validities.is_empty() {
                check(road, &validities, found);
            }
        }
    }
}

/// Checks that validities only use lanes in the range of the road's widest lane sections.
fn check(road: &Road<'_>, validities: &[Node<'_>], found: &mut Sink<'_>) {
    for node in validities {
        let validity = Validity::of(*node);
        let Some((from, to)) = validity.from_lane().zip(validity.to_lane()) else {
            continue;
        };
        if validity.layer() == LayerKind::Unknown {
            continue;
        }
        let Some(layer) = road.layer(validity.layer()) else {
            continue;
        };
        let ids = layer
            .sections(road)
            .flat_map(|section| section.lanes())
            .filter_map(|lane| lane.id());
        let (low, high) = ids.fold((0, 0), |(low, high), id| (id.min(low), id.max(high)));
        let beyond = |lane: i64| lane < low || lane > high;
        let Some((attribute, lane)) = [("fromLane", from), ("toLane", to)]
            .into_iter()
            .find(|(_, lane)| beyond(*lane))
        else {
            continue;
        };
        let holder = owner(*node);
        let text = format!(
            "`{attribute}` of the validity of {} is {lane}, but road `{}` has lanes from {low} to {high} only",
            named(holder),
            road.id()
        );
        let place = number(holder, "s");
        let finding = found.issue(Place::attribute_or_node(*node, attribute), text);
        if let Some(s) = place {
            finding.on(road, s, number(holder, "t").unwrap_or(0.0));
        }
    }
}
