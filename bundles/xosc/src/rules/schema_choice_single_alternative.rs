use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    run,
    ..Rule::after(READABLE)
};

/// Types of elements that must have one of several children, and a list of these. The schemas up to
/// 1.2 allow them to be empty. From 1.3 on the schema requires a child.
const CHOICES: &[(&str, &str)] = &[
    ("Action", "a private, a global or a user-defined action"),
    ("AssignRouteAction", "a `Route` or a `CatalogReference`"),
    (
        "ByValueCondition",
        "a condition such as `SimulationTimeCondition`",
    ),
    ("CollisionCondition", "an `EntityRef` or a `ByType`"),
    ("Condition", "a `ByEntityCondition` or a `ByValueCondition`"),
    (
        "ControllerDistributionEntry",
        "a `Controller` or a `CatalogReference`",
    ),
    (
        "EntityAction",
        "an `AddEntityAction` or a `DeleteEntityAction`",
    ),
    ("EntityCondition", "a condition such as `SpeedCondition`"),
    (
        "EnvironmentAction",
        "an `Environment` or a `CatalogReference`",
    ),
    (
        "FinalSpeed",
        "an `AbsoluteSpeed` or a `RelativeSpeedToMaster`",
    ),
    (
        "GlobalAction",
        "an action such as `EnvironmentAction` or `EntityAction`",
    ),
    (
        "InRoutePosition",
        "a `FromCurrentEntity`, a `FromRoadCoordinates` or a `FromLaneCoordinates`",
    ),
    (
        "LaneChangeTarget",
        "a `RelativeTargetLane` or an `AbsoluteTargetLane`",
    ),
    (
        "LaneOffsetTarget",
        "a `RelativeTargetLaneOffset` or an `AbsoluteTargetLaneOffset`",
    ),
    (
        "LateralAction",
        "a `LaneChangeAction`, a `LaneOffsetAction` or a `LateralDistanceAction`",
    ),
    (
        "LongitudinalAction",
        "a `SpeedAction` or a `LongitudinalDistanceAction`, from 1.2 also a `SpeedProfileAction`",
    ),
    ("ModifyRule", "an `AddValue` or a `MultiplyByValue`"),
    ("ParameterAction", "a `SetAction` or a `ModifyAction`"),
    (
        "Position",
        "a position such as `LanePosition` or `WorldPosition`",
    ),
    (
        "PrivateAction",
        "an action such as `LongitudinalAction` or `TeleportAction`",
    ),
    ("RouteRef", "a `Route` or a `CatalogReference`"),
    (
        "RoutingAction",
        "an `AssignRouteAction`, a `FollowTrajectoryAction` or an `AcquirePositionAction`",
    ),
    ("Shape", "a `Polyline`, a `Clothoid` or a `Nurbs`"),
    (
        "SpeedActionTarget",
        "a `RelativeTargetSpeed` or an `AbsoluteTargetSpeed`",
    ),
    ("TimeReference", "a `None` or a `Timing`"),
    (
        "TimeToCollisionConditionTarget",
        "a `Position` or an `EntityRef`",
    ),
    ("TrafficAction", "an action such as `TrafficSwarmAction`"),
    (
        "TrafficSignalAction",
        "a `TrafficSignalControllerAction` or a `TrafficSignalStateAction`",
    ),
    ("VariableAction", "a `SetAction` or a `ModifyAction`"),
    ("VariableModifyRule", "an `AddValue` or a `MultiplyByValue`"),
];

/// Children of which exactly one is required, although the schema requires none.
struct OneOf {
    element: &'static str,
    alternatives: &'static [&'static str],
    level: Level,
    /// Versions with schemas that do not check this: from the first to before the second.
    versions: ((u16, u16), (u16, u16)),
    /// Whether the schema also allows several.
    several: bool,
}

const ONE_OF: &[OneOf] = &[
    OneOf {
        element: "ScenarioObject",
        alternatives: &[
            "CatalogReference",
            "Vehicle",
            "Pedestrian",
            "MiscObject",
            "ExternalObjectReference",
        ],
        level: Level::Error,
        versions: ((1, 0), (1, 3)),
        several: false,
    },
    OneOf {
        element: "FollowTrajectoryAction",
        alternatives: &["TrajectoryRef", "Trajectory", "CatalogReference"],
        level: Level::Error,
        versions: ((1, 0), (2, 0)),
        several: true,
    },
    OneOf {
        element: "TrafficSourceAction",
        alternatives: &["TrafficDistribution", "TrafficDefinition"],
        level: Level::Warning,
        versions: ((1, 3), (2, 0)),
        several: true,
    },
    OneOf {
        element: "TrafficSwarmAction",
        alternatives: &["TrafficDistribution", "TrafficDefinition"],
        level: Level::Warning,
        versions: ((1, 3), (2, 0)),
        several: true,
    },
];

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let version = scenario.version();
    if version < (1, 3) {
        for element in scenario.root().descendants() {
            if element.children().next().is_none() {
                empty(element, found);
            }
        }
    }
    for one_of in ONE_OF {
        if one_of.versions.0 <= version && version < one_of.versions.1 {
            for element in scenario.elements(one_of.element) {
                choose(element, one_of, found);
            }
        }
    }
}

fn empty(element: Element<'_, '_>, found: &mut Sink<'_>) {
    let Some(class) = element.class() else { return };
    let Some((_, allowed)) = CHOICES.iter().find(|(name, _)| *name == class) else {
        return;
    };
    let text = format!(
        "this `{}` is empty, but must have {allowed}",
        element.name()
    );
    found.about(element, "", text);
}

fn choose(element: Element<'_, '_>, one_of: &OneOf, found: &mut Sink<'_>) {
    let mut present = element
        .children()
        .filter(|child| one_of.alternatives.contains(&child.name()));
    let allowed: Vec<String> = one_of
        .alternatives
        .iter()
        .map(|name| format!("`{name}`"))
        .collect();
    let allowed = allowed.join(", ");
    match (present.next(), present.next()) {
        (None, _) => {
            let text = format!(
                "this `{}` must have one of {allowed}, but has none",
                element.name()
            );
            found.about(element, "", text).level(one_of.level);
        }
        (Some(first), Some(second)) if one_of.several => {
            let text = format!(
                "this `{}` has `{}` in addition to `{}`, but must have only one of {allowed}",
                element.name(),
                second.name(),
                first.name()
            );
            found
                .about(second, "", text)
                .level(one_of.level)
                .at(first.node(), "the first of them");
        }
        _ => {}
    }
}
