use crate::families::placement::{self, Start};
use crate::prelude::*;
use foldhash::{HashMap, HashSet};

pub const RULE: Rule<Scene> = Rule {
    level: Level::Information,
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let starts = placement::starts(scenario);
    let mut first: HashMap<&str, usize> = HashMap::default();
    for (at, start) in starts.iter().enumerate() {
        first.entry(start.name.as_str()).or_insert(at);
    }
    let mut said: HashSet<&str> = HashSet::default();
    let mut done: HashSet<&str> = HashSet::default();
    for start in &starts {
        circle(start, &starts, &first, &mut done, &mut said, found);
    }
    for (at, start) in starts.iter().enumerate() {
        let Some(reference) = relative_to(start.position).filter(|name| *name != start.name) else {
            continue;
        };
        let later = first.get(reference.as_str()).filter(|later| **later > at);
        let Some(later) = later.and_then(|later| starts.get(*later)) else {
            continue;
        };
        // One action places all members of a selection.
        if said.contains(start.name.as_str()) || later.position == start.position {
            continue;
        }
        let text = format!(
            "`{}` is placed relative to `{reference}`, which is placed only later in the file; a simulator that \
             reads from top to bottom does not know its position yet",
            start.name
        );
        found
            .about(start.position, "entityRef", text)
            .at(later.position.node(), "the position of the other entity");
    }
}

/// Returns the entity that a position is relative to.
fn relative_to(position: Element<'_, '_>) -> Option<String> {
    let is_relative = position.name().starts_with("Relative");
    let name = position.text("entityRef").filter(|_| is_relative)?;
    Some(name.into_owned())
}

/// Reports entities with cyclic relative positions, which cannot be computed.
fn circle<'s, 'm, 'd>(
    start: &'s Start<'m, 'd>,
    starts: &'s [Start<'m, 'd>],
    first: &HashMap<&str, usize>,
    done: &mut HashSet<&'s str>,
    said: &mut HashSet<&'s str>,
    found: &mut Sink<'_>,
) {
    let mut way: Vec<&Start<'_, '_>> = Vec::new();
    let mut at = start;
    loop {
        if let Some(begin) = way.iter().position(|one| one.name == at.name) {
            let members = way.get(begin..).unwrap_or(&[]);
            said.extend(members.iter().map(|one| one.name.as_str()));
            // Another rule reports a position relative to the entity itself.
            if members.len() > 1 {
                say(members, found);
            }
            return;
        }
        if !done.insert(at.name.as_str()) {
            return;
        }
        way.push(at);
        let own_first = first
            .get(at.name.as_str())
            .and_then(|place| starts.get(*place));
        let next = own_first.and_then(|own| relative_to(own.position));
        let next = next.and_then(|name| starts.get(*first.get(name.as_str())?));
        match next {
            Some(next) => at = next,
            None => return,
        }
    }
}

fn say(members: &[&Start<'_, '_>], found: &mut Sink<'_>) {
    let Some((first, others)) = members.split_first() else {
        return;
    };
    let names: Vec<String> = members
        .iter()
        .map(|one| format!("`{}`", one.name))
        .collect();
    let text = format!(
        "{} and again `{}` are each placed relative to the next, so none of them has a position",
        names.join(", "),
        first.name
    );
    let mut finding = found
        .about(first.position, "entityRef", text)
        .level(Level::Error);
    for other in others {
        finding = finding.at(other.position.node(), "another of these positions");
    }
}
