//! The whole map.

use std::sync::{Arc, OnceLock};

use qcbus_document::{Document, Node};

use crate::queries::index::IdIndex;
use crate::queries::lane_ref::LaneRef;
use crate::queries::section_ref::SectionRef;
use crate::types::contacts::{LaneJoint, LaneKey, RoadContact, RoadEnd, TouchingLanes};
use crate::types::junction::{Connection, Junction};
use crate::types::names::Names;
use crate::types::objects::Object;
use crate::types::railroad::RailroadStation;
use crate::types::road::Road;
use crate::types::signals::{Controller, Signal, VmsGroup};
use crate::types::value::{integer, is_user_data};
use crate::types::view::listed;

/// The version of a file (`header@revMajor`, `@revMinor`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Version {
    /// `@revMajor`
    pub major: u16,
    /// `@revMinor`
    pub minor: u16,
}

impl std::fmt::Display for Version {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}.{}", self.major, self.minor)
    }
}

/// A signal with its id and whether it is dynamic.
#[derive(Debug, Clone, Copy)]
pub struct SignalKey<'a> {
    /// The signal.
    pub signal: Signal<'a>,
    /// `@id` of the signal.
    pub id: Option<&'a str>,
    /// `@dynamic` of the signal.
    pub dynamic: Option<bool>,
}

impl<'a> SignalKey<'a> {
    fn of(signal: Signal<'a>) -> SignalKey<'a> {
        SignalKey {
            signal,
            id: signal.id(),
            dynamic: signal.dynamic(),
        }
    }
}

/// Statements about links, computed on first use by the queries of `joints` and `touching`.
#[derive(Debug, Default)]
pub(crate) struct Caches<'a> {
    /// Joints of junctions. Joints of lanes are cached in their roads.
    pub(crate) joints: OnceLock<Box<[LaneJoint<'a>]>>,
    pub(crate) touching: OnceLock<Box<[TouchingLanes<'a>]>>,
    /// Contacts from the links of each road, for its start and its end.
    pub(crate) linked: OnceLock<Vec<[Option<RoadContact<'a>>; 2]>>,
    pub(crate) connections: OnceLock<Vec<(usize, Connection<'a>)>>,
    /// Contact of each connection.
    pub(crate) connected: OnceLock<Vec<Option<RoadContact<'a>>>>,
    pub(crate) contacts: OnceLock<Vec<RoadContact<'a>>>,
    /// Both ends of every contact, sorted, with the place of the contact.
    pub(crate) by_end: OnceLock<Vec<(RoadEnd, u32)>>,
}

/// An OpenDRIVE file with roads and junctions, built once and shared by all rules.
#[derive(Debug)]
pub struct RoadMap<'a> {
    root: Option<Node<'a>>,
    header: Option<Node<'a>>,
    version: Option<Version>,
    roads: Vec<Road<'a>>,
    junctions: Vec<Junction<'a>>,
    road_ids: IdIndex<'a>,
    junction_ids: IdIndex<'a>,
    object_ids: OnceLock<IdIndex<'a>>,
    signal_ids: OnceLock<IdIndex<'a>>,
    controller_ids: OnceLock<IdIndex<'a>>,
    signals: OnceLock<Vec<SignalKey<'a>>>,
    pub(crate) caches: Caches<'a>,
}

impl<'a> RoadMap<'a> {
    /// Reads the roads and junctions of a document. Their content is read on first use. The time is
    /// proportional to the number of their direct children.
    pub fn new(document: Document<'a>) -> RoadMap<'a> {
        let root = document.root();
        let mut roads = Vec::new();
        let mut junctions = Vec::new();
        let mut header = None;
        let names = Arc::new(Names::of(document));
        for child in root.into_iter().flat_map(|root| root.children()) {
            let place = |len: usize| u32::try_from(len).unwrap_or(u32::MAX);
            match child.name() {
                "road" => roads.push(Road::read(child, place(roads.len()), &names)),
                "junction" => junctions.push(Junction::read(child, place(junctions.len()))),
                "header" => header = header.or(Some(child)),
                _ => {}
            }
        }
        RoadMap {
            root,
            header,
            version: header.and_then(version),
            road_ids: IdIndex::new(roads.iter().map(Road::id)),
            junction_ids: IdIndex::new(junctions.iter().map(Junction::id)),
            roads,
            junctions,
            object_ids: OnceLock::new(),
            signal_ids: OnceLock::new(),
            controller_ids: OnceLock::new(),
            signals: OnceLock::new(),
            caches: Caches::default(),
        }
    }

    /// Returns the root element, regardless of its name.
    pub fn root(&self) -> Option<Node<'a>> {
        self.root
    }

    /// Returns the `<header>` element.
    pub fn header(&self) -> Option<Node<'a>> {
        self.header
    }

    /// Returns the version in the header.
    pub fn version(&self) -> Option<Version> {
        self.version
    }

    /// Returns all roads in document order.
    #[inline]
    pub fn roads(&self) -> &[Road<'a>] {
        &self.roads
    }

    /// Returns the first road with this id.
    #[inline]
    pub fn road(&self, id: &str) -> Option<&Road<'a>> {
        self.roads_with_id(id).next()
    }

    /// Returns all roads with this id, in document order. Only faulty files have more than one.
    pub fn roads_with_id(&self, id: &str) -> impl Iterator<Item = &Road<'a>> {
        let places = self.road_ids.places(id);
        places.filter_map(|place| self.roads.get(place))
    }

    /// Returns the road that contains a node. The node may be the road element itself.
    pub fn road_of(&self, node: Node<'a>) -> Option<&Road<'a>> {
        let after = self.roads.partition_point(|road| road.node() <= node);
        let road = self.roads.get(after.checked_sub(1)?)?;
        let inside = road.node() == node || node.ancestors().any(|above| above == road.node());
        inside.then_some(road)
    }

    /// Returns all junctions in document order.
    #[inline]
    pub fn junctions(&self) -> &[Junction<'a>] {
        &self.junctions
    }

    /// Checks whether a junction has the id `-1`, by which a road says that it belongs to none. The
    /// roads of this junction cannot be told from those outside of junctions.
    pub fn has_reserved_junction(&self) -> bool {
        self.junction("-1").is_some()
    }

    /// Returns the first junction with this id.
    #[inline]
    pub fn junction(&self, id: &str) -> Option<&Junction<'a>> {
        self.junctions_with_id(id).next()
    }

    /// Returns all junctions with this id, in document order. Only faulty files have more than one.
    pub fn junctions_with_id(&self, id: &str) -> impl Iterator<Item = &Junction<'a>> {
        let places = self.junction_ids.places(id);
        places.filter_map(|place| self.junctions.get(place))
    }

    /// Returns the junction of a road, if it belongs to one.
    pub fn junction_of(&self, road: &Road<'_>) -> Option<&Junction<'a>> {
        self.junction(road.junction()?)
    }

    /// Returns the signal controllers (14.6).
    pub fn controllers(&self) -> impl Iterator<Item = Controller<'a>> + use<'a> {
        listed(self.root, "controller").map(Controller::of)
    }

    /// Returns the railroad stations (15.4).
    pub fn stations(&self) -> impl Iterator<Item = RailroadStation<'a>> + use<'a> {
        listed(self.root, "station").map(RailroadStation::of)
    }

    /// Returns the VMS groups (14.7) within the signals of a road or within a junction.
    pub fn vms_groups(&self) -> impl Iterator<Item = VmsGroup<'a>> + use<'a> {
        let all = self.root.map(|root| root.descendants_named("vmsGroup"));
        let all = all.into_iter().flatten();
        all.filter(|node| !is_user_data(*node)).map(VmsGroup::of)
    }

    /// Returns the objects of all roads with their road, in document order.
    pub fn objects(&self) -> impl Iterator<Item = (&Road<'a>, Object<'a>)> {
        self.roads
            .iter()
            .flat_map(|road| road.objects().map(move |object| (road, object)))
    }

    /// Returns the signals of all roads with their road, in document order.
    pub fn signals(&self) -> impl Iterator<Item = (&Road<'a>, Signal<'a>)> {
        self.roads
            .iter()
            .flat_map(|road| road.signals().map(move |signal| (road, signal)))
    }

    /// Returns the signals of all roads for rules about controllers, in document order; cached.
    pub fn signal_keys(&self) -> &[SignalKey<'a>] {
        self.signals.get_or_init(|| {
            let signals = self.signals();
            signals.map(|(_, signal)| SignalKey::of(signal)).collect()
        })
    }

    /// Returns the objects with this id, on roads and junctions, in document order.
    pub fn objects_with_id(&self, id: &str) -> impl Iterator<Item = Object<'a>> {
        let index = self
            .object_ids
            .get_or_init(|| self.index_of("object", &["objects", "junction"]));
        index
            .places(id)
            .filter_map(|place| self.node_at(place))
            .map(Object::of)
    }

    /// Returns the signals with this id, in document order.
    pub fn signals_with_id(&self, id: &str) -> impl Iterator<Item = Signal<'a>> {
        let index = self
            .signal_ids
            .get_or_init(|| self.index_of("signal", &["signals"]));
        index
            .places(id)
            .filter_map(|place| self.node_at(place))
            .map(Signal::of)
    }

    /// Returns the controllers with this id, in document order.
    pub fn controllers_with_id(&self, id: &str) -> impl Iterator<Item = Controller<'a>> {
        let index = self
            .controller_ids
            .get_or_init(|| self.index_of("controller", &["OpenDRIVE"]));
        index
            .places(id)
            .filter_map(|place| self.node_at(place))
            .map(Controller::of)
    }

    /// Builds the index of the elements that are direct children of one of `parents`.
    fn index_of(&self, name: &str, parents: &[&str]) -> IdIndex<'a> {
        let elements = self
            .root
            .into_iter()
            .flat_map(|root| root.descendants_named(name));
        let placed = |node: &Node<'a>| {
            node.parent()
                .is_some_and(|parent| parents.contains(&parent.name()))
        };
        let ids = elements
            .filter(|node| placed(node) && !is_user_data(*node))
            .filter_map(|node| Some((node.attr("id")?, node.index())));
        IdIndex::of(ids.collect())
    }

    fn node_at(&self, place: usize) -> Option<Node<'a>> {
        self.root?.document().node(u32::try_from(place).ok()?)
    }

    /// Returns the lane sections of all roads and layers, in document order.
    #[inline]
    pub fn sections(&self) -> impl Iterator<Item = SectionRef<'_, 'a>> {
        self.roads.iter().flat_map(Road::sections)
    }

    /// Returns all lanes in document order.
    #[inline]
    pub fn lanes(&self) -> impl Iterator<Item = LaneRef<'_, 'a>> {
        self.sections().flat_map(SectionRef::lanes)
    }

    /// Returns the lane with this key.
    #[inline]
    pub fn lane(&self, key: LaneKey) -> Option<LaneRef<'_, 'a>> {
        let road = self.roads.get(key.road as usize)?;
        let layer = road.layers().get(key.layer as usize)?;
        layer
            .section(road, key.section as usize)?
            .lane_at(key.lane as usize)
    }
}

fn version(header: Node<'_>) -> Option<Version> {
    let part = |name: &str| u16::try_from(integer(header, name)?).ok();
    Some(Version {
        major: part("revMajor")?,
        minor: part("revMinor")?,
    })
}
