use std::f64::consts::TAU;

use crate::families::on_road::MAX_PLACES;
use crate::prelude::*;

const TURNS: Param = Param::number(
    "turns",
    2.5,
    "",
    "largest number of full turns at which a heading counts as radians",
);

/// Distance in metres from which two ends do not meet.
const FAR: f64 = 1.0;
/// Distance of ends that meet, per metre of the geometry. It is also the maximum difference of
/// directions that continue, in radians.
const NEAR: f64 = 0.01;

pub const RULE: Rule<Roads> = Rule {
    level: Level::Warning,
    params: &[TURNS],
    each: Some(each),
    ..Rule::after(READABLE)
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
                fit: fit(map, road, at, hdg),
            })
            .filter(|odd| odd.fit != Some(Fit::Meets))
            .collect();
        if !odd.is_empty() {
            report(road, &odd, found);
        }
    }
}

/// Fit of a geometry with such a heading to the previous and the next geometry.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Fit {
    /// The geometry meets the next one, so the many turns are intended.
    Meets,
    /// The end lies this number of metres from the next geometry.
    Misses(f64),
    /// Like `Misses`, but it meets the next geometry if the heading is read as degrees.
    MeetsInDegrees(f64),
}

/// A heading with many turns.
struct Odd {
    /// Index of its geometry in the road.
    at: usize,
    hdg: f64,
    fit: Option<Fit>,
}

/// Reports the first heading of a road, with the others as further places.
fn report(road: &Road<'_>, odd: &[Odd], found: &mut Sink<'_>) {
    let geometries = road.plan_view().geometries();
    let proof = odd.iter().find_map(|odd| match odd.fit? {
        Fit::Meets => None,
        Fit::Misses(gap) => Some(format!(
            "; with this heading, the geometry ends {gap:.2} m away from the next one"
        )),
        Fit::MeetsInDegrees(gap) => Some(format!(
            "; with this heading, the geometry ends {gap:.2} m away from the next one, but would meet it if the \
             heading were in degrees"
        )),
    });
    let mut places = odd
        .iter()
        .filter_map(|odd| Some((geometries.get(odd.at)?, odd.hdg)));
    let Some((first, hdg)) = places.next() else {
        return;
    };
    let turns = (hdg / TAU).abs();
    let certain = proof.is_some();
    let proof = proof.unwrap_or_default();
    let text = format!(
        "the heading is {hdg:.6}, which is {turns:.1} full turns; headings are in radians, not in degrees, and \
         less than a full turn (6.28) is sufficient{proof}"
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

/// Returns the fit to the next geometry and to the previous direction, or `None` if unknown.
fn fit<'a>(map: &RoadMap<'a>, road: &Road<'a>, at: usize, hdg: f64) -> Option<Fit> {
    let geometries = road.plan_view().geometries();
    let geometry: &Geometry<'_> = geometries.get(at)?;
    let before = at.checked_sub(1).and_then(|at| geometries.get(at)?.end());
    let turn = before.and_then(|before| heading_difference(before.hdg, hdg));
    if turn.is_some_and(|turn| turn.abs() < NEAR) {
        return Some(Fit::Meets);
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
    if radians < near {
        return Some(Fit::Meets);
    }
    (radians > FAR.max(10.0 * near)).then_some(if degrees < near {
        Fit::MeetsInDegrees(radians)
    } else {
        Fit::Misses(radians)
    })
}
