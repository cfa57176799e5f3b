//! Parts of a map with a few roads each.

use std::ops::Range;

use crate::queries::lane_ref::LaneRef;
use crate::queries::map::RoadMap;
use crate::queries::section_ref::SectionRef;
use crate::types::contacts::{LaneJoint, TouchingLanes};
use crate::types::objects::Object;
use crate::types::road::Road;

/// Minimum size of a part in bytes of the file, if roads remain. Image and model of a part stay in
/// the second-level cache (1 MiB and less) while several rules read them. Of 32 KiB to 1 MiB, this
/// was the fastest. In builds with debug assertions, every road is its own part. Tests then find
/// rules that do not look beyond their part.
const PART: u32 = if cfg!(debug_assertions) {
    1
} else {
    128 * 1024
};

/// Some consecutive roads of a map.
///
/// Elements in the part have the same keys as in [`RoadMap`]. Referenced elements are found in the
/// whole [`map`](MapPart::map).
#[derive(Debug, Clone, Copy)]
pub struct MapPart<'m, 'a> {
    map: &'m RoadMap<'a>,
    roads: &'m [Road<'a>],
}

impl<'a> RoadMap<'a> {
    /// Returns the places of all roads, in parts of a size that is fast for several passes.
    pub fn parts(&self) -> impl Iterator<Item = Range<usize>> {
        let mut next = 0;
        std::iter::from_fn(move || {
            let rest = self.roads().get(next..)?;
            let begin = rest.first()?.node().offset();
            let fills = |road: &Road<'a>| road.node().end_offset().saturating_sub(begin) >= PART;
            let count = rest.iter().position(fills).map_or(rest.len(), |at| at + 1);
            let part = next..next + count;
            next = part.end;
            Some(part)
        })
    }

    /// Returns the roads at these places.
    #[inline]
    pub fn part(&self, places: &Range<usize>) -> MapPart<'_, 'a> {
        let roads = self.roads().get(places.clone()).unwrap_or(&[]);
        MapPart { map: self, roads }
    }
}

impl<'m, 'a> MapPart<'m, 'a> {
    /// Returns the whole map.
    #[inline]
    pub fn map(self) -> &'m RoadMap<'a> {
        self.map
    }

    /// Returns the roads in document order.
    #[inline]
    pub fn roads(self) -> &'m [Road<'a>] {
        self.roads
    }

    /// Returns the lane sections of these roads, in document order.
    #[inline]
    pub fn sections(self) -> impl Iterator<Item = SectionRef<'m, 'a>> {
        self.roads.iter().flat_map(Road::sections)
    }

    /// Returns the lanes of these roads, in document order.
    #[inline]
    pub fn lanes(self) -> impl Iterator<Item = LaneRef<'m, 'a>> {
        self.sections().flat_map(SectionRef::lanes)
    }

    /// Returns the joints that the lanes of these roads state. The last part also returns the
    /// joints of junctions. See [`RoadMap::lane_joints`].
    pub fn lane_joints(self) -> impl Iterator<Item = &'m LaneJoint<'a>> {
        let of_lanes = self
            .roads
            .iter()
            .flat_map(move |road| self.map.joints_of(road));
        let last = self.is_last().then(|| self.map.junction_joints());
        of_lanes.chain(last.into_iter().flatten())
    }

    /// Returns the pairs of touching lanes that these roads state. The last part also returns the
    /// pairs that only junctions state. See [`RoadMap::touching_lanes`].
    pub fn touching_lanes(self) -> impl Iterator<Item = &'m TouchingLanes<'a>> {
        let by_lanes = self
            .roads
            .iter()
            .flat_map(move |road| self.map.touching_by(road));
        let last = self.is_last().then(|| self.map.touching_by_junctions());
        by_lanes.chain(last.into_iter().flatten())
    }

    fn is_last(self) -> bool {
        let last = |road: &Road<'a>| road.index() + 1 == self.map.roads().len();
        self.roads.last().is_some_and(last)
    }

    /// Returns the objects of these roads with their road, in document order.
    pub fn objects(self) -> impl Iterator<Item = (&'m Road<'a>, Object<'a>)> {
        let of = |road: &'m Road<'a>| road.objects().map(move |object| (road, object));
        self.roads.iter().flat_map(of)
    }
}
