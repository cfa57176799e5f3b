//! Outcome of the tasks of a job.

use std::sync::Arc;

use qcbus_document::FileKind;
use qcbus_messages::Catalogue;
use qcbus_types::{Answer, TaskOutcome};

use super::jobs::{Task, TaskState};

/// Returns the outcome of one task. The code that stores it converts it to a result, outside the loop.
pub(super) fn outcome(name: &str, task: &Task) -> TaskOutcome {
    TaskOutcome {
        name: name.to_owned(),
        version: task.version.clone(),
        failure: match &task.state {
            TaskState::Failed(why) => Some(why.clone()),
            _ => None,
        },
        demanded: task.demanded.clone(),
        answer: Answer::Said(task.pending.clone()),
        catalogue: task.catalogue.clone(),
        micros: task.micros,
    }
}

/// Returns the outcome of a bundle that does not take files of this kind. Each demanded checker is
/// reported as not applicable.
pub(super) fn not_applicable(
    name: &str,
    version: &str,
    catalogue: &Arc<Catalogue>,
    demanded: Vec<u32>,
    kind: FileKind,
) -> TaskOutcome {
    TaskOutcome {
        name: name.to_owned(),
        version: version.to_owned(),
        failure: None,
        demanded: demanded.into(),
        answer: Answer::OtherKind(kind),
        catalogue: Some(catalogue.clone()),
        micros: 0,
    }
}

#[cfg(test)]
#[path = "outcome_tests.rs"]
mod tests;
