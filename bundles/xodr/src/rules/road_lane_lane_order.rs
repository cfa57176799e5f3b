use crate::families::lane_numbers::{number, outward, word};
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.1.0..",
    each: Some(each),
    ..Rule::after(READABLE)
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for section in map.part(part).sections() {
        for side in Side::BOTH {
            let lanes = outward(section, side);
            let Some((distance, lane)) = lanes.first().filter(|(distance, _)| *distance != 1)
            else {
                continue;
            };
            let text = format!(
                "the innermost lane on the {} has id {}; numbering must start with {} next to the \
                 center lane",
                word(side),
                number(side, *distance),
                number(side, 1)
            );
            found.issue(Place::attribute_or_node(lane.node(), "id"), text);
        }
    }
}
