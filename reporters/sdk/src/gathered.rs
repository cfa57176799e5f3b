//! A checked file with all files that it refers to.

use std::convert::Infallible;
use std::path::Path;

use qcbus_document::{Document, Image};
use qcbus_ingest::modular::{ExpandedImage, SearchPath};
use qcbus_ingest::{Limits, Source, Walking};
use qcbus_messages::path_text::{from_text, split_archive, to_text};
use qcbus_messages::{Absence, DocumentRole, MissingDocument, ResultMessage};

use crate::Sources;

/// Maximum number of files that a checked file may refer to in a report.
const MOST_DOCUMENTS: usize = 1024;

/// The image of a checked file and of the files that it refers to, with the checked bytes.
#[derive(Debug)]
pub struct Gathered {
    /// Image of the checked file.
    pub root: Image,
    /// The files that it refers to, in the order of the references.
    pub linked: Vec<GatheredFile>,
    /// Files that are missing, or whose checked bytes are no longer available.
    pub missing: Vec<MissingDocument>,
}

/// A file that a checked file refers to.
#[derive(Debug)]
pub struct GatheredFile {
    /// Its path.
    pub path: String,
    /// Its role.
    pub role: DocumentRole,
    /// Offset of the referring element in the image of the checked file.
    pub referred_at: u32,
    /// Its image.
    pub image: Image,
}

impl Gathered {
    /// Gathers the files of a result. Returns `None` if the checked bytes of the checked file are
    /// no longer available.
    pub fn of(result: &ResultMessage, sources: &dyn Sources) -> Option<Gathered> {
        let root = image(sources, &result.input)?;
        let document = Document::open(&root).ok()?;
        let mut store = Store {
            sources,
            linked: Vec::new(),
        };
        let search = SearchPath::of_environment();
        let limits = Limits::default();
        let walking = Walking {
            max_documents: MOST_DOCUMENTS,
            max_text: limits.max_archive,
            max_image: limits.max_image,
            search: &search,
        };
        let Ok(found) = qcbus_ingest::gather(&document, &walking, &mut store);
        let linked = store.linked;
        Some(Gathered {
            root: Image::new(root),
            linked,
            missing: found.missing,
        })
    }
}

fn image(sources: &dyn Sources, path: &str) -> Option<Vec<u8>> {
    let mut found = None;
    // The source is locked during the call, so the bytes are copied.
    sources.image(path, &mut |image| found = Some(image.to_vec()));
    found
}

struct Store<'s> {
    sources: &'s dyn Sources,
    linked: Vec<GatheredFile>,
}

impl Source for Store<'_> {
    type Document = Vec<u8>;
    type Halt = Infallible;

    fn fetch(&mut self, path: &Path) -> Result<Result<Vec<u8>, Absence>, Infallible> {
        let text = to_text(path);
        let file = split_archive(&text).map_or(text.as_str(), |(archive, _)| archive);
        Ok(
            image(self.sources, &text).ok_or_else(|| match from_text(file).exists() {
                true => Absence::Unreadable {
                    why: "has changed since the check".to_owned(),
                },
                false => Absence::NotThere,
            }),
        )
    }

    fn image(document: &Vec<u8>) -> &[u8] {
        document
    }

    fn listing(&mut self, _: &Path) -> Result<Option<Vec<u8>>, Infallible> {
        Ok(None)
    }

    fn expanded(
        &self,
        expanded: &ExpandedImage<'_, '_>,
    ) -> Result<Result<Vec<u8>, Absence>, Infallible> {
        Ok(Ok(expanded.build()))
    }

    fn kept(&self, index: usize) -> &[u8] {
        self.linked.get(index).map_or(&[], |file| &file.image)
    }

    fn keep(&mut self, path: &Path, role: DocumentRole, referred_at: u32, document: Vec<u8>) {
        self.linked.push(GatheredFile {
            path: to_text(path),
            role,
            referred_at,
            image: Image::new(document),
        });
    }
}
