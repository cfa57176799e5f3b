use crate::families::timeline::{self, differs};
use crate::families::triggers::edge_of_time;
use crate::prelude::*;
use qcbus_openscenario::Cause;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    versions: "1.0.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    timeline::each_cause(scenario, |_, never, cause| {
        let Cause::Over { at } = cause else { return };
        let Some(condition) = never.condition(at) else {
            return;
        };
        // Another rule reports an edge that never occurs.
        if edge_of_time(condition).is_some() {
            return;
        }
        let edge = condition.word("conditionEdge").unwrap_or_default();
        let what = match &*edge {
            "none" | "" => "the condition is true only before it is first looked at".to_owned(),
            edge => format!("the `{edge}` edge comes before the condition is first looked at"),
        };
        let text = format!("{what}; {}{}", never.so, differs(never));
        found
            .about(condition, "conditionEdge", text)
            .maybe_fault(timeline::start_of(condition));
    });
}
