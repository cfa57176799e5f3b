use crate::families::positions::shown;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for nurbs in scenario.elements_everywhere("Nurbs") {
        let knots: Vec<_> = nurbs.children_named("Knot").collect();
        let falls = knots.windows(2).filter_map(|pair| match pair {
            [one, two] => {
                let (before, after) = one.number("value").zip(two.number("value"))?;
                (after < before).then_some((*one, *two, before, after))
            }
            _ => None,
        });
        let falls: Vec<_> = falls.collect();
        // A fall back to the start makes every later knot wrong. The first one must be fixed.
        let Some((one, two, before, after)) = falls.first() else {
            continue;
        };
        let text = format!(
            "the knot {} follows the knot {before}; the knots of a NURBS must not decrease",
            shown(*two, "value", &after.to_string())
        );
        let place = Place::attribute_or_node(one.node(), "value");
        found
            .about(*two, "value", text)
            .at(place, "the knot before it");
    }
}
