//! Collects the set of documents that belong to a file. All checks use this one walk, for any way
//! of fetching documents.

use std::collections::{BTreeSet, HashMap};
use std::path::{Path, PathBuf};

use qcbus_disk::foreign;
use qcbus_document::{Document, FaultGroup, FileKind};
use qcbus_formats::xqar::Level;
use qcbus_messages::path_text::{from_text, name_of, to_text};
use qcbus_messages::{Absence, DocumentRole, Link, MissingDocument, Within};

use crate::archive::MAIN_MEMBER;
use crate::modular::{ExpandedImage, MAX_DEPTH, Piece, SearchPath, expand, libraries};
use crate::references::{Parameters, Reference, references};
use crate::rests_on::{Member, rests_on};

/// Source that provides and stores documents.
pub trait Source {
    /// A fetched document.
    type Document;
    /// Reason for aborting the whole walk. A later attempt may succeed.
    type Halt;

    /// Reads a document. Returns `Ok(Err(…))` when it is not available.
    ///
    /// # Errors
    /// If no further document can be fetched now.
    fn fetch(&mut self, path: &Path) -> Result<Result<Self::Document, Absence>, Self::Halt>;

    /// Returns the image of a document.
    fn image(document: &Self::Document) -> &[u8];

    /// Returns the listing of an archive of which a member was fetched; see
    /// [`DocumentRole::Listing`].
    ///
    /// # Errors
    /// As [`Source::fetch`].
    fn listing(&mut self, archive: &Path) -> Result<Option<Self::Document>, Self::Halt>;

    /// Stores a document. `referred_at` is the offset of the element in the root that leads to it.
    fn keep(&mut self, path: &Path, role: DocumentRole, referred_at: u32, document: Self::Document);

    /// Returns an image of the expanded form of a modular scenario, or `Ok(Err(…))` if no image is
    /// possible.
    ///
    /// # Errors
    /// As [`Source::fetch`].
    fn expanded(
        &self,
        expanded: &ExpandedImage<'_, '_>,
    ) -> Result<Result<Self::Document, Absence>, Self::Halt>;

    /// Returns the image of a stored document. `index` is the number of documents stored before it.
    fn kept(&self, index: usize) -> &[u8];

    /// Checks that a file exists without reading it.
    ///
    /// # Errors
    /// The reason why it cannot be used.
    fn find(&self, path: &Path) -> Result<(), Absence> {
        match foreign::metadata(path) {
            Ok(data) if data.is_file() => Ok(()),
            Ok(data) if data.is_dir() => Err(Absence::Directory),
            Ok(_) => Err(Absence::NotAFile),
            Err(_) => Err(Absence::NotThere),
        }
    }

    /// Receives the other paths that the walk examined, so that a caller can watch them.
    fn looked(&mut self, look: Look<'_>) {
        let _ = look;
    }
}

/// A path that the set depends on but that is not a document of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Look<'p> {
    /// A file that is missing or could not be read.
    NotHad(&'p Path),
    /// A file that was not read because there are too many, or because it is no file.
    NotRead(&'p Path),
    /// A file that only has to exist. It is no document, but a copy of the root needs it.
    Attached(&'p Path),
    /// A directory from which all files count.
    Listed(&'p Path),
}

/// Limits and search path of a walk.
#[derive(Debug, Clone)]
pub struct Walking<'w> {
    /// Maximum number of documents in a set, including the root.
    pub max_documents: usize,
    /// Maximum number of bytes copied into an expanded scenario.
    pub max_text: u64,
    /// Maximum size of the expanded scenario's image in bytes.
    pub max_image: u64,
    /// Additional directories in which scenarios are looked for.
    pub search: &'w SearchPath,
}

/// Result of a walk: missing documents, links and dependencies.
#[derive(Debug)]
pub struct Found {
    /// Missing or unusable documents, in the order of the references.
    pub missing: Vec<MissingDocument>,
    /// Targets of the references to maps and scenarios, for each document. The root is first.
    pub links: Vec<Vec<Link>>,
    /// Whether the root rests on the document, for each document. The root is first. If so, a fault
    /// of the document is also a fault of everything that runs the root.
    pub rests_on: Vec<bool>,
}

/// Follows the references of a root and fetches their targets. For a modular scenario, it also
/// follows the references of the scenarios that the root takes groups from.
///
/// # Errors
/// If the source aborts the walk.
pub fn gather<S: Source>(
    root: &Document<'_>,
    walking: &Walking<'_>,
    source: &mut S,
) -> Result<Found, S::Halt> {
    let own = from_text(root.path());
    let mut walk = Walk {
        root,
        source,
        walking,
        had: HashMap::from([(own, 0)]),
        documents: vec![Had::of_root(DocumentRole::Root)],
        catalogs: BTreeSet::new(),
        is_expanded: false,
        listed: BTreeSet::new(),
        missing: Vec::new(),
    };
    let of_root = references(root, walking.search);
    let is_modular = of_root.iter().any(|reference| reference.is_library);
    walk.list_archive(root.path())?;
    for reference in &of_root {
        walk.follow(0, reference)?;
    }
    let mut next = 1;
    while next < walk.documents.len() {
        if walk.documents[next].is_library {
            for reference in walk.libraries_of(next) {
                walk.follow(next, &reference)?;
            }
        }
        next += 1;
    }
    if is_modular {
        walk.expand()?;
    }
    let links = walk.documents.iter().map(|had| had.links.clone()).collect();
    let rests_on = rests_on(&walk.set());
    Ok(Found {
        missing: walk.weighed(),
        links,
        rests_on,
    })
}

struct Walk<'w, S> {
    root: &'w Document<'w>,
    source: &'w mut S,
    walking: &'w Walking<'w>,
    /// Index of each document by path.
    had: HashMap<PathBuf, usize>,
    documents: Vec<Had>,
    /// Names of the catalogs found.
    catalogs: BTreeSet<String>,
    /// Whether the last document is the expanded form of a modular scenario.
    is_expanded: bool,
    /// Archives whose members have been listed.
    listed: BTreeSet<PathBuf>,
    /// Missing documents. For a missing catalog directory, with the expected kind of catalogs.
    missing: Vec<(MissingDocument, Option<String>)>,
}

/// Reason why a scenario cannot be expanded, and the element of the root that leads to it.
type Obstacle = (String, u32);

/// A fetched document.
#[derive(Debug)]
struct Had {
    role: DocumentRole,
    links: Vec<Link>,
    is_library: bool,
    /// Minimum number of references from the root to the document.
    depth: u32,
    /// Element of the root that leads to the document.
    referred_at: u32,
}

impl Had {
    fn of_root(role: DocumentRole) -> Had {
        Had {
            role,
            links: Vec::new(),
            is_library: false,
            depth: 0,
            referred_at: 0,
        }
    }
}

impl<S: Source> Walk<'_, S> {
    /// Returns the references of a library to further libraries.
    fn libraries_of(&self, from: usize) -> Vec<Reference> {
        let image = self.source.kept(from - 1);
        Document::open(image).map_or_else(
            |_| Vec::new(),
            |document| libraries(&document, self.walking.search),
        )
    }

    fn follow(&mut self, from: usize, reference: &Reference) -> Result<(), S::Halt> {
        if let Some(directory) = &reference.directory {
            self.source.looked(Look::Listed(directory));
        }
        if let Some(why) = &reference.unresolved {
            let path = reference.directory.as_deref().unwrap_or(Path::new(""));
            let whole = reference.candidates.is_empty();
            let catalogs = reference.catalogs.clone().filter(|_| whole);
            self.miss(from, reference, path, why.clone(), catalogs);
        }
        if reference.role == DocumentRole::Attachment {
            self.attach(from, reference);
            return Ok(());
        }
        let mut first: Option<(&Path, Absence)> = None;
        for path in &reference.candidates {
            let Err(why) = self.candidate(from, reference, path)? else {
                if reference.means_all() {
                    continue;
                }
                return Ok(());
            };
            if reference.is_library && why != Absence::NotThere {
                // An existing library is the intended one, even if it is unusable. A library with
                // the same name further along the search path is not intended.
                self.miss(from, reference, path, why, None);
                return Ok(());
            }
            if reference.means_all() {
                self.miss(from, reference, path, why, None);
            } else if first
                .as_ref()
                .is_none_or(|(_, other)| *other == Absence::NotThere && why != Absence::NotThere)
            {
                // If one of several spellings exists, it is the intended one.
                first = Some((path, why));
            }
        }
        if let Some((path, why)) = first {
            self.miss(from, reference, path, why, None);
        }
        Ok(())
    }

    /// Looks for a file that only has to exist.
    fn attach(&mut self, from: usize, reference: &Reference) {
        let mut missing = None;
        for path in &reference.candidates {
            match self.source.find(path) {
                Ok(()) => return self.source.looked(Look::Attached(path)),
                Err(why) => {
                    self.source.looked(match why {
                        Absence::NotThere => Look::NotHad(path),
                        _ => Look::NotRead(path),
                    });
                    missing.get_or_insert((path, why));
                }
            }
        }
        if let Some((path, why)) = missing {
            self.miss(from, reference, path, why, None);
        }
    }

    /// Fetches one referenced file, unless it has already been fetched.
    fn candidate(
        &mut self,
        from: usize,
        reference: &Reference,
        path: &Path,
    ) -> Result<Result<(), Absence>, S::Halt> {
        if let Some(&to) = self.had.get(path) {
            self.link(from, reference, to);
            return Ok(Ok(()));
        }
        let depth = self.documents[from].depth + 1;
        if depth > MAX_DEPTH {
            return Ok(Err(Absence::TooDeep { most: MAX_DEPTH }));
        }
        if self.documents.len() >= self.walking.max_documents {
            self.source.looked(Look::NotRead(path));
            let most = self.walking.max_documents as u64;
            return Ok(Err(Absence::TooMany { most }));
        }
        let document = match self.source.fetch(path)? {
            Ok(document) => document,
            Err(why) => {
                self.source.looked(Look::NotHad(path));
                return Ok(Err(why));
            }
        };
        let to = self.documents.len();
        // A member of an archive can be reached by its own name and by the name of the archive.
        let own = Document::open(S::image(&document))
            .map_or_else(|_| path.to_path_buf(), |it| from_text(it.path()));
        if let Some(&to) = self.had.get(&own) {
            self.had.insert(path.to_path_buf(), to);
            self.link(from, reference, to);
            return Ok(Ok(()));
        }
        let broken = self.examine(reference, S::image(&document));
        self.had.insert(path.to_path_buf(), to);
        self.had.insert(own.clone(), to);
        let referred_at = match from {
            0 => reference.offset,
            _ => self.documents[from].referred_at,
        };
        self.documents.push(Had {
            role: reference.role,
            links: Vec::new(),
            is_library: reference.is_library,
            depth,
            referred_at,
        });
        self.source
            .keep(path, reference.role, referred_at, document);
        self.link(from, reference, to);
        if let Some(why) = broken {
            self.miss(from, reference, path, why, None);
        }
        if reference.is_library {
            self.list_archive(&to_text(&own))?;
        }
        Ok(Ok(()))
    }

    /// Adds the listing of the archive that a main scenario comes from to the set.
    fn list_archive(&mut self, main: &str) -> Result<(), S::Halt> {
        let Some(archive) = main.strip_suffix(&format!("!{MAIN_MEMBER}")) else {
            return Ok(());
        };
        let path = from_text(archive);
        if self.documents.len() < self.walking.max_documents
            && self.listed.insert(path.clone())
            && let Some(listing) = self.source.listing(&path)?
        {
            let referred_at = self.documents.last().map_or(0, |had| had.referred_at);
            self.documents.push(Had::of_root(DocumentRole::Listing));
            self.source
                .keep(&path, DocumentRole::Listing, referred_at, listing);
        }
        Ok(())
    }

    /// Makes a plain scenario from a modular one. If this is impossible, the reason is recorded as
    /// a missing document.
    fn expand(&mut self) -> Result<(), S::Halt> {
        match self.expanded()? {
            Ok(document) => {
                let path = from_text(self.root.path());
                self.documents.push(Had::of_root(DocumentRole::Expanded));
                self.source.keep(&path, DocumentRole::Expanded, 0, document);
                self.is_expanded = true;
            }
            Err((why, referred_at)) => {
                let missing = MissingDocument {
                    role: DocumentRole::Expanded,
                    // The directory is left out, because results must not depend on the place where
                    // they were made.
                    reference: name_of(self.root.path()).to_owned(),
                    path: String::new(),
                    why: Absence::NotExpanded { why },
                    level: Level::Error,
                    referred_at,
                    within: None,
                };
                self.missing.push((missing, None));
            }
        }
        Ok(())
    }

    /// Returns the expanded scenario, or the obstacle that prevents it.
    fn expanded(&self) -> Result<Result<S::Document, Obstacle>, S::Halt> {
        let expansion = expand(self.pieces(), self.walking.max_text);
        if let Some(obstacle) = expansion.obstacles().next() {
            let node = obstacle.at.node();
            let path = node.document().path();
            let from = self.had.get(&from_text(path)).copied().unwrap_or(0);
            let at = match from {
                0 => node.offset(),
                from => self.documents[from].referred_at,
            };
            return Ok(Err((obstacle.text.clone(), at)));
        }
        match expansion.image(self.walking.max_image) {
            Some(image) => {
                let made = self.source.expanded(&image)?;
                Ok(made.map_err(|why| (format!("the expanded scenario {why}"), 0)))
            }
            None => {
                let why = "its image would be larger than the limit max_image allows";
                Ok(Err((why.to_owned(), 0)))
            }
        }
    }

    /// Returns the documents with their roles.
    fn set(&self) -> Vec<Member<'_>> {
        let image = |index: usize| match index {
            0 => Some(*self.root),
            _ => Document::open(self.source.kept(index - 1)).ok(),
        };
        let documents = self.documents.iter().enumerate();
        documents
            .map(|(index, had)| (had.role, image(index)))
            .collect()
    }

    /// Returns the documents with their links. A document that cannot be opened is already reported
    /// as missing. The root replaces it, because no scenario may refer to the root.
    fn pieces(&self) -> Vec<Piece<'_>> {
        let images =
            (1..self.documents.len()).map(|index| Document::open(self.source.kept(index - 1)));
        let documents =
            std::iter::once(*self.root).chain(images.map(|it| it.unwrap_or(*self.root)));
        let piece = |(document, had): (_, &Had)| Piece {
            document,
            links: had.links.clone(),
        };
        documents.zip(&self.documents).map(piece).collect()
    }

    fn link(&mut self, from: usize, reference: &Reference, to: usize) {
        if reference.role == DocumentRole::Catalog {
            return;
        }
        let link = Link {
            at: reference.offset,
            to: u32::try_from(to).unwrap_or(u32::MAX),
        };
        self.documents[from].links.push(link);
    }

    /// Returns the reason why an existing document is not usable, or `None`.
    fn examine(&mut self, reference: &Reference, image: &[u8]) -> Option<Absence> {
        let document = match Document::open(image) {
            Ok(document) => document,
            Err(error) => {
                return Some(Absence::Unreadable {
                    why: error.to_string(),
                });
            }
        };
        if reference.role == DocumentRole::Catalog {
            let catalog = document.root().and_then(|root| root.child("Catalog"));
            let name = catalog.and_then(|catalog| catalog.attr("name"));
            self.catalogs.extend(name.map(str::to_owned));
        }
        let fault = document.faults().find(|fault| fault.code.makes_partial())?;
        if fault.code.group() == FaultGroup::Limit {
            return Some(Absence::TooLarge {
                why: fault.text.to_owned(),
            });
        }
        let position = document.position(fault.offset);
        Some(Absence::Broken {
            path: position.path.to_owned(),
            row: position.row,
            column: position.column,
            text: fault.text.to_owned(),
        })
    }

    fn miss(
        &mut self,
        from: usize,
        reference: &Reference,
        path: &Path,
        why: Absence,
        catalogs: Option<String>,
    ) {
        let (referred_at, within) = match from {
            0 => (reference.offset, None),
            _ => (
                self.documents[from].referred_at,
                self.within(from, reference.offset),
            ),
        };
        let missing = MissingDocument {
            role: reference.role,
            reference: reference.text.clone(),
            path: to_text(path),
            level: level(reference.role, path, &why),
            why,
            referred_at,
            within,
        };
        self.missing.push((missing, catalogs));
    }

    /// Returns the place of a reference in a document other than the root.
    fn within(&self, from: usize, offset: u32) -> Option<Within> {
        let document = Document::open(self.source.kept(from - 1)).ok()?;
        let position = document.position(offset);
        Some(Within {
            path: position.path.to_owned(),
            row: position.row,
            column: position.column,
        })
    }

    /// Sets the level of missing catalog directories. A missing directory is more severe if the
    /// scenario needs a catalog of it. This is known only after all other catalogs have been found.
    fn weighed(self) -> Vec<MissingDocument> {
        // The groups that a modular scenario takes from other files may need catalogs that its own
        // file does not need.
        let last = self.documents.len().checked_sub(2);
        let expanded = last.filter(|_| self.is_expanded);
        let expanded = expanded.and_then(|last| Document::open(self.source.kept(last)).ok());
        let root = expanded.as_ref().unwrap_or(self.root);
        let weigh = |(mut missing, catalogs): (MissingDocument, Option<String>)| {
            let gone = matches!(missing.why, Absence::NotThere | Absence::NotAFile);
            if let Some(kind) = catalogs.filter(|_| gone) {
                missing.level = match need_of(root, &kind, &self.catalogs) {
                    Need::Used => Level::Error,
                    Need::Unknown => Level::Warning,
                    Need::Unused => Level::Information,
                };
            }
            missing
        };
        self.missing.into_iter().map(weigh).collect()
    }
}

/// Returns the level for a missing file. Catalogs may be listed without being used.
fn level(role: DocumentRole, path: &Path, why: &Absence) -> Level {
    let needed = role != DocumentRole::Catalog;
    match why {
        Absence::SimulatorMap => Level::Information,
        Absence::NotAFile if role == DocumentRole::Attachment => Level::Error,
        Absence::NotThere
        | Absence::Directory
        | Absence::Escapes
        | Absence::NotAScenario
        | Absence::TooDeep { .. }
            if needed =>
        {
            Level::Error
        }
        // Maps may have a format other than XML.
        Absence::Broken { .. } if needed && FileKind::of_path(path).is_some() => Level::Error,
        _ => Level::Warning,
    }
}

/// Whether a scenario needs catalogs of a missing directory.
enum Need {
    /// The scenario refers to an unknown catalog in a place where only this kind of catalog is
    /// allowed.
    Used,
    /// All referenced catalogs were found.
    Unused,
    /// An entry of another catalog may need it.
    Unknown,
}

fn need_of(root: &Document<'_>, kind: &str, found: &BTreeSet<String>) -> Need {
    let users: &[&str] = match kind {
        "VehicleCatalog" | "PedestrianCatalog" | "MiscObjectCatalog" => &["ScenarioObject"],
        "ControllerCatalog" => &["ObjectController", "AssignControllerAction"],
        "ManeuverCatalog" => &["ManeuverGroup"],
        "EnvironmentCatalog" => &["EnvironmentAction"],
        "RouteCatalog" => &["AssignRouteAction", "RouteRef"],
        "TrajectoryCatalog" => &["FollowTrajectoryAction", "TrajectoryRef"],
        _ => &[],
    };
    let parameters = Parameters::of(root);
    let mut need = Need::Unused;
    for reference in root.elements("CatalogReference") {
        let parent = reference.parent().map_or("", |parent| parent.name());
        let written = reference.attr("catalogName");
        let name = written.and_then(|name| parameters.fill(name).ok());
        let is_found = name.map(|name| found.contains(&name));
        match is_found {
            Some(false) if users.contains(&parent) => return Need::Used,
            // Maneuvers in catalogs may themselves refer to catalogs of other kinds.
            Some(true) if parent != "ManeuverGroup" => {}
            _ => need = Need::Unknown,
        }
    }
    need
}
