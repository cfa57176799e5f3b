//! User schemas: groups files into schemas and finds the files that each schema is for.

use std::path::Path;
use std::sync::Arc;

use qcbus_document::{Document, FileKind};

use crate::check::{Override, Source};
use crate::compile::{CompileError, compile};
use crate::model::Schema;
use crate::notation::NotationError;
use crate::versions::Version;

/// A schema file of the user. A process with file access has read it.
#[derive(Clone, Copy, Debug)]
pub struct UserSchemaFile<'f> {
    /// Path for messages.
    pub path: &'f str,
    /// Path relative to the directory that the user named.
    pub below: &'f Path,
    /// SHA-256 of its bytes, in hexadecimal.
    pub sha256: &'f str,
    /// Content of the file.
    pub content: UserSchemaContent<'f>,
}

/// Content of a schema file: an XSD or compiled tables.
#[derive(Clone, Copy, Debug)]
pub enum UserSchemaContent<'f> {
    /// The image of an `.xsd` file.
    Xsd(&'f [u8]),
    /// The bytes of a `.tbl` file.
    Tables(&'f [u8]),
}

/// Reason why a user's schemas cannot be used, as a continuation of "failed to ".
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum UserSchemaError {
    /// The compiler rejects an XSD.
    #[error(transparent)]
    Compile(#[from] CompileError),
    /// A table file cannot be read.
    #[error("use the tables {path}: failed to {error}")]
    Tables {
        /// The file.
        path: String,
        /// Reason for the failure.
        error: NotationError,
    },
    /// An image made by qcbus cannot be opened.
    #[error("open the image of {path}: {error}")]
    Image {
        /// The file.
        path: String,
        /// Reason for the failure.
        error: qcbus_document::ImageError,
    },
    /// The schema is for neither standard.
    #[error(
        "use the schema {0}: it declares neither <OpenDRIVE> nor <OpenSCENARIO> as a root element; an XSD that \
         is part of another one must be included there by xs:include and be in the same directory"
    )]
    NoKnownRoot(String),
    /// Two schemas for the same files.
    #[error(
        "choose a schema: {first} and {second} are both for {what}; the version is taken from the file and \
         directory names, such as 1.7/map.xsd"
    )]
    Ambiguous {
        /// First schema.
        first: String,
        /// Second schema.
        second: String,
        /// Files that both schemas are for.
        what: String,
    },
}

/// Builds schemas from a user's files. Those for one version come before those for every version.
///
/// Each `.tbl` is one schema. XSDs form one schema if they are in one directory and include each
/// other. The root element determines the kind of file. The version of tables is the first number
/// of the form `1.7` in their title. Otherwise the name of the file that declares the root gives it
/// (also as `_17_`, as in ASAM's names). Otherwise the directories below the user's directory give
/// it, innermost first. A schema without a version is for all versions.
///
/// # Errors
/// [`UserSchemaError`] for the first unusable file. No file is skipped silently.
pub fn user_schemas(files: &[UserSchemaFile<'_>]) -> Result<Vec<Override>, UserSchemaError> {
    let mut all: Vec<(String, Override)> = Vec::new();
    for file in files {
        if let UserSchemaContent::Tables(bytes) = file.content {
            let schema = tables(file, bytes)?;
            let version = version_in(&schema.title).or_else(|| version_of_path(file.below));
            add(&mut all, schema, &[file], version)?;
        }
    }
    for group in groups(files)? {
        let documents: Vec<Document<'_>> = group.iter().map(|(_, document)| *document).collect();
        let members: Vec<&UserSchemaFile<'_>> = group.iter().map(|(file, _)| *file).collect();
        let main = group
            .iter()
            .find(|(_, document)| declares_root(document))
            .map_or(members[0], |(file, _)| file);
        let schema = compile(&main.below.display().to_string(), &documents)?;
        add(&mut all, schema, &members, version_of_path(main.below))?;
    }
    let mut overrides: Vec<Override> = all.into_iter().map(|(_, one)| one).collect();
    overrides.sort_by_key(|one| one.version.is_none());
    Ok(overrides)
}

/// Root elements, each with its kind of file.
const ROOTS: [(&str, FileKind); 2] = [
    ("OpenDRIVE", FileKind::Xodr),
    ("OpenSCENARIO", FileKind::Xosc),
];

fn add(
    all: &mut Vec<(String, Override)>,
    schema: Schema,
    files: &[&UserSchemaFile<'_>],
    version: Option<Version>,
) -> Result<(), UserSchemaError> {
    let path = files.first().map_or("", |file| file.path).to_owned();
    let sources: Arc<[Source]> = files
        .iter()
        .map(|file| Source {
            path: file.path.to_owned(),
            sha256: file.sha256.to_owned(),
        })
        .collect();
    let schema = Arc::new(schema);
    let mut known = false;
    for (root, kind) in ROOTS {
        if schema.root(root).is_none() {
            continue;
        }
        known = true;
        let taken = all
            .iter()
            .find(|(_, one)| one.kind == kind && one.version == version);
        if let Some((first, _)) = taken {
            return Err(UserSchemaError::Ambiguous {
                first: first.clone(),
                second: path,
                what: version.map_or_else(
                    || format!("every version of {root}"),
                    |version| format!("{root} {version}"),
                ),
            });
        }
        all.push((
            path.clone(),
            Override {
                kind,
                version,
                schema: schema.clone(),
                sources: sources.clone(),
            },
        ));
    }
    if known {
        Ok(())
    } else {
        Err(UserSchemaError::NoKnownRoot(path))
    }
}

fn tables(file: &UserSchemaFile<'_>, bytes: &[u8]) -> Result<Schema, UserSchemaError> {
    let broken = |error| UserSchemaError::Tables {
        path: file.path.to_owned(),
        error,
    };
    let text = std::str::from_utf8(bytes).map_err(|error| {
        let before = bytes.get(..error.valid_up_to()).unwrap_or_default();
        broken(NotationError {
            line: before.iter().filter(|byte| **byte == b'\n').count() + 1,
            what: "the file is not UTF-8 text".to_owned(),
        })
    })?;
    Schema::from_notation(text).map_err(broken)
}

type Member<'f> = (&'f UserSchemaFile<'f>, Document<'f>);

/// Groups the XSDs of each directory that include each other, in the order of their paths.
fn groups<'f>(files: &'f [UserSchemaFile<'f>]) -> Result<Vec<Vec<Member<'f>>>, UserSchemaError> {
    let mut groups: Vec<Vec<Member<'f>>> = Vec::new();
    for file in files {
        let UserSchemaContent::Xsd(image) = file.content else {
            continue;
        };
        let document = Document::open(image).map_err(|error| UserSchemaError::Image {
            path: file.path.to_owned(),
            error,
        })?;
        let mut joined = vec![(file, document)];
        let (related, rest): (Vec<_>, Vec<_>) = groups.into_iter().partition(|group| {
            group
                .iter()
                .any(|other| belong_together(other, &(file, document)))
        });
        groups = rest;
        joined.splice(0..0, related.into_iter().flatten());
        groups.push(joined);
    }
    Ok(groups)
}

fn belong_together(one: &Member<'_>, other: &Member<'_>) -> bool {
    one.0.below.parent() == other.0.below.parent()
        && (includes(&one.1, other.0.below) || includes(&other.1, one.0.below))
}

/// Checks whether a schema document includes a file with this name.
fn includes(document: &Document<'_>, path: &Path) -> bool {
    let name = path.file_name().and_then(|name| name.to_str());
    document.root().is_some_and(|root| {
        root.children_named("include")
            .filter_map(|include| include.attr("schemaLocation"))
            .any(|location| location.rsplit(['/', '\\']).next() == name)
    })
}

fn declares_root(document: &Document<'_>) -> bool {
    document.root().is_some_and(|root| {
        root.children_named("element")
            .filter_map(|element| element.attr("name"))
            .any(|name| ROOTS.iter().any(|(root, _)| *root == name))
    })
}

/// Returns the version in the name of a file, or else of its directories, innermost first.
fn version_of_path(below: &Path) -> Option<Version> {
    let stem = below.file_stem().and_then(|stem| stem.to_str());
    let of_file = stem.and_then(|stem| version_in(stem).or_else(|| two_digits(stem)));
    let directories = below.ancestors().skip(1);
    let names = directories.filter_map(|path| path.file_name()?.to_str());
    of_file.or_else(|| names.filter_map(version_in).next())
}

/// Returns the first number such as `1.7` in a name.
fn version_in(name: &str) -> Option<Version> {
    let mut numbers = name.split(|c: char| !c.is_ascii_digit() && c != '.');
    numbers.find_map(|word| {
        let (major, rest) = word.trim_matches('.').split_once('.')?;
        let minor = rest.split('.').next()?;
        Some(Version {
            major: major.parse().ok()?,
            minor: minor.parse().ok()?,
        })
    })
}

/// Reads `_17` or `_17_` in a name. ASAM names the files of OpenDRIVE 1.6 and 1.7 in this way.
fn two_digits(name: &str) -> Option<Version> {
    name.split('_').skip(1).find_map(|word| {
        let [major @ b'1'..=b'9', minor @ b'0'..=b'9'] = word.as_bytes() else {
            return None;
        };
        Some(Version {
            major: u32::from(major - b'0'),
            minor: u32::from(minor - b'0'),
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn version_is_read_from_schema_path() {
        let of = |path: &str| version_of_path(Path::new(path)).map(|version| version.to_string());
        for (path, version) in [
            ("OpenDRIVE_1.4H.xsd", Some("1.4")),
            ("opendrive_17_core.xsd", Some("1.7")),
            ("1.8.1/OpenDRIVE_Core.xsd", Some("1.8")),
            ("1.5/acme-1.6.xsd", Some("1.6")),
            ("v1.6/inner/acme.xsd", Some("1.6")),
            ("xosc-1.3.tbl", Some("1.3")),
            ("acme.xsd", None),
            ("acme_2024.xsd", None),
            ("acme7.xsd", None),
        ] {
            assert_eq!(of(path).as_deref(), version, "{path}");
        }
    }
}
