use crate::families::signals::Controllers;
use crate::prelude::*;

pub static RULE: Rule<Scene> = Rule {
    id: "check_qcbus_xosc_signal_zero_cycle",
    uids: &["qcbus.dev:xosc:1.0.0:signal.zero_cycle"],
    level: Level::Warning,
    after: super::READABLE,
    page: include_str!("signal_zero_cycle.md"),
    run,
    ..Rule::DEFAULTS
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
