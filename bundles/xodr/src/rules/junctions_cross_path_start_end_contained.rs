use crate::families::cross_paths::crossings;
use crate::prelude::*;

const TOLERANCE: Param = Param::number(
    "tolerance",
    0.05,
    "m",
    "maximum distance of a corner of the crossing road outside the linked lane",
);

pub const RULE: Rule<Roads> = Rule {
    versions: "1.8.0..",
    params: &[TOLERANCE],
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for crossing in crossings(map) {
        for landing in crossing.landings(map) {
            let corners = crossing.corners(landing.end).into_iter().flatten();
            let outside = corners.filter_map(|corner| {
                let (s, t) = landing.project(corner)?;
                let [low, high] = landing.span(s)?;
                Some(((low - t).max(t - high), corner))
            });
            let worst = outside.max_by(|one, other| one.0.total_cmp(&other.0));
            let limit = found.number(&TOLERANCE);
            let Some((outside, corner)) = worst.filter(|(outside, _)| *outside > limit) else {
                continue;
            };
            let text = format!(
                "a corner of crossing road `{}` at its {} lies {outside:.2} m outside lane `{}` of road `{}`; \
                 the ends of a crossing road must lie within the linked lanes with all of its lanes",
                crossing.road.id(),
                landing.end,
                landing.lane,
                landing.other.id()
            );
            found
                .issue(crossing.path.node(), text)
                .point(corner.x, corner.y, 0.0)
                .at(landing.link.node(), "the link");
        }
    }
}
