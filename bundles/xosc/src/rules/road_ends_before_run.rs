use crate::families::actions::{acting, short};
use crate::families::init;
use crate::families::motion::{Speeds, may_drive_itself};
use crate::families::relative::Reach;
use crate::prelude::*;
use foldhash::{HashSet, HashSetExt as _};
use qcbus_openscenario::places::Origins;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Information,
    versions: "1.0.0..",
    params: &[TIMES],
    run,
    ..Rule::after(READABLE)
};

const TIMES: Param = Param::number(
    "times",
    5.0,
    "",
    "a run may last this many times as long as the way to the end of the roads",
);

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    if let Network::Map(network) = scenario.network() {
        network.with(|map| look(scenario, map, found));
    }
}

fn look(scenario: &Scenario<'_>, map: &RoadMap<'_>, found: &mut Sink<'_>) {
    // A scenario with one of these knows that entities leave.
    const EXPECTED: [&str; 2] = ["EndOfRoadCondition", "OffroadCondition"];
    let mut expected = EXPECTED
        .iter()
        .flat_map(|name| scenario.elements_everywhere(name));
    let Some(timeline) = scenario.timeline().filter(|_| expected.next().is_none()) else {
        return;
    };
    let ends = timeline.tolerant().ends.earliest;
    let (Some(speeds), Some(mut reach)) = (Speeds::of(scenario), Reach::of(map)) else {
        return;
    };
    let Some(elsewhere) = elsewhere(scenario) else {
        return;
    };
    let times = found.number(&TIMES);
    let origins = Origins::of(scenario, Some(map));
    let at_start = init::speeds_at_start(scenario);
    for (at, start) in origins.starts.iter().enumerate() {
        let (Some(entity), Some(slowest)) = (
            scenario.entities().object(&start.name),
            speeds.slowest(&start.name),
        ) else {
            continue;
        };
        let is_certain = at_start.contains(&start.name)
            && !elsewhere.contains(&start.name)
            && !may_drive_itself(scenario, entity);
        let on = origins.place(at).and_then(|place| origins.on(&place));
        let Some(on) = on.filter(|on| is_certain && on.along && slowest > 0.0) else {
            continue;
        };
        let Some(way) = reach.from(on.road, on.s, true) else {
            continue;
        };
        let seconds = way / slowest;
        if !(ends.is_finite() && seconds * times < ends) {
            continue;
        }
        let text = format!(
            "`{}` reaches the end of the roads after {} s at the latest, {} m away at {} m/s or more, but the run lasts \
             {} s or more; simulators stop it there, let it leave the road, or remove it",
            start.name,
            short(seconds.round()),
            short(way.round()),
            short(slowest),
            short(ends)
        );
        found
            .about(start.position, "", text)
            .at(on.road.node(), "the road on which it starts");
    }
}

/// Returns the entities that may leave the roads, are deleted, or are placed more than once.
/// Returns `None` if they are unknown.
fn elsewhere(scenario: &Scenario<'_>) -> Option<HashSet<String>> {
    let mut found = HashSet::new();
    for action in scenario.elements_everywhere("FollowTrajectoryAction") {
        found.extend(acting(action)?.into_iter().map(|one| one.name().to_owned()));
    }
    for action in scenario.elements_everywhere("EntityAction") {
        let name = action.text("entityRef")?;
        let entities = scenario.entities().expand(&name)?;
        found.extend(entities.into_iter().map(|one| one.name().to_owned()));
    }
    Some(found)
}
