//! Loads a subject from files without a broker, for single runs and for the examples of pages.

use std::convert::Infallible;
use std::path::{Path, PathBuf};

use qcbus_document::{FileKind, Image, ImageError, Suffix};
use qcbus_formats::pool::{BundleOutcome, Remark};
use qcbus_ingest::modular::{ExpandedImage, SearchPath};
use qcbus_ingest::{IngestError, Limits, Prepared, Reader, Source, Walking};
use qcbus_messages::path_text::to_text;
use qcbus_messages::{Absence, Digest, DocumentRole, Link, MissingDocument};

use crate::cached::JobModels;
use crate::subject::LinkedImage;
use crate::{Bundle, Subject};

/// A root document and the documents it refers to, as images in memory.
pub struct Loaded {
    kind: FileKind,
    path: PathBuf,
    digest: Digest,
    root: Image,
    links: Vec<Link>,
    linked: Vec<LinkedImage>,
    missing: Vec<MissingDocument>,
}

/// Reasons why a file cannot be loaded; the text follows "failed to ".
#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    /// The name does not belong to any kind of file that can be checked.
    #[error("check {}: its name must end in one of {}", to_text(.0), Suffix::list())]
    UnknownKind(PathBuf),
    /// The file cannot be read at all.
    #[error("{error}")]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// The reason.
        error: String,
    },
    /// A built image cannot be opened. This is an internal error.
    #[error("open the image of a document: {0}")]
    Image(#[from] ImageError),
}

impl Loaded {
    /// Reads a file and everything that it refers to. Includes and archives stay inside `boundary`.
    ///
    /// # Errors
    /// [`LoadError`] if nothing can be checked. An ill-formed file is not an error: its faults are
    /// in the image.
    pub fn from_path(path: &Path, boundary: &Path) -> Result<Loaded, LoadError> {
        Loaded::searching(path, boundary, &SearchPath::of_environment())
    }

    /// Reads a file as [`Loaded::from_path`] does, with a given search path for scenarios instead
    /// of that of the environment.
    ///
    /// # Errors
    /// As [`Loaded::from_path`].
    pub fn searching(
        path: &Path,
        boundary: &Path,
        search: &SearchPath,
    ) -> Result<Loaded, LoadError> {
        let kind = kind_of(path)?;
        let mut reader = Reader::new(Limits::default());
        let prepared = reader.prepare(path, boundary).map_err(|error| {
            let error = error.to_string();
            LoadError::Unreadable {
                path: path.to_owned(),
                error,
            }
        })?;
        let mut loaded = Loaded::of(kind, path, &prepared);
        loaded.follow(reader, boundary, search)?;
        Ok(loaded)
    }

    /// Creates a subject from the content of a file, without following references.
    ///
    /// # Errors
    /// [`LoadError::UnknownKind`].
    pub fn from_bytes(path: &Path, bytes: Vec<u8>) -> Result<Loaded, LoadError> {
        let kind = kind_of(path)?;
        let prepared = qcbus_ingest::prepare_bytes(path, bytes, &Limits::default());
        Ok(Loaded::of(kind, path, &prepared))
    }

    /// Opens the documents for a check by a bundle.
    ///
    /// # Errors
    /// [`LoadError::Image`].
    pub fn subject(&self, bundle: &Bundle) -> Result<Subject<'_>, LoadError> {
        // There is no next job, so the models serve the rules of this one only.
        let models = JobModels::default();
        let linked = self.linked.iter().map(|linked| linked.open(&models));
        let linked = linked.collect::<Result<_, ImageError>>()?;
        let subject = Subject::new(&self.root, self.kind, bundle.version_of)?;
        let subject = subject.with(linked, self.missing.clone());
        Ok(subject.with_links(self.links.clone()).read(bundle.reads))
    }

    /// Returns the findings of qcbus itself: references without a target, and faults of the file
    /// that no bundle reports.
    ///
    /// # Errors
    /// [`LoadError::Image`].
    pub fn remarks(&self, bundles: &[BundleOutcome]) -> Result<Vec<Remark>, LoadError> {
        Ok(qcbus_ingest::remarks(
            &self.root.document()?,
            &self.missing,
            bundles,
        ))
    }

    /// Returns the kind of file according to its name.
    pub fn kind(&self) -> FileKind {
        self.kind
    }

    /// Returns the path of the file as given.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the digest of the file's bytes on disk.
    pub fn digest(&self) -> Digest {
        self.digest
    }

    fn of(kind: FileKind, path: &Path, prepared: &Prepared) -> Loaded {
        Loaded {
            kind,
            path: path.to_owned(),
            digest: Digest(prepared.digest()),
            root: Image::new(prepared.build()),
            links: Vec::new(),
            linked: Vec::new(),
            missing: Vec::new(),
        }
    }

    fn follow(
        &mut self,
        reader: Reader,
        boundary: &Path,
        search: &SearchPath,
    ) -> Result<(), LoadError> {
        let mut store = SourceStore {
            reader,
            boundary,
            linked: Vec::new(),
        };
        let root = self.root.document()?;
        let walking = Walking {
            max_documents: MAX_DOCUMENTS,
            max_text: Limits::default().max_archive,
            max_image: Limits::default().max_image,
            search,
        };
        let Ok(found) = qcbus_ingest::gather(&root, &walking, &mut store);
        self.missing = found.missing;
        let mut links = found.links.into_iter();
        self.links = links.next().unwrap_or_default();
        for (linked, links) in store.linked.iter_mut().zip(links) {
            linked.links = links;
        }
        self.linked = store.linked;
        Ok(())
    }
}

/// Maximum number of documents that may belong to a file. Their images are in this process, not on
/// the bus.
const MAX_DOCUMENTS: usize = 2048;

/// Source that reads documents from disk into memory.
struct SourceStore<'b> {
    reader: Reader,
    boundary: &'b Path,
    linked: Vec<LinkedImage>,
}

impl Source for SourceStore<'_> {
    type Document = Vec<u8>;
    type Halt = Infallible;

    fn fetch(&mut self, path: &Path) -> Result<Result<Vec<u8>, Absence>, Infallible> {
        // Maps and catalogs may lie anywhere. Their includes must stay in their own directory.
        let boundary = path.parent().unwrap_or(self.boundary);
        let prepared = self.reader.prepare(path, boundary);
        Ok(prepared
            .map(|prepared| prepared.build())
            .map_err(|error: IngestError| error.to_absence()))
    }

    fn image(document: &Vec<u8>) -> &[u8] {
        document
    }

    fn listing(&mut self, archive: &Path) -> Result<Option<Vec<u8>>, Infallible> {
        let listing = self.reader.listing(archive, self.boundary);
        Ok(listing.ok().flatten().map(|prepared| prepared.build()))
    }

    fn expanded(
        &self,
        expanded: &ExpandedImage<'_, '_>,
    ) -> Result<Result<Vec<u8>, Absence>, Infallible> {
        Ok(Ok(expanded.build()))
    }

    fn kept(&self, index: usize) -> &[u8] {
        self.linked.get(index).map_or(&[], |linked| &linked.image)
    }

    fn keep(&mut self, path: &Path, role: DocumentRole, referred_at: u32, image: Vec<u8>) {
        self.linked.push(LinkedImage {
            links: Vec::new(),
            role,
            path: to_text(path),
            referred_at,
            id: (0, self.linked.len() as u64),
            image: Image::new(image),
        });
    }
}

fn kind_of(path: &Path) -> Result<FileKind, LoadError> {
    FileKind::of_path(path).ok_or_else(|| LoadError::UnknownKind(path.to_owned()))
}
