use crate::families::signals::Controllers;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let controllers = Controllers::of(scenario);
    for controller in &controllers.all {
        controllers.resolve(*controller, "reference", found);
    }
}
