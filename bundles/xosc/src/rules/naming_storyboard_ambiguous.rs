use qcbus_openscenario::{Scenario, StoryElement, StoryKind};
use qcbus_sdk::{Level, Rule, Sink};

use crate::families::references::quoted;
use crate::model::{About, Scene};

pub static RULE: Rule<Scene> = Rule {
    id: "check_qcbus_xosc_naming_storyboard_ambiguous",
    uids: &["qcbus.dev:xosc:1.0.0:naming.storyboard_ambiguous"],
    level: Level::Warning,
    after: super::READABLE,
    page: include_str!("naming_storyboard_ambiguous.md"),
    run,
    ..Rule::DEFAULTS
};

fn run<'d>(scenario: &Scenario<'d>, found: &mut Sink<'_>) {
    let storyboard = scenario.storyboard();
    for condition in scenario.elements_everywhere("StoryboardElementStateCondition") {
        let (Some(name), Some(word)) = (
            condition.text("storyboardElementRef"),
            condition.word("storyboardElementType"),
        ) else {
            continue;
        };
        let Some(kind) = StoryKind::of_word(&word) else {
            continue;
        };
        let mut meant = storyboard.find(&name);
        meant.retain(|element| element.kind() == kind);
        let [first, _, ..] = meant.as_slice() else {
            continue;
        };
        // A maneuver of a catalog that is used twice means itself each time.
        let own = condition
            .ancestor("Maneuver")
            .filter(|own| own.reference().is_some());
        let is_own = |one: &&&StoryElement<'d>| {
            let element = one.element(scenario);
            own.is_some() && (Some(element) == own || element.ancestor("Maneuver") == own)
        };
        if meant.iter().filter(is_own).count() == 1 {
            continue;
        }
        let parent = first
            .parent()
            .and_then(|parent| storyboard.elements().get(parent));
        let longer = parent.and_then(|parent| parent.name()).map(|parent| {
            let leaf = first.name().unwrap_or("");
            format!(", as in `{parent}::{leaf}`")
        });
        let text = format!(
            "{} elements of type `{word}` are called {}; which is meant is up to the simulator, unless the \
             names of the elements around it stand before it{}",
            meant.len(),
            quoted(condition, "storyboardElementRef", &name),
            longer.unwrap_or_default()
        );
        let mut finding = found.about(condition, "storyboardElementRef", text);
        for element in meant.iter().take(4) {
            finding = finding.at(element.element(scenario).node(), "one of this name");
        }
    }
}
