use crate::families::direct_overlap::{SharedSpace, shared_spaces};
use crate::families::on_road::{OnRoad, lane_name};
use crate::prelude::*;

const STEP: Param = Param::number("step", 0.05, "m", "maximum accepted difference in height");

pub const RULE: Rule<Roads> = Rule {
    versions: "1.8.0..",
    params: &[STEP],
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for space in shared_spaces(map) {
        check(&space, found);
    }
}

fn check(space: &SharedSpace<'_, '_>, found: &mut Sink<'_>) {
    let limit = found.number(&STEP);
    let [one, other] = &space.arms;
    let steps = space.places.iter().filter_map(|place| {
        let step = other.height(place[1])? - one.height(place[0])?;
        Some((step.abs(), place[1]))
    });
    let worst = steps.max_by(|one, other| one.0.total_cmp(&other.0));
    if let Some((step, (s, t))) = worst.filter(|(step, _)| *step > limit) {
        let text = format!(
            "{} and {} cover the same ground, but their surfaces are up to {step:.2} m apart in height there; \
             lanes that overlap at a direct junction must have the same height (at most {limit} m)",
            lane_name(one.lane),
            lane_name(other.lane)
        );
        found
            .issue(other.link, text)
            .on(other.road(), s, t)
            .at(one.link, "the link to the other lane");
    }
}
