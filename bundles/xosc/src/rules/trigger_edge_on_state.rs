use crate::families::actions::stated;
use crate::families::triggers;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Information,
    versions: "1.0.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for condition in scenario.elements_everywhere("Condition") {
        let Some(edge) = condition
            .word("conditionEdge")
            .filter(|edge| edge != "none")
        else {
            continue;
        };
        let time = triggers::time(condition).and_then(|time| of_time(time, &edge));
        let states = condition.path(&["ByValueCondition", "StoryboardElementStateCondition"]);
        let Some((level, text)) = time.or_else(|| of_state(states?, &edge)) else {
            continue;
        };
        found.about(condition, "conditionEdge", text).level(level);
    }
}

/// Checks the edge of a condition about time. Time starts at 0 and only increases.
fn of_time(time: Element<'_, '_>, edge: &str) -> Option<(Level, String)> {
    let value = time.number("value")?;
    let rule = time.word("rule")?;
    let wanted = stated(time, "value", value);
    match (edge, &*rule) {
        ("falling", "greaterThan" | "greaterOrEqual") => Some((
            Level::Warning,
            format!(
                "the time becomes greater than {wanted} s and stays so; a `falling` edge never occurs, only a \
                 `rising` one does"
            ),
        )),
        // The rule `trigger_never_true` reports smaller values.
        ("rising", "lessThan" | "lessOrEqual")
            if value > 0.0 || (value == 0.0 && &*rule == "lessOrEqual") =>
        {
            Some((
                Level::Warning,
                format!(
                    "the time is less than {wanted} s from the beginning; a `rising` edge never occurs, only a \
                     `falling` one does"
                ),
            ))
        }
        ("rising", "equalTo" | "greaterOrEqual") if value == 0.0 => Some((
            Level::Information,
            format!(
                "at {wanted} s the condition is true in the very first step, and there is no earlier step to \
                 rise from; strictly, the edge never occurs; use `conditionEdge=\"none\"`"
            ),
        )),
        _ => None,
    }
}

/// Checks the edge of a condition about a transition. A transition lasts for one step.
fn of_state(state: Element<'_, '_>, edge: &str) -> Option<(Level, String)> {
    let name = state.word("state")?;
    let transition = name.ends_with("Transition");
    let text = match edge {
        "falling" if transition => format!(
            "`{name}` lasts for one step, so its `falling` edge occurs only one step later; use `none` or \
             `rising`"
        ),
        "risingOrFalling" if transition => format!(
            "`{name}` lasts for one step; it rises and falls, so the condition is true in two successive steps; \
             use `none` or `rising`"
        ),
        _ => return None,
    };
    Some((Level::Information, text))
}
