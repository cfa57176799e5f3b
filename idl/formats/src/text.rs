//! Texts that many results have in common.

use std::sync::Arc;

/// A text that is shared, not copied. What the catalogue of a bundle says of its hundreds of checkers
/// stands in the result of every file.
pub type Text = Arc<str>;
