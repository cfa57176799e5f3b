//! Log events for each stage that a file reaches, to measure its processing time:
//! `QCBUS_LOG=qcbus_broker::stages=debug`. The timestamps are those of the log.

use std::path::Path;

use crate::environment;

/// Logs that a file has reached a stage.
pub fn reached(stage: &'static str, path: &Path) {
    tracing::debug!(target: "qcbus_broker::stages", stage, path = %path.display());
    environment::step(stage, path);
}
