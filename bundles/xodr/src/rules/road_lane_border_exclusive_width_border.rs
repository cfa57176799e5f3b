use crate::families::lane_numbers::word;
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    uids: &[
        "asam.net:xodr:1.4.0:road.lane.border.exclusive_width_border",
        "asam.net:xodr:1.9.0:road.lane.width.no_width_with_border",
    ],
    versions: "1.1.0..",
    each: Some(each),
    ..Rule::after(READABLE)
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for section in map.part(part).sections() {
        for side in Side::BOTH {
            let first = |name: &str| section.side(side).find_map(|lane| lane.node().child(name));
            let (Some(width), Some(border)) = (first("width"), first("border")) else {
                continue;
            };
            let text = format!(
                "the {} lanes of this section use both `width` and `border`; a lane group must use only one of \
                 them",
                word(side)
            );
            let group = border.ancestors().nth(1).unwrap_or(border);
            found
                .issue(group, text)
                .at(width, "a width")
                .at(border, "a border");
        }
    }
}
