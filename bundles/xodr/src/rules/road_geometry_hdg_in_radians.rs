use std::f64::consts::TAU;

use qcbus_opendrive::geometry::{Point, heading_difference};
use qcbus_opendrive::{ContactPoint, Geometry, Road, RoadMap};
use qcbus_sdk::{Level, Param, Place, Rule, Sink};

use crate::families::on_road::MAX_PLACES;
use crate::model::{Part, Roads};

const TURNS: Param = Param::number(
    "turns",
    2.5,
    "",
    "number of full turns up to which a heading is taken for radians",
);

/// How far apart ends lie that do not meet, in metres.
const FAR: f64 = 1.0;
/// How far apart ends lie that do, for every metre of the geometry, and by how many radians directions differ
/// that go on.
const NEAR: f64 = 0.01;

pub static RULE: Rule<Roads> = Rule {
    id: "check_qcbus_xodr_road_geometry_hdg_in_radians",
    uids: &["qcbus.dev:xodr:1.4.0:road.geometry.hdg_in_radians"],
    level: Level::Warning,
    after: super::READABLE,
    params: &[TURNS],
    page: include_str!("road_geometry_hdg_in_radians.md"),
    each: Some(each),
    ..Rule::DEFAULTS
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    let most = found.number(&TURNS) * TAU;
    for road in map.part(part).roads() {
        let headings = road.plan_view().geometries().iter().enumerate();
        let far = headings
            .filter_map(|(at, geometry)| Some((at, geometry.hdg()?)))
            .filter(|(_, hdg)| hdg.abs() > most);
        let odd: Vec<Odd> = far
            .map(|(at, hdg)| Odd {
                at,
                hdg,
                meant: meant(map, road, at, hdg),
            })
            .filter(|odd| odd.meant != Some(Unit::Radians))
            .collect();
        if !odd.is_empty() {
            report(road, &odd, found);
        }
    }
}

/// What a heading is written in, as far as the pieces before and after it tell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Unit {
    Radians,
    Degrees,
}

/// A heading of many turns.
struct Odd {
    /// Its geometry's place in the road.
    at: usize,
    hdg: f64,
    meant: Option<Unit>,
}

/// Reports the first heading of a road, with the others as further places.
fn report(road: &Road<'_>, odd: &[Odd], found: &mut Sink<'_>) {
    let geometries = road.plan_view().geometries();
    let certain = odd.iter().any(|odd| odd.meant == Some(Unit::Degrees));
    let mut places = odd
        .iter()
        .filter_map(|odd| Some((geometries.get(odd.at)?, odd.hdg)));
    let Some((first, hdg)) = places.next() else {
        return;
    };
    let turns = (hdg / TAU).abs();
    let proof = if certain {
        "; read as degrees, the road meets what follows it, as radians it does not"
    } else {
        ""
    };
    let text = format!(
        "the heading is {hdg:.6}, which is {turns:.1} full turns; headings are in radians, not in degrees, and less \
         than a full turn (6.28) says all{proof}"
    );
    let mut finding = found.issue(Place::attribute_or_node(first.node(), "hdg"), text);
    if certain {
        finding = finding.level(Level::Error);
    }
    if let Some(s) = first.s() {
        finding = finding.road(road.id(), s, 0.0);
    }
    for (other, hdg) in places.take(MAX_PLACES) {
        let what = format!("a heading of {hdg:.6}");
        finding = finding.at(Place::attribute_or_node(other.node(), "hdg"), what);
    }
}

/// By which reading a geometry leads to what follows it, or goes on in the direction of what is before it.
fn meant<'a>(map: &RoadMap<'a>, road: &Road<'a>, at: usize, hdg: f64) -> Option<Unit> {
    let geometries = road.plan_view().geometries();
    let geometry: &Geometry<'_> = geometries.get(at)?;
    let before = at.checked_sub(1).and_then(|at| geometries.get(at)?.end());
    let turn = before.and_then(|before| heading_difference(before.hdg, hdg));
    if turn.is_some_and(|turn| turn.abs() < NEAR) {
        return Some(Unit::Radians);
    }
    let (start, end) = (geometry.origin()?, geometry.end_point()?);
    let (sin, cos) = (hdg.to_radians() - hdg).sin_cos();
    let (dx, dy) = (end.x - start.x, end.y - start.y);
    let turned = Point::finite(start.x + cos * dx - sin * dy, start.y + sin * dx + cos * dy)?;
    let next = match geometries.get(at + 1) {
        Some(next) => vec![next.origin()?],
        None => map
            .neighbours(road, ContactPoint::End)
            .iter()
            .filter_map(|other| map.roads().get(other.road)?.end_pose(other.end))
            .map(|pose| pose.point())
            .collect(),
    };
    let gap = |point: Point| {
        let gaps = next.iter().map(|next| next.distance(point));
        gaps.min_by(f64::total_cmp)
    };
    let near = NEAR * geometry.length()?.max(1.0);
    let (radians, degrees) = (gap(end)?, gap(turned)?);
    match (radians < near, degrees < near) {
        (true, _) => Some(Unit::Radians),
        (false, true) if radians > FAR.max(10.0 * near) => Some(Unit::Degrees),
        _ => None,
    }
}
