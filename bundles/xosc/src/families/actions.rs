//! Entities that an action moves, and their speeds and domains.

use crate::prelude::*;

pub(crate) use qcbus_openscenario::wording::{short, stated};

/// Returns the scenario objects that an action moves, including members of selections. Returns
/// `None` if not all of them are known.
pub(crate) fn acting<'m, 'd>(action: Element<'m, 'd>) -> Option<Vec<&'m Entity<'d>>> {
    let names = Actors::of(action)?.names()?;
    let entities = action.scenario().entities();
    let mut acting: Vec<&Entity<'d>> = Vec::new();
    for name in names {
        for entity in entities.expand(&name)? {
            if !acting.iter().any(|other| std::ptr::eq(*other, entity)) {
                acting.push(entity);
            }
        }
    }
    Some(acting)
}

/// Returns the name and `maxSpeed` of the slowest vehicle that an action moves. Entities without a
/// known `maxSpeed` set no limit.
pub(crate) fn slowest<'m>(action: Element<'m, '_>) -> Option<(&'m str, f64)> {
    let scenario = action.scenario();
    let limits = acting(action)?.into_iter().filter_map(|entity| {
        let performance = entity.object(scenario)?.child("Performance")?;
        let most = performance.number("maxSpeed").filter(|most| *most >= 0.0)?;
        Some((entity.name(), most))
    });
    limits.min_by(|(_, one), (_, other)| one.total_cmp(other))
}

/// Part of an entity's motion that an action controls.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum Domain {
    /// Speed along its path.
    Longitudinal,
    /// Position across its path.
    Lateral,
}

impl Domain {
    /// Returns the domain as an adjective.
    pub(crate) fn word(self) -> &'static str {
        match self {
            Domain::Longitudinal => "longitudinal",
            Domain::Lateral => "lateral",
        }
    }
}

/// Returns the domains that a `PrivateAction` controls. A trajectory with times also sets the
/// speed.
pub(crate) fn domains(private: Element<'_, '_>) -> Vec<Domain> {
    let mut domains = Vec::new();
    for kind in private.children() {
        match kind.name() {
            "LongitudinalAction" | "SynchronizeAction" => domains.push(Domain::Longitudinal),
            "LateralAction" => domains.push(Domain::Lateral),
            "RoutingAction" => {
                let Some(follow) = kind.child("FollowTrajectoryAction") else {
                    continue;
                };
                domains.push(Domain::Lateral);
                if follow.path(&["TimeReference", "Timing"]).is_some() {
                    domains.push(Domain::Longitudinal);
                }
            }
            _ => {}
        }
    }
    domains
}

/// Elements of type `TransitionDynamics`.
pub(crate) const TRANSITIONS: &[&str] = &["SpeedActionDynamics", "LaneChangeActionDynamics"];
