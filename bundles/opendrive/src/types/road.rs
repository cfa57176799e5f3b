//! Roads (OpenDRIVE 1.9, chapter 10).

use std::sync::{Arc, OnceLock};

use qcbus_document::Node;

use crate::geometry::Pose;
use crate::types::contacts::{LaneJoint, RoadEnd, TouchingLanes};
use crate::types::frame::Frame;
use crate::types::lane_section::LaneLayer;
use crate::types::lateral::LateralProfile;
use crate::types::names::Names;
use crate::types::plan_view::{END_TOLERANCE, PlanView};
use crate::types::profile::Profile;
use crate::types::station::Station;
use crate::types::value::{ContactPoint, LayerKind, known, number};
use crate::types::view::view;

/// Side of the road for traffic (`road@rule`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum TrafficRule {
    /// Right-hand traffic, also the meaning of a missing `@rule`.
    RightHand,
    /// Left-hand traffic.
    LeftHand,
}

/// One `<road>`. Its own attributes are read at once, its content on first use.
#[derive(Debug)]
pub struct Road<'a> {
    node: Node<'a>,
    index: u32,
    id: &'a str,
    length: f64,
    junction: Option<&'a str>,
    rule: Option<TrafficRule>,
    children: RoadChildren<'a>,
    plan_view: OnceLock<PlanView<'a>>,
    elevation: OnceLock<Profile<'a>>,
    lateral: OnceLock<LateralProfile<'a>>,
    layers: OnceLock<Box<[LaneLayer<'a>]>>,
    names: Arc<Names>,
    /// Cross sections at the start and at the end, computed on first use.
    end_frames: [OnceLock<Option<Frame>>; 2],
    /// Joints from the links of its lanes, then the touching lanes, both computed on first use.
    pub(crate) joints: OnceLock<Box<[LaneJoint<'a>]>>,
    pub(crate) touching: OnceLock<Box<[TouchingLanes<'a>]>>,
}

/// The direct children of a road, found in one pass. The first of several equal ones counts.
#[derive(Debug, Clone, Copy, Default)]
struct RoadChildren<'a> {
    link: Option<Node<'a>>,
    plan_view: Option<Node<'a>>,
    elevation: Option<Node<'a>>,
    lateral: Option<Node<'a>>,
    objects: Option<Node<'a>>,
    signals: Option<Node<'a>>,
    surface: Option<Node<'a>>,
    railroad: Option<Node<'a>>,
}

impl<'a> RoadChildren<'a> {
    fn of(road: Node<'a>) -> RoadChildren<'a> {
        let mut children = RoadChildren::default();
        for child in road.children() {
            let slot = match child.name() {
                "link" => &mut children.link,
                "planView" => &mut children.plan_view,
                "elevationProfile" => &mut children.elevation,
                "lateralProfile" => &mut children.lateral,
                "objects" => &mut children.objects,
                "signals" => &mut children.signals,
                "surface" => &mut children.surface,
                "railroad" => &mut children.railroad,
                _ => continue,
            };
            slot.get_or_insert(child);
        }
        children
    }
}

impl<'a> Road<'a> {
    pub(crate) fn read(node: Node<'a>, index: u32, names: &Arc<Names>) -> Road<'a> {
        Road {
            node,
            index,
            id: node.attr("id").unwrap_or(""),
            length: number(node, "length").unwrap_or(f64::NAN),
            junction: node.attr("junction"),
            rule: match node.attr("rule") {
                None | Some("RHT") => Some(TrafficRule::RightHand),
                Some("LHT") => Some(TrafficRule::LeftHand),
                Some(_) => None,
            },
            children: RoadChildren::of(node),
            plan_view: OnceLock::new(),
            elevation: OnceLock::new(),
            lateral: OnceLock::new(),
            layers: OnceLock::new(),
            names: Arc::clone(names),
            end_frames: [OnceLock::new(), OnceLock::new()],
            joints: OnceLock::new(),
            touching: OnceLock::new(),
        }
    }

    /// Returns the `<road>` element.
    #[inline]
    pub fn node(&self) -> Node<'a> {
        self.node
    }

    /// Returns the place among the roads of the map.
    #[inline]
    pub fn index(&self) -> usize {
        self.index as usize
    }

    /// Returns `@id`, or an empty string if it is missing.
    #[inline]
    pub fn id(&self) -> &'a str {
        self.id
    }

    /// Returns `@length`, in metres.
    #[inline]
    pub fn length(&self) -> Option<f64> {
        known(self.length)
    }

    /// Returns the id of the junction of the road. Returns `None` if it belongs to no junction
    /// (`-1`, empty or no attribute).
    #[inline]
    pub fn junction(&self) -> Option<&'a str> {
        self.junction
            .filter(|id| *id != "-1" && !id.trim().is_empty())
    }

    /// Returns `@rule`, or `None` if the standard does not define the word.
    #[inline]
    pub fn traffic_rule(&self) -> Option<TrafficRule> {
        self.rule
    }

    /// Returns the `<link>` element.
    pub fn link_node(&self) -> Option<Node<'a>> {
        self.children.link
    }

    /// Returns the link at an end: `<predecessor>` at the start, `<successor>` at the end.
    #[inline]
    pub fn link(&self, end: ContactPoint) -> Option<RoadLink<'a>> {
        let node = self.children.link?.child(end.link_name())?;
        Some(RoadLink::of(node))
    }

    /// Returns the `<planView>` element.
    pub fn plan_view_node(&self) -> Option<Node<'a>> {
        self.children.plan_view
    }

    /// Returns the `<elevationProfile>` element.
    pub fn elevation_node(&self) -> Option<Node<'a>> {
        self.children.elevation
    }

    /// Returns the `<lateralProfile>` element.
    pub fn lateral_node(&self) -> Option<Node<'a>> {
        self.children.lateral
    }

    /// Returns the `<objects>` element.
    pub fn objects_node(&self) -> Option<Node<'a>> {
        self.children.objects
    }

    /// Returns the `<signals>` element.
    pub fn signals_node(&self) -> Option<Node<'a>> {
        self.children.signals
    }

    /// Returns the `<surface>` element.
    pub fn surface_node(&self) -> Option<Node<'a>> {
        self.children.surface
    }

    /// Returns the `<railroad>` element.
    pub fn railroad_node(&self) -> Option<Node<'a>> {
        self.children.railroad
    }

    /// Returns the `<type>` records.
    pub fn types(&self) -> impl Iterator<Item = RoadType<'a>> + use<'a> {
        self.node.children_named("type").map(RoadType::of)
    }

    /// Returns the reference line.
    #[inline]
    pub fn plan_view(&self) -> &PlanView<'a> {
        self.plan_view
            .get_or_init(|| PlanView::read(self.children.plan_view))
    }

    /// Returns the elevation profile (10.5.1): z over s.
    #[inline]
    pub fn elevation(&self) -> &Profile<'a> {
        self.elevation.get_or_init(|| {
            let node = self.children.elevation.into_iter();
            let records = node.flat_map(|node| node.children_named("elevation"));
            Profile::read(records, "s")
        })
    }

    /// Returns superelevation, shape and cross section surface (10.5.2 to 10.5.4).
    #[inline]
    pub fn lateral(&self) -> &LateralProfile<'a> {
        self.lateral
            .get_or_init(|| LateralProfile::read(self.children.lateral))
    }

    /// Returns the lane layers, one per `<lanes>` element.
    #[inline]
    pub fn layers(&self) -> &[LaneLayer<'a>] {
        self.layers.get_or_init(|| {
            let lanes = self.node.children_named("lanes").enumerate();
            lanes
                .map(|(index, node)| LaneLayer::read(node, index, self.length, &self.names))
                .collect()
        })
    }

    /// Returns the first layer of this kind.
    #[inline]
    pub fn layer(&self, kind: LayerKind) -> Option<&LaneLayer<'a>> {
        self.layers().iter().find(|layer| layer.kind() == kind)
    }

    /// Returns the layer of permanent lanes.
    #[inline]
    pub fn permanent(&self) -> Option<&LaneLayer<'a>> {
        self.layer(LayerKind::Permanent)
    }

    /// Returns the pose of the reference line at `s`. Returns `None` outside of the road: more than
    /// 1 µm before the start, or beyond both `@length` and the last geometry's end.
    pub fn pose(&self, s: impl Into<Station>) -> Option<Pose> {
        let station = s.into();
        let end = match (self.length(), self.plan_view().end()) {
            (Some(length), Some(end)) => length.max(end),
            (one, other) => one.or(other)?,
        };
        let on_road = station.x() >= -END_TOLERANCE && station.x() <= end + END_TOLERANCE;
        if !on_road {
            return None;
        }
        self.plan_view().pose(station)
    }

    /// Returns the pose of the reference line at one of its ends, in the direction of s. It is the
    /// start of the first or the end of the last geometry.
    pub fn end_pose(&self, end: ContactPoint) -> Option<Pose> {
        match end {
            ContactPoint::Start => self.plan_view().first(),
            ContactPoint::End => self.plan_view().last(),
        }
    }

    /// Returns the cross section at an end. On first use, `find` computes it.
    pub(crate) fn end_frame_or(
        &self,
        end: ContactPoint,
        find: impl FnOnce() -> Option<Frame>,
    ) -> Option<Frame> {
        let slot = match end {
            ContactPoint::Start => &self.end_frames[0],
            ContactPoint::End => &self.end_frames[1],
        };
        *slot.get_or_init(find)
    }

    /// Returns the s-coordinate of an end: 0 or `@length`.
    pub fn end_s(&self, end: ContactPoint) -> Option<f64> {
        match end {
            ContactPoint::Start => Some(0.0),
            ContactPoint::End => self.length(),
        }
    }
}

impl RoadEnd {
    /// Returns an end of a road.
    pub fn of(road: &Road<'_>, end: ContactPoint) -> RoadEnd {
        RoadEnd {
            road: road.index(),
            end,
        }
    }
}

view! {
    /// A `<predecessor>` or `<successor>` of a road (10.3), also of a virtual connection (12.7).
    RoadLink {
        /// `@elementType`: `road` or `junction`.
        element_type: text "elementType",
        /// `@elementId`.
        element_id: text "elementId",
        /// `@contactPoint`: the end of the linked road.
        contact_point: contact "contactPoint",
        /// `@elementS`: a place within the linked road, in metres.
        element_s: number "elementS",
    }
}

impl<'a> RoadLink<'a> {
    /// Returns the id of the linked road, if the link leads to a road.
    pub fn road_id(&self) -> Option<&'a str> {
        self.element_id()
            .filter(|_| self.element_type() == Some("road"))
    }

    /// Returns the id of the linked junction, if the link leads to a junction.
    pub fn junction_id(&self) -> Option<&'a str> {
        self.element_id()
            .filter(|_| self.element_type() == Some("junction"))
    }
}

view! {
    /// A `<type>` record of a road (10.4).
    RoadType {
        /// `@s`, in metres.
        s: number "s",
        /// `@type`.
        kind: text "type",
    }
}
