//! Lane numbers as references: lane links between sections and roads, lane links of junctions.

use std::collections::HashMap;

use qcbus_document::{Document, Node};
use qcbus_sdk::{Place, Sink};

/// Which end of a road or of a link.
#[derive(Clone, Copy, PartialEq, Eq)]
enum End {
    Start,
    End,
}

/// Reports lane numbers that lead to no lane. Where the road that is linked does not exist either,
/// that is reported elsewhere.
pub(crate) fn check(document: &Document<'_>, found: &mut Sink<'_>) {
    let roads = document
        .elements("road")
        .filter(|road| road.parent().is_some_and(|p| p.is("OpenDRIVE")));
    let roads: Vec<Node<'_>> = roads.collect();
    let by_id = roads
        .iter()
        .filter_map(|road| Some((road.attr("id")?, *road)));
    let by_id: HashMap<&str, Node<'_>> = by_id.collect();
    for road in &roads {
        lanes_of_road(*road, &by_id, found);
    }
    for link in document.elements("laneLink") {
        lane_link(link, &by_id, found);
    }
}

/// Links between the lanes of neighbouring sections, and over the ends of the road.
fn lanes_of_road(road: Node<'_>, by_id: &HashMap<&str, Node<'_>>, found: &mut Sink<'_>) {
    let sections = sections(road);
    for (index, section) in sections.iter().enumerate() {
        for (name, end) in [("predecessor", End::Start), ("successor", End::End)] {
            let neighbour = match end {
                End::Start => index
                    .checked_sub(1)
                    .and_then(|before| sections.get(before))
                    .copied(),
                End::End => sections.get(index + 1).copied(),
            };
            let neighbour = neighbour.or_else(|| linked_section(road, name, by_id));
            let Some(neighbour) = neighbour else { continue };
            for lane in lanes(*section) {
                let links = lane
                    .child("link")
                    .into_iter()
                    .flat_map(|link| link.children_named(name));
                for link in links {
                    demand_lane(link, "id", neighbour, found);
                }
            }
        }
    }
}

/// The lane section of the linked road at which a link of `road` arrives, if it is a road.
fn linked_section<'d>(
    road: Node<'d>,
    name: &str,
    by_id: &HashMap<&str, Node<'d>>,
) -> Option<Node<'d>> {
    let link = road.child("link")?.child(name)?;
    let other = by_id.get(
        link.attr("elementId")
            .filter(|_| link.attr("elementType") == Some("road"))?,
    )?;
    section_at(*other, end_of(link.attr("contactPoint")?)?)
}

/// `from` must be a lane of the incoming road, `to` one of the connecting or linked road.
fn lane_link(link: Node<'_>, by_id: &HashMap<&str, Node<'_>>, found: &mut Sink<'_>) {
    let Some(connection) = link.parent().filter(|parent| parent.is("connection")) else {
        return;
    };
    let named = |attribute: &str| {
        connection
            .attr(attribute)
            .and_then(|id| by_id.get(id))
            .copied()
    };
    let junction = connection.parent().and_then(|junction| junction.attr("id"));
    if let Some(other) = named("connectingRoad").or_else(|| named("linkedRoad"))
        && let Some(section) = connection
            .attr("contactPoint")
            .and_then(end_of)
            .and_then(|end| section_at(other, end))
    {
        demand_lane(link, "to", section, found);
    }
    if let Some(incoming) = named("incomingRoad")
        && let Some(section) =
            end_at_junction(incoming, junction).and_then(|end| section_at(incoming, end))
    {
        demand_lane(link, "from", section, found);
    }
}

/// The end at which a road meets the junction; `None` when it is neither or both.
fn end_at_junction(road: Node<'_>, junction: Option<&str>) -> Option<End> {
    let meets = |name: &str| {
        let link = road.child("link").and_then(|link| link.child(name));
        link.is_some_and(|l| {
            l.attr("elementType") == Some("junction") && l.attr("elementId") == junction
        })
    };
    match (meets("predecessor"), meets("successor")) {
        (true, false) => Some(End::Start),
        (false, true) => Some(End::End),
        _ => None,
    }
}

fn demand_lane(link: Node<'_>, attribute: &str, section: Node<'_>, found: &mut Sink<'_>) {
    let Some(id) = link.attr(attribute) else {
        return;
    };
    let mut ids = lanes(section).filter_map(|lane| lane.attr("id"));
    // Lane ids are whole numbers: `-1` and ` -01` are one lane.
    let number = |text: &str| text.trim().parse::<i64>().ok();
    if ids.any(|other| other == id || (number(id).is_some() && number(other) == number(id))) {
        return;
    }
    let text = format!(
        "`{attribute}=\"{id}\"` of `{}` refers to a lane that the lane section it leads to does not have",
        link.name()
    );
    found
        .issue(Place::attribute_or_node(link, attribute), text)
        .at(section, "the lane section without such a lane");
}

fn end_of(contact_point: &str) -> Option<End> {
    match contact_point {
        "start" => Some(End::Start),
        "end" => Some(End::End),
        _ => None,
    }
}

fn section_at(road: Node<'_>, end: End) -> Option<Node<'_>> {
    let sections = sections(road);
    match end {
        End::Start => sections.first().copied(),
        End::End => sections.last().copied(),
    }
}

/// In the order of `s`, which decides which sections meet, whatever the order of the file. Several
/// layers of lanes share their sections' positions; then nothing is said.
fn sections(road: Node<'_>) -> Vec<Node<'_>> {
    let layers: Vec<Node<'_>> = road.children_named("lanes").collect();
    let [lanes] = layers.as_slice() else {
        return Vec::new();
    };
    if lanes
        .child("laneSection")
        .is_some_and(|section| section.attribute("layer").is_some())
    {
        return Vec::new();
    }
    // Sections for one side only overlap others: `singleSide`.
    if lanes
        .children_named("laneSection")
        .any(|section| section.attr("singleSide") == Some("true"))
    {
        return Vec::new();
    }
    let mut sections: Vec<Node<'_>> = lanes.children_named("laneSection").collect();
    let starts = sections.iter().map(|section| section.f64("s").ok());
    // Without every `s`, the order of the file has to do.
    if starts.collect::<Option<Vec<f64>>>().is_some() {
        let start = |section: &Node<'_>| section.f64("s").unwrap_or_default();
        sections.sort_by(|one, other| start(one).total_cmp(&start(other)));
    }
    sections
}

fn lanes(section: Node<'_>) -> impl Iterator<Item = Node<'_>> {
    section
        .children()
        .flat_map(|side| side.children_named("lane"))
}
