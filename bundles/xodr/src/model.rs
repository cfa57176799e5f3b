//! Model for rules about roads, lanes and junctions: `Rule<Roads>` gets a `&RoadMap<'_>`.

use std::ops::Range;

use qcbus_opendrive::RoadMap;
use qcbus_sdk::{Model, Subject, Unbuilt};

/// Indices of some roads, for [`RoadMap::part`].
pub type Part = Range<usize>;

/// The road network, read once per document and shared by all rules that use it.
pub enum Roads {}

impl Model for Roads {
    type Of<'d> = RoadMap<'d>;
    type Part = Part;

    fn build<'d>(subject: &'d Subject<'d>) -> Result<RoadMap<'d>, Unbuilt> {
        Ok(RoadMap::new(subject.root()))
    }

    fn parts(map: &RoadMap<'_>) -> Vec<Part> {
        map.parts().collect()
    }
}
