//! Trajectories: the entities that follow them, and their times and places.

use crate::families::positions::Spot;
use crate::prelude::*;

/// Whether the follower of a trajectory uses its times.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Timing<'m, 'd> {
    /// Yes. This element requests it.
    Asked(Element<'m, 'd>),
    /// No. The times have no effect.
    Ignored,
    /// No follower exists here: it is a catalog entry that is checked by itself.
    Unknown,
}

/// Checks whether the times of a trajectory are used.
pub(crate) fn timing_of<'m, 'd>(trajectory: Element<'m, 'd>) -> Timing<'m, 'd> {
    match follower(trajectory) {
        Some(action) => {
            let reference = action.child("TimeReference");
            match reference.map(|reference| (reference.child("Timing"), reference.child("None"))) {
                Some((Some(timing), _)) => Timing::Asked(timing),
                Some((None, Some(_))) => Timing::Ignored,
                _ => Timing::Unknown,
            }
        }
        None if trajectory.ancestor("TrajectoryPosition").is_some() => Timing::Ignored,
        None => Timing::Unknown,
    }
}

/// Returns the action that follows a trajectory.
pub(crate) fn follower<'m, 'd>(trajectory: Element<'m, 'd>) -> Option<Element<'m, 'd>> {
    let around = trajectory.parent()?;
    let around = if around.is("TrajectoryRef") {
        around.parent()?
    } else {
        around
    };
    around.is("FollowTrajectoryAction").then_some(around)
}

/// Returns the trajectory that an action follows, wherever it is written.
pub(crate) fn followed<'m, 'd>(action: Element<'m, 'd>) -> Option<Element<'m, 'd>> {
    let within = action.child("TrajectoryRef");
    let found = within.and_then(|reference| reference.child_or_entry(&["Trajectory"]));
    found.or_else(|| action.child_or_entry(&["Trajectory"]))
}

/// Returns the shape of a trajectory.
pub(crate) fn shape<'m, 'd>(trajectory: Element<'m, 'd>) -> Option<Element<'m, 'd>> {
    let mut shapes = trajectory.child("Shape")?.children();
    shapes.find(|shape| ["Polyline", "Clothoid", "ClothoidSpline", "Nurbs"].contains(&shape.name()))
}

/// A point of a shape that may have a time.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TimedPoint<'m, 'd> {
    pub(crate) element: Element<'m, 'd>,
    pub(crate) attribute: &'static str,
}

impl<'m, 'd> TimedPoint<'m, 'd> {
    pub(crate) fn time(self) -> Option<f64> {
        self.element.number(self.attribute)
    }

    /// Returns the place of the moving object at this time, if a position gives it.
    pub(crate) fn spot(self) -> Option<Spot<'d>> {
        Spot::of(self.element.child("Position")?)
    }
}

/// Returns the points of a shape that may have a time, in the order of travel.
pub(crate) fn timed_points<'m, 'd>(shape: Element<'m, 'd>) -> Vec<TimedPoint<'m, 'd>> {
    let of = |element, attribute| TimedPoint { element, attribute };
    match shape.name() {
        "Polyline" => shape
            .children_named("Vertex")
            .map(|vertex| of(vertex, "time"))
            .collect(),
        "Nurbs" => shape
            .children_named("ControlPoint")
            .map(|point| of(point, "time"))
            .collect(),
        "Clothoid" => vec![of(shape, "startTime"), of(shape, "stopTime")],
        "ClothoidSpline" => shape
            .children_named("ClothoidSplineSegment")
            .map(|segment| of(segment, "timeStart"))
            .chain([of(shape, "timeEnd")])
            .collect(),
        _ => Vec::new(),
    }
}

/// Formats the name of a trajectory for a message.
pub(crate) fn named(trajectory: Element<'_, '_>) -> String {
    match trajectory.text("name") {
        Some(name) => format!("trajectory `{name}`"),
        None => "trajectory".to_owned(),
    }
}

/// Returns the maximum length of a shape.
pub(crate) fn longest(trajectory: Element<'_, '_>) -> Option<f64> {
    let shape = shape(trajectory)?;
    match shape.name() {
        "Clothoid" => shape.number("length"),
        "ClothoidSpline" => {
            let segments = shape.children_named("ClothoidSplineSegment");
            segments.map(|segment| segment.number("length")).sum()
        }
        // The chords are the length of a polyline unless its corners are rounded (1.4). A curve of
        // control points is never longer than the line through them.
        "Polyline" | "Nurbs" if shape.child("Interpolation").is_none() => {
            chords(shape, trajectory.flag("closed")?)
        }
        _ => None,
    }
}

fn chords(shape: Element<'_, '_>, closed: bool) -> Option<f64> {
    let spots: Option<Vec<Spot<'_>>> = timed_points(shape)
        .into_iter()
        .map(TimedPoint::spot)
        .collect();
    let spots = spots?;
    let (first, last) = (spots.first()?, spots.last()?);
    let along: Option<f64> = spots
        .windows(2)
        .map(|pair| pair.first()?.distance(pair.last()?))
        .sum();
    let back = if closed { last.distance(first)? } else { 0.0 };
    Some(along? + back)
}
