//! Start of entities: the actions of `Init` that place them.

use crate::queries::element::Element;
use crate::queries::scenario::Scenario;

/// A `TeleportAction` of `Init` for one entity.
pub struct Start<'m, 'd> {
    /// The entity.
    pub name: String,
    /// `WorldPosition` or a similar element.
    pub position: Element<'m, 'd>,
}

/// Returns the teleports of `Init` in document order. A selection gives one for each member.
pub fn starts<'m, 'd>(scenario: &'m Scenario<'d>) -> Vec<Start<'m, 'd>> {
    let mut starts = Vec::new();
    let actions = scenario.root().path(&["Storyboard", "Init", "Actions"]);
    let privates = actions
        .into_iter()
        .flat_map(|actions| actions.children_named("Private"));
    for private in privates {
        let name = private.text("entityRef");
        let Some(entities) = name.and_then(|name| scenario.entities().expand(&name)) else {
            continue;
        };
        for action in private.children_named("PrivateAction") {
            let position = action.path(&["TeleportAction", "Position"]);
            let Some(position) = position.and_then(|position| position.children().next()) else {
                continue;
            };
            starts.extend(entities.iter().map(|entity| Start {
                name: entity.name().to_owned(),
                position,
            }));
        }
    }
    starts
}
