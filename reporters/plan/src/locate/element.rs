//! Place of an element: the place of the nearest enclosing element that has one.

use qcbus_document::Node;
use qcbus_opendrive::geometry::Point;
use qcbus_opendrive::{
    Connection, ContactPoint, Edge, Junction, LaneRef, PlanView, Road, SectionRef, Station,
};

use super::find::{lane_at, section_at};
use super::{Locator, Target};
use crate::furniture::{object_pose, on_the_road, signal_pose};

/// The place of an element and its targets.
#[derive(Debug, Default)]
pub(super) struct Found {
    pub(super) at: Option<Point>,
    pub(super) on: Vec<Target>,
}

impl<'m, 'a> Locator<'m, 'a> {
    /// Returns the place of an element; empty for an element outside of roads and junctions.
    pub(super) fn element(&self, node: Node<'a>) -> Found {
        let mut way: Vec<Node<'a>> = std::iter::once(node).chain(node.ancestors()).collect();
        // The order is now from the child of the root downwards.
        way.pop();
        way.reverse();
        let Some((&top, within)) = way.split_first() else {
            return Found::default();
        };
        if let Some(junction) = self.junction_at(top) {
            return self.in_junction(junction, within);
        }
        match self.map.road_of(top) {
            Some(road) => self.in_road(road, within),
            None => Found::default(),
        }
    }

    /// Returns the place of an element in a road, given the elements from the road's child down to
    /// it.
    fn in_road(&self, road: &'m Road<'a>, within: &[Node<'a>]) -> Found {
        let section = within
            .iter()
            .enumerate()
            .find(|(_, node)| node.is("laneSection"));
        let section = section.and_then(|(at, node)| Some((at, section_at(road, *node)?)));
        let (at, target) = match section {
            Some((at, (index, section))) => {
                let below = within.get(at + 1..).unwrap_or(&[]);
                in_section(road.index(), index, section, below)
            }
            None => self.beside_lanes(road, within),
        };
        Found {
            at: at.or_else(|| middle_of(road)),
            on: vec![target],
        }
    }

    /// Does the same as [`Locator::in_road`], outside of lane sections.
    fn beside_lanes(&self, road: &'m Road<'a>, within: &[Node<'a>]) -> (Option<Point>, Target) {
        let on_road = Target::Road { road: road.index() };
        for node in within {
            if let Some((place, signal)) = self.signal_at(*node) {
                let at = signal_pose(road, signal).map(|pose| pose.point());
                return (at, Target::Signal { signal: place });
            }
            if let Some((place, object)) = self.object_at(*node) {
                let at = object_pose(road, object).map(|pose| pose.point());
                return (at, Target::Object { object: place });
            }
        }
        let inward = within.iter().rev();
        let at = inward.clone().find_map(|node| match node.name() {
            "geometry" => start_of(road.plan_view(), *node),
            "predecessor" => end_of(road, ContactPoint::Start),
            "successor" => end_of(road, ContactPoint::End),
            _ => {
                let s = ["s", "sStart"]
                    .iter()
                    .find_map(|name| number(*node, name))?;
                on_line(road, s, number(*node, "t").unwrap_or(0.0))
            }
        });
        (at, on_road)
    }

    /// Returns the place of an element in a junction, given the elements from the junction's child
    /// down to it.
    fn in_junction(&self, junction: &'m Junction<'a>, within: &[Node<'a>]) -> Found {
        let target = Target::Junction {
            junction: junction.index(),
        };
        let mut found = Found {
            at: None,
            on: vec![target],
        };
        for node in within {
            found.at = match node.name() {
                "connection" => {
                    let connection = Connection::of(*node);
                    let road = connection.target_road().and_then(|id| self.map.road(id));
                    if let Some(road) = road {
                        let target = Target::Road { road: road.index() };
                        found.on.insert(0, target);
                    }
                    road.and_then(|road| end_of(road, ContactPoint::Start))
                }
                "geometry" => start_of(junction.plan_view(), *node),
                "roadSection" => self.on_other_road(*node, "roadId", "sStart"),
                "segment" => self.on_other_road(*node, "roadId", "sStart"),
                _ => None,
            };
            if found.at.is_some() {
                return found;
            }
        }
        found.at = self.middle(junction).or_else(|| self.first_road(junction));
        found
    }

    /// Returns the place that an element gives by the id of a road and its s.
    fn on_other_road(&self, node: Node<'a>, road: &str, s: &str) -> Option<Point> {
        on_line(self.map.road(node.attr(road)?)?, number(node, s)?, 0.0)
    }

    /// Returns the start of the first road of a junction, for junctions without an outline.
    fn first_road(&self, junction: &Junction<'a>) -> Option<Point> {
        junction.connections().find_map(|connection| {
            let road = self.map.road(connection.target_road()?)?;
            let end = connection.contact_point().unwrap_or(ContactPoint::Start);
            end_of(road, end)
        })
    }
}

/// Returns the place of an element in a lane section, given the elements below the section.
fn in_section<'a>(
    road: usize,
    index: usize,
    section: SectionRef<'_, 'a>,
    below: &[Node<'a>],
) -> (Option<Point>, Target) {
    let lane = below.iter().find_map(|node| lane_at(section, *node));
    let offset = below.iter().find_map(|node| number(*node, "sOffset"));
    let end = below.iter().find_map(|node| match node.name() {
        "predecessor" => Some(ContactPoint::Start),
        "successor" => Some(ContactPoint::End),
        _ => None,
    });
    let ds = match end {
        Some(ContactPoint::Start) => Some(Station::at(0.0)),
        Some(ContactPoint::End) => length(section, lane).map(Station::before),
        None => {
            let middle = || length(section, lane).map(|length| length / 2.0);
            offset.or_else(middle).map(Station::at)
        }
    };
    let ds = ds.unwrap_or(Station::at(0.0));
    let t = lane.and_then(|lane| {
        let both = lane.t(Edge::Inner, ds).zip(lane.t(Edge::Outer, ds));
        both.map(|(inner, outer)| inner.midpoint(outer))
    });
    let t = t.or_else(|| section.center_t(ds)).unwrap_or(0.0);
    let at = section
        .s()
        .and_then(|start| on_line(section.road, start + ds.x(), t));
    let id = lane.and_then(|lane| lane.id());
    let target = id.map_or(
        Target::Section {
            road,
            section: index,
        },
        |lane| Target::Lane {
            road,
            section: index,
            lane,
        },
    );
    (at, target)
}

/// Returns the length of a section for a lane, or the shortest length of both sides.
fn length(section: SectionRef<'_, '_>, lane: Option<LaneRef<'_, '_>>) -> Option<f64> {
    let of_lane = lane.and_then(|lane| lane.length());
    let length = of_lane.or_else(|| section.shortest_length())?;
    (length > 0.0).then_some(length)
}

/// Returns a point of the road. For a place before or beyond the road it uses the nearer end.
fn on_line(road: &Road<'_>, s: f64, t: f64) -> Option<Point> {
    let point = road.point(on_the_road(road, s)?, t, 0.0)?;
    Some(point.plan())
}

fn end_of(road: &Road<'_>, end: ContactPoint) -> Option<Point> {
    road.end_pose(end).map(|pose| pose.point())
}

/// Returns the middle of a road's reference line, or its start if the middle is undefined.
fn middle_of(road: &Road<'_>) -> Option<Point> {
    let length = road.plan_view().end().or(road.length());
    let middle = length.and_then(|length| road.pose(length / 2.0));
    let middle = middle.map(|pose| pose.point());
    middle.or_else(|| end_of(road, ContactPoint::Start))
}

/// Returns the start of a geometry.
fn start_of(line: &PlanView<'_>, node: Node<'_>) -> Option<Point> {
    let geometries = line.geometries();
    let found = geometries.binary_search_by(|geometry| geometry.node().cmp(&node));
    let geometry = geometries.get(found.ok()?)?;
    geometry.start_point().or_else(|| geometry.origin())
}

/// Returns an attribute of an element as a finite number.
fn number(node: Node<'_>, name: &str) -> Option<f64> {
    let value: f64 = node.attr(name)?.trim().parse().ok()?;
    value.is_finite().then_some(value)
}
