//! Result files: model, reading, writing.

mod head;
mod model;
mod numbers;
mod read;
mod road;
mod write;

pub use head::input_file;
pub(crate) use model::MAX_INFO_DEPTH;
pub use model::{
    Checker, CheckerBundle, DomainInfo, InfoElement, Issue, Level, Location, Locations, Metadata,
    Param, Results, Status,
};
pub use read::{ReadError, read};
pub use write::{Dialect, FORMAT_VERSION, write, write_into};
