//! Finds the other files that a file refers to: the map and the catalogs of a scenario, the scenarios
//! that it is built from, and the surface grids of a map.

use std::collections::HashMap;
use std::fs::DirEntry;
use std::io;
use std::path::{Path, PathBuf};

use qcbus_disk::foreign;
use qcbus_document::{Document, Node};
use qcbus_messages::path_text::from_text;
use qcbus_messages::{Absence, DocumentRole};

use crate::modular::{SearchPath, libraries};
use crate::prepare::{absolute, names_directory, split_members};

/// A reference from a document to another file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Reference {
    /// Role of the file. `RoadNetwork/LogicFile` names the map, and `CatalogLocations/…/Directory`
    /// names a folder whose `.xosc` files are catalogs. `ScenarioReference` and
    /// `ParameterValueDistribution/ScenarioFile` name scenarios. `surface/CRG` names a grid.
    pub role: DocumentRole,
    /// Kind of catalogs in a catalog directory, such as `VehicleCatalog`.
    pub catalogs: Option<String>,
    /// The reference as written.
    pub text: String,
    /// Offset of the referring element in the document's text.
    pub offset: u32,
    /// Absolute paths. The first existing one is the target; for a catalog directory each of them
    /// is a catalog. A member of an archive is `archive!member`.
    pub candidates: Vec<PathBuf>,
    /// The catalog directory itself, so that a caller can watch it.
    pub directory: Option<PathBuf>,
    /// Reason why there is no candidate, or why some candidates are missing.
    pub unresolved: Option<Absence>,
    /// Whether a modular scenario takes maneuver groups from the file.
    pub is_library: bool,
}

impl Reference {
    /// Checks whether all candidates are targets, instead of only the first existing one.
    pub fn means_all(&self) -> bool {
        self.role == DocumentRole::Catalog
    }
}

/// Maximum number of files of one catalog directory that are read as catalogs.
const MAX_CATALOGS: usize = 1000;

/// Returns the references of a document in document order. In the file system it reads only the
/// entries of catalog directories.
pub fn references(document: &Document<'_>, search: &SearchPath) -> Vec<Reference> {
    let parameters = Parameters::of(document);
    let mut found: Vec<Reference> = targets(document)
        .into_iter()
        .map(|(role, node, text)| resolve(role, node, text, &parameters))
        .collect();
    found.extend(libraries(document, search));
    found.sort_by_key(|reference| reference.offset);
    found
}

/// Returns the referring elements with their references as written.
fn targets<'d>(document: &Document<'d>) -> Vec<(DocumentRole, Node<'d>, &'d str)> {
    let mut found = Vec::new();
    let mut gather = |role, element: &str, attribute: &str, parent: &dyn Fn(Node<'d>) -> bool| {
        for node in document
            .elements(element)
            .filter(|node| node.parent().is_some_and(parent))
        {
            if let Some(text) = node
                .attr(attribute)
                .filter(|text| reaches_a_file(role, text))
            {
                found.push((role, node, text));
            }
        }
    };
    let in_catalogs = |node: Node<'d>| {
        node.parent()
            .is_some_and(|above| above.is("CatalogLocations"))
    };
    // Before OpenSCENARIO 1.0 the element was called `Logics`.
    for element in ["LogicFile", "Logics"] {
        gather(DocumentRole::Map, element, "filepath", &|parent| {
            parent.is("RoadNetwork")
        });
    }
    gather(DocumentRole::Catalog, "Directory", "path", &in_catalogs);
    // Grids of road surfaces (OpenDRIVE 1.9, 10.6 and 13.12).
    gather(DocumentRole::Attachment, "CRG", "file", &|parent| {
        parent.is("surface")
    });
    gather(
        DocumentRole::Scenario,
        "ScenarioFile",
        "filepath",
        &|parent| parent.is("ParameterValueDistribution"),
    );
    found
}

/// Checks whether it is worth looking for a file. The rules about maps report the other surfaces.
fn reaches_a_file(role: DocumentRole, text: &str) -> bool {
    let has_drive = text.as_bytes().get(1) == Some(&b':');
    role != DocumentRole::Attachment || !(text.trim().is_empty() || has_drive)
}

fn resolve(
    role: DocumentRole,
    node: Node<'_>,
    text: &str,
    parameters: &Parameters<'_>,
) -> Reference {
    let mut reference = Reference {
        role,
        catalogs: (role == DocumentRole::Catalog)
            .then(|| node.parent().map(|kind| kind.name().to_string()))
            .flatten(),
        text: text.to_string(),
        offset: node.offset(),
        candidates: Vec::new(),
        directory: None,
        unresolved: None,
        is_library: false,
    };
    let outcome = parameters
        .fill(text)
        .and_then(|text| check(role, &text).map(|()| text));
    match outcome {
        Err(why) => reference.unresolved = Some(why),
        Ok(path) => locate(&mut reference, &from_text(node.position().path), &path),
    }
    reference
}

/// Checks whether the text can name a file.
fn check(role: DocumentRole, text: &str) -> Result<(), Absence> {
    let text = text.trim();
    if text.is_empty() {
        return Err(Absence::EmptyPath);
    }
    if text.contains("://") && !text.starts_with("file://") {
        return Err(Absence::Remote);
    }
    if role != DocumentRole::Catalog && names_directory(text) {
        return Err(Absence::Directory);
    }
    let has_extension = Path::new(text.rsplit(['/', '\\']).next().unwrap_or(text))
        .extension()
        .is_some();
    let is_bare = !text.contains(['/', '\\']) && !has_extension;
    if role == DocumentRole::Map && is_bare {
        return Err(Absence::SimulatorMap);
    }
    Ok(())
}

fn locate(reference: &mut Reference, from: &Path, text: &str) {
    let text = text.trim();
    let mut candidates: Vec<PathBuf> = Vec::new();
    for spelling in spellings(text) {
        for candidate in places(from, &spelling) {
            if !candidates.contains(&candidate) {
                candidates.push(candidate);
            }
        }
    }
    if !reference.means_all() {
        reference.candidates = candidates;
        return;
    }
    let mut why = Absence::NotThere;
    for folder in &candidates {
        if names_directory(text) && foreign::metadata(folder).is_ok_and(|data| data.is_file()) {
            continue;
        }
        match catalogs(folder) {
            Ok((catalogs, left_out)) => {
                reference.directory = Some(folder.clone());
                reference.candidates = catalogs;
                reference.unresolved = left_out;
                return;
            }
            // If one spelling exists but is unusable, it is the intended one.
            Err(found) if why == Absence::NotThere => why = found,
            Err(_) => {}
        }
    }
    reference.unresolved = Some(why);
    reference.directory = candidates.into_iter().next();
}

/// Returns the spellings to try: first as written, then with `%20`, `file://` and backslashes
/// interpreted.
fn spellings(text: &str) -> Vec<String> {
    let plain = text.strip_prefix("file://").unwrap_or(text);
    let mut spellings = vec![plain.to_string()];
    let decoded = percent_decoded(plain);
    let slashed = decoded.replace('\\', "/");
    for spelling in [decoded, slashed] {
        if !spellings.contains(&spelling) {
            spellings.push(spelling);
        }
    }
    spellings
}

fn percent_decoded(text: &str) -> String {
    let mut bytes = Vec::with_capacity(text.len());
    let mut rest = text.as_bytes();
    while let Some((&byte, tail)) = rest.split_first() {
        let hex = |at: usize| char::from(*tail.get(at)?).to_digit(16);
        let code = (byte == b'%')
            .then(|| Some(hex(0)? * 16 + hex(1)?))
            .flatten();
        match code.and_then(|code| u8::try_from(code).ok()) {
            Some(decoded) => {
                bytes.push(decoded);
                rest = &tail[2..];
            }
            None => {
                bytes.push(byte);
                rest = tail;
            }
        }
    }
    String::from_utf8(bytes).unwrap_or_else(|_| text.to_string())
}

/// Returns paths relative to the referring file. Maps and catalogs of a scenario in an archive are
/// beside the archive.
fn places(from: &Path, text: &str) -> Vec<PathBuf> {
    // A `!` that does not follow an archive is an ordinary character of a name.
    let (file, _) = split_members(from);
    let folder = file.parent().unwrap_or(Path::new(""));
    let joined = folder.join(text);
    vec![absolute(folder, &joined)]
}

/// Returns the `.xosc` files of a folder, sorted by name. If there are too many, it also returns
/// the reason for the omission.
fn catalogs(folder: &Path) -> Result<(Vec<PathBuf>, Option<Absence>), Absence> {
    if foreign::metadata(folder).is_ok_and(|data| data.is_file()) {
        // Some tools write the path of the catalog itself.
        return Ok((vec![folder.to_path_buf()], None));
    }
    let entries = foreign::list(folder).map_err(|error| unlisted(folder, &error))?;
    let mut catalogs: Vec<PathBuf> = entries
        .iter()
        .map(DirEntry::path)
        .filter(|path| {
            path.extension()
                .is_some_and(|ext| ext.eq_ignore_ascii_case("xosc"))
        })
        .filter(|path| !foreign::metadata(path).is_ok_and(|data| data.is_dir()))
        .collect();
    catalogs.sort();
    let left_out = (catalogs.len() > MAX_CATALOGS).then_some(Absence::TooMany {
        most: MAX_CATALOGS as u64,
    });
    catalogs.truncate(MAX_CATALOGS);
    Ok((catalogs, left_out))
}

fn unlisted(folder: &Path, error: &io::Error) -> Absence {
    match error.kind() {
        io::ErrorKind::NotFound => Absence::NotThere,
        io::ErrorKind::NotADirectory if foreign::metadata(folder).is_ok() => Absence::NotAFile,
        io::ErrorKind::NotADirectory => Absence::NotThere,
        _ => Absence::Unreadable {
            why: error.to_string(),
        },
    }
}

/// Plain values of the scenario's own parameters.
pub(crate) struct Parameters<'d> {
    defaults: HashMap<&'d str, &'d str>,
}

impl<'d> Parameters<'d> {
    /// Reads the global declarations of the scenario. Declarations in catalogs and maneuvers do not
    /// apply to paths.
    pub(crate) fn of(document: &Document<'d>) -> Parameters<'d> {
        let global = document
            .root()
            .and_then(|root| root.child("ParameterDeclarations"));
        let declarations = global.into_iter().flat_map(|global| global.children());
        let defaults = declarations
            .filter(|node| node.is("ParameterDeclaration"))
            .filter_map(|node| {
                Some((
                    node.attr("name")?.trim_start_matches('$'),
                    node.attr("value")?,
                ))
            })
            .collect();
        Parameters { defaults }
    }

    /// Replaces every `$name` by its declared default.
    pub(crate) fn fill(&self, text: &str) -> Result<String, Absence> {
        let mut filled = String::new();
        let mut rest = text;
        while let Some(at) = rest.find('$') {
            filled.push_str(&rest[..at]);
            let name = &rest[at + 1..];
            if name.starts_with('{') {
                return Err(Absence::Expression);
            }
            let len = name
                .find(|c: char| !(c.is_alphanumeric() || c == '_'))
                .unwrap_or(name.len());
            let (name, after) = name.split_at(len);
            let value = self.defaults.get(name).filter(|value| !value.contains('$'));
            let value = value.ok_or_else(|| Absence::Parameter {
                name: name.to_string(),
            })?;
            filled.push_str(value);
            rest = after;
        }
        filled.push_str(rest);
        Ok(filled)
    }
}
