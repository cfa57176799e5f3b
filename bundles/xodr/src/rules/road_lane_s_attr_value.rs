use crate::prelude::*;

pub static RULE: Rule<Roads> = Rule {
    id: "check_asam_xodr_road_lane_s_attr_value",
    uids: &["asam.net:xodr:1.4.0:road.lane.s_attr_value"],
    versions: "1.1.0..",
    after: super::READABLE,
    page: include_str!("road_lane_s_attr_value.md"),
    each: Some(each),
    ..Rule::DEFAULTS
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for section in map.part(part).sections() {
        let node = section.node();
        let text = match (section.s(), node.attr("s")) {
            (Some(s), _) if s < 0.0 => format!(
                "the lane section starts at s = {s}; `s` must not be negative, because roads start at s = 0"
            ),
            (Some(_), _) => continue,
            (None, Some(text)) => {
                format!("`s` of the lane section is `{text}`; it must be a finite number [m]")
            }
            (None, None) => {
                "the lane section has no `s`; it must define where the section starts".to_owned()
            }
        };
        found.issue(Place::attribute_or_node(node, "s"), text);
    }
}
