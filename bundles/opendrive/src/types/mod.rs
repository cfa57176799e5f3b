//! Views of elements. An accessor reads its own element and the elements within it.

pub(crate) mod contacts;
pub(crate) mod crg;
pub(crate) mod frame;
pub(crate) mod junction;
pub(crate) mod junction_area;
pub(crate) mod lane;
pub(crate) mod lane_section;
pub(crate) mod lateral;
pub(crate) mod names;
pub(crate) mod objects;
pub(crate) mod outlines;
pub(crate) mod plan_view;
pub(crate) mod profile;
pub(crate) mod railroad;
pub(crate) mod road;
pub(crate) mod signals;
pub(crate) mod station;
pub(crate) mod steps;
pub(crate) mod strips;
pub(crate) mod value;
pub(crate) mod view;
