use crate::families::faults::OfFault as _;
use crate::families::on_road::OnRoad;
use crate::families::routes::{NARROW, lanes_at, routes_at};
use crate::prelude::*;
use foldhash::HashSet;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.1.0..",
    params: &[NARROW],
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let mut seen = HashSet::default();
    for (junction, connection) in map.connections() {
        if junction.kind() != Some(JunctionType::Common) || connection.is_virtual() {
            continue;
        }
        let connecting = connection.connecting_road().and_then(|id| map.road(id));
        let inside = connecting.filter(|road| road.junction() == Some(junction.id()));
        let Some(road) = inside.filter(|road| seen.insert(road.index())) else {
            continue;
        };
        for end in ContactPoint::BOTH {
            if let Some(link) = leads_inside(road, junction, end, found.number(&NARROW)) {
                let text = format!(
                    "the {} of the connecting road `{}` is junction `{}`, to which the road itself belongs; it must \
                     be the road that follows at its {end}, otherwise routes end inside the junction",
                    end.link_name(),
                    road.id(),
                    junction.id()
                );
                found
                    .issue(link.node(), text)
                    .at_end(road, end)
                    .at(connection.node(), "the connection that uses the road")
                    .of_junction(junction.node());
                continue;
            }
            let enters = connection.contact_point() == Some(end);
            if is_open(road, end, found.number(&NARROW)) && (enters || !has_lane_links(road, end)) {
                let text = format!(
                    "the connecting road `{}` of junction `{}` has no {}, so the road that it joins at its {end} \
                     is undefined; a connecting road must be linked at both ends",
                    road.id(),
                    junction.id(),
                    end.link_name()
                );
                // A link is required where traffic enters. At the other end, a road may have been
                // left out.
                let known = connection.incoming_road().and_then(|id| map.road(id));
                let level = if enters && known.is_some() {
                    Level::Error
                } else {
                    Level::Warning
                };
                found
                    .issue(road.link_node().unwrap_or(road.node()), text)
                    .level(level)
                    .at_end(road, end)
                    .at(connection.node(), "the connection that uses the road")
                    .of_junction(junction.node());
            }
        }
    }
}

/// Returns the link at an end with traffic if it leads to the junction of the road itself.
fn leads_inside<'a>(
    road: &Road<'a>,
    junction: &Junction<'a>,
    end: ContactPoint,
    narrow: f64,
) -> Option<RoadLink<'a>> {
    let link = road.link(end)?;
    let is_inside = link.junction_id() == Some(junction.id());
    (is_inside && routes_at(road, end, narrow).next().is_some()).then_some(link)
}

/// Checks whether traffic reaches an end of a road that has no link.
fn is_open(road: &Road<'_>, end: ContactPoint, narrow: f64) -> bool {
    road.link(end).is_none() && routes_at(road, end, narrow).next().is_some()
}

/// Checks for lane links at an end of a road without a link, which another rule reports.
fn has_lane_links(road: &Road<'_>, end: ContactPoint) -> bool {
    lanes_at(road, end).any(|lane| lane.links(end).next().is_some())
}
