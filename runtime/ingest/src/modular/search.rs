//! Finds the scenarios that a modular scenario consists of.

use std::collections::HashSet;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use qcbus_document::Document;
use qcbus_messages::path_text::{from_text, split_archive};
use qcbus_messages::{Absence, DocumentRole};

use crate::prepare::{absolute, split_members};
use crate::references::Reference;

/// Environment variable with the directories of a search path.
pub const SEARCH_PATH_VARIABLE: &str = "SCENARIO_PATH";

/// Directories in which referenced scenarios are looked for, after the places around the referring
/// scenario.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct SearchPath(Vec<PathBuf>);

impl SearchPath {
    /// Reads a list of directories. They are separated by the platform's own separator. `;` is a
    /// separator on every platform, because the reference tool uses it. Relative directories start
    /// at `base`.
    pub fn parse(text: &OsStr, base: &Path) -> SearchPath {
        let mut directories = Vec::new();
        for part in std::env::split_paths(text) {
            // In a path that is not UTF-8, a `;` cannot be distinguished from part of a character.
            let parts = match part.to_str() {
                Some(text) => text.split(';').map(PathBuf::from).collect(),
                None => vec![part],
            };
            directories.extend(parts);
        }
        let mut seen = HashSet::new();
        let directories = directories
            .into_iter()
            .filter(|directory| !directory.as_os_str().is_empty())
            .map(|directory| absolute(base, &base.join(directory)))
            .filter(|directory| seen.insert(directory.clone()));
        SearchPath(directories.collect())
    }

    /// Returns the search path in [`SEARCH_PATH_VARIABLE`] of this process. Relative directories
    /// start at its working directory.
    pub fn of_environment() -> SearchPath {
        let base = std::env::current_dir().unwrap_or_default();
        std::env::var_os(SEARCH_PATH_VARIABLE)
            .map_or_else(SearchPath::default, |text| SearchPath::parse(&text, &base))
    }

    /// Appends the directories of another search path.
    #[must_use]
    pub fn then(mut self, other: &SearchPath) -> SearchPath {
        let more = other.0.iter().filter(|it| !self.0.contains(it)).cloned();
        let more: Vec<PathBuf> = more.collect();
        self.0.extend(more);
        self
    }

    /// Returns the directories in search order.
    pub fn directories(&self) -> &[PathBuf] {
        &self.0
    }
}

/// Returns the references in the `ScenarioReference` elements of a document, in document order.
pub(crate) fn libraries(document: &Document<'_>, search: &SearchPath) -> Vec<Reference> {
    let names: HashSet<&str> = document
        .elements("ScenarioReference")
        .filter_map(|node| node.attr("scenarioFileName"))
        .collect();
    let from = from_text(document.path());
    let mut found = Vec::new();
    for node in document.elements("ScenarioReference") {
        let Some(text) = node.attr("scenarioFileName") else {
            continue;
        };
        let (candidates, unresolved) = match check(&from, text) {
            Ok(()) => (candidates(&from, text, &names, search), None),
            Err(why) => (Vec::new(), Some(why)),
        };
        found.push(Reference {
            role: DocumentRole::Scenario,
            catalogs: None,
            text: text.to_owned(),
            offset: node.offset(),
            candidates,
            directory: None,
            unresolved,
            is_library: true,
        });
    }
    found
}

/// Checks whether the text can name a scenario that may be read.
fn check(from: &Path, text: &str) -> Result<(), Absence> {
    if text.trim().is_empty() {
        return Err(Absence::EmptyPath);
    }
    if text.contains("://") {
        return Err(Absence::Remote);
    }
    if !text.ends_with(".xosc") && !text.ends_with(".mosc") {
        return Err(Absence::NotAScenario);
    }
    // A reference must not lead into an archive; it names the archive itself.
    let into_archive = split_archive(text).is_some();
    let in_archive = !split_members(from).1.is_empty();
    if into_archive || in_archive && !crate::archive::stays_inside(text) {
        return Err(Absence::Escapes);
    }
    Ok(())
}

/// Returns the candidate paths. For a scenario in an archive they are in this archive, then in the
/// archives around it, but never beside them. An archive therefore means the same in every place.
/// For other scenarios they are beside the file. The search path comes last.
///
/// The reference tool stores its result for `name.mosc` as `name.xosc`, and later references find
/// it. If the document refers to both and `name.xosc` is not found, this name leads to the archive.
fn candidates(from: &Path, text: &str, names: &HashSet<&str>, search: &SearchPath) -> Vec<PathBuf> {
    let mut found = places(from, text, search);
    let archive = text
        .strip_suffix(".xosc")
        .map(|stem| format!("{stem}.mosc"));
    if let Some(archive) = archive.filter(|archive| names.contains(archive.as_str())) {
        found.extend(places(from, &archive, search));
    }
    let mut seen = HashSet::new();
    found.retain(|place| seen.insert(place.clone()));
    found
}

fn places(from: &Path, text: &str, search: &SearchPath) -> Vec<PathBuf> {
    let (file, members) = split_members(from);
    let mut places = Vec::new();
    let in_file = |around: &[String], name: &str| {
        let mut place = file.as_os_str().to_owned();
        for member in around.iter().map(String::as_str).chain([name]) {
            place.push("!");
            place.push(member);
        }
        PathBuf::from(place)
    };
    if let Some((own, around)) = members.split_last() {
        // This place is beside the referring member, if that is not at the root of the archive.
        if let Some((folder, _)) = own.rsplit_once('/') {
            places.push(in_file(around, &format!("{folder}/{text}")));
        }
        for depth in (0..=around.len()).rev() {
            places.push(in_file(&around[..depth], text));
        }
    }
    let beside = file.parent().filter(|_| members.is_empty());
    let directories = beside
        .into_iter()
        .chain(search.0.iter().map(PathBuf::as_path));
    for directory in directories {
        for text in spellings(text) {
            let joined = directory.join(text);
            places.push(absolute(directory, &joined));
        }
    }
    places
}

/// Returns the spellings to try: first as written, then with the backslashes of Windows replaced.
fn spellings(text: &str) -> Vec<String> {
    let mut spellings = vec![text.to_owned()];
    if text.contains('\\') {
        spellings.push(text.replace('\\', "/"));
    }
    spellings
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_separators_split_a_search_path() {
        let path = |text: &str| SearchPath::parse(OsStr::new(text), Path::new("/usr"));
        let plain = |all: &[&str]| SearchPath(all.iter().map(PathBuf::from).collect());
        assert_eq!(path("/a;b;;/a"), plain(&["/a", "/usr/b"]));
        #[cfg(unix)]
        assert_eq!(path("/a:../c;/d"), plain(&["/a", "/c", "/d"]));
        assert_eq!(path(""), SearchPath::default());
        assert_eq!(
            path("/a;/b").then(&path("/b;/c")),
            plain(&["/a", "/b", "/c"])
        );
    }

    #[test]
    fn archive_members_cannot_be_named_from_outside() {
        let from = Path::new("/d/main.xosc");
        for text in ["x.mosc!a.xosc", "X.MOSC!a.xosc", "x.mosc!y.mosc!a.xosc"] {
            assert_eq!(check(from, text), Err(Absence::Escapes), "{text}");
        }
        assert_eq!(check(from, "oh!/a.xosc"), Ok(()));
    }

    #[test]
    fn archive_is_searched_inside_first_and_then_outside() {
        let search = SearchPath::parse(OsStr::new("/lib"), Path::new("/"));
        let found = places(
            Path::new("/d/x.mosc!in.mosc!sub/main.xosc"),
            "a.xosc",
            &search,
        );
        let expected = [
            "/d/x.mosc!in.mosc!sub/a.xosc",
            "/d/x.mosc!in.mosc!a.xosc",
            "/d/x.mosc!a.xosc",
            "/lib/a.xosc",
        ];
        assert_eq!(found, expected.map(PathBuf::from));
        let found = places(Path::new("/d/main.xosc"), "sub\\a.xosc", &search);
        assert!(found.contains(&PathBuf::from("/d/sub/a.xosc")), "{found:?}");
    }
}
