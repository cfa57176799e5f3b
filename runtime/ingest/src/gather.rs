//! The set of documents that belong to a file: one walk for everybody who checks files, however the
//! documents are fetched.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use qcbus_document::{Document, FaultGroup, FileKind};
use qcbus_formats::xqar::Level;
use qcbus_messages::{Absence, DocumentRole, MissingDocument};

use crate::references::{Parameters, Reference, references};

/// Where documents come from and go to.
pub trait Source {
    /// A document that was fetched.
    type Document;
    /// Why the whole walk is given up: it is worth another try later.
    type Halt;

    /// Reads a document; `Ok(Err(…))` when it cannot be had.
    ///
    /// # Errors
    /// When no further document can be fetched now.
    fn fetch(&mut self, path: &Path) -> Result<Result<Self::Document, Absence>, Self::Halt>;

    /// The image of a document.
    fn image(document: &Self::Document) -> &[u8];

    /// Keeps a document. `referred_at` is the referring element's offset in the root.
    fn keep(&mut self, path: &Path, role: DocumentRole, referred_at: u32, document: Self::Document);

    /// Hears what was looked at besides, for those who watch it.
    fn looked(&mut self, look: Look<'_>) {
        let _ = look;
    }
}

/// Something that the set of documents depends on and that is no document of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Look<'p> {
    /// A file that was looked for in vain, or is there and was not to be had.
    NotHad(&'p Path),
    /// A file that was not read because there are too many.
    NotRead(&'p Path),
    /// A directory whose files count.
    Listed(&'p Path),
}

/// Follows the references of a root and fetches what they lead to, at most `max_documents` with the
/// root. Gives what could not be had or is of no use, in the order of the references.
///
/// # Errors
/// What the source gives up with.
pub fn gather<S: Source>(
    root: &Document<'_>,
    max_documents: usize,
    source: &mut S,
) -> Result<Vec<MissingDocument>, S::Halt> {
    let mut walk = Walk {
        root,
        source,
        max_documents,
        had: BTreeSet::from([PathBuf::from(root.path())]),
        catalogs: BTreeSet::new(),
        missing: Vec::new(),
    };
    for reference in references(root) {
        walk.follow(&reference)?;
    }
    Ok(walk.weighed())
}

struct Walk<'w, S> {
    root: &'w Document<'w>,
    source: &'w mut S,
    max_documents: usize,
    had: BTreeSet<PathBuf>,
    /// Names of the catalogs that were found.
    catalogs: BTreeSet<String>,
    /// With the kind of catalogs that a missing directory was to have.
    missing: Vec<(MissingDocument, Option<String>)>,
}

impl<S: Source> Walk<'_, S> {
    fn follow(&mut self, reference: &Reference) -> Result<(), S::Halt> {
        if let Some(directory) = &reference.directory {
            self.source.looked(Look::Listed(directory));
        }
        if let Some(why) = &reference.unresolved {
            let path = reference.directory.as_deref().unwrap_or(Path::new(""));
            let whole = reference.candidates.is_empty();
            let catalogs = reference.catalogs.clone().filter(|_| whole);
            self.miss(reference, path, why.clone(), catalogs);
        }
        let mut first: Option<(&Path, Absence)> = None;
        for path in &reference.candidates {
            let Err(why) = self.candidate(reference, path)? else {
                if reference.means_all() {
                    continue;
                }
                return Ok(());
            };
            if reference.means_all() {
                self.miss(reference, path, why, None);
            } else if first
                .as_ref()
                .is_none_or(|(_, other)| *other == Absence::NotThere && why != Absence::NotThere)
            {
                // Of several spellings the one that is there is meant, if there is one.
                first = Some((path, why));
            }
        }
        if let Some((path, why)) = first {
            self.miss(reference, path, why, None);
        }
        Ok(())
    }

    /// Fetches one referenced file, unless that was done.
    fn candidate(
        &mut self,
        reference: &Reference,
        path: &Path,
    ) -> Result<Result<(), Absence>, S::Halt> {
        if self.had.contains(path) {
            return Ok(Ok(()));
        }
        if self.had.len() >= self.max_documents {
            self.source.looked(Look::NotRead(path));
            let most = self.max_documents as u64;
            return Ok(Err(Absence::TooMany { most }));
        }
        let document = match self.source.fetch(path)? {
            Ok(document) => document,
            Err(why) => {
                self.source.looked(Look::NotHad(path));
                return Ok(Err(why));
            }
        };
        let broken = self.examine(reference, S::image(&document));
        self.had.insert(path.to_path_buf());
        self.source
            .keep(path, reference.role, reference.offset, document);
        if let Some(why) = broken {
            self.miss(reference, path, why, None);
        }
        Ok(Ok(()))
    }

    /// What keeps a document that is there from being relied on.
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

    fn miss(&mut self, reference: &Reference, path: &Path, why: Absence, catalogs: Option<String>) {
        let missing = MissingDocument {
            role: reference.role,
            reference: reference.text.clone(),
            path: qcbus_messages::path_text::to_text(path),
            level: level(reference.role, path, &why),
            why,
            referred_at: reference.offset,
        };
        self.missing.push((missing, catalogs));
    }

    /// A catalog directory that is not there weighs more when the scenario needs a catalog of it,
    /// which is known only when all other catalogs are.
    fn weighed(self) -> Vec<MissingDocument> {
        let weigh = |(mut missing, catalogs): (MissingDocument, Option<String>)| {
            let gone = matches!(missing.why, Absence::NotThere | Absence::NotAFile);
            if let Some(kind) = catalogs.filter(|_| gone) {
                missing.level = match need_of(self.root, &kind, &self.catalogs) {
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

/// How much it weighs that a file cannot be had. Catalogs may be listed and never used.
fn level(role: DocumentRole, path: &Path, why: &Absence) -> Level {
    let needed = role != DocumentRole::Catalog;
    match why {
        Absence::SimulatorMap => Level::Information,
        Absence::NotThere | Absence::Directory if needed => Level::Error,
        // Maps may be of a kind that is no XML.
        Absence::Broken { .. } if needed && FileKind::of_path(path).is_some() => Level::Error,
        _ => Level::Warning,
    }
}

/// Whether a scenario needs catalogs of a directory that is not there.
enum Need {
    /// It names one that was not found where only a catalog of this kind will do.
    Used,
    /// All that it refers to was found.
    Unused,
    /// It may be an entry of another catalog that needs it.
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
            // Maneuvers of catalogs refer to catalogs of other kinds themselves.
            Some(true) if parent != "ManeuverGroup" => {}
            _ => need = Need::Unknown,
        }
    }
    need
}
