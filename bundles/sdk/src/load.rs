//! From files to a subject, without a broker: for one-shot runs and for the examples of pages.

use std::path::{Path, PathBuf};

use qcbus_document::{Document, FileKind, ImageError, Suffix};
use qcbus_ingest::{Limits, Prepared, Reference, Role};
use qcbus_messages::{Digest, DocumentRole, MissingDocument};

use crate::subject::Linked;
use crate::{Bundle, Subject};

/// A root document and what it refers to, as images in memory.
pub struct Loaded {
    kind: FileKind,
    path: PathBuf,
    digest: Digest,
    root: Vec<u8>,
    linked: Vec<LinkedImage>,
    missing: Vec<MissingDocument>,
}

struct LinkedImage {
    role: DocumentRole,
    path: String,
    referred_at: u32,
    image: Vec<u8>,
}

/// Why a file could not be loaded; reads well after "failed to ".
#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    /// Its name promises nothing that can be checked.
    #[error("check {}: its name ends in none of {}", .0.display(), Suffix::list())]
    UnknownKind(PathBuf),
    /// No byte of it could be had.
    #[error("{error}")]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// Why.
        error: String,
    },
    /// An image was built that cannot be opened, which is our fault.
    #[error("open the image of a document: {0}")]
    Image(#[from] ImageError),
}

impl Loaded {
    /// Reads a file and everything that it refers to. Includes and archives stay inside `boundary`.
    ///
    /// # Errors
    /// [`LoadError`] when nothing can be checked. An ill-formed file is no error: its faults are
    /// in the image.
    pub fn from_path(path: &Path, boundary: &Path) -> Result<Loaded, LoadError> {
        let kind = kind_of(path)?;
        let prepared = prepare(path, boundary)?;
        let mut loaded = Loaded::of(kind, path, &prepared);
        loaded.follow(boundary)?;
        Ok(loaded)
    }

    /// A file whose content is at hand and that refers to nothing.
    ///
    /// # Errors
    /// [`LoadError::UnknownKind`].
    pub fn from_bytes(path: &Path, bytes: Vec<u8>) -> Result<Loaded, LoadError> {
        let kind = kind_of(path)?;
        let prepared = qcbus_ingest::prepare_bytes(path, bytes, &Limits::default());
        Ok(Loaded::of(kind, path, &prepared))
    }

    /// The documents, ready to be checked by a bundle.
    ///
    /// # Errors
    /// [`LoadError::Image`].
    pub fn subject(&self, bundle: &Bundle) -> Result<Subject<'_>, LoadError> {
        let root = Document::open(&self.root)?;
        let linked = self.linked.iter().map(|linked| {
            Ok(Linked {
                document: Document::open(&linked.image)?,
                role: linked.role,
                path: linked.path.clone(),
                referred_at: linked.referred_at,
            })
        });
        let linked = linked.collect::<Result<_, ImageError>>()?;
        let subject = Subject::new(root, self.kind, (bundle.version_of)(&root));
        Ok(subject.with(linked, self.missing.clone()))
    }

    /// What the file's name promises.
    pub fn kind(&self) -> FileKind {
        self.kind
    }

    /// The file, as it was named.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Digest of the file's bytes on disk.
    pub fn digest(&self) -> Digest {
        self.digest
    }

    fn of(kind: FileKind, path: &Path, prepared: &Prepared) -> Loaded {
        Loaded {
            kind,
            path: path.to_owned(),
            digest: Digest(prepared.digest()),
            root: prepared.build(),
            linked: Vec::new(),
            missing: Vec::new(),
        }
    }

    fn follow(&mut self, boundary: &Path) -> Result<(), LoadError> {
        let references = qcbus_ingest::references(&Document::open(&self.root)?);
        for reference in references {
            self.load_reference(&reference, boundary);
        }
        Ok(())
    }

    fn load_reference(&mut self, reference: &Reference, boundary: &Path) {
        let Some(role) = role_of(reference.role) else {
            return;
        };
        let missing = |path: &Path, why: String| MissingDocument {
            role,
            reference: reference.text.clone(),
            path: path.display().to_string(),
            why,
            referred_at: reference.offset,
        };
        if let Some(why) = &reference.unresolved {
            self.missing.push(missing(Path::new(""), why.clone()));
        }
        // Every file of a catalog directory is meant; else the first candidate that is there.
        let all = reference.role == Role::CatalogDirectory;
        let (mut failed, mut loaded) = (Vec::new(), false);
        for path in &reference.candidates {
            // Maps and catalogs may lie anywhere; what they include stays around them.
            match prepare(path, path.parent().unwrap_or(boundary)) {
                Ok(prepared) => {
                    self.linked.push(LinkedImage {
                        role,
                        path: path.display().to_string(),
                        referred_at: reference.offset,
                        image: prepared.build(),
                    });
                    loaded = true;
                }
                Err(error) => failed.push(missing(path, error.to_string())),
            }
            if loaded && !all {
                return;
            }
        }
        let told = if all { failed.len() } else { 1 };
        self.missing.extend(failed.into_iter().take(told));
    }
}

/// What a referenced file is to the job; schemas are never read.
fn role_of(role: Role) -> Option<DocumentRole> {
    match role {
        Role::LogicFile => Some(DocumentRole::Map),
        Role::CatalogDirectory => Some(DocumentRole::Catalog),
        Role::ScenarioReference | Role::ScenarioFile => Some(DocumentRole::Scenario),
        Role::Schema => None,
    }
}

fn kind_of(path: &Path) -> Result<FileKind, LoadError> {
    FileKind::of_path(path).ok_or_else(|| LoadError::UnknownKind(path.to_owned()))
}

fn prepare(path: &Path, boundary: &Path) -> Result<Prepared, LoadError> {
    qcbus_ingest::prepare(path, boundary, &Limits::default()).map_err(|error| {
        LoadError::Unreadable {
            path: path.to_owned(),
            error: error.to_string(),
        }
    })
}
