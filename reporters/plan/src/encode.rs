//! Encoding of the plan as bytes.

use qcbus_opendrive::{ContactPoint, Junction, Road, RoadMap, TrafficRule};

use crate::furniture::{ObjectPlan, SignalPlan};
use crate::road::RoadPlan;
use crate::section::{Border, LanePlan, SectionPlan};
use crate::simplify::Vertex;
use crate::writer::{Writer, length, offset};

const LEFT_HAND: u64 = 1;
const CANNOT_BE_DRAWN: u64 = 2;

const DYNAMIC: u64 = 1;
const NO_PLACE: u64 = 2;

/// Writes a road, also one that cannot be drawn and has no plan.
pub(crate) fn road(
    out: &mut Writer,
    map: &RoadMap<'_>,
    road: &Road<'_>,
    plan: Option<&RoadPlan<'_>>,
) {
    let nothing = RoadPlan::default();
    out.string(road.id());
    out.string(road.node().attr("name").unwrap_or(""));
    let junction = road.junction().and_then(|id| map.junction(id));
    out.maybe(junction.map(Junction::index));
    let mut flags = 0;
    if road.traffic_rule() == Some(TrafficRule::LeftHand) {
        flags |= LEFT_HAND;
    }
    if plan.is_none() {
        flags |= CANNOT_BE_DRAWN;
    }
    out.unsigned(flags);
    out.unsigned(length(road.length().unwrap_or(0.0)));
    let plan = plan.unwrap_or(&nothing);
    let mut last = 0;
    out.points(
        &plan.line,
        |point| point.at,
        |out, point| {
            ascending(out, length(point.s), &mut last);
            out.unsigned(u64::from(point.level));
        },
    );
    profile(out, &plan.elevation, true);
    for end in ContactPoint::BOTH {
        link(out, road, end);
    }
    out.count(plan.sections.len());
    for each in &plan.sections {
        section(out, each);
    }
}

fn link(out: &mut Writer, road: &Road<'_>, end: ContactPoint) {
    let link = road.link(end);
    let (kind, id) = match link.map(|link| (link.road_id(), link.junction_id())) {
        Some((Some(id), _)) => (1, id),
        Some((None, Some(id))) => (2, id),
        _ => (0, ""),
    };
    out.unsigned(kind);
    out.string(id);
}

/// Writes a number as the difference from the previous one, which is never larger.
fn ascending(out: &mut Writer, value: u64, last: &mut u64) {
    let value = value.max(*last);
    out.unsigned(value - *last);
    *last = value;
}

/// Writes values along the road, in centimetres. With `steps`, each is written as the difference
/// from the previous one.
fn profile(out: &mut Writer, values: &[[f64; 2]], steps: bool) {
    out.count(values.len());
    let (mut last, mut height) = (0, 0);
    for [along, value] in values {
        ascending(out, length(along / 100.0), &mut last);
        let value = offset(value / 100.0);
        if steps {
            let value = value.clamp(-HIGHEST, HIGHEST);
            out.signed(value - height);
            height = value;
        } else {
            out.unsigned(value.unsigned_abs());
        }
    }
}

/// Maximum height, in centimetres: 10,000 km.
const HIGHEST: i64 = 1_000_000_000;

fn section(out: &mut Writer, section: &SectionPlan<'_>) {
    out.unsigned(length(section.s[0]));
    out.unsigned(length(section.s[1]));
    border(out, &section.center);
    for side in [&section.left, &section.right] {
        out.count(side.len());
        for each in side {
            lane(out, each);
        }
    }
}

fn lane(out: &mut Writer, lane: &LanePlan<'_>) {
    out.signed(lane.id);
    out.string(lane.kind);
    border(out, &lane.border);
    profile(out, &lane.widths, false);
}

fn border(out: &mut Writer, border: &Border<'_>) {
    out.points(
        &border.line,
        |point: &Vertex| point.at,
        |out, point| {
            out.unsigned(u64::from(point.level));
        },
    );
    out.count(border.marks.len());
    for mark in &border.marks {
        out.count(mark.first);
        out.count(mark.points);
        out.string(mark.kind);
        out.string(mark.color);
        out.unsigned(length(mark.width));
    }
}

/// Writes a junction with its outline.
pub(crate) fn junction(
    out: &mut Writer,
    map: &RoadMap<'_>,
    junction: &Junction<'_>,
    outline: &[[i64; 2]],
) {
    out.string(junction.id());
    out.string(junction.node().attr("name").unwrap_or(""));
    let written = || junction.node().attr("type").unwrap_or("");
    out.string(junction.kind().map_or_else(written, |kind| kind.as_str()));
    out.points(outline, |point| *point, |_, _| {});
    let index = |id: Option<&str>| map.road(id?).map(Road::index);
    out.count(junction.connections().count());
    for connection in junction.connections() {
        out.maybe(index(connection.incoming_road()));
        out.maybe(index(connection.target_road()));
    }
}

/// Writes a signal.
pub(crate) fn signal(out: &mut Writer, plan: &SignalPlan<'_>) {
    let signal = plan.signal;
    for text in [
        signal.id(),
        signal.node().attr("name"),
        signal.kind(),
        signal.subtype(),
    ] {
        out.string(text.unwrap_or(""));
    }
    out.count(plan.road);
    out.unsigned(length(signal.s().unwrap_or(0.0)));
    out.signed(offset(signal.t().unwrap_or(0.0)));
    let [x, y] = plan.at.unwrap_or_default();
    out.signed(x);
    out.signed(y);
    out.signed((1000.0 * plan.hdg).round() as i64);
    let mut flags = 0;
    if signal.dynamic() == Some(true) {
        flags |= DYNAMIC;
    }
    if plan.at.is_none() {
        flags |= NO_PLACE;
    }
    out.unsigned(flags);
}

/// Writes an object.
pub(crate) fn object(out: &mut Writer, plan: &ObjectPlan<'_>) {
    let object = plan.object;
    for text in [object.id(), object.node().attr("name"), object.kind()] {
        out.string(text.unwrap_or(""));
    }
    out.count(plan.road);
    out.unsigned(length(object.s().unwrap_or(0.0)));
    out.signed(offset(object.t().unwrap_or(0.0)));
    out.points(&plan.outline, |point| *point, |_, _| {});
}
