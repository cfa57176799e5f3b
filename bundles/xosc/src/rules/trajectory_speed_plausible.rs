use crate::families::positions::moved;
use crate::families::trajectories::{Timing, followed, shape, timed_points, timing_of};
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    params: &[SPEED, ACCELERATION, SPAN],
    run,
    ..Rule::after(READABLE)
};

const SPEED: Param = Param::number(
    "speed",
    1.05,
    "",
    "largest accepted ratio of the required speed to the vehicle's `maxSpeed`",
);
const ACCELERATION: Param = Param::number(
    "acceleration",
    1.5,
    "",
    "largest accepted ratio of the required acceleration or deceleration to the vehicle's `maxAcceleration` or \
     `maxDeceleration`",
);
const SPAN: Param = Param::number(
    "span",
    1.0,
    "s",
    "speeds are averaged over at least this time, so that rounded digits do not appear as accelerations",
);

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for action in scenario.elements_everywhere("FollowTrajectoryAction") {
        let Some(trajectory) = followed(action) else {
            continue;
        };
        let Timing::Asked(timing) = timing_of(trajectory) else {
            continue;
        };
        let scale = timing.number("scale").filter(|scale| *scale > 0.0);
        let polyline = shape(trajectory).filter(|shape| shape.is("Polyline"));
        let (Some(scale), Some(polyline)) = (scale, polyline) else {
            continue;
        };
        let Some(limits) = Limits::of(action) else {
            continue;
        };
        let points = points(polyline, scale);
        if !speed(action, &points, &limits, found) {
            acceleration(action, &points, &limits, found);
        }
    }
}

/// Limits of the slowest vehicle that follows the trajectory.
struct Limits<'m, 'd> {
    performance: Element<'m, 'd>,
    name: &'m str,
    speed: f64,
    acceleration: f64,
    deceleration: f64,
}

impl<'m, 'd> Limits<'m, 'd> {
    fn of(action: Element<'m, 'd>) -> Option<Limits<'m, 'd>> {
        let entities = moved(action)?;
        let limits = entities.into_iter().filter_map(|entity| {
            let object = entity.object(action.scenario())?;
            let performance = object.child("Performance")?;
            Some(Limits {
                performance,
                name: entity.name(),
                speed: performance
                    .number("maxSpeed")
                    .filter(|speed| *speed > 0.0)?,
                acceleration: performance
                    .number("maxAcceleration")
                    .filter(|most| *most > 0.0)?,
                deceleration: performance
                    .number("maxDeceleration")
                    .filter(|most| *most > 0.0)?,
            })
        });
        limits.min_by(|one, two| one.speed.total_cmp(&two.speed))
    }
}

/// A vertex with its time and its distance from the first one.
type Point<'m, 'd> = (Element<'m, 'd>, f64, f64);

fn points<'m, 'd>(polyline: Element<'m, 'd>, scale: f64) -> Vec<Point<'m, 'd>> {
    let mut points: Vec<Point<'m, 'd>> = Vec::new();
    let mut before = None;
    let mut way = 0.0;
    for stamp in timed_points(polyline) {
        let Some((time, spot)) = stamp.time().zip(stamp.spot()) else {
            return Vec::new();
        };
        if let Some(before) = &before {
            let Some(distance) = spot.distance(before) else {
                return Vec::new();
            };
            way += distance;
        }
        let time = time * scale;
        // Another rule reports times that do not increase.
        if points.last().is_some_and(|(_, last, _)| time <= *last) {
            return Vec::new();
        }
        points.push((stamp.element, time, way));
        before = Some(spot);
    }
    points
}

/// Reports where the vehicle would have to exceed its maximum speed.
fn speed(
    action: Element<'_, '_>,
    points: &[Point<'_, '_>],
    limits: &Limits<'_, '_>,
    found: &mut Sink<'_>,
) -> bool {
    let speeds = points.windows(2).filter_map(|pair| match pair {
        [(_, from, start), (vertex, to, end)] => Some((*vertex, (end - start) / (to - from))),
        _ => None,
    });
    let fastest = speeds.max_by(|(_, one), (_, two)| one.total_cmp(two));
    let most = limits.speed * found.number(&SPEED);
    let Some((vertex, speed)) = fastest.filter(|(_, speed)| *speed > most) else {
        return false;
    };
    let text = format!(
        "to reach this vertex in time, `{}` would have to drive at {speed:.1} m/s, but its `maxSpeed` is {} m/s",
        limits.name, limits.speed
    );
    say(action, vertex, limits, text, found);
    true
}

/// Reports where the vehicle would have to exceed its maximum acceleration or deceleration.
fn acceleration(
    action: Element<'_, '_>,
    points: &[Point<'_, '_>],
    limits: &Limits<'_, '_>,
    found: &mut Sink<'_>,
) {
    let factor = found.number(&ACCELERATION);
    let spans = spans(points, found.number(&SPAN));
    let changes = spans.windows(2).filter_map(|pair| match pair {
        [(vertex, from, before), (_, to, after)] => Some((*vertex, (after - before) / (to - from))),
        _ => None,
    });
    let excess = |change: f64| {
        let most = if change > 0.0 {
            limits.acceleration
        } else {
            limits.deceleration
        };
        change.abs() / most
    };
    let worst = changes.max_by(|(_, one), (_, two)| excess(*one).total_cmp(&excess(*two)));
    let Some((vertex, change)) = worst.filter(|(_, change)| excess(*change) > factor) else {
        return;
    };
    let (what, limit, most) = if change > 0.0 {
        ("accelerate", "maxAcceleration", limits.acceleration)
    } else {
        ("brake", "maxDeceleration", limits.deceleration)
    };
    let text = format!(
        "around this vertex `{}` would have to {what} at {:.1} m/s², but its `{limit}` is {most} m/s²",
        limits.name,
        change.abs()
    );
    say(action, vertex, limits, text, found);
}

/// Returns the mean speeds over pieces of at least `least` seconds. Each has the end of the piece,
/// the middle of its time, and the speed.
fn spans<'m, 'd>(points: &[Point<'m, 'd>], least: f64) -> Vec<Point<'m, 'd>> {
    let mut spans = Vec::new();
    let mut begin: Option<Point<'m, 'd>> = None;
    for (vertex, time, way) in points {
        let Some((_, from, start)) = begin else {
            begin = Some((*vertex, *time, *way));
            continue;
        };
        if time - from >= least && *time > from {
            spans.push((
                *vertex,
                f64::midpoint(from, *time),
                (way - start) / (time - from),
            ));
            begin = Some((*vertex, *time, *way));
        }
    }
    spans
}

fn say(
    action: Element<'_, '_>,
    vertex: Element<'_, '_>,
    limits: &Limits<'_, '_>,
    text: String,
    found: &mut Sink<'_>,
) {
    let finding = found
        .about(vertex, "time", text)
        .at(limits.performance.node(), "the limits of the vehicle");
    // A trajectory of a catalog is already reported at its reference.
    if vertex.reference().is_none() {
        finding.at(action.node(), "the action that follows the trajectory");
    }
}
