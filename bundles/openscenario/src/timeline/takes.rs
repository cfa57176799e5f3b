//! How long actions take: annex A of ASAM OpenSCENARIO XML, "Action tables".

use super::plan::Takes;
use crate::queries::element::Element;

/// Returns how long an `Action` takes.
pub(super) fn takes(action: Element<'_, '_>) -> Takes {
    if let Some(global) = action.child("GlobalAction") {
        return match global.child("TrafficAction") {
            Some(_) => Takes::Unknown,
            None => Takes::NoTime,
        };
    }
    let private = action.child("PrivateAction");
    let Some(kind) = private.and_then(|it| it.children().next()) else {
        return Takes::Unknown;
    };
    match kind.name() {
        "VisibilityAction"
        | "TeleportAction"
        | "ControllerAction"
        | "ActivateControllerAction"
        | "TrailerAction" => Takes::NoTime,
        "LongitudinalAction" => longitudinal(kind),
        "LateralAction" => lateral(kind),
        "RoutingAction" if kind.child("AssignRouteAction").is_some() => Takes::NoTime,
        _ => Takes::Unknown,
    }
}

fn longitudinal(kind: Element<'_, '_>) -> Takes {
    if let Some(distance) = kind.child("LongitudinalDistanceAction") {
        return unless_continuous(distance, Takes::Forever);
    }
    let Some(speed) = kind.child("SpeedAction") else {
        return Takes::Unknown;
    };
    let relative = speed.path(&["SpeedActionTarget", "RelativeTargetSpeed"]);
    match relative.map(|relative| relative.flag("continuous")) {
        Some(Some(true)) => Takes::Forever,
        // The other entity may change its speed meanwhile.
        Some(_) => Takes::Unknown,
        None => transition(speed.child("SpeedActionDynamics")),
    }
}

fn lateral(kind: Element<'_, '_>) -> Takes {
    if let Some(offset) = kind.child("LaneOffsetAction") {
        return unless_continuous(offset, Takes::ForeverInTheory);
    }
    if let Some(distance) = kind.child("LateralDistanceAction") {
        return unless_continuous(distance, Takes::Forever);
    }
    let change = kind.child("LaneChangeAction");
    transition(change.and_then(|change| change.child("LaneChangeActionDynamics")))
}

fn unless_continuous(action: Element<'_, '_>, forever: Takes) -> Takes {
    match action.flag("continuous") {
        Some(true) => forever,
        _ => Takes::Unknown,
    }
}

/// Returns how long a transition takes. Limits of the entity may make it longer.
fn transition(dynamics: Option<Element<'_, '_>>) -> Takes {
    let Some(dynamics) = dynamics else {
        return Takes::Unknown;
    };
    let shape = dynamics.word("dynamicsShape");
    let dimension = dynamics.word("dynamicsDimension");
    match (shape.as_deref(), dimension.as_deref()) {
        (Some("step"), _) => Takes::NoTime,
        (Some(_), Some("time")) => match dynamics.number("value") {
            Some(seconds) if seconds >= 0.0 => Takes::Seconds(seconds),
            _ => Takes::Unknown,
        },
        _ => Takes::Unknown,
    }
}
