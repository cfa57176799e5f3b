//! What is checked: a root document and the documents that it refers to.

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
    /// What `root` is read from.
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
    /// What it is to the root.
    pub role: DocumentRole,
    /// Absolute path; for a member of an archive, the archive's path, `!` and the member's name.
    pub path: String,
    /// Byte offset of the element in the root's image that leads here.
    pub referred_at: u32,
    /// Where its own references to maps and scenarios lead; the root counts as the first document.
    pub links: &'d [Link],
    image: &'d LinkedImage,
    models: JobModels,
}

/// A document that a root refers to, as whoever checks has it in hand.
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
    /// The document, with models of it from among those that are kept.
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
    /// The document's image, for whoever keeps what he made of it longer than he was given it.
    pub fn image(&self) -> &Image {
        &self.image.image
    }

    /// A model of the document that is built when it is first asked for, shared by all rules, and
    /// kept for the next root that refers to the same document with the same bytes, in it and in
    /// all that it includes. `None` when nothing can be made of the document.
    ///
    /// What costs time on a large document belongs into such a model, so that a root costs its own
    /// checks and not those of its map.
    pub fn cached<M: LinkedModel>(&self) -> Option<Arc<M>> {
        self.models.get(self.image.id, &self.image.image)
    }
}

impl<'d> Subject<'d> {
    /// A root document on its own. `version_of` reads what the document says about itself.
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

    /// Adds the documents that the root refers to, and those that could not be had.
    #[must_use]
    pub fn with(mut self, linked: Vec<Linked<'d>>, missing: Vec<MissingDocument>) -> Subject<'d> {
        self.linked = linked;
        self.missing = missing;
        self
    }

    /// Says where the root's references to maps and scenarios lead; the root counts as the first
    /// document, the linked ones follow.
    #[must_use]
    pub fn with_links(mut self, links: Vec<Link>) -> Subject<'d> {
        self.links = links;
        self
    }

    /// The same subject as a bundle looks at it that reads modular scenarios in this way.
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

    /// The same subject with what was made of the user's files; see [`crate::Resource`].
    #[must_use]
    pub fn with_resources(mut self, resources: Vec<ResourceValue>) -> Subject<'d> {
        self.resources = resources;
        self
    }

    /// The same subject under the configuration in force.
    #[must_use]
    pub(crate) fn under(mut self, config: Option<Arc<Config>>) -> Subject<'d> {
        self.config = config;
        self
    }

    /// The configuration in force, for whoever hands it on to another program; rules have their parameters from their
    /// [`crate::Sink`].
    pub fn config(&self) -> Option<&Config> {
        self.config.as_deref()
    }

    /// What was made of the user's files, if the user gave any to this bundle.
    pub fn resource<T: 'static>(&self) -> Option<&T> {
        self.resources.iter().find_map(|one| one.downcast_ref())
    }

    /// The root file as it is written, also where the root is what it was expanded to.
    pub fn written(&self) -> Document<'d> {
        self.written
    }

    /// Whether the root is what a modular scenario was expanded to.
    pub fn is_expanded(&self) -> bool {
        self.is_expanded
    }

    /// Where the written root's references to maps and scenarios lead.
    pub fn links(&self) -> &[Link] {
        &self.links
    }

    /// What becomes of the written root when it is expanded, with all that is wrong on the way.
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

    /// The document that is checked.
    pub fn root(&self) -> Document<'d> {
        self.root
    }

    /// The image of the document that is checked, for whoever keeps what he made of it longer than he was given it.
    pub fn image(&self) -> &'d Image {
        self.image
    }

    /// What the root file's name promises.
    pub fn kind(&self) -> FileKind {
        self.kind
    }

    /// The version of its standard that the root names, if it names one.
    pub fn version(&self) -> Option<Version> {
        self.version
    }

    /// The documents that the root refers to, in the order of the references.
    pub fn linked(&self) -> &[Linked<'d>] {
        &self.linked
    }

    /// The documents of one role, in the order of the references.
    pub fn with_role(&self, role: DocumentRole) -> impl Iterator<Item = &Linked<'d>> {
        self.linked.iter().filter(move |linked| linked.role == role)
    }

    /// The XPath of an element. Many findings within one large parent cost no more than few: what
    /// tells the root document's elements from their siblings is remembered.
    pub(crate) fn xpath(&self, node: Node<'_>) -> String {
        self.paths
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .xpath(node)
    }

    /// What the root refers to and could not be had.
    pub fn missing(&self) -> &[MissingDocument] {
        &self.missing
    }
}
