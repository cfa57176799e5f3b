use crate::families::driving::is_drivable;
use crate::families::on_road::lane_name;
use crate::prelude::*;

const STEP: Param = Param::number(
    "step",
    0.02,
    "m",
    "largest step between neighbouring lanes that is accepted",
);

pub const RULE: Rule<Roads> = Rule {
    level: Level::Warning,
    versions: "1.8.0..",
    backport: Backport::Lower { since: "" },
    params: &[STEP],
    each: Some(each),
    ..Rule::after(READABLE)
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for section in map.part(part).sections() {
        for side in Side::BOTH {
            let mut inner: Option<LaneRef<'_, '_>> = None;
            for lane in section.side(side) {
                if let Some(inner) = inner {
                    check(inner, Edge::Outer, lane, found);
                }
                inner = Some(lane);
            }
        }
        // These lanes are neighbours across the center, which has no width.
        let [left, right] = [Side::Left, Side::Right].map(|side| section.side(side).next());
        if let (Some(left), Some(right)) = (left, right) {
            check(left, Edge::Inner, right, found);
        }
    }
}

/// Reports the largest step between this edge of the first lane and the inner edge of the second
/// lane.
fn check<'m, 'a>(one: LaneRef<'m, 'a>, edge: Edge, other: LaneRef<'m, 'a>, found: &mut Sink<'_>) {
    let raised = |lane: LaneRef<'m, 'a>| !lane.heights().is_empty() || lane.level() == Some(true);
    if !is_drivable(one) || !is_drivable(other) || !(raised(one) || raised(other)) {
        return;
    }
    let limit = found.number(&STEP);
    let steps = places(one.at, [one, other]).filter_map(|ds| {
        let wide = |lane: LaneRef<'m, 'a>| lane.width(ds).is_some_and(|width| width > limit);
        let (here, there) = (one.border(edge, ds)?, other.border(Edge::Inner, ds)?);
        let step = there.point.z - here.point.z;
        (wide(one) && wide(other)).then_some((step, ds, there))
    });
    // Of equal steps this keeps the first one.
    let worst = steps.fold(None, |worst: Option<(f64, Station, _)>, next| match worst {
        Some(worst) if worst.0.abs() + 1e-9 >= next.0.abs() => Some(worst),
        _ => Some(next),
    });
    if let Some((step, ds, border)) = worst.filter(|(step, ..)| step.abs() > limit) {
        let s = one.at.s().unwrap_or(0.0) + ds.x();
        let text = format!(
            "{} lies {:.3} m {} than its neighbour `{}` where they meet at s = {s:.2}; there should be no step \
             between drivable lanes (at most {limit} m is accepted)",
            lane_name(other),
            step.abs(),
            if step > 0.0 { "higher" } else { "lower" },
            one.id_text().unwrap_or_default(),
        );
        found
            .issue(other.node(), text)
            .road(one.at.road.id(), s, border.t)
            .point(border.point.x, border.point.y, border.point.z)
            .at(one.node(), "the neighbour");
    }
}

/// Returns the stations where heights may change: both ends of the section, before and after every
/// height record, and halfway between them.
fn places<'m, 'a>(
    section: SectionRef<'m, 'a>,
    lanes: [LaneRef<'m, 'a>; 2],
) -> impl Iterator<Item = Station> {
    let length = lanes[0].length().unwrap_or(0.0);
    let mut starts: Vec<f64> = lanes
        .iter()
        .flat_map(|lane| lane.heights().iter().filter_map(|height| height.s_offset()))
        .chain([0.0, length])
        .filter(|ds| *ds >= 0.0 && *ds <= length && section.s().is_some())
        .collect();
    starts.sort_by(f64::total_cmp);
    starts.dedup();
    let halves: Vec<f64> = starts
        .windows(2)
        .map(|pair| 0.5 * (pair[0] + pair[1]))
        .collect();
    let mut all: Vec<Station> = Vec::with_capacity(3 * starts.len());
    for (at, start) in starts.iter().enumerate() {
        if at > 0 {
            all.push(Station::before(*start));
        }
        if at + 1 < starts.len() {
            all.push(Station::at(*start));
        }
        all.extend(halves.get(at).map(|half| Station::at(*half)));
    }
    all.into_iter()
}
