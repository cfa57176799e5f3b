use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Information,
    params: &[SPEED, ACCELERATION],
    run,
    ..Rule::after(READABLE)
};

const SPEED: Param = Param::number(
    "speed",
    150.0,
    "m/s",
    "largest plausible `maxSpeed`; a greater value is considered a value in km/h or a placeholder",
);
const ACCELERATION: Param = Param::number(
    "acceleration",
    20.0,
    "m/s²",
    "largest plausible `maxAcceleration` or `maxDeceleration`; a greater value is considered a placeholder",
);

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let (speed, acceleration) = (found.number(&SPEED), found.number(&ACCELERATION));
    let limits = [
        ("maxSpeed", speed, "m/s"),
        ("maxAcceleration", acceleration, "m/s²"),
        ("maxDeceleration", acceleration, "m/s²"),
    ];
    for performance in scenario.elements_everywhere("Performance") {
        let above = limits.iter().filter_map(|(name, most, unit)| {
            let value = performance.number(name).filter(|value| value > most)?;
            Some((
                *name,
                format!("`{name}` is {value} {unit}, more than {most} {unit}"),
            ))
        });
        let above: Vec<(&str, String)> = above.collect();
        let Some((first, _)) = above.first() else {
            continue;
        };
        let texts: Vec<&str> = above.iter().map(|(_, text)| text.as_str()).collect();
        let text = format!(
            "{}; no road vehicle reaches that, so the limit has no effect",
            texts.join(", and ")
        );
        found.about(performance, first, text);
    }
}
