//! Deprecated parts of the standard, which later versions keep only for older files.

use crate::prelude::*;
use qcbus_openscenario::Version;

/// Deprecated part of an element.
#[derive(Clone, Copy)]
enum Subject {
    /// An attribute.
    Attribute(&'static str),
    /// A word as the value of an attribute.
    Word(&'static str, &'static str),
    /// The element itself, within an element of another type.
    Within(&'static str),
}

use Subject::{Attribute, Within, Word};

/// A deprecated part: the element, its type, the part, the version since which it is deprecated,
/// and the replacement.
struct Deprecated {
    element: &'static str,
    class: &'static str,
    part: Subject,
    since: Version,
    instead: &'static str,
}

/// Each line has the element, the part and the replacement. The type is given if it differs from
/// the element name.
macro_rules! deprecated {
    ($($since:literal: {$(
        $element:ident $(($class:ident))? $part:ident($($word:literal),*) $instead:literal;
    )*})*) => {
        const TABLE: &[Deprecated] = &[$($(Deprecated {
            element: stringify!($element),
            class: deprecated!(@class $element $($class)?),
            part: $part($($word),*),
            since: (1, $since),
            instead: $instead,
        },)*)*];
    };
    (@class $element:ident) => { stringify!($element) };
    (@class $element:ident $class:ident) => { stringify!($class) };
}

deprecated! {
    1: {
        ActivateControllerAction Within("PrivateAction") "an `ActivateControllerAction` within a `ControllerAction`";
        CatalogReference Within("FollowTrajectoryAction") "a `TrajectoryRef` around it";
        Clothoid Attribute("curvatureDot") "`curvaturePrime` (per metre, not per second)";
        DistanceCondition Attribute("alongRoute") "`coordinateSystem`";
        DistanceCondition Word("relativeDistanceType", "cartesianDistance") "`euclidianDistance`";
        MiscObject Word("miscObjectCategory", "wind") "`Wind` in the `Weather`";
        Pedestrian Attribute("model") "`model3d`";
        Precipitation Attribute("intensity") "`precipitationIntensity` (in mm/h)";
        RelativeDistanceCondition Word("relativeDistanceType", "cartesianDistance") "`euclidianDistance`";
        TimeHeadwayCondition Attribute("alongRoute") "`coordinateSystem`";
        TimeHeadwayCondition Word("relativeDistanceType", "cartesianDistance") "`euclidianDistance`";
        TimeToCollisionCondition Attribute("alongRoute") "`coordinateSystem`";
        TimeToCollisionCondition Word("relativeDistanceType", "cartesianDistance") "`euclidianDistance`";
        Trajectory Within("FollowTrajectoryAction") "a `TrajectoryRef` around it";
    }
    2: {
        Brake (OverrideBrakeAction) Attribute("value") "a child `BrakePercent` or `BrakeForce`";
        Event Word("priority", "overwrite") "`override`";
        Gear (OverrideGearAction) Attribute("number") "a child `ManualGear` or `AutomaticGear`";
        GeoPosition Attribute("height") "`altitude`";
        GeoPosition Attribute("latitude") "`latitudeDeg` (in degrees)";
        GeoPosition Attribute("longitude") "`longitudeDeg` (in degrees)";
        ParameterAction Within("GlobalAction") "a `VariableAction` and a `VariableDeclaration`";
        ParkingBrake (OverrideParkingBrakeAction) Attribute("value") "a child `BrakePercent` or `BrakeForce`";
        ReachPositionCondition Within("EntityCondition") "a `DistanceCondition`";
        Sun Attribute("intensity") "`illuminance`";
        TrafficSourceAction Attribute("velocity") "`speed`";
        TrafficSwarmAction Attribute("velocity") "a child `InitialSpeedRange`";
        Weather Attribute("cloudState") "`fractionalCloudCover`";
    }
    3: {
        ActivateControllerAction Attribute("controllerRef") "`objectControllerRef`";
        CatalogReference Within("AssignControllerAction") "an `ObjectController` around it";
        Controller Within("AssignControllerAction") "an `ObjectController` around it";
        TrafficDefinition Within("TrafficSinkAction") "nothing";
        TrafficDefinition Within("TrafficSourceAction") "a `TrafficDistribution`";
        TrafficDefinition Within("TrafficSwarmAction") "a `TrafficDistribution`";
    }
}

impl Deprecated {
    /// Checks whether this element is of the right type and has the deprecated part.
    fn is_in(&self, element: Element<'_, '_>) -> bool {
        let of_type = || element.class() == Some(self.class);
        match self.part {
            Attribute(name) => element.has(name) && of_type(),
            Word(name, word) => element.word(name).as_deref() == Some(word) && of_type(),
            Within(class) => element.parent().and_then(Element::class) == Some(class),
        }
    }

    fn place<'d>(&self, element: Element<'_, 'd>) -> Place<'d> {
        match self.part {
            Attribute(name) | Word(name, _) => Place::attribute_or_node(element.node(), name),
            Within(_) => Place::Node(element.node()),
        }
    }

    fn what(&self, element: Element<'_, '_>) -> String {
        let name = element.name();
        match self.part {
            Attribute(attribute) => format!("`{attribute}` of `{name}`"),
            Word(attribute, word) => format!("`{word}` as `{attribute}` of `{name}`"),
            Within(_) => {
                let around = element.parent().map_or("", Element::name);
                format!("`{name}` directly within `{around}`")
            }
        }
    }
}

/// Reports the deprecated parts that the document uses. Each kind is reported at its first use,
/// with the number of further uses.
pub(crate) fn report(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let version = scenario.version();
    for kind in TABLE.iter().filter(|kind| kind.since <= version) {
        let elements = scenario.elements(kind.element);
        let mut uses = elements.filter(|element| kind.is_in(*element));
        let Some(first) = uses.next() else {
            continue;
        };
        let text = format!(
            "{} is deprecated since version {}.{}; use {} instead{}",
            kind.what(first),
            kind.since.0,
            kind.since.1,
            kind.instead,
            match uses.count() {
                0 => String::new(),
                1 => " (one more use in this file)".to_owned(),
                more => format!(" ({more} more uses in this file)"),
            }
        );
        found.issue(kind.place(first), text);
    }
}
