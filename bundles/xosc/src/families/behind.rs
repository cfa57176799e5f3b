//! Places on a road that an entity has certainly passed.

use std::cell::RefCell;

use crate::families::actions::acting;
use crate::families::deletions::added;
use crate::families::init;
use crate::families::motion::{Speeds, may_drive_itself};
use crate::families::positions::{road_of, station};
use crate::families::relative::Reach;
use crate::prelude::*;
use foldhash::{HashSet, HashSetExt as _};
use qcbus_openscenario::places::Origins;

/// Entities with a known start on a road, and the ways that lead back.
pub(crate) struct Behind<'m, 'd, 'w, 'r> {
    scenario: &'m Scenario<'d>,
    map: &'w RoadMap<'r>,
    origins: Origins<'m, 'd, 'w, 'r>,
    speeds: &'w Speeds,
    /// Entities that may come back to a place without driving there.
    jumping: HashSet<String>,
    /// Entities that drive from the start, at an absolute speed.
    driving: HashSet<String>,
    reach: RefCell<Reach<'w, 'r>>,
}

impl<'m, 'd, 'w, 'r> Behind<'m, 'd, 'w, 'r> {
    /// Reads the scenario. Returns `None` if it is unknown which entities jump.
    pub(crate) fn of(
        scenario: &'m Scenario<'d>,
        map: &'w RoadMap<'r>,
        speeds: &'w Speeds,
    ) -> Option<Behind<'m, 'd, 'w, 'r>> {
        let mut jumping = HashSet::new();
        for name in ["TeleportAction", "FollowTrajectoryAction"] {
            let actions = scenario.elements_everywhere(name);
            for action in actions.filter(|it| it.ancestor("Init").is_none()) {
                jumping.extend(acting(action)?.iter().map(|one| one.name().to_owned()));
            }
        }
        jumping.extend(added(scenario)?);
        Some(Behind {
            scenario,
            map,
            origins: Origins::of(scenario, Some(map)),
            speeds,
            jumping,
            driving: init::speeds_at_start(scenario),
            reach: RefCell::new(Reach::of(map)?),
        })
    }

    /// Returns how far a position is behind an entity, in metres, at a time in seconds. Returns
    /// `None` if the entity may be before it, or may come back to it.
    pub(crate) fn by(&self, entity: &str, position: Element<'m, 'd>, time: f64) -> Option<f64> {
        /// Distance in metres that may be a matter of tolerances.
        const LEAST: f64 = 5.0;
        let object = self.scenario.entities().object(entity)?;
        if may_drive_itself(self.scenario, object) || self.jumping.contains(entity) {
            return None;
        }
        let starts = self.origins.starts.iter().enumerate();
        let mut starts = starts.filter(|(_, start)| start.name == entity);
        let (Some((at, _)), None) = (starts.next(), starts.next()) else {
            return None;
        };
        let on = self.origins.on(&self.origins.place(at)?)?;
        let road = road_of(position, self.map)?;
        if !on.along || road.index() != on.road.index() {
            return None;
        }
        let s = station(position, road)?;
        // An entity that stands passes nothing.
        self.speeds.fastest(entity).filter(|speed| *speed > 0.0)?;
        if self.speeds.reverses(entity) {
            return None;
        }
        let slowest = self
            .speeds
            .slowest(entity)
            .filter(|_| self.driving.contains(entity));
        let by = on.s + slowest.unwrap_or(0.0) * time - s;
        // Without an end, the way may lead back.
        self.reach.borrow_mut().from(on.road, on.s, true)?;
        (by > LEAST).then_some(by)
    }
}
