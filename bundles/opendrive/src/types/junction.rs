//! Junctions of all types (OpenDRIVE 1.9, chapter 12).

use std::sync::OnceLock;

use qcbus_document::Node;

use crate::types::junction_area::{Boundary, ElevationGrid};
use crate::types::plan_view::PlanView;
use crate::types::value::{ContactPoint, number};
use crate::types::view::{children, view};

/// The types of junction.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum JunctionType {
    /// `default`, also the meaning of a missing `@type`: a common junction (12.2).
    Common,
    /// `direct` (12.6).
    Direct,
    /// `virtual` (12.7).
    Virtual,
    /// `crossing` (12.8).
    Crossing,
}

impl JunctionType {
    /// Returns the word of the standard for `@type`.
    pub fn as_str(self) -> &'static str {
        match self {
            JunctionType::Common => "default",
            JunctionType::Direct => "direct",
            JunctionType::Virtual => "virtual",
            JunctionType::Crossing => "crossing",
        }
    }
}

/// One `<junction>`.
#[derive(Debug)]
pub struct Junction<'a> {
    node: Node<'a>,
    index: u32,
    id: &'a str,
    kind: Option<JunctionType>,
    plan_view: OnceLock<PlanView<'a>>,
}

impl<'a> Junction<'a> {
    pub(crate) fn read(node: Node<'a>, index: u32) -> Junction<'a> {
        let kind = match node.attr("type") {
            None | Some("default") => Some(JunctionType::Common),
            Some("direct") => Some(JunctionType::Direct),
            Some("virtual") => Some(JunctionType::Virtual),
            Some("crossing") => Some(JunctionType::Crossing),
            Some(_) => None,
        };
        Junction {
            node,
            index,
            id: node.attr("id").unwrap_or(""),
            kind,
            plan_view: OnceLock::new(),
        }
    }

    /// Returns the `<junction>` element.
    pub fn node(&self) -> Node<'a> {
        self.node
    }

    /// Returns the place among the junctions of the map.
    pub fn index(&self) -> usize {
        self.index as usize
    }

    /// Returns `@id`, or an empty string if it is missing.
    pub fn id(&self) -> &'a str {
        self.id
    }

    /// Returns `@type`, or `None` if the standard does not define the word.
    pub fn kind(&self) -> Option<JunctionType> {
        self.kind
    }

    /// Returns `@mainRoad` of a virtual junction.
    pub fn main_road(&self) -> Option<&'a str> {
        self.node.attr("mainRoad")
    }

    /// Returns `@sStart` of a virtual junction, in metres on the main road.
    pub fn s_start(&self) -> Option<f64> {
        number(self.node, "sStart")
    }

    /// Returns `@sEnd` of a virtual junction, in metres on the main road.
    pub fn s_end(&self) -> Option<f64> {
        number(self.node, "sEnd")
    }

    /// Returns the junction reference line (12.9). It is empty without `<planView>`.
    pub fn plan_view(&self) -> &PlanView<'a> {
        self.plan_view
            .get_or_init(|| PlanView::read(self.node.child("planView")))
    }

    /// Returns the `<boundary>` (12.10).
    pub fn boundary(&self) -> Option<Boundary<'a>> {
        self.node.child("boundary").map(Boundary::of)
    }

    /// Returns the first `<elevationGrid>` (12.11).
    pub fn elevation_grid(&self) -> Option<ElevationGrid<'a>> {
        self.elevation_grids().next()
    }

    children! {
        /// The connections.
        connections: Connection "connection",
        /// The `<priority>` records (12.4).
        priorities: Priority "priority",
        /// The `<controller>` records of the junction (12.14).
        controllers: JunctionController "controller",
        /// The cross paths (12.5).
        cross_paths: CrossPath "crossPath",
        /// The road sections of a crossing (12.8).
        road_sections: RoadSection "roadSection",
        /// All elevation grids. The standard allows one.
        elevation_grids: ElevationGrid "elevationGrid",
    }
}

view! {
    /// A `<connection>` of a junction.
    Connection {
        /// `@id`.
        id: text "id",
        /// `@type`: `default` or `virtual`.
        kind: text "type",
        /// `@incomingRoad`.
        incoming_road: text "incomingRoad",
        /// `@connectingRoad`, for all junctions except direct ones.
        connecting_road: text "connectingRoad",
        /// `@linkedRoad`, for direct junctions.
        linked_road: text "linkedRoad",
        /// `@contactPoint`: the end of the connecting or linked road.
        contact_point: contact "contactPoint",
    }
}

impl<'a> Connection<'a> {
    /// Checks whether this is a virtual connection (12.7).
    pub fn is_virtual(&self) -> bool {
        self.kind() == Some("virtual")
    }

    /// Returns the road that the incoming road leads to: the connecting road, else the linked road.
    pub fn target_road(&self) -> Option<&'a str> {
        self.connecting_road().or(self.linked_road())
    }

    children! {
        /// The lane links.
        lane_links: JunctionLaneLink "laneLink",
    }
}

view! {
    /// A `<laneLink>` of a connection (12.4, 12.6).
    JunctionLaneLink {
        /// `@from`: a lane of the incoming road.
        from: integer "from",
        /// `@to`: a lane of the connecting or linked road.
        to: integer "to",
        /// `@fromLayer`; permanent when missing.
        from_layer: layer "fromLayer",
        /// `@toLayer`; permanent when missing.
        to_layer: layer "toLayer",
    }
}

view! {
    /// A `<priority>` of a junction (12.4).
    Priority {
        /// `@high`: the road with priority.
        high: text "high",
        /// `@low`: the road that gives way.
        low: text "low",
    }
}

view! {
    /// A `<controller>` within a junction (12.14).
    JunctionController {
        /// `@id` of the signal controller.
        id: text "id",
    }
}

view! {
    /// A `<crossPath>` (12.5).
    CrossPath {
        /// `@crossingRoad`.
        crossing_road: text "crossingRoad",
        /// `@roadAtStart`.
        road_at_start: text "roadAtStart",
        /// `@roadAtEnd`.
        road_at_end: text "roadAtEnd",
    }
}

impl<'a> CrossPath<'a> {
    /// Returns `<startLaneLink>` or `<endLaneLink>`.
    pub fn lane_link(&self, end: ContactPoint) -> Option<CrossPathLaneLink<'a>> {
        let name = match end {
            ContactPoint::Start => "startLaneLink",
            ContactPoint::End => "endLaneLink",
        };
        self.node.child(name).map(CrossPathLaneLink::of)
    }

    /// Returns the id of the road at this end of the crossing road.
    pub fn road_at(&self, end: ContactPoint) -> Option<&'a str> {
        match end {
            ContactPoint::Start => self.road_at_start(),
            ContactPoint::End => self.road_at_end(),
        }
    }
}

view! {
    /// A `<startLaneLink>` or `<endLaneLink>` of a cross path (12.5).
    CrossPathLaneLink {
        /// `@from`: a lane of the crossed road.
        from: integer "from",
        /// `@to`: a lane of the crossing road.
        to: integer "to",
        /// `@s`: the place on the crossed road, in metres.
        s: number "s",
    }
}

view! {
    /// A `<roadSection>` of a crossing (12.8).
    RoadSection {
        /// `@roadId`.
        road_id: text "roadId",
        /// `@sStart`, in metres.
        s_start: number "sStart",
        /// `@sEnd`, in metres.
        s_end: number "sEnd",
    }
}
