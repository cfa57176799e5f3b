//! Whom an action moves, and how.

use qcbus_openscenario::{Actors, Element, Entity};

/// The scenario objects that an action moves, those of selections among them; `None` when it is not
/// known who all of them are.
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

/// The slowest of the vehicles that an action moves: its name and its `maxSpeed`. Entities without a
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

/// What of an entity's motion an action takes over.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum Domain {
    /// How fast it moves along its way.
    Longitudinal,
    /// Where it moves across its way.
    Lateral,
}

impl Domain {
    /// The domain as an adjective.
    pub(crate) fn word(self) -> &'static str {
        match self {
            Domain::Longitudinal => "longitudinal",
            Domain::Lateral => "lateral",
        }
    }
}

/// The domains that a `PrivateAction` takes over; a trajectory with times sets the speed, too.
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

/// A number as a person would write it: at most three decimals.
pub(crate) fn short(value: f64) -> String {
    let rounded = (value * 1000.0).round() / 1000.0;
    format!("{}", if rounded == 0.0 { 0.0 } else { rounded })
}

/// Elements of type `TransitionDynamics`.
pub(crate) const TRANSITIONS: &[&str] = &["SpeedActionDynamics", "LaneChangeActionDynamics"];

/// A number as it is written; what a parameter or an expression led to, and those.
pub(crate) fn stated(element: Element<'_, '_>, attribute: &str, value: f64) -> String {
    match element.written(attribute) {
        Some(written) if written.contains('$') => format!("`{}` (`{written}`)", short(value)),
        Some(written) => format!("`{}`", written.trim()),
        None => format!("`{}`", short(value)),
    }
}
