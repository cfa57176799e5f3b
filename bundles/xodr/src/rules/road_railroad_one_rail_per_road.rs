use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.7.0..",
    backport: Backport::Lower { since: "" },
    each: Some(each),
    ..Rule::after(READABLE)
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for section in map.part(part).sections() {
        let mut rails = section
            .lanes()
            .filter(|lane| matches!(lane.kind(), Some("tram" | "rail")));
        let Some(first) = rails.next() else { continue };
        for lane in rails {
            let text = format!(
                "lane `{}` of road `{}` is a `{}` lane, but lane `{}` is already a `{}` lane; a road may have \
                 only one tram or rail lane",
                lane.id_text().unwrap_or_default(),
                section.road.id(),
                lane.kind().unwrap_or_default(),
                first.id_text().unwrap_or_default(),
                first.kind().unwrap_or_default()
            );
            found
                .issue(Place::attribute_or_node(lane.node(), "type"), text)
                .at(first.node(), "the first of these lanes");
        }
    }
}
