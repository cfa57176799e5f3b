//! Completion of issues: adds row and column to every XPath.

use std::collections::HashMap;

use crate::xqar::{Issue, Location, Locations};

/// Place of an XPath in the checked file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct XPathPlace {
    /// Line of the element's `<`, from 1.
    pub row: u64,
    /// Column in characters, from 1.
    pub column: u64,
    /// Offset in bytes in the file on disk, if it is known.
    pub offset: Option<u64>,
}

/// Finds places in the checked file. Closures implement this trait.
pub trait Resolver {
    /// Returns the place of the first node that an XPath selects; `None` when it selects none. It
    /// is called once for every XPath.
    fn resolve(&mut self, xpath: &str) -> Option<XPathPlace>;
}

impl<F: FnMut(&str) -> Option<XPathPlace>> Resolver for F {
    fn resolve(&mut self, xpath: &str) -> Option<XPathPlace> {
        self(xpath)
    }
}

/// A resolver without any places, for a file that cannot be read.
#[derive(Debug, Clone, Copy, Default)]
pub struct NoPlaces;

impl Resolver for NoPlaces {
    fn resolve(&mut self, _: &str) -> Option<XPathPlace> {
        None
    }
}

/// Completes the places of issues.
pub(super) struct Completer<'r> {
    resolver: &'r mut dyn Resolver,
    /// Cache of places, because many issues point at the same elements.
    known: HashMap<String, Option<XPathPlace>>,
}

impl<'r> Completer<'r> {
    pub fn new(resolver: &'r mut dyn Resolver) -> Self {
        Completer {
            resolver,
            known: HashMap::new(),
        }
    }

    pub fn complete(&mut self, issue: &mut Issue) {
        for place in &mut issue.locations {
            let is_file = |location: &Location| matches!(location, Location::File { .. });
            if place.places.iter().any(is_file) {
                without_doubles(place);
            } else {
                self.add_files(place);
            }
        }
    }

    /// Inserts a `FileLocation` before every `XMLLocation`.
    fn add_files(&mut self, place: &mut Locations) {
        let mut files: Vec<XPathPlace> = Vec::new();
        let before = std::mem::take(&mut place.places);
        for location in before {
            if let Location::Xml { xpath } = &location
                && let Some(found) = self.find(xpath)
                && !files.contains(&found)
            {
                files.push(found);
                let XPathPlace {
                    row,
                    column,
                    offset,
                } = found;
                place.places.push(Location::File {
                    row,
                    column,
                    offset,
                });
            }
            place.places.push(location);
        }
    }

    fn find(&mut self, xpath: &str) -> Option<XPathPlace> {
        if let Some(known) = self.known.get(xpath) {
            return *known;
        }
        let found = self.resolver.resolve(xpath);
        self.known.insert(xpath.to_owned(), found);
        found
    }
}

/// Removes file locations that equal an earlier one.
fn without_doubles(place: &mut Locations) {
    let mut seen: Vec<Location> = Vec::new();
    place.places.retain(|location| {
        if !matches!(location, Location::File { .. }) {
            return true;
        }
        let first = !seen.contains(location);
        if first {
            seen.push(location.clone());
        }
        first
    });
}
