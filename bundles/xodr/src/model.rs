//! What rules about roads, lanes and junctions look at: `Rule<Roads>` gets a `&RoadMap<'_>`.

use std::ops::Range;

use qcbus_opendrive::RoadMap;
use qcbus_sdk::{Model, Subject, Unbuilt};

/// Some roads by their places, for [`RoadMap::part`].
pub type Part = Range<usize>;

/// The road network, read once per document and shared by all rules about it.
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
