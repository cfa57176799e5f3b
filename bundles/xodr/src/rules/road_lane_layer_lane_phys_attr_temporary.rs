use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.9.0..",
    each: Some(each),
    ..Rule::after(READABLE)
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
