//! Results as a page to look at.

/// The reporter's name on the bus and in configurations.
pub const NAME: &str = "qc-report-html";
