use crate::families::{self, finite::Numbers};
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    run,
    ..Rule::after(READABLE)
};

/// Numbers that are not part of a position and have no range of their own.
const NUMBERS: &Numbers = &[
    ("AbsoluteTargetLaneOffset", &["value"]),
    ("AbsoluteTargetSpeed", &["value"]),
    ("RelativeTargetLaneOffset", &["value"]),
    ("RelativeTargetSpeed", &["value"]),
    ("RelativeSpeedToMaster", &["value"]),
    ("SpeedProfileEntry", &["speed"]),
    ("LaneChangeAction", &["targetLaneOffset"]),
    ("FollowTrajectoryAction", &["initialDistanceOffset"]),
    ("Center", &["x", "y", "z"]),
    ("TrailerCoupler", &["dx", "dz"]),
    ("TrailerHitch", &["dx", "dz"]),
    ("Clothoid", &["curvature", "curvatureDot", "curvaturePrime"]),
    ("ClothoidSpline", &["timeEnd"]),
    ("ClothoidSplineSegment", &["curvatureStart", "curvatureEnd"]),
    ("ControlPoint", &["weight"]),
    ("Knot", &["value"]),
    ("AccelerationCondition", &["value"]),
    ("RelativeSpeedCondition", &["value"]),
    ("SpeedCondition", &["value"]),
    ("SimulationTimeCondition", &["value"]),
];

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let why = "it must be a finite number, because no simulator can reach it or compare with it";
    families::finite::report(scenario, NUMBERS, why, found);
}
