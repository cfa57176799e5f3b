use crate::families::actions::acting;
use crate::families::init;
use crate::families::positions::{lane_id, listed};
use crate::families::references::quoted;
use crate::families::relative::{self, OnRoad};
use crate::families::stays::{Stays, When};
use crate::prelude::*;
use qcbus_openscenario::RoadNetwork;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    versions: "1.0.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let mut changes = scenario.elements_everywhere("LaneChangeAction");
    if let (Network::Map(network), Some(_)) = (scenario.network(), changes.next()) {
        network.with(|map| look(scenario, network, map, found));
    }
}

fn look(scenario: &Scenario<'_>, network: &RoadNetwork, map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let Some(stays) = Stays::of(scenario, map) else {
        return;
    };
    for one in init::actions(scenario) {
        let target = one.action.child("LaneChangeTarget");
        if let Some(target) = target.and_then(|target| target.children().next()) {
            check(
                target,
                &one.entities,
                When::Start(1),
                &stays,
                network,
                found,
            );
        }
    }
    let Some(timeline) = scenario.timeline() else {
        return;
    };
    for (place, one) in scenario.storyboard().elements().iter().enumerate() {
        let action = one.element(scenario);
        let target = action.path(&[
            "PrivateAction",
            "LateralAction",
            "LaneChangeAction",
            "LaneChangeTarget",
        ]);
        let target = target.and_then(|target| target.children().next());
        let (Some(target), Some(span)) = (target, timeline.tolerant().get(place)) else {
            continue;
        };
        if span.start.is_never() {
            continue;
        }
        let acting = acting(action).unwrap_or_default();
        let names: Vec<String> = acting.iter().map(|one| one.name().to_owned()).collect();
        let when = When::At(place, span.start.latest);
        check(target, &names, when, &stays, network, found);
    }
}

/// Reports the first entity for which the target lane does not exist.
fn check<'m, 'd>(
    target: Element<'m, 'd>,
    entities: &[String],
    when: When,
    stays: &Stays<'m, 'd, '_, '_>,
    network: &RoadNetwork,
    found: &mut Sink<'_>,
) {
    for entity in entities {
        let Some(here) = stays.place_of(entity, when) else {
            continue;
        };
        let (from, attribute, lanes) = match target.name() {
            "RelativeTargetLane" => {
                let Some(reference) = target.text("entityRef") else {
                    return;
                };
                let reference = reference.into_owned();
                let is_own = entities.contains(&reference);
                let moment = match when {
                    When::Start(_) => When::Start(usize::from(is_own)),
                    When::At(..) => when,
                };
                let Some(there) = stays.place_of(&reference, moment) else {
                    return;
                };
                if there.road.index() != here.road.index() {
                    return;
                }
                let lanes = relative_lanes(target, there, network);
                let lane = there.lane.unwrap_or_default();
                (
                    format!("from the lane `{lane}` of `{reference}` "),
                    "value",
                    lanes,
                )
            }
            "AbsoluteTargetLane" => (String::new(), "value", absolute_lane(target, network)),
            _ => return,
        };
        let Some(lanes) = lanes.filter(|lanes| !lanes.is_empty()) else {
            return;
        };
        let Some(all) = lanes_of(here.road) else {
            continue;
        };
        if lanes.iter().any(|lane| all.contains(lane)) {
            continue;
        }
        let ids: Vec<String> = all.iter().map(ToString::to_string).collect();
        let lane = lanes.first().copied().unwrap_or_default();
        let text = format!(
            "the change by {} leads {from}to the lane `{lane}`, but road `{}`, where `{entity}` is, has only {}; this \
             lane change cannot take place",
            quoted(
                target,
                attribute,
                &target.text(attribute).unwrap_or_default()
            ),
            here.road.id(),
            listed(ids.iter().map(String::as_str))
        );
        found
            .about(target, attribute, text)
            .at(here.road.node(), "the road");
        return;
    }
}

/// Returns the lanes that a relative target may mean. Another rule reports changes by more lanes
/// than any road has.
fn relative_lanes(
    target: Element<'_, '_>,
    from: OnRoad<'_, '_>,
    network: &RoadNetwork,
) -> Option<Vec<i64>> {
    let by = target.integer("value")?;
    let is_told = by.unsigned_abs() > network.most_lanes();
    (!is_told).then(|| relative::lanes_by(by, from))?
}

/// Returns the lane of an absolute target. Another rule reports lanes that no road has.
fn absolute_lane(target: Element<'_, '_>, network: &RoadNetwork) -> Option<Vec<i64>> {
    let lane = lane_id(&target.text("value")?)?;
    let is_told = lane == 0 || !network.lane_ids()?.contains(&lane);
    (!is_told).then(|| vec![lane])
}

/// Returns the ids of all lanes of a road, in any of its lane sections. Returns `None` if one of
/// them is unknown.
fn lanes_of(road: &Road<'_>) -> Option<Vec<i64>> {
    let layers = road.layers().iter();
    let sections = layers.flat_map(|layer| layer.sections(road));
    let ids: Option<Vec<i64>> = sections
        .flat_map(|section| section.lanes())
        .map(|lane| lane.id())
        .collect();
    let mut ids = ids?;
    ids.retain(|id| *id != 0);
    ids.sort_unstable_by_key(|id| -id);
    ids.dedup();
    (!ids.is_empty()).then_some(ids)
}
