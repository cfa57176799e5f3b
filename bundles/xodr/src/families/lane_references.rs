//! Lane numbers as references: lane links between sections and roads, lane links of junctions.

use std::cell::OnceCell;

use qcbus_document::Node;
use qcbus_opendrive::{ContactPoint, LaneJoint, MapPart, RoadMap};
use qcbus_sdk::{Place, Sink};

/// Which end of a road or of a link.
#[derive(Clone, Copy, PartialEq, Eq)]
enum End {
    Start,
    End,
}

/// The roads of a file with their lane sections, which are read when somebody asks.
struct Roads<'m, 'd> {
    map: &'m RoadMap<'d>,
    sections: Vec<OnceCell<Vec<Section<'d>>>>,
}

/// A road by its place in the map.
#[derive(Clone, Copy)]
struct Road<'d> {
    place: usize,
    node: Node<'d>,
}

struct Section<'d> {
    node: Node<'d>,
    lanes: Vec<Lane<'d>>,
}

struct Lane<'d> {
    id: Option<&'d str>,
    link: Option<Node<'d>>,
}

impl<'m, 'd> Roads<'m, 'd> {
    fn of(map: &'m RoadMap<'d>) -> Roads<'m, 'd> {
        let sections = map.roads().iter().map(|_| OnceCell::new()).collect();
        Roads { map, sections }
    }

    fn get(&self, id: &str) -> Option<Road<'d>> {
        let road = self.map.roads_with_id(id).last()?;
        Some(Road {
            place: road.index(),
            node: road.node(),
        })
    }

    fn sections(&self, road: Road<'d>) -> &[Section<'d>] {
        let read = || sections(road.node).into_iter().map(Section::of).collect();
        let slot = self.sections.get(road.place);
        slot.map_or(&[], |slot| slot.get_or_init(read).as_slice())
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

/// Reports numbers in the links of lanes that lead to no lane. Where the road that is linked does
/// not exist either, that is reported elsewhere.
pub(crate) fn of_lanes(part: MapPart<'_, '_>, found: &mut Sink<'_>) {
    let map = part.map();
    let all = OnceCell::new();
    for road in part.roads() {
        // Links that lead to a lane are known, which are most; the others are looked at.
        let is_known = among(map.joints_of(road));
        let lanes = || road.sections().flat_map(|section| section.lanes());
        let mut links = lanes().flat_map(|lane| ContactPoint::BOTH.map(|end| lane.links(end)));
        if links.any(|mut links| links.any(|link| !is_known(link.node()))) {
            let place = road.index();
            let node = road.node();
            let roads = all.get_or_init(|| Roads::of(map));
            lanes_of_road(Road { place, node }, roads, found);
        }
    }
}

/// The same for the lane links of junctions.
pub(crate) fn of_junctions(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let roads = Roads::of(map);
    let is_known = among(map.junction_joints());
    let document = map.root().map(|root| root.document());
    for link in document
        .iter()
        .flat_map(|document| document.elements("laneLink"))
    {
        if !is_known(link) {
            lane_link(link, &roads, found);
        }
    }
}

/// Whether a link is one of those that lead to a lane.
fn among(joints: &[LaneJoint<'_>]) -> impl Fn(Node<'_>) -> bool {
    let mut known: Vec<u32> = joints.iter().map(|one| one.node.index()).collect();
    known.sort_unstable();
    move |link| known.binary_search(&link.index()).is_ok()
}

/// Links between the lanes of neighbouring sections, and over the ends of the road.
fn lanes_of_road<'d>(road: Road<'d>, roads: &Roads<'_, 'd>, found: &mut Sink<'_>) {
    let sections = roads.sections(road);
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
    roads: &'r Roads<'_, 'd>,
) -> Option<&'r Section<'d>> {
    let link = road.child("link")?.child(name)?;
    let other = roads.get(
        link.attr("elementId")
            .filter(|_| link.attr("elementType") == Some("road"))?,
    )?;
    section_at(roads.sections(other), end_of(link.attr("contactPoint")?)?)
}

/// `from` must be a lane of the incoming road, `to` one of the connecting or linked road.
fn lane_link<'d>(link: Node<'d>, roads: &Roads<'_, 'd>, found: &mut Sink<'_>) {
    let Some(connection) = link.parent().filter(|parent| parent.is("connection")) else {
        return;
    };
    let named = |attribute: &str| connection.attr(attribute).and_then(|id| roads.get(id));
    let junction = connection.parent().and_then(|junction| junction.attr("id"));
    if let Some(other) = named("connectingRoad").or_else(|| named("linkedRoad"))
        && let Some(section) = connection
            .attr("contactPoint")
            .and_then(end_of)
            .and_then(|end| section_at(roads.sections(other), end))
    {
        demand_lane(link, "to", section, found);
    }
    if let Some(incoming) = named("incomingRoad")
        && let Some(section) = end_at_junction(incoming.node, junction)
            .and_then(|end| section_at(roads.sections(incoming), end))
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

fn section_at<'r, 'd>(sections: &'r [Section<'d>], end: End) -> Option<&'r Section<'d>> {
    match end {
        End::Start => sections.first(),
        End::End => sections.last(),
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
