use crate::prelude::*;
use qcbus_opendrive::Record;

pub const RULE: Rule<Roads> = Rule {
    uids: &[
        "asam.net:xodr:1.4.0:road.lane.border.exclusive_offset_border",
        "asam.net:xodr:1.4.0:road.lanes.lane_offset.no_offset_if_border_defined",
    ],
    versions: "1.1.0..",
    each: Some(each),
    ..Rule::after(READABLE)
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for road in map.part(part).roads() {
        for layer in road.layers() {
            let mut lanes = layer.sections(road).flat_map(SectionRef::lanes);
            let border = lanes.find_map(|lane| lane.elements("border").next());
            let offsets = layer.offset().records();
            let (Some(border), Some(offset)) = (border, offsets.first()) else {
                continue;
            };
            let shifting = offsets.iter().find(|offset| !is_zero(offset));
            let text = "a lane has a `border`, but the road has a `laneOffset`; borders are measured from the \
                        reference line and must not be used together with an offset";
            let (level, offset) = match shifting {
                Some(shifting) => (Level::Error, shifting),
                None => (Level::Information, offset),
            };
            found
                .issue(border, text)
                .level(level)
                .at(offset.node(), "the lane offset");
        }
    }
}

/// Checks whether the offset is zero. An unreadable offset may be different from zero.
fn is_zero(offset: &Record<'_>) -> bool {
    let zero = |cubic: Cubic| [cubic.a, cubic.b, cubic.c, cubic.d] == [0.0; 4];
    offset.cubic().is_some_and(zero)
}
