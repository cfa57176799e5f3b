use crate::families::signals::Controllers;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for controller in Controllers::of(scenario).all {
        let durations: Option<Vec<f64>> = controller
            .children_named("Phase")
            .map(|phase| phase.double("duration"))
            .collect();
        let Some(durations) = durations.filter(|durations| !durations.is_empty()) else {
            continue;
        };
        if durations.iter().all(|duration| *duration == 0.0) {
            let text = format!(
                "{} 0 s in total; a cycle without duration cannot be repeated",
                match durations.len() {
                    1 => "the only phase of the controller lasts".to_owned(),
                    count => format!("the {count} phases of the controller last"),
                }
            );
            found.issue(controller.node(), text);
        }
    }
}
