//! Converts bytes on disk to document images: reading, gzip and zip, encodings, and the XML checks
//! that a fast parser omits. It also handles OpenDRIVE includes and the references of a document to
//! other files.
//!
//! [`prepare`] does all input and output. [`Prepared::build_into`] then parses once, directly into
//! a buffer that the caller owns. A file that cannot be read at all is an [`IngestError`]. A
//! readable file always becomes an image, and its faults describe the errors.

mod archive;
mod count;
mod decode;
mod error;
mod gather;
mod limits;
pub mod modular;
mod prepare;
mod prepared;
mod read;
mod references;
mod remarks;
mod rests_on;
mod text_fault;
mod unpack;
mod xml;

pub use error::IngestError;
pub use gather::{Found, Look, Source, Walking, gather};
pub use limits::{Exceeded, Limits};
pub use prepare::{Reader, outer_file, prepare, prepare_bytes};
pub use prepared::Prepared;
pub use qcbus_document::BuildError;
pub use read::{Content, FileStamp, Stat};
pub use references::{Reference, references};
pub use remarks::{RESTS_ON_CHECKER, Resting};
pub use remarks::{faults_of_root, missing_references, remarks, resting, unwatched};
