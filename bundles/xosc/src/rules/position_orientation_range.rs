use crate::families::positions::shown;
use crate::prelude::*;
use foldhash::{HashSet, HashSetExt as _};

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    params: &[TURNS],
    run,
    ..Rule::after(READABLE)
};

const TURNS: Param = Param::number(
    "turns",
    1.0,
    "",
    "largest angle in full turns; up to twice as much is reported as information; in a trajectory, where \
     headings may accumulate, up to five times as much is accepted",
);

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    // The tolerance accepts 6.284, a full turn rounded to three digits.
    let most = found.number(&TURNS) * std::f64::consts::TAU + 1e-3;
    let mut said = HashSet::new();
    for name in ["WorldPosition", "Orientation"] {
        for element in scenario.elements_everywhere(name) {
            let far = ["h", "p", "r"].into_iter().find_map(|angle| {
                let value = element.number(angle)?;
                (value.abs() > most).then_some((angle, value))
            });
            let Some((angle, value)) = far else { continue };
            if let Some(trajectory) = element.ancestor("Trajectory") {
                let key = (
                    trajectory.node().document().path(),
                    trajectory.node().index(),
                );
                // Thousands of vertices may have the same fault, so only the first one is reported.
                if value.abs() <= 5.0 * most || !said.insert(key) {
                    continue;
                }
            }
            // Accumulated angles may be a little more than a full turn.
            let level = if value.abs() > 2.0 * most {
                Level::Warning
            } else {
                Level::Information
            };
            say(element, angle, value, level, found);
        }
    }
}

fn say(element: Element<'_, '_>, angle: &str, value: f64, level: Level, found: &mut Sink<'_>) {
    let four_digits = |value: f64| (value * 1e4).round() / 1e4;
    let rounded = four_digits(value);
    let meant = match level {
        Level::Warning => format!(
            "if {rounded} degrees are meant, write {}",
            four_digits(value.to_radians())
        ),
        _ => format!(
            "{} rad is the same direction",
            four_digits(value % std::f64::consts::TAU)
        ),
    };
    let text = format!(
        "`{angle}` of `{}` is {} rad, which is more than a full turn (6.2832 rad); {meant}",
        element.name(),
        shown(element, angle, &rounded.to_string())
    );
    found.about(element, angle, text).level(level);
}
