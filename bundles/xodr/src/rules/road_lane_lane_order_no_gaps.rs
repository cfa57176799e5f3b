use crate::families::lane_numbers::{number, outward};
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.1.0..",
    each: Some(each),
    ..Rule::after(READABLE)
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for section in map.part(part).sections() {
        for side in Side::BOTH {
            for pair in outward(section, side).windows(2) {
                let ((inner, inner_lane), (outer, lane)) = (pair[0], pair[1]);
                if outer - inner <= 1 {
                    continue;
                }
                let missing = match (inner + 1, outer - 1) {
                    (one, last) if one == last => format!("{} is", number(side, one)),
                    (one, last) => format!("{} to {} are", number(side, one), number(side, last)),
                };
                let text = format!(
                    "lane {} is followed outward by lane {}; {missing} missing, but ids must be consecutive",
                    number(side, inner),
                    number(side, outer)
                );
                found
                    .issue(Place::attribute_or_node(lane.node(), "id"), text)
                    .at(inner_lane.node(), "the last lane before the gap");
            }
        }
    }
}
