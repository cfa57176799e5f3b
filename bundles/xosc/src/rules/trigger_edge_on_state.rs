use crate::families::timeline::keeps_running;
use crate::families::triggers::edge_of_time;
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
        // A run that never ends is reported as such.
        if keeps_running(scenario, condition) {
            continue;
        }
        let time = edge_of_time(condition).map(|no| match no.is_disputed {
            true => (Level::Information, no.why),
            false => (Level::Warning, no.why),
        });
        let states = condition.path(&["ByValueCondition", "StoryboardElementStateCondition"]);
        let Some((level, text)) = time.or_else(|| of_state(states?, &edge)) else {
            continue;
        };
        found.about(condition, "conditionEdge", text).level(level);
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
