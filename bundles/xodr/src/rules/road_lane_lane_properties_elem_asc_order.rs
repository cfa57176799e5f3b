use crate::families::ascending;
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    uids: &[
        "asam.net:xodr:1.4.0:road.lane.lane_properties.elem_asc_order",
        "asam.net:xodr:1.4.0:road.lane.width.elem_asc_order",
        "asam.net:xodr:1.4.0:road.lane.border.elem_asc_order",
        "asam.net:xodr:1.4.0:road.lane.height.elem_asc_order",
    ],
    versions: "1.1.0..",
    params: &[ascending::TOLERANCE],
    each: Some(each),
    ..Rule::after(READABLE)
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for (element, uid) in [
        (
            "width",
            "asam.net:xodr:1.4.0:road.lane.width.elem_asc_order",
        ),
        (
            "border",
            "asam.net:xodr:1.4.0:road.lane.border.elem_asc_order",
        ),
        (
            "height",
            "asam.net:xodr:1.4.0:road.lane.height.elem_asc_order",
        ),
    ] {
        ascending::lane_records_under(map.part(part), element, Some(uid), ascending::VOID, found);
    }
}
