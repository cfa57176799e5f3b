//! Requests of clients, and trials of shadows.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use qcbus_messages::Verdict;
use qcbus_messages::control::Checked;

use crate::values::RequestId;

/// Request of a client for an on-demand check.
#[derive(Debug, Clone)]
pub struct OnDemand {
    /// The client.
    pub request_id: RequestId,
    /// The bundles that must check the file. No other bundle takes part.
    pub bundles: Arc<[String]>,
}

/// Outcome of an on-demand check after its file was checked.
#[derive(Debug, Clone, PartialEq)]
pub enum OnDemandOutcome {
    /// The pooled findings.
    Pooled(Box<Checked>),
    /// The findings of a shadow.
    Tried(TrialEnd),
    /// The file has changed since it was read.
    Stale,
    /// The required bundles or the configuration have changed.
    Outdated,
    /// The check failed, with the reason as a text for the user.
    Failed(String),
}

/// Goal and timeout of a client of the control socket.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Until {
    /// Time after which the wait ends. `None` means no limit.
    pub timeout: Option<Duration>,
    /// The client also waits until every reporter has written its report.
    pub reports: bool,
}

/// Findings of a shadow in a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TrialEnd {
    /// Effect on the verdict of the required bundles. An error rejects, a failed checker makes it
    /// undetermined, otherwise there is none.
    pub adds: Verdict,
    /// Verdict if no other bundle judged.
    pub alone: Verdict,
    /// Its issues by level: errors, warnings, information.
    pub counts: [u64; 3],
    /// Its failed checkers, each with the reason.
    pub why: Vec<String>,
    /// Path of its result. `None` if there are no findings.
    pub result: Option<PathBuf>,
}
