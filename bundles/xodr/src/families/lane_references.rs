//! Lane numbers as references: lane links between sections and roads, lane links of junctions.

use foldhash::HashMap;
use qcbus_document::{Document, Node};
use qcbus_sdk::{Place, Sink};

/// Which end of a road or of a link.
#[derive(Clone, Copy, PartialEq, Eq)]
enum End {
    Start,
    End,
}

/// The roads of a file with their lane sections.
struct Roads<'d> {
    roads: Vec<Road<'d>>,
    by_id: HashMap<&'d str, usize>,
}

struct Road<'d> {
    node: Node<'d>,
    sections: Vec<Section<'d>>,
}

struct Section<'d> {
    node: Node<'d>,
    lanes: Vec<Lane<'d>>,
}

struct Lane<'d> {
    id: Option<&'d str>,
    link: Option<Node<'d>>,
}

impl<'d> Roads<'d> {
    fn of(document: &Document<'d>) -> Roads<'d> {
        let roads = document
            .elements("road")
            .filter(|road| road.parent().is_some_and(|p| p.is("OpenDRIVE")));
        let roads = roads.map(|node| Road {
            node,
            sections: sections(node).into_iter().map(Section::of).collect(),
        });
        let roads: Vec<Road<'d>> = roads.collect();
        let ids = roads.iter().enumerate();
        let ids = ids.filter_map(|(at, road)| Some((road.node.attr("id")?, at)));
        let by_id = ids.collect();
        Roads { roads, by_id }
    }

    fn get(&self, id: &str) -> Option<&Road<'d>> {
        self.roads.get(*self.by_id.get(id)?)
    }
}

impl<'d> Section<'d> {
    fn of(node: Node<'d>) -> Section<'d> {
        let lanes = node
            .children()
            .flat_map(|side| side.children_named("lane"))
            .map(|lane| Lane {
                id: lane.attr("id"),
                link: lane.child("link"),
            });
        Section {
            node,
            lanes: lanes.collect(),
        }
    }
}

/// Reports lane numbers that lead to no lane. Where the road that is linked does not exist either,
/// that is reported elsewhere.
pub(crate) fn check(document: &Document<'_>, found: &mut Sink<'_>) {
    let roads = Roads::of(document);
    for road in &roads.roads {
        lanes_of_road(road, &roads, found);
    }
    for link in document.elements("laneLink") {
        lane_link(link, &roads, found);
    }
}

/// Links between the lanes of neighbouring sections, and over the ends of the road.
fn lanes_of_road(road: &Road<'_>, roads: &Roads<'_>, found: &mut Sink<'_>) {
    let sections = &road.sections;
    for (index, section) in sections.iter().enumerate() {
        for (name, end) in [("predecessor", End::Start), ("successor", End::End)] {
            let neighbour = match end {
                End::Start => index.checked_sub(1).and_then(|before| sections.get(before)),
                End::End => sections.get(index + 1),
            };
            let neighbour = neighbour.or_else(|| linked_section(road.node, name, roads));
            let Some(neighbour) = neighbour else { continue };
            for lane in &section.lanes {
                let links = lane
                    .link
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
fn linked_section<'r, 'd>(
    road: Node<'d>,
    name: &str,
    roads: &'r Roads<'d>,
) -> Option<&'r Section<'d>> {
    let link = road.child("link")?.child(name)?;
    let other = roads.get(
        link.attr("elementId")
            .filter(|_| link.attr("elementType") == Some("road"))?,
    )?;
    section_at(other, end_of(link.attr("contactPoint")?)?)
}

/// `from` must be a lane of the incoming road, `to` one of the connecting or linked road.
fn lane_link(link: Node<'_>, roads: &Roads<'_>, found: &mut Sink<'_>) {
    let Some(connection) = link.parent().filter(|parent| parent.is("connection")) else {
        return;
    };
    let named = |attribute: &str| connection.attr(attribute).and_then(|id| roads.get(id));
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
            end_at_junction(incoming.node, junction).and_then(|end| section_at(incoming, end))
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

fn demand_lane(link: Node<'_>, attribute: &str, section: &Section<'_>, found: &mut Sink<'_>) {
    let Some(id) = link.attr(attribute) else {
        return;
    };
    let mut ids = section.lanes.iter().filter_map(|lane| lane.id);
    // Lane ids are whole numbers: `-1` and ` -01` are one lane.
    let number = |text: &str| text.trim().parse::<i64>().ok();
    let is_there = ids.clone().any(|other| other == id)
        || number(id).is_some_and(|id| ids.any(|other| number(other) == Some(id)));
    if is_there {
        return;
    }
    let text = format!(
        "`{attribute}=\"{id}\"` of `{}` refers to a lane that the lane section it leads to does not have",
        link.name()
    );
    found
        .issue(Place::attribute_or_node(link, attribute), text)
        .at(section.node, "the lane section without such a lane");
}

fn end_of(contact_point: &str) -> Option<End> {
    match contact_point {
        "start" => Some(End::Start),
        "end" => Some(End::End),
        _ => None,
    }
}

fn section_at<'r, 'd>(road: &'r Road<'d>, end: End) -> Option<&'r Section<'d>> {
    match end {
        End::Start => road.sections.first(),
        End::End => road.sections.last(),
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
