//! Results as SARIF 2.1.0.

/// The reporter's name on the bus and in configurations.
pub const NAME: &str = "qc-report-sarif";
