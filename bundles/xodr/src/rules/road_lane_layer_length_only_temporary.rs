use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.9.0..",
    each: Some(each),
    ..Rule::after(READABLE)
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
