//! Result files: model, reading, writing.

mod model;
mod numbers;
mod read;
mod road;
mod write;

pub(crate) use model::MAX_INFO_DEPTH;
pub use model::{
    Checker, CheckerBundle, DomainInfo, InfoElement, Issue, Level, Location, Locations, Metadata,
    Param, Results, Status,
};
pub use read::{ReadError, read};
pub use write::{Dialect, FORMAT_VERSION, write};
