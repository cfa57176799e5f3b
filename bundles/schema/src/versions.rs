//! Selection of the schema for a file: the shipped tables and the choice among them by the header.

use std::sync::OnceLock;

use qcbus_document::{Document, FileKind};

use crate::model::Schema;
use crate::notation::NotationError;

/// `revMajor` and `revMinor` of a header.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Version {
    /// `revMajor`
    pub major: u32,
    /// `revMinor`
    pub minor: u32,
}

impl std::fmt::Display for Version {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}.{}", self.major, self.minor)
    }
}

/// The tables of one published schema, parsed when first needed.
#[derive(Debug)]
pub struct Shipped {
    /// The kind of file that the schema describes.
    pub kind: FileKind,
    /// The header version that the schema applies to.
    pub version: Version,
    /// The tables in text notation.
    pub notation: &'static str,
    loaded: OnceLock<Result<Schema, NotationError>>,
}

macro_rules! shipped {
    ($($kind:ident $major:literal $minor:literal $file:literal)*) => {
        /// All shipped tables, oldest first.
        pub static SHIPPED: [Shipped; 13] = [$(Shipped {
            kind: FileKind::$kind,
            version: Version { major: $major, minor: $minor },
            notation: include_str!(concat!("../tables/", $file)),
            loaded: OnceLock::new(),
        },)*];
    };
}

// OpenDRIVE 1.8 means 1.8.1, and OpenSCENARIO 1.1 means 1.1.1. Headers do not distinguish patch
// releases, and the later ones correct the earlier. The tables of OpenDRIVE 1.9 are written by
// hand: those of 1.8.1 with the elements, attributes and words that the text of 1.9.0 adds.
shipped! {
    Xodr 1 1 "xodr-1.1.tbl"
    Xodr 1 2 "xodr-1.2.tbl"
    Xodr 1 3 "xodr-1.3.tbl"
    Xodr 1 4 "xodr-1.4.tbl"
    Xodr 1 5 "xodr-1.5.tbl"
    Xodr 1 6 "xodr-1.6.tbl"
    Xodr 1 7 "xodr-1.7.tbl"
    Xodr 1 8 "xodr-1.8.tbl"
    Xodr 1 9 "xodr-1.9.tbl"
    Xosc 1 0 "xosc-1.0.tbl"
    Xosc 1 1 "xosc-1.1.tbl"
    Xosc 1 2 "xosc-1.2.tbl"
    Xosc 1 3 "xosc-1.3.tbl"
}

impl Shipped {
    /// Returns the parsed tables.
    ///
    /// # Errors
    /// Returns an error if the shipped file is invalid. A test ensures that it is valid.
    pub fn schema(&self) -> Result<&Schema, &NotationError> {
        self.loaded
            .get_or_init(|| Schema::from_notation(self.notation))
            .as_ref()
    }
}

/// Returns the version in the header. Blanks around the numbers and leading zeros are allowed.
pub fn version_of(document: &Document<'_>, kind: FileKind) -> Option<Version> {
    let header = if kind == FileKind::Xodr {
        "header"
    } else {
        "FileHeader"
    };
    let header = document.root()?.child(header)?;
    let number = |name: &str| header.attr(name)?.trim().parse().ok();
    Some(Version {
        major: number("revMajor")?,
        minor: number("revMinor")?,
    })
}

/// Checks whether another version than that of this schema declares such a child. Then the name is
/// not a typing error.
pub(crate) fn is_known_elsewhere(schema: &Schema, parent: &str, child: &str) -> bool {
    let is_own = |one: &&Shipped| {
        let loaded = one.loaded.get().and_then(|loaded| loaded.as_ref().ok());
        loaded.is_some_and(|loaded| std::ptr::eq(loaded, schema))
    };
    // A user's own schema has no other versions.
    let Some(own) = SHIPPED.iter().find(is_own) else {
        return false;
    };
    let of_kind = SHIPPED.iter().filter(|one| one.kind == own.kind);
    let mut others = of_kind.filter(|one| one.version != own.version);
    others.any(|one| {
        let other = one.schema();
        other.is_ok_and(|other| other.knows_child(parent, child))
    })
}

/// Reasons why no schema applies.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SkipReason {
    /// The header or its version is missing, or the version is not a number.
    #[error("the file header states no valid version, so no schema can be chosen")]
    NoVersion,
    /// Versions before 1.0 have no published schema.
    #[error("version {0} has no published schema: major version 0")]
    MajorZero(Version),
    /// An old version without a schema.
    #[error("version {0} has no published schema")]
    NoSchema(Version),
    /// The tables cannot be used.
    #[error("the tables cannot be used: failed to {0}")]
    Tables(NotationError),
    /// The file is not well-formed, so the tree is partial.
    #[error("the file is not well-formed XML, so only a part of it can be read")]
    IllFormed,
}

/// A schema, and whether the file declares a newer version.
pub(crate) struct Selection {
    pub(crate) schema: &'static Schema,
    pub(crate) newer: bool,
}

/// Returns the shipped schema for a version.
pub(crate) fn select(kind: FileKind, version: Version) -> Result<Selection, SkipReason> {
    if version.major == 0 {
        return Err(SkipReason::MajorZero(version));
    }
    let kind = if kind == FileKind::Xodr {
        FileKind::Xodr
    } else {
        FileKind::Xosc
    };
    let of_kind = || SHIPPED.iter().filter(|one| one.kind == kind);
    let exact = of_kind().find(|one| one.version == version);
    let newest = of_kind()
        .max_by_key(|one| one.version)
        .filter(|newest| version > newest.version);
    let newer = exact.is_none();
    let chosen = exact.or(newest).ok_or(SkipReason::NoSchema(version))?;
    let schema = chosen
        .schema()
        .map_err(|error| SkipReason::Tables(error.clone()))?;
    Ok(Selection { schema, newer })
}
