use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Information,
    params: &[FASTEST],
    run,
    ..Rule::after(READABLE)
};

/// Elements whose `value` is a speed in m/s.
const SPEEDS: &[&str] = &["AbsoluteTargetSpeed", "AbsoluteSpeed", "SpeedCondition"];

/// Speed from which a value means "as fast as possible", in any unit.
const UNLIMITED: f64 = 1e4;

const FASTEST: Param = Param::number(
    "fastest",
    70.0,
    "m/s",
    "largest plausible speed; a higher one may be in another unit",
);

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let fastest = found.number(&FASTEST);
    for name in SPEEDS {
        for element in scenario.elements_everywhere(name) {
            let speed = element.number("value");
            let Some(speed) =
                speed.filter(|speed| speed.abs() > fastest && speed.abs() < UNLIMITED)
            else {
                continue;
            };
            let text = format!(
                "the value of `{name}` is {} m/s, which is {:.0} km/h; speeds are in m/s; {} km/h would be {:.1} \
                 m/s",
                short(speed),
                speed * 3.6,
                short(speed),
                speed / 3.6
            );
            found.about(element, "value", text);
        }
    }
}

/// Formats a number with at most three decimals.
fn short(number: f64) -> String {
    let rounded = (number * 1000.0).round() / 1000.0;
    rounded.to_string()
}
