//! Names that most rules use.

pub(crate) use qcbus_document::{Attribute, Document, FaultCode, FileKind, Node};
pub(crate) use qcbus_openscenario::closest;
pub(crate) use qcbus_sdk::modular::{Followed, OFFERS, Spot, Use, What, archive_of};
pub(crate) use qcbus_sdk::{Level, Place, Rule, Sink};
