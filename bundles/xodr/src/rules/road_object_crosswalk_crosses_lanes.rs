use crate::families::object_parts::named;
use crate::families::on_road::OnRoad;
use crate::families::roadside::{beside, edges_at};
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    level: Level::Warning,
    params: &[AWAY],
    run,
    ..Rule::after(READABLE)
};

const AWAY: Param = Param::number(
    "away",
    5.0,
    "m",
    "largest distance between a crosswalk and the lanes of its road that is accepted",
);
fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let away = found.number(&AWAY);
    for (road, object) in map.objects() {
        // In a junction the crosswalk may cross another road.
        let in_junction = road.junction().is_some_and(|id| id != "-1");
        if object.kind() != Some("crosswalk") || in_junction || object.repeats().next().is_some() {
            continue;
        }
        let Some((s, range)) = across(road, &object) else {
            continue;
        };
        if edges_at(road, s).is_none() {
            continue;
        }
        let [low, high] = range;
        let nearest = beside(road, s, low).min(beside(road, s, high));
        let [right, left] = edges_at(road, s).unwrap_or_default();
        let meets = low < left && high > right;
        if meets || nearest <= away {
            continue;
        }
        let text = format!(
            "{} lies between t = {low:.2} and {high:.2}, but the lanes of road `{}` lie between {right:.2} and \
             {left:.2}; a crosswalk should cross lanes",
            named(object.node()),
            road.id()
        );
        found
            .issue(object.node(), text)
            .on(road, s, 0.5 * (low + high));
    }
}

/// Returns s of a crosswalk along its road, and its range of t.
fn across(road: &Road<'_>, object: &Object<'_>) -> Option<(f64, [f64; 2])> {
    let (s, t) = object.s().zip(object.t())?;
    let (sin, cos) = object.hdg().unwrap_or(0.0).sin_cos();
    let mut places: Vec<(f64, f64)> = Vec::new();
    for corner in object.outlines().flat_map(|outline| outline.corners()) {
        let point = corner.point;
        places.push(match corner.kind {
            CornerKind::Road => point.s().zip(point.t())?,
            CornerKind::Local | CornerKind::Curve => {
                let (u, v) = point.u().zip(point.v())?;
                (s + u * cos - v * sin, t + u * sin + v * cos)
            }
        });
    }
    if places.is_empty() {
        let half = 0.5
            * object
                .length()
                .unwrap_or(0.0)
                .hypot(object.width().unwrap_or(0.0));
        places = vec![(s, t - half), (s, t + half)];
    }
    let along = places.iter().map(|place| place.0).sum::<f64>() / places.len() as f64;
    let length = road.length()?;
    let low = places
        .iter()
        .map(|place| place.1)
        .fold(f64::INFINITY, f64::min);
    let high = places
        .iter()
        .map(|place| place.1)
        .fold(f64::NEG_INFINITY, f64::max);
    Some((along.clamp(0.0, length.max(0.0)), [low, high]))
}
