use crate::families::signals::Controllers;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for controller in Controllers::of(scenario).all {
        match (controller.has("delay"), controller.has("reference")) {
            (true, false) => delay_alone(controller, found),
            (false, true) => {
                let text = "the controller has a `reference` to another controller but no `delay`; both are \
                            required together, because the time shift between them is undefined without a delay";
                found
                    .about(controller, "reference", text)
                    .level(Level::Warning);
            }
            _ => {}
        }
    }
}

fn delay_alone(controller: Element<'_, '_>, found: &mut Sink<'_>) {
    // A controller without a reference has no delay.
    let Some(delay) = controller.number("delay").filter(|delay| *delay != 0.0) else {
        return;
    };
    let text = format!(
        "the controller has a `delay` of {delay} s but no `reference`; the delay counts from the first phase of \
         the controller that `reference` names, so it has no effect"
    );
    found.about(controller, "delay", text);
}
