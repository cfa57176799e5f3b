use crate::families::minsubset;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Information,
    versions: "1.3.0..",
    default_on: false,
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for action in scenario.elements("FollowTrajectoryAction") {
        for shape in action.descendants_named("Shape") {
            minsubset::only(shape, &["Polyline"], found);
        }
        for reference in action.children_named("TimeReference") {
            minsubset::only(reference, &["Timing"], found);
        }
        for mode in action.children_named("TrajectoryFollowingMode") {
            word(mode, "followingMode", "position", found);
        }
        for timing in action.descendants_named("Timing") {
            word(timing, "domainAbsoluteRelative", "absolute", found);
            number(timing, "scale", 1.0, found);
            number(timing, "offset", 0.0, found);
        }
    }
}

fn word(element: Element<'_, '_>, attribute: &str, allowed: &str, found: &mut Sink<'_>) {
    if let Some(word) = element.word(attribute).filter(|word| word != allowed) {
        say(element, attribute, &word, allowed, found);
    }
}

fn number(element: Element<'_, '_>, attribute: &str, allowed: f64, found: &mut Sink<'_>) {
    if let Some(number) = element
        .number(attribute)
        .filter(|number| *number != allowed)
    {
        say(
            element,
            attribute,
            &number.to_string(),
            &allowed.to_string(),
            found,
        );
    }
}

fn say(element: Element<'_, '_>, attribute: &str, is: &str, allowed: &str, found: &mut Sink<'_>) {
    let text = format!(
        "`{attribute}` of `{}` is `{is}`, which is outside the minimum subset; only `{allowed}` is allowed",
        element.name()
    );
    found.issue(Place::attribute_or_node(element.node(), attribute), text);
}
