//! Names of faults that several findings may be about. Pooling joins findings with the same name.

use crate::prelude::*;
use qcbus_sdk::fault_of;

/// Adds the name of a fault to a finding.
pub(crate) trait OfFault {
    /// The finding is about two cross-sections that do not fit together, at these ends of lanes.
    fn at_joint(self, ends: [(LaneRef<'_, '_>, ContactPoint); 2]) -> Self;
    /// The finding is about links of a lane that has no width at this end.
    fn at_opening(self, lane: LaneRef<'_, '_>, end: ContactPoint) -> Self;
    /// The finding is about two road ends that do not lie at the same place.
    fn at_gap(self, ends: [RoadEnd; 2]) -> Self;
    /// The finding is about the roads, connections and lane links of the junction at or around an
    /// element.
    fn of_junction(self, node: Node<'_>) -> Self;
    /// The finding is about the boundary of a junction.
    fn in_boundary_of(self, junction: &Junction<'_>) -> Self;
}

impl OfFault for Finding<'_, '_> {
    fn at_joint(self, ends: [(LaneRef<'_, '_>, ContactPoint); 2]) -> Self {
        self.follows(between(ends.map(|(lane, end)| cross_section(lane.at, end))))
    }

    fn at_opening(self, lane: LaneRef<'_, '_>, end: ContactPoint) -> Self {
        self.follows(format!("no width at {}", cross_section(lane.at, end)))
    }

    fn at_gap(self, ends: [RoadEnd; 2]) -> Self {
        let finding = self.fault(between(ends.map(end_of_road)));
        // Several roads that should meet one end miss it if it lies at the wrong place.
        ends.into_iter().fold(finding, |finding, end| {
            finding.fault(format!("place of {}", end_of_road(end)))
        })
    }

    fn of_junction(self, node: Node<'_>) -> Self {
        let mut around = std::iter::once(node).chain(node.ancestors());
        match around.find(|it| it.is("junction")) {
            Some(junction) => self.follows(fault_of(junction)),
            None => self,
        }
    }

    fn in_boundary_of(self, junction: &Junction<'_>) -> Self {
        self.fault(format!("boundary of junction {}", junction.index()))
    }
}

/// Returns the name of the fault that the curves of a road are not what they should be.
pub(crate) fn shape_of(road: &Road<'_>) -> String {
    format!("shape of road {}", road.index())
}

/// Returns the name of the fault that the lengths of a road and of its geometries contradict.
pub(crate) fn lengths_of(road: &Road<'_>) -> String {
    format!("lengths of road {}", road.index())
}

/// Returns the name of the fault that two cross-sections do not fit together.
fn between(mut sections: [String; 2]) -> String {
    sections.sort();
    sections.join(" beside ")
}

fn end_of_road(at: RoadEnd) -> String {
    format!("road {} {}", at.road, at.end)
}

/// Returns the name of the cross-section at an end of a section: an end of the road, or the boundary
/// between two sections.
fn cross_section(section: SectionRef<'_, '_>, end: ContactPoint) -> String {
    let (road, at) = (section.road.index(), section.index());
    let is_last = at + 1 == section.layer.section_count();
    match end {
        ContactPoint::Start if at > 0 => format!("road {road} section {at}"),
        ContactPoint::End if !is_last => format!("road {road} section {}", at + 1),
        end => end_of_road(RoadEnd { road, end }),
    }
}
