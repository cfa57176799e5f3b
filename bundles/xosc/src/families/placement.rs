//! Start of entities: the elements that place them, and their order.

use crate::prelude::*;
use foldhash::HashSet;

pub(crate) use qcbus_openscenario::places::{Start, starts};

/// Returns the names of all entities that are placed at some time. Returns `None` if this is
/// unknown.
pub(crate) fn placed(scenario: &Scenario<'_>) -> Option<HashSet<String>> {
    let mut placed = trailers(scenario)?;
    // The schema reports a missing `Init`.
    let init = scenario.root().path(&["Storyboard", "Init"])?;
    // The effect of a simulator's own action is unknown.
    let is_open = init
        .child("Actions")
        .is_some_and(|actions| actions.child("UserDefinedAction").is_some());
    if is_open || !scenario.storyboard().is_complete() {
        return None;
    }
    // All actions of a group place the same entities.
    let mut groups: HashSet<u32> = HashSet::default();
    for action in ["TeleportAction", "FollowTrajectoryAction"] {
        for action in scenario.elements_everywhere(action) {
            let mut around = action.ancestors();
            let holder = around.find(|one| one.is("Private") || one.is("ManeuverGroup"))?;
            if !groups.insert(holder.node().offset()) {
                continue;
            }
            for name in Actors::of(holder)?.names()? {
                placed.extend(expanded(scenario, &name)?);
            }
        }
    }
    for action in scenario.elements_everywhere("AddEntityAction") {
        let name = action.parent()?.text("entityRef")?;
        placed.extend(expanded(scenario, &name)?);
    }
    Some(placed)
}

/// Returns the entities that are towed by a vehicle and stand behind it. Returns `None` if they are
/// unknown.
pub(crate) fn trailers(scenario: &Scenario<'_>) -> Option<HashSet<String>> {
    let mut trailers: HashSet<String> = HashSet::default();
    for reference in scenario.elements_everywhere("TrailerRef") {
        trailers.insert(reference.text("entityRef")?.into_owned());
    }
    for action in scenario.elements_everywhere("ConnectTrailerAction") {
        trailers.insert(action.text("trailerRef")?.into_owned());
    }
    let entities = scenario.entities().objects().iter();
    let within = entities.filter(|entity| entity.element(scenario).is("Trailer"));
    trailers.extend(within.map(|entity| entity.name().to_owned()));
    Some(trailers)
}

/// Returns the names of the scenario objects behind a name. An unresolved name is reported
/// elsewhere.
fn expanded(scenario: &Scenario<'_>, name: &str) -> Option<Vec<String>> {
    if !scenario.entities().contains(name) {
        return Some(Vec::new());
    }
    let objects = scenario.entities().expand(name)?;
    Some(
        objects
            .iter()
            .map(|object| object.name().to_owned())
            .collect(),
    )
}
