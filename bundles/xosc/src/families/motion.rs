//! Speeds that a scenario gives to its entities.

use crate::families::actions::acting;
use crate::prelude::*;
use foldhash::{HashMap, HashMapExt as _};

/// The lowest and highest speeds of entities, by the actions of the whole scenario.
pub(crate) struct Speeds {
    by_name: HashMap<String, (f64, f64)>,
}

impl Speeds {
    /// Reads the speeds. Returns `None` if an unknown action may move an entity.
    pub(crate) fn of(scenario: &Scenario<'_>) -> Option<Speeds> {
        // Trailers move with their vehicle. A simulator's own action may do anything.
        const OPEN: [&str; 3] = ["Trailer", "TrailerAction", "UserDefinedAction"];
        let mut open = OPEN
            .iter()
            .flat_map(|name| scenario.elements_everywhere(name));
        if open.next().is_some() || !scenario.storyboard().is_complete() {
            return None;
        }
        let mut by_name: HashMap<String, (f64, f64)> = HashMap::new();
        for action in scenario.elements_everywhere("PrivateAction") {
            let Some(speed) = speed_by(action) else {
                continue;
            };
            for entity in acting(action)? {
                let name = entity.name().to_owned();
                let (slowest, fastest) = by_name.entry(name).or_insert((speed, speed.abs()));
                *slowest = slowest.min(speed);
                *fastest = fastest.max(speed.abs());
            }
        }
        Some(Speeds { by_name })
    }

    /// Returns the highest speed in m/s that actions give to an entity. It is infinite if it is
    /// unknown, and `None` if no action gives it a speed.
    pub(crate) fn fastest(&self, entity: &str) -> Option<f64> {
        self.by_name.get(entity).map(|(_, fastest)| *fastest)
    }

    /// Checks whether an action lets an entity drive backwards.
    pub(crate) fn reverses(&self, entity: &str) -> bool {
        let speeds = self.by_name.get(entity);
        speeds.is_some_and(|(slowest, _)| *slowest < 0.0)
    }

    /// Returns the lowest speed in m/s that actions give to an entity, negative for driving
    /// backwards. Returns `None` if one of its speeds is unknown, or if no action gives it a speed.
    pub(crate) fn slowest(&self, entity: &str) -> Option<f64> {
        let (slowest, fastest) = self.by_name.get(entity)?;
        fastest.is_finite().then_some(*slowest)
    }
}

/// Returns the speed that an action gives. Returns infinity if only the run can tell, and `None` if
/// it gives none.
fn speed_by(private: Element<'_, '_>) -> Option<f64> {
    let kind = private.children().next()?;
    match kind.name() {
        "VisibilityAction" | "AppearanceAction" | "LateralAction" => None,
        // A jump to another place counts as motion.
        "TeleportAction" => private.ancestor("Init").is_none().then_some(f64::INFINITY),
        "LongitudinalAction" => {
            let target = kind.path(&["SpeedAction", "SpeedActionTarget", "AbsoluteTargetSpeed"]);
            let value = target.and_then(|target| target.number("value"));
            Some(value.unwrap_or(f64::INFINITY))
        }
        "RoutingAction" => {
            let is_untimed =
                |follow: Element<'_, '_>| follow.path(&["TimeReference", "None"]).is_some();
            let follow = kind.child("FollowTrajectoryAction");
            let keeps = follow.is_some_and(is_untimed) || kind.child("AssignRouteAction").is_some();
            (!keeps).then_some(f64::INFINITY)
        }
        _ => Some(f64::INFINITY),
    }
}

/// Checks whether something outside of the storyboard may drive an entity: a controller, or a
/// simulator that knows it.
pub(crate) fn may_drive_itself<'d>(scenario: &Scenario<'d>, entity: &Entity<'d>) -> bool {
    let is_known = matches!(
        entity.kind(),
        EntityKind::Vehicle | EntityKind::Pedestrian | EntityKind::MiscObject
    );
    let element = entity.element(scenario);
    let mut controllers = element.children_named("ObjectController");
    !is_known
        || controllers.any(|controller| controller.children().next().is_some())
        || is_controlled(scenario, entity)
}

/// Checks whether an action gives an entity a controller.
fn is_controlled<'d>(scenario: &Scenario<'d>, entity: &Entity<'d>) -> bool {
    const ACTIONS: [&str; 3] = [
        "ControllerAction",
        "AssignControllerAction",
        "ActivateControllerAction",
    ];
    let actions = ACTIONS
        .iter()
        .flat_map(|name| scenario.elements_everywhere(name));
    let mut acting = actions.map(acting);
    acting.any(|all| all.is_none_or(|all| all.iter().any(|one| one.name() == entity.name())))
}
