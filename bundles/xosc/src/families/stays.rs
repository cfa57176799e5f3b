//! Entities that certainly are still in the lane in which `Init` places them.

use crate::families::actions::acting;
use crate::families::deletions::added;
use crate::families::init;
use crate::families::motion::{Speeds, may_drive_itself};
use crate::families::relative::OnRoad;
use crate::prelude::*;
use qcbus_opendrive::ContactPoint;
use qcbus_openscenario::StoryKind;
use qcbus_openscenario::places::Origins;

/// A moment of the run.
#[derive(Debug, Clone, Copy)]
pub(crate) enum When {
    /// `Init`, with this number of actions that may move the entity: 1 for the lane change itself.
    Start(usize),
    /// The start of this element of the storyboard, at this time in seconds at the latest.
    At(usize, f64),
}

/// What is known about the lanes of entities during the run.
pub(crate) struct Stays<'m, 'd, 'w, 'r> {
    scenario: &'m Scenario<'d>,
    origins: Origins<'m, 'd, 'w, 'r>,
    speeds: Speeds,
    /// Actions that may change the lane or the road: the entity, the element of the storyboard
    /// (`None` in `Init`) and the earliest time.
    movers: Vec<(String, Option<usize>, f64)>,
    /// Names of the entities that `Init` or an `AddEntityAction` places, once for each time.
    placed: Vec<String>,
}

impl<'m, 'd, 'w, 'r> Stays<'m, 'd, 'w, 'r> {
    /// Reads the scenario. Returns `None` if an unknown action may move an entity.
    pub(crate) fn of(
        scenario: &'m Scenario<'d>,
        map: &'w RoadMap<'r>,
    ) -> Option<Stays<'m, 'd, 'w, 'r>> {
        let timeline = scenario.timeline()?;
        let speeds = Speeds::of(scenario)?;
        // An entity that is added is placed again.
        let mut placed = added(scenario)?;
        let mut movers = Vec::new();
        for one in init::actions(scenario) {
            if one.action.is("TeleportAction") {
                placed.extend(one.entities.iter().cloned());
            }
            if !keeps_lane(one.action.name()) {
                movers.extend(one.entities.into_iter().map(|entity| (entity, None, 0.0)));
            }
        }
        for (place, one) in scenario.storyboard().elements().iter().enumerate() {
            let element = one.element(scenario);
            let private = element.child("PrivateAction");
            let kind = private.and_then(|it| it.children().next());
            let Some(kind) = kind.filter(|_| one.kind() == StoryKind::Action) else {
                continue;
            };
            if !keeps_lane(kind.name()) || kind.is("TeleportAction") {
                let start = timeline.tolerant().get(place)?.start;
                for entity in acting(element)? {
                    movers.push((entity.name().to_owned(), Some(place), start.earliest));
                }
            }
        }
        Some(Stays {
            scenario,
            origins: Origins::of(scenario, Some(map)),
            speeds,
            movers,
            placed,
        })
    }

    /// Returns the place in which `Init` puts an entity, if the entity certainly stays on this road
    /// and in this lane until a moment.
    pub(crate) fn place_of(&self, entity: &str, when: When) -> Option<OnRoad<'w, 'r>> {
        let object = self.scenario.entities().object(entity)?;
        if may_drive_itself(self.scenario, object) {
            return None;
        }
        // An entity may be placed by itself and by a selection.
        if self.placed.iter().filter(|name| *name == entity).count() != 1 {
            return None;
        }
        let starts = self.origins.starts.iter().enumerate();
        let mut starts = starts.filter(|(_, start)| start.name == entity);
        let (Some((at, _)), None) = (starts.next(), starts.next()) else {
            return None;
        };
        let on = self.origins.on(&self.origins.place(at)?)?;
        on.lane?;
        let moves = |(name, place, earliest): &(String, Option<usize>, f64)| {
            let is_before = match (when, place) {
                (When::Start(_), place) => place.is_none(),
                (When::At(own, _), Some(place)) if own == *place => false,
                (When::At(_, latest), _) => *earliest <= latest,
            };
            name == entity && is_before
        };
        let (allowed, latest) = match when {
            When::Start(own) => (own, 0.0),
            When::At(_, latest) => (0, latest),
        };
        if self.movers.iter().filter(|mover| moves(mover)).count() > allowed {
            return None;
        }
        (!self.may_leave(object, on, latest)).then_some(on)
    }

    /// Checks whether an entity may leave its road until a time.
    fn may_leave(&self, entity: &Entity<'d>, on: OnRoad<'w, 'r>, latest: f64) -> bool {
        let is_linked = |end| on.road.link(end).is_some();
        let ends = (is_linked(ContactPoint::Start), is_linked(ContactPoint::End));
        let Some(length) = on.road.length().filter(|_| ends != (false, false)) else {
            return ends != (false, false);
        };
        let given = self.speeds.fastest(entity.name());
        let known = given.filter(|speed| speed.is_finite());
        let top = || {
            let performance = entity.object(self.scenario)?.child("Performance")?;
            performance.number("maxSpeed")
        };
        let Some(speed) = known.or_else(top) else {
            return true;
        };
        // No motion takes no way, even until the end of time.
        let way = if speed == 0.0 || latest == 0.0 {
            0.0
        } else {
            speed * latest
        };
        let forward = ends.1 && on.s + way > length;
        let backward = ends.0 && !on.along && on.s - way < 0.0;
        forward || backward
    }
}

/// Checks whether a private action, or the group of it, leaves an entity in its lane.
fn keeps_lane(name: &str) -> bool {
    matches!(
        name,
        "LongitudinalAction"
            | "SpeedAction"
            | "SpeedProfileAction"
            | "LongitudinalDistanceAction"
            | "SynchronizeAction"
            | "VisibilityAction"
            | "AppearanceAction"
            | "TeleportAction"
    )
}
