//! Continuity of linked lanes (OpenDRIVE 1.9, annex D.1).

use super::faults::OfFault as _;
use std::f64::consts::PI;

use super::driving::is_drivable;
use super::gap_levels::Misfit;
use super::on_road::{OnRoad as _, lane_name};
use super::routes::is_route;
use crate::prelude::*;
use qcbus_opendrive::BorderPoint;
use qcbus_opendrive::TouchingLanes;

pub(crate) const GAP: Param = Param::number(
    "gap",
    0.01,
    "m",
    "maximum distance in the plan view at which two edges match",
);
pub(crate) const KINK: Param = Param::number(
    "kink",
    0.01,
    "rad",
    "maximum accepted difference between two headings",
);
pub(crate) const STEP: Param =
    Param::number("step", 0.01, "m", "maximum accepted difference in height");

/// Width in metres up to which a lane counts as zero at a contact with another lane. The direction
/// of the edges of such lanes is meaningless.
const NO_WIDTH: f64 = 0.001;

/// Maximum distance of edges in the plan view for comparing their heights, in metres. It allows
/// small gaps, so that a gap does not hide a step.
const NEAR: f64 = 0.1;

/// Kind of place where two lanes touch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Where {
    /// Within a road, or between two roads that are linked without a junction.
    Roads,
    /// Between an incoming and a connecting road; whether the junction has its own heights.
    Connection { elevation_grid: bool },
    /// Between two roads of a direct junction.
    Direct,
}

/// Two drivable lanes that touch and have some width.
pub(crate) struct Pair<'m, 'a> {
    pub touching: &'m TouchingLanes<'a>,
    pub from: LaneRef<'m, 'a>,
    pub to: LaneRef<'m, 'a>,
    pub at: Where,
}

/// Returns the drivable lanes that touch, once per pair.
pub(crate) fn pairs<'m, 'a>(part: MapPart<'m, 'a>) -> impl Iterator<Item = Pair<'m, 'a>> {
    pairs_of(part.map(), part.touching_lanes())
}

fn pairs_of<'m, 'a>(
    map: &'m RoadMap<'a>,
    touching: impl Iterator<Item = &'m TouchingLanes<'a>>,
) -> impl Iterator<Item = Pair<'m, 'a>> {
    touching.filter_map(|touching| {
        let from = map.lane(touching.joint.from.lane)?;
        let to = map.lane(touching.joint.to.lane)?;
        let wide = touching.narrower() > NO_WIDTH;
        (wide && is_drivable(from) && is_drivable(to)).then(|| Pair {
            touching,
            from,
            to,
            at: place_of(map, &touching.joint, from, to),
        })
    })
}

pub(crate) fn place_of(
    map: &RoadMap<'_>,
    joint: &LaneJoint<'_>,
    from: LaneRef<'_, '_>,
    to: LaneRef<'_, '_>,
) -> Where {
    let named = joint.junction.and_then(|at| map.junctions().get(at));
    let crosses = from.at.road.index() != to.at.road.index();
    let of_roads = [from.at.road.junction(), to.at.road.junction()];
    let of_roads = of_roads.into_iter().flatten().filter(|_| crosses);
    let junction = named.or_else(|| of_roads.into_iter().find_map(|id| map.junction(id)));
    match junction {
        None => Where::Roads,
        Some(junction) if junction.kind() == Some(JunctionType::Direct) => Where::Direct,
        Some(junction) => Where::Connection {
            elevation_grid: junction.elevation_grid().is_some(),
        },
    }
}

/// A fault of one edge.
pub(crate) struct EdgeFault {
    /// `left` or `right`, as seen along s of the first road.
    pub side: &'static str,
    pub amount: f64,
    /// Position on the edge of the first lane.
    pub point: BorderPoint,
}

impl Pair<'_, '_> {
    /// Checks for a hard border, which is lowered and bent at crossings for people and vehicles.
    pub fn is_kerb(&self) -> bool {
        [self.from, self.to]
            .iter()
            .any(|lane| lane.kind() == Some("border"))
    }

    fn worst(&self, fault: impl Fn([BorderPoint; 2]) -> Option<f64>) -> Option<EdgeFault> {
        let sides = ["left", "right"].into_iter().zip(self.touching.edges());
        let faults = sides.filter_map(|(side, edge)| {
            Some(EdgeFault {
                side,
                amount: fault(edge)?,
                point: edge[0],
            })
        });
        faults.max_by(|one, other| one.amount.total_cmp(&other.amount))
    }

    /// Returns the edge with the largest kink, in radians, if it meets within `gap` metres.
    pub fn kink(&self, gap: f64) -> Option<EdgeFault> {
        let turn = if self.touching.joint.is_reversed() {
            PI
        } else {
            0.0
        };
        self.worst(|[here, there]| {
            let meets = distance(here, there) <= gap;
            let difference = heading_difference(here.hdg?, there.hdg? + turn)?;
            meets.then_some(difference)
        })
    }

    /// Returns the angle between the reference lines of two roads whose ends touch, in radians.
    pub fn corner(&self) -> Option<f64> {
        let joint = &self.touching.joint;
        let (from, to) = (self.from.at.road, self.to.at.road);
        let turn = if joint.is_reversed() { PI } else { 0.0 };
        let one = from.end_pose(joint.from.end)?;
        let other = to.end_pose(joint.to.end)?;
        let angle = heading_difference(one.hdg, other.hdg + turn)?;
        (from.index() != to.index()).then_some(angle)
    }

    /// Returns the edge with the highest step among those that meet, in metres. The height
    /// difference caused by a slope over a gap in the plan view is subtracted.
    pub fn step(&self) -> Option<EdgeFault> {
        self.worst(|[here, there]| {
            let apart = distance(here, there);
            let slope = here.slope.abs().max(there.slope.abs());
            let step = (here.point.z - there.point.z).abs() - slope * apart;
            (apart <= NEAR).then_some(step)
        })
    }

    /// Returns the tilt of the lanes against each other in radians, if both are at least `width`
    /// metres wide.
    pub fn roll(&self, width: f64) -> Option<f64> {
        let roll = |at: usize| {
            let (left, right) = (self.touching.left[at].point, self.touching.right[at].point);
            let across = left.plan().distance(right.plan());
            (across >= width).then(|| (left.z - right.z).atan2(across))
        };
        Some((roll(0)? - roll(1)?).abs())
    }

    /// Returns the edge with the greatest change of slope among those that meet. Only roads without
    /// lateral shapes other than superelevation are compared.
    pub fn pitch(&self, gap: f64, step: f64) -> Option<EdgeFault> {
        let flat = |lane: LaneRef<'_, '_>| lane.at.road.lateral().is_flat();
        if !flat(self.from) || !flat(self.to) {
            return None;
        }
        let sign = if self.touching.joint.is_reversed() {
            -1.0
        } else {
            1.0
        };
        self.worst(|[here, there]| {
            let meets =
                distance(here, there) <= gap && (here.point.z - there.point.z).abs() <= step;
            let difference = (here.grade? - sign * there.grade?).abs();
            meets.then_some(difference)
        })
    }

    /// Reports a fault of the pair at the link between the two lanes.
    pub fn report<'s, 'd>(
        &self,
        text: &str,
        point: BorderPoint,
        found: &'s mut Sink<'d>,
    ) -> Finding<'s, 'd> {
        let joint = &self.touching.joint;
        let text = format!(
            "{} and {} are linked, but {text}",
            lane_name(self.from),
            lane_name(self.to)
        );
        let end = self.from.end_station(joint.from.end);
        let s = self.from.at.s().zip(end).map_or(0.0, |(s, ds)| s + ds.x());
        found
            .issue(joint.node, text)
            .road(self.from.at.road.id(), s, point.t)
            .point(point.point.x, point.point.y, point.point.z)
            .at(self.from.node(), "the first lane")
            .at_lane_end(self.from, joint.from.end)
            .at(self.to.node(), "the second lane")
            .at_lane_end(self.to, joint.to.end)
            .at_joint([(self.from, joint.from.end), (self.to, joint.to.end)])
    }
}

fn distance(here: BorderPoint, there: BorderPoint) -> f64 {
    here.point.plan().distance(there.point.plan())
}

/// Reports edges with a kink where linked lanes touch. A corner between the roads themselves of
/// `broken_from` radians and more is an error in every version.
pub(crate) fn report_kink(pair: &Pair<'_, '_>, broken_from: f64, found: &mut Sink<'_>) {
    let limit = found.number(&KINK);
    if let Some(edge) = pair
        .kink(found.number(&GAP))
        .filter(|edge| edge.amount > limit)
    {
        let text = format!(
            "their {} edges point in directions that differ by {:.4} rad ({:.2}°) where they touch; at most \
             {limit} rad is allowed",
            edge.side,
            edge.amount,
            edge.amount.to_degrees()
        );
        let is_broken = pair.corner().is_some_and(|corner| corner >= broken_from);
        let misfit = if is_broken && is_route(pair.from) && is_route(pair.to) {
            Misfit::Broken
        } else {
            Misfit::kink(edge.amount, found)
        };
        misfit.put(pair.report(&text, edge.point, found));
    }
}

/// Reports steps in height where linked lanes touch. Returns whether there was one.
pub(crate) fn report_step(pair: &Pair<'_, '_>, found: &mut Sink<'_>) -> bool {
    let limit = found.number(&STEP);
    let Some(edge) = pair.step().filter(|edge| edge.amount > limit) else {
        return false;
    };
    let text = format!(
        "their {} edges differ by {:.3} m in height where they touch; at most {limit} m is allowed",
        edge.side, edge.amount
    );
    let misfit = Misfit::step(edge.amount, found);
    // No route leads over a border or a hard shoulder.
    let has_routes = is_route(pair.from) && is_route(pair.to);
    let most = if has_routes {
        Misfit::Broken
    } else {
        Misfit::Plain
    };
    let misfit = misfit.min(most);
    misfit.put(pair.report(&text, edge.point, found));
    true
}

/// Reports kinks and steps at places of one kind. Together with gaps they define `smooth` for
/// junctions; `lane_smoothness.contact_point_no_horizontal_gaps` reports gaps.
pub(crate) fn report_misfits(
    map: &RoadMap<'_>,
    mine: impl Fn(Where) -> bool,
    found: &mut Sink<'_>,
) {
    for pair in pairs_of(map, map.touching_lanes()).filter(|pair| mine(pair.at)) {
        report_kink(&pair, f64::INFINITY, found);
        let has_grid = pair.at
            == Where::Connection {
                elevation_grid: true,
            };
        if !has_grid {
            report_step(&pair, found);
        }
    }
}
