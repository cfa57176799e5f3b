use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.9.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for (junction, connection) in map.connections() {
        if junction.kind() != Some(JunctionType::Virtual) || connection.is_virtual() {
            continue;
        }
        let Some(main) = junction.main_road() else {
            continue;
        };
        let connecting = connection.connecting_road().and_then(|id| map.road(id));
        let Some(road) = connecting.filter(|_| connection.incoming_road() != Some(main)) else {
            continue;
        };
        // A road without links at both ends may be incomplete.
        let ends = ContactPoint::BOTH.map(|end| road.link(end).and_then(|link| link.road_id()));
        if let [Some(start), Some(end)] = ends
            && ![start, end].contains(&main)
        {
            let text = format!(
                "connecting road `{}` of virtual junction `{}` leads from road `{start}` to road `{end}`; \
                 virtual junctions must only be used for branches off the main road `{main}`",
                road.id(),
                junction.id()
            );
            found
                .issue(connection.node(), text)
                .at(road.node(), "the connecting road");
        }
    }
}
