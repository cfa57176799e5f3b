//! The map, lanes within their road, and everything that needs more than one element.

pub(crate) mod index;
pub(crate) mod joints;
pub(crate) mod lane_ref;
pub(crate) mod map;
pub(crate) mod owned;
pub(crate) mod part;
pub(crate) mod section_ref;
pub(crate) mod spans;
pub(crate) mod surface;
pub(crate) mod touching;
pub(crate) mod traffic;
