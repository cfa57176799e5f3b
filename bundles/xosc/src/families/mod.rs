//! Algorithms that several rules share.

pub(crate) mod actions;
pub(crate) mod allowed_values;
pub(crate) mod casts;
pub(crate) mod catalogs;
pub(crate) mod constraints;
pub(crate) mod declared;
pub(crate) mod demands;
pub(crate) mod deprecation;
pub(crate) mod distributions;
pub(crate) mod minsubset;
pub(crate) mod names;
pub(crate) mod origins;
pub(crate) mod placement;
pub(crate) mod positions;
pub(crate) mod profiles;
pub(crate) mod ranges;
pub(crate) mod references;
pub(crate) mod relative;
pub(crate) mod road_network;
pub(crate) mod routes;
pub(crate) mod signals;
pub(crate) mod spawn;
pub(crate) mod states;
pub(crate) mod trajectories;
pub(crate) mod triggers;
pub(crate) mod values;
