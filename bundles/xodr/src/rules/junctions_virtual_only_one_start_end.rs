use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.9.0..",
    backport: Backport::Lower { since: "1.5.0" },
    params: &[TOLERANCE],
    run,
    ..Rule::after(READABLE)
};

const TOLERANCE: Param = Param::number(
    "tolerance",
    1e-3,
    "m",
    "largest distance beyond the ends of the main road that is accepted",
);

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let tolerance = found.number(&TOLERANCE);
    for junction in map.junctions() {
        if junction.kind() != Some(JunctionType::Virtual) {
            continue;
        }
        let node = junction.node();
        let main = junction.main_road().and_then(|id| map.road(id));
        for (name, s) in [("sStart", junction.s_start()), ("sEnd", junction.s_end())] {
            let Some(attribute) = node.attribute(name) else {
                let text = format!(
                    "virtual junction `{}` has no `{name}`; it must have one `sStart` and one `sEnd`",
                    junction.id()
                );
                found.issue(node, text);
                continue;
            };
            let (Some(s), Some(road), Some(length)) = (s, main, main.and_then(Road::length)) else {
                continue;
            };
            if s < -tolerance || s > length + tolerance {
                let text = format!(
                    "`{name}` is {s}, but the main road `{}` extends from s = 0 to s = {length}; the junction \
                     must lie on it",
                    road.id()
                );
                found
                    .issue(attribute, text)
                    .in_every_version(Level::Error)
                    .road(road.id(), s, 0.0);
            }
        }
        if let (Some(start), Some(end)) = (junction.s_start(), junction.s_end())
            && start > end
        {
            let text = format!(
                "the virtual junction ends at s = {end}, before it starts at s = {start}; `sStart` must not be \
                 greater than `sEnd`"
            );
            found
                .issue(Place::attribute_or_node(node, "sEnd"), text)
                .in_every_version(Level::Error)
                .at(
                    Place::attribute_or_node(node, "sStart"),
                    "the start of the virtual junction",
                );
        }
    }
}
