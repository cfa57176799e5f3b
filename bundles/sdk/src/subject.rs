//! The subject of a check: a root document and the documents that it refers to.

use std::sync::{Arc, Mutex, PoisonError};

use qcbus_document::{Document, FileKind, Image, ImageError, Node, XPaths};
use qcbus_formats::config::Config;
use qcbus_ingest::Limits;
use qcbus_ingest::modular::{Expansion, Piece};
use qcbus_messages::{DocumentRole, Link, MissingDocument};

use crate::cached::{ImageId, JobModels};
use crate::{LinkedModel, Reads, ResourceValue, Version};

/// The documents of one check.
#[derive(Debug, Clone)]
pub struct Subject<'d> {
    root: Document<'d>,
    /// Image of `root`.
    image: &'d Image,
    written: Document<'d>,
    is_expanded: bool,
    links: Vec<Link>,
    kind: FileKind,
    version: Option<Version>,
    linked: Vec<Linked<'d>>,
    missing: Vec<MissingDocument>,
    resources: Vec<ResourceValue>,
    config: Option<Arc<Config>>,
    paths: Arc<Mutex<XPaths>>,
}

/// A document that the root refers to.
#[derive(Debug, Clone)]
pub struct Linked<'d> {
    /// The document.
    pub document: Document<'d>,
    /// Its role for the root.
    pub role: DocumentRole,
    /// Absolute path; for a member of an archive, the archive's path, `!` and the member's name.
    pub path: String,
    /// Byte offset of the referring element in the root's image.
    pub referred_at: u32,
    /// Targets of its own references to maps and scenarios. The root counts as the first document.
    pub links: &'d [Link],
    image: &'d LinkedImage,
    models: JobModels,
}

/// A document that a root refers to, in the form in which the checking thread holds it.
#[derive(Debug, Clone)]
pub(crate) struct LinkedImage {
    pub role: DocumentRole,
    pub path: String,
    pub referred_at: u32,
    pub links: Vec<Link>,
    pub id: ImageId,
    pub image: Image,
}

impl LinkedImage {
    /// Opens the document, with access to the cached models.
    pub(crate) fn open(&self, models: &JobModels) -> Result<Linked<'_>, ImageError> {
        Ok(Linked {
            document: self.image.document()?,
            role: self.role,
            path: self.path.clone(),
            referred_at: self.referred_at,
            links: &self.links,
            image: self,
            models: models.clone(),
        })
    }
}

impl Linked<'_> {
    /// Returns the document's image, for callers that keep data derived from it for longer than the
    /// check.
    pub fn image(&self) -> &Image {
        &self.image.image
    }

    /// Returns a cached model of the document, or `None` if it cannot be built. It is built on
    /// first use and shared by all rules. It is kept for the next root that refers to the same
    /// document, if the bytes of it and of its includes are the same.
    ///
    /// Computations that are slow on a large document belong in such a model. A root then costs
    /// only its own checks, not those of its map.
    pub fn cached<M: LinkedModel>(&self) -> Option<Arc<M>> {
        self.models.get(self.image.id, &self.image.image)
    }
}

impl<'d> Subject<'d> {
    /// Creates a subject from a single root document. `version_of` reads the version that the
    /// document names.
    ///
    /// # Errors
    /// As [`Document::open`].
    pub fn new(
        image: &'d Image,
        kind: FileKind,
        version_of: fn(&Document<'_>) -> Option<Version>,
    ) -> Result<Subject<'d>, ImageError> {
        let root = image.document()?;
        let version = version_of(&root);
        Ok(Subject {
            root,
            image,
            written: root,
            is_expanded: false,
            links: Vec::new(),
            kind,
            version,
            linked: Vec::new(),
            missing: Vec::new(),
            resources: Vec::new(),
            config: None,
            paths: Arc::new(Mutex::new(XPaths::new(root))),
        })
    }

    /// Adds the documents that the root refers to, and those that are not available.
    #[must_use]
    pub fn with(mut self, linked: Vec<Linked<'d>>, missing: Vec<MissingDocument>) -> Subject<'d> {
        self.linked = linked;
        self.missing = missing;
        self
    }

    /// Sets the targets of the root's references to maps and scenarios. The root counts as the
    /// first document, and the linked ones follow.
    #[must_use]
    pub fn with_links(mut self, links: Vec<Link>) -> Subject<'d> {
        self.links = links;
        self
    }

    /// Returns the same subject for a bundle that reads modular scenarios in this way.
    #[must_use]
    pub fn read(mut self, reads: Reads) -> Subject<'d> {
        if reads == Reads::Expanded {
            let expanded = self.with_role(DocumentRole::Expanded).next();
            if let Some(expanded) = expanded {
                (self.root, self.image) = (expanded.document, &expanded.image.image);
                self.is_expanded = true;
            }
            self.paths = Arc::new(Mutex::new(XPaths::new(self.root)));
        }
        self
    }

    /// Returns the same subject with the data made from the user's files; see [`crate::Resource`].
    #[must_use]
    pub fn with_resources(mut self, resources: Vec<ResourceValue>) -> Subject<'d> {
        self.resources = resources;
        self
    }

    /// Returns the same subject under the configuration in force.
    #[must_use]
    pub(crate) fn under(mut self, config: Option<Arc<Config>>) -> Subject<'d> {
        self.config = config;
        self
    }

    /// Returns the configuration in force, for callers that pass it on to another program. Rules
    /// get their parameters from their [`crate::Sink`].
    pub fn config(&self) -> Option<&Config> {
        self.config.as_deref()
    }

    /// Returns the data made from the user's files, if the user gave any to this bundle.
    pub fn resource<T: 'static>(&self) -> Option<&T> {
        self.resources.iter().find_map(|one| one.downcast_ref())
    }

    /// Returns the root file as written, even if the root is its expansion.
    pub fn written(&self) -> Document<'d> {
        self.written
    }

    /// Returns whether the root is the expansion of a modular scenario.
    pub fn is_expanded(&self) -> bool {
        self.is_expanded
    }

    /// Returns the targets of the written root's references to maps and scenarios.
    pub fn links(&self) -> &[Link] {
        &self.links
    }

    /// Expands the written root and returns the result with all faults found on the way.
    pub fn expansion(&self) -> Expansion<'d> {
        let root = Piece {
            document: self.written,
            links: self.links.clone(),
        };
        let linked = self.linked.iter().map(|linked| Piece {
            document: linked.document,
            links: linked.links.to_vec(),
        });
        let pieces = std::iter::once(root).chain(linked).collect();
        qcbus_ingest::modular::expand(pieces, Limits::default().max_archive)
    }

    /// Returns the document that is checked.
    pub fn root(&self) -> Document<'d> {
        self.root
    }

    /// Returns the image of the checked document, for callers that keep data derived from it for
    /// longer than the check.
    pub fn image(&self) -> &'d Image {
        self.image
    }

    /// Returns the kind of file that the root file's name indicates.
    pub fn kind(&self) -> FileKind {
        self.kind
    }

    /// Returns the version of its standard that the root names, if any.
    pub fn version(&self) -> Option<Version> {
        self.version
    }

    /// Returns the documents that the root refers to, in the order of the references.
    pub fn linked(&self) -> &[Linked<'d>] {
        &self.linked
    }

    /// Returns the documents of one role, in the order of the references.
    pub fn with_role(&self, role: DocumentRole) -> impl Iterator<Item = &Linked<'d>> {
        self.linked.iter().filter(move |linked| linked.role == role)
    }

    /// Returns the XPath of an element. The positions among siblings in the root document are
    /// cached, so many findings within one large parent stay cheap.
    pub(crate) fn xpath(&self, node: Node<'_>) -> String {
        self.paths
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .xpath(node)
    }

    /// Returns the documents that the root refers to and that are not available.
    pub fn missing(&self) -> &[MissingDocument] {
        &self.missing
    }
}
