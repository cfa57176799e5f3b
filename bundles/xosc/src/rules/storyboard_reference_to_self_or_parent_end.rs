use crate::families::states::{StateCondition, own_triggers};
use crate::families::triggers::called;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    versions: "1.0.0..",
    run,
    ..Rule::after(READABLE)
};

fn run<'d>(scenario: &Scenario<'d>, found: &mut Sink<'_>) {
    if scenario.form() != Form::Scenario {
        return;
    }
    for (owner, groups) in own_triggers(scenario) {
        let element = owner.element(scenario);
        let waits = |condition: &StateCondition<'_, 'd>| waits_for_itself(element, condition);
        let all = groups.iter().all(|group| group.iter().any(waits));
        for condition in groups.iter().flatten() {
            let itself = condition.target == element;
            if ends_around(element, condition) || (all && itself && waits(condition)) {
                say(element, condition, itself, found);
            }
        }
    }
}

/// Checks whether the condition cannot be true before the element starts.
fn waits_for_itself<'d>(element: Element<'_, 'd>, condition: &StateCondition<'_, 'd>) -> bool {
    let before = ["standbyState", "skipTransition"];
    (condition.target == element && !before.contains(&&*condition.state))
        || ends_around(element, condition)
}

/// Checks whether the condition waits for the end of an ancestor of this element. After this end,
/// no element in it starts.
fn ends_around<'d>(element: Element<'_, 'd>, condition: &StateCondition<'_, 'd>) -> bool {
    let over = ["completeState", "endTransition", "stopTransition"];
    over.contains(&&*condition.state)
        && element.ancestors().any(|around| around == condition.target)
}

fn say<'d>(
    element: Element<'_, 'd>,
    condition: &StateCondition<'_, 'd>,
    itself: bool,
    found: &mut Sink<'_>,
) {
    let state = &condition.state;
    let text = if itself {
        format!(
            "{} waits for its own `{state}` before it starts, which cannot happen first; it never starts",
            called(element)
        )
    } else {
        format!(
            "{} waits for the `{state}` of {}, which contains it; when that is complete, nothing in it starts \
             any more",
            called(element),
            called(condition.target)
        )
    };
    found
        .about(condition.element, "storyboardElementRef", text)
        .at(condition.target.node(), "the element that it waits for");
}
