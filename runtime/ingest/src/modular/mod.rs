//! Modular scenarios: an OpenSCENARIO file whose maneuver groups are taken from other files by
//! `ScenarioReference`, with some of their attributes replaced.
//!
//! [`expand`] makes one plain scenario of the documents of a set, in memory and without looking
//! anywhere else. What it makes is written as text ([`Expansion::text`]), with the formatting of the
//! files, or as a document image ([`Expansion::image`]), whose text *is* that of the files: so each
//! element and each value of it knows where it comes from.

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

/// How deeply scenarios may refer to scenarios.
pub const MAX_DEPTH: u32 = 32;

/// The attribute that lists the attributes of its element for which a reference may give values.
pub const OFFERS: &str = "parameterAttributes";

/// A document of a set, with where its references lead within the set.
#[derive(Debug, Clone)]
pub struct Piece<'d> {
    /// The document.
    pub document: Document<'d>,
    /// Its references that were followed; [`Link::to`] counts the pieces.
    pub links: Vec<Link>,
}

/// The archive that a document lies in; of one within another, `archive!member`.
pub fn archive_of(path: &str) -> Option<&str> {
    archive_and_member(path).map(|(archive, _)| archive)
}

/// Whether a document is the scenario that an archive starts from, where that was referred to.
pub fn is_archive(document: Document<'_>) -> bool {
    archive_and_member(document.path()).is_some_and(|(_, member)| member == MAIN_MEMBER)
}

fn archive_and_member(path: &str) -> Option<(&str, &str)> {
    let is_archive = |path: &str| FileKind::of_path(Path::new(path)) == Some(FileKind::Mosc);
    path.rsplit_once('!')
        .filter(|(archive, _)| is_archive(archive))
}
