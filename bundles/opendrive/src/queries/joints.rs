//! Contacts between linked road ends and between linked lanes (OpenDRIVE 1.9, 10.3, 11.6, 12.3,
//! 12.4, 12.6, 12.7).

use std::collections::BTreeSet;

use crate::queries::lane_ref::LaneRef;
use crate::queries::map::RoadMap;
use crate::queries::section_ref::SectionRef;
use crate::types::contacts::{LaneEnd, LaneJoint, RoadContact, RoadEnd};
use crate::types::junction::{Connection, Junction, JunctionLaneLink};
use crate::types::road::Road;
use crate::types::station::Station;
use crate::types::value::{ContactPoint, LayerKind, Side};

impl<'a> RoadMap<'a> {
    /// Returns the road at a place of [`RoadMap::roads`].
    #[inline]
    pub fn road_at(&self, index: usize) -> Option<&Road<'a>> {
        self.roads().get(index)
    }

    /// Returns all connections with their junctions, in document order.
    pub fn connections(&self) -> impl Iterator<Item = (&Junction<'a>, Connection<'a>)> {
        self.all_connections()
            .iter()
            .filter_map(|(at, connection)| Some((self.junctions().get(*at)?, *connection)))
    }

    fn all_connections(&self) -> &[(usize, Connection<'a>)] {
        self.caches.connections.get_or_init(|| {
            let junctions = self.junctions().iter();
            junctions
                .flat_map(|junction| junction.connections().map(|one| (junction.index(), one)))
                .collect()
        })
    }

    /// Returns every statement that two road ends touch, in document order. Statements are links
    /// between roads by `@contactPoint` and connections of junctions. References to missing roads
    /// and links to places within a road (`@elementS`) are left out.
    pub fn road_contacts(&self) -> &[RoadContact<'a>] {
        self.caches.contacts.get_or_init(|| {
            let links = self
                .roads()
                .iter()
                .flat_map(|road| ContactPoint::BOTH.map(|end| self.linked_end(road, end)));
            let connections = self
                .connections()
                .map(|(junction, connection)| self.connection_contact(junction, connection));
            links.chain(connections).flatten().collect()
        })
    }

    /// Returns the contact that a road's own link states for one of its ends.
    #[inline]
    pub fn linked_end(&self, road: &Road<'a>, end: ContactPoint) -> Option<RoadContact<'a>> {
        let linked = self.caches.linked.get_or_init(|| {
            let roads = self.roads().iter();
            roads
                .map(|road| ContactPoint::BOTH.map(|end| self.read_link(road, end)))
                .collect()
        });
        let [start, last] = linked.get(road.index())?;
        match end {
            ContactPoint::Start => *start,
            ContactPoint::End => *last,
        }
    }

    fn read_link(&self, road: &Road<'a>, end: ContactPoint) -> Option<RoadContact<'a>> {
        let link = road.link(end)?;
        let linked = self.road(link.road_id()?)?;
        Some(RoadContact {
            from: RoadEnd::of(road, end),
            to: RoadEnd::of(linked, link.contact_point()?),
            node: link.node(),
            junction: None,
        })
    }

    /// Returns the road ends that a connection of a common or direct junction joins.
    pub fn connection_contact(
        &self,
        junction: &Junction<'a>,
        connection: Connection<'a>,
    ) -> Option<RoadContact<'a>> {
        let all = self.all_connections();
        let connected = self.caches.connected.get_or_init(|| {
            let all = self.connections();
            all.map(|(junction, connection)| self.read_contact(junction, connection))
                .collect()
        });
        // The connections are in document order.
        let place = all.binary_search_by_key(&connection.node(), |(_, one)| one.node());
        match place.ok().and_then(|place| connected.get(place)) {
            Some(known) => *known,
            None => self.read_contact(junction, connection),
        }
    }

    fn read_contact(
        &self,
        junction: &Junction<'a>,
        connection: Connection<'a>,
    ) -> Option<RoadContact<'a>> {
        if connection.is_virtual() {
            return None;
        }
        let target = self.road(connection.target_road()?)?;
        let contact = connection.contact_point()?;
        let incoming = self.road(connection.incoming_road()?)?;
        let end = self.incoming_end(junction, incoming, target, contact)?;
        Some(RoadContact {
            from: RoadEnd::of(incoming, end),
            to: RoadEnd::of(target, contact),
            node: connection.node(),
            junction: Some(junction.index()),
        })
    }

    /// Checks for both ends of a road, start and end, whether its link leads to the junction.
    pub fn ends_at(&self, junction: &Junction<'a>, road: &Road<'a>) -> [bool; 2] {
        ContactPoint::BOTH.map(|end| {
            let link = road.link(end);
            link.is_some_and(|link| link.junction_id() == Some(junction.id()))
        })
    }

    /// Returns the junction's end of the incoming road. Its own links decide if exactly one end
    /// leads there. Otherwise the target road's link back decides. If that is missing and both ends
    /// lead there, the nearer end counts. Virtual junctions touch their main road between its ends.
    pub fn incoming_end(
        &self,
        junction: &Junction<'a>,
        incoming: &Road<'a>,
        target: &Road<'a>,
        contact: ContactPoint,
    ) -> Option<ContactPoint> {
        match self.ends_at(junction, incoming) {
            [true, false] => Some(ContactPoint::Start),
            [false, true] => Some(ContactPoint::End),
            [both, _] => {
                let link = target
                    .link(contact)
                    .filter(|link| link.road_id() == Some(incoming.id()));
                let named = link.and_then(|link| link.contact_point());
                named.or_else(|| {
                    if both {
                        nearer_end(incoming, target, contact)
                    } else {
                        None
                    }
                })
            }
        }
    }

    /// Returns the road ends that touch an end of a road, without repetition, in document order of
    /// the statements. Both directions of each statement count.
    pub fn neighbours(&self, road: &Road<'a>, end: ContactPoint) -> Vec<RoadEnd> {
        let own = RoadEnd::of(road, end);
        let mut seen = BTreeSet::new();
        let contacts = self.contacts_of(own);
        let others = contacts.map(|contact| {
            if contact.from == own {
                contact.to
            } else {
                contact.from
            }
        });
        others.filter(|other| seen.insert(*other)).collect()
    }

    /// Returns the statements about one road end, from both sides, in document order.
    pub fn contacts_of(&self, own: RoadEnd) -> impl Iterator<Item = &RoadContact<'a>> {
        let contacts = self.road_contacts();
        let by_end = self.caches.by_end.get_or_init(|| {
            let ends = contacts
                .iter()
                .zip(0..)
                .flat_map(|(one, at)| [(one.from, at), (one.to, at)]);
            let mut ends: Vec<(RoadEnd, u32)> = ends.collect();
            ends.sort_unstable();
            ends.dedup();
            ends
        });
        let from = by_end.partition_point(|(end, _)| *end < own);
        let rest = by_end.get(from..).unwrap_or(&[]).iter();
        rest.take_while(move |(end, _)| *end == own)
            .filter_map(|(_, at)| contacts.get(*at as usize))
    }

    /// Returns every statement that two lane ends touch: links within a road, links across roads
    /// and lane links of junctions. They are in document order, lanes first, and cached.
    ///
    /// Links to missing lanes are left out. So are links with an unknown other side, because a road
    /// link or contact point is missing.
    pub fn lane_joints(&self) -> impl Iterator<Item = &LaneJoint<'a>> + Clone {
        let roads = self.roads().iter();
        let of_lanes = roads.flat_map(|road| self.joints_of(road));
        of_lanes.chain(self.junction_joints())
    }

    /// Returns the statements of the lanes of one road; see [`RoadMap::lane_joints`].
    pub fn joints_of<'m>(&'m self, road: &'m Road<'a>) -> &'m [LaneJoint<'a>] {
        road.joints.get_or_init(|| {
            let lanes = || road.sections().flat_map(SectionRef::lanes);
            // Counting first is cheaper than allocating unused memory.
            let links = |lane: LaneRef<'_, 'a>| {
                let ends = ContactPoint::BOTH.map(|end| lane.links(end).count());
                ends.into_iter().sum::<usize>()
            };
            let mut joints = Vec::with_capacity(lanes().map(links).sum());
            for lane in lanes() {
                for end in ContactPoint::BOTH {
                    self.collect_links(lane, end, &mut joints);
                }
            }
            joints.into()
        })
    }

    /// Returns the statements of junctions; see [`RoadMap::lane_joints`].
    pub fn junction_joints(&self) -> &[LaneJoint<'a>] {
        self.caches.joints.get_or_init(|| {
            let mut joints = Vec::new();
            for (junction, connection) in self.connections() {
                self.collect_lane_links(junction, connection, &mut joints);
            }
            joints.into()
        })
    }

    fn collect_links(
        &self,
        lane: LaneRef<'_, 'a>,
        end: ContactPoint,
        joints: &mut Vec<LaneJoint<'a>>,
    ) {
        for link in lane.links(end) {
            let to = link
                .id()
                .and_then(|id| self.linked_lane(lane, end, id, link.layer()));
            if let Some(to) = to {
                joints.push(LaneJoint {
                    from: LaneEnd::of(lane, end),
                    to,
                    node: link.node(),
                    junction: None,
                });
            }
        }
    }

    /// Returns the lane that a link of `lane` at `end` with this id and layer leads to; see
    /// [`RoadMap::linked_section`].
    pub fn linked_lane(
        &self,
        lane: LaneRef<'_, 'a>,
        end: ContactPoint,
        id: i64,
        layer: LayerKind,
    ) -> Option<LaneEnd> {
        let (section, end) = self.linked_section(lane, end, Some(id), layer)?;
        Some(LaneEnd::of(section.lane(id)?, end))
    }

    /// Returns the section that a link of `lane` at `end` with this layer leads to, and its
    /// touching end. This is the next section of the road, or on another layer the section at that
    /// station. At the end of a road, it is a section of the linked road. `id` selects the side.
    pub fn linked_section<'m>(
        &'m self,
        lane: LaneRef<'m, 'a>,
        end: ContactPoint,
        id: Option<i64>,
        layer: LayerKind,
    ) -> Option<(SectionRef<'m, 'a>, ContactPoint)> {
        let own_side = lane.side().unwrap_or(Side::Right);
        let side = id.and_then(Side::of_lane_id).unwrap_or(own_side);
        let own_layer = lane.at.layer.kind();
        if layer == own_layer
            && let Some(next) = lane.at.neighbour(own_side, end)
        {
            return Some((next, end.other()));
        }
        // Temporary lanes may begin and end anywhere. Permanent lanes begin and end with the road.
        let always = layer == own_layer && layer == LayerKind::Permanent;
        if always || lane.is_at_road_end(end) {
            let to = self.linked_end(lane.at.road, end)?.to;
            let road = self.road_at(to.road)?;
            let section = road.layer(layer)?.end_section(road, side, to.end)?;
            return Some((section, to.end));
        }
        if layer == own_layer {
            return None;
        }
        let other = other_layer(lane, end, side, layer)?;
        Some((other, end.other()))
    }

    /// Returns the lane with this id in the section at an end of a road.
    pub fn lane_at_road_end(&self, at: RoadEnd, id: i64, layer: LayerKind) -> Option<LaneEnd> {
        let road = self.road_at(at.road)?;
        let side = Side::of_lane_id(id).unwrap_or(Side::Right);
        let section = road.layer(layer)?.end_section(road, side, at.end)?;
        Some(LaneEnd::of(section.lane(id)?, at.end))
    }

    fn collect_lane_links(
        &self,
        junction: &Junction<'a>,
        connection: Connection<'a>,
        joints: &mut Vec<LaneJoint<'a>>,
    ) {
        let Some(contact) = self.connection_contact(junction, connection) else {
            return;
        };
        for link in connection.lane_links() {
            if let Some((from, to)) = self.lane_link_ends(&contact, link) {
                joints.push(LaneJoint {
                    from,
                    to,
                    node: link.node(),
                    junction: contact.junction,
                });
            }
        }
    }

    fn lane_link_ends(
        &self,
        contact: &RoadContact<'a>,
        link: JunctionLaneLink<'a>,
    ) -> Option<(LaneEnd, LaneEnd)> {
        let from = self.lane_at_road_end(contact.from, link.from()?, link.from_layer())?;
        let to = self.lane_at_road_end(contact.to, link.to()?, link.to_layer())?;
        Some((from, to))
    }
}

/// Returns the section of another layer of the same road that touches an end of a lane.
fn other_layer<'m, 'a>(
    lane: LaneRef<'m, 'a>,
    end: ContactPoint,
    side: Side,
    layer: LayerKind,
) -> Option<SectionRef<'m, 'a>> {
    let road = lane.at.road;
    let station = match end {
        ContactPoint::Start => Station::before(lane.at.s()?),
        ContactPoint::End => Station::at(lane.at.end(side)?),
    };
    road.layer(layer)?.section_at(road, side, station)
}

/// Returns the end of the incoming road that is nearer to the contact point of the target road.
fn nearer_end(
    incoming: &Road<'_>,
    target: &Road<'_>,
    contact: ContactPoint,
) -> Option<ContactPoint> {
    let place = target.end_pose(contact)?.point();
    let distance = |end| Some(incoming.end_pose(end)?.point().distance(place));
    let (start, end) = (distance(ContactPoint::Start)?, distance(ContactPoint::End)?);
    Some(if start <= end {
        ContactPoint::Start
    } else {
        ContactPoint::End
    })
}
