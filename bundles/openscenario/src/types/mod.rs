//! Values, declarations, catalogs and roads, without the scenario around them.

pub(crate) mod catalogs;
pub(crate) mod data_type;
pub(crate) mod date_time;
pub(crate) mod declaration;
pub(crate) mod entities;
pub(crate) mod faults;
pub(crate) mod form;
pub(crate) mod inputs;
pub(crate) mod reading;
pub(crate) mod road_network;
pub(crate) mod roads_nearby;
pub(crate) mod scope;
pub(crate) mod storyboard;
pub(crate) mod text;
pub(crate) mod ways;
