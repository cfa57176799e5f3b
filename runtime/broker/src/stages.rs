//! When a file passes from one stage to the next, for whoever wants to know where its time goes:
//! `QCBUS_LOG=qcbus_broker::stages=debug`. The times are those of the log.

use std::path::Path;

use crate::environment;

/// Says that a file has got this far.
pub fn reached(stage: &'static str, path: &Path) {
    tracing::debug!(target: "qcbus_broker::stages", stage, path = %path.display());
    environment::step(stage, path);
}
