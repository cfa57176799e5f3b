use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.9.0..",
    params: &[TOLERANCE],
    each: Some(each),
    ..Rule::after(READABLE)
};

const TOLERANCE: Param = Param::number("tolerance", 1e-6, "m", "largest gap that is accepted");

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    let tolerance = found.number(&TOLERANCE);
    for road in map.part(part).roads() {
        let Some(layer) = road.permanent() else {
            continue;
        };
        for section in layer.sections(road) {
            if section.lanes().next().is_none() {
                let text = "the lane section of the permanent layer contains no lane; there must be at least one \
                            at every s of the road";
                found.issue(section.node(), text);
            }
        }
        let sections: Vec<SectionRef<'_, '_>> = layer.in_order(road).collect();
        for (index, section) in sections.iter().enumerate() {
            let next = match sections.get(index + 1) {
                Some(next) => next.s(),
                None => road.length(),
            };
            let length = section.node().f64("length").ok();
            let (Some(s), Some(length), Some(next)) = (section.s(), length, next) else {
                continue;
            };
            let end = s + length;
            // A section for a single side may lie beside another one that continues.
            if end < next - tolerance && section.single_side() != Some(true) {
                let text = format!(
                    "this section of the permanent layer ends at s = {end} (s = {s} and length = {length}), so \
                     the road has no permanent lanes from there to s = {next}; there must be at least one lane \
                     at every s"
                );
                found
                    .issue(Place::attribute_or_node(section.node(), "length"), text)
                    .road(road.id(), end, 0.0);
            }
        }
    }
}
