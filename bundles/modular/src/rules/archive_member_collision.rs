use std::collections::{BTreeMap, BTreeSet};

use crate::assembly::{Archive, Assembly, Member, Modular};
use crate::prelude::*;
use qcbus_messages::path_text::name_of;

pub const RULE: Rule<Modular> = Rule {
    run,
    ..Rule::DEFAULTS
};

fn run(assembly: &Assembly<'_>, found: &mut Sink<'_>) {
    let archives: Vec<Archive<'_>> = assembly.archives().collect();
    let members: Vec<BTreeMap<&str, Member<'_>>> = archives.iter().map(members_of).collect();
    let below = below(assembly, &archives);
    let mut said = BTreeSet::new();
    for (outer, inner) in below {
        for (name, one) in &members[outer] {
            let is_other = |other: &&Member<'_>| (other.crc32, other.size) != (one.crc32, one.size);
            if members[inner].get(name).filter(is_other).is_none() {
                continue;
            }
            // In a cycle, each of two archives lies below the other. The pair is reported once.
            if said.insert((outer.min(inner), outer.max(inner), *name)) {
                say(assembly, found, [archives[outer], archives[inner]], name);
            }
        }
    }
}

/// Returns the scenarios that may collide. The main scenario is left out: every archive has one.
fn members_of<'d>(archive: &Archive<'d>) -> BTreeMap<&'d str, Member<'d>> {
    let is_scenario = |name: &str| name.ends_with(".xosc") || name.ends_with(".mosc");
    let members = archive.members().map(|member| (member.name, member));
    members
        .filter(|(name, _)| *name != MAIN && is_scenario(name))
        .collect()
}

const MAIN: &str = "main.xosc";

fn say(
    assembly: &Assembly<'_>,
    found: &mut Sink<'_>,
    [outer, inner]: [Archive<'_>; 2],
    name: &str,
) {
    let member = |archive: Archive<'_>| document(assembly, &format!("{}!{name}", archive.path));
    let text = format!(
        "`{name}` is in `{}` and, with other content, in `{}`, to which the first one refers; the reference tool \
         unpacks both into one folder, so the inner file replaces the outer one; give one of them another name",
        name_of(outer.path),
        name_of(inner.path),
    );
    let Some(main) = document(assembly, &format!("{}!{MAIN}", inner.path)) else {
        return;
    };
    let mut finding = assembly.say_of(found, (main, 0), text, "the inner archive");
    for (archive, what) in [
        (outer, "the member of the outer archive"),
        (inner, "the member of the inner archive"),
    ] {
        if let Some(member) = member(archive) {
            finding = finding.at((member, 0), what);
        }
    }
}

fn document<'d>(assembly: &Assembly<'d>, path: &str) -> Option<Document<'d>> {
    let mut scenarios = assembly.scenarios();
    scenarios.find(|document| document.path() == path)
}

/// Returns the pairs of an outer and an inner archive that are unpacked at the same time. The
/// scenarios of the outer archive lead to the inner one by any number of references.
fn below(assembly: &Assembly<'_>, archives: &[Archive<'_>]) -> BTreeSet<(usize, usize)> {
    let index: BTreeMap<&str, usize> = archives.iter().map(|it| it.path).zip(0..).collect();
    let mut next: Vec<BTreeSet<usize>> = vec![BTreeSet::new(); archives.len()];
    let pieces = &assembly.expansion.pieces;
    for piece in pieces {
        let from = archive_of(piece.document.path()).and_then(|path| index.get(path));
        let targets = piece
            .links
            .iter()
            .filter_map(|link| pieces.get(link.to as usize));
        for target in targets.map(|target| target.document.path()) {
            let to = target
                .strip_suffix(MAIN)
                .and_then(|path| index.get(path.strip_suffix('!')?));
            if let (Some(&from), Some(&to)) = (from, to) {
                next[from].insert(to);
            }
        }
    }
    let mut below = BTreeSet::new();
    for outer in 0..archives.len() {
        let mut open: Vec<usize> = next[outer].iter().copied().collect();
        while let Some(inner) = open.pop() {
            if inner != outer && below.insert((outer, inner)) {
                open.extend(&next[inner]);
            }
        }
    }
    below
}
