//! Tables of ranges: one table per rule.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use qcbus_openscenario::Element;
use qcbus_sdk::Level;

use super::{
    Row, a_turn_is_harmless, above_zero, at_least, at_most, between, finite, from_zero, warning,
    zero_is_harmless,
};

/// Builds a table. Each line has the kind of range, the type, the attribute, its unit and its UID.
macro_rules! table {
    ($name:ident: $(
        $make:ident $(($($end:expr),*))? $class:ident $attribute:ident $unit:literal $uid:literal
        $(.$more:ident($($with:expr),*))*;
    )*) => {
        pub(crate) const $name: &[Row] = &[$(
            $make(
                $($($end,)*)?
                stringify!($class),
                stringify!($attribute),
                $unit,
                concat!("qcbus.dev:xosc:1.0.0:range.", $uid),
            )$(.$more($($with),*))*,
        )*];
    };
}

const BEHIND: &str = "zero is the position of the rear axle";
const A_RATE: &str = "a rate is a magnitude; the target defines the direction";
const A_TURN: &str = "a full turn does not change the direction";
const ANY_ANGLE: &str = "such a tolerance accepts any angle";
const NO_SIDE: &str = "version 1.0 has no `displacement` that defines the side";
const ZERO: &str = "with zero it has no effect";

table! {
    ACTIONS:
        from_zero AbsoluteSpeed value "m/s" "absolutespeed_value";
        from_zero DynamicConstraints maxAcceleration "m/s²" "dynamicconstraints_maxacceleration";
        from_zero DynamicConstraints maxAccelerationRate "m/s³" "dynamicconstraints_maxaccelerationrate";
        from_zero DynamicConstraints maxDeceleration "m/s²" "dynamicconstraints_maxdeceleration";
        from_zero DynamicConstraints maxDecelerationRate "m/s³" "dynamicconstraints_maxdecelerationrate";
        from_zero DynamicConstraints maxSpeed "m/s" "dynamicconstraints_maxspeed";
        from_zero LaneOffsetActionDynamics maxLateralAcc "m/s²" "laneoffsetactiondynamics_maxlateralacc";
        from_zero LongitudinalDistanceAction timeGap "s" "longitudinaldistanceaction_timegap"
            .judged(a_side_may_have_a_sign, NO_SIDE);
        from_zero SpeedProfileEntry time "s" "speedprofileentry_time";
        from_zero SynchronizeAction targetTolerance "m" "synchronizeaction_targettolerance";
        from_zero SynchronizeAction targetToleranceMaster "m" "synchronizeaction_targettolerancemaster";
        above_zero TargetDistanceSteadyState distance "m" "targetdistancesteadystate_distance"
            .judged(zero_is_harmless, ZERO);
        above_zero TargetTimeSteadyState time "s" "targettimesteadystate_time" .judged(zero_is_harmless, ZERO);
        from_zero TransitionDynamics value "" "transitiondynamics_value"
            .called(&["LaneChangeActionDynamics", "SpeedActionDynamics"]).judged(a_rate_may_have_a_sign, A_RATE);
}

/// Returns a warning for rates. Existing files write the rate of braking with a minus, and
/// simulators use its magnitude.
fn a_rate_may_have_a_sign(element: Element<'_, '_>, _: f64) -> Level {
    match element.word("dynamicsDimension").as_deref() {
        Some("time" | "distance") => Level::Error,
        _ => Level::Warning,
    }
}

table! {
    APPEARANCE:
        from_zero AnimationAction animationDuration "s" "animationaction_animationduration";
        from_zero AnimationFile timeOffset "s" "animationfile_timeoffset";
        between(0.0, 1.0) AnimationState state "" "animationstate_state";
        between(0.0, 1.0) ColorCmyk cyan "" "colorcmyk_cyan";
        between(0.0, 1.0) ColorCmyk key "" "colorcmyk_key";
        between(0.0, 1.0) ColorCmyk magenta "" "colorcmyk_magenta";
        between(0.0, 1.0) ColorCmyk yellow "" "colorcmyk_yellow";
        between(0.0, 1.0) ColorRgb blue "" "colorrgb_blue";
        between(0.0, 1.0) ColorRgb green "" "colorrgb_green";
        between(0.0, 1.0) ColorRgb red "" "colorrgb_red";
        from_zero LightState flashingOffDuration "s" "lightstate_flashingoffduration";
        from_zero LightState flashingOnDuration "s" "lightstate_flashingonduration";
        from_zero LightState luminousIntensity "cd" "lightstate_luminousintensity";
}

table! {
    CONDITIONS:
        between(-PI, PI) AngleCondition angle "rad" "anglecondition_angle" .judged(a_turn_is_harmless, A_TURN);
        between(0.0, PI) AngleCondition angleTolerance "rad" "anglecondition_angletolerance"
            .judged(a_wide_tolerance_is_harmless, ANY_ANGLE);
        from_zero EndOfRoadCondition duration "s" "endofroadcondition_duration";
        from_zero OffroadCondition duration "s" "offroadcondition_duration";
        between(-PI, PI) RelativeAngleCondition angle "rad" "relativeanglecondition_angle"
            .judged(a_turn_is_harmless, A_TURN);
        between(0.0, PI) RelativeAngleCondition angleTolerance "rad" "relativeanglecondition_angletolerance"
            .judged(a_wide_tolerance_is_harmless, ANY_ANGLE);
        from_zero StandStillCondition duration "s" "standstillcondition_duration";
        from_zero TimeHeadwayCondition value "s" "timeheadwaycondition_value";
        from_zero TimeToCollisionCondition value "s" "timetocollisioncondition_value";
}

/// Returns a warning for positive values. A tolerance beyond half a turn accepts any angle. One
/// below zero accepts none.
fn a_wide_tolerance_is_harmless(_: Element<'_, '_>, value: f64) -> Level {
    if value > 0.0 {
        Level::Warning
    } else {
        Level::Error
    }
}

table! {
    CONDITION_DELAY:
        from_zero Condition delay "s" "condition_delay";
}

table! {
    DISTANCES:
        from_zero DistanceCondition value "m" "distancecondition_value";
        from_zero LateralDistanceAction distance "m" "lateraldistanceaction_distance"
            .judged(a_side_may_have_a_sign, NO_SIDE);
        from_zero LongitudinalDistanceAction distance "m" "longitudinaldistanceaction_distance"
            .judged(a_side_may_have_a_sign, NO_SIDE);
        from_zero ReachPositionCondition tolerance "m" "reachpositioncondition_tolerance";
        from_zero RelativeClearanceCondition distanceBackward "m" "relativeclearancecondition_distancebackward";
        from_zero RelativeClearanceCondition distanceForward "m" "relativeclearancecondition_distanceforward";
        from_zero RelativeDistanceCondition value "m" "relativedistancecondition_value";
        from_zero TrafficSinkAction radius "m" "trafficsinkaction_radius";
        from_zero TrafficSourceAction radius "m" "trafficsourceaction_radius";
        from_zero TrafficSwarmAction innerRadius "m" "trafficswarmaction_innerradius";
        from_zero TrafficSwarmAction semiMajorAxis "m" "trafficswarmaction_semimajoraxis";
        from_zero TrafficSwarmAction semiMinorAxis "m" "trafficswarmaction_semiminoraxis";
        from_zero TraveledDistanceCondition value "m" "traveleddistancecondition_value";
}

/// Returns a warning before 1.1. The attribute `displacement` exists since 1.1. Before that, only a
/// sign could state the side.
fn a_side_may_have_a_sign(element: Element<'_, '_>, _: f64) -> Level {
    if element.scenario().version() < (1, 1) {
        Level::Warning
    } else {
        Level::Error
    }
}

table! {
    ENTITIES:
        // Many existing files write degrees, and most simulators do not read this attribute.
        between(0.0, PI) Axle maxSteering "rad" "axle_maxsteering" .called(AXLES).judged(warning, "");
        // A reference point before the rear axle is unusual, but well defined.
        from_zero Axle positionX "m" "axle_positionx" .called(AXLES).judged(an_axle_may_be_behind, BEHIND);
        from_zero Axle positionZ "m" "axle_positionz" .called(AXLES).judged(warning, "");
        from_zero Axle trackWidth "m" "axle_trackwidth" .called(AXLES);
        above_zero Axle wheelDiameter "m" "axle_wheeldiameter" .called(AXLES).judged(zero_is_harmless, ZERO);
        from_zero Dimensions height "m" "dimensions_height";
        from_zero Dimensions length "m" "dimensions_length";
        from_zero Dimensions width "m" "dimensions_width";
        from_zero MiscObject mass "kg" "miscobject_mass";
        from_zero Pedestrian mass "kg" "pedestrian_mass";
        from_zero Performance maxAcceleration "m/s²" "performance_maxacceleration";
        from_zero Performance maxAccelerationRate "m/s³" "performance_maxaccelerationrate";
        from_zero Performance maxDeceleration "m/s²" "performance_maxdeceleration";
        from_zero Performance maxDecelerationRate "m/s³" "performance_maxdecelerationrate";
        from_zero Performance maxSpeed "m/s" "performance_maxspeed";
        from_zero Vehicle mass "kg" "vehicle_mass";
}

/// Returns an information for additional axles. The rear axle is at zero, and additional axles are
/// often behind it.
fn an_axle_may_be_behind(element: Element<'_, '_>, _: f64) -> Level {
    if element.is("AdditionalAxle") {
        Level::Information
    } else {
        Level::Warning
    }
}

const AXLES: &[&str] = &["FrontAxle", "RearAxle", "AdditionalAxle"];

table! {
    ENVIRONMENT:
        between(0.0, TAU) DomeImage azimuthOffset "rad" "domeimage_azimuthoffset"
            .judged(a_turn_is_harmless, A_TURN);
        from_zero Fog visualRange "m" "fog_visualrange";
        between(0.0, 1.0) Precipitation intensity "" "precipitation_intensity";
        from_zero Precipitation precipitationIntensity "mm/h" "precipitation_precipitationintensity";
        from_zero RoadCondition frictionScaleFactor "" "roadcondition_frictionscalefactor";
        between(0.0, TAU) Sun azimuth "rad" "sun_azimuth" .judged(a_turn_is_harmless, A_TURN);
        between(-PI, PI) Sun elevation "rad" "sun_elevation" .judged(a_turn_is_harmless, A_TURN);
        from_zero Sun illuminance "lx" "sun_illuminance";
        from_zero Sun intensity "lx" "sun_intensity";
        // Only models of the air read these two values. The ranges state plausible values.
        between(80_000.0, 120_000.0) Weather atmosphericPressure "Pa" "weather_atmosphericpressure"
            .judged(warning, "");
        between(170.0, 340.0) Weather temperature "K" "weather_temperature" .judged(warning, "");
        between(0.0, TAU) Wind direction "rad" "wind_direction" .half_open().judged(a_turn_is_harmless, A_TURN);
        from_zero Wind speed "m/s" "wind_speed";
}

// The standard confuses the ranges of latitude and longitude in radians, and has no places below
// sea level.
table! {
    GEO:
        between(-FRAC_PI_2, FRAC_PI_2) GeoPosition latitude "rad" "geoposition_latitude" .if_finite();
        between(-90.0, 90.0) GeoPosition latitudeDeg "°" "geoposition_latitudedeg" .if_finite();
        between(-PI, PI) GeoPosition longitude "rad" "geoposition_longitude" .judged(a_turn_is_harmless, A_TURN).if_finite();
        between(-180.0, 180.0) GeoPosition longitudeDeg "°" "geoposition_longitudedeg"
            .judged(a_turn_in_degrees_is_harmless, A_TURN).if_finite();
}

/// Returns a warning up to a full turn, because 190° east is 170° west.
fn a_turn_in_degrees_is_harmless(_: Element<'_, '_>, value: f64) -> Level {
    if value.abs() <= 360.0 {
        Level::Warning
    } else {
        Level::Error
    }
}

table! {
    EXECUTIONS:
        at_least(1.0) Event maximumExecutionCount "" "event_maximumexecutioncount" .count();
        at_least(1.0) ManeuverGroup maximumExecutionCount "" "maneuvergroup_maximumexecutioncount" .count();
}

table! {
    OVERRIDES:
        // The unit is per cent or newton. Neither has a sign.
        from_zero Brake value "" "brake_value" .called(BRAKES);
        above_zero Brake maxRate "" "brake_maxrate" .called(BRAKES);
        between(0.0, 1.0) OverrideBrakeAction value "" "overridebrakeaction_value" .called(&["Brake"]);
        // Tests of simulators that do not read this value write any number.
        between(0.0, 1.0) OverrideClutchAction value "" "overrideclutchaction_value"
            .called(&["Clutch"]).judged(warning, "");
        above_zero OverrideClutchAction maxRate "%/s" "overrideclutchaction_maxrate" .called(&["Clutch"]);
        between(0.0, 1.0) OverrideParkingBrakeAction value "" "overrideparkingbrakeaction_value"
            .called(&["ParkingBrake"]);
        above_zero OverrideSteeringWheelAction maxRate "%/s" "overridesteeringwheelaction_maxrate"
            .called(&["SteeringWheel"]);
        above_zero OverrideSteeringWheelAction maxTorque "Nm" "overridesteeringwheelaction_maxtorque"
            .called(&["SteeringWheel"]);
        between(0.0, 1.0) OverrideThrottleAction value "" "overridethrottleaction_value" .called(&["Throttle"]);
        above_zero OverrideThrottleAction maxRate "%/s" "overridethrottleaction_maxrate" .called(&["Throttle"]);
}

const BRAKES: &[&str] = &["BrakePercent", "BrakeForce"];

table! {
    PHASES:
        from_zero Phase duration "s" "phase_duration";
}

table! {
    POSITIONS:
        at_most(0.0) GeoPosition verticalRoadSelection "" "geoposition_verticalroadselection" .judged(warning, "");
        from_zero PositionInLaneCoordinates pathS "m" "positioninlanecoordinates_paths"
            .called(&["FromLaneCoordinates"]).if_finite();
        from_zero PositionInRoadCoordinates pathS "m" "positioninroadcoordinates_paths"
            .called(&["FromRoadCoordinates"]).if_finite();
}

table! {
    TIMING:
        above_zero Timing scale "" "timing_scale";
        finite Timing offset "s" "timing_offset";
}

table! {
    TRAFFIC:
        above_zero ControllerDistributionEntry weight "" "controllerdistributionentry_weight"
            .judged(zero_is_harmless, ZERO);
        from_zero DirectionOfTravelDistribution opposite "" "directionoftraveldistribution_opposite";
        from_zero DirectionOfTravelDistribution same "" "directionoftraveldistribution_same";
        above_zero EntityDistributionEntry weight "" "entitydistributionentry_weight"
            .judged(zero_is_harmless, ZERO);
        from_zero Range lowerLimit "m/s" "initialspeedrange_lowerlimit" .called(&["InitialSpeedRange"]);
        from_zero Range upperLimit "m/s" "initialspeedrange_upperlimit" .called(&["InitialSpeedRange"]);
        above_zero TrafficDistributionEntry weight "" "trafficdistributionentry_weight"
            .judged(zero_is_harmless, ZERO);
        from_zero TrafficSignalController delay "s" "trafficsignalcontroller_delay";
        from_zero TrafficSinkAction rate "vehicles/s" "trafficsinkaction_rate";
        from_zero TrafficSourceAction rate "vehicles/s" "trafficsourceaction_rate";
        from_zero TrafficSourceAction speed "m/s" "trafficsourceaction_speed";
        from_zero TrafficSourceAction velocity "m/s" "trafficsourceaction_velocity";
        from_zero TrafficSwarmAction velocity "m/s" "trafficswarmaction_velocity";
        from_zero VehicleCategoryDistributionEntry weight "" "vehiclecategorydistributionentry_weight";
        from_zero VehicleRoleDistributionEntry weight "" "vehicleroledistributionentry_weight";
}

table! {
    TRAJECTORIES:
        above_zero Clothoid length "m" "clothoid_length";
        from_zero Clothoid startTime "s" "clothoid_starttime";
        above_zero Clothoid stopTime "s" "clothoid_stoptime";
        between(-PI, PI) ClothoidSplineSegment hOffset "rad" "clothoidsplinesegment_hoffset"
            .open().judged(a_turn_is_harmless, A_TURN);
        above_zero ClothoidSplineSegment length "m" "clothoidsplinesegment_length";
        from_zero ClothoidSplineSegment timeStart "s" "clothoidsplinesegment_timestart";
        from_zero ControlPoint time "s" "controlpoint_time";
        at_least(2.0) Nurbs order "" "nurbs_order" .count();
}

table! {
    TRANSITIONS:
        from_zero LightStateAction transitionTime "s" "lightstateaction_transitiontime";
}

/// All tables.
pub(crate) const ALL: &[&[Row]] = &[
    ACTIONS,
    APPEARANCE,
    CONDITIONS,
    CONDITION_DELAY,
    DISTANCES,
    ENTITIES,
    ENVIRONMENT,
    GEO,
    EXECUTIONS,
    OVERRIDES,
    PHASES,
    POSITIONS,
    TIMING,
    TRAFFIC,
    TRAJECTORIES,
    TRANSITIONS,
];
