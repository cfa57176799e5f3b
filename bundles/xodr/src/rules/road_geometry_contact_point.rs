use crate::families::faults::OfFault as _;
use crate::families::gap_levels::{
    GAP_BROKEN_FROM, GAP_ERROR_FROM, Misfit, STEP_BROKEN_FROM, STEP_ERROR_FROM,
};
use crate::families::mouths::Mouth;
use crate::families::on_road::OnRoad;
use crate::prelude::*;
use qcbus_opendrive::geometry::Point3;

const GAP: Param = Param::number(
    "gap",
    0.01,
    "m",
    "largest distance that is accepted, in the plan view and in height",
);

pub const RULE: Rule<Roads> = Rule {
    versions: "1.7.0..",
    backport: Backport::Separate { since: "" },
    params: &[
        GAP,
        GAP_ERROR_FROM,
        GAP_BROKEN_FROM,
        STEP_ERROR_FROM,
        STEP_BROKEN_FROM,
    ],
    each: Some(each),
    ..Rule::after(READABLE)
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for road in map.part(part).roads() {
        for end in ContactPoint::BOTH {
            check(map, road, end, found);
        }
    }
}

fn check<'a>(map: &RoadMap<'a>, road: &Road<'a>, end: ContactPoint, found: &mut Sink<'_>) {
    let Some(contact) = map.linked_end(road, end) else {
        return;
    };
    let Some(linked) = map.road_at(contact.to.road) else {
        return;
    };
    // The rule only covers roads that are connected without a junction.
    if road.junction().is_some() || linked.junction().is_some() {
        return;
    }
    let (Some(here), Some(there)) = (place(road, end), place(linked, contact.to.end)) else {
        return;
    };
    let (gap, step) = (here.plan().distance(there.plan()), (here.z - there.z).abs());
    let limit = found.number(&GAP);
    if gap <= limit && step <= limit {
        return;
    }
    let RoadEnd { end: other, .. } = contact.to;
    let distance = match (gap > limit, step > limit) {
        (true, false) => format!("{gap:.3} m away from"),
        (false, _) => format!("{step:.3} m above or below"),
        (true, true) => format!("{gap:.3} m away from, and {step:.3} m above or below,"),
    };
    let meant = place(linked, other.other()).map(|meant| here.plan().distance(meant.plan()));
    let meant = match meant {
        Some(meant) if meant <= limit => {
            format!(
                " (the {} of road `{}` lies there)",
                other.other(),
                linked.id()
            )
        }
        _ => String::new(),
    };
    let text = format!(
        "the {end} of road `{}` lies {distance} the {other} of road `{}`, its {}{meant}; reference lines of \
         linked roads must meet within {limit} m",
        road.id(),
        linked.id(),
        end.link_name()
    );
    let misfit = misfit((road, end), (linked, other), [gap, step], found);
    misfit
        .put(found.issue(road.node(), text))
        .at_end(road, end)
        .at(contact.node, "the link")
        .at_end(linked, other)
        .at_gap([contact.from, contact.to]);
}

/// Classifies the distance of two ends. If reference lines lie side by side, the lanes may still
/// meet. They do not meet if the mouths of the roads are apart. If the mouths are apart but the
/// reference lines nearly meet, `road.linkage.ends_meet` reports the mouths.
fn misfit(
    (road, end): (&Road<'_>, ContactPoint),
    (linked, other): (&Road<'_>, ContactPoint),
    [gap, step]: [f64; 2],
    found: &Sink<'_>,
) -> Misfit {
    let mouths = Mouth::of(road, end).zip(Mouth::of(linked, other));
    let whole = mouths.map_or(gap, |(here, there)| here.distance(there));
    Misfit::gap(gap, whole.min(gap), found).max(Misfit::step(step, found))
}

fn place(road: &Road<'_>, end: ContactPoint) -> Option<Point3> {
    let frame = road.end_frame(end)?;
    Point3::finite(frame.pose.x, frame.pose.y, frame.z)
}
