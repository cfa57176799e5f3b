use crate::prelude::*;

pub static RULE: Rule<Roads> = Rule {
    id: "check_asam_xodr_road_lane_layer_length_only_temporary",
    uids: &["asam.net:xodr:1.9.0:road.lane.layer.length_only_temporary"],
    versions: "1.9.0..",
    after: super::READABLE,
    page: include_str!("road_lane_layer_length_only_temporary.md"),
    each: Some(each),
    ..Rule::DEFAULTS
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for section in map.part(part).sections() {
        if section.layer.kind() != LayerKind::Permanent {
            continue;
        }
        if let Some(length) = section.node().attribute("length") {
            let text = format!(
                "this lane section of the permanent layer has length = {}; only sections of a temporary layer \
                 may have a length",
                length.value()
            );
            found.issue(length, text);
        }
    }
}
