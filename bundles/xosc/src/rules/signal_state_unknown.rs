use crate::prelude::*;
use foldhash::{HashMap, HashMapExt as _};

pub const RULE: Rule<Scene> = Rule {
    level: Level::Information,
    run,
    ..Rule::after(READABLE)
};

const WITH_STATE: &[&str] = &[
    "TrafficSignalState",
    "TrafficSignalStateAction",
    "TrafficSignalCondition",
    "TrafficSignalGroupState",
];

/// Words that simulators are known to understand, alone or combined.
const WORDS: &[&str] = &[
    "on",
    "off",
    "flashing",
    "blinking",
    "counting",
    "red",
    "yellow",
    "amber",
    "orange",
    "green",
    "blue",
    "white",
    "go",
    "stop",
    "caution",
    "attention",
    "walk",
    "dont",
    "dontwalk",
    "unknown",
    "other",
    "broken",
    "proceed",
    "black",
    "none",
    "true",
    "false",
    "solid",
    "solidon",
    "solidoff",
    "circle",
    "arrow",
    "left",
    "right",
    "up",
    "straight",
    "down",
    "lower",
    "upper",
    "cross",
    "pedestrian",
    "bicycle",
    "light",
    "turn",
    "bulb",
];

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let mut seen: HashMap<String, (Element<'_, '_>, usize)> = HashMap::new();
    let mut order = Vec::new();
    for name in WITH_STATE {
        for element in scenario.elements_everywhere(name) {
            let Some(state) = element.text("state") else {
                continue;
            };
            if is_known(&state) {
                continue;
            }
            if let Some((_, count)) = seen.get_mut(&*state) {
                *count += 1;
            } else {
                order.push(state.to_string());
                seen.insert(state.into_owned(), (element, 1));
            }
        }
    }
    for state in order {
        let Some((element, count)) = seen.get(&state) else {
            continue;
        };
        let often = match count {
            1 => String::new(),
            count => format!(", {count} times in this scenario"),
        };
        let text = if state.trim().is_empty() {
            format!(
                "`{}` has an empty `state`{often}; no signal can show it",
                element.name()
            )
        } else {
            format!(
                "`{}` has the state `{state}`{often}; the standard leaves the words to the road network and the \
                 simulator; this one is neither a colour nor a list of lights that are `on` or `off`",
                element.name()
            )
        };
        found.about(*element, "state", text);
    }
}

fn is_known(state: &str) -> bool {
    let apart = |letter: char| !letter.is_alphanumeric();
    let mut words = state
        .split(apart)
        .filter(|word| !word.is_empty())
        .peekable();
    words.peek().is_some()
        && words.all(|word| {
            let word = word.to_ascii_lowercase();
            WORDS.contains(&&*word) || word.bytes().all(|byte| byte.is_ascii_digit())
        })
}
