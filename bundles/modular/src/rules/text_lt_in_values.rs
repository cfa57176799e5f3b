use std::collections::HashSet;

use crate::assembly::{Assembly, Modular, place};
use crate::families::copies::taken_at;
use crate::families::finds::Finds;
use crate::prelude::*;

pub const RULE: Rule<Modular> = Rule {
    level: Level::Warning,
    run,
    ..Rule::DEFAULTS
};

fn run(assembly: &Assembly<'_>, found: &mut Sink<'_>) {
    let root = assembly.root();
    let references = &assembly.expansion.references;
    let refers = root.elements("ScenarioReference").next().is_some();
    let as_a_whole = refers || assembly.subject.kind() == FileKind::Mosc;
    let tops: Vec<Node<'_>> = match as_a_whole {
        true => root.root().into_iter().collect(),
        // Only the groups of a library file are taken.
        false => root.elements("ManeuverGroup").collect(),
    };
    for top in tops {
        look(top, &mut |spot, text| {
            found.issue(place(spot), text);
        });
    }
    // A file with references is written as a whole. From other files only groups are written.
    let whole: HashSet<usize> = references.iter().map(|reference| reference.piece).collect();
    let mut finds = Finds::default();
    let mut looked: HashSet<(usize, u32)> = HashSet::new();
    for reference in references {
        let at = Spot::of(reference.node, "scenarioFileName");
        if let Some(target) = reference.target.filter(|target| whole.contains(target)) {
            let all = assembly.piece(target).root().filter(|_| target != 0);
            let all = all.filter(|all| looked.insert((target, all.index())));
            all.into_iter().for_each(|all| bring(all, at, &mut finds));
        }
        for one in &reference.uses {
            for copy in one
                .copies
                .iter()
                .filter(|copy| !whole.contains(&copy.piece))
            {
                let key = (copy.piece, copy.group.index());
                if looked.insert(key) {
                    bring(copy.group, taken_at(reference, one), &mut finds);
                }
            }
        }
    }
    finds.say(found);
}

fn bring<'d>(top: Node<'d>, at: Spot<'d>, finds: &mut Finds<'d>) {
    look(top, &mut |spot, text| {
        finds.brought(at, spot, "where it is written", text);
    });
}

/// Searches for `<` in the values and texts of an element and its descendants.
fn look<'d>(top: Node<'d>, say: &mut impl FnMut(Spot<'d>, String)) {
    const AND: &str = "the reference tool writes it as an unescaped `<`, and the resulting file is not valid \
                       XML; use other words (`less than`, `below`)";
    let document = top.document();
    for index in top.index()..top.subtree_end() {
        let Some(node) = document.node(index) else {
            return;
        };
        if !node.is_element() {
            if let Some(around) = node.parent().filter(|_| escapes(document, node)) {
                say(
                    around.into(),
                    format!("the text of `{}` has a `<`: {AND}", around.name()),
                );
            }
            continue;
        }
        for attribute in node.attributes() {
            // An attribute value cannot contain an unescaped `<`, so it was escaped.
            if attribute.value().contains('<') {
                let (name, element) = (attribute.name(), node.name());
                say(
                    attribute.into(),
                    format!("`{name}` of `{element}` has a `<`: {AND}"),
                );
            }
        }
    }
}

/// Checks whether a run of characters has a `<` outside of CDATA sections, which are kept.
fn escapes(document: Document<'_>, run: Node<'_>) -> bool {
    if !run.character_run().contains('<') {
        return false;
    }
    let range = run.character_range();
    let mut sources = document.sources();
    let holds = |start: u32, len: u32| range.start >= start && range.end <= start + len;
    let Some(source) = sources.find(|source| holds(source.start, source.len)) else {
        return false;
    };
    let at = |offset: u32| (offset - source.start) as usize;
    let text = document.source_text(&source);
    let mut rest = text.get(at(range.start)..at(range.end)).unwrap_or("");
    while let Some((before, after)) = rest.split_once("<![CDATA[") {
        if is_escaped(before) {
            return true;
        }
        rest = after.split_once("]]>").map_or("", |(_, after)| after);
    }
    is_escaped(rest)
}

fn is_escaped(written: &str) -> bool {
    let written = written.to_ascii_lowercase();
    let mut references = written
        .split('&')
        .skip(1)
        .filter_map(|rest| rest.split(';').next());
    references.any(|name| match name.strip_prefix('#') {
        None => name == "lt",
        Some(number) => match number.strip_prefix('x') {
            Some(hex) => hex.trim_start_matches('0') == "3c",
            None => number.trim_start_matches('0') == "60",
        },
    })
}
