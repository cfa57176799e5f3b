use std::collections::HashMap;

use crate::assembly::{Assembly, Modular, place};
use crate::families::copies::Taken;
use crate::prelude::*;

pub const RULE: Rule<Modular> = Rule {
    run,
    ..Rule::DEFAULTS
};

/// A group of the expanded scenario: a taken group or one of the root itself.
struct Bearer<'a, 'd> {
    name: &'a str,
    at: Spot<'d>,
    taken: Option<Taken<'a, 'd>>,
}

fn run(assembly: &Assembly<'_>, found: &mut Sink<'_>) {
    let mut taken: HashMap<u32, Vec<Taken<'_, '_>>> = HashMap::new();
    for one in assembly.taken() {
        taken
            .entry(one.reference.group.index())
            .or_default()
            .push(one);
    }
    for act in assembly.root().elements("Act") {
        let groups = act.children_named("ManeuverGroup");
        let mut first: HashMap<&str, Bearer<'_, '_>> = HashMap::new();
        for bearer in groups.flat_map(|group| bearers(group, taken.get(&group.index()))) {
            match first.get(bearer.name) {
                None => {
                    first.insert(bearer.name, bearer);
                }
                Some(other) if is_said_elsewhere(other, &bearer) => {}
                Some(other) => say(act, other, &bearer, found),
            }
        }
    }
}

fn bearers<'a, 'd>(group: Node<'d>, taken: Option<&'a Vec<Taken<'a, 'd>>>) -> Vec<Bearer<'a, 'd>>
where
    'd: 'a,
{
    let refers = group.child("ScenarioReference").is_some();
    let own = group.attr("name").filter(|_| !refers).map(|name| Bearer {
        name,
        at: Spot::of(group, "name"),
        taken: None,
    });
    let taken = taken.into_iter().flatten().map(|taken| Bearer {
        name: taken.copy.name(),
        at: taken.at(),
        taken: Some(*taken),
    });
    let named = |bearer: &Bearer<'_, '_>| !bearer.name.is_empty();
    own.into_iter().chain(taken).filter(named).collect()
}

/// Checks whether both groups come from the same referring group. Another rule reports those.
fn is_said_elsewhere(one: &Bearer<'_, '_>, other: &Bearer<'_, '_>) -> bool {
    let group = |bearer: &Bearer<'_, '_>| Some(bearer.taken?.reference.group.index());
    group(one).is_some() && group(one) == group(other)
}

fn say(act: Node<'_>, first: &Bearer<'_, '_>, second: &Bearer<'_, '_>, found: &mut Sink<'_>) {
    let referring = |bearer: &Bearer<'_, '_>| {
        let taken = bearer.taken?;
        Some(taken.reference.group.attr("name").unwrap_or("").to_owned())
    };
    let is_nameless = |one: &Option<String>| one.as_deref() == Some("");
    let advice = match (referring(first), referring(second)) {
        (one, other) if is_nameless(&one) || is_nameless(&other) => {
            match is_nameless(&one) && is_nameless(&other) {
                true => "neither referring group has a name: give them different ones".to_owned(),
                false => "a referring group has no name: give it one".to_owned(),
            }
        }
        (Some(one), Some(other)) if one == other => {
            format!("both referring groups are called `{one}`: give one of them another name")
        }
        (Some(one), None) | (None, Some(one)) => {
            format!("give the referring group `{one}` or the group beside it another name")
        }
        _ => "give one of the referring groups another name".to_owned(),
    };
    let text = format!(
        "two groups of the act `{}` are called `{}` in the expanded scenario, so neither can be referred to; \
         {advice}",
        act.attr("name").unwrap_or(""),
        second.name
    );
    let mut finding = found.issue(place(second.at), text);
    if let Some(taken) = &second.taken {
        finding = finding.at(
            place(Spot::of(taken.copy.group, "name")),
            "the group that is taken here",
        );
    }
    finding.at(place(first.at), "the first group of this name");
}
