//! What other files a scenario refers to: its map, its catalogs, the scenarios it is built from.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use qcbus_document::{Document, Node};
use qcbus_messages::path_text::from_text;

use crate::prepare::{normal, split_members};

/// What a referenced file is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Role {
    /// `RoadNetwork/LogicFile`: the OpenDRIVE map.
    LogicFile,
    /// `CatalogLocations/…/Directory`: a folder whose `.xosc` files are catalogs.
    CatalogDirectory,
    /// `ScenarioReference`: a scenario that a modular scenario is built from.
    ScenarioReference,
    /// `ParameterValueDistribution/ScenarioFile`: the scenario whose parameters are varied.
    ScenarioFile,
    /// `xsi:schemaLocation` and its sibling: named for information, never fetched.
    Schema,
}

/// A reference from a document to another file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Reference {
    /// What the file is for.
    pub role: Role,
    /// The reference as written.
    pub text: String,
    /// Offset of the referring element in the document's text.
    pub offset: u32,
    /// Absolute paths. The first that exists is meant; for a catalog directory each of them is
    /// a catalog. A member of an archive is `archive!member`.
    pub candidates: Vec<PathBuf>,
    /// The catalog directory itself, for whoever watches it.
    pub directory: Option<PathBuf>,
    /// Why there is no candidate.
    pub unresolved: Option<String>,
}

/// Most files of one catalog directory that are taken for catalogs.
const MAX_CATALOGS: usize = 1000;

/// The references of a document in document order. Of the file system only the entries of catalog
/// directories are looked at.
pub fn references(document: &Document<'_>) -> Vec<Reference> {
    let parameters = Parameters::of(document);
    let mut found: Vec<Reference> = targets(document)
        .into_iter()
        .map(|(role, node, text)| resolve(role, node, text, &parameters))
        .collect();
    found.sort_by_key(|reference| reference.offset);
    found
}

/// The referring elements with their references as written.
fn targets<'d>(document: &Document<'d>) -> Vec<(Role, Node<'d>, &'d str)> {
    let mut found = Vec::new();
    let mut gather = |role, element: &str, attribute: &str, parent: &dyn Fn(Node<'d>) -> bool| {
        for node in document
            .elements(element)
            .filter(|node| node.parent().is_some_and(parent))
        {
            if let Some(text) = node.attr(attribute) {
                found.push((role, node, text));
            }
        }
    };
    let in_catalogs = |node: Node<'d>| {
        node.parent()
            .is_some_and(|above| above.is("CatalogLocations"))
    };
    gather(Role::LogicFile, "LogicFile", "filepath", &|parent| {
        parent.is("RoadNetwork")
    });
    gather(Role::CatalogDirectory, "Directory", "path", &in_catalogs);
    gather(
        Role::ScenarioReference,
        "ScenarioReference",
        "scenarioFileName",
        &|_| true,
    );
    gather(Role::ScenarioFile, "ScenarioFile", "filepath", &|parent| {
        parent.is("ParameterValueDistribution")
    });
    if let Some(root) = document.root() {
        for attribute in root.attributes() {
            let local = attribute.name().rsplit(':').next().unwrap_or("");
            if local == "noNamespaceSchemaLocation" || local == "schemaLocation" {
                found.push((Role::Schema, root, attribute.value()));
            }
        }
    }
    found
}

fn resolve(role: Role, node: Node<'_>, text: &str, parameters: &Parameters<'_>) -> Reference {
    let mut reference = Reference {
        role,
        text: text.to_string(),
        offset: node.offset(),
        candidates: Vec::new(),
        directory: None,
        unresolved: None,
    };
    if role == Role::Schema {
        reference.unresolved = Some("schemas are never fetched; qcbus brings its own".to_string());
        return reference;
    }
    let outcome = parameters
        .fill(text)
        .and_then(|text| check(role, &text).map(|()| text));
    match outcome {
        Err(reason) => reference.unresolved = Some(reason),
        Ok(path) => locate(&mut reference, &from_text(node.position().path), &path),
    }
    reference
}

/// Whether the text can name a file at all.
fn check(role: Role, text: &str) -> Result<(), String> {
    let text = text.trim();
    if text.is_empty() {
        return Err("the path is empty".to_string());
    }
    if text.contains("://") && !text.starts_with("file://") {
        return Err("nothing is fetched from the network".to_string());
    }
    let has_extension = Path::new(text.rsplit(['/', '\\']).next().unwrap_or(text))
        .extension()
        .is_some();
    let is_bare = !text.contains(['/', '\\']) && !has_extension;
    if role == Role::LogicFile && is_bare {
        return Err(format!(
            "{text} is the name of a map that the simulator knows, not of a file"
        ));
    }
    Ok(())
}

fn locate(reference: &mut Reference, from: &Path, text: &str) {
    let mut candidates: Vec<PathBuf> = Vec::new();
    for spelling in spellings(text.trim()) {
        for candidate in places(reference.role, from, &spelling) {
            if !candidates.contains(&candidate) {
                candidates.push(candidate);
            }
        }
    }
    if reference.role != Role::CatalogDirectory {
        reference.candidates = candidates;
        return;
    }
    let listed = candidates
        .iter()
        .find_map(|folder| Some((folder, catalogs(folder)?)));
    match listed {
        Some((folder, catalogs)) => {
            reference.directory = Some(folder.clone());
            reference.candidates = catalogs;
        }
        None => {
            reference.unresolved = Some("there is no such directory".to_string());
            reference.directory = candidates.into_iter().next();
        }
    }
}

/// As written first; then what the writer may have meant by `%20`, `file://` and backslashes.
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

/// Relative to the referring file. What a member of an archive refers to is looked for in the
/// archive first, then beside it.
fn places(role: Role, from: &Path, text: &str) -> Vec<PathBuf> {
    let mut places = Vec::new();
    // A `!` that follows no archive is an ordinary character of a name.
    let (file, members) = split_members(from);
    if let Some((_, around)) = members.split_last()
        && (role == Role::ScenarioReference || role == Role::ScenarioFile)
    {
        let mut place = file.as_os_str().to_owned();
        for member in around.iter().map(String::as_str).chain([text]) {
            place.push("!");
            place.push(member);
        }
        places.push(PathBuf::from(place));
    }
    let folder = file.parent().unwrap_or(Path::new(""));
    let joined = folder.join(text);
    places.push(normal(&std::path::absolute(&joined).unwrap_or(joined)));
    places
}

/// The `.xosc` files of a folder by name; `None` when it cannot be listed.
fn catalogs(folder: &Path) -> Option<Vec<PathBuf>> {
    if folder.is_file() {
        // Some tools write the catalog's own path.
        return Some(vec![folder.to_path_buf()]);
    }
    let mut catalogs: Vec<PathBuf> = std::fs::read_dir(folder)
        .ok()?
        .filter_map(|entry| Some(entry.ok()?.path()))
        .filter(|path| {
            path.extension()
                .is_some_and(|ext| ext.eq_ignore_ascii_case("xosc"))
        })
        .filter(|path| path.is_file())
        .collect();
    catalogs.sort();
    catalogs.truncate(MAX_CATALOGS);
    Some(catalogs)
}

/// Values of the scenario's own parameters, as far as they are plain.
struct Parameters<'d> {
    defaults: HashMap<&'d str, &'d str>,
}

impl<'d> Parameters<'d> {
    /// The scenario's global declarations; those of catalogs and maneuvers hold in no path.
    fn of(document: &Document<'d>) -> Parameters<'d> {
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
    fn fill(&self, text: &str) -> Result<String, String> {
        let mut filled = String::new();
        let mut rest = text;
        while let Some(at) = rest.find('$') {
            filled.push_str(&rest[..at]);
            let name = &rest[at + 1..];
            if name.starts_with('{') {
                return Err(
                    "the path is an expression, which is known only when it runs".to_string(),
                );
            }
            let len = name
                .find(|c: char| !(c.is_alphanumeric() || c == '_'))
                .unwrap_or(name.len());
            let (name, after) = name.split_at(len);
            let value = self.defaults.get(name).filter(|value| !value.contains('$'));
            let value =
                value.ok_or_else(|| format!("the parameter ${name} has no plain default"))?;
            filled.push_str(value);
            rest = after;
        }
        filled.push_str(rest);
        Ok(filled)
    }
}
