use crate::prelude::*;
use qcbus_opendrive::ShapeRow;

const STEP: Param = Param::number(
    "step",
    0.3,
    "m",
    "largest plausible step across a road, such as that of a high kerb",
);

pub const RULE: Rule<Roads> = Rule {
    level: Level::Warning,
    params: &[STEP],
    each: Some(each),
    ..Rule::after(READABLE)
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for road in map.part(part).roads() {
        for row in road.lateral().shape.rows() {
            check(road.id(), row, found);
        }
    }
}

/// Reports the highest step in one cross section.
fn check(road: &str, row: &ShapeRow<'_>, found: &mut Sink<'_>) {
    let limit = found.number(&STEP);
    let steps = row.profile.in_order().skip(1).filter_map(|record| {
        let t = record.start()?;
        let before = row.profile.at(Station::before(t))?;
        let after = row.profile.at(t)?;
        Some((record.node(), t, before, after))
    });
    let height = |step: &(_, f64, f64, f64)| (step.3 - step.2).abs();
    let highest = steps
        .filter(|step| height(step) > limit)
        .max_by(|one, other| height(one).total_cmp(&height(other)));
    if let Some(step) = highest {
        let (node, t, before, after) = step;
        let text = format!(
            "the cross section of road `{road}` at s = {} steps from {before:.3} m to {after:.3} m at t = {t}; \
             the shapes of one cross section should join, and a step of more than {limit} m is not a kerb",
            row.s
        );
        found.issue(node, text).road(road, row.s, t);
    }
}
