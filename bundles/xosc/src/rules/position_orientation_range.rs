use foldhash::{HashSet, HashSetExt as _};
use qcbus_openscenario::{Element, Scenario};
use qcbus_sdk::{Level, Param, Rule, Sink};

use crate::families::positions::shown;
use crate::model::{About as _, Scene};

pub static RULE: Rule<Scene> = Rule {
    id: "check_qcbus_xosc_position_orientation_range",
    uids: &["qcbus.dev:xosc:1.0.0:position.orientation_range"],
    level: Level::Warning,
    after: super::READABLE,
    params: &[TURNS],
    page: include_str!("position_orientation_range.md"),
    run,
    ..Rule::DEFAULTS
};

const TURNS: Param = Param::number(
    "turns",
    1.0,
    "",
    "so many full turns an angle may be; within a trajectory, where headings may go on counting, five times as many",
);

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    // Rounded to three digits, a full turn may be 6.284.
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
                // Thousands of vertices have the same fault: the first one is said.
                if value.abs() <= 5.0 * most || !said.insert(key) {
                    continue;
                }
            }
            say(element, angle, value, found);
        }
    }
}

fn say(element: Element<'_, '_>, angle: &str, value: f64, found: &mut Sink<'_>) {
    let rounded = (value * 1e4).round() / 1e4;
    let radians = (value.to_radians() * 1e4).round() / 1e4;
    let text = format!(
        "`{angle}` of `{}` is {} rad, which is more than a full turn (6.2832 rad); if {rounded} degrees are \
         meant, write {radians}",
        element.name(),
        shown(element, angle, &rounded.to_string())
    );
    found.about(element, angle, text);
}
