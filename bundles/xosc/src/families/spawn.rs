//! Entities that overlap at the start.

use std::collections::BTreeMap;

use crate::families::placement::{self, Start};
use crate::prelude::*;
use foldhash::{HashMap, HashSet};
use qcbus_openscenario::places::{Origins, or};

/// A vehicle or pedestrian at the last place that `Init` gives it.
pub(crate) struct Body<'m, 'd> {
    pub(crate) name: String,
    pub(crate) position: Element<'m, 'd>,
    place: Standing,
    /// Half the length and half the width.
    half: (f64, f64),
    /// Vector from the reference point to the center of the box.
    center: (f64, f64),
    height: f64,
}

enum Standing {
    World {
        x: f64,
        y: f64,
        z: Option<f64>,
        h: f64,
    },
    /// `s` and the offset from the middle of the lane. `along` is `None` if the body is at an angle
    /// to the lane.
    Lane {
        key: (String, String),
        s: f64,
        offset: f64,
        along: Option<bool>,
    },
}

/// Returns the bodies with known boxes and places, in document order. Trailers are left out because
/// they stand at their vehicle. Entities that are added later are left out because the place may be
/// free then.
pub(crate) fn bodies<'m, 'd>(scenario: &'m Scenario<'d>) -> Vec<Body<'m, 'd>> {
    let on_map = scenario.on_map(|map| bodies_on(scenario, Some(map)));
    on_map.unwrap_or_else(|| bodies_on(scenario, None))
}

fn bodies_on<'m, 'd>(scenario: &'m Scenario<'d>, map: Option<&RoadMap<'_>>) -> Vec<Body<'m, 'd>> {
    let (Some(trailers), Some(added)) = (placement::trailers(scenario), added(scenario)) else {
        return Vec::new();
    };
    let mut last: HashMap<String, usize> = HashMap::default();
    let origins = Origins::of(scenario, map);
    for (at, start) in origins.starts.iter().enumerate() {
        last.insert(start.name.clone(), at);
    }
    let mut bodies = Vec::new();
    for (at, start) in origins.starts.iter().enumerate() {
        let apart = !trailers.contains(&start.name) && !added.contains(&start.name);
        if apart && last.get(&start.name) == Some(&at) {
            // On a map all places are compared in world coordinates, because roads overlap in a
            // junction.
            let standing = match origins.place(at) {
                Some(place) => Some(Standing::World {
                    x: place.x,
                    y: place.y,
                    z: place.z,
                    h: place.heading,
                }),
                None => place(start.position),
            };
            bodies.extend(standing.and_then(|standing| body(scenario, start, standing)));
        }
    }
    bodies
}

fn added(scenario: &Scenario<'_>) -> Option<HashSet<String>> {
    let mut added = HashSet::default();
    for action in ["AddEntityAction", "DeleteEntityAction"] {
        for action in scenario.elements_everywhere(action) {
            added.insert(action.parent()?.text("entityRef")?.into_owned());
        }
    }
    Some(added)
}

fn body<'m, 'd>(
    scenario: &'m Scenario<'d>,
    start: &Start<'m, 'd>,
    place: Standing,
) -> Option<Body<'m, 'd>> {
    let entity = scenario.entities().object(&start.name)?;
    if !matches!(entity.kind(), EntityKind::Vehicle | EntityKind::Pedestrian) {
        return None;
    }
    let bounds = entity.object(scenario)?.child("BoundingBox")?;
    let (size, center) = (bounds.child("Dimensions")?, bounds.child("Center")?);
    let half = (size.number("length")? / 2.0, size.number("width")? / 2.0);
    if half.0 <= 0.0 || half.1 <= 0.0 {
        return None;
    }
    Some(Body {
        place,
        half,
        center: (center.number("x")?, center.number("y")?),
        height: size.number("height")?,
        name: start.name.clone(),
        position: start.position,
    })
}

fn place(position: Element<'_, '_>) -> Option<Standing> {
    match position.name() {
        "LanePosition" => {
            let lane = position.integer("laneId")?;
            let turned = position.child("Orientation").is_some();
            Some(Standing::Lane {
                key: (position.text("roadId")?.into_owned(), lane.to_string()),
                s: position.number("s")?,
                offset: or(position, "offset", 0.0)?,
                along: (!turned).then_some(lane < 0),
            })
        }
        _ => None,
    }
}

/// Returns each body that overlaps an earlier one, with that one.
pub(crate) fn overlapping<'b, 'm, 'd>(
    bodies: &'b [Body<'m, 'd>],
    tolerance: f64,
) -> Vec<(&'b Body<'m, 'd>, &'b Body<'m, 'd>)> {
    // Groups the bodies by lane. World coordinates form one group.
    let mut lanes: BTreeMap<Option<&(String, String)>, Vec<Reach>> = BTreeMap::new();
    for (at, body) in bodies.iter().enumerate() {
        let reach = body.half.0.hypot(body.half.1) + body.center.0.hypot(body.center.1);
        let (key, middle) = match &body.place {
            Standing::World { x, .. } => (None, *x),
            Standing::Lane { key, s, .. } => (Some(key), *s),
        };
        lanes
            .entry(key)
            .or_default()
            .push((middle - reach, middle + reach, at));
    }
    let mut found: HashMap<usize, usize> = HashMap::default();
    for mut group in lanes.into_values() {
        group.sort_by(|one, other| one.0.total_cmp(&other.0));
        sweep(bodies, &group, tolerance, &mut found);
    }
    let mut found: Vec<_> = found.into_iter().collect();
    found.sort_unstable();
    found
        .into_iter()
        .filter_map(|(one, other)| Some((bodies.get(one)?, bodies.get(other)?)))
        .collect()
}

/// The range that a body may touch, and the index of the body.
type Reach = (f64, f64, usize);

/// Maximum number of neighbours that are compared per body. More can only occur in one pile, which
/// is reported anyway.
const MOST: usize = 500;

/// Compares the bodies with overlapping ranges, in ascending order.
fn sweep(
    bodies: &[Body<'_, '_>],
    group: &[Reach],
    tolerance: f64,
    found: &mut HashMap<usize, usize>,
) {
    for (number, (_, end, one)) in group.iter().enumerate() {
        for (begin, _, other) in group.iter().skip(number + 1).take(MOST) {
            if begin > end {
                break;
            }
            let (earlier, later) = (*one.min(other), *one.max(other));
            if found.contains_key(&later) {
                continue;
            }
            if let (Some(a), Some(b)) = (bodies.get(earlier), bodies.get(later))
                && overlap(a, b, tolerance)
            {
                found.insert(later, earlier);
            }
        }
    }
}

fn overlap(one: &Body<'_, '_>, other: &Body<'_, '_>, tolerance: f64) -> bool {
    match (&one.place, &other.place) {
        (Standing::World { z, .. }, Standing::World { z: other_z, .. }) => {
            let apart = z
                .zip(*other_z)
                .map_or(0.0, |(one, other)| (one - other).abs());
            apart < one.height.max(other.height).max(1.0) && boxes_overlap(one, other, tolerance)
        }
        (
            Standing::Lane {
                s, offset, along, ..
            },
            Standing::Lane {
                s: other_s,
                offset: other_offset,
                along: other_along,
                ..
            },
        ) => {
            let middle = |s: f64, along: &Option<bool>, body: &Body<'_, '_>| {
                along.map(|along| {
                    if along {
                        s + body.center.0
                    } else {
                        s - body.center.0
                    }
                })
            };
            let (Some(at), Some(other_at)) =
                (middle(*s, along, one), middle(*other_s, other_along, other))
            else {
                // The angle does not matter: the same point is the same place.
                return (s - other_s).abs() < tolerance
                    && (offset - other_offset).abs() < tolerance;
            };
            let (length, width) = (one.half.0 + other.half.0, one.half.1 + other.half.1);
            (at - other_at).abs() < length - tolerance
                && (offset - other_offset).abs() < width - tolerance
        }
        _ => false,
    }
}

/// Checks whether two boxes overlap by more than the tolerance, seen from above. They do so if no
/// side of either box separates them.
fn boxes_overlap(one: &Body<'_, '_>, other: &Body<'_, '_>, tolerance: f64) -> bool {
    let (Some(a), Some(b)) = (corners(one), corners(other)) else {
        return false;
    };
    let sides = [(a[0], a[1]), (a[1], a[2]), (b[0], b[1]), (b[1], b[2])];
    sides.iter().all(|(from, to)| {
        let (dx, dy) = (to.0 - from.0, to.1 - from.1);
        let length = dx.hypot(dy);
        let shadow = |corners: &[(f64, f64); 4]| {
            let along = corners.map(|(x, y)| (x * dx + y * dy) / length);
            let least = along.iter().copied().fold(f64::INFINITY, f64::min);
            let most = along.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            (least, most)
        };
        let ((least, most), (other_least, other_most)) = (shadow(&a), shadow(&b));
        most.min(other_most) - least.max(other_least) > tolerance
    })
}

fn corners(body: &Body<'_, '_>) -> Option<[(f64, f64); 4]> {
    let Standing::World { x, y, h, .. } = &body.place else {
        return None;
    };
    let (sin, cos) = h.sin_cos();
    let corner = |length: f64, width: f64| {
        let (along, across) = (body.center.0 + length, body.center.1 + width);
        (
            x + along * cos - across * sin,
            y + along * sin + across * cos,
        )
    };
    let (length, width) = body.half;
    Some([
        corner(-length, -width),
        corner(length, -width),
        corner(length, width),
        corner(-length, width),
    ])
}
