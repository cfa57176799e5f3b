//! Expands modular scenarios: OpenSCENARIO files whose maneuver groups are taken from other files
//! by `ScenarioReference`, with some attributes replaced.
//!
//! [`expand`] makes one plain scenario from the documents of a set, in memory and without reading
//! other files. The result can be written as text ([`Expansion::text`]), with the formatting of the
//! files. It can also become a document image ([`Expansion::image`]). The text of the image *is*
//! the text of the files, so the origin of each element and value is known.

mod actor;
mod copy;
mod foreign;
mod image;
mod keys;
mod pack;
mod plan;
mod problem;
mod refusal;
mod search;
mod text;

pub use copy::{Copy, Value};
pub use image::ExpandedImage;
pub use keys::{Key, offered};
pub use pack::{PackError, pack};
pub use plan::{Expansion, Followed, Form, Use, expand};
pub use problem::{Problem, Spot, What};
pub(crate) use search::libraries;
pub use search::{SEARCH_PATH_VARIABLE, SearchPath};

pub use crate::archive::{has_only_backslashes, stays_inside};

use std::path::Path;

use qcbus_document::{Document, FileKind};
use qcbus_messages::Link;

use crate::archive::MAIN_MEMBER;

/// Maximum depth of references from scenario to scenario.
pub const MAX_DEPTH: u32 = 32;

/// Attribute that lists the attributes of its element for which a reference may give values.
pub const OFFERS: &str = "parameterAttributes";

/// A document of a set and the targets of its references within the set.
#[derive(Debug, Clone)]
pub struct Piece<'d> {
    /// The document.
    pub document: Document<'d>,
    /// Its references that were followed. [`Link::to`] is an index of a piece.
    pub links: Vec<Link>,
}

/// Returns the archive that contains a document. For an archive within another one it is
/// `archive!member`.
pub fn archive_of(path: &str) -> Option<&str> {
    archive_and_member(path).map(|(archive, _)| archive)
}

/// Checks whether a document is the main scenario of an archive that was referred to.
pub fn is_archive(document: Document<'_>) -> bool {
    archive_and_member(document.path()).is_some_and(|(_, member)| member == MAIN_MEMBER)
}

fn archive_and_member(path: &str) -> Option<(&str, &str)> {
    let is_archive = |path: &str| FileKind::of_path(Path::new(path)) == Some(FileKind::Mosc);
    path.rsplit_once('!')
        .filter(|(archive, _)| is_archive(archive))
}
