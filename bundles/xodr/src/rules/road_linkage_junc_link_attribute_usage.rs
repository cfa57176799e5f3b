use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.7.0..",
    backport: Backport::Lower { since: "1.1.0" },
    each: Some(each),
    ..Rule::after(READABLE)
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for road in map.part(part).roads() {
        for link in ContactPoint::BOTH
            .into_iter()
            .filter_map(|end| road.link(end))
        {
            if link.element_type() == Some("junction") {
                check(map, link, found);
            }
        }
    }
}

fn check(map: &RoadMap<'_>, link: RoadLink<'_>, found: &mut Sink<'_>) {
    let Some(id) = link.element_id() else {
        let text = "the link leads to a junction, but has no `elementId` to identify it; links to junctions must \
                    have `elementType` and `elementId`";
        found.issue(link.node(), text);
        return;
    };
    // Separate rules cover links to virtual junctions.
    let is_virtual = |junction: &Junction<'_>| junction.kind() == Some(JunctionType::Virtual);
    if map.junction(id).is_some_and(is_virtual) {
        return;
    }
    // A contact point is often written by habit. A position indicates, in every version, that
    // another kind of junction or another link is intended.
    let before = found.version() < Some(Version::new(1, 7));
    for name in ["contactPoint", "elementS", "elementDir"] {
        let level = match name {
            "contactPoint" => Level::Warning,
            _ if before => Level::Error,
            _ => Level::Warning,
        };
        if let Some(attribute) = link.node().attribute(name) {
            let text = format!(
                "the link to junction `{id}` has the attribute `{name}`, which is only for links to roads; links \
                 to junctions have `elementType` and `elementId`"
            );
            found.issue(attribute, text).level(level);
        }
    }
}
