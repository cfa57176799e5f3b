//! Findings about groups that are taken several times. Each finding is reported once.

use std::collections::{HashMap, HashSet};

use crate::assembly::place;
use crate::families::copies::WrittenAt;
use crate::prelude::*;

/// Maximum number of further places that a finding lists. The rest is only counted.
const MOST: usize = 5;

/// Findings about taken groups, each reported once. A fault in a library file counts once, however
/// often the group is taken. A fault of a value counts once, however many attributes get it.
#[derive(Default)]
pub struct Finds<'d> {
    all: Vec<Find<'d>>,
    known: HashMap<(Key, String), usize>,
    /// The places of each finding.
    places: HashSet<(usize, Key)>,
}

/// The document of a place, identified by the address of its path in memory, and the offset.
type Key = (usize, u32);

/// A finding, with all places where it applies.
pub struct Find<'d> {
    at: Spot<'d>,
    target: Place<'d>,
    there: &'static str,
    text: String,
    besides: Vec<(Place<'d>, String)>,
    more: Vec<Place<'d>>,
    /// Text for each of the further places.
    too: &'static str,
    /// Number of further places that are not listed.
    left: usize,
}

impl<'d> Find<'d> {
    /// Adds a place that is the same for all places of the finding.
    pub fn besides(&mut self, at: impl Into<Place<'d>>, there: impl Into<String>) {
        self.besides.push((at.into(), there.into()));
    }
}

impl<'d> Finds<'d> {
    /// Notes a fault of `target` in a library file; `at` takes its group. If the same text is
    /// already noted for the target, only the taking place is added and `None` is returned.
    pub fn brought(
        &mut self,
        at: Spot<'d>,
        target: Spot<'d>,
        there: &'static str,
        text: String,
    ) -> Option<&mut Find<'d>> {
        let find = Find::of(at, place(target), there, text, "it is also taken here");
        self.note(place(target), place(at), find)
    }

    /// Notes a fault of a whole file that `at` refers to.
    pub fn of_file(
        &mut self,
        at: Spot<'d>,
        document: Document<'d>,
        there: &'static str,
        text: String,
    ) -> Option<&mut Find<'d>> {
        let start = document.root().map_or(0, |root| root.offset());
        let target = Place::Text(document, start);
        let target = document.root().map_or(target, Place::Node);
        let find = Find::of(at, target, there, text, "it is also referred to here");
        self.note(target, place(at), find)
    }

    /// Notes a fault of a value that is written at `at` and set at `target` in a library file. If
    /// the same text is already noted for the value, only the target is added.
    pub fn given(
        &mut self,
        at: Spot<'d>,
        target: Spot<'d>,
        there: &'static str,
        text: String,
    ) -> Option<&mut Find<'d>> {
        let find = Find::of(at, place(target), there, text, "it is also set here");
        self.note(place(at), place(target), find)
    }

    /// Notes a fault of a value that is written at `origin` and that an attribute in a library file
    /// gets.
    pub fn value(&mut self, origin: WrittenAt<'d>, target: Attribute<'d>, text: String) {
        let at = origin.attribute().into();
        self.given(at, target.into(), "the attribute that gets the value", text);
    }

    fn note(
        &mut self,
        anchor: Place<'d>,
        other: Place<'d>,
        find: Find<'d>,
    ) -> Option<&mut Find<'d>> {
        let anchor = key_of(anchor);
        let index = self.all.len();
        let known = self.known.entry((anchor, find.text.clone()));
        let known = *known.or_insert(index);
        if known == index {
            self.places
                .extend([(index, anchor), (index, key_of(other))]);
            self.all.push(find);
            return self.all.last_mut();
        }
        if self.places.insert((known, key_of(other)))
            && let Some(find) = self.all.get_mut(known)
        {
            match find.more.len() < MOST {
                true => find.more.push(other),
                false => find.left += 1,
            }
        }
        None
    }

    /// Reports all findings.
    pub fn say(self, found: &mut Sink<'_>) {
        for find in self.all {
            let mut finding = found
                .issue(place(find.at), find.text)
                .at(find.target, find.there);
            for (at, there) in find.besides {
                finding = finding.at(at, there);
            }
            let last = find.more.len().wrapping_sub(1);
            for (index, at) in find.more.into_iter().enumerate() {
                finding = match find.left {
                    left if left > 0 && index == last => {
                        finding.at(at, format!("{}, and at {}", find.too, further(left)))
                    }
                    _ => finding.at(at, find.too),
                };
            }
        }
    }
}

impl<'d> Find<'d> {
    fn of(
        at: Spot<'d>,
        target: Place<'d>,
        there: &'static str,
        text: String,
        too: &'static str,
    ) -> Find<'d> {
        Find {
            at,
            target,
            there,
            text,
            besides: Vec::new(),
            more: Vec::new(),
            too,
            left: 0,
        }
    }
}

fn further(places: usize) -> String {
    match places {
        1 => "1 further place".to_owned(),
        many => format!("{many} further places"),
    }
}

fn key_of(place: Place<'_>) -> Key {
    let (document, offset) = match place {
        Place::Node(node) => (node.document(), node.offset()),
        Place::Attribute(attribute) => (attribute.node().document(), attribute.offset()),
        Place::Text(document, offset) => (document, offset),
    };
    (document.path().as_ptr() as usize, offset)
}
