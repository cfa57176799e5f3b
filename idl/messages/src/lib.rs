//! What is said on the bus and on the control socket: plain data, one file per direction.
//!
//! Nothing here does I/O. The bus carries these types as a reliable, ordered stream per peer and
//! direction (see `qcbus-bus`); documents and the configuration travel on topics of their own.

pub mod broker_to_peer;
pub mod catalogue;
pub mod codec;
pub mod control;
mod exit;
pub mod ids;
pub mod missing;
pub mod peer_to_broker;
pub mod services;

pub use broker_to_peer::{Job, JobDocument, PeerReport, ResultMessage, ToPeer, Withdrawn};
pub use catalogue::{Catalogue, CheckerInfo, Hello, ParamInfo, Role};
pub use exit::Exit;
pub use ids::{Digest, DocId, DocumentRole, JobId, PROTOCOL_VERSION};
pub use missing::{Absence, MissingDocument};
pub use peer_to_broker::FromPeer;
pub use qcbus_formats::Verdict;
