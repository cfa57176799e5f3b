use crate::families::states::Waiting;
use crate::families::timeline;
use crate::families::triggers::called;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    versions: "1.0.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    if scenario.form() != Form::Scenario {
        return;
    }
    let elements = scenario.storyboard().elements();
    let named = |place: usize| {
        elements
            .get(place)
            .map_or_else(String::new, |one| called(one.element(scenario)))
    };
    for cycle in Waiting::of(scenario).cycles() {
        let Some(((first, condition), others)) = cycle.split_first() else {
            continue;
        };
        let rest: Vec<String> = others.iter().map(|(place, _)| named(*place)).collect();
        let text = match rest.as_slice() {
            [] => format!(
                "{} starts only after something within it has started, which cannot happen first; it never \
                 starts",
                named(*first)
            ),
            [other] => format!(
                "{} and {other} wait for each other; neither ever starts",
                named(*first)
            ),
            rest => format!(
                "{} waits for {}, which waits for the first of them; none of them ever starts",
                named(*first),
                chain(rest)
            ),
        };
        let mut finding = found
            .about(*condition, "storyboardElementRef", text)
            .maybe_fault(timeline::start_of(*condition));
        for (_, further) in others.iter().take(4) {
            finding = finding.at(further.node(), "the next element that waits");
        }
    }
}

/// Joins the names. The middle of a long list is left out.
fn chain(names: &[String]) -> String {
    const MOST: usize = 6;
    let join = |names: &[String]| names.join(", which waits for ");
    match (names.get(..MOST), names.last()) {
        (Some(shown), Some(last)) if names.len() > MOST + 1 => format!(
            "{}, and so on through {} more to {last}",
            join(shown),
            names.len() - MOST - 1
        ),
        _ => join(names),
    }
}
