use crate::families::references::quoted;
use crate::prelude::*;
use foldhash::{HashMap, HashMapExt as _, HashSet, HashSetExt as _};

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    versions: "1.0.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let placed = placed(scenario);
    let mut deleted: HashSet<String> = HashSet::new();
    for action in scenario.elements_everywhere("EntityAction") {
        if action.child("DeleteEntityAction").is_some() {
            // Any entity may be deleted if the name is unknown.
            let Some(name) = action.text("entityRef") else {
                return;
            };
            deleted.extend(members(scenario, &name));
        }
    }
    for action in scenario.elements_everywhere("EntityAction") {
        let added = action.child("AddEntityAction").is_some() && action.ancestor("Init").is_none();
        let Some(name) = action.text("entityRef").filter(|_| added) else {
            continue;
        };
        let Some(teleport) = placed.get(&*name).filter(|_| !deleted.contains(&*name)) else {
            continue;
        };
        let text = format!(
            "{} is added, but it exists from the start: `Init` places it and nothing deletes it; remove one of \
             the two actions, or delete the entity first",
            quoted(action, "entityRef", &name)
        );
        found
            .about(action, "entityRef", text)
            .at(teleport.node(), "the action that places it");
    }
}

/// Returns the entities that `Init` places, with the elements that place them.
fn placed<'m, 'd>(scenario: &'m Scenario<'d>) -> HashMap<String, Element<'m, 'd>> {
    let mut placed = HashMap::new();
    let actions = scenario.root().path(&["Storyboard", "Init", "Actions"]);
    let privates = actions
        .into_iter()
        .flat_map(|actions| actions.children_named("Private"));
    for private in privates {
        let Some(name) = private.text("entityRef") else {
            continue;
        };
        let teleport = private
            .children_named("PrivateAction")
            .find_map(|action| action.child("TeleportAction"));
        if let Some(teleport) = teleport {
            for member in members(scenario, &name) {
                placed.entry(member).or_insert(teleport);
            }
        }
    }
    placed
}

/// Returns the names of the scenario objects that a name stands for.
fn members(scenario: &Scenario<'_>, name: &str) -> Vec<String> {
    match scenario.entities().expand(name) {
        Some(entities) => entities.iter().map(|one| one.name().to_owned()).collect(),
        None => vec![name.to_owned()],
    }
}
