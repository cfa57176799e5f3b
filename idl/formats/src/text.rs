//! Texts that many results share.

use std::sync::Arc;

/// A text that is shared, not copied. The result of every file contains the catalogue texts of
/// hundreds of checkers.
pub type Text = Arc<str>;
