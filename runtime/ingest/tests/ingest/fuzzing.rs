//! Bodies of the fuzz targets, run as seeded tests on stable.

use std::convert::Infallible;
use std::path::Path;

use qcbus_document::{Document, Node};
use qcbus_messages::{Absence, DocumentRole};

use qcbus_ingest::modular::{ExpandedImage, Expansion, Piece, SearchPath, expand, pack};
use qcbus_ingest::{Limits, Reader, Source, Walking, gather, prepare_bytes, references};

/// Checks arbitrary bytes under names of every kind. An image exists, it is valid, its places can
/// be found, and it does not exceed its bound.
///
/// # Panics
/// If one of these conditions is violated.
pub fn ingest(bytes: &[u8]) {
    let limits = Limits {
        max_file: 1 << 20,
        max_unpacked: 1 << 22,
        ..Limits::default()
    };
    for name in ["fuzz.xodr", "fuzz.xodr.gz", "fuzz.xosc", "fuzz.mosc"] {
        let prepared = prepare_bytes(Path::new(name), bytes.to_vec(), &limits);
        let image = prepared.build();
        let document = match Document::open(&image) {
            Ok(document) => document,
            Err(error) => panic!("{name}: {error}"),
        };
        if let Err(error) = document.validate() {
            panic!("{name}: {error}");
        }
        for fault in document.faults() {
            assert!(document.position(fault.offset).row > 0);
        }
        if document.root().is_none() {
            assert!(
                document.faults().next().is_some(),
                "{name}: a document without a root must have a fault"
            );
        }
        references(&document, &SearchPath::default());
    }
}

/// Documents of an archive in memory. No other files are read.
struct Files {
    reader: Reader,
    images: Vec<Vec<u8>>,
}

impl Source for Files {
    type Document = Vec<u8>;
    type Halt = Infallible;

    fn fetch(&mut self, path: &Path) -> Result<Result<Vec<u8>, Absence>, Infallible> {
        if !path.to_string_lossy().starts_with("/fuzz.mosc!") {
            return Ok(Err(Absence::NotThere));
        }
        let prepared = self.reader.prepare(path, Path::new("/"));
        Ok(prepared
            .map(|prepared| prepared.build())
            .map_err(|error| error.to_absence()))
    }

    fn image(document: &Vec<u8>) -> &[u8] {
        document
    }

    fn listing(&mut self, archive: &Path) -> Result<Option<Vec<u8>>, Infallible> {
        let listing = self.reader.listing(archive, Path::new("/"));
        Ok(listing.ok().flatten().map(|prepared| prepared.build()))
    }

    fn expanded(
        &self,
        expanded: &ExpandedImage<'_, '_>,
    ) -> Result<Result<Vec<u8>, Absence>, Infallible> {
        Ok(Ok(expanded.build()))
    }

    fn kept(&self, index: usize) -> &[u8] {
        &self.images[index]
    }

    fn keep(&mut self, _: &Path, _: DocumentRole, _: u32, image: Vec<u8>) {
        self.images.push(image);
    }
}

/// Outcome of an archive.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Outcome {
    /// The expanded scenario.
    Expanded(String),
    /// At least one reason why the archive cannot be expanded.
    Stopped(String),
}

/// Expands any archive, or returns the reason why it cannot be expanded. The expanded text is
/// well-formed, its image is valid and the same tree, and expanding it again changes nothing.
///
/// # Panics
/// If one of these conditions is violated.
pub fn archive(bytes: &[u8]) -> Outcome {
    let limits = Limits {
        max_archive: 1 << 22,
        max_image: 1 << 26,
        ..Limits::default()
    };
    let mut reader = Reader::new(limits);
    let root = reader
        .prepare_bytes(Path::new("/fuzz.mosc"), bytes.to_vec())
        .build();
    let mut store = Files {
        reader,
        images: Vec::new(),
    };
    let Ok(root) = Document::open(&root) else {
        return Outcome::Stopped("the root is no image".to_owned());
    };
    let search = SearchPath::default();
    let walking = Walking {
        max_documents: 64,
        max_text: limits.max_archive,
        max_image: limits.max_image,
        search: &search,
    };
    let Ok(found) = gather(&root, &walking, &mut store);
    let images = store.images.iter().map(|image| Document::open(image));
    let documents = std::iter::once(root).chain(images.filter_map(Result::ok));
    let pieces: Vec<Piece<'_>> = documents
        .zip(found.links)
        .map(|(document, links)| Piece { document, links })
        .collect();
    let expansion = expand(pieces, limits.max_archive);
    if let Some(obstacle) = expansion.obstacles().next() {
        return Outcome::Stopped(obstacle.text.clone());
    }
    match expansion.image(limits.max_image) {
        Some(image) => Outcome::Expanded(sound(&expansion, &image.build())),
        None => Outcome::Stopped("the image is too large".to_owned()),
    }
}

/// Packs these files into an archive and expands it as [`archive`] does.
///
/// # Panics
/// As [`archive`].
pub fn assembled(files: &[(String, Vec<u8>)]) -> Outcome {
    match pack(files) {
        Ok(bytes) => archive(&bytes),
        Err(error) => Outcome::Stopped(error.to_string()),
    }
}

fn sound(expansion: &Expansion<'_>, image: &[u8]) -> String {
    let text = expansion.text();
    let whole = expansion.pieces[0].document.root().is_some();
    let document = match Document::open(image) {
        Ok(document) => document,
        Err(error) => panic!("the expanded image must be valid: {error}"),
    };
    if let Err(error) = document.validate() {
        panic!("the expanded image must be valid: {error}");
    }
    let again = prepare_bytes(
        Path::new("/again.xosc"),
        text.clone().into_bytes(),
        &Limits::default(),
    );
    let again = again.build();
    let again = match Document::open(&again) {
        Ok(again) => again,
        Err(error) => panic!("the expanded text must be readable: {error}"),
    };
    if let Some(fault) = again
        .faults()
        .find(|fault| fault.code.makes_partial() && whole)
    {
        panic!(
            "the expanded text must have no such fault: {}\n{text}",
            fault.text
        );
    }
    assert_eq!(tree(document), tree(again), "{text}");
    let same = expand(
        vec![Piece {
            document: again,
            links: Vec::new(),
        }],
        u64::MAX,
    );
    assert_eq!(same.text(), text, "a second expansion changes nothing");
    text
}

/// Returns the contents of a document: names, attributes, characters, and their depth.
fn tree(document: Document<'_>) -> Vec<String> {
    let depth = |node: Node<'_>| node.ancestors().count();
    let nodes = (0..document.len()).filter_map(|index| document.node(index));
    let mut said: Vec<String> = Vec::new();
    for node in nodes {
        if node.is_element() {
            let attributes: Vec<String> = node
                .attributes()
                .filter(|attribute| !attribute.name().starts_with("xmlns"))
                .map(|attribute| format!("{}={:?}", attribute.name(), attribute.value()))
                .collect();
            said.push(format!("{} {} {attributes:?}", depth(node), node.name()));
        } else {
            said.push(format!("{} {:?}", depth(node), node.character_run()));
        }
    }
    said
}
