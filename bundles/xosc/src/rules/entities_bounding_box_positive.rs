use crate::families::catalogs;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for kind in ["Vehicle", "Pedestrian"] {
        for object in scenario.elements_everywhere(kind) {
            let Some(dimensions) = object.path(&["BoundingBox", "Dimensions"]) else {
                continue;
            };
            let names = ["length", "width", "height"].into_iter();
            let flat: Vec<&str> = names
                .filter(|name| dimensions.number(name) == Some(0.0))
                .collect();
            let Some(first) = flat.first() else {
                continue;
            };
            let text = format!(
                "the bounding box of this `{kind}` is 0 in {}; distances and collisions are computed from it",
                catalogs::listed(flat.iter().copied())
            );
            found.about(dimensions, first, text);
        }
    }
}
