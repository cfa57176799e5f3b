use crate::prelude::*;
use foldhash::HashSet;
use qcbus_openscenario::Selection;

pub const RULE: Rule<Scene> = Rule {
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let entities = scenario.entities();
    let all_known = entities
        .objects()
        .iter()
        .all(|one| one.kind() != EntityKind::Unknown);
    let mut said: HashSet<&str> = HashSet::default();
    for selection in entities.selections() {
        let element = selection.element(scenario);
        let Some(members) = element.child("Members") else {
            continue;
        };
        if members.children().next().is_none() {
            let text = format!("the selection `{}` has no members", selection.name());
            found.issue(members.node(), text).level(Level::Warning);
            continue;
        }
        if let Some(way) = way_back(scenario, selection)
            && !way.iter().any(|name| said.contains(name))
        {
            let chain: Vec<String> = way.iter().map(|name| format!("`{name}`")).collect();
            said.extend(way);
            let text = format!(
                "the selection contains itself: {} in `{}`",
                chain.join(" in "),
                selection.name()
            );
            found.about(element, "name", text);
        }
        for by_type in members.children_named("ByType") {
            let Some(wanted) = by_type.word("objectType") else {
                continue;
            };
            let kind = kind_of(&wanted);
            let mut objects = entities.objects().iter();
            if all_known && kind.is_some_and(|kind| !objects.any(|one| one.kind() == kind)) {
                let text = format!("no entity of the scenario has the type `{wanted}`");
                found
                    .about(by_type, "objectType", text)
                    .level(Level::Warning);
            }
        }
    }
}

/// Returns the selections by which a selection leads back to itself, the innermost first.
fn way_back<'m>(scenario: &'m Scenario<'_>, from: &'m Selection<'_>) -> Option<Vec<&'m str>> {
    let entities = scenario.entities();
    let mut before: Vec<(&str, usize)> = vec![(from.name(), 0)];
    let mut seen: HashSet<&str> = HashSet::default();
    let mut at = 0;
    while let Some((name, _)) = before.get(at) {
        let selection = entities.selection(name);
        for member in selection.into_iter().flat_map(Selection::members) {
            if member == from.name() {
                let mut way = vec![member];
                let mut step = at;
                while step > 0 {
                    let (name, back) = before.get(step)?;
                    way.push(name);
                    step = *back;
                }
                return Some(way);
            }
            let is_object = entities.object(member).is_some();
            if !is_object && entities.selection(member).is_some() && seen.insert(member) {
                before.push((member, at));
            }
        }
        at += 1;
    }
    None
}

fn kind_of(object_type: &str) -> Option<EntityKind> {
    Some(match object_type {
        "vehicle" => EntityKind::Vehicle,
        "pedestrian" => EntityKind::Pedestrian,
        "miscellaneous" => EntityKind::MiscObject,
        _ => return None,
    })
}
