use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.9.0..",
    params: &[TOLERANCE],
    each: Some(each),
    ..Rule::after(READABLE)
};

const TOLERANCE: Param = Param::number(
    "tolerance",
    1e-3,
    "m",
    "largest distance beyond the end of the road that is accepted",
);

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    let tolerance = found.number(&TOLERANCE);
    for section in map.part(part).sections() {
        let length = section.node().f64("length").ok();
        let (Some(s), Some(length)) = (section.s(), length.filter(|length| length.is_finite()))
        else {
            continue;
        };
        let end = s + length;
        if let Some(road_end) = section.road.length().filter(|road| end > road + tolerance) {
            let text = format!(
                "the lane section ends at s = {end} (s = {s} and length = {length}); it must not extend \
                 beyond the end of the road at s = {road_end}"
            );
            found
                .issue(Place::attribute_or_node(section.node(), "length"), text)
                .road(section.road.id(), road_end, 0.0);
        }
    }
}
