//! Results as GitLab code quality.

/// The reporter's name on the bus and in configurations.
pub const NAME: &str = "qc-report-gitlab";
