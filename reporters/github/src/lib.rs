//! Results as GitHub annotations.

/// The reporter's name on the bus and in configurations.
pub const NAME: &str = "qc-report-github";
