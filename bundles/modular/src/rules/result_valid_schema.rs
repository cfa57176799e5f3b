use std::collections::{HashMap, HashSet};

use crate::assembly::{Assembly, Modular};
use crate::families::copies::{Taken, short_name};
use crate::families::finds::Finds;
use crate::prelude::*;
use qcbus_messages::DocumentRole;
use qcbus_schema::{Checked, Code, Options, Outcome, Severity, Version, Violation};

pub const RULE: Rule<Modular> = Rule {
    run,
    ..Rule::DEFAULTS
};

fn run(assembly: &Assembly<'_>, found: &mut Sink<'_>) {
    let Some(own) = assembly.version_of(assembly.root()) else {
        return;
    };
    // If all files have the same version, a group is equally valid in both files.
    let is_other = |taken: Taken<'_, '_>| {
        let theirs = assembly.version_of(taken.copy.group.document());
        theirs.is_some_and(|theirs| theirs != own)
    };
    if !assembly.taken().any(is_other) {
        return;
    }
    let expanded = assembly.subject.with_role(DocumentRole::Expanded).next();
    let Some(expanded) = expanded.map(|expanded| expanded.document) else {
        return;
    };
    let Some(checked) = checked(&expanded) else {
        return;
    };
    let mut judge = Judge {
        own,
        groups: groups(assembly, expanded),
        libraries: HashMap::new(),
        first: HashMap::new(),
        finds: Finds::default(),
    };
    judge.later(&checked);
    judge.violations(&checked);
    judge.finds.say(found);
}

fn checked<'d>(document: &Document<'d>) -> Option<Checked<'d>> {
    match qcbus_schema::check(document, FileKind::Xosc, &Options::default()) {
        Outcome::Checked(checked) => Some(checked),
        Outcome::Skipped(_) => None,
    }
}

/// Returns the copied groups in the expanded scenario in document order, with their originals.
fn groups<'a, 'd>(
    assembly: &'a Assembly<'d>,
    expanded: Document<'d>,
) -> Vec<(Node<'d>, Taken<'a, 'd>)> {
    let mut taken: HashMap<u32, Vec<Taken<'_, '_>>> = HashMap::new();
    for one in assembly.taken() {
        taken
            .entry(one.reference.group.index())
            .or_default()
            .push(one);
    }
    let mut found = Vec::new();
    let mut groups = expanded.elements("ManeuverGroup");
    for group in assembly.root().elements("ManeuverGroup") {
        if group.child("ScenarioReference").is_none() {
            groups.next();
            continue;
        }
        for taken in taken.remove(&group.index()).unwrap_or_default() {
            match groups.next() {
                Some(copy) if copy.attr("name") == Some(taken.copy.name()) => {
                    found.push((copy, taken));
                }
                // With groups inside groups, copies cannot be matched to their originals.
                _ => return Vec::new(),
            }
        }
    }
    found
}

struct Judge<'a, 'd> {
    own: Version,
    groups: Vec<(Node<'d>, Taken<'a, 'd>)>,
    /// Violations in the files of pieces on their own.
    libraries: HashMap<usize, Option<HashSet<(u32, Code)>>>,
    /// First spot of each text, by piece and text.
    first: HashMap<(usize, String), Spot<'d>>,
    finds: Finds<'d>,
}

impl<'a, 'd> Judge<'a, 'd> {
    /// Notes parts that exist in the version of the library but not in that of the scenario.
    fn later(&mut self, checked: &Checked<'d>) {
        for thing in checked.later.iter().flat_map(|later| &later.things) {
            let name = thing.attribute.map(|attribute| attribute.name());
            for node in &thing.nodes {
                let attribute = name.and_then(|name| node.attribute(name));
                let Some((taken, spot)) = self.origin(*node, attribute) else {
                    continue;
                };
                let library = taken.copy.group.document();
                let theirs = qcbus_schema::version_of(&library, FileKind::Xosc);
                if theirs.is_none_or(|theirs| theirs < thing.since) {
                    continue;
                }
                let text = format!(
                    "{} in the group `{}` of `{}` exists since version {}, but this scenario is of version {}; \
                     name version {} here, or take a group without it",
                    thing.what,
                    taken.own_name(),
                    short_name(library),
                    thing.since,
                    self.own,
                    thing.since
                );
                self.note(taken, spot, text);
            }
        }
    }

    /// Notes violations of the scenario's version that are valid in the library's version.
    fn violations(&mut self, checked: &Checked<'d>) {
        for violation in &checked.violations {
            let is_new = !matches!(
                violation.code,
                // Other rules check names and keys better.
                Code::DuplicateKey | Code::MissingKey | Code::DanglingReference
            );
            if checked.severity(violation) != Severity::Error || !is_new {
                continue;
            }
            let Some((taken, spot)) = self.origin(violation.node, violation.attribute) else {
                continue;
            };
            let library = taken.copy.group.document();
            let theirs = qcbus_schema::version_of(&library, FileKind::Xosc);
            let Some(theirs) = theirs.filter(|theirs| *theirs != self.own) else {
                continue;
            };
            if self.is_own_fault(taken.copy.piece, library, spot, violation) {
                continue;
            }
            let text = format!(
                "the group `{}` of `{}` is written for version {theirs}, and is not valid in this scenario of \
                 version {}: {}",
                taken.own_name(),
                short_name(library),
                self.own,
                violation.text
            );
            self.note(taken, spot, text);
        }
    }

    /// Notes a fault at the first spot of its piece.
    fn note(&mut self, taken: Taken<'_, 'd>, spot: Spot<'d>, text: String) {
        let key = (taken.copy.piece, text.clone());
        let first = *self.first.entry(key).or_insert(spot);
        let there = "where the library file has it";
        self.finds.brought(taken.at(), first, there, text);
    }

    /// Returns the spot in the library for a part of a copied group, unless a key has set it.
    fn origin(
        &self,
        node: Node<'d>,
        attribute: Option<Attribute<'d>>,
    ) -> Option<(Taken<'a, 'd>, Spot<'d>)> {
        let index = node.index();
        let after = self
            .groups
            .partition_point(|(copy, _)| copy.index() <= index);
        let (copy, taken) = self.groups.get(after.checked_sub(1)?)?;
        if index >= copy.subtree_end() {
            return None;
        }
        let group = taken.copy.group;
        let own = group
            .document()
            .node(index - copy.index() + group.index())?;
        if own.name() != node.name() {
            return None;
        }
        let Some(attribute) = attribute else {
            return Some((*taken, own.into()));
        };
        let attribute = own.attribute(attribute.name())?;
        let is_given = taken.copy.edit(attribute).is_some();
        (!is_given).then(|| (*taken, attribute.into()))
    }

    /// Checks whether the library file has the fault in its own version, too.
    fn is_own_fault(
        &mut self,
        piece: usize,
        library: Document<'d>,
        spot: Spot<'d>,
        violation: &Violation<'_>,
    ) -> bool {
        let own = self.libraries.entry(piece).or_insert_with(|| {
            let checked = checked(&library)?;
            // The places of faults beyond the listed ones are unknown.
            let all = checked
                .violations
                .iter()
                .filter(|_| checked.rest.is_empty());
            let all: HashSet<(u32, Code)> = all.map(|one| (one.node.index(), one.code)).collect();
            (checked.rest.is_empty()).then_some(all)
        });
        own.as_ref()
            .is_none_or(|own| own.contains(&(spot.node().index(), violation.code)))
    }
}
