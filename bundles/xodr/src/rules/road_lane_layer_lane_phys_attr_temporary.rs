use crate::prelude::*;

pub static RULE: Rule<Roads> = Rule {
    id: "check_asam_xodr_road_lane_layer_lane_phys_attr_temporary",
    uids: &["asam.net:xodr:1.9.0:road.lane.layer.lane_phys_attr_temporary"],
    versions: "1.9.0..",
    after: super::READABLE,
    page: include_str!("road_lane_layer_lane_phys_attr_temporary.md"),
    each: Some(each),
    ..Rule::DEFAULTS
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for lane in map.part(part).lanes() {
        if lane.at.layer.kind() != LayerKind::Temporary {
            continue;
        }
        for element in ["height", "material"] {
            for child in lane.elements(element) {
                let text = format!(
                    "a lane of the temporary layer has a `{element}`; only the permanent layer may define the \
                     height and material of the surface"
                );
                found.issue(child, text);
            }
        }
    }
}
