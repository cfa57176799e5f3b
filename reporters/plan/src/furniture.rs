//! Signals and objects on the plan.

use std::f64::consts::{PI, TAU};

use qcbus_opendrive::geometry::{Placed, Point, Pose, wrap_angle};
use qcbus_opendrive::{Corner, CornerKind, CurveLocal, Object, Outline, Road, Signal};

use crate::origin::Shift;

/// Number of corners with which a round object is drawn.
const CORNERS: u32 = 8;

/// Number of lines with which a curve of an outline is drawn.
const CURVE_STEPS: u32 = 8;

/// A signal and its place.
pub(crate) struct SignalPlan<'a> {
    pub(crate) signal: Signal<'a>,
    /// Index of its road in the list of roads.
    pub(crate) road: usize,
    /// Place of the signal; `None` if it is not finite.
    pub(crate) at: Option<[i64; 2]>,
    /// Heading in radians, from -π to π.
    pub(crate) hdg: f64,
}

/// An object and its outline.
pub(crate) struct ObjectPlan<'a> {
    pub(crate) object: Object<'a>,
    /// Index of its road in the list of roads.
    pub(crate) road: usize,
    /// Points of the outline. One point is the place alone; empty if no finite place exists.
    pub(crate) outline: Vec<[i64; 2]>,
}

/// Returns the part of a signal in the plan. It faces along the road, or against it if its
/// orientation is `-` (14.1).
pub(crate) fn signal<'a>(road: &Road<'a>, signal: Signal<'a>, origin: Shift) -> SignalPlan<'a> {
    let pose = signal_pose(road, signal);
    let spot = pose.and_then(|pose| origin.spot(pose.point()));
    let against = if signal.orientation() == Some("-") {
        PI
    } else {
        0.0
    };
    let turned = pose.map(|pose| pose.hdg + against + signal.h_offset().unwrap_or(0.0));
    SignalPlan {
        signal,
        road: road.index(),
        at: spot.map(|spot| spot.rounded()),
        hdg: turned.and_then(wrap_angle).unwrap_or(0.0),
    }
}

/// Returns the position of a signal with the heading of the road.
pub(crate) fn signal_pose(road: &Road<'_>, signal: Signal<'_>) -> Option<Pose> {
    pose(road, signal.s()?, signal.t()?)
}

/// Returns the position of an object with the heading of the road.
pub(crate) fn object_pose(road: &Road<'_>, object: Object<'_>) -> Option<Pose> {
    pose(road, object.s()?, object.t()?)
}

/// Returns `s`, limited to the extent of the road. A thing beyond the road is drawn at the nearest
/// end of the road, because the user must look there.
pub(crate) fn on_the_road(road: &Road<'_>, s: f64) -> Option<f64> {
    let end = match (road.length(), road.plan_view().end()) {
        (Some(length), Some(end)) => length.max(end),
        (one, other) => one.or(other)?,
    };
    Some(s.clamp(0.0, end.max(0.0)))
}

fn pose(road: &Road<'_>, s: f64, t: f64) -> Option<Pose> {
    let s = on_the_road(road, s)?;
    let point = road.point(s, t, 0.0)?;
    Some(Pose {
        x: point.x,
        y: point.y,
        ..road.pose(s)?
    })
}

/// Returns the object's part of the plan: its outline, else bounding box or cylinder, else place.
pub(crate) fn object<'a>(road: &Road<'a>, object: Object<'a>, origin: Shift) -> ObjectPlan<'a> {
    let pose = object_pose(road, object).map(|pose| Pose {
        hdg: pose.hdg + object.hdg().unwrap_or(0.0),
        ..pose
    });
    let written = object
        .outlines()
        .find(|outline| outline.outer() != Some(false));
    let corners = written.and_then(|outline| corners(road, pose, outline));
    let points = corners
        .or_else(|| bounds(pose?, object))
        .unwrap_or_default();
    let spots: Option<Vec<[i64; 2]>> = points
        .into_iter()
        .map(|point| origin.spot(point).map(|spot| spot.rounded()))
        .collect();
    ObjectPlan {
        object,
        road: road.index(),
        outline: spots.unwrap_or_default(),
    }
}

/// Returns the corners of a given outline (13.2), or `None` if there are fewer than two or one has
/// no place.
fn corners(road: &Road<'_>, pose: Option<Pose>, outline: Outline<'_>) -> Option<Vec<Point>> {
    let mut points = Vec::new();
    for corner in outline.corners() {
        let Corner { kind, point } = corner;
        match kind {
            CornerKind::Road => {
                points.push(road.point(point.s()?, point.t()?, 0.0)?.plan());
            }
            CornerKind::Local => points.push(local(pose?, point.u()?, point.v()?)?),
            CornerKind::Curve => curve(pose?, CurveLocal::of(point.node()), &mut points)?,
        }
    }
    (points.len() > 1).then_some(points)
}

/// Appends the points along a curve of an outline (13.2.3).
fn curve(pose: Pose, curve: CurveLocal<'_>, points: &mut Vec<Point>) -> Option<()> {
    let placed = Placed {
        origin: Point::finite(curve.u()?, curve.v()?)?,
        hdg: curve.hdg()?,
        length: curve.length()?,
        curve: curve.curve()?,
    };
    for step in 0..=CURVE_STEPS {
        let at = placed.point(placed.length * f64::from(step) / f64::from(CURVE_STEPS))?;
        points.push(local(pose, at.x, at.y)?);
    }
    Some(())
}

/// Returns the shape given by length and width or by radius (13.1), else the object's place.
fn bounds(pose: Pose, object: Object<'_>) -> Option<Vec<Point>> {
    let positive = |value: Option<f64>| value.filter(|value| *value > 0.0);
    if let Some(radius) = positive(object.radius()) {
        let corner = |at: u32| {
            let (sin, cos) = (TAU * f64::from(at) / f64::from(CORNERS)).sin_cos();
            local(pose, radius * cos, radius * sin)
        };
        return (0..CORNERS).map(corner).collect();
    }
    let sides = positive(object.length()).zip(positive(object.width()));
    let Some((length, width)) = sides else {
        return Some(vec![pose.point()]);
    };
    let corners = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)];
    let corners = corners.map(|(u, v)| local(pose, u * length, v * width));
    corners.into_iter().collect()
}

/// Converts a point given in u and v of an object at `pose`.
fn local(pose: Pose, u: f64, v: f64) -> Option<Point> {
    let (sin, cos) = pose.hdg.sin_cos();
    Point::finite(pose.x + u * cos - v * sin, pose.y + u * sin + v * cos)
}
