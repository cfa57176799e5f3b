use crate::prelude::*;
use qcbus_opendrive::LaneLayer;

pub const RULE: Rule<Roads> = Rule {
    readers: Some(Readers::warning(
        "readers ignore lane links where the road has none, except those of connecting roads",
    )),
    versions: "1.1.0..",
    each: Some(each),
    ..Rule::after(READABLE)
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for road in map.part(part).roads() {
        for end in ContactPoint::BOTH {
            if let Some(why) = nothing_to_link(map, road, end) {
                let temporary = |layer: &&LaneLayer<'_>| layer.kind() == LayerKind::Temporary;
                let temporary = road.layers().iter().filter(temporary);
                for layer in road.permanent().into_iter().chain(temporary) {
                    check(road, layer, (end, &why), found);
                }
            }
        }
    }
}

/// Returns the reason why lanes have no target for a link at an end of a road, or `None`.
fn nothing_to_link(map: &RoadMap<'_>, road: &Road<'_>, end: ContactPoint) -> Option<String> {
    let Some(link) = road.link(end) else {
        let here = RoadEnd::of(road, end);
        // If other roads state that they touch this end, the link of the road is missing.
        let is_touched = map.contacts_of(here).next().is_some();
        return (!is_touched).then(|| {
            format!(
                "the road itself has no {} and leads nowhere",
                end.link_name()
            )
        });
    };
    let id = link.junction_id()?;
    let is_virtual = |junction: &Junction<'_>| junction.kind() == Some(JunctionType::Virtual);
    let is_cut = !map.junction(id).is_some_and(is_virtual);
    is_cut.then(|| {
        format!("junction `{id}` lies there, and its connections define which lanes follow")
    })
}

fn check<'a>(
    road: &Road<'a>,
    layer: &LaneLayer<'a>,
    (end, why): (ContactPoint, &str),
    found: &mut Sink<'_>,
) {
    let is_temporary = layer.kind() == LayerKind::Temporary;
    let sections = Side::BOTH.into_iter().filter_map(|side| {
        let section = layer.end_section(road, side, end)?;
        let reaches = !is_temporary || reaches(road, section, (side, end));
        reaches.then(|| section.side(side))
    });
    let links = sections.flatten().filter_map(|lane| {
        // A link from a temporary lane to a permanent one may refer to the same road.
        let mut links = lane.links(end);
        let link =
            links.find(|link| !is_temporary || link.node().attr("layer") == Some("temporary"))?;
        Some((lane, link))
    });
    let links: Vec<_> = links.collect();
    let Some((_, first)) = links.first() else {
        return;
    };
    let lanes: Vec<&str> = links
        .iter()
        .filter_map(|(lane, _)| lane.id_text())
        .collect();
    let what = match (is_temporary, lanes.len()) {
        (true, 1) => "the temporary lane",
        (true, _) => "the temporary lanes",
        (false, 1) => "lane",
        (false, _) => "the lanes",
    };
    let text = format!(
        "{what} {} of road `{}` {} a {} at its {end}, but {why}; such links must be omitted",
        lanes.join(", "),
        road.id(),
        if lanes.len() == 1 { "has" } else { "have" },
        end.link_name()
    );
    let mut finding = found.issue(first.node(), text);
    // The connections of a junction do not help at the ends of its own roads.
    if road.junction().is_some() && road.link(end).is_none() {
        finding = finding.readers_level(Level::Error);
    }
    if let Some(s) = road.end_s(end) {
        finding.road(road.id(), s, 0.0);
    }
}

/// Checks whether a section reaches an end of its road.
fn reaches(
    road: &Road<'_>,
    section: SectionRef<'_, '_>,
    (side, end): (Side, ContactPoint),
) -> bool {
    const SAME: f64 = 1e-3;
    let own = match end {
        ContactPoint::Start => section.s(),
        ContactPoint::End => section.end(side),
    };
    let of_road = road.end_s(end);
    own.zip(of_road)
        .is_some_and(|(own, end)| (own - end).abs() <= SAME)
}
