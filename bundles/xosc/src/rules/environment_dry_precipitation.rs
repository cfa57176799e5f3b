use crate::families::references::quoted;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    versions: "1.0.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for precipitation in scenario.elements_everywhere("Precipitation") {
        if precipitation.word("precipitationType").as_deref() != Some("dry") {
            continue;
        }
        for name in ["precipitationIntensity", "intensity"] {
            let Some(value) = precipitation.number(name).filter(|value| *value > 0.0) else {
                continue;
            };
            let text = format!(
                "`precipitationType` is `dry`, but `{name}` is {}; a dry weather has the intensity 0; use `rain` or \
                 `snow`, or 0",
                quoted(precipitation, name, &value.to_string())
            );
            found.about(precipitation, name, text);
            break;
        }
    }
}
