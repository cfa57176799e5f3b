//! The editions of XML Schema.

/// Edition of XML Schema that the tables follow where the two editions differ.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Edition {
    /// XML Schema 1.0.
    V1_0,
    /// XML Schema 1.1. The compiler chooses it if the schema has a 1.1 construct.
    V1_1,
}
