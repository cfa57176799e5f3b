//! Private actions of `Init`, in the order of the file.

use super::element::Element;
use super::scenario::Scenario;

/// A private action of `Init` and the entity that it is for.
pub struct InitAction<'m, 'd> {
    /// Name in `Private`, of an entity or a selection.
    pub named: String,
    /// Names of the entities behind it.
    pub entities: Vec<String>,
    /// Element with the name of the action, such as `SpeedAction`.
    pub action: Element<'m, 'd>,
}

/// Returns the private actions of `Init`. Those of unknown entities are left out.
pub fn init_actions<'m, 'd>(scenario: &'m Scenario<'d>) -> Vec<InitAction<'m, 'd>> {
    let mut found = Vec::new();
    let actions = scenario.root().path(&["Storyboard", "Init", "Actions"]);
    let privates = actions
        .into_iter()
        .flat_map(|actions| actions.children_named("Private"));
    for private in privates {
        let Some(named) = private.text("entityRef") else {
            continue;
        };
        let Some(entities) = scenario.entities().expand(&named) else {
            continue;
        };
        let names = entities.iter().map(|entity| entity.name().to_owned());
        let entities: Vec<String> = names.collect();
        for kind in private
            .children_named("PrivateAction")
            .flat_map(Element::children)
        {
            let Some(action) = inner(kind) else { continue };
            found.push(InitAction {
                named: named.clone().into_owned(),
                entities: entities.clone(),
                action,
            });
        }
    }
    found
}

/// Returns the action within its group.
fn inner<'m, 'd>(kind: Element<'m, 'd>) -> Option<Element<'m, 'd>> {
    match kind.name() {
        "LongitudinalAction" | "LateralAction" | "RoutingAction" => kind.children().next(),
        _ => Some(kind),
    }
}
