use crate::families::virtual_links;
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.7.0..",
    backport: Backport::Lower { since: "1.5.0" },
    params: &[TOLERANCE],
    each: Some(each),
    ..Rule::after(READABLE)
};

const TOLERANCE: Param = Param::number(
    "tolerance",
    1e-3,
    "m",
    "largest distance from the ends of the main road that is accepted",
);

const DEMAND: &str = "a link into the middle of a main road must have `elementType`, `elementId`, `elementS` and \
                      `elementDir`";

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for road in map.part(part).roads() {
        for link in ContactPoint::BOTH
            .into_iter()
            .filter_map(|end| road.link(end))
        {
            if has(link, "elementS") || has(link, "elementDir") {
                if virtual_links::may_be_within(map, road) {
                    within(map, link, found);
                } else if has(link, "contactPoint") && link.element_type() == Some("road") {
                    superfluous(link, found);
                } else {
                    beyond(map, link, found);
                }
            } else if virtual_links::leads_to_main_road(map, road, link) {
                at_an_end(map, road, link, found);
            }
        }
    }
}

fn has(link: RoadLink<'_>, name: &str) -> bool {
    link.node().attribute(name).is_some()
}

/// Reports `elementS` or `elementDir` beside a contact point, in a link of a road without any
/// relation to virtual junctions. Such a link refers to the contact point.
fn superfluous(link: RoadLink<'_>, found: &mut Sink<'_>) {
    for attribute in ["elementS", "elementDir"] {
        let Some(attribute) = link.node().attribute(attribute) else {
            continue;
        };
        let text = format!(
            "the link has `{}`, which is for links into the middle of the main road of a virtual junction; this \
             link leads to an end of a road and only needs `contactPoint`",
            attribute.name()
        );
        found.issue(attribute, text).level(Level::Information);
    }
}

/// Checks a link with `elementS` or `elementDir`.
fn within(map: &RoadMap<'_>, link: RoadLink<'_>, found: &mut Sink<'_>) {
    // At a common junction both attributes are wrong. Another rule reports this.
    let junction = link.junction_id().and_then(|id| map.junction(id));
    if junction.is_some_and(|junction| junction.kind() != Some(JunctionType::Virtual)) {
        return;
    }
    for name in ["elementS", "elementDir", "elementId"] {
        if !has(link, name) {
            found.issue(link.node(), format!("the link has no `{name}`; {DEMAND}"));
        }
    }
    if let Some(contact) = link.node().attribute("contactPoint") {
        let text = format!(
            "the link has `contactPoint` in addition to `elementS` or `elementDir`; it must lead either to an \
             end of the road or to a place within it; {DEMAND}"
        );
        found.issue(contact, text);
    }
    beyond(map, link, found);
}

fn beyond(map: &RoadMap<'_>, link: RoadLink<'_>, found: &mut Sink<'_>) {
    let tolerance = found.number(&TOLERANCE);
    let Some(road) = link.road_id().and_then(|id| map.road(id)) else {
        return;
    };
    let (Some(s), Some(length)) = (link.element_s(), road.length()) else {
        return;
    };
    if s < -tolerance || s > length + tolerance {
        let text = format!(
            "elementS is {s}, but road `{}` extends from s = 0 to s = {length}; the link must lead to a place on \
             it",
            road.id()
        );
        // The position does not exist, so this is an error in every version.
        found
            .issue(Place::attribute_or_node(link.node(), "elementS"), text)
            .in_every_version(Level::Error)
            .road(road.id(), s, 0.0);
    }
}

/// Checks a link of a road in a virtual junction to an end of the main road. It is legal only if
/// the junction itself lies there.
fn at_an_end(map: &RoadMap<'_>, road: &Road<'_>, link: RoadLink<'_>, found: &mut Sink<'_>) {
    let tolerance = found.number(&TOLERANCE);
    let junction = map.junction_of(road);
    let main = link.road_id().and_then(|id| map.road(id));
    if let (Some(junction), Some(main), Some(end)) = (junction, main, link.contact_point()) {
        let touches = |s: Option<f64>| {
            let place = main.end_s(end).zip(s);
            place.is_none_or(|(end, s)| (end - s).abs() <= tolerance)
        };
        if touches(junction.s_start()) || touches(junction.s_end()) {
            return;
        }
    }
    let text = format!(
        "road `{}` of a virtual junction is linked to its main road without a position; {DEMAND}",
        road.id()
    );
    found.issue(link.node(), text);
}
